use std::path::Path;

use facemill_tool_model::cl_from_cc;
use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::examples::new_job::{NewJob, Series, new_job};
use crate::setup::path::*;

/// Makes a changed patch job in a folder.
fn job_with(folder: &Path, rotation: &str, changes: &[(&str, Value)]) -> Job {
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 400.0 }).unwrap() {
        let bytes = match name.as_str() {
            "job.json" => changed(&bytes, changes),
            "tool.json" => changed(&bytes, &[("/spindle_rotation", json!(rotation))]),
            _ => bytes,
        };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    Job::read(&folder.join("job.json")).unwrap()
}

fn changed(bytes: &[u8], changes: &[(&str, Value)]) -> Vec<u8> {
    let mut file: Value = serde_json::from_slice(bytes).unwrap();
    for (pointer, value) in changes {
        *file.pointer_mut(pointer).unwrap() = value.clone();
    }
    serde_json::to_vec(&file).unwrap()
}

/// Writes two passes along x, 8 mm apart; the second lies to the left.
fn path_file(folder: &Path) {
    let points = |y: f64| (0..20).map(|k| [10.0 * f64::from(k) - 95.0, y, 0.0]).collect::<Vec<_>>();
    let passes: Vec<Value> = [-4.0, 4.0].into_iter().map(|y| json!({ "points_mm": points(y) })).collect();
    let file = json!({ "format": "facemill-path/1", "frame": "work", "passes": passes });
    std::fs::write(folder.join("path.json"), serde_json::to_vec(&file).unwrap()).unwrap();
}

/// Checks climb or not, and the lean of the axis, by the motion of a tooth: independent of any sign
/// convention of this crate.
///
/// Where the cutter is in the uncut stock, its teeth go against the feed when climb milling, with
/// it otherwise; and the axis leans to that side, so that the disc rises over the cut surface.
fn check(job: &Job, direction: &str, case: &str) {
    let setup = Setup::read(job, 0).unwrap();
    let laid = lay_operation(job, &setup, 0, &job.file.operations[0]).unwrap();
    assert!(laid.tasks.len() >= 2, "{case}");
    for pair in laid.tasks.windows(2) {
        let cc = &pair[0].pass.points[pair[0].pass.points.len() / 2];
        let nearest = |p: &&CcPoint| ((p.position - cc.position).norm() * 1e6) as u64;
        let next = pair[1].pass.points.iter().min_by_key(nearest).unwrap();
        let way = next.position - cc.position;
        let toward_uncut = (way - cc.feed.into_inner() * way.dot(&cc.feed)).normalize();
        check_point(job, &pair[0], cc, toward_uncut, direction, case);
    }
}

fn check_point(job: &Job, task: &LaidTask, cc: &CcPoint, toward_uncut: Vector3<f64>, direction: &str, case: &str) {
    let clockwise = job.tool.spindle_rotation() == facemill_tool_model::SpindleRotation::Clockwise;
    let posture = task.curve.end();
    assert!(posture.rotate.abs() > 1.0, "{case}");
    let cl = cl_from_cc(job.tool.cutter(), cc, posture);
    let spin: Vector3<f64> = cl.axis.into_inner() * if clockwise { -1.0 } else { 1.0 };
    let tooth = spin.cross(&toward_uncut);
    let against = tooth.dot(&cc.feed) < 0.0;
    assert_eq!(against, direction == "climb", "{case}");
    assert!(cl.axis.dot(&toward_uncut) > 0.1, "{case}: the axis leans away from the uncut stock");
}

#[test]
fn direction_and_spindle_decide_feed_and_lean_of_flows_and_spirals() {
    let end = |y: f64| json!({ "plane": { "origin_mm": [0, y, 0], "normal": [0, 1, 0] } });
    let flow = json!({ "flow": { "from": end(-200.0), "to": end(200.0) } });
    let rings = json!({ "axis_direction": [0, 0, 1], "from_radius_mm": 0, "to_radius_mm": 150 });
    let spiral = json!({ "spiral": { "cylindrical_sections": rings } });
    for direction in ["climb", "conventional"] {
        for order in ["increasing", "decreasing"] {
            let job = |folder: &Path, strategy: &Value| {
                let path = json!({ "strategy": { "strategy": strategy, "order": order } });
                let changes = [("/operations/0/direction", json!(direction)), ("/operations/0/path", path)];
                job_with(folder, "clockwise", &changes)
            };
            let folder = tempfile::tempdir().unwrap();
            check(&job(folder.path(), &flow), direction, &format!("flow {direction} {order}"));
            let folder = tempfile::tempdir().unwrap();
            let job = job(folder.path(), &spiral);
            let setup = Setup::read(&job, 0).unwrap();
            let laid = lay_operation(&job, &setup, 0, &job.file.operations[0]).unwrap();
            let [task] = laid.tasks.as_slice() else { panic!("{} passes", laid.tasks.len()) };
            let cc = &task.pass.points[task.pass.points.len() / 2];
            let out = cc.position.coords - cc.normal.into_inner() * cc.normal.dot(&cc.position.coords);
            let toward_uncut = if order == "increasing" { out } else { -out }.normalize();
            check_point(&job, task, cc, toward_uncut, direction, &format!("spiral {direction} {order}"));
        }
    }
}

#[test]
fn an_end_of_a_flow_that_is_no_border_is_named() {
    let end = |y: f64| json!({ "plane": { "origin_mm": [0, y, 0], "normal": [0, 1, 0] } });
    let flow = json!({ "flow": { "from": end(-200.0), "to": end(150.0) } });
    let folder = tempfile::tempdir().unwrap();
    let job =
        job_with(folder.path(), "clockwise", &[("/operations/0/path", json!({ "strategy": { "strategy": flow } }))]);
    let setup = Setup::read(&job, 0).unwrap();
    let e = lay_operation(&job, &setup, 0, &job.file.operations[0]).err().expect("no border there").to_string();
    assert!(e.contains("operations[0].path.strategy: flow.to: no border of the region lies within 0.05 mm"), "{e}");
}

#[test]
fn direction_and_spindle_decide_feed_and_lean() {
    for rotation in ["clockwise", "counterclockwise"] {
        for direction in ["climb", "conventional"] {
            for order in ["increasing", "decreasing"] {
                let folder = tempfile::tempdir().unwrap();
                let strategy = json!({ "parallel_planes": { "normal": [0, 1, 0] } });
                let path = json!({ "strategy": { "strategy": strategy, "order": order } });
                let changes = [("/operations/0/direction", json!(direction)), ("/operations/0/path", path)];
                let job = job_with(folder.path(), rotation, &changes);
                check(&job, direction, &format!("{rotation} {direction} {order}"));
            }
            let folder = tempfile::tempdir().unwrap();
            path_file(folder.path());
            let file = json!({ "file": { "file": "path.json", "max_distance_mm": 30, "uncut_side": "left" } });
            let changes = [("/operations/0/direction", json!(direction)), ("/operations/0/path", file)];
            let job = job_with(folder.path(), rotation, &changes);
            check(&job, direction, &format!("{rotation} {direction} from a file"));
        }
    }
}

#[test]
fn edge_fill_lays_less_length_over_a_blade() {
    let folder = tempfile::tempdir().unwrap();
    let propeller = NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 1000.0 };
    for (name, bytes) in new_job(&propeller).unwrap() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("job.json");
    let file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let length = |edge_fill: bool| -> f64 {
        let mut file = file.clone();
        file["operations"][0]["path"]["strategy"]["edge_fill"] = json!(edge_fill);
        std::fs::write(&path, serde_json::to_vec(&file).unwrap()).unwrap();
        let job = Job::read(&path).unwrap();
        let setup = Setup::read(&job, 0).unwrap();
        let laid = lay_operation(&job, &setup, 0, &job.file.operations[0]).unwrap();
        let of_pass =
            |points: &[CcPoint]| points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum::<f64>();
        laid.tasks.iter().map(|t| of_pass(&t.pass.points)).sum()
    };
    let [levels, fronts] = [false, true].map(length);
    assert!(fronts < 0.95 * levels && fronts > 0.5 * levels, "{fronts} {levels}");
}
