//! Roughing level by level in a block, beside a part in it.

use facemill::new_job::NewJob;
use facemill_tests::commands::{CommandOutput, facemill_in};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::oracles::rest_points::{RestPoint, RestPoints};
use nalgebra::{Point2, Point3, Vector3};
use serde_json::{Value, json};

/// Radius of the frustum at its base and top, and heights of both, mm: it is in a box of 60 ×
/// 60 × 30 mm.
const FRUSTUM: [[f64; 2]; 2] = [[18.0, 0.5], [9.0, 26.0]];

/// Sides of the prism in its place.
const SIDES: usize = 48;

/// Material to be left on it, mm.
pub(crate) const ALLOWANCE: f64 = 0.5;

/// Cutter: R and r, mm.
const RADIUS: f64 = 8.0;
const CORNER: f64 = 1.0;

/// Distance of places of the tool along its way, mm.
const STEP: f64 = 1.0;

/// The frustum as OBJ.
fn frustum_obj() -> String {
    let mut text = String::from("o frustum\n");
    for [radius, z] in FRUSTUM {
        for k in 0..SIDES {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
            text += &format!("v {} {} {z}\n", radius * cos, radius * sin);
        }
    }
    text += &format!("v 0 0 {}\nv 0 0 {}\n", FRUSTUM[0][1], FRUSTUM[1][1]);
    let [bottom, top] = [2 * SIDES + 1, 2 * SIDES + 2];
    for k in 0..SIDES {
        let [a, b] = [k + 1, (k + 1) % SIDES + 1];
        let [c, d] = [a + SIDES, b + SIDES];
        text += &format!("f {a} {b} {d}\nf {a} {d} {c}\nf {bottom} {b} {a}\nf {top} {c} {d}\n");
    }
    text
}

/// Distance of a point from the frustum, negative inside, mm: in the half plane of radius and
/// height, from its top and side.
pub(crate) fn distance(p: &Point3<f64>) -> f64 {
    let at = Point2::new(p.x.hypot(p.y), p.z);
    let [low, high] = FRUSTUM.map(Point2::from);
    let to_stretch = |a: &Point2<f64>, b: &Point2<f64>| {
        let share = ((at - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (at - (a + (b - a) * share)).norm()
    };
    let axis = |z: f64| Point2::new(0.0, z);
    let outside = to_stretch(&low, &high).min(to_stretch(&high, &axis(high.y))).min(to_stretch(&low, &axis(low.y)));
    let is_inside = at.y > low.y && at.y < high.y && at.x < radius_at(at.y);
    if is_inside { -outside } else { outside }
}

/// Radius of the frustum at a height, mm.
fn radius_at(z: f64) -> f64 {
    let [[low, z_low], [high, z_high]] = FRUSTUM;
    low + (high - low) * (z - z_low) / (z_high - z_low)
}

/// Returns a job that roughs a box around the frustum in levels.
pub(crate) fn block(levels: &Value) -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    job.write("part.obj", frustum_obj().as_bytes());
    let arc = json!({ "tangential_arc": { "radius_mm": 4.0, "angle_deg": 90.0 } });
    job.set(
        "job.json",
        &[
            ("/setups/0/meshes/0/file", json!("part.obj")),
            ("/setups/0/stock", json!({ "box": { "min_mm": [-30, -30, 0], "max_mm": [30, 30, 30] } })),
            ("/setups/0/clearance/plane/origin_mm", json!([0.0, 0.0, 50.0])),
            ("/operations/0/name", json!("rough")),
            ("/operations/0/allowance_mm", json!(ALLOWANCE)),
            ("/operations/0/levels", levels.clone()),
            ("/operations/0/direction", json!("either")),
            ("/operations/0/entry", arc.clone()),
            ("/operations/0/exit", arc),
            (
                "/operations/0/path/strategy",
                json!({ "strategy": { "parallel_planes": { "normal": [0.0, 1.0, 0.0] } } }),
            ),
            ("/operations/0/search/tilt_deg", json!([0.0, 0.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 0.0])),
            ("/operations/0/search/mode", json!({ "fixed": { "lead_deg": 0.0 } })),
            ("/operations/0/tolerances/cusp_mm", json!(0.2)),
            ("/operations/0/tolerances/max_step_mm", json!(10.0)),
            ("/operations/0/tolerances/max_step_over_mm", json!(9.0)),
        ],
    );
    let holder = job.json("tool.json")["holder"]["sections"].clone();
    let holder: f64 = holder.as_array().expect("sections").iter().map(|s| s["length_mm"].as_f64().expect("mm")).sum();
    let neck = json!([{ "length_mm": 34.0, "diameter_low_mm": 12.0, "diameter_high_mm": 12.0 }]);
    job.set(
        "tool.json",
        &[
            ("/radius_mm", json!(RADIUS)),
            ("/corner_radius_mm", json!(CORNER)),
            ("/flute_length_mm", json!(6.0)),
            ("/dead_core_radius_mm", json!(4.0)),
            ("/max_ramp_angle_deg", json!(3.0)),
            ("/stick_out_mm", json!(40.0)),
            ("/gauge_length_mm", json!(40.0 + holder)),
            ("/body", json!({ "clearance_mm": 0.1, "sections": neck })),
        ],
    );
    job
}

pub(crate) fn text(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Plans a job, which must succeed without a finding; returns the reports of its programs.
pub(crate) fn planned(job: &JobFolder, programs: &[&str]) -> Vec<Value> {
    let planned = facemill_in(job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    let report =
        |name: &&str| -> Value { serde_json::from_str(&text(job, &format!("out/report-{name}.json"))).expect("JSON") };
    let reports: Vec<Value> = programs.iter().map(report).collect();
    for report in &reports {
        assert_eq!(report["findings"].as_array().map(Vec::len), Some(0), "{}", report["findings"]);
    }
    reports
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn levels_clear_a_block_around_a_part_and_leave_the_allowance() {
    let job = block(&json!({ "to_mm": 22.0, "depth_mm": 4.0 }));
    let programs = ["top-1-tool", "top-2-tool"];
    let reports = planned(&job, &programs);

    // Points of the block, and closely beside the part; heights are distances from it.
    let mut points = RestPoints::over([[-29.0, -29.0], [29.0, 29.0]], (2.0, 0.5), 12.0, |_, _| 18.0);
    let beside = (0..36).flat_map(|k| (0..12).map(move |j| (f64::from(k), f64::from(j)))).map(|(k, j)| {
        let (sin, cos) = (k * 10f64.to_radians()).sin_cos();
        let (z, slope) = (18.2 + 0.6 * j, (FRUSTUM[0][0] - FRUSTUM[1][0]) / (FRUSTUM[1][1] - FRUSTUM[0][1]));
        let radius = radius_at(z) + (ALLOWANCE - 0.1) * slope.hypot(1.0);
        Point3::new(radius * cos, radius * sin, z)
    });
    let place = |place: Point3<f64>| RestPoint { place, height: 0.0, clearance: f64::INFINITY };
    points.left.extend(beside.map(place));
    points.left.iter_mut().for_each(|p| p.height = distance(&p.place));

    let mut top = 30.0;
    for (program, level) in programs.iter().zip([26.0, 22.0]) {
        let before = points.left.clone();
        let motions = interpreter::run(&text(&job, &format!("out/program-{program}.nc")));
        let met = points.cut(&ReadBack::of(&job, 0), &motions, STEP);
        assert!(met.is_empty(), "{program}: {} points, first {:?}", met.len(), met[0]);
        let is_left = |p: &RestPoint| points.left.iter().any(|left| left.place == p.place);
        // The gouge tolerance, and facets inside of the round frustum.
        let kept = before.iter().filter(|p| p.height < ALLOWANCE - 0.08 || p.place.z < level - 0.05);
        let cut = kept.filter(|p| !is_left(p)).count();
        assert_eq!(cut, 0, "{program} cuts the allowance or below its level");
        // Of the slab, only what the corner of the upright cutter leaves beside the part stays.
        let kept_radius = if level < 26.0 + ALLOWANCE { radius_at(level.min(26.0)) + ALLOWANCE + CORNER } else { 0.0 };
        let of_slab = points.left.iter().filter(|p| p.place.z > level + 0.05 && p.place.z < top);
        let far = of_slab.filter(|p| p.place.x.hypot(p.place.y) > kept_radius + 0.6).count();
        assert_eq!(far, 0, "{program} leaves stock beside the part");
        assert!(before.len() > points.left.len() + 1000, "{program} cuts little");
        top = level;
    }

    // Areas: the second level has the section of the part with allowance and corner, to a cell.
    for (report, level) in reports.iter().zip([26.0, 22.0]) {
        let areas = &report["remaining"]["operations"][0]["level"];
        assert_eq!(number(&areas["height_mm"]), level);
        assert!((number(&areas["before_mm2"]) / 3600.0 - 1.0).abs() < 0.03, "{areas}");
        assert!(number(&areas["missed_mm2"]) < 10.0, "{areas}");
        assert_eq!(number(&areas["uncut_above_mm2"]), 0.0, "{areas}");
        // Less than a fifth of a cell beside the part.
        let around = std::f64::consts::TAU * (radius_at(level) + ALLOWANCE + CORNER);
        let uncertain = number(&areas["uncertain_mm2"]);
        assert!(uncertain < 0.2 * (RADIUS - CORNER) / 12.0 * around * 2.0, "{areas}");
        let section = std::f64::consts::PI * (radius_at(level) + ALLOWANCE + CORNER).powi(2);
        let part = number(&areas["part_mm2"]);
        assert!(part > 0.8 * section && part < 1.35 * section, "{part} mm2 of about {section}");
    }
    let checked = facemill_in(&job, "check job.json");
    for words in [["rough 1 of 2", "level at 26.00 mm"], ["rough 2 of 2", "stay because the part"]] {
        assert!(checked.prints(&words), "{words:?}: {}", checked.printed);
    }
}

#[test]
fn levels_across_a_tilted_axis_cut_a_bar_from_one_side() {
    // 30 deg about x: the tool comes from +z and -y.
    let axis = Vector3::new(0.0, -0.5, 0.75f64.sqrt());
    let job = block(&json!({ "axis": [axis.x, axis.y, axis.z], "to_mm": 33.0, "depth_mm": 6.0 }));
    let bar = json!({ "cylinder": { "base_mm": [0, 0, 0], "radius_mm": 30, "height_mm": 30 } });
    job.set(
        "job.json",
        &[
            ("/setups/0/stock", bar),
            ("/setups/0/clearance", json!({ "sphere": { "radius_mm": 80.0 } })),
            ("/operations/0/search/preferred_branch", json!("nearest_home")),
            ("/operations/0/path/strategy/strategy/parallel_planes/normal", json!([1.0, 0.0, 0.0])),
        ],
    );
    job.set("tool.json", &[("/flute_length_mm", json!(9.0)), ("/stick_out_mm", json!(43.0))]);
    let gauge = number(&job.json("tool.json")["gauge_length_mm"]) + 3.0;
    job.set("tool.json", &[("/gauge_length_mm", json!(gauge))]);
    let programs = ["top-1-tool", "top-2-tool"];
    planned(&job, &programs);
    let mut points = RestPoints::over([[-29.0, -29.0], [29.0, 29.0]], (2.0, 1.0), 24.0, |_, _| 6.0);
    points.left.retain(|p| p.place.x.hypot(p.place.y) < 29.9);
    let all = points.left.clone();
    for program in programs {
        let motions = interpreter::run(&text(&job, &format!("out/program-{program}.nc")));
        let met = points.cut(&ReadBack::of(&job, 0), &motions, STEP);
        assert!(met.is_empty(), "{program}: {} points, first {:?}", met.len(), met[0]);
    }
    let height = |p: &RestPoint| p.place.coords.dot(&axis);
    let above = points.left.iter().filter(|p| height(p) > 33.1).count();
    assert_eq!(above, 0, "of {} points above the level", all.iter().filter(|p| height(p) > 33.1).count());
    let below = |of: &[RestPoint]| of.iter().filter(|p| height(p) < 32.9).count();
    assert_eq!(below(&points.left), below(&all), "points below the level");
}

#[test]
fn wrong_levels_are_refused() {
    let refused = |values: &[(&str, Value)], words: &[&str]| {
        let job = block(&json!({ "to_mm": 22.0, "depth_mm": 4.0 }));
        job.set("job.json", values);
        let done: CommandOutput = facemill_in(&job, "check job.json");
        let is_named = words.iter().all(|word| done.errors.contains(word));
        assert!(done.code == 2 && is_named, "{words:?}: {}{}", done.printed, done.errors);
    };
    let levels = "/operations/0/levels";
    refused(&[(&format!("{levels}/axis"), json!([0.0, 0.0, 0.0]))], &["operations[0].levels.axis", "direction"]);
    refused(&[(&format!("{levels}/axis"), json!([0.0, 1e300, 0.0]))], &["operations[0].levels.axis"]);
    refused(&[(&format!("{levels}/axis"), json!([0.0, 1.0, 0.0]))], &["parallel_planes.normal", "across levels.axis"]);
    refused(&[(&format!("{levels}/from_mm"), json!(20.0))], &["operations[0].levels.to_mm", "below from_mm, 20 mm"]);
    refused(&[(&format!("{levels}/to_mm"), json!(30.0))], &["operations[0].levels.to_mm", "top of the stock, 30 mm"]);
    refused(&[(&format!("{levels}/from_mm"), json!(28.0))], &["levels.from_mm", "5.00 mm above", "begin higher"]);
    refused(&[(&format!("{levels}/depth_mm"), json!(5.9))], &["levels.depth_mm", "longer flute than that of T1, 6 mm"]);
    refused(&[(&format!("{levels}/depth_mm"), json!(0.01))], &["operations[0].levels.depth_mm", "more than 200"]);
    refused(&[(&format!("{levels}/depth_mm"), json!(0.0))], &["operations[0].levels.depth_mm", "from 0.01"]);
    refused(
        &[("/setups/0/stock", json!({ "offset": { "allowance_mm": 4.0 } }))],
        &["operations[0].levels", "box, cylinder or mesh"],
    );
    refused(
        &[("/setups/0/stock", json!({ "mesh": { "file": "part.obj" } }))],
        &["operations[0].levels.from_mm", "the stock is a mesh"],
    );
    refused(
        &[("/operations/0/layers", json!({ "from_mm": 4.0, "depth_mm": 2.0 }))],
        &["operations[0].levels", "leave out layers"],
    );
    refused(
        &[("/operations/0/path/strategy/region", json!({ "extend_mm": 2.0 }))],
        &["operations[0].levels", "extend_mm"],
    );
    refused(
        &[("/operations/0/path/strategy/strategy", json!({ "edge": { "width_mm": 2.0 } }))],
        &["operations[0].levels", "parallel_planes"],
    );
    refused(
        &[("/operations/0/tolerances/max_step_over_mm", json!(14.1))],
        &["operations[0].tolerances.max_step_over_mm", "flat bottom of T1, 14 mm"],
    );
    refused(&[("/operations/0/pattern", json!({ "copies": 2, "index_angle_deg": 90.0 }))], &["leave out pattern"]);
}
