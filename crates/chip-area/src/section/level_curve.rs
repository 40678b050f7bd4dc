use nalgebra::{Point2, Vector2};

/// Circle or line as `k·|p|²/2 + n·p = h`: a circle of curvature about `k` when `k ≠ 0`, a line
/// when `k = 0`.
///
/// With a unit normal `n` and `h = 0` it passes through the origin with that normal there, and
/// bends away from `n` for `k > 0`. Planes are the limit `k → 0` without loss of digits, unlike
/// with centre and radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelCurve {
    k: f64,
    normal: Vector2<f64>,
    level: f64,
}

/// One of the two common points of a vertical line and a [`LevelCurve`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Branch {
    /// The one that stays when the curve straightens to a line.
    Near,
    /// The one that moves to infinity.
    Far,
}

impl LevelCurve {
    /// Returns the curve through the origin with unit normal `normal` and curvature `k`, moved by
    /// `offset` along its normal.
    pub(crate) fn offset_of_surface(k: f64, normal: Vector2<f64>, offset: f64) -> Self {
        Self { k, normal, level: offset + 0.5 * k * offset * offset }
    }

    /// Returns the circle about `center`.
    pub(crate) fn circle(center: Point2<f64>, radius: f64) -> Self {
        Self { k: 1.0, normal: -center.coords, level: 0.5 * (radius * radius - center.coords.norm_squared()) }
    }

    /// Returns the line of all points with this y.
    pub(crate) fn horizontal(y: f64) -> Self {
        Self { k: 0.0, normal: Vector2::y(), level: y }
    }

    /// Returns the line `normal`·p = `level`, for a unit normal.
    pub(crate) fn line(normal: Vector2<f64>, level: f64) -> Self {
        Self { k: 0.0, normal, level }
    }

    /// Returns a value that is negative on the side that `k` bends toward (inside of a circle with
    /// `k > 0`), and 0 on the curve.
    pub(crate) fn value(&self, p: &Point2<f64>) -> f64 {
        0.5 * self.k * p.coords.norm_squared() + self.normal.dot(&p.coords) - self.level
    }

    /// Returns the gradient of [`Self::value`].
    pub(crate) fn gradient(&self, p: &Point2<f64>) -> Vector2<f64> {
        p.coords * self.k + self.normal
    }

    /// Returns the curvature times the gradient's length along the curve; 0 for a line.
    pub(crate) fn k(&self) -> f64 {
        self.k
    }

    /// Returns the signed curvature; 0 for a line.
    pub(crate) fn curvature(&self) -> f64 {
        if self.k == 0.0 { 0.0 } else { self.k / self.size_sq().max(0.0).sqrt() }
    }

    /// Returns the square of the gradient's length along the curve: (k·radius)² for a circle.
    fn size_sq(&self) -> f64 {
        self.normal.norm_squared() + 2.0 * self.k * self.level
    }

    /// Returns a value that is positive where the vertical line at `x` crosses the curve, negative
    /// where it misses it.
    pub(crate) fn reach(&self, x: f64) -> f64 {
        self.normal.y * self.normal.y - 2.0 * self.k * self.rest(x)
    }

    fn rest(&self, x: f64) -> f64 {
        0.5 * self.k * x * x + self.normal.x * x - self.level
    }

    /// Returns y on a branch at `x`, for a normal with `n.y ≥ 0`; where the vertical line just
    /// misses the curve, the y of its extreme point.
    pub(crate) fn y_at(&self, x: f64, branch: Branch) -> f64 {
        let sum = self.normal.y + self.reach(x).max(0.0).sqrt();
        match branch {
            Branch::Near if sum == 0.0 => 0.0,
            Branch::Near => -2.0 * self.rest(x) / sum,
            Branch::Far => -sum / self.k,
        }
    }

    /// Returns x of the leftmost and rightmost points.
    pub(crate) fn extremes(&self) -> [Option<f64>; 2] {
        if self.k == 0.0 {
            return [None; 2];
        }
        let root = self.size_sq().max(0.0).sqrt();
        [Some((-self.normal.x - root) / self.k), Some((-self.normal.x + root) / self.k)]
    }

    /// Returns the common points with another curve. Coinciding and concentric curves have none; at
    /// a tangency, rounding decides between none and two that are close together.
    pub(crate) fn crossings(&self, other: &Self) -> [Option<Point2<f64>>; 2] {
        // The combination without |p|² is the line through the common points.
        let (line, level) = if self.k == 0.0 {
            (self.normal, self.level)
        } else {
            (self.normal * other.k - other.normal * self.k, self.level * other.k - other.level * self.k)
        };
        let circle = if self.k == 0.0 { other } else { self };
        let length = line.norm();
        if length == 0.0 {
            return [None; 2];
        }
        let (across, distance) = (line / length, level / length);
        let along = Vector2::new(-across.y, across.x);
        // Along the line p = distance·across + s·along the curve is a·s² + 2·b·s + c = 0.
        let a = 0.5 * circle.k;
        let b = 0.5 * circle.normal.dot(&along);
        let c = 0.5 * circle.k * distance * distance + distance * circle.normal.dot(&across) - circle.level;
        let at = |s: f64| s.is_finite().then(|| Point2::from(across * distance + along * s));
        let disc = b * b - a * c;
        if disc < 0.0 {
            return [None; 2];
        }
        let q = -(b + b.signum() * disc.sqrt());
        [at(q / a), at(c / q)]
    }
}

/// Returns the area between a circular arc of curvature `k` ≥ 0, not longer than half a circle, and
/// its chord.
pub(crate) fn segment_area(k: f64, chord: f64) -> f64 {
    // φ − sin φ loses all digits for small angles, where its series is short: in the sine h of half
    // the angle, φ/2 − sin φ/2 = ⅔·h³ + ⅕·h⁵ + 3/28·h⁷ + 5/72·h⁹ + ….
    const SERIES_BELOW: f64 = 0.05;
    if k == 0.0 || chord == 0.0 {
        return 0.0;
    }
    let h = (0.5 * k * chord).min(1.0);
    let sq = h * h;
    if h > SERIES_BELOW {
        return (h.asin() - h * ((1.0 - h) * (1.0 + h)).sqrt()) / (k * k);
    }
    let series =
        2.0 / 3.0 + sq * (0.2 + sq * (3.0 / 28.0 + sq * (5.0 / 72.0 + sq * (35.0 / 704.0 + sq * 63.0 / 1664.0))));
    0.125 * chord * chord * chord * k * series
}

#[cfg(test)]
#[path = "../../tests/unit/section/level_curve.rs"]
mod tests;
