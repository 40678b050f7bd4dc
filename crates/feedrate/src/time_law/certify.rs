use super::bernstein::Bernstein;
use super::law::SquaredSpeed;

/// Relative accuracy of a bound; it costs at most this fraction of time.
const ACCURACY: f64 = 1e-7;

/// Returns the derivative of order `d` by s, as a polynomial.
fn derivative(c: &[f64], d: usize) -> Bernstein {
    let mut powers = [0.0; 8];
    // A polynomial of too low a degree has 0 as its derivative.
    let n = c.len().saturating_sub(d).max(1);
    for (k, power) in powers.iter_mut().enumerate().take(n) {
        let factor: usize = (k + 1..=k + d).product();
        *power = c.get(k + d).map_or(0.0, |c| c * factor as f64);
    }
    Bernstein::from_powers(&powers[..n])
}

/// Returns the factor by which time has to be stretched on this span until no limit is exceeded: 1
/// where one is just reached.
///
/// It is an upper bound over the whole span, at most the fraction [`ACCURACY`] above the least one,
/// or below `floor`. With ṡ² = ρ(s), velocity² = q_s²·ρ, acceleration = q_ss·ρ + q_s·ρ'/2 and jerk²
/// = ρ·(q_sss·ρ + 3/2·q_ss·ρ' + q_s·ρ''/2)² are polynomials in s, bounded by their Bernstein
/// coefficients.
pub(crate) fn stretch<const K: usize>(
    (axes, limits): (&[[f64; K]], &[[f64; 3]]),
    (tip, tip_limit): (&[[f64; K]], f64),
    pace: &SquaredSpeed,
    floor: f64,
) -> f64 {
    let [a, b, c] = pace.0;
    let rho = Bernstein::from_coefficients(&[a, b, c]);
    let rho1 = Bernstein::from_coefficients(&[2.0 * (b - a), 2.0 * (c - b)]);
    let rho2 = 2.0 * ((a - b) + (c - b));
    let mut most = floor;
    // Bounds of the factors often suffice: then the products are not computed.
    let sizes = [rho.size(), rho1.size(), rho2.abs()];
    for (axis, limit) in axes.iter().zip(limits) {
        let q1 = derivative(axis, 1);
        let q2 = derivative(axis, 2);
        let q3 = derivative(axis, 3);
        let [s1, s2, s3] = [q1.size(), q2.size(), q3.size()];
        if s1 * s1 * sizes[0] * limit[0] > most * most {
            let velocity_sq = q1.times(&q1).times(&rho).scaled(limit[0]);
            most = most.max(velocity_sq.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
        }
        if (s2 * sizes[0] + 0.5 * s1 * sizes[1]) * limit[1] > most * most {
            let acceleration = q2.times(&rho).plus(&q1.times(&rho1).scaled(0.5)).scaled(limit[1]);
            for signed in [acceleration, acceleration.scaled(-1.0)] {
                most = most.max(signed.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
            }
        }
        let limit = limit[2] * limit[2];
        let far = s3 * sizes[0] + 1.5 * s2 * sizes[1] + 0.5 * s1 * sizes[2];
        if far * far * sizes[0] * limit <= most.powi(6) {
            continue;
        }
        let inner = q3.times(&rho).plus(&q2.times(&rho1).scaled(1.5)).plus(&q1.scaled(0.5 * rho2));
        let far = inner.size();
        if far * far * sizes[0] * limit > most.powi(6) {
            let jerk_sq = inner.times(&inner).times(&rho).scaled(limit);
            most = most.max(jerk_sq.upper_bound(most.powi(6), ACCURACY).max(0.0).powf(1.0 / 6.0));
        }
    }
    let squares = tip.iter().map(|c| derivative(c, 1)).map(|v| v.times(&v));
    if let Some(speed_sq) = squares.reduce(|sum, next| sum.plus(&next)) {
        let speed_sq = speed_sq.times(&rho).scaled(tip_limit);
        most = most.max(speed_sq.upper_bound(most.powi(2), ACCURACY).max(0.0).sqrt());
    }
    most
}

/// Returns a bound of ṙ over a span on which r is this polynomial of s: at most the fraction
/// [`ACCURACY`] above its largest value.
pub(crate) fn speed_bound<const K: usize>(r: &[f64; K], pace: &SquaredSpeed) -> f64 {
    let rate = derivative(r, 1);
    let speed_sq = rate.times(&rate).times(&Bernstein::from_coefficients(&pace.0));
    speed_sq.upper_bound(0.0, ACCURACY).sqrt()
}
