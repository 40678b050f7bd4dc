//! Cubic spline with two continuous derivatives through table values.

/// Condition at an end of a spline.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SplineEnd {
    /// The slope is given.
    Slope(f64),
    /// The second derivative is zero, as where an odd function passes through its centre.
    Natural,
    /// The first two (last two) pieces are one cubic: nothing is known about the end.
    NotAKnot,
}

/// Piecewise cubic through knots, continuous with two derivatives; beyond its knots it goes on as a
/// straight line.
#[derive(Clone, Debug)]
pub(crate) struct CubicSpline {
    knots: Vec<f64>,
    values: Vec<f64>,
    second_derivatives: Vec<f64>,
}

impl CubicSpline {
    /// The spline through `(x, y)` knots with growing x; at least four of them, or with natural
    /// ends three.
    pub(crate) fn new(points: impl IntoIterator<Item = (f64, f64)>, start: SplineEnd, end: SplineEnd) -> Self {
        let (knots, values): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        debug_assert!(knots.len() >= 3 && knots.windows(2).all(|w| w[0] < w[1]));
        let second_derivatives = second_derivatives(&knots, &values, start, end);
        Self { knots, values, second_derivatives }
    }

    /// The value at `x`.
    pub(crate) fn value(&self, x: f64) -> f64 {
        self.value_and_slope(x).0
    }

    /// The value and the first derivative at `x`.
    pub(crate) fn value_and_slope(&self, x: f64) -> (f64, f64) {
        let (first, last) = (self.knots[0], self.knots[self.knots.len() - 1]);
        let inside = x.clamp(first, last);
        let piece = self.knots.partition_point(|&k| k <= inside).clamp(1, self.knots.len() - 1) - 1;
        let width = self.knots[piece + 1] - self.knots[piece];
        let (a, b) = ((self.knots[piece + 1] - inside) / width, (inside - self.knots[piece]) / width);
        let [y0, y1] = [self.values[piece], self.values[piece + 1]];
        let [m0, m1] = [self.second_derivatives[piece], self.second_derivatives[piece + 1]];
        let at_inside = a * y0 + b * y1 + (a * (a * a - 1.0) * m0 + b * (b * b - 1.0) * m1) * width * width / 6.0;
        let slope = (y1 - y0) / width + ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1) * width / 6.0;
        (at_inside + slope * (x - inside), slope)
    }
}

/// The second derivative at an end is `constant + near·M₁ + next·M₂` of the two knots inside.
struct EndRow {
    constant: f64,
    near: f64,
    next: f64,
}

/// `width` and `rise` of the end piece and width of the piece beside it; `outward` is −1 at the
/// start, 1 at the end.
fn end_row(end: SplineEnd, width: f64, next_width: f64, rise: f64, outward: f64) -> EndRow {
    match end {
        SplineEnd::Natural => EndRow { constant: 0.0, near: 0.0, next: 0.0 },
        SplineEnd::Slope(slope) => {
            EndRow { constant: 3.0 * outward * (slope - rise / width) / width, near: -0.5, next: 0.0 }
        }
        SplineEnd::NotAKnot => EndRow { constant: 0.0, near: 1.0 + width / next_width, next: -width / next_width },
    }
}

/// Second derivatives at the knots, by elimination in the tridiagonal system of the inner ones.
fn second_derivatives(x: &[f64], y: &[f64], start: SplineEnd, end: SplineEnd) -> Vec<f64> {
    let n = x.len() - 1;
    let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let rise: Vec<f64> = y.windows(2).map(|w| w[1] - w[0]).collect();
    let first = end_row(start, h[0], h[1], rise[0], -1.0);
    let last = end_row(end, h[n - 1], h[n - 2], rise[n - 1], 1.0);
    let (mut lower, mut diagonal, mut upper, mut right) =
        (vec![0.0; n + 1], vec![1.0; n + 1], vec![0.0; n + 1], vec![0.0; n + 1]);
    for i in 1..n {
        lower[i] = h[i - 1];
        diagonal[i] = 2.0 * (h[i - 1] + h[i]);
        upper[i] = h[i];
        right[i] = 6.0 * (rise[i] / h[i] - rise[i - 1] / h[i - 1]);
    }
    diagonal[1] += h[0] * first.near;
    upper[1] += h[0] * first.next;
    right[1] -= h[0] * first.constant;
    diagonal[n - 1] += h[n - 1] * last.near;
    lower[n - 1] += h[n - 1] * last.next;
    right[n - 1] -= h[n - 1] * last.constant;
    for i in 2..n {
        let factor = lower[i] / diagonal[i - 1];
        diagonal[i] -= factor * upper[i - 1];
        right[i] -= factor * right[i - 1];
    }
    let mut m = vec![0.0; n + 1];
    m[n - 1] = right[n - 1] / diagonal[n - 1];
    for i in (1..n - 1).rev() {
        m[i] = (right[i] - upper[i] * m[i + 1]) / diagonal[i];
    }
    m[0] = first.constant + first.near * m[1] + first.next * m[2];
    m[n] = last.constant + last.near * m[n - 1] + last.next * m[n - 2];
    m
}

#[cfg(test)]
#[path = "../tests/unit/spline.rs"]
mod tests;
