//! Certificates of planned jobs under every motion law, held to depths and distances by brute force
//! over all triangles at times close together.

use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter::{Axes, Motion};
use facemill_tests::oracles::read_back::TipAndAxis;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{Written, variant, written};
use nalgebra::{Rotation3, Unit, Vector3};
use serde_json::{Value, json};

/// Largest excess of sampling over a certificate by the rounding of coordinates of metres, mm.
const ROUNDING: f64 = 1e-6;

/// Two passes of the small job under a control with these laws.
fn job(feed_mode: &str, cutting: &str, rapid: &str) -> JobFolder {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = variant(&[
        ("/post/feed_mode", json!(feed_mode)),
        ("/setups/0/work_offset", json!({ "linear_mm": { "X": 41.5, "Y": -27.0, "Z": 260.0 } })),
        (&format!("{planes}/from_mm"), json!(-1.0)),
        (&format!("{planes}/to_mm"), json!(1.0)),
    ]);
    let tolerance = json!({ "path_mm": 0.0, "orientation_deg": 0.0 });
    let motion = json!({ "cutting": cutting, "rapid": rapid, "control_tolerance": tolerance });
    job.set("machine.json", &[("/motion", motion)]);
    job
}

/// Words of the axes themselves, where those of X, Y and Z are the tip's: the other way round than
/// [`tool_on_table`](facemill_tests::oracles::paper_machine::tool_on_table).
fn axis_words(w: &Written, at: &Axes, rtcp: bool) -> Axes {
    if !rtcp {
        return *at;
    }
    let ([x, y, z], l) = (w.back.work_offset, w.back.pivot_length);
    let (px, py, pz) = (at.x + x, at.y + y, at.z + z);
    let ((sin_b, cos_b), (sin_c, cos_c)) = (at.b.to_radians().sin_cos(), at.c.to_radians().sin_cos());
    Axes {
        x: cos_c * px + sin_c * py + l * sin_b - x,
        y: cos_c * py - sin_c * px - y,
        z: pz - l + l * cos_b - z,
        ..*at
    }
}

/// Words at a part of the time of a rapid in which every axis goes at its own speed until it is
/// there.
fn each_at_its_speed(a: &Axes, b: &Axes, t: f64) -> Axes {
    // Speeds of the preset, per minute: 15000 mm and 3600 deg.
    let time = |from: f64, to: f64, speed: f64| (to - from).abs() / speed;
    let linear = [time(a.x, b.x, 15000.0), time(a.y, b.y, 15000.0), time(a.z, b.z, 15000.0)];
    let rotary = [time(a.b, b.b, 3600.0), time(a.c, b.c, 3600.0)];
    let whole = linear.into_iter().chain(rotary).fold(0.0, f64::max);
    let mix = |from: f64, to: f64, own: f64| if own > t * whole { from + (to - from) * t * whole / own } else { to };
    Axes {
        x: mix(a.x, b.x, linear[0]),
        y: mix(a.y, b.y, linear[1]),
        z: mix(a.z, b.z, linear[2]),
        b: mix(a.b, b.b, rotary[0]),
        c: mix(a.c, b.c, rotary[1]),
    }
}

/// The tool at a part of a motion's time.
fn place(w: &Written, m: &Motion, laws: [&str; 2], t: f64) -> TipAndAxis {
    if m.rapid {
        let [a, b] = [m.from, m.to].map(|at| axis_words(w, &at, m.rtcp));
        let at = if laws[1] == "per_axis" { each_at_its_speed(&a, &b, t) } else { a.lerp(&b, t) };
        return w.back.tool(&at, false);
    }
    if laws[0] == "tip_linear_vector_turned" {
        let ((from, u), (to, v)) = (w.back.tool(&m.from, m.rtcp), w.back.end(m));
        let turn = Rotation3::rotation_between(&u, &v).expect("no reversal").scaled_axis() * t;
        return (from + (to - from) * t, Unit::new_normalize(Rotation3::new(turn) * u.into_inner()));
    }
    // Words of the tip and the rotaries, or of the axes: linear in either case.
    w.back.tool(&m.from.lerp(&m.to, t), m.rtcp)
}

/// Distance of the nearest body from anything, searched up to `at_most`.
fn body_distance(w: &Written, (tip, axis): &TipAndAxis, at_most: f64) -> f64 {
    let pairs = w.back.grounds.iter().flat_map(|g| w.back.bodies.iter().map(move |b| (g, b)));
    pairs.map(|(g, b)| g.bins.distance(&b.shape, tip, axis, at_most)).fold(at_most, f64::min)
}

/// Times at which a motion is looked at.
const TIMES: u32 = 32;

/// Holds a sample of the motions to their certificates; returns how much of the proven depths is
/// more than there is.
fn check(w: &Written, certificates: &Value, laws: [&str; 2]) -> Vec<f64> {
    let all = certificates["certificates"].as_array().expect("a list");
    let mut slacks = Vec::new();
    let moving: Vec<_> = w.motions.iter().filter(|m| m.from != m.to).collect();
    for m in moving.iter().enumerate().filter(|(k, m)| m.rapid || k % 3 == 0).map(|(_, m)| m) {
        let c = all.iter().find(|c| c["line"] == m.line);
        let c = c.unwrap_or_else(|| panic!("line {} has no certificate", m.line));
        let [depth, clearance] = ["depth_mm", "clearance_mm"].map(|key| c[key].as_f64());
        let mut deepest = 0.0_f64;
        for k in 0..=TIMES {
            let place = place(w, m, laws, f64::from(k) / f64::from(TIMES));
            deepest = deepest.max(w.back.depth(&place));
            if let Some(clearance) = clearance {
                let distance = body_distance(w, &place, clearance + 0.01);
                assert!(distance >= clearance - ROUNDING, "line {}: {distance} mm, certified {clearance}", m.line);
            }
        }
        if let Some(depth) = depth {
            assert!(deepest <= depth + ROUNDING, "line {}: {deepest} mm deep, certified {depth}", m.line);
            if !m.rapid {
                slacks.push(depth - deepest);
            }
        }
    }
    slacks
}

fn plan_and_check(feed_mode: &str, laws: [&str; 2]) {
    let job = job(feed_mode, laws[0], laws[1]);
    let [file, out] = [job.job(), job.path("out")].map(|p| p.display().to_string());
    let output = run(&["plan", &file, "--out", &out, "--certificates"]);
    assert_eq!(code_and_errors(&output), (0, String::new()));
    let w = written(&job, 0, "");
    assert!(w.motions.iter().all(|m| m.rtcp == (feed_mode == "rtcp")));
    let certificates = job.json("out/certificates.json");
    let [blocks, certified] = ["blocks", "certified"].map(|key| certificates[key].as_u64().unwrap());
    assert!(blocks > 60 && certified * 100 >= blocks * 99, "{laws:?}: {certified} of {blocks} blocks");
    let mut slacks = check(&w, &certificates, laws);
    slacks.sort_by(f64::total_cmp);
    let median = slacks[slacks.len() / 2];
    assert!(slacks.len() > 15 && median <= 5e-3, "{laws:?}: {} judged, median slack {median} mm", slacks.len());
}

#[test]
fn even_rotaries_about_a_straight_tip_keep_their_certificates() {
    plan_and_check("rtcp", ["tip_and_rotaries_linear", "linear"]);
}

#[test]
fn a_turned_tool_vector_keeps_its_certificates() {
    plan_and_check("rtcp", ["tip_linear_vector_turned", "linear"]);
}

#[test]
fn rapids_with_each_axis_at_its_own_speed_keep_their_certificates() {
    plan_and_check("g94", ["axes_linear", "per_axis"]);
}

#[test]
fn the_words_of_the_axes_are_those_that_bring_the_tip_back() {
    let job = job("rtcp", "tip_and_rotaries_linear", "linear");
    let back = facemill_tests::oracles::read_back::ReadBack::of(&job, 0);
    let w =
        Written { report: Value::Null, nc: String::new(), apt: String::new(), motions: vec![], feeds: vec![], back };
    let at = Axes { x: 12.0, y: -30.0, z: 4.0, b: 17.0, c: 71.0 };
    let ((tip, axis), (back, same)) = (w.back.tool(&at, true), w.back.tool(&axis_words(&w, &at, true), false));
    let apart: Vector3<f64> = tip - back;
    assert!(apart.norm() < 1e-9 && (axis.into_inner() - same.into_inner()).norm() < 1e-12, "{apart}");
}
