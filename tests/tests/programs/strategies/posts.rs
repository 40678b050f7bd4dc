//! Solid stock that stays beside the passes: bodies keep their clearance from it between poses,
//! too.

use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::brute::in_tool;
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::variants::{box_obj, tiny_patch};
use nalgebra::Point3;
use serde_json::json;

/// Places of the posts along the passes, mm: between poses, which are `APART` mm apart.
const POSTS: [f64; 7] = [-15.0, -9.0, -3.0, 3.0, 9.0, 15.0, 21.0];

/// Largest distance of poses, mm.
const APART: f64 = 6.0;

/// Side of the posts that the tool sees, and their top, mm.
const SIDE: f64 = -7.0;
const TOP: f64 = 50.0;

/// Half of the thickness of a post, mm.
const HALF: f64 = 0.2;

/// Returns a job of two passes on a plane, with posts beside them that the cutter does not reach
/// but the upright holder would meet.
fn posts() -> JobFolder {
    let job = tiny_patch();
    job.write("patch.obj", b"o patch\nv -30 -4 0\nv 30 -4 0\nv 30 30 0\nv -30 30 0\nf 1 2 3\nf 1 3 4\n");
    let mut stock = box_obj([-30.0, -4.0, -6.0], [30.0, 30.0, 0.2]);
    for (k, x) in POSTS.iter().enumerate() {
        let post = box_obj([x - HALF, SIDE - 2.0 * HALF, -6.0], [x + HALF, SIDE, TOP]);
        // Vertices count on through the file.
        for line in post.lines() {
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
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            (&format!("{planes}/from_mm"), json!(1.0)),
            (&format!("{planes}/to_mm"), json!(2.0)),
            ("/operations/0/search/mode", json!("smallest")),
            ("/operations/0/search/tilt_deg/1", json!(30.0)),
            ("/operations/0/tolerances/max_step_mm", json!(APART)),
            ("/setups/0/stock", json!({ "mesh": { "file": "stock.obj", "unit": "millimetre", "up_axis": "z" } })),
            ("/setups/0/clearance/plane/origin_mm/2", json!(TOP + 10.0)),
        ],
    );
    job
}

#[test]
fn holder_keeps_its_clearance_from_solid_stock_between_poses() {
    let job = posts();
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert!(planned.prints(&["findings          0"]), "{}{}", planned.printed, planned.errors);

    let nc = std::fs::read_to_string(job.path("out/program.nc")).expect("a program without faults");
    let back = ReadBack::of(&job, 0);
    let heights = (0..=100).map(|k| 0.2 + (TOP - 0.2) * f64::from(k) / 100.0);
    let edges: Vec<Point3<f64>> =
        heights.flat_map(|z| POSTS.map(|x| [x - HALF, x + HALF].map(|x| Point3::new(x, SIDE, z)))).flatten().collect();
    let (mut nearest, mut places) = (f64::INFINITY, 0);
    for motion in interpreter::run(&nc).iter().filter(|motion| !motion.rapid) {
        for (tip, axis) in back.places(motion, 0.05) {
            places += 1;
            for point in &edges {
                let (rho, z) = in_tool(&tip, &axis, point);
                let beyond = back.bodies.iter().map(|b| b.shape.distance(rho, z) - b.clearance);
                nearest = beyond.fold(nearest, f64::min);
            }
        }
    }
    // Not far beyond the clearance: it is the posts that turn the tool.
    assert!(
        places > 1000 && nearest > -0.005 && nearest < 1.0,
        "{nearest} mm more than the clearance at {places} places"
    );
}
