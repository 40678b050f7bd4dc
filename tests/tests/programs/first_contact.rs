//! First contact of a user: a folder for a job, another file in its place, values set for one run.

use std::collections::BTreeMap;

use facemill_tests::commands::facemill_in;
use facemill_tests::variants::tiny_patch;
use serde_json::{Value, json};

#[test]
fn a_folder_stands_for_the_job_in_it_and_another_file_is_called_by_its_format() {
    let f = tiny_patch();
    let folder = f.path("").display().to_string();
    let checked = facemill_in(&f, &format!("check {folder}"));
    assert!(checked.code == 0 && checked.printed.contains("job.json: job "), "{}{}", checked.errors, checked.printed);
    f.write("program.nc", b"%\nO1\nM30\n%\n");
    for (given, named) in [
        ("machine.json", "this is a machine file, not a job"),
        ("tool.json", "this is a tool file, not a job"),
        ("patch.obj", "this is a mesh, not a job"),
        ("program.nc", "this is an NC program by its name, not a job"),
    ] {
        let output = facemill_in(&f, &format!("plan {given}"));
        assert!(output.is_refused_for(&[given, named]), "{given}: {} {}", output.code, output.errors);
    }
    // Every command that takes a job says the same.
    let output = facemill_in(&f, "verify program.nc --job tool.json");
    assert!(output.is_refused_for(&["this is a tool file, not a job"]), "{}", output.errors);
    let output = facemill_in(&f, "verify program.nc");
    assert!(output.is_refused_for(&["--job", "--part"]), "{}", output.errors);
}

#[test]
fn a_value_set_for_one_run_is_read_as_strictly_as_the_file_and_named_in_errors() {
    let f = tiny_patch();
    let before = f.json("job.json");
    for (set, named) in [
        ("operations[0].tolerances.cusp=0.1", "did you mean `cusp_mm`"),
        ("operations[0].tolerances.cusp_mm=wide", "operations[0].tolerances.cusp_mm: invalid type"),
        ("/operations/0/tolerances/cusp_mm=-1", "operations[0].tolerances.cusp_mm: must be"),
        ("operations[7].name=x", "the list has 1"),
    ] {
        let output = facemill_in(&f, &format!("check job.json --set {set}"));
        assert!(output.is_refused_for(&["job.json: --set operations[", named]), "{set}: {}", output.errors);
    }
    let output = facemill_in(&f, "check job.json --set name=renamed --set /operations/0/name=side");
    assert!(
        output.code == 0 && output.prints(&["renamed"]) && output.prints(&["side"]),
        "{}{}",
        output.errors,
        output.printed
    );
    assert_eq!(f.json("job.json"), before, "the file is as it was");
}

/// Checksums of the files that a report was made from.
fn inputs(report: &Value) -> BTreeMap<String, String> {
    let all = report["made_from"]["inputs"].as_array().unwrap();
    let sums = all.iter().map(|i| (i["file"].as_str().unwrap().to_owned(), i["blake3"].as_str().unwrap().to_owned()));
    let sums: BTreeMap<String, String> = sums.collect();
    assert!(sums.values().all(|sum| sum.len() == 64 && sum.chars().all(|c| c.is_ascii_hexdigit())), "{sums:?}");
    sums
}

/// A plan printed as JSON follows its schema and prints nothing else; `--quiet` prints nothing, and
/// the report lists the values set.
#[test]
fn a_plan_tells_its_summary_as_json_or_nothing() {
    let f = tiny_patch();
    let output =
        facemill_in(&f, &format!("plan job.json --no-verify --json --set name=set --out {}", f.path("a").display()));
    assert_eq!(output.code, 0, "{}", output.errors);
    let summary: Value = serde_json::from_str(&output.printed).expect("JSON and nothing else");
    let schema: Value = serde_json::from_str(&facemill_in(&f, "schema summary").printed).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let faults: Vec<String> = validator.iter_errors(&summary).map(|e| e.to_string()).collect();
    assert!(faults.is_empty(), "{faults:?}");
    let setup = &summary["setups"][0];
    assert_eq!((&summary["outcome"], &summary["exit_code"], &setup["job"]), (&json!("done"), &json!(0), &json!("set")));
    let report: Value = serde_json::from_slice(&std::fs::read(f.path("a/report.json")).unwrap()).unwrap();
    assert_eq!(report["settings"], json!([{ "key": "name", "value": "set" }]));
    for key in ["totals", "times", "worst", "remaining", "cusps", "wind_up"] {
        assert_eq!(setup[key], report[key], "{key}");
    }
    assert_eq!(setup["incomplete_because"], json!([]));
    let made_from = &report["made_from"];
    assert_eq!(
        (&made_from["tool"], &made_from["machine"]),
        (&f.json("tool.json")["name"], &f.json("machine.json")["name"])
    );
    assert_eq!(made_from["dialect"], "fanuc");
    let stamp = format!("program.nc blake3 {}", report["programs"][0]["blake3"].as_str().unwrap());
    for file in ["program.apt", "chips.svg", "solution-space.svg"] {
        let text = std::fs::read_to_string(f.path("a").join(file)).unwrap();
        assert!(text.contains(&stamp), "{file} does not name its program");
    }
    let timings: Value = serde_json::from_slice(&std::fs::read(f.path("a/timings.json")).unwrap()).unwrap();
    assert_eq!(timings["setups"][0]["programs"], report["programs"]);
    let before = inputs(&report);
    assert_eq!(before.keys().collect::<Vec<_>>(), ["job.json", "machine.json", "patch.obj", "tool.json"]);
    assert!(report["times"]["cutting_s"].as_f64().is_some_and(|s| s > 1.0), "{}", report["times"]);

    // A comment is no other part, and another file.
    f.write("patch.obj", &[b"# a comment\n", &std::fs::read(f.path("patch.obj")).unwrap()[..]].concat());
    let output = facemill_in(&f, &format!("plan job.json --no-verify --quiet --out {}", f.path("b").display()));
    assert!(
        output.code == 0 && output.printed.is_empty() && output.errors.is_empty(),
        "{}{}",
        output.printed,
        output.errors
    );
    let report: Value = serde_json::from_slice(&std::fs::read(f.path("b/report.json")).unwrap()).unwrap();
    let after = inputs(&report);
    let other: Vec<&String> = before.keys().filter(|file| before[*file] != after[*file]).collect();
    assert_eq!(other, ["patch.obj"]);
    let output = facemill_in(&f, "plan tool.json --quiet");
    assert!(output.is_refused_for(&["not a job"]), "{}", output.errors);
}

#[test]
fn an_example_is_for_the_requested_machine_and_control() {
    let f = tiny_patch();
    let dir = f.path("new").display().to_string();
    let output = facemill_in(&f, &format!("new patch {dir} --size-mm 100 --machine table-table-a-c --dialect haas"));
    assert_eq!(output.code, 0, "{}", output.errors);
    let checked = facemill_in(&f, &format!("check {dir}"));
    assert_eq!(checked.code, 0, "{}", checked.errors);
    let machine: Value = serde_json::from_slice(&std::fs::read(f.path("new/machine.json")).unwrap()).unwrap();
    assert!(machine["name"].as_str().unwrap().contains("A-C"), "{machine}");
    let job: Value = serde_json::from_slice(&std::fs::read(f.path("new/job.json")).unwrap()).unwrap();
    assert_eq!(job["post"]["dialect"], "haas");
    for (options, named) in [
        ("--machine dual-c-horizontal-xyzb", &["two heads", "propeller-dual"][..]),
        ("--size-mm 3000 --machine table-table-a-c", &["out of reach"]),
        ("--machine lathe", &["lathe", "table-table-a-c"]),
        ("--dialect klingon", &["klingon", "fanuc"]),
    ] {
        let output = facemill_in(&f, &format!("new patch {} {options}", f.path("refused").display()));
        assert!(
            output.is_refused_for(named) && !f.path("refused").exists(),
            "{options}: {} {}",
            output.code,
            output.errors
        );
    }
}

/// An error on another file in place of a program names its format, also where more of it follows
/// than is read.
#[test]
fn a_file_of_another_format_is_no_program() {
    let f = tiny_patch();
    let points = "[0,0,0],".repeat(20_000);
    f.write("long.json", format!("{{\"format\": \"facemill-path/1\", \"passes\": [{points}").as_bytes());
    for (given, named) in [
        ("job.json", "this is a job file, not an NC program"),
        ("machine.json", "this is a machine file, not an NC program"),
        ("tool.json", "this is a tool file, not an NC program"),
        ("long.json", "this is a path file, not an NC program"),
        ("patch.obj", "this is a mesh by its name, not an NC program"),
    ] {
        let output = facemill_in(&f, &format!("verify {given} --job job.json"));
        assert!(output.is_refused_for(&[given, named]), "{given}: {} {}", output.code, output.errors);
    }
}

/// A job that cannot be read leaves the files of an earlier plan as they are; a file in place of
/// the folder is refused before a plan.
#[test]
fn a_plan_that_cannot_begin_changes_nothing() {
    let f = tiny_patch();
    std::fs::create_dir(f.path("out")).unwrap();
    f.write("out/program.nc", b"%\n");
    f.write("plain", b"mine");
    let out = f.path("out").display().to_string();
    let output = facemill_in(&f, &format!("plan job.json --set operations[0].nosuch=1 --out {out}"));
    assert!(output.is_refused_for(&["nosuch"]), "{}", output.errors);
    let names: Vec<_> = std::fs::read_dir(f.path("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["program.nc"]);
    let output = facemill_in(&f, &format!("plan job.json --out {}", f.path("plain").display()));
    assert!(output.code == 3 && output.errors.contains("not a folder"), "{} {}", output.code, output.errors);
    assert_eq!(std::fs::read(f.path("plain")).unwrap(), b"mine");
}
