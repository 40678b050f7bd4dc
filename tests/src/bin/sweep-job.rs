//! Writes the job, tools and batch of `assets/batch` into a folder: 24 variants of a place on the
//! blade of a small propeller.

use std::path::PathBuf;
use std::process::ExitCode;

use facemill::file_format::to_json;
use facemill::files::write_all;
use facemill_tests::jobs::{JobFolder, set, small_propeller};
use serde_json::{Value, json};

/// The propeller of the tests, with its whole region in one rectangle of a blade.
fn job(folder: &JobFolder) -> Value {
    let mut job = folder.json("job.json");
    for (pointer, value) in [
        ("/name", json!("DTMB 4119, D 400 mm, a place on one blade")),
        ("/operations/0/pattern", Value::Null),
        ("/operations/0/entry", json!({ "shortest": { "radius_mm": 62.5, "angle_deg": 8.0, "straight_mm": 5.0 } })),
        ("/operations/0/exit", json!({ "shortest": { "radius_mm": 62.5, "angle_deg": 8.0, "straight_mm": 5.0 } })),
        ("/operations/0/tolerances/max_step_mm", json!(3.0)),
        ("/operations/0/path/strategy/width_rounds", json!(0)),
        (
            "/operations/0/path/strategy/region",
            json!({ "box": { "min_mm": [110, 40, -200], "max_mm": [160, 95, 200] } }),
        ),
        ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [1, 0, 0] } })),
        ("/verification", json!({ "cut_stock": false })),
    ] {
        set(&mut job, pointer, value);
    }
    job
}

/// The tool of the job with a smaller cutter.
fn smaller(tool: &Value) -> Value {
    let mut tool = tool.clone();
    for (pointer, value) in [
        ("/name", json!("face mill D12 r0.75")),
        ("/radius_mm", json!(6.0)),
        ("/dead_core_radius_mm", json!(3.5)),
        ("/body/sections/0/diameter_low_mm", json!(10.4)),
        ("/body/sections/0/diameter_high_mm", json!(9.0)),
        ("/holder/sections/0/diameter_low_mm", json!(9.0)),
    ] {
        set(&mut tool, pointer, value);
    }
    tool
}

fn batch() -> Value {
    let strategy = |label: &str, strategy: Value| json!({ "label": label, "settings": { "operations[0].path.strategy.strategy": strategy } });
    let cylinders =
        json!({ "cylindrical_sections": { "axis_direction": [0, 0, 1], "from_radius_mm": 110, "to_radius_mm": 190 } });
    json!({
        "format": "facemill-batch/1",
        "jobs": { "sweep": {
            "job": "job.json",
            "axes": [
                { "name": "tilt", "values": { "each": {
                    "key": "operations[0].search.tilt_deg", "values": [[2, 8], [5, 15], [10, 20]],
                } } },
                { "name": "tool", "values": { "labelled": [
                    { "label": "D20" },
                    { "label": "D12", "settings": {
                        "tool": "tool-12.json",
                        "operations[0].feeds.spindle_rpm": 4000,
                        "operations[0].feeds.cutting_mm_min": 2000,
                    } },
                ] } },
                { "name": "strategy", "values": { "labelled": [
                    strategy("planes across x", json!({ "parallel_planes": { "normal": [1, 0, 0] } })),
                    strategy("planes across y", json!({ "parallel_planes": { "normal": [0, 1, 0] } })),
                    strategy("cylinders", cylinders),
                    strategy("constant scallop", json!({ "constant_scallop": { "seed": "border" } })),
                ] } },
            ],
        } },
    })
}

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("sweep-job FOLDER");
        return ExitCode::from(2);
    };
    let propeller = small_propeller();
    let tool = propeller.json("tool.json");
    let json = |name: &str, file: &Value| (name.to_owned(), to_json(file).into_bytes());
    let mut all = vec![
        json("sweep.json", &batch()),
        json("job.json", &job(&propeller)),
        json("tool.json", &tool),
        json("tool-12.json", &smaller(&tool)),
    ];
    for name in ["machine.json", "propeller.glb"] {
        all.push((name.to_owned(), std::fs::read(propeller.path(name)).expect("a file of the job")));
    }
    match write_all(&folder, &all) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("sweep-job: {e}");
            ExitCode::from(3)
        }
    }
}
