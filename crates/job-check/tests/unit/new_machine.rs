use crate::new_machine::*;

const PATCH: NewJob = NewJob::Patch { size_mm: 120.0 };

#[test]
fn a_machine_takes_a_small_patch_or_says_why_not() {
    for name in ["table-table-a-c", "head-head-c-a"] {
        let files = new_job_for(&PATCH, Some(name), None).unwrap_or_else(|why| panic!("{name}: {why}"));
        let machine = &files.iter().find(|(file, _)| file == "machine.json").expect("a machine").1;
        assert_eq!(preset(name).map(str::as_bytes), Some(&machine[..]));
    }
    for (name, reason) in [("dual-c-horizontal-xzab", "two heads"), ("head-b-a-table-c-two-linear", "out of reach")] {
        let why = new_job_for(&PATCH, Some(name), None).expect_err(name);
        assert!(why.contains(name) && why.contains(reason), "{why}");
    }
}

#[test]
fn a_part_that_is_too_large_and_a_machine_that_is_not_there_are_refused_with_the_reason() {
    let large = NewJob::Patch { size_mm: 2500.0 };
    let why = new_job_for(&large, Some("table-table-a-c"), None).expect_err("too large");
    assert!(why.starts_with("on table-table-a-c: ") && why.contains("out of reach") && why.contains("axis "), "{why}");
    let why = new_job_for(&PATCH, Some("lathe"), None).expect_err("no such machine");
    assert!(why.contains("no machine \"lathe\"") && why.contains("head-head-c-a"), "{why}");
}

#[test]
fn every_control_can_be_requested() {
    for dialect in Dialect::ALL {
        let files = new_job_for(&PATCH, None, Some(dialect)).unwrap_or_else(|why| panic!("{}: {why}", dialect.name()));
        let job: Value =
            serde_json::from_slice(&files.iter().find(|(f, _)| f == "job.json").expect("a job").1).expect("JSON");
        assert_eq!(job["post"]["dialect"], json!(dialect));
    }
}
