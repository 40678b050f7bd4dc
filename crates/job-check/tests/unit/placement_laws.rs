//! Laws of units and mountings: an implausible size names the likely unit, and a mounting
//! that nothing reaches names operation, axis and limit.

use crate::describe::describe_setup;
use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::Job;

/// Returns the lines of `check` for the patch job on a wavy sheet of 400 mm with its numbers
/// divided by `unit`, or its message.
fn verdict(unit: f64, settings: &[&str]) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 400.0 }).unwrap() {
        let bytes = if name.ends_with(".obj") { sheet(1.0 / unit) } else { bytes };
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    // As few passes as may be: none of them is planned.
    let wide = ["operations[0].tolerances.cusp_mm=20", "operations[0].tolerances.max_step_mm=20"];
    let settings: Vec<_> = wide.iter().chain(settings).map(|s| s.parse().unwrap()).collect();
    let job = Job::read_with(&folder.path().join("job.json"), &settings).unwrap();
    describe_setup(&job, 0).map(|lines| lines.join("\n")).map_err(|e| e.to_string())
}

/// Returns a sheet of 400 by 400 by 15 mm as an OBJ file, scaled.
fn sheet(by: f64) -> Vec<u8> {
    const N: usize = 16;
    let vertex = |k: usize| {
        let [u, v] = [k / (N + 1), k % (N + 1)].map(|i| i as f64 / N as f64);
        let z = 7.5 * (u * std::f64::consts::TAU).sin();
        format!("v {} {} {}\n", (400.0 * u - 200.0) * by, (400.0 * v - 200.0) * by, z * by)
    };
    let quad = |k: usize| {
        let a = k / N * (N + 1) + k % N + 1;
        format!("f {} {} {} {}\n", a, a + N + 1, a + N + 2, a + 1)
    };
    (0..(N + 1) * (N + 1)).map(vertex).chain((0..N * N).map(quad)).collect::<String>().into_bytes()
}

#[test]
fn check_tells_the_size_of_the_part_alone() {
    let lines = verdict(1.0, &[]).unwrap();
    assert!(lines.contains("the part is 400.0 x 400.0 x 15.0 mm: it lies in (-200.0, -200.0, -7.5) to"), "{lines}");
    assert!(!lines.contains("is the unit right"), "{lines}");
}

#[test]
fn metres_and_inches_that_are_read_as_mm_are_named_as_such() {
    let metres = verdict(1000.0, &[]).unwrap_err();
    assert!(metres.contains("400.0 mm in metres: is the unit right"), "{metres}");
    assert!(!metres.contains("direction of the strategy"), "{metres}");
    let inches = verdict(25.4, &[]).unwrap();
    assert!(inches.contains("400.0 mm in inches"), "{inches}");
    for (unit, scale) in [("metre", 1000.0), ("inch", 25.4)] {
        let reported = verdict(scale, &[&format!("setups[0].meshes[0].unit={unit}")]).unwrap();
        assert!(
            reported.contains("the part is 400.0 x 400.0 x 15.0 mm") && !reported.contains("is the unit right"),
            "{reported}"
        );
    }
}

#[test]
fn mm_that_are_read_as_inches_are_named_before_the_clearance() {
    let message = verdict(1.0, &["setups[0].meshes[0].unit=inch"]).unwrap_err();
    let [unit, clearance] = ["400.0 mm in millimetres: is the unit", "clearance surface"].map(|s| message.find(s));
    assert!(unit.is_some() && unit < clearance, "{message}");
}

#[test]
fn a_mounting_that_nothing_reaches_names_operation_axis_and_limit() {
    let at = |z: f64| verdict(1.0, &[&format!("setups[0].table_from_work={{\"translation_mm\":[0,0,{z}]}}")]);
    assert!(at(300.0).is_ok());
    let message = at(-900.0).unwrap_err();
    for part in ["setups[0].table_from_work: operation \"patch\" reaches none of", "axis Z", "limits are -350"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let message = at(-200.0).unwrap_err();
    assert!(message.contains("inside") && message.contains("raise the part"), "{message}");
}
