//! The JSON Schemas are the ones checked in, and every example obeys them.

use facemill::new_job::{NewJob, Series, new_job};
use facemill_tests::jobs::{small_patch, small_patch_planned, text_of};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::workspace;
use serde_json::{Value, json};

const FORMATS: [&str; 21] = [
    "job",
    "tool",
    "machine",
    "path",
    "dialect",
    "report",
    "certificates",
    "solution-space",
    "verification",
    "holders",
    "lengths",
    "rapids",
    "summary",
    "job-report",
    "paths",
    "strategies",
    "batch",
    "batch-report",
    "batch-tasks",
    "propeller",
    "post",
];

fn schema(format: &str) -> Value {
    let output = run(&["schema", format]);
    assert_eq!(code_and_errors(&output).0, 0);
    serde_json::from_slice(&output.stdout).expect("a schema is JSON")
}

/// Asserts that a file obeys the schema of a format.
pub(crate) fn check(format: &str, what: &str, file: &Value) {
    let validator = jsonschema::validator_for(&schema(format)).expect("a schema that is one");
    let faults: Vec<String> = validator.iter_errors(file).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(faults.is_empty(), "{what} against the schema of {format}: {}", faults.join("; "));
}

#[test]
fn schemas_are_the_ones_checked_in() {
    for format in FORMATS {
        let printed = run(&["schema", format]).stdout;
        let name = format!("docs/schemas/{format}.json");
        let kept = std::fs::read(workspace().join(&name)).unwrap_or_default();
        assert!(
            printed == kept,
            "{name} is not what `facemill schema {format}` prints; regenerate it: \
             cargo run --release -- schema {format} > {name}"
        );
    }
}

#[test]
fn every_example_obeys_its_schema() {
    let series = [
        Series::Dtmb4119,
        Series::Dtmb4382,
        Series::Vp1304,
        Series::WageningenB { blades: 5, area_ratio: 0.6, pitch_ratio: 1.1 },
    ];
    let mut examples: Vec<NewJob> =
        series.into_iter().map(|series| NewJob::Propeller { series, diameter_mm: 900.0 }).collect();
    examples.extend([NewJob::Patch { size_mm: 300.0 }, NewJob::Rotor37 { scale: 10.0 }]);
    for example in examples {
        for (name, bytes) in new_job(&example).unwrap() {
            if let Some(format) = name.strip_suffix(".json") {
                check(format, &format!("{name} of {example:?}"), &serde_json::from_slice(&bytes).unwrap());
            }
        }
    }
}

#[test]
fn every_committed_job_folder_obeys_the_schemas() {
    let mut n = 0;
    for folder in std::fs::read_dir(workspace().join("assets")).unwrap().map(|e| e.unwrap().path()) {
        for format in FORMATS {
            if let Ok(bytes) = std::fs::read(folder.join(format!("{format}.json"))) {
                check(format, &format!("{} in {}", format, folder.display()), &serde_json::from_slice(&bytes).unwrap());
                n += 1;
            }
        }
    }
    assert!(n >= 3, "only {n} files");
}

#[test]
fn holder_files_obey_their_schema_and_are_holders() {
    let files: Vec<_> =
        std::fs::read_dir(workspace().join("assets/holders")).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(!files.is_empty());
    for path in files {
        let bytes = std::fs::read(&path).unwrap();
        check("holders", &path.display().to_string(), &serde_json::from_slice(&bytes).unwrap());
        facemill::tool_model::HolderLibrary::from_json(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}

/// Dialect files that a shop starts from.
#[test]
fn dialect_files_obey_their_schema_and_wrong_ones_do_not() {
    let folders = ["crates/nc-program/dialects", "assets/dialects"].map(|folder| workspace().join(folder));
    let files = folders.into_iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let files: Vec<_> =
        files.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "json")).collect();
    assert!(files.len() >= 9);
    let validator = jsonschema::validator_for(&schema("dialect")).unwrap();
    for path in files {
        let file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        check("dialect", &path.display().to_string(), &file);
        for (pointer, value) in [
            ("/words/rapid", Value::Null),
            ("/numbers/always_pont", json!(true)),
            ("/lines/numbering", json!("some")),
            ("/program/extension", json!(1)),
        ] {
            let mut wrong = file.clone();
            facemill_tests::jobs::set(&mut wrong, pointer, value);
            assert!(!validator.is_valid(&wrong), "{}: {pointer}", path.display());
        }
    }
}

#[test]
fn a_report_obeys_its_schema_and_a_wrong_job_does_not() {
    let job = small_patch();
    check("report", "a report", &serde_json::from_str(&text_of(small_patch_planned(), "report.json")).unwrap());
    let validator = jsonschema::validator_for(&schema("job")).unwrap();
    assert!(validator.is_valid(&job.json("job.json")));
    for (pointer, value) in [
        ("/operations/0/tolerances/gauge_mm", json!(1.0)),
        ("/operations/0/direction", json!("sideways")),
        ("/setups/0/meshes/0/role", json!(7)),
        ("/tool", json!(7)),
    ] {
        let mut wrong = job.json("job.json");
        facemill_tests::jobs::set(&mut wrong, pointer, value);
        assert!(!validator.is_valid(&wrong), "{pointer}");
    }
}
