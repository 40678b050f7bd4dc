//! Programs along the rounded edge of a plate and in the fillet and corner between two planes.

use facemill::Planned;
use facemill::formats::incomplete_because;
use facemill::report::outcome::Outcome;
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

/// OBJ of a prism along y, 24 mm long, over a profile in the xz plane, material to the right; a
/// group for each part.
fn prism(parts: &[(&str, Vec<[f64; 2]>)]) -> String {
    const ROWS: usize = 24;
    let mut text = String::new();
    for [x, z] in parts.iter().flat_map(|(_, points)| points) {
        for j in 0..=ROWS {
            text += &format!("v {x} {} {z}\n", 24.0 * j as f64 / ROWS as f64);
        }
    }
    let mut column = 0;
    for (name, points) in parts {
        text += &format!("g {name}\n");
        for _ in 1..points.len() {
            for j in 0..ROWS {
                let at = |i: usize, j: usize| (column + i) * (ROWS + 1) + j + 1;
                text += &format!("f {} {} {}\n", at(0, j), at(1, j), at(1, j + 1));
                text += &format!("f {} {} {}\n", at(0, j), at(1, j + 1), at(0, j + 1));
            }
            column += 1;
        }
        column += 1;
    }
    text
}

fn line(from: [f64; 2], to: [f64; 2], n: u32) -> Vec<[f64; 2]> {
    (0..=n).map(|k| f64::from(k) / f64::from(n)).map(|t| [0, 1].map(|i| from[i] + (to[i] - from[i]) * t)).collect()
}

/// Points on a circle about (0, `height`), by angles from +z toward +x, deg.
fn arc(height: f64, radius: f64, from: f64, to: f64, n: u32) -> Vec<[f64; 2]> {
    let angle = |k: u32| (from + (to - from) * f64::from(k) / f64::from(n)).to_radians();
    (0..=n).map(|k| [radius * angle(k).sin(), height + radius * angle(k).cos()]).collect()
}

/// The upper edge of a plate with flanks at 40° to both sides, rounded by 3 mm.
fn plate() -> String {
    let round = arc(0.0, 3.0, -40.0, 40.0, 24);
    let [start, end] = [round[0], round[24]];
    let (s, c) = 40f64.to_radians().sin_cos();
    let (left, right) = ([start[0] - 9.0 * c, start[1] - 9.0 * s], [end[0] + 9.0 * c, end[1] - 9.0 * s]);
    prism(&[("left", line(left, start, 12)), ("nose", round), ("right", line(end, right, 12))])
}

/// A trough of two planes at 40° to both sides with a fillet of 6 mm.
fn trough() -> String {
    let fillet = arc(0.0, 6.0, 220.0, 140.0, 24);
    let [start, end] = [fillet[0], fillet[24]];
    let (s, c) = 40f64.to_radians().sin_cos();
    let (left, right) = ([start[0] - 9.0 * c, start[1] + 9.0 * s], [end[0] + 9.0 * c, end[1] + 9.0 * s]);
    prism(&[("blade", line(left, start, 12)), ("fillet", fillet), ("hub", line(end, right, 12))])
}

/// The same without a fillet.
fn corner() -> String {
    let (s, c) = 40f64.to_radians().sin_cos();
    let [left, right] = [-12.0, 12.0].map(|x| [x * c, 12.0 * s]);
    prism(&[("blade", line(left, [0.0; 2], 12)), ("hub", line([0.0; 2], right, 12))])
}

const CUSP: f64 = 0.05;

/// A ball of 4 mm on the part.
fn job(mesh: &str, strategy: Value) -> JobFolder {
    let text = |value: Value| facemill::file_format::to_json(&value).into_bytes();
    let approach = json!({ "tangential_arc": { "radius_mm": 10.0, "angle_deg": 20.0 } });
    let tool = json!({
        "format": "facemill-tool/1", "name": "ball D8", "number": 1, "radius_mm": 4.0, "corner_radius_mm": 4.0,
        "n_inserts": 2, "flute_length_mm": 12.0, "max_ramp_angle_deg": 90.0, "spindle_rotation": "clockwise",
        "stick_out_mm": 92.0, "gauge_length_mm": 292.0,
        "body": { "clearance_mm": 0.1, "sections": [
            { "length_mm": 80.0, "diameter_low_mm": 6.8, "diameter_high_mm": 6.8 }] },
        "holder": { "clearance_mm": 1.0, "sections": [
            { "length_mm": 200.0, "diameter_low_mm": 12.0, "diameter_high_mm": 40.0 }] },
    });
    let job = json!({
        "format": "facemill-job/1", "name": "edge or root", "tool": "tool.json", "machine": "machine.json",
        "setups": [{
            "name": "up",
            // Clamped aslant, so that the tool is never upright, where the machine is singular.
            "table_from_work": {
                "translation_mm": [0.0, 0.0, 1500.0], "rotation_axis": [0.0, 1.0, 0.0], "rotation_deg": 35.0 },
            "meshes": [{ "file": "part.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" }],
            "stock": { "offset": { "allowance_mm": 0.2 } },
            "clearance": { "plane": { "origin_mm": [0.0, 0.0, 60.0] } },
            "rapid_clearance_mm": 2.0,
        }],
        "operations": [{
            "name": "along the line",
            "path": { "strategy": { "strategy": strategy, "linking": "zigzag" } },
            "direction": "either",
            "entry": approach,
            "exit": approach,
            "infeasible": { "trim": { "max_trimmed_fraction": 0.01 } },
            "search": {
                "tilt_deg": [10.0, 40.0], "rotate_deg": [0.0, 90.0], "u_step": 0.05, "max_turn_deg_per_mm": 5.0,
                "preferred_branch": "positive",
                "tool_axis_cone": { "axis": [0, 0, 1], "half_angle_deg": 75 },
            },
            "feeds": { "cutting_mm_min": 800.0, "approach_mm_min": 1500.0, "spindle_rpm": 6000.0 },
            "tolerances": {
                "mesh_chord_mm": 0.05, "path_chord_mm": 0.01, "max_step_mm": 3.0, "linearisation_mm": 0.02,
                "gouge_mm": 0.02, "max_lift_mm": 0.1, "cusp_mm": CUSP, "max_step_over_mm": 2.0,
            },
        }],
        "post": { "dialect": "fanuc" },
    });
    JobFolder::of(&[
        ("part.obj".to_owned(), mesh.as_bytes().to_vec()),
        ("job.json".to_owned(), text(job)),
        ("tool.json".to_owned(), text(tool)),
        ("machine.json".to_owned(), facemill::inverse_kinematics::preset_head_b_table_c().as_bytes().to_vec()),
    ])
}

/// Plans a job without findings, with all of its points and the cusp within the tolerance.
fn planned_whole(job: &JobFolder) -> Planned {
    let planned = job.plan();
    let report = &planned.report;
    println!("{} passes, cusp {:?}, {:?}", report.totals.passes, report.worst.cusp_mm, report.worst.corner_rest_mm);
    assert!(report.findings.is_empty(), "{:?}", report.findings);
    assert!(report.totals.passes > 6 && report.totals.planned_points == report.totals.cc_points);
    assert!(!report.worst.cusp_exceeded && report.worst.cusp_mm.is_some_and(|c| c <= CUSP), "{:?}", report.worst);
    planned
}

/// Plans a job that leaves nothing in a corner, and is done.
fn planned_done(job: &JobFolder) {
    let planned = planned_whole(job);
    assert!(planned.is_clean() && planned.report.worst.corner_rest_mm.is_none());
}

#[test]
fn the_rounded_edge_of_a_plate_is_cut_around_its_ridge() {
    planned_done(&job(&plate(), json!({ "edge": { "line": "ridge", "width_mm": 12.0 } })));
}

/// A single pass is measured on its line, 24 mm long: all of it has to be cut, and nothing beside
/// it.
#[test]
fn an_edge_without_width_is_one_pass_that_is_done_where_its_whole_line_is_cut() {
    let job = job(&plate(), json!({ "edge": { "line": "ridge", "width_mm": 0.0 } }));
    let planned = job.plan();
    assert!(planned.is_clean() && planned.report.totals.passes == 1, "{:?}", incomplete_because(&planned.report));
    let on_line = &planned.report.remaining.as_ref().unwrap().operations[0];
    assert_eq!((on_line.area_mm2, on_line.slopes.len(), on_line.never_cut_fraction), (0.0, 0, 0.0));
    assert!(on_line.length_mm.is_some_and(|l| (l - 24.0).abs() < 0.01), "{on_line:?}");
    assert!(on_line.largest.is_some_and(|p| p.height_mm < on_line.limit_mm) && on_line.samples > 1_000);
    assert!(on_line.spacing_mm < 0.024, "{}", on_line.spacing_mm);
    let lines = planned.report.remaining.as_ref().unwrap().summary_lines();
    assert!(lines[0].starts_with("  left on line      half of it"), "{lines:?}");

    // A quarter of the line at each end stays uncut.
    job.set("job.json", &[("/operations/0/path/strategy/edge_margin_mm", json!(6.0))]);
    let planned = job.plan();
    let on_line = &planned.report.remaining.as_ref().unwrap().operations[0];
    let (above, never) = (on_line.above_fraction, on_line.never_cut_fraction);
    assert!(on_line.exceeded && above > 0.2 && never > 0.2 && never < 0.5, "{above} {never}");
    assert!(planned.outcome() == Outcome::Incomplete);
}

#[test]
fn a_fillet_is_cut_by_a_ball_that_fits_it() {
    planned_done(&job(&trough(), json!({ "root": { "line": { "fillet": "fillet" }, "width_mm": 14.0 } })));
}

/// A ball of radius r in a corner of two planes, each at angle a to its bisector, touches both and
/// leaves r (1 / sin a − 1) below it: the plan says so, and is not done.
#[test]
fn a_corner_without_a_fillet_is_cut_by_the_rolling_ball_and_its_rest_reported() {
    let strategy = json!({ "root": { "line": { "between_groups": ["blade", "hub"] }, "width_mm": 9.0 } });
    let planned = planned_whole(&job(&corner(), strategy));
    let rest = planned.report.worst.corner_rest_mm.unwrap();
    assert!((rest - 4.0 * (1.0 / 50f64.to_radians().sin() - 1.0)).abs() < 1e-3, "{rest}");
    let reasons = incomplete_because(&planned.report);
    assert!(reasons.len() == 1 && planned.outcome() == Outcome::Incomplete, "{reasons:?}");
    // There are 0.2 mm of stock on the surface.
    let left = &planned.report.remaining.as_ref().unwrap().operations[0];
    let height = left.largest.as_ref().unwrap().height_mm;
    assert!(left.exceeded && (height - 0.2).abs() < 0.01, "{height}");
}

#[test]
fn a_ball_that_does_not_fit_the_fillet_is_refused() {
    let job = job(&trough(), json!({ "root": { "line": { "fillet": "fillet" }, "width_mm": 14.0 } }));
    job.set("tool.json", &[("/radius_mm", json!(7.0)), ("/corner_radius_mm", json!(7.0))]);
    let refusal = job.try_plan().err().expect("a refusal").to_string();
    assert!(refusal.contains("a corner radius of 6.0") || refusal.contains("a corner radius of 5.9"), "{refusal}");
    assert!(refusal.contains("operations[0].path.strategy"), "{refusal}");
}
