//! The written program, run by an interpreter, kinematics and distances that share nothing with the planner.

use facemill::nc_program::read_apt;
use facemill::surface_model::TriMesh;
use facemill_tests::brute::{Bins, Frustum, RoundedCylinder};
use facemill_tests::interpreter::{self, Axes, Motion};
use facemill_tests::jobs::{JobFolder, small_patch, small_propeller, text_of};
use facemill_tests::paper_machine::{PIVOT_TO_FACE, tool_on_table};
use nalgebra::{Point3, Unit, Vector3};
use serde_json::Value;

/// What the read-back needs, taken from the files alone.
struct ReadBack {
    part: Bins,
    check: Option<Bins>,
    cutter: RoundedCylinder,
    /// Non-cutting bodies and their clearances.
    bodies: Vec<(Frustum, f64)>,
    pivot_length: f64,
    table_from_work: Vector3<f64>,
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("no number: {v}"))
}

impl ReadBack {
    fn of(job: &JobFolder) -> Self {
        let (file, tool) = (job.json("job.json"), job.json("tool.json"));
        let setup = &file["setups"][0];
        let mesh = |role: &str| -> Option<TriMesh> {
            let entry = setup["meshes"].as_array().unwrap().iter().rfind(|m| m["role"] == role)?;
            let typed = job.file().setups.remove(0).meshes;
            let typed = typed.iter().find(|m| m.file == entry["file"].as_str().unwrap()).unwrap();
            let all = facemill::read_mesh(&job.path(&typed.file), typed.unit, typed.up_axis).unwrap().mesh;
            let prefix = entry["groups"][0].as_str().map(|g| g.trim_end_matches('*').to_owned());
            Some(all.select_groups(|name| prefix.as_ref().is_none_or(|p| name.starts_with(p))))
        };
        let part = mesh("part").or_else(|| mesh("drive")).expect("a part");
        let mut bodies = Vec::new();
        let mut low = number(&tool["flute_length_mm"]);
        for stack in ["body", "holder"] {
            for s in tool[stack]["sections"].as_array().unwrap() {
                let high = low + number(&s["length_mm"]);
                let (radius_low, radius_high) =
                    (0.5 * number(&s["diameter_low_mm"]), 0.5 * number(&s["diameter_high_mm"]));
                bodies.push((Frustum { low, high, radius_low, radius_high }, number(&tool[stack]["clearance_mm"])));
                low = high;
            }
        }
        // The preset machine's spindle nose.
        bodies.push((Frustum { low, high: low + 250.0, radius_low: 90.0, radius_high: 90.0 }, 5.0));
        assert_eq!(low, number(&tool["gauge_length_mm"]));
        let z = setup["table_from_work"]["translation_mm"].as_array().unwrap().iter().map(number).collect::<Vec<_>>();
        Self {
            part: Bins::new(&part, 5.0),
            check: mesh("check").map(|m| Bins::new(&m, 5.0)),
            cutter: RoundedCylinder {
                radius: number(&tool["radius_mm"]),
                corner: number(&tool["corner_radius_mm"]),
                height: number(&tool["flute_length_mm"]),
            },
            bodies,
            pivot_length: PIVOT_TO_FACE + low,
            table_from_work: Vector3::new(z[0], z[1], z[2]),
        }
    }

    /// Tip and axis in the workpiece frame.
    fn tool(&self, at: &Axes) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let (tip, axis) = tool_on_table(at, self.pivot_length);
        (tip - self.table_from_work, axis)
    }

    /// Positions along a motion, tip and rim at most `step` apart.
    fn positions(&self, m: &Motion, step: f64) -> Vec<Axes> {
        let ((a, u), (b, v)) = (self.tool(&m.from), self.tool(&m.to));
        // The rotaries may swing the tip out and back within a block.
        let turn = (m.to.b - m.from.b).abs().to_radians() * self.pivot_length
            + (m.to.c - m.from.c).abs().to_radians() * m.from.x.hypot(m.from.y);
        let rim = self.cutter.radius * (u.into_inner() - v.into_inner()).norm();
        let way = ((a - b).norm() + rim).max(turn.min(40.0) * 0.5);
        let n = (way / step).ceil().max(1.0) as usize;
        (1..=n).map(|k| m.from.lerp(&m.to, k as f64 / n as f64)).collect()
    }
}

/// Deepest cutter over every `stride`-th motion, and its line.
fn deepest(back: &ReadBack, motions: &[Motion], stride: usize) -> (f64, usize) {
    let mut deepest = (0.0, 0);
    for m in motions.iter().step_by(stride) {
        for at in back.positions(m, 1.0) {
            let (tip, axis) = back.tool(&at);
            let mut depth = back.part.depth(&back.cutter, &tip, &axis);
            if let Some(check) = &back.check {
                depth = depth.max(check.depth(&back.cutter, &tip, &axis));
            }
            if depth > deepest.0 {
                deepest = (depth, m.line);
            }
        }
    }
    deepest
}

/// `strides`: of how many motions one is looked at, for the cutter and for the bodies.
fn check_program(job: &JobFolder, strides: (usize, usize)) {
    let planned = job.plan();
    let report = &planned.report;
    assert!(planned.is_clean(), "{:?} {:?}", report.findings, report.infeasible);
    assert_eq!(report.totals.trimmed_points, 0, "{:?}", report.infeasible);
    let nc = text_of(&planned, "program.nc");
    let motions = interpreter::run(&nc);
    let back = ReadBack::of(job);
    let budget = report.budgets[0].against_mesh_mm;
    let n_cuts = motions.iter().filter(|m| !m.rapid).count();
    assert!(
        n_cuts >= report.totals.planned_points,
        "{n_cuts} cutting motions for {} points",
        report.totals.planned_points
    );

    let (depth, line) = deepest(&back, &motions, strides.0);
    assert!(depth <= budget, "line {line}: {depth} mm deep, budget {budget}");
    // A cutter that never touches would pass, too: it is to cut.
    assert!(depth > 0.0, "the cutter touches nothing");
    let told = report.worst.gouge_mm.unwrap_or(0.0);
    assert!(told >= depth - 1e-3 && told <= budget, "report {told}, by brute force {depth} in line {line}");
    // The report's own place of its deepest gouge, looked at closely.
    if let Some(line) = report.worst.gouge_line {
        let there: Vec<Motion> = motions.iter().filter(|m| m.line == line as usize).copied().collect();
        let (depth, _) = deepest(&back, &there, 1);
        assert!((depth - told).abs() < 0.1 * told + 1e-3, "report {told} in line {line}, by brute force {depth}");
    }
    check_bodies(&back, &motions, strides.1, report.worst.clearance_mm.expect("a clearance"));
    check_apt(&back, &motions, &text_of(&planned, "program.apt"));
}

/// No body comes nearer than its clearance allows (0.1 mm of slack between planned points), nor than the report says.
fn check_bodies(back: &ReadBack, motions: &[Motion], stride: usize, told: f64) {
    let mut nearest = f64::INFINITY;
    for m in motions.iter().step_by(stride) {
        let (tip, axis) = back.tool(&m.to);
        for (body, clearance) in &back.bodies {
            let at_most = clearance + 5.0;
            let d = back.part.distance(body, &tip, &axis, at_most);
            assert!(d >= clearance - 0.1, "line {}: {body:?} {d} away", m.line);
            if d < at_most {
                nearest = nearest.min(d);
            }
        }
    }
    assert!(told <= nearest + 1e-6, "report {told}, by brute force {nearest}");
}

/// The APT file's points are the program's positions, up to the rounding of words at the end of the tool.
fn check_apt(back: &ReadBack, motions: &[Motion], apt: &str) {
    let apt = read_apt(apt).unwrap();
    assert_eq!(motions.len(), apt.points.len(), "motions and APT points");
    let rounding = 5e-4 * 3f64.sqrt() + 2.0 * 5e-5f64.to_radians() * (back.pivot_length + 500.0) + 1e-4;
    for (m, p) in motions.iter().zip(&apt.points) {
        let (tip, axis) = back.tool(&m.to);
        assert!((tip - p.cl.tip).norm() < rounding, "line {}: {tip} and APT line {} {}", m.line, p.line, p.cl.tip);
        assert!((axis.into_inner() - p.cl.axis.into_inner()).norm() < 1e-5, "line {}", m.line);
        assert_eq!(m.rapid, p.kind == facemill::nc_program::AptPointKind::Rapid, "line {}", m.line);
    }
}

#[test]
fn patch_program_read_back_stays_within_its_budget() {
    check_program(&small_patch(), (1, 7));
}

#[test]
fn propeller_program_read_back_stays_within_its_budget() {
    check_program(&small_propeller(), (5, 61));
}
