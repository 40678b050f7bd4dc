/// Returns the length of the ellipse x = sin t, y = −s·cos t from its lowest point to `t`, divided
/// by its half width: the incomplete elliptic integral E(t | 1 − s²) by Carlson's duplication, to
/// rounding. `sin` and `cos` are those of `t` in [−π/2, π/2], `s` in [0, 1].
pub(crate) fn ellipse_arc(sin: f64, cos: f64, s: f64) -> f64 {
    let parameter = (1.0 - s) * (1.0 + s);
    let delta = cos * cos + s * s * sin * sin;
    if delta == 0.0 {
        return sin;
    }
    // The form without differences (NIST Digital Library of Mathematical Functions, 19.25.10).
    let (rf, rd) = carlson(cos * cos, 1.0, delta);
    sin * (s * s * (rf + parameter / 3.0 * sin * sin * rd) + parameter * cos / delta.sqrt())
}

/// Returns Carlson's R_F(x, y, z) and R_D(x, y, z) for x, y ≥ 0, not both 0, and z > 0 (B. C.
/// Carlson, Numerical computation of real or complex elliptic integrals, Numer. Algorithms 10,
/// 1995).
fn carlson(mut x: f64, mut y: f64, mut z: f64) -> (f64, f64) {
    // The series' error is of the sixth power of the spread: 2⁻⁵⁴ here. Each step divides the
    // spread by four.
    const SPREAD: f64 = 1e-3;
    const MAX_STEPS: u32 = 600;
    let (mut sum, mut weight) = (0.0, 1.0);
    for _ in 0..MAX_STEPS {
        let mean = (x + y + 3.0 * z) / 5.0;
        if (x - mean).abs().max((y - mean).abs()).max((z - mean).abs()) < SPREAD * mean {
            break;
        }
        let (rx, ry, rz) = (x.sqrt(), y.sqrt(), z.sqrt());
        let lambda = rx * ry + rx * rz + ry * rz;
        sum += weight / (rz * (z + lambda));
        weight *= 0.25;
        (x, y, z) = (0.25 * (x + lambda), 0.25 * (y + lambda), 0.25 * (z + lambda));
    }
    (series_f(x, y, z), weight * series_d(x, y, z) + 3.0 * sum)
}

fn series_f(x: f64, y: f64, z: f64) -> f64 {
    let mean = (x + y + z) / 3.0;
    let (dx, dy, dz) = (1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean);
    let (e2, e3) = (dx * dy - dz * dz, dx * dy * dz);
    (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / mean.sqrt()
}

fn series_d(x: f64, y: f64, z: f64) -> f64 {
    let mean = (x + y + 3.0 * z) / 5.0;
    let (dx, dy, dz) = (1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean);
    let (xy, zz) = (dx * dy, dz * dz);
    let (e2, e3) = (xy - 6.0 * zz, (3.0 * xy - 8.0 * zz) * dz);
    let (e4, e5) = (3.0 * (xy - zz) * zz, xy * zz * dz);
    let sum = 1.0 - 3.0 / 14.0 * e2 + e3 / 6.0 + 9.0 / 88.0 * e2 * e2 - 3.0 / 22.0 * e4 - 9.0 / 52.0 * e2 * e3
        + 3.0 / 26.0 * e5;
    sum / (mean * mean.sqrt())
}

#[cfg(test)]
#[path = "../../tests/unit/section/elliptic.rs"]
mod tests;
