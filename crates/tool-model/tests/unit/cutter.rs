use super::*;
use facemill_cl_data::Solid;
use nalgebra::Point3;

const CUTTERS: [(f64, f64, f64); 7] = [
    (25.0, 2.0, 50.0),
    (80.0, 6.0, 6.0),
    (80.0, 6.0, 6.3),
    (10.0, 0.0, 20.0),
    (10.0, 0.3, 5.0),
    (8.0, 8.0, 8.0),
    (8.0, 8.0, 30.0),
];
const TOLERANCES: [f64; 5] = [0.0, 0.01, 0.2, 0.5, 1.5];

/// Points of the cutter's boundary in its (radial, z) half plane, and some within.
fn profile(c: &Cutter) -> Vec<(f64, f64)> {
    let (r, rim, top) = (c.corner_radius(), c.rim_radius(), c.flute_length());
    let mut points = Vec::new();
    for k in 0..=200 {
        let u = f64::from(k) / 200.0;
        let (sin, cos) = (u * std::f64::consts::FRAC_PI_2).sin_cos();
        points.push((rim + r * sin, r - r * cos));
        points.push((u * rim, 0.0));
        points.push((c.radius(), r + u * (top - r)));
        points.push((u * c.radius(), top));
        points.push((0.7 * (rim + r * sin), r - 0.7 * r * cos));
    }
    points
}

/// How far a point in the half plane is outside the cutter extended upward without end, 0 inside.
fn outside(c: &Cutter, radial: f64, z: f64) -> f64 {
    let r = c.corner_radius();
    if z >= r {
        return (radial - c.radius()).max(0.0);
    }
    let out = (radial - c.rim_radius()).max(0.0);
    (out.hypot(r - z) - r).max(0.0)
}

#[test]
fn no_cutter_point_is_farther_than_the_tolerance_from_its_test_bodies() {
    for (radius, corner, flute) in CUTTERS {
        let c = Cutter::new(radius, corner, flute).unwrap();
        for t in TOLERANCES {
            let body = Solid::Frustum(c.lower_test_body(t));
            let upper = c.upper_test_body(t).map(Solid::Frustum);
            for (radial, z) in profile(&c) {
                let p = Point3::new(radial, 0.0, z);
                let lower = body.distance(&p);
                let both = upper.as_ref().map_or(lower, |u| lower.min(u.distance(&p)));
                assert!(both <= t + 1e-12, "{c:?} t {t}: ({radial}, {z}) is {both} away");
                if z <= flute - corner {
                    assert!(lower <= t + 1e-12, "{c:?} t {t}: ({radial}, {z}) is {lower} from the lower body");
                }
            }
        }
    }
}

#[test]
fn test_bodies_lie_inside_the_cutter() {
    for (radius, corner, flute) in CUTTERS {
        let c = Cutter::new(radius, corner, flute).unwrap();
        for t in TOLERANCES {
            for f in std::iter::once(c.lower_test_body(t)).chain(c.upper_test_body(t)) {
                let overhang = if f.rounding > 0.0 { 2.0 * corner - t } else { f.z_low };
                assert!(f.z_high + f.rounding <= flute.max(overhang) + 1e-12);
                for k in 0..=400 {
                    let angle = f64::from(k) / 400.0 * std::f64::consts::PI;
                    let (sin, cos) = angle.sin_cos();
                    let z = if cos > 0.0 { f.z_high } else { f.z_low } + f.rounding * cos;
                    let gap = outside(&c, f.radius_low + f.rounding * sin, z);
                    assert!(gap <= 1e-12, "{c:?} t {t}: {gap} outside at angle {angle}");
                }
            }
        }
    }
}

#[test]
fn neighbourhood_of_the_core_is_the_cutter_below_its_upper_rounding() {
    for (radius, corner, flute) in CUTTERS {
        let c = Cutter::new(radius, corner, flute).unwrap();
        let body = Solid::Frustum(c.core()).dilated(corner);
        for i in 0..60 {
            for j in 0..60 {
                let (radial, z) = (f64::from(i) / 50.0 * radius, f64::from(j) / 60.0 * c.core().z_high - 0.5);
                let d = body.distance(&Point3::new(0.0, radial, z));
                let gap = outside(&c, radial, z);
                assert!((d.max(0.0) - gap).abs() < 1e-12, "{c:?} at ({radial}, {z}): {d} and {gap}");
            }
        }
    }
}

#[test]
fn impossible_cutters_are_refused() {
    assert_eq!(Cutter::new(0.0, 0.0, 1.0), Err(CutterError::Radius(0.0)));
    assert!(matches!(Cutter::new(f64::NAN, 0.0, 1.0), Err(CutterError::Radius(_))));
    assert!(matches!(Cutter::new(5.0, 5.1, 9.0), Err(CutterError::CornerRadius { .. })));
    assert!(matches!(Cutter::new(5.0, f64::NAN, 9.0), Err(CutterError::CornerRadius { .. })));
    assert!(matches!(Cutter::new(5.0, -0.1, 9.0), Err(CutterError::CornerRadius { .. })));
    assert!(matches!(Cutter::new(5.0, 2.0, 1.0), Err(CutterError::FluteLength { .. })));
    assert!(matches!(Cutter::new(5.0, 0.0, f64::INFINITY), Err(CutterError::FluteLength { .. })));
}
