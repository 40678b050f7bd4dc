//! Laws across rooms, checked against closed forms and brute force.

use std::f64::consts::TAU;

use facemill::cl_data::{CcPoint, ClPoint, Pass, Posture, RoundFrustum, Silent, Solid};
use facemill::cutter_location::{
    Hints, Obstacle, PassSettings, PassTask, PoseTest, PostureMode, SearchCurve, SearchOrder, SearchSettings, Workcell,
    plan_passes, search, tool_frame,
};
use facemill::interference::{Interference, MeshTree};
use facemill::inverse_kinematics::{BranchPreference, Machine};
use facemill::sample_parts::{AnalyticPart, AnalyticShape, MaterialSide, PatchSpec, patch};
use facemill::surface_model::TriMesh;
use facemill::tool_model::{Cutter, ToolAssembly};
use facemill_test_kit::{Random, golden_least};
use facemill_tests::oracles::brute::{Bins, RoundedCylinder, SECTIONS, in_tool};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde_json::json;

const MOUNT: f64 = 600.0;

fn tool(radius: f64, corner: f64) -> ToolAssembly {
    let flute = (2.0 * corner).max(8.0);
    let file = json!({
        "format": "facemill-tool/1", "name": "mill", "number": 1, "radius_mm": radius, "corner_radius_mm": corner,
        "n_inserts": 4, "flute_length_mm": flute, "max_ramp_angle_deg": 3.0, "spindle_rotation": "clockwise",
        "stick_out_mm": flute + 40.0, "gauge_length_mm": flute + 140.0,
        "body": { "clearance_mm": 1.0, "sections": [
            { "length_mm": 40.0, "diameter_low_mm": 1.6 * radius, "diameter_high_mm": 1.6 * radius }] },
        "holder": { "clearance_mm": 2.0, "sections": [
            { "length_mm": 100.0, "diameter_low_mm": 30.0, "diameter_high_mm": 40.0 }] },
    });
    ToolAssembly::from_json(file.to_string().as_bytes()).unwrap()
}

fn workcell<'a>(
    machine: &'a Machine,
    tool: &'a ToolAssembly,
    mesh: &'a MeshTree,
    table_from_work: Isometry3<f64>,
    max_lift: f64,
) -> Workcell<'a> {
    Workcell {
        machine,
        table_from_work,
        tool,
        obstacles: vec![Obstacle {
            name: "part".to_owned(),
            mesh: mesh.into(),
            gouge_allowance: Some(0.0),
            collision_allowance: 0.0,
            machine_body: None,
            pieces: None,
        }],
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift,
        lift_resolution: 1e-3,
        z_map: None,
    }
}

fn solid(cutter: &Cutter) -> RoundedCylinder {
    RoundedCylinder { radius: cutter.radius(), corner: cutter.corner_radius(), height: cutter.flute_length() }
}

fn curve(tilt: [f64; 2], rotate: [f64; 2], order: SearchOrder) -> SearchCurve {
    let at = |k: usize| Posture { tilt: tilt[k].to_radians(), rotate: rotate[k].to_radians() };
    SearchCurve::new(at(0), at(1), order, 1.0).unwrap()
}

/// Random CC points of the wavy patch with random feeds.
fn cc_on_patch(spec: &PatchSpec, reach: f64, random: &mut Random) -> CcPoint {
    let p = spec.at(random.between(-reach, reach), random.between(-reach, reach));
    CcPoint::new(p.point, p.normal.into_inner(), random.direction().into_inner()).unwrap()
}

#[test]
fn search_gives_the_smallest_feasible_u_of_a_dense_scan_and_a_pose_that_brute_force_finds_free() {
    // Deep waves: flat postures gouge in the hollows.
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let mesh = patch(&spec, 140, 140).unwrap();
    let (tree, bins) = (MeshTree::new(&mesh), Bins::new(&mesh, 5.0));
    let machine = Machine::head_b_table_c().unwrap();
    let tool = tool(16.0, 2.0);
    let cell = workcell(&machine, &tool, &tree, Isometry3::translation(0.0, 0.0, MOUNT), 0.06);
    let test = PoseTest::new(&cell);
    let settings = SearchSettings { u_step: 0.05, u_tolerance: 0.002, ..SearchSettings::default() };
    let mut random = Random(41);
    let (mut monotone, mut other, mut beyond_start) = (0, 0, 0);
    for _ in 0..60 {
        let cc = cc_on_patch(&spec, 80.0, &mut random);
        let order = if random.below(2) == 0 { SearchOrder::TiltFirst } else { SearchOrder::RotateFirst };
        let curve = curve([2.0, 25.0], [0.0, -80.0], order);
        let n = 400;
        let free = |u: f64| test.try_posture(&cc, curve.at(u), None, &mut Hints::default()).is_ok();
        let scan: Vec<bool> = (0..=n).map(|k| free(f64::from(k) / f64::from(n))).collect();
        let first = scan.iter().position(|f| *f);
        let found = search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default());
        if let Ok(found) = &found {
            let pose = &found.pose;
            let depth = bins.depth(&solid(tool.cutter()), &pose.cl.tip, &pose.cl.axis);
            assert!(depth <= cell.gouge_tolerance + 1e-6, "{depth} mm deep at u {}", found.u);
            assert!(pose.lift <= cell.max_lift);
            let again = machine.cl_point(&pose.configuration.axes, tool.gauge_length());
            let meant = pose.cl.transformed(&cell.table_from_work);
            assert!((again.tip - meant.tip).norm() < 1e-7);
        }
        let is_monotone = first.is_none_or(|k| scan[k..].iter().all(|f| *f));
        if !is_monotone {
            other += 1;
            continue;
        }
        monotone += 1;
        match (first, found) {
            (None, found) => assert!(found.is_err()),
            (Some(k), found) => {
                let smallest = k as f64 / f64::from(n);
                let u = found.expect("a dense scan finds one").u;
                let below = if k == 0 { 0.0 } else { smallest - 1.0 / f64::from(n) };
                assert!(u <= smallest + settings.u_tolerance && u >= below, "{u}, by dense scan {smallest}");
                beyond_start += usize::from(k > 0);
            }
        }
    }
    assert!(monotone >= 20 && beyond_start >= 10, "{monotone} monotone, {other} not, {beyond_start} beyond the start");
}

#[test]
fn seating_never_exceeds_its_limit_and_leaves_no_gouge() {
    // Coarse facets: the smooth normal leans against them.
    let spec = PatchSpec::new([200.0, 200.0], 4.0, [1.2, 1.0]).unwrap();
    let mesh = patch(&spec, 24, 24).unwrap();
    let (tree, bins) = (MeshTree::new(&mesh), Bins::new(&mesh, 5.0));
    let machine = Machine::head_b_table_c().unwrap();
    let mut random = Random(7);
    let (mut lifted, mut refused, mut tried) = (0, 0, 0);
    for (radius, corner, max_lift) in [(16.0, 2.0, 0.3), (12.0, 0.0, 0.15), (10.0, 10.0, 0.1)] {
        let tool = tool(radius, corner);
        let cell = workcell(&machine, &tool, &tree, Isometry3::translation(0.0, 0.0, MOUNT), max_lift);
        let test = PoseTest::new(&cell);
        for _ in 0..150 {
            let cc = cc_on_patch(&spec, 70.0, &mut random);
            let posture = Posture { tilt: random.between(0.05, 0.4), rotate: random.between(-1.4, 1.4) };
            tried += 1;
            let Ok(pose) = test.try_posture(&cc, posture, None, &mut Hints::default()) else {
                refused += 1;
                continue;
            };
            assert!((0.0..=max_lift).contains(&pose.lift), "{}", pose.lift);
            let depth = bins.depth(&solid(tool.cutter()), &pose.cl.tip, &pose.cl.axis);
            assert!(depth <= cell.gouge_tolerance + 1e-6, "{depth} mm deep, lifted by {}", pose.lift);
            if pose.lift > 0.0 {
                lifted += 1;
                // Not lifted for nothing: a resolution lower, the cutter was deeper than its test
                // body forgives.
                let lower = pose.cl.tip - cc.normal.into_inner() * (pose.lift - cell.lift_resolution).min(pose.lift);
                let before = bins.depth(&solid(tool.cutter()), &(lower - cc.normal.into_inner() * 2e-3), &pose.cl.axis);
                assert!(before > 0.5 * cell.gouge_tolerance, "{before}");
            }
        }
    }
    assert!(lifted > 30 && refused < tried, "{lifted} lifted, {refused} refused of {tried}");
}

#[test]
fn a_rigid_motion_of_part_and_mounting_moves_the_plan_with_it() {
    let spec = PatchSpec::new([200.0, 200.0], 5.0, [1.2, 1.0]).unwrap();
    let mesh = patch(&spec, 80, 80).unwrap();
    let machine = Machine::head_b_table_c().unwrap();
    let tool = tool(12.0, 1.5);
    let passes: Vec<Vec<CcPoint>> = (0..4)
        .map(|k| {
            let y = -45.0 + 30.0 * f64::from(k);
            let at = |x: f64| spec.at(x, y);
            (0..25)
                .map(|j| {
                    let x = -60.0 + 5.0 * f64::from(j);
                    let (p, ahead) = (at(x), at(x + 0.01).point);
                    CcPoint::new(p.point, p.normal.into_inner(), ahead - p.point).unwrap()
                })
                .collect()
        })
        .collect();
    let settings =
        PassSettings { search: SearchSettings::default(), mode: PostureMode::Smallest, max_turn_per_mm: 0.02 };
    let curve = curve([10.0, 20.0], [0.0, -60.0], SearchOrder::TiltFirst);
    let table_from_work = Isometry3::translation(0.0, 0.0, MOUNT);
    let plan = |moved: &Isometry3<f64>| {
        let tree = MeshTree::new(&mesh.transformed(moved));
        let cell = workcell(&machine, &tool, &tree, table_from_work * moved.inverse(), 0.06);
        let tasks: Vec<PassTask> = passes
            .iter()
            .map(|p| PassTask {
                pass: Pass::new(p.iter().map(|cc| cc.transformed(moved)).collect()),
                curve,
                strips: Vec::new(),
                given: Vec::new(),
            })
            .collect();
        plan_passes(&PoseTest::new(&cell), &tasks, &settings, &Silent).unwrap()
    };
    let still = plan(&Isometry3::identity());
    let planned = still.iter().flat_map(|p| &p.outcomes.points).filter(|o| o.is_ok()).count();
    assert!(planned > 80, "only {planned} planned");
    let mut random = Random(13);
    for _ in 0..3 {
        let motion = random.motion(400.0);
        for (a, b) in still
            .iter()
            .zip(plan(&motion))
            .flat_map(|(a, b)| a.outcomes.points.iter().copied().zip(b.outcomes.points).collect::<Vec<_>>())
        {
            let (Ok(a), Ok(b)) = (&a, &b) else {
                assert!(a.is_err() && b.is_err(), "planned in one place only: {a:?} {b:?}");
                continue;
            };
            let meant: ClPoint = a.cl.transformed(&motion);
            // Rounding may end the bisection of the lift one step apart.
            assert!((meant.tip - b.cl.tip).norm() < 2e-3, "{meant:?} {b:?}");
            assert!((meant.axis.into_inner() - b.cl.axis.into_inner()).norm() < 1e-6);
            for k in 0..a.configuration.axes.len() {
                assert!(
                    (a.configuration.axes.get_or_zero(k) - b.configuration.axes.get_or_zero(k)).abs() < 5e-3,
                    "axis {k}: {a:?} {b:?}"
                );
            }
        }
    }
}

/// A random pose of a test body such that its lowest place is near a wanted gap above a surface
/// point.
fn random_axis(random: &mut Random, near: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    Unit::new_normalize(near.into_inner() + 0.6 * random.direction().into_inner())
}

/// Distance of a point from the undilated test body, by own formula.
fn core_distance(body: &RoundFrustum, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>, p: &Point3<f64>) -> f64 {
    assert_eq!(body.radius_low, body.radius_high, "a cutter's test body is a cylinder");
    let (rho, z) = in_tool(tip, axis, p);
    (rho - body.radius_low).max(0.0).hypot((body.z_low - z).max(z - body.z_high).max(0.0))
}

/// Gap between test body and part over many random poses near contact: the verdict must be free
/// above `band.1` and a hit below `-band.0`. `gap` is the closed form.
fn verdicts_agree(
    tree: &MeshTree,
    what: &str,
    band: (f64, f64),
    random: &mut Random,
    contact: impl Fn(&mut Random) -> (Point3<f64>, Unit<Vector3<f64>>),
    gap: impl Fn(&RoundFrustum, &Point3<f64>, &Unit<Vector3<f64>>) -> f64,
) {
    let (mut free, mut hit, mut within) = (0, 0, 0);
    for k in 0..600 {
        let (radius, corner) = [(25.0, 2.0), (16.0, 0.0), (8.0, 8.0), (20.0, 6.0)][k % 4];
        let cutter = Cutter::new(radius, corner, 20.0).unwrap();
        let body = cutter.lower_test_body([0.0, 0.02, 0.5][k % 3]);
        let (place, normal) = contact(random);
        let axis = random_axis(random, &normal);
        // Moved along the normal until the gap is about what is wanted: it grows by at most the
        // way.
        let wanted = random.between(-0.3, 0.3);
        let mut tip = place + normal.into_inner() * wanted;
        for _ in 0..40 {
            tip += normal.into_inner() * (0.8 * (wanted - gap(&body, &tip, &axis)));
        }
        let gap = gap(&body, &tip, &axis);
        let verdict = tree.verdict(&Solid::Frustum(body), &tool_frame(&ClPoint { tip, axis }), None);
        if gap > band.1 {
            assert!(verdict.is_free(), "{what}: hit with a gap of {gap}: {body:?} {tip} {axis:?}");
            free += 1;
        } else if gap < -band.0 {
            assert!(!verdict.is_free(), "{what}: free with a gap of {gap}: {body:?} {tip} {axis:?}");
            hit += 1;
        } else {
            within += 1;
        }
    }
    assert!(free > 100 && hit > 100, "{what}: {free} free, {hit} hit, {within} within the band");
}

/// Largest distance of the facets from the surface, sampled densely, with a fifth more for what
/// lies between samples.
fn chord_error(mesh: &TriMesh, part: &AnalyticPart) -> f64 {
    let mut worst = 0.0;
    for k in 0..mesh.triangles().len() {
        let [a, b, c] = mesh.corners(k);
        for (u, v) in [(1. / 3., 1. / 3.), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5), (0.25, 0.25), (0.5, 0.25), (0.25, 0.5)] {
            let p = a + (b - a) * u + (c - a) * v;
            if let Some(s) = part.project(&p) {
                worst = f64::max(worst, (s.point - p).norm());
            }
        }
    }
    1.2 * worst
}

#[test]
fn gouge_verdict_on_a_plane_is_the_closed_form() {
    let part = AnalyticPart::new(AnalyticShape::Plane { size: [400.0, 400.0] }).unwrap();
    let tree = MeshTree::new(&part.mesh(20).unwrap());
    // Lowest point of a cylinder: its lower end, lower by the radius times the sine of its lean.
    let gap = |body: &RoundFrustum, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>| {
        let sin = axis.x.hypot(axis.y);
        tip.z + (body.z_low * axis.z).min(body.z_high * axis.z) - body.radius_low * sin - body.rounding
    };
    let contact = |random: &mut Random| {
        (Point3::new(random.between(-90.0, 90.0), random.between(-90.0, 90.0), 0.0), Vector3::z_axis())
    };
    verdicts_agree(&tree, "plane", (1e-9, 1e-9), &mut Random(1), contact, gap);
}

#[test]
fn gouge_verdict_on_a_sphere_is_the_closed_form_outside_the_chord_error() {
    let radius = 120.0;
    let part = AnalyticPart::new(AnalyticShape::Sphere { radius, material: MaterialSide::Inside }).unwrap();
    let mesh = part.mesh(90).unwrap();
    let band = chord_error(&mesh, &part);
    assert!(band < 0.05, "{band}");
    let gap = |body: &RoundFrustum, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>| {
        core_distance(body, tip, axis, &Point3::origin()) - body.rounding - radius
    };
    let contact = |random: &mut Random| {
        let normal = random.direction();
        (Point3::from(normal.into_inner() * radius), normal)
    };
    // Facets lie inside the ball, so a body that is free of it is free of them.
    verdicts_agree(&MeshTree::new(&mesh), "sphere", (band, 1e-9), &mut Random(2), contact, gap);
}

#[test]
fn gouge_verdict_on_a_torus_is_the_closed_form_outside_the_chord_error() {
    let (major, minor) = (150.0, 60.0);
    let part = AnalyticPart::new(AnalyticShape::Torus { major_radius: major, minor_radius: minor }).unwrap();
    let mesh = part.mesh(400).unwrap();
    let band = chord_error(&mesh, &part);
    assert!(band < 0.05, "{band}");
    let circle = |angle: f64| Point3::new(major * angle.cos(), major * angle.sin(), 0.0);
    // Nearest point of the circle of centres: of 120 arcs the three best, each searched.
    let gap = |body: &RoundFrustum, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>| {
        let n = 120;
        let arc = TAU / f64::from(n);
        let at = |angle: f64| core_distance(body, tip, axis, &circle(angle));
        let mut arcs: Vec<(f64, f64)> = (0..n).map(|k| (at(f64::from(k) * arc), f64::from(k) * arc)).collect();
        arcs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = |angle: f64| golden_least(SECTIONS, |t| at(angle + (2.0 * t - 1.0) * arc));
        arcs[..3].iter().map(|a| best(a.1)).fold(f64::INFINITY, f64::min) - body.rounding - minor
    };
    let contact = |random: &mut Random| {
        let (u, v) = (random.between(0.0, TAU), random.between(0.0, TAU));
        let out = Vector3::new(u.cos(), u.sin(), 0.0);
        let normal = Unit::new_normalize(out * v.cos() + Vector3::z() * v.sin());
        (Point3::from(out * major + normal.into_inner() * minor), normal)
    };
    verdicts_agree(&MeshTree::new(&mesh), "torus", (band, band), &mut Random(3), contact, gap);
}
