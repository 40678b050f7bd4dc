use crate::run::ramp::*;
use nalgebra::Point3;

fn pose(x: f64, z: f64, lean: f64) -> ClPoint {
    ClPoint { tip: Point3::new(x, 0.0, z), axis: Unit::new_normalize(Vector3::new(lean.sin(), 0.0, lean.cos())) }
}

#[test]
fn straight_ramp_has_its_own_angle() {
    let d = Descent::between(&pose(0.0, 0.0, 0.0), &pose(0.5, -0.5 * 3f64.to_radians().tan(), 0.0), 40.0);
    assert!((d.angle() - 3f64.to_radians()).abs() < 1e-12);
    assert!(d.is_steeper_than(2.9_f64.to_radians(), 0.0) && !d.is_steeper_than(3.1_f64.to_radians(), 0.0));
    assert!(!d.is_steeper_than(std::f64::consts::FRAC_PI_2, 0.0));
}

#[test]
fn following_a_concave_cylinder_is_no_descent() {
    // Cylinder of radius 300 about (0, 0, 300), cutter of radius 40 tilted 2 degrees, contact at
    // angle u.
    let (cylinder, radius, tilt) = (300.0, 40.0, 2f64.to_radians());
    let at = |u: f64| {
        let contact = Vector3::new(cylinder * u.sin(), 0.0, cylinder * (1.0 - u.cos()));
        // The normal leans back by u, the axis into the feed by the tilt.
        let lean = tilt - u;
        let back = Vector3::new(-lean.cos(), 0.0, lean.sin()) * radius;
        let p = contact + back;
        pose(p.x, p.z, lean)
    };
    let d = Descent::between(&at(0.0), &at(0.5 / cylinder), radius);
    let tip_angle = (-(at(0.5 / cylinder).tip - at(0.0).tip).z).atan2(0.5);
    assert!(tip_angle > 4f64.to_radians(), "the tip itself goes down: {tip_angle}");
    assert!(d.down < 0.0, "{d:?}");
}
