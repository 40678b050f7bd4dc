use super::*;

/// Derivatives by central differences of the one below them, over seeded arguments.
#[test]
fn derivatives_are_those_of_differences() {
    let f = |u: f64| {
        let u = Jet::parameter(u);
        let v = (u * u + Jet::constant(1.5)).sqrt();
        (u.sin() * v - u.cos()).atan2(v * v.recip() * u.cos() - Jet::constant(3.0))
    };
    for k in 0..40 {
        let (u, h) = (-2.0 + 0.1 * f64::from(k), 1e-5);
        let (low, mid, high) = (f(u - h), f(u), f(u + h));
        for d in 0..3 {
            // Across the cut of atan2 the value jumps by a full turn.
            let rise = (high.0[d] - low.0[d] + 3.0) % std::f64::consts::TAU - 3.0;
            let slope = rise / (2.0 * h);
            assert!((slope - mid.0[d + 1]).abs() < 1e-7 * (1.0 + slope.abs()), "{u} {d}: {slope} {mid:?}");
        }
    }
}
