//! Scenes, and distances to spheres without meshes.

use facemill_cl_data::{CcPoint, ClPoint, Posture, RoundFrustum, Solid};
use facemill_cutter_location::links::link::Waypoint;
use facemill_cutter_location::{Configuration, Obstacle, SearchCurve, SearchOrder, Workcell};
use facemill_interference::Interference;
use facemill_inverse_kinematics::{AxisValues, Branch, BranchPreference, Carrier, Machine};
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide, PatchSpec};
use facemill_surface_model::TriMesh;
pub(crate) use facemill_test_kit::Random;
use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile};
use nalgebra::{Isometry3, Point3, Vector3};

/// Height of the workpiece frame above the table, mm.
pub(crate) const MOUNT: f64 = 900.0;

/// A mill with a thinner body and a holder; lengths in mm.
pub(crate) fn tool(radius: f64, corner_radius: f64, flute: f64) -> ToolAssembly {
    let section =
        |length_mm, diameter_mm| Section { length_mm, diameter_low_mm: diameter_mm, diameter_high_mm: diameter_mm };
    ToolAssembly::new(ToolFile {
        format: FormatTag::V1,
        name: "mill".to_owned(),
        number: 1,
        length_register: None,
        radius_mm: radius,
        corner_radius_mm: corner_radius,
        n_inserts: 4,
        flute_length_mm: flute,
        dead_core_radius_mm: 0.0,
        max_ramp_angle_deg: 3.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: flute + 40.0,
        gauge_length_mm: flute + 140.0,
        body: Stack { clearance_mm: 1.0, sections: vec![section(40.0, 1.5 * radius)] },
        holder: Stack { clearance_mm: 2.0, sections: vec![section(100.0, 60.0)] },
        assumed: Vec::new(),
    })
    .unwrap()
}

pub(crate) fn machine() -> Machine {
    Machine::head_b_table_c().unwrap()
}

pub(crate) fn obstacle<'a>(name: &str, mesh: &'a dyn Interference) -> Obstacle<'a> {
    Obstacle {
        name: name.to_owned(),
        mesh: mesh.into(),
        gouge_allowance: Some(0.0),
        collision_allowance: 0.0,
        machine_body: None,
        pieces: None,
    }
}

pub(crate) fn workcell<'a>(machine: &'a Machine, tool: &'a ToolAssembly, obstacles: Vec<Obstacle<'a>>) -> Workcell<'a> {
    Workcell {
        machine,
        table_from_work: Isometry3::translation(0.0, 0.0, MOUNT),
        tool,
        obstacles,
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift: 0.06,
        lift_resolution: 1e-3,
        z_map: None,
    }
}

/// Returns a pose with its configuration on a branch.
pub(crate) fn stand_on(cell: &Workcell<'_>, cl: &ClPoint, branch: Branch) -> Waypoint {
    let on_table = cl.transformed(&cell.table_from_work);
    let all = cell.machine.inverse(&on_table, cell.tool.gauge_length()).unwrap();
    let axes = all.on_branch(branch).unwrap_or_else(|| all.iter().next().unwrap()).values;
    Waypoint { cl: *cl, configuration: Configuration { axes, branch } }
}

/// Returns the same on the positive branch, which scenes here prefer.
pub(crate) fn stand(cell: &Workcell<'_>, cl: &ClPoint) -> Waypoint {
    stand_on(cell, cl, Branch::Positive)
}

pub(crate) fn posture_deg(tilt: f64, rotate: f64) -> Posture {
    Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() }
}

pub(crate) fn curve_deg(start: [f64; 2], end: [f64; 2], order: SearchOrder, weight: f64) -> SearchCurve {
    SearchCurve::new(posture_deg(start[0], start[1]), posture_deg(end[0], end[1]), order, weight).unwrap()
}

pub(crate) fn plane(size: f64) -> TriMesh {
    AnalyticPart::new(AnalyticShape::Plane { size: [size; 2] }).unwrap().mesh(8).unwrap()
}

/// A CC point of the plane z = 0 with the feed along +x.
pub(crate) fn cc_on_plane(x: f64, y: f64) -> CcPoint {
    CcPoint::new(Point3::new(x, y, 0.0), Vector3::z(), Vector3::x()).unwrap()
}

pub(crate) fn cc_on_patch(spec: &PatchSpec, x: f64, y: f64, feed: Vector3<f64>) -> CcPoint {
    let p = spec.at(x, y);
    CcPoint::new(p.point, p.normal.into_inner(), feed).unwrap()
}

/// A ball as an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    pub(crate) center: Point3<f64>,
    pub(crate) radius: f64,
}

impl Ball {
    /// Returns the largest distance of its mesh, whose facets lie inside the ball.
    pub(crate) fn chord_error(&self) -> f64 {
        self.radius * (1.0 - (0.5 * std::f64::consts::FRAC_PI_2 / N_BALL).cos().powi(2))
    }

    pub(crate) fn mesh(&self) -> TriMesh {
        let shape = AnalyticShape::Sphere { radius: self.radius, material: MaterialSide::Inside };
        let at_origin = AnalyticPart::new(shape).unwrap().mesh(N_BALL as usize).unwrap();
        at_origin.transformed(&Isometry3::from(self.center.coords))
    }
}

/// Quads along a quarter turn of a ball.
const N_BALL: f64 = 20.0;

/// Returns the distance from cutter, tool and head, dilated, to the nearest ball at a pose. From
/// the definition of the cutter (flute cylinder and corner torus) and the poses of the bodies;
/// without the interference of the crate under test.
pub(crate) fn distance_to_balls(cell: &Workcell<'_>, cl: &ClPoint, balls: &[Ball]) -> f64 {
    let length = cell.tool.gauge_length();
    let on_table = cl.transformed(&cell.table_from_work);
    let axes = cell.machine.nearest_inverse(&on_table, length, None, cell.preferred_branch).unwrap();
    distance_at(cell, &axes, balls)
}

/// Returns the same at axis values.
pub(crate) fn distance_at(cell: &Workcell<'_>, axes: &AxisValues, balls: &[Ball]) -> f64 {
    let length = cell.tool.gauge_length();
    let table_from_tool = cell.machine.forward(axes, length);
    let cutter = cell.tool.cutter();
    let (big, r) = (cutter.radius(), cutter.corner_radius());
    let cylinder = |radius, z_high, rounding| {
        Solid::Frustum(RoundFrustum { z_low: r, z_high, radius_low: radius, radius_high: radius, rounding })
    };
    let of_cutter = [cylinder(big - r, r, r), cylinder(big, cutter.flute_length(), 0.0)].map(|s| (s, table_from_tool));
    let of_tool = cell.tool.collision_bodies().into_iter().map(|b| (b.solid, table_from_tool * b.frame_from_solid));
    let of_head = cell.machine.body_poses(axes).filter(|p| p.body.carrier() == Some(Carrier::Head));
    let of_head = of_head.map(|p| (p.body.body.solid.clone(), p.table_from_solid));
    let solids: Vec<(Solid, Isometry3<f64>)> = of_cutter.into_iter().chain(of_tool).chain(of_head).collect();
    let to_ball = |ball: &Ball| {
        let center = cell.table_from_work * ball.center;
        let to_solid = |(solid, table_from_solid): &(Solid, Isometry3<f64>)| {
            solid.core_distance(&table_from_solid.inverse_transform_point(&center)) - solid.rounding()
        };
        solids.iter().map(to_solid).fold(f64::INFINITY, f64::min) - ball.radius
    };
    balls.iter().map(to_ball).fold(f64::INFINITY, f64::min)
}

/// Returns the smallest of [`distance_to_balls`] over a way, tip straight and axis turned in the
/// plane of its ends, `n` poses a leg.
pub(crate) fn smallest_distance(cell: &Workcell<'_>, way: &[ClPoint], n: usize, balls: &[Ball]) -> f64 {
    let mut smallest = f64::INFINITY;
    for leg in way.windows(2) {
        for k in 0..=n {
            let t = k as f64 / n as f64;
            let tip = leg[0].tip + (leg[1].tip - leg[0].tip) * t;
            let pose = ClPoint { tip, axis: leg[0].axis.slerp(&leg[1].axis, t) };
            smallest = smallest.min(distance_to_balls(cell, &pose, balls));
        }
    }
    smallest
}
