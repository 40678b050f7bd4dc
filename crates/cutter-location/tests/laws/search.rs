use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::{Hints, Infeasible, PoseTest, SearchOrder, SearchSettings, Workcell, search};
use facemill_interference::{MeshTree, ParryMesh};
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide, PatchSpec, patch};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::kit::{MOUNT, Random, cc_on_patch, curve_deg, machine, obstacle, posture_deg, tool, workcell};

#[test]
fn search_gives_the_smallest_feasible_u_of_a_dense_scan_in_both_orders_for_any_weight_and_sign() {
    const N: usize = 240;
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let tree = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let settings = SearchSettings { u_step: 0.05, u_tolerance: 0.002, ..SearchSettings::default() };
    let mut random = Random(5);
    for order in [SearchOrder::TiltFirst, SearchOrder::RotateFirst] {
        for weight in [0.3, 1.0, 4.0] {
            let one_sign = curve_deg([2.0, 0.0], [25.0, -80.0], order, weight);
            for curve in [one_sign, one_sign.mirrored()] {
                let mut beyond_start = 0;
                for _ in 0..14 {
                    let (x, y) = (random.between(-80.0, 80.0), random.between(-80.0, 80.0));
                    let cc = cc_on_patch(&spec, x, y, random.vector(1.0));
                    let free = |u: f64| test.try_posture(&cc, curve.at(u), None, &mut Hints::default()).is_ok();
                    let scan: Vec<bool> = (0..=N).map(|k| free(k as f64 / N as f64)).collect();
                    let found = search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default());
                    if let Ok(found) = found {
                        assert_eq!(found.pose.posture, curve.at(found.u));
                        assert!(found.pose.posture.rotate * curve.end().rotate >= 0.0);
                        let again = test.try_posture(&cc, curve.at(found.u), None, &mut Hints::default());
                        assert_eq!(again, Ok(found.pose), "re-tested without hints");
                    }
                    let first = scan.iter().position(|f| *f);
                    if first.is_some_and(|k| scan[k..].iter().any(|f| !f)) {
                        continue;
                    }
                    let Some(first) = first else {
                        assert!(found.is_err());
                        continue;
                    };
                    let smallest = first as f64 / N as f64;
                    let blocked = first.saturating_sub(1) as f64 / N as f64;
                    let u = found.expect("the dense scan finds one").u;
                    let largest = smallest + settings.u_tolerance;
                    assert!(blocked <= u && u <= largest, "u {u}, dense scan {smallest}");
                    beyond_start += usize::from(first > 0);
                }
                assert!(beyond_start >= 3, "{order:?} {weight}: only {beyond_start} beyond the start");
            }
        }
    }
}

#[test]
fn search_from_a_later_u_never_goes_below_it() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let tree = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let curve = curve_deg([2.0, 0.0], [25.0, -80.0], SearchOrder::TiltFirst, 1.0);
    let mut random = Random(6);
    let mut taken_at_once = 0;
    for _ in 0..60 {
        let (x, y, from) = (random.between(-80.0, 80.0), random.between(-80.0, 80.0), random.between(0.0, 1.0));
        let cc = cc_on_patch(&spec, x, y, Vector3::x());
        let at_once = test.try_posture(&cc, curve.at(from), None, &mut Hints::default()).is_ok();
        let found = search(&test, &cc, &curve, &SearchSettings::default(), from, None, &mut Hints::default());
        assert!(found.is_ok() || !at_once);
        if let Ok(found) = found {
            assert!(if at_once { found.u == from } else { found.u > from });
            taken_at_once += usize::from(at_once);
        }
    }
    assert!(taken_at_once > 10, "{taken_at_once}");
}

/// Radius and length of the hollow of the rear gouge tests, mm.
const HOLLOW: f64 = 500.0;
const N_HOLLOW: usize = 500;

/// Half a hollow cylinder along z, open toward +y.
fn hollow() -> TriMesh {
    let shape = AnalyticShape::Cylinder { radius: HOLLOW, length: 600.0, material: MaterialSide::Outside };
    let whole = AnalyticPart::new(shape).unwrap().mesh(N_HOLLOW).unwrap();
    let low = |t: &&[u32; 3]| t.iter().all(|v| whole.vertices()[*v as usize].y < -100.0);
    TriMesh::new(whole.vertices().to_vec(), whole.triangles().iter().filter(low).copied().collect()).unwrap()
}

/// At the bottom of the hollow, feeding around it.
fn cc_in_hollow() -> CcPoint {
    CcPoint::new(Point3::new(0.0, -HOLLOW, 0.0), Vector3::y(), Vector3::x()).unwrap()
}

fn with_y_up(cell: Workcell<'_>) -> Workcell<'_> {
    let up = UnitQuaternion::rotation_between(&Vector3::y(), &Vector3::z()).unwrap();
    let table_from_work = Isometry3::translation(0.0, 0.0, MOUNT) * up;
    Workcell { table_from_work, max_lift: 0.03, gouge_tolerance: 0.005, ..cell }
}

#[test]
fn rear_gouge_is_refused_on_a_concave_cylinder_below_the_closed_form_tilt() {
    let tree = MeshTree::new(&hollow());
    let machine = machine();
    for (radius, corner) in [(80.0, 6.0), (63.0, 0.0), (40.0, 15.0)] {
        let tool = tool(radius, corner, 40.0);
        let cell = with_y_up(workcell(&machine, &tool, vec![obstacle("hollow", &tree)]));
        let test = PoseTest::new(&cell);
        // The circle of corner centres starts HOLLOW − r from the axis; with tilt α its point
        // `back` behind comes as near to the surface again where back = 2·(HOLLOW − r)·sin α, and
        // the farthest one is 2·(R − r) behind.
        let closed_form = ((radius - corner) / (HOLLOW - corner)).asin();
        // Tolerance, lift and facets, seen from the front rim across the disc.
        let facets = HOLLOW * (1.0 - (std::f64::consts::PI / N_HOLLOW as f64).cos());
        let slack = (2.0 * cell.gouge_tolerance + cell.max_lift + facets) / (2.0 * (radius - corner));
        assert!(slack < 0.06f64.to_radians(), "the test says something");
        let at = |tilt: f64| {
            let posture = Posture { tilt, rotate: 0.0 };
            test.try_posture(&cc_in_hollow(), posture, None, &mut Hints::default())
        };
        for k in 0..=40 {
            let share = f64::from(k) / 40.0;
            let below = (closed_form - slack) * share;
            let refused = at(below);
            let Err(Infeasible::Gouge { obstacle: 0, place }) = refused else { panic!("tilt {below}: {refused:?}") };
            assert!(place.x < 0.0, "the trailing edge gouges, not {place}");
            let above = closed_form + slack + share * (0.25 - closed_form);
            assert!(at(above).is_ok(), "tilt {above}: {:?}", at(above));
        }
        let curve = curve_deg([0.0, 0.0], [15.0, 0.0], SearchOrder::TiltFirst, 1.0);
        let settings = SearchSettings { u_step: 0.1, u_tolerance: 1e-4, ..SearchSettings::default() };
        let found = search(&test, &cc_in_hollow(), &curve, &settings, 0.0, None, &mut Hints::default()).unwrap();
        let off = found.pose.posture.tilt - closed_form;
        assert!(off.abs() < slack + 1e-4, "{off} rad off the closed form");
    }
}

#[test]
fn a_seated_pose_is_lifted_no_more_than_it_needs() {
    // Coarse facets: the smooth normal leans against them.
    let spec = PatchSpec::new([200.0, 200.0], 6.0, [1.2, 1.0]).unwrap();
    let mesh = patch(&spec, 24, 24).unwrap();
    let (tree, plain) = (MeshTree::new(&mesh), ParryMesh::new(&mesh));
    let machine = machine();
    let mut random = Random(8);
    let (mut lifted, mut refused) = (0, 0);
    for (radius, corner, max_lift) in [(16.0, 2.0, 0.3), (12.0, 0.0, 0.02), (10.0, 10.0, 0.1), (25.0, 2.0, 0.03)] {
        let tool = tool(radius, corner, 20.0);
        let by_tree = Workcell { max_lift, ..workcell(&machine, &tool, vec![obstacle("part", &tree)]) };
        let by_parry = Workcell { max_lift, ..workcell(&machine, &tool, vec![obstacle("part", &plain)]) };
        let (test, reference) = (PoseTest::new(&by_tree), PoseTest::new(&by_parry));
        for _ in 0..60 {
            let cc = cc_on_patch(&spec, random.between(-70.0, 70.0), random.between(-70.0, 70.0), random.vector(1.0));
            let posture = posture_deg(random.between(1.0, 23.0), random.between(-80.0, 80.0));
            let Ok(pose) = test.try_posture(&cc, posture, None, &mut Hints::default()) else {
                refused += 1;
                continue;
            };
            assert!((0.0..=max_lift).contains(&pose.lift), "{}", pose.lift);
            assert!(reference.gouge(&pose.cl, &mut Hints::default()).is_none());
            if pose.lift > 0.0 {
                let lower = pose.cl.translated(cc.normal.into_inner() * (-2.0 * by_tree.lift_resolution));
                let blocked = reference.gouge(&lower, &mut Hints::default()).is_some();
                assert!(blocked || pose.lift < 2.0 * by_tree.lift_resolution, "lifted by {} for nothing", pose.lift);
                lifted += 1;
            }
        }
    }
    assert!(lifted > 20 && refused > 5, "{lifted} lifted, {refused} refused");
}
