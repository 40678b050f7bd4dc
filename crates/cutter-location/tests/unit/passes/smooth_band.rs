use super::*;

#[test]
fn postures_between_two_turn_evenly() {
    let axis = |p: Posture| {
        let (sin, cos) = p.tilt.sin_cos();
        Vector3::new(sin * p.rotate.cos(), sin * p.rotate.sin(), cos)
    };
    let posture = |tilt: f64, rotate: f64| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() };
    for (from, to) in [
        (posture(13.1, -51.0), posture(12.3, -45.0)),
        (posture(40.0, 0.0), posture(2.0, -85.0)),
        (posture(0.0, 0.0), posture(5.0, -60.0)),
        (posture(3.0, -20.0), posture(3.0, -20.0)),
    ] {
        let whole = axis(from).angle(&axis(to));
        for k in 0..=10 {
            let share = f64::from(k) / 10.0;
            let at = axis(turned(from, to, share));
            assert!((axis(from).angle(&at) - share * whole).abs() < 1e-7, "{from:?} {to:?} {share}");
            assert!((at.angle(&axis(to)) - (1.0 - share) * whole).abs() < 1e-7, "{from:?} {to:?} {share}");
        }
    }
}
