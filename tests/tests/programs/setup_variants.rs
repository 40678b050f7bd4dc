//! Plans of one small job in other setups: clearance surfaces, solid stock, a fixture, two
//! clampings. Each is planned by the command, ends with exit code 0, and is held to what every
//! clean program is held to and to a law of its own.

use std::f64::consts::TAU;

use facemill::planner::plan_job_with_setups;
use facemill::surface_model::TriMesh;
use facemill::{Job, PlanSettings, SilentStages};
use facemill_tests::jobs::{JobFolder, unfinished};
use facemill_tests::oracles::brute::Bins;
use facemill_tests::oracles::interpreter::Motion;
use facemill_tests::oracles::read_back::{KeepOutMesh, TipAndAxis, number};
use facemill_tests::variants::{
    Written, blink_patch, box_obj, plan, planned, tiny_patch, tiny_patch_planned, with_long_flute, write_patch, written,
};
use nalgebra::Point3;
use serde_json::{Value, json};

/// The job with another clearance surface; `outside` tells how far a tip is outside of it.
fn with_clearance(surface: Value, outside: impl Fn(&Point3<f64>) -> f64) {
    let job = tiny_patch();
    job.set("job.json", &[("/setups/0/clearance", surface)]);
    let w = planned(&job);
    w.check();
    let n = w.motions.len();
    // The program starts and ends on the clearance surface or outside of it, and is inside while it
    // cuts.
    for (what, place) in [("start", w.back.tool(&w.motions[0].from, false)), ("end", w.back.end(&w.motions[n - 1]))] {
        assert!(outside(&place.0) > -0.01, "{what}: {} mm outside", outside(&place.0));
    }
    let cuts = w.motions.iter().filter(|m| !m.rapid);
    assert!(cuts.map(|m| outside(&w.back.end(m).0)).all(|d| d < 0.0));
    // Passes are cut the same whatever the way between them is.
    let plane = tiny_patch_planned();
    let cut = |w: &Written| -> Vec<_> { w.motions.iter().filter(|m| !m.rapid).map(|m| m.to).collect() };
    assert_eq!(cut(&w), cut(plane));
}

#[test]
fn a_clearance_cylinder_is_left_and_reached_outside() {
    let radius = 70.0;
    let surface = json!({ "cylinder": { "radius_mm": radius, "axis": [1, 0, 0] } });
    with_clearance(surface, |p| p.y.hypot(p.z) - radius);
}

#[test]
fn a_clearance_sphere_is_left_and_reached_outside() {
    let (radius, center) = (75.0, Point3::new(0.0, 0.0, -5.0));
    let surface = json!({ "sphere": { "radius_mm": radius, "center_mm": center.coords.as_slice() } });
    with_clearance(surface, |p| (p - center).norm() - radius);
}

fn box_mesh(low: [f64; 3], high: [f64; 3]) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh(low, high);
    TriMesh::new(vertices, triangles).unwrap()
}

/// The job in a solid stock, and what was written; `solid` must lie in the stock.
fn in_stock(stock: Value, files: &[(&str, String)], solid: &TriMesh) -> Written {
    let job = tiny_patch();
    with_long_flute(&job, 12.0);
    for (name, text) in files {
        job.write(name, text.as_bytes());
    }
    job.set("job.json", &[("/setups/0/stock", stock), ("/setups/0/clearance/plane/origin_mm", json!([0, 0, 30]))]);
    let mut w = planned(&job);
    let bins = Bins::new(solid, 60.0);
    // Only bodies and rapids keep off it: the cutter may cut all of it.
    let (bodies_too_near, rapids_too_near) = nearest_to(&w, &bins);
    assert!(bodies_too_near >= -0.1, "a body is {} mm too near to the stock", -bodies_too_near);
    assert!(rapids_too_near >= -0.5, "a rapid is {} mm too near to the stock", -rapids_too_near);
    w.back.grounds[0].thickness = 0.0;
    w.check();
    // The cutter is in the stock nearly all the time that it cuts.
    let cuts: Vec<TipAndAxis> = w.with_feed(1200.0).iter().map(|c| c.1).collect();
    let within = cuts.iter().filter(|p| bins.gap(&w.back.cutter, &p.0, &p.1, 0.0) < -0.1).count();
    assert!(within * 10 > cuts.len() * 9, "{within} of {} cuts are in the stock", cuts.len());
    w
}

/// Returns the rest of the clearances of bodies, over all motions, and of the rapid clearance of
/// the whole tool, over rapids.
fn nearest_to(w: &Written, bins: &Bins) -> (f64, f64) {
    let (mut bodies, mut rapids) = (1.0, 1.0);
    let keeps = w.back.rapid_clearance;
    for m in &w.motions {
        for (tip, axis) in w.back.places(m, 4.0) {
            for b in &w.back.bodies {
                let d = bins.distance(&b.shape, &tip, &axis, b.clearance.max(keeps) + 1.0);
                bodies = f64::min(bodies, d - b.clearance);
                if m.rapid {
                    rapids = f64::min(rapids, d - keeps);
                }
            }
            if m.rapid {
                rapids = f64::min(rapids, bins.gap(&w.back.cutter, &tip, &axis, keeps + 1.0) - keeps);
            }
        }
    }
    (bodies, rapids)
}

const LOW: [f64; 3] = [-41.0, -41.0, -10.0];
const HIGH: [f64; 3] = [41.0, 41.0, 2.5];

#[test]
fn tools_keep_off_a_stock_box_and_a_casting_of_its_shape_alike() {
    let solid = box_mesh(LOW, HIGH);
    let as_box = in_stock(json!({ "box": { "min_mm": LOW, "max_mm": HIGH } }), &[], &solid);
    let casting = json!({ "mesh": { "file": "casting.obj" } });
    let as_mesh = in_stock(casting, &[("casting.obj", box_obj(LOW, HIGH))], &solid);
    let moves = |w: &Written| -> Vec<_> { w.motions.iter().map(|m| (m.rapid, m.to)).collect() };
    assert_eq!(moves(&as_box), moves(&as_mesh));
}

#[test]
fn tools_keep_off_a_stock_bar() {
    let (radius, low, high) = (58.0, -10.0, 2.5);
    // A prism in the bar, smaller by hundredths of a millimetre.
    let n = 120u32;
    let at = |k: u32, z: f64| {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
        Point3::new(radius * cos, radius * sin, z)
    };
    let mut vertices: Vec<Point3<f64>> = (0..n).map(|k| at(k, low)).chain((0..n).map(|k| at(k, high))).collect();
    vertices.push(Point3::new(0.0, 0.0, high));
    let around = |k: u32| (k, (k + 1) % n);
    let wall = (0..n).map(around).flat_map(|(a, b)| [[a, b, n + b], [a, n + b, n + a]]);
    let top = (0..n).map(around).map(|(a, b)| [2 * n, n + a, n + b]);
    let solid = TriMesh::new(vertices, wall.chain(top).collect()).unwrap();
    let bar = json!({ "base_mm": [0, 0, low], "radius_mm": radius, "height_mm": high - low });
    in_stock(json!({ "cylinder": bar }), &[], &solid);
}

#[test]
fn a_solid_stock_above_the_cutting_edge_leaves_points_out() {
    let job = tiny_patch();
    with_long_flute(&job, 3.0);
    let high = [41.0, 41.0, 6.0];
    job.set(
        "job.json",
        &[
            ("/setups/0/stock", json!({ "box": { "min_mm": LOW, "max_mm": high } })),
            ("/setups/0/clearance/plane/origin_mm", json!([0, 0, 40])),
            ("/operations/0/infeasible", json!("stop")),
        ],
    );
    let why = job.try_plan().err().expect("a stock that the cutter's body is in");
    assert!(
        matches!(why, facemill::Failure::Infeasible(_)) && why.to_string().contains("stays whole while planning"),
        "{why}"
    );
}

/// The clamp of the fixture test, over the border of the last passes.
const CLAMP: ([f64; 3], [f64; 3]) = ([20.0, 7.0, -5.0], [32.0, 30.0, 12.0]);
const KEPT: f64 = 2.0;

fn with_clamp(job: &JobFolder) {
    job.write("clamp.obj", box_obj(CLAMP.0, CLAMP.1).as_bytes());
    let clamp = json!({ "file": "clamp.obj", "role": "fixture", "allowance_mm": KEPT });
    let mut meshes = job.json("job.json")["setups"][0]["meshes"].clone();
    meshes.as_array_mut().unwrap().push(clamp);
    job.set(
        "job.json",
        &[("/setups/0/meshes", meshes), ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(0.5))],
    );
}

#[test]
fn a_clamp_is_kept_off_and_what_it_forbids_is_left_out() {
    let job = tiny_patch();
    // Postures point by point: along a whole pass they give way to the clamp from afar.
    job.set(
        "job.json",
        &[
            ("/setups/0/clearance/plane/origin_mm", json!([0, 0, 60])),
            ("/operations/0/search/mode", json!("smallest")),
            unfinished(),
        ],
    );
    let free = planned(&job);
    with_clamp(&job);
    let w = planned(&job);
    // Cutter and bodies keep the allowance from the clamp as they keep off the part.
    w.check();
    let clamp: Vec<&KeepOutMesh> = w.back.grounds.iter().filter(|g| g.role == "fixture").collect();
    assert_eq!((clamp.len(), clamp[0].allowance), (1, KEPT));
    let nearest = |w: &Written| -> f64 {
        let near = |p: &TipAndAxis| clamp[0].bins.gap(&w.back.cutter, &p.0, &p.1, 20.0);
        w.motions.iter().flat_map(|m| w.back.places(m, 1.0)).map(|p| near(&p)).fold(20.0, f64::min)
    };
    let budget = number(&w.report["budgets"][0]["against_mesh_mm"]);
    assert!(nearest(&w) >= KEPT - budget, "{}", nearest(&w));
    // Without it the tool goes through its place, so the clamp changes the plan.
    assert!(nearest(&free) < 0.0, "{}", nearest(&free));
    assert_eq!(free.total("trimmed_points"), 0.0);
    let (left_out, planned) = (w.total("trimmed_points"), w.total("planned_points"));
    assert!(left_out > 0.0 && planned > left_out, "{left_out} left out, {planned} planned");
    let reasons: Vec<&Value> = w.report["infeasible"].as_array().unwrap().iter().map(|r| &r["reason"]).collect();
    let names_it = |r: &&Value| r.as_str().is_some_and(|r| r.contains("fixture") || r.contains("clamp"));
    assert!(reasons.iter().any(names_it), "{reasons:?}");
    // Places far from the clamp are cut as without it.
    let far = |w: &Written| -> Vec<_> {
        let cuts = w.with_feed(1200.0);
        cuts.iter().filter(|c| c.1.0.x < -15.0).map(|c| c.1.0).collect()
    };
    let (with, without) = (far(&w), far(&free));
    assert!(with.len() > 50, "{}", with.len());
    for p in &with {
        let nearest = without.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.01, "{p} is {nearest} from the plan without the clamp");
    }
}

#[test]
fn two_setups_write_two_complete_programs() {
    let job = tiny_patch();
    let file = job.json("job.json");
    let mut turned = file["setups"][0].clone();
    turned["name"] = json!("turned");
    turned["work_from_part"] = json!({ "rotation_axis": [0, 0, 1], "rotation_deg": 90 });
    turned["work_offset"] = json!({ "register": "G55", "linear_mm": { "X": 12.5 } });
    let operations: Vec<Value> = ["top", "turned"]
        .iter()
        .map(|setup| {
            let mut operation = file["operations"][0].clone();
            operation["setup"] = json!(setup);
            operation["name"] = json!(format!("patch {setup}"));
            operation
        })
        .collect();
    job.set("job.json", &[("/setups", json!([file["setups"][0], turned])), ("/operations", json!(operations))]);
    plan(&job);
    let top = written(&job, 0, "-top");
    let turned = written(&job, 1, "-turned");
    top.check();
    turned.check();
    assert!(top.nc.contains("G54") && !top.nc.contains("G55"));
    assert!(turned.nc.contains("G55") && !turned.nc.contains("G54"));
    // On the control one must not take the other's place.
    assert!(top.nc.contains("\nO1001 ") && turned.nc.contains("\nO1002 "));
    assert!(top.nc.contains("(PATCH TOP)") && turned.nc.contains("(PATCH TURNED)"));
    assert!(!job.path("out/program.nc").exists());
    // One program is what a job with that setup alone gives, but for its name.
    let alone = tiny_patch_planned();
    let moves = |w: &Written| -> Vec<Motion> { w.motions.iter().map(|m| Motion { line: 0, ..*m }).collect() };
    assert_eq!(moves(alone), moves(&top));
    // The other is another: the waves lie across the passes.
    assert_ne!(moves(&top), moves(&turned));
}

#[test]
fn a_mesh_that_changes_while_its_setups_are_planned_is_an_error() {
    let job = blink_patch();
    let mut file = job.json("job.json");
    let (mut setup, mut operation) = (file["setups"][0].clone(), file["operations"][0].clone());
    file["operations"][0]["setup"] = setup["name"].clone();
    setup["name"] = json!("again");
    operation["name"] = json!("again");
    operation["setup"] = json!("again");
    file["setups"].as_array_mut().expect("setups").push(setup);
    file["operations"].as_array_mut().expect("operations").push(operation);
    job.write("job.json", file.to_string().as_bytes());
    let read = Job::read(&job.job()).expect("a job");
    let settings = || PlanSettings { verify: true, certificates: false };
    let both = plan_job_with_setups(&read, settings(), None, &SilentStages, |_, _| ()).expect("two plans");
    assert_eq!(both.len(), 2);
    let changed = plan_job_with_setups(&read, settings(), None, &SilentStages, |_, _| write_patch(&job, 31));
    let why = changed.err().expect("a fault").to_string();
    assert!(why.contains("patch.obj has changed while the job was planned"), "{why}");
}
