//! Laws of the moves that do not cut, and of the reasons why a posture cannot be taken.

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_cutter_location::approach::{ApproachSettings, ApproachShape, PassEnd, approach, arc_poses};
use facemill_cutter_location::link::{ClearanceSurface, LinkSettings, between, link, way_out};
use facemill_cutter_location::{AxisCone, Hints, Infeasible, Obstacle, PoseTest, Workcell};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{BranchPreference, Machine};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile, cl_from_cc};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

fn tool() -> ToolAssembly {
    let section =
        |length_mm, diameter_mm| Section { length_mm, diameter_low_mm: diameter_mm, diameter_high_mm: diameter_mm };
    ToolAssembly::new(ToolFile {
        format: FormatTag::V1,
        name: "mill".to_owned(),
        number: 1,
        radius_mm: 20.0,
        corner_radius_mm: 2.0,
        n_inserts: 4,
        flute_length_mm: 8.0,
        dead_core_radius_mm: 10.0,
        max_ramp_angle_deg: 3.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: 48.0,
        gauge_length_mm: 148.0,
        body: Stack { clearance_mm: 1.0, sections: vec![section(40.0, 32.0)] },
        holder: Stack { clearance_mm: 2.0, sections: vec![section(100.0, 60.0)] },
    })
    .unwrap()
}

/// Closed box from `min` to `max`, wound outward.
fn block(min: [f64; 3], max: [f64; 3]) -> TriMesh {
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let vertices = (0..8).map(|k| Point3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[p, q, r, s]: &[u32; 4]| [[p, q, r], [p, r, s]]).collect();
    TriMesh::new(vertices, triangles).unwrap()
}

/// A slab with its top at z = 0, with or without a wall across the middle.
fn slab(wall: bool) -> TriMesh {
    let slab = block([-200.0, -100.0, -40.0], [200.0, 100.0, 0.0]);
    if wall { slab.joined(&block([-10.0, -100.0, -1.0], [10.0, 100.0, 90.0])) } else { slab }
}

struct Scene {
    machine: Machine,
    tool: ToolAssembly,
    tree: MeshTree,
}

impl Scene {
    fn new(mesh: &TriMesh) -> Self {
        Self { machine: Machine::head_b_table_c().unwrap(), tool: tool(), tree: MeshTree::new(mesh) }
    }

    fn cell(&self, stock: f64) -> Workcell<'_> {
        Workcell {
            machine: &self.machine,
            table_from_work: Isometry3::translation(0.0, 0.0, 500.0),
            tool: &self.tool,
            obstacles: vec![Obstacle {
                name: "part".to_owned(),
                mesh: &self.tree,
                gouge_allowance: Some(0.0),
                collision_allowance: stock,
            }],
            preferred_branch: BranchPreference::Positive,
            axis_cone: None,
            gouge_tolerance: 0.02,
            max_lift: 0.05,
            lift_resolution: 1e-3,
            z_map: None,
        }
    }
}

fn settings() -> LinkSettings {
    let clearance = ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, 120.0), normal: Vector3::z_axis() };
    LinkSettings { clearance, rapid_clearance: 4.0 }
}

fn pose(x: f64, z: f64) -> ClPoint {
    ClPoint { tip: Point3::new(x, 0.0, z), axis: Unit::new_normalize(Vector3::new(0.05, 0.02, 1.0)) }
}

/// Smallest distance along a way, sampled every 0.25 mm or so.
fn nearest(test: &PoseTest<'_>, way: &[ClPoint]) -> f64 {
    let mut hints = Hints::default();
    let legs = way.windows(2).flat_map(|w| {
        let n = ((w[1].tip - w[0].tip).norm() / 0.25).ceil().max(1.0) as usize;
        (0..=n).map(move |k| between(&w[0], &w[1], k as f64 / n as f64)).collect::<Vec<_>>()
    });
    legs.map(|p| test.rapid_distance(&p, 50.0, &mut hints).unwrap().0).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_link_over_an_open_slab_is_direct() {
    let scene = Scene::new(&slab(false));
    let cell = scene.cell(0.0);
    let test = PoseTest::new(&cell);
    let way = link(&test, &settings(), &pose(-120.0, 10.0), &pose(120.0, 10.0), &mut Hints::default()).unwrap();
    assert!(way.is_empty(), "{way:?}");
}

#[test]
fn a_link_goes_over_a_wall_and_keeps_the_rapid_clearance_all_along() {
    let scene = Scene::new(&slab(true));
    let cell = scene.cell(1.0);
    let test = PoseTest::new(&cell);
    let (from, to) = (pose(-120.0, 12.0), pose(120.0, 12.0));
    let way = link(&test, &settings(), &from, &to, &mut Hints::default()).unwrap();
    assert!(!way.is_empty(), "the wall is in the straight way");
    let whole: Vec<ClPoint> = std::iter::once(from).chain(way).chain(std::iter::once(to)).collect();
    let distance = nearest(&test, &whole);
    assert!(distance >= settings().rapid_clearance - 0.3, "{distance}");
}

#[test]
fn a_way_out_ends_outside_the_clearance_surface_with_the_whole_cutter() {
    let scene = Scene::new(&slab(true));
    let cell = scene.cell(0.0);
    let test = PoseTest::new(&cell);
    let surfaces = [
        settings().clearance,
        ClearanceSurface::Cylinder { origin: Point3::origin(), axis: Vector3::x_axis(), radius: 150.0 },
        ClearanceSurface::Sphere { center: Point3::origin(), radius: 260.0 },
    ];
    for clearance in surfaces {
        let settings = LinkSettings { clearance, rapid_clearance: 4.0 };
        let way = way_out(&test, &settings, &pose(-120.0, 12.0), &mut Hints::default()).unwrap();
        let end = way.last().unwrap();
        assert!(clearance.height(&end.tip) >= scene.tool.cutter().radius() - 1e-6, "{clearance:?}");
    }
}

fn cc() -> CcPoint {
    CcPoint::new(Point3::new(150.0, 0.0, 0.0), Vector3::z(), -Vector3::x()).unwrap()
}

#[test]
fn arcs_leave_the_pass_along_the_feed_and_a_roll_in_comes_from_the_finished_side() {
    let scene = Scene::new(&slab(false));
    let cl = cl_from_cc(scene.tool.cutter(), &cc(), Posture { tilt: 0.05, rotate: 0.0 });
    for (end, sign) in [(PassEnd::Entry, -1.0), (PassEnd::Exit, 1.0)] {
        for shape in [
            ApproachShape::TangentialArc { radius: 100.0, angle: 0.5 },
            ApproachShape::RollIn { radius: 100.0, angle: 0.5 },
        ] {
            for uncut_left in [false, true] {
                let poses = arc_poses(shape, end, &cc(), &cl, uncut_left, 0.01);
                let first = (poses[0].tip - cl.tip).normalize();
                assert!((first - cc().feed.into_inner() * sign).norm() < 1e-3, "tangent to the pass");
                let last = poses.last().unwrap().tip - cl.tip;
                assert!(last.dot(&cc().normal) > 0.0, "away from the surface");
                if let ApproachShape::RollIn { .. } = shape {
                    let to_left = last.dot(&cc().left());
                    assert_eq!(to_left > 0.0, !uncut_left, "on the finished side");
                }
            }
        }
    }
}

#[test]
fn an_approach_ends_clear_of_the_stock_and_enters_it_no_steeper_than_the_tool_may() {
    let scene = Scene::new(&slab(false));
    let stock = 1.5;
    let cell = scene.cell(stock);
    let test = PoseTest::new(&cell);
    let cl = cl_from_cc(scene.tool.cutter(), &cc(), Posture { tilt: 0.05, rotate: 0.0 });
    let settings = |radius: f64, angle: f64| ApproachSettings {
        shape: ApproachShape::TangentialArc { radius, angle },
        step: radius / 80.0,
        rapid_clearance: 4.0,
        max_retract: 300.0,
    };
    let flat =
        approach(&test, &settings(400.0, 0.3), PassEnd::Entry, &cc(), &cl, false, &mut Hints::default()).unwrap();
    let end = flat.outward.last().unwrap();
    let (distance, _) = test.rapid_distance(end, 50.0, &mut Hints::default()).unwrap();
    assert!(distance >= 4.0 - 1e-9, "{distance}");
    let steep = approach(&test, &settings(8.0, 1.4), PassEnd::Entry, &cc(), &cl, false, &mut Hints::default());
    assert!(matches!(steep, Err(Infeasible::Ramp { .. })), "{steep:?}");
    // An exit goes up and may be as steep as it likes.
    assert!(approach(&test, &settings(8.0, 1.4), PassEnd::Exit, &cc(), &cl, false, &mut Hints::default()).is_ok());
}

#[test]
fn every_reason_is_found_and_named() {
    let scene = Scene::new(&slab(true));
    let up = Posture { tilt: 0.05, rotate: 0.0 };
    let mut hints = Hints::default();
    let mut cell = scene.cell(0.0);
    let reason = |cell: &Workcell<'_>, cc: &CcPoint, posture, hints: &mut Hints| {
        let test = PoseTest::new(cell);
        let why = test.try_posture(cc, posture, None, hints).unwrap_err();
        (why, test.describe(&why))
    };
    let at = |x: f64, feed: f64| CcPoint::new(Point3::new(x, 0.0, 0.0), Vector3::z(), Vector3::x() * feed).unwrap();
    assert!(PoseTest::new(&cell).try_posture(&at(100.0, -1.0), up, None, &mut hints).is_ok());

    // The disc lies behind the contact: 15 mm from the wall with the feed away from it, it reaches into the wall.
    let (why, text) = reason(&cell, &at(25.0, 1.0), up, &mut hints);
    assert!(matches!(why, Infeasible::Gouge { obstacle: 0, .. }) && text == "cutter gouges part", "{text}");

    // Leaning over the wall with the feed toward it, the cutter is clear and the holder is not.
    let (why, text) = reason(&cell, &at(40.0, -1.0), Posture { tilt: 0.6, rotate: 0.0 }, &mut hints);
    assert!(matches!(why, Infeasible::Collision { .. }) && text.ends_with("hits part"), "{text}");

    cell.axis_cone = Some(AxisCone { axis: Vector3::z_axis(), half_angle: 0.01 });
    let (why, _) = reason(&cell, &at(100.0, -1.0), up, &mut hints);
    let Infeasible::OutsideCone { excess } = why else { panic!("{why:?}") };
    assert!((excess - 0.04).abs() < 1e-9);
    cell.axis_cone = None;

    cell.table_from_work = Isometry3::translation(0.0, 0.0, 6000.0);
    let (why, text) = reason(&cell, &at(100.0, -1.0), up, &mut hints);
    assert!(matches!(why, Infeasible::Unreachable(_)) && text.contains("axis Z"), "{text}");
}
