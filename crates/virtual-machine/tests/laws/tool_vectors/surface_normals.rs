//! Normals of Heidenhain's LN: wrong ones are reported at their lines, and those that facets and
//! rounding may turn are not.

use facemill_cl_data::{CcPoint, Posture};
use facemill_interference::MeshTree;
use facemill_surface_model::TriMesh;
use facemill_test_kit::Random;
use facemill_tool_model::cl_from_cc;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use super::*;

/// Lines before the first LN.
const HEAD: u32 = 6;

/// Returns a vector turned by an angle (deg) to any side.
fn turned(random: &mut Random, v: &Vector3<f64>, deg: f64) -> Vector3<f64> {
    let side = v.cross(&Vector3::new(0.31, -0.52, 0.77)).normalize();
    let about = UnitQuaternion::from_axis_angle(&Unit::new_normalize(*v), std::f64::consts::TAU * random.unit()) * side;
    UnitQuaternion::from_axis_angle(&Unit::new_normalize(about), deg.to_radians()) * v
}

/// A surface that is cut, and cuts on it: the pose, and the normal where the cutter touches.
struct Cuts {
    part: MeshTree,
    poses: Vec<Pose>,
    normals: Vec<Vector3<f64>>,
}

impl Cuts {
    /// Of contact points with a tilt (deg), each `above` the surface.
    fn new(part: MeshTree, points: Vec<(Point3<f64>, Vector3<f64>, Vector3<f64>)>, tilt: f64, above: f64) -> Self {
        let tool = kit::tool();
        let posture = Posture { tilt: tilt.to_radians(), rotate: 0.2 };
        let pose = |(at, normal, feed): &(Point3<f64>, Vector3<f64>, Vector3<f64>)| -> Pose {
            let cc = CcPoint::new(at + normal * above, *normal, *feed).unwrap();
            let cl = cl_from_cc(tool.cutter(), &cc, posture);
            (cl.tip.coords.into(), cl.axis.into_inner().into())
        };
        Self { part, poses: points.iter().map(pose).collect(), normals: points.iter().map(|p| p.1).collect() }
    }

    /// A closed box, cut on its top.
    fn plate(above: f64) -> Self {
        let point = |k: usize| {
            let (sin, cos) = (0.05 * k as f64).sin_cos();
            (Point3::new(40.0 * cos, 40.0 * sin, 0.0), Vector3::z(), Vector3::new(-sin, cos, 0.0))
        };
        let part = MeshTree::new(&kit::box_mesh([-200.0, -200.0, -80.0], [200.0, 200.0, 0.0]));
        Self::new(part, (0..40).map(point).collect(), 18.0, above)
    }

    /// A sheet of facets on a sphere, cut around its pole and, at the last points, so near its
    /// border that the cutter reaches beyond it.
    fn dome() -> Self {
        const RADIUS: f64 = 120.0;
        let normal = |polar: f64, turn: f64| {
            let (sin, cos) = polar.sin_cos();
            Vector3::new(sin * turn.cos(), sin * turn.sin(), cos)
        };
        let (vertices, triangles) = facemill_test_kit::cap_mesh(RADIUS, 0.06 * 14.0, [14, 72]);
        let point = |k: usize| {
            let (polar, turn) = (0.5 + 0.0085 * k as f64, 0.06 * k as f64);
            let normal = normal(polar, turn);
            (Point3::from(normal * RADIUS), normal, Vector3::new(-turn.sin(), turn.cos(), 0.0))
        };
        let part = MeshTree::new(&TriMesh::new(vertices, triangles).unwrap());
        Self::new(part, (0..40).map(point).collect(), 12.0, 0.0)
    }

    /// First lines and angles of the normals that are reported when a program names these.
    fn reported(&self, normals: &[Vector3<f64>]) -> Vec<(u32, f64)> {
        let shop = shop();
        let text = with_normals(&shop, &self.poses, |k| normals[k].into());
        let program = read_program(&text, Dialect::Heidenhain).unwrap();
        let mut setup = setup(&shop, Dialect::Heidenhain);
        setup.obstacles.truncate(1);
        setup.obstacles[0].mesh = &self.part;
        let found = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap();
        assert!(found.findings.iter().all(|f| f.kind != FindingKind::UnknownPosition), "{:?}", super::reported(&found));
        let wrong = found.findings.iter().filter(|f| f.kind == FindingKind::OtherNormal);
        wrong.map(|f| (f.first_line, f.measure.unwrap().value())).collect()
    }
}

#[test]
fn normals_of_the_surface_and_those_ten_degrees_off_are_not_reported() {
    let mut rng = Random(5);
    for cuts in [Cuts::plate(0.0), Cuts::plate(0.3), Cuts::dome()] {
        assert_eq!(cuts.reported(&cuts.normals), []);
        let off: Vec<_> = cuts.normals.iter().map(|n| turned(&mut rng, n, 10.0)).collect();
        assert_eq!(cuts.reported(&off), []);
    }
}

/// Every third normal is turned to any side by 45 deg, or round: each is reported with its line and
/// angle.
#[test]
fn normals_that_are_turned_or_flipped_are_reported_each_by_its_line() {
    let mut rng = Random(11);
    for cuts in [Cuts::plate(0.0), Cuts::dome()] {
        let mut normals = cuts.normals.clone();
        let mut expected = Vec::new();
        for k in (2..38).step_by(3) {
            let is_flipped = k % 2 == 0;
            normals[k] = if is_flipped { -normals[k] } else { turned(&mut rng, &normals[k], 45.0) };
            let axis = Vector3::from(unit(cuts.poses[k].1));
            let off = if is_flipped { normals[k].angle(&axis).to_degrees() } else { 45.0 };
            // LN lines begin with the second pose.
            expected.push((HEAD + k as u32, off));
        }
        let reports = cuts.reported(&normals);
        assert_eq!(reports.len(), expected.len(), "{reports:?}");
        for (reports, expected) in reports.iter().zip(expected) {
            // Facets of the dome turn its normals by up to 3 deg.
            assert!(reports.0 == expected.0 && (reports.1 - expected.1).abs() < 4.0, "{reports:?} {expected:?}");
        }
    }
}

/// A normal toward the tool's back is a fault even where no part is; others are compared with a
/// surface alone, and in cuts.
#[test]
fn away_from_the_part_only_normals_that_point_away_from_the_tool_are_reported() {
    let cuts = Cuts::plate(20.0);
    let mut rng = Random(3);
    let mut normals: Vec<_> = cuts.normals.iter().map(|n| turned(&mut rng, n, 45.0)).collect();
    assert_eq!(cuts.reported(&normals), []);
    normals[7] = -normals[7];
    let reports = cuts.reported(&normals);
    assert!(reports.len() == 1 && reports[0].0 == HEAD + 7 && reports[0].1 > 91.1, "{reports:?}");
    let at_rapid = |text: String| text.replace("LN", "LN FMAX");
    let shop = shop();
    let text = at_rapid(with_normals(&shop, &cuts.poses, |k| normals[k].into()));
    let found = run(&shop, &text, Dialect::Heidenhain);
    assert!(found.n_blocks > 39 && found.cutting_length_mm < 200.0, "rapids");
    assert!(found.findings.iter().all(|f| f.kind != FindingKind::OtherNormal), "{:?}", super::reported(&found));
}
