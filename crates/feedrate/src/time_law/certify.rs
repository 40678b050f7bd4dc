use super::barrier::Scaled;
use super::bernstein::Bernstein;
use super::law::Pace;
use super::span::{Septic, Span};

/// Relative accuracy of a bound; it costs this share of time at most.
const ACCURACY: f64 = 1e-7;

/// Derivative of order `d` by s, as a polynomial.
fn derivative(c: &Septic, d: usize) -> Bernstein {
    let mut powers = *c;
    for _ in 0..d {
        for k in 0..7 {
            powers[k] = powers[k + 1] * (k + 1) as f64;
        }
        powers[7] = 0.0;
    }
    Bernstein::from_powers(&powers[..8 - d])
}

/// The factor by which time has to be stretched on this span so that no limit is exceeded: 1 where one is just reached.
///
/// It is an upper bound over the whole span, at most the share [`ACCURACY`] above the least one, or below `floor`. With
/// ṡ² = ρ(s), velocity² = q_s²·ρ, acceleration = q_ss·ρ + q_s·ρ'/2 and jerk² = ρ·(q_sss·ρ + 3/2·q_ss·ρ' + q_s·ρ''/2)²
/// are polynomials in s, bounded by their Bernstein coefficients.
pub(crate) fn stretch(span: &Span, pace: &Pace, scaled: &Scaled, floor: f64) -> f64 {
    let [a, b, c] = pace.0;
    let rho = Bernstein::from_coefficients(&[a, b, c]);
    let rho1 = Bernstein::from_coefficients(&[2.0 * (b - a), 2.0 * (c - b)]);
    let rho2 = 2.0 * ((a - b) + (c - b));
    let mut most = floor;
    for (axis, limit) in span.axes.iter().zip(&scaled.axes) {
        let [q1, q2, q3] = [1, 2, 3].map(|d| derivative(axis, d));
        let velocity_sq = q1.times(&q1).times(&rho).scaled(limit[0]);
        most = most.max(velocity_sq.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
        let acceleration = q2.times(&rho).plus(&q1.times(&rho1).scaled(0.5)).scaled(limit[1]);
        for signed in [acceleration, acceleration.scaled(-1.0)] {
            most = most.max(signed.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
        }
        let inner = q3.times(&rho).plus(&q2.times(&rho1).scaled(1.5)).plus(&q1.scaled(0.5 * rho2));
        let jerk_sq = inner.times(&inner).times(&rho).scaled(limit[2] * limit[2]);
        most = most.max(jerk_sq.upper_bound(most.powi(6), ACCURACY).max(0.0).powf(1.0 / 6.0));
    }
    if let (Some(tip), Some(limit)) = (&span.tip, scaled.tip) {
        let squares = tip.each_ref().map(|c| derivative(c, 1)).map(|v| v.times(&v));
        let speed_sq = squares[0].plus(&squares[1]).plus(&squares[2]).times(&rho).scaled(limit);
        most = most.max(speed_sq.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
    }
    most
}
