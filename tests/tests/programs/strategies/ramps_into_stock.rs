//! Ways down into stock: entries and cuts that would go down too steeply are not in the program.

use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::brute::in_tool;
use facemill_tests::oracles::interpreter::{self, Motion};
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis};
use facemill_tests::variants::{box_obj, tiny_patch, with_long_flute};
use nalgebra::{Point3, Vector2};
use serde_json::json;

/// Largest ramp angle of the mill, and what is more than rounding of the program, degrees.
const RAMP: f64 = 3.0;
const MORE: f64 = 1.0;

/// Distance of places of the tool along its way, mm.
const STEP: f64 = 0.05;

/// Steps of the tool at a feed, each from one place to the next, by the program's text.
fn steps(back: &ReadBack, nc: &str) -> Vec<[TipAndAxis; 2]> {
    let motions = interpreter::run(nc);
    let at_feed = motions.iter().filter(|motion| !motion.rapid);
    let of = |motion: &Motion| {
        let start = back.tool(&motion.from, motion.rtcp);
        let places: Vec<TipAndAxis> = std::iter::once(start).chain(back.places(motion, STEP)).collect();
        places.windows(2).map(|w| [w[0], w[1]]).collect::<Vec<_>>()
    };
    at_feed.flat_map(of).collect()
}

/// Angle at which the tool goes down along its axis, degrees.
fn descent([(from, axis), (to, _)]: &[TipAndAxis; 2]) -> f64 {
    let way = to - from;
    let down = -way.dot(axis);
    down.atan2((way + axis.into_inner() * down).norm()).to_degrees()
}

/// Ends of the slats along x, from the middle, beyond those of the arcs; and their sides along y
/// and z, in the second place of the pattern, mm.
const ENDS: [f64; 2] = [10.0, 45.0];
const SIDES: [f64; 2] = [-23.9, -23.35];
const HEIGHTS: [f64; 2] = [4.5, 5.5];

/// Returns a job of a pass in two places of a pattern. Beside the second one there are slats of
/// stock, above the flute and beside the neck of the mill: on its way down the flute meets them.
fn slats() -> JobFolder {
    let job = tiny_patch();
    job.write("patch.obj", b"o patch\nv -30 -30 0\nv 30 -30 0\nv 30 30 0\nv -30 30 0\nf 1 2 3\nf 1 3 4\n");
    let mut stock = box_obj([-30.0, -30.0, -6.0], [30.0, 30.0, 0.2]);
    for (k, [low, high]) in [[-ENDS[1], -ENDS[0]], ENDS].into_iter().enumerate() {
        let slat = box_obj([low, SIDES[0], HEIGHTS[0]], [high, SIDES[1], HEIGHTS[1]]);
        // Vertices count on through the file.
        for line in slat.lines() {
            stock += &match line.strip_prefix("f ") {
                Some(of) => {
                    let numbers = of.split(' ').map(|n| n.parse::<usize>().expect("a number") + 8 * (k + 1));
                    format!("f {}\n", numbers.map(|n| n.to_string()).collect::<Vec<_>>().join(" "))
                }
                None => format!("{line}\n"),
            };
        }
    }
    job.write("stock.obj", stock.as_bytes());
    with_long_flute(&job, 3.0);
    job.set("tool.json", &[("/max_ramp_angle_deg", json!(RAMP))]);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            (&format!("{planes}/from_mm"), json!(19.0)),
            (&format!("{planes}/to_mm"), json!(20.0)),
            ("/operations/0/search/mode", json!("smallest")),
            ("/operations/0/pattern", json!({ "copies": 2, "index_angle_deg": 180.0 })),
            ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(0.5)),
            ("/setups/0/stock", json!({ "mesh": { "file": "stock.obj", "unit": "millimetre", "up_axis": "z" } })),
        ],
    );
    job
}

#[test]
fn an_entry_in_the_second_place_of_a_pattern_does_not_plunge_through_the_stock_there() {
    let job = slats();
    let planned = job.plan();
    assert_eq!(planned.report.findings, []);
    // The first place is cut whole; the second from the first point with a way on.
    let infeasible = &planned.report.infeasible;
    let plunges = infeasible.iter().filter(|i| i.reason.starts_with("no entry: ramp of 90.00 deg"));
    let places: Vec<[f64; 3]> = plunges.map(|i| i.first_place_mm).collect();
    assert!(!places.is_empty() && places.iter().all(|p| p[1] < 0.0), "{infeasible:?}");
    assert_eq!(infeasible.len(), places.len(), "{infeasible:?}");

    let back = ReadBack::of(&job, 0);
    let mut slats: Vec<Point3<f64>> = Vec::new();
    for x in (0..=140).map(|k| ENDS[0] + 0.25 * f64::from(k)) {
        for (y, z) in SIDES.iter().flat_map(|y| HEIGHTS.map(|z| (*y, z))) {
            slats.extend([x, -x].map(|x| Point3::new(x, y, z)));
        }
    }
    let (mut met, mut in_second) = (0, 0);
    for step in steps(&back, &text_of(&planned, "program.nc")) {
        let (tip, axis) = &step[1];
        in_second += usize::from(tip.y < -15.0 && tip.z < 2.0);
        if (tip.y - SIDES[1]).abs() > 8.0 {
            continue;
        }
        let flute = |p: &Point3<f64>| {
            let (rho, z) = in_tool(tip, axis, p);
            rho < back.cutter.radius - 0.02 && (0.0..back.cutter.height).contains(&z)
        };
        if slats.iter().any(flute) {
            met += 1;
            assert!(descent(&step) < RAMP + MORE, "{:?} goes down {} degrees", tip, descent(&step));
        }
    }
    // The exits lead up through the slats, so that they are in the way of the flute.
    assert!(met > 0 && in_second > 200, "{met} places of the flute in stock, {in_second} in the second place");
}

/// Places along x and heights of the surface of the ridge, mm: flat, up, down, flat.
const RIDGE: [[f64; 2]; 5] = [[-30.0, -4.5], [-15.0, -4.5], [0.0, 0.0], [15.0, -4.5], [30.0, -4.5]];

/// Stock on the ridge, mm.
const STOCK: f64 = 0.4;

/// Returns a job of passes across a ridge, up on one side and down on the other, by a ball nose
/// mill that points to one place.
fn ridge() -> JobFolder {
    let job = tiny_patch();
    let vertices = RIDGE.map(|[x, z]| format!("v {x} -30 {z}\nv {x} 30 {z}\n")).concat();
    let facets = [1, 3, 5, 7].map(|k| format!("f {k} {} {}\nf {k} {} {}\n", k + 2, k + 3, k + 3, k + 1)).concat();
    job.write("patch.obj", format!("o patch\n{vertices}{facets}").as_bytes());
    with_long_flute(&job, 6.0);
    job.set("tool.json", &[("/max_ramp_angle_deg", json!(RAMP)), ("/corner_radius_mm", json!(4.0))]);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            (&format!("{planes}/from_mm"), json!(-1.0)),
            (&format!("{planes}/to_mm"), json!(1.0)),
            ("/operations/0/search/mode", json!({ "toward": { "point": { "position_mm": [0.0, 400.0, 1000.0] } } })),
            ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(0.7)),
            ("/setups/0/stock/offset/allowance_mm", json!(STOCK)),
        ],
    );
    job
}

/// Distance of a point of the xz plane from the ridge, mm.
fn beside_ridge(p: &Vector2<f64>) -> f64 {
    let to_side = |side: &[[f64; 2]]| {
        let [a, b] = [0, 1].map(|k| Vector2::from(side[k]));
        let share = (p - a).dot(&(b - a)) / (b - a).norm_squared();
        (p - a - (b - a) * share.clamp(0.0, 1.0)).norm()
    };
    RIDGE.windows(2).map(to_side).fold(f64::INFINITY, f64::min)
}

#[test]
fn cuts_that_go_down_into_stock_more_steeply_than_the_tool_may_are_left_out() {
    let job = ridge();
    let planned = job.plan();
    assert_eq!(planned.report.findings, []);
    let ramps = planned.report.infeasible.iter().filter(|i| i.reason.starts_with("ramp of "));
    assert!(ramps.map(|i| i.points).sum::<usize>() > 0, "{:?}", planned.report.infeasible);
    // The way down, and what no entry leads to behind it.
    let totals = &planned.report.totals;
    assert!((0.2..0.7).contains(&(1.0 - totals.planned_fraction)), "{}", totals.planned_fraction);

    let back = ReadBack::of(&job, 0);
    let radius = back.cutter.radius;
    let (mut rising, mut steepest) = (0, f64::NEG_INFINITY);
    for step in steps(&back, &text_of(&planned, "program.nc")) {
        let (tip, axis) = &step[1];
        let middle = tip.coords + axis.into_inner() * radius;
        if beside_ridge(&middle.xz()) < radius + STOCK - 0.05 {
            rising += usize::from(descent(&step) < -10.0);
            steepest = descent(&step).max(steepest);
        }
    }
    assert!(steepest < RAMP + MORE && rising > 200, "{steepest} degrees down, {rising} places on the way up");
}
