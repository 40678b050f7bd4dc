//! Laws of parts with closed forms: projection, normals and curvatures against each other and
//! against meshes.

use crate::kit;
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide, PatchSpec, SpecError, SurfacePoint, patch};
use nalgebra::{Point3, Vector3};
use proptest::{
    prelude::*,
    test_runner::{Config, TestRunner},
};

fn shapes() -> Vec<AnalyticPart> {
    use MaterialSide::{Inside, Outside};
    [
        AnalyticShape::Plane { size: [80.0, 50.0] },
        AnalyticShape::Sphere { radius: 40.0, material: Inside },
        AnalyticShape::Sphere { radius: 40.0, material: Outside },
        AnalyticShape::Cylinder { radius: 30.0, length: 70.0, material: Inside },
        AnalyticShape::Cylinder { radius: 30.0, length: 70.0, material: Outside },
        AnalyticShape::Torus { major_radius: 60.0, minor_radius: 20.0 },
        AnalyticShape::Saddle { size: [60.0, 60.0], concave_radius: 50.0, convex_radius: 80.0 },
    ]
    .map(|shape| AnalyticPart::new(shape).expect("in range"))
    .to_vec()
}

fn runner(cases: u32) -> TestRunner {
    let rng = proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha);
    TestRunner::new_with_rng(Config { cases, failure_persistence: None, ..Config::default() }, rng)
}

fn check_frame(s: &SurfacePoint) -> Result<(), TestCaseError> {
    let [d1, d2] = s.directions;
    prop_assert!((d1.cross(&d2) - s.normal.into_inner()).norm() < 1e-12, "right-handed frame");
    prop_assert!(s.curvatures[0] >= s.curvatures[1]);
    Ok(())
}

/// The surface along a direction bends by the curvature: two points at ±h have their middle h²·k/2
/// inside.
fn check_curvatures(
    s: &SurfacePoint,
    project: impl Fn(Point3<f64>) -> Option<SurfacePoint>,
) -> Result<(), TestCaseError> {
    let h = 1e-3;
    for (k, d) in s.curvatures.into_iter().zip(s.directions) {
        let [a, b] = [h, -h].map(|step| project(s.point + d.into_inner() * step));
        let (Some(a), Some(b)) = (a, b) else { return Err(TestCaseError::fail("no foot near the surface")) };
        // Weingarten: the normal turns along the principal direction by k, outward where convex.
        let turn = (a.normal.into_inner() - b.normal.into_inner()) / (a.point - b.point).norm();
        prop_assert!((turn - d.into_inner() * k).norm() < 1e-5, "turn {turn}, k {k}");
    }
    Ok(())
}

#[test]
fn the_foot_is_the_closest_point_and_its_own_foot() {
    for part in shapes() {
        let law = |(x, y, z, u, v): (f64, f64, f64, f64, f64)| {
            let p = Point3::new(x, y, z);
            let Some(s) = part.project(&p) else { return Ok(()) };
            check_frame(&s)?;
            // The way to the foot is along the normal.
            let way = p - s.point;
            prop_assert!(way.cross(&s.normal).norm() < 1e-9 * (1.0 + way.norm()), "{way}");
            let again = part.project(&s.point).expect("a point of the surface has a foot");
            prop_assert!((again.point - s.point).norm() < 1e-9);
            prop_assert!((again.normal.into_inner() - s.normal.into_inner()).norm() < 1e-9);
            // No other point of the surface is closer.
            let tangent = s.directions[0].into_inner() * u + s.directions[1].into_inner() * v;
            if let Some(other) = part.project(&(s.point + tangent)) {
                prop_assert!((other.point - p).norm() > way.norm() - 1e-9);
            }
            check_curvatures(&s, |q| part.project(&q))
        };
        let place = || -90.0..90.0;
        runner(300).run(&(place(), place(), place(), -30.0..30.0, -30.0..30.0), law).expect("holds");
    }
}

#[test]
fn curvatures_have_the_sign_of_the_vocabulary() {
    use MaterialSide::{Inside, Outside};
    let at = |shape, p: [f64; 3]| AnalyticPart::new(shape).expect("in range").project(&p.into()).expect("a foot");
    assert_eq!(at(AnalyticShape::Sphere { radius: 5.0, material: Inside }, [9.0, 0.0, 0.0]).curvatures, [0.2, 0.2]);
    assert_eq!(at(AnalyticShape::Sphere { radius: 5.0, material: Outside }, [9.0, 0.0, 0.0]).curvatures, [-0.2, -0.2]);
    let bore = at(AnalyticShape::Cylinder { radius: 4.0, length: 9.0, material: Outside }, [3.0, 0.0, 1.0]);
    assert_eq!(bore.curvatures, [0.0, -0.25]);
    assert_eq!(bore.normal.into_inner(), -Vector3::x());
    assert_eq!(bore.directions[0].z.abs(), 1.0);
    let inner = at(AnalyticShape::Torus { major_radius: 10.0, minor_radius: 2.0 }, [7.0, 0.0, 0.0]);
    assert!((inner.curvatures[0] - 0.5).abs() < 1e-12 && (inner.curvatures[1] + 0.125).abs() < 1e-12);
    let saddle =
        at(AnalyticShape::Saddle { size: [9.0; 2], concave_radius: 20.0, convex_radius: 50.0 }, [0.0, 0.0, 1.0]);
    assert!((saddle.curvatures[0] - 0.02).abs() < 1e-12 && (saddle.curvatures[1] + 0.05).abs() < 1e-12);
    assert!(saddle.directions[0].y.abs() > 0.999_999);
}

#[test]
fn ambiguous_points_have_no_foot() {
    let part = |shape| AnalyticPart::new(shape).expect("in range");
    let none = |shape, p: [f64; 3]| assert_eq!(part(shape).project(&p.into()), None);
    none(AnalyticShape::Sphere { radius: 5.0, material: MaterialSide::Inside }, [0.0; 3]);
    none(AnalyticShape::Cylinder { radius: 5.0, length: 5.0, material: MaterialSide::Inside }, [0.0, 0.0, 2.0]);
    let torus = AnalyticShape::Torus { major_radius: 10.0, minor_radius: 2.0 };
    none(torus, [0.0, 0.0, 7.0]);
    none(torus, [0.0, 10.0, 0.0]);
    let saddle = AnalyticShape::Saddle { size: [9.0; 2], concave_radius: 20.0, convex_radius: 50.0 };
    none(saddle, [0.0, 1.0, 40.0]);
    none(saddle, [1.0, 0.0, -90.0]);
    for shape in shapes() {
        assert_eq!(shape.project(&Point3::new(f64::NAN, 0.0, 0.0)), None);
        assert_eq!(shape.project(&Point3::new(0.0, f64::INFINITY, 0.0)), None);
    }
}

#[test]
fn meshes_lie_on_their_surface_and_face_out_of_the_material() {
    for part in shapes() {
        let mesh = part.mesh(24).expect("in range");
        for p in mesh.vertices() {
            let foot = part.project(p).expect("a point of the surface has a foot");
            assert!((p - foot.point).norm() < 1e-9, "{part:?}");
        }
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t);
            let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let normal = part.project(&centre).expect("near the surface").normal;
            assert!(mesh.scaled_normal(t).normalize().dot(&normal) > 0.98, "{part:?}: triangle {t}");
        }
        match part.shape() {
            AnalyticShape::Sphere { .. } | AnalyticShape::Torus { .. } => assert!(kit::is_closed(&mesh), "{part:?}"),
            _ => assert!(kit::is_consistent(&mesh) && !kit::is_closed(&mesh), "{part:?}"),
        }
    }
}

#[test]
fn the_patch_has_the_normals_and_curvatures_of_its_formula() {
    let spec = PatchSpec::new([200.0, 120.0], 8.0, [2.0, 1.5]).expect("in range");
    let law = |(x, y): (f64, f64)| {
        let s = spec.at(x, y);
        check_frame(&s)?;
        prop_assert!(s.point.z.abs() <= 8.0);
        let step = 1e-5;
        let along = |dx: f64, dy: f64| spec.at(x + dx, y + dy).point - spec.at(x - dx, y - dy).point;
        let normal = along(step, 0.0).cross(&along(0.0, step)).normalize();
        prop_assert!((normal - s.normal.into_inner()).norm() < 1e-8);
        check_curvatures(&s, |q| Some(spec.at(q.x, q.y)))
    };
    runner(500).run(&(-100.0..100.0, -60.0..60.0), law).expect("holds");
}

#[test]
fn the_patch_has_every_kind_of_curvature() {
    let spec = PatchSpec::new([200.0, 120.0], 8.0, [2.0, 1.5]).expect("in range");
    let kinds = (0..2000).map(|k| spec.at(f64::from(k % 50) * 4.0 - 100.0, f64::from(k / 50) * 3.0 - 60.0).curvatures);
    let [mut convex, mut concave, mut saddle] = [0; 3];
    for [k1, k2] in kinds {
        match (k1 > 0.0, k2 > 0.0) {
            (true, true) => convex += 1,
            (false, false) => concave += 1,
            _ => saddle += 1,
        }
    }
    assert!(convex > 200 && concave > 200 && saddle > 200, "{convex} {concave} {saddle}");
}

#[test]
fn the_patch_is_an_open_sheet_facing_up() {
    let spec = PatchSpec::new([50.0, 40.0], 3.0, [1.0, 1.0]).expect("in range");
    let mesh = patch(&spec, 31, 17).expect("in range");
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (32 * 18, 2 * 31 * 17));
    assert!(kit::is_consistent(&mesh) && !kit::is_closed(&mesh));
    assert!((0..mesh.triangles().len()).all(|t| mesh.scaled_normal(t).z > 0.0));
    assert_eq!(mesh.aabb().min.xy(), nalgebra::Point2::new(-25.0, -20.0));
    assert_eq!(mesh.aabb().max.xy(), nalgebra::Point2::new(25.0, 20.0));
}

#[test]
fn impossible_parts_are_refused() {
    assert!(PatchSpec::new([0.0, 1.0], 0.1, [1.0, 1.0]).is_err());
    assert!(PatchSpec::new([10.0, 10.0], f64::NAN, [1.0, 1.0]).is_err());
    assert!(PatchSpec::new([10.0, 10.0], 1.0, [1.0, -1.0]).is_err());
    let spec = PatchSpec::new([10.0, 10.0], 1.0, [1.0, 1.0]).expect("in range");
    assert!(patch(&spec, 0, 5).is_err() && patch(&spec, 5, usize::MAX).is_err());
    let refused = AnalyticPart::new(AnalyticShape::Torus { major_radius: 10.0, minor_radius: 10.0 });
    assert_eq!(refused, Err(SpecError::OutOfRange { field: "minor radius", value: 10.0, least: 1e-3, most: 9.5 }));
    let sphere = AnalyticPart::new(AnalyticShape::Sphere { radius: 1.0, material: MaterialSide::Inside }).expect("ok");
    assert!(sphere.mesh(1).is_err() && sphere.mesh(100_000).is_err());
}
