//! Scenes shared by the benches: a wavy patch, a propeller blade, cutters, and postures over both.

pub mod peer;

use facemill_cl_data::{CcPoint, ClPoint, Posture, RoundBox, RoundFrustum, Solid};
use facemill_cutter_location::{Obstacle, SearchCurve, SearchOrder, Workcell};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{BranchPreference, Machine};
use facemill_sample_parts::blade;
use facemill_sample_parts::{BladeResolution, PatchSpec, PropellerSeries, PropellerSpec, blade_pose, patch};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill_test_kit::Random;
use facemill_tool_model::{Cutter, Section, SpindleRotation, Stack, ToolAssembly, ToolFile, cl_from_cc};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A mesh with CC points on it.
pub struct Scene {
    /// Name in the bench.
    pub name: &'static str,
    /// The mesh.
    pub mesh: TriMesh,
    /// CC points on its smooth surface.
    pub cc: Vec<CcPoint>,
}

/// Wavy patch of 200 mm with about 200,000 triangles.
///
/// # Panics
/// Never: the numbers are in range.
pub fn patch_scene(n_points: usize) -> Scene {
    let spec = PatchSpec::new([200.0, 200.0], 15.0, [1.1, 1.0]).expect("numbers are in range");
    let mesh = patch(&spec, 316, 316).expect("numbers are in range");
    let mut random = Random(1);
    let cc = (0..n_points)
        .map(|_| spec.at(170.0 * random.unit() - 85.0, 170.0 * random.unit() - 85.0))
        .map(|p| CcPoint::new(p.point, p.normal.into_inner(), Vector3::x()).expect("the patch is nowhere vertical"))
        .collect();
    Scene { name: "patch_200k", mesh, cc }
}

/// Suction side of a DTMB 4119 blade of 3,048 mm diameter, with the whole blade of about 200,000
/// triangles as mesh.
///
/// # Panics
/// Never: the numbers are in range.
pub fn blade_scene(n_points: usize) -> Scene {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0).expect("numbers are in range");
    let mesh = blade(&spec, BladeResolution::new(200, 240).expect("numbers are in range"));
    let surface = Surface::new(mesh.clone(), SurfaceSettings::default());
    let suction = mesh.groups()[0].triangles.clone();
    let mut random = Random(2);
    let mut cc = Vec::with_capacity(n_points);
    while cc.len() < n_points {
        let triangle = suction.start + (random.unit() * suction.len() as f64) as usize;
        let point = surface.point(triangle as u32, [1.0 / 3.0; 3]);
        let radius = point.position.x.hypot(point.position.y);
        // Where the sample job cuts: neither in the hub's corner nor on the tip.
        if (700.0..1480.0).contains(&radius) {
            let around = Vector3::new(-point.position.y, point.position.x, 0.0);
            cc.extend(CcPoint::new(point.position, surface.normal_at(&point).into_inner(), around));
        }
    }
    Scene { name: "blade_200k", mesh, cc }
}

/// Fifty passes of 200 points each over [`patch_scene`].
///
/// # Panics
/// Never: the numbers are in range.
pub fn patch_passes() -> Vec<Vec<CcPoint>> {
    let spec = PatchSpec::new([200.0, 200.0], 15.0, [1.1, 1.0]).expect("numbers are in range");
    let at = |x: f64, y: f64| {
        let p = spec.at(x, y);
        CcPoint::new(p.point, p.normal.into_inner(), Vector3::x()).expect("the patch is nowhere vertical")
    };
    let spread = |k: u32, n: u32| 170.0 * f64::from(k) / f64::from(n - 1) - 85.0;
    (0..50).map(|j| (0..200).map(|k| at(spread(k, 200), spread(j, 50))).collect()).collect()
}

/// Passes of about 10,000 points, 5 mm apart, over the suction side of [`blade_scene`]: on
/// cylinders about the shaft.
///
/// # Panics
/// Never: the numbers are in range.
pub fn blade_passes() -> Vec<Vec<CcPoint>> {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0).expect("numbers are in range");
    let mesh = blade(&spec, BladeResolution::new(200, 240).expect("numbers are in range"));
    let suction = mesh.groups()[0].triangles.clone();
    let surface = Surface::new(mesh, SurfaceSettings::default());
    let down = -Vector3::z_axis();
    (0..45)
        .map(|j| {
            let radius = 705.0 + 17.0 * f64::from(j);
            let step = 5.0 / radius;
            (0..(3.0 / step) as u32)
                .filter_map(|k| {
                    let (sin, cos) = (f64::from(k) * step - 1.5).sin_cos();
                    let above = Point3::new(radius * cos, radius * sin, 2000.0);
                    let hit = surface.ray(&above, &down, 4000.0)?;
                    let normal = surface.normal_at(&hit.point);
                    // Not over the edge.
                    let inside = suction.contains(&(hit.point.triangle as usize)) && normal.z > 0.5;
                    let cc = CcPoint::new(hit.point.position, normal.into_inner(), Vector3::new(sin, -cos, 0.0));
                    cc.ok().filter(|_| inside)
                })
                .collect()
        })
        .collect()
}

/// Wavy patch of 200 mm with n × n squares.
///
/// # Panics
/// When `n` is 0 or above what a mesh may have.
pub fn patch_mesh(n: usize) -> TriMesh {
    let spec = PatchSpec::new([200.0, 200.0], 15.0, [1.1, 1.0]).expect("numbers are in range");
    patch(&spec, n, n).expect("numbers are in range")
}

/// Four-bladed propeller of 500 mm without hub, with about n × n × 16.6 triangles.
///
/// # Panics
/// When `n` is below 8 or above 1600.
pub fn propeller_mesh(n: usize) -> TriMesh {
    let series = PropellerSeries::WageningenB { n_blades: 4, area_ratio: 0.7, pitch_ratio: 1.0 };
    let spec = PropellerSpec::new(series, 500.0).expect("numbers are in range");
    let first = blade(&spec, BladeResolution::new(n, n * 6 / 5).expect("numbers are in range"));
    (1..spec.n_blades()).fold(first.clone(), |all, k| all.joined(&first.transformed(&blade_pose(&spec, k))))
}

/// Poses with tilt 2° to 15° and rotate 0 to −85° at the CC points, lifted by `lift` along the
/// normal.
pub fn poses(cutter: &Cutter, cc: &[CcPoint], lift: f64) -> Vec<Isometry3<f64>> {
    let mut random = Random(3);
    cc.iter()
        .map(|cc| {
            let posture = Posture {
                tilt: (2.0 + 13.0 * random.unit()).to_radians(),
                rotate: (-85.0 * random.unit()).to_radians(),
            };
            frame(&cl_from_cc(cutter, cc, posture).translated(cc.normal.into_inner() * lift))
        })
        .collect()
}

/// A tool frame at a pose.
fn frame(cl: &ClPoint) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &cl.axis).unwrap_or_else(UnitQuaternion::identity);
    Isometry3::from_parts(Translation3::from(cl.tip.coords), turn)
}

/// Cutter, holder and box of the bench postures, tool frame: each with the pose of the solid.
pub fn bodies(cutter: &Cutter) -> Vec<(Solid, Isometry3<f64>)> {
    let holder = RoundFrustum {
        z_low: 50.0,
        z_high: 150.0,
        radius_low: 1.26 * cutter.radius(),
        radius_high: 1.26 * cutter.radius(),
        rounding: 0.0,
    };
    let head = RoundBox { half_extents: Vector3::new(100.0, 100.0, 150.0), rounding: 0.0 };
    vec![
        (Solid::Frustum(cutter.lower_test_body(0.0)), Isometry3::identity()),
        (Solid::Frustum(holder), Isometry3::identity()),
        (Solid::Box(head), Isometry3::translation(0.0, 0.0, 300.0)),
    ]
}

/// A face mill with arbor.
///
/// # Panics
/// Never: the lengths fit together.
pub fn tool(radius: f64, corner_radius: f64) -> ToolAssembly {
    let section =
        |length_mm, diameter_mm| Section { length_mm, diameter_low_mm: diameter_mm, diameter_high_mm: diameter_mm };
    let flute = 2.0 * corner_radius.max(3.0);
    ToolAssembly::new(ToolFile {
        format: facemill_tool_model::FormatTag::V1,
        name: "bench mill".to_owned(),
        number: 1,
        length_register: None,
        radius_mm: radius,
        corner_radius_mm: corner_radius,
        n_inserts: 6,
        flute_length_mm: flute,
        dead_core_radius_mm: 0.5 * radius,
        max_ramp_angle_deg: 2.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: flute + 40.0,
        gauge_length_mm: flute + 40.0 + 4.0 * radius,
        body: Stack { clearance_mm: 1.0, sections: vec![section(40.0, 1.8 * radius)] },
        holder: Stack { clearance_mm: 2.0, sections: vec![section(4.0 * radius, 1.2 * radius)] },
        assumed: Vec::new(),
    })
    .expect("lengths fit together")
}

/// The propeller mill with head B and table C.
///
/// # Panics
/// Never: the preset is valid.
pub fn machine() -> Machine {
    Machine::head_b_table_c().expect("the preset is valid")
}

/// The tool on the machine before a part on the table, 700 mm above its middle.
///
/// Seats by at most `max_lift` mm.
pub fn work_cell<'a>(machine: &'a Machine, tool: &'a ToolAssembly, part: &'a MeshTree, max_lift: f64) -> Workcell<'a> {
    Workcell {
        machine,
        table_from_work: Isometry3::translation(0.0, 0.0, 700.0),
        tool,
        obstacles: vec![Obstacle {
            name: "part".to_owned(),
            mesh: part.into(),
            gouge_allowance: Some(0.0),
            collision_allowance: 1.0,
            machine_body: None,
            pieces: None,
        }],
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift,
        lift_resolution: 0.002,
        z_map: None,
    }
}

/// Tilt 2° to 15°, rotate 0 to −85°, tilt first.
///
/// # Panics
/// Never: the ranges are valid.
pub fn search_curve() -> SearchCurve {
    let deg = |tilt: f64, rotate: f64| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() };
    SearchCurve::new(deg(2.0, 0.0), deg(15.0, -85.0), SearchOrder::TiltFirst, 1.0).expect("ranges are valid")
}

/// Reachable tool poses over the table of [`machine`].
pub fn table_poses(n: usize) -> Vec<ClPoint> {
    let mut random = Random(4);
    (0..n)
        .map(|_| {
            let tip = Point3::new(
                2000.0 * random.unit() - 1000.0,
                2000.0 * random.unit() - 1000.0,
                400.0 + 400.0 * random.unit(),
            );
            let lean = Vector3::new(random.unit() - 0.5, random.unit() - 0.5, 0.6);
            ClPoint { tip, axis: nalgebra::Unit::new_normalize(lean) }
        })
        .collect()
}
