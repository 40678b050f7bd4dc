use crate::examples::new_job::{NewJob, new_job};
use crate::load::job::Job;

#[test]
fn a_cast_propeller_has_two_setups_and_a_casting_around_the_part() {
    let written = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&NewJob::CastPropeller { diameter_mm: 1000.0 }).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    let lines = (0..job.file.setups.len()).flat_map(|k| crate::check::describe_setup(&job, k).unwrap());
    let text = lines.collect::<Vec<_>>().join("\n");
    for needed in ["suction side up", "pressure side up", "casting.glb", "closed"] {
        assert!(text.contains(needed), "{needed}: {text}");
    }
    assert!(job.file.operations.iter().filter(|o| o.allowance_mm > 0.0).count() >= 4, "layers on both sides");
}

#[test]
fn a_diameter_that_the_tools_do_not_fit_is_refused() {
    for diameter_mm in [100.0, 5000.0, f64::NAN] {
        let why = new_job(&NewJob::CastPropeller { diameter_mm }).expect_err("refused");
        assert!(why.contains("from 800 to 1200 mm"), "{why}");
    }
}
