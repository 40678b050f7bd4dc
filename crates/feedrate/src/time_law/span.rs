use super::{JointPath, PathPoint, TimeLawError};

/// Degree 7 in s ∈ [0, 1], from the constant term up.
pub(crate) type Septic = [f64; 8];

/// The path between two knots of the path variable r: polynomials in s = (r − r0)/h.
#[derive(Clone, Debug)]
pub(crate) struct Span {
    /// r at its start.
    pub(crate) start: f64,
    /// Length in r.
    pub(crate) h: f64,
    /// Piece of the given path that it lies in.
    pub(crate) piece: usize,
    pub(crate) axes: Vec<Septic>,
    pub(crate) tip: Option<[Septic; 3]>,
}

/// Returns the polynomial that has these values and first three derivatives (by s) at s = 0 and s =
/// 1.
pub(crate) fn septic(start: [f64; 4], end: [f64; 4]) -> Septic {
    let [c0, c1, c2, c3] = [start[0], start[1], start[2] / 2.0, start[3] / 6.0];
    let d0 = (end[0] - c0) - (c1 + c2 + c3);
    let d1 = end[1] - (c1 + 2.0 * c2 + 3.0 * c3);
    let d2 = (end[2] - (2.0 * c2 + 6.0 * c3)) / 2.0;
    let d3 = (end[3] - 6.0 * c3) / 6.0;
    [
        c0,
        c1,
        c2,
        c3,
        35.0 * d0 - 15.0 * d1 + 5.0 * d2 - d3,
        -84.0 * d0 + 39.0 * d1 - 14.0 * d2 + 3.0 * d3,
        70.0 * d0 - 34.0 * d1 + 13.0 * d2 - 3.0 * d3,
        -20.0 * d0 + 10.0 * d1 - 4.0 * d2 + d3,
    ]
}

/// Returns value and first three derivatives by s of a polynomial by its powers, lowest first.
pub(crate) fn eval(c: &[f64], s: f64) -> [f64; 4] {
    let mut out = [0.0; 4];
    for &k in c.iter().rev() {
        out[3] = out[3] * s + out[2];
        out[2] = out[2] * s + out[1];
        out[1] = out[1] * s + out[0];
        out[0] = out[0] * s + k;
    }
    [out[0], out[1], 2.0 * out[2], 6.0 * out[3]]
}

/// Relation of the path variable r ∈ [0, 1] to the parameter: u = u0 + length·(10 r³ − 15 r⁴ + 6
/// r⁵).
///
/// Its first two derivatives vanish at both ends, so every law with a finite speed ṙ is at rest
/// there with finite jerk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    pub(crate) start: f64,
    pub(crate) length: f64,
}

impl Ramp {
    /// Returns u and its first three derivatives by r.
    pub(crate) fn at(&self, r: f64) -> [f64; 4] {
        let l = self.length;
        let q = 1.0 - r;
        [
            self.start + l * r * r * r * (10.0 + r * (6.0 * r - 15.0)),
            l * 30.0 * r * r * q * q,
            l * 60.0 * r * q * (1.0 - 2.0 * r),
            l * 60.0 * (1.0 + 6.0 * r * (r - 1.0)),
        ]
    }

    /// Returns the r at which u is reached, by bisection to the last bit.
    pub(crate) fn inverse(&self, u: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let mid = 0.5 * (low + high);
            if self.at(mid)[0] < u { low = mid } else { high = mid }
        }
        0.5 * (low + high)
    }
}

/// Returns the derivatives by s of f(u(r0 + h s)), by the chain rule.
fn by_s(f: [f64; 4], u: [f64; 4], h: f64) -> [f64; 4] {
    let [_, u1, u2, u3] = u;
    [
        f[0],
        f[1] * u1 * h,
        (f[2] * u1 * u1 + f[1] * u2) * h * h,
        (f[3] * u1 * u1 * u1 + 3.0 * f[2] * u1 * u2 + f[1] * u3) * h * h * h,
    ]
}

/// Returns the part of `piece` between `r` and `r + h` as polynomials.
pub(crate) fn span(
    path: &dyn JointPath,
    piece: usize,
    ramp: &Ramp,
    (r, end): (f64, f64),
    within: (f64, f64),
) -> Result<Span, TimeLawError> {
    let h = end - r;
    let point = |r: f64| {
        let mut u = ramp.at(r);
        u[0] = u[0].clamp(within.0, within.1);
        let p = path.at(piece, u[0]);
        if is_finite(&p) { Ok((u, p)) } else { Err(TimeLawError::NotFinite { piece, parameter: u[0] }) }
    };
    let ((u0, p0), (u1, p1)) = (point(r)?, point(end)?);
    let axes = (0..p0.axes[0].len())
        .map(|k| septic(by_s(p0.axes.map(|q| q[k]), u0, h), by_s(p1.axes.map(|q| q.get_or_zero(k)), u1, h)))
        .collect();
    let tip = match (p0.tip, p1.tip) {
        (Some(t0), Some(t1)) => {
            Some([0, 1, 2].map(|k| septic(by_s(t0.map(|t| t[k]), u0, h), by_s(t1.map(|t| t[k]), u1, h))))
        }
        _ => None,
    };
    Ok(Span { start: r, h, piece, axes, tip })
}

fn is_finite(p: &PathPoint) -> bool {
    let tip = p.tip.is_none_or(|t| t.iter().flat_map(|v| v.iter()).all(|x| x.is_finite()));
    tip && p.axes.iter().all(|q| q.is_finite())
}
