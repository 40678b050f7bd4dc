use facemill_cl_data::Posture;

/// Order in which the angles grow along the search curve (CLOPT, chapter III).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchOrder {
    /// Control points V1, V2 = (tilt end, rotate start), V3.
    #[default]
    TiltFirst,
    /// Control points V1, V2′ = (tilt start, rotate end), V3.
    RotateFirst,
}

/// CLOPT's search curve: the rational quadratic Bézier from the smallest to the largest tilt and
/// rotate.
///
/// `C(u) = [(1−u)²·V1 + 2·w·u(1−u)·V2 + u²·V3] / [(1−u)² + 2·w·u(1−u) + u²]`, u in 0..=1. Tilt and
/// |rotate| never decrease along it, because every coordinate of V2 is that of one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchCurve {
    start: Posture,
    middle: Posture,
    end: Posture,
    weight: f64,
}

/// Reason why a search range is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SearchCurveError {
    /// Tilt must lie in 0..90° and not decrease.
    #[error("tilt range must satisfy 0 <= start <= end < 90 degrees")]
    Tilt,
    /// Rotate must lie in ±180° and keep its sign.
    #[error("rotate must stay within 180 degrees, start nearer to 0 than it ends, and keep its sign")]
    Rotate,
    /// The weight of the curve's middle control point must be positive.
    #[error("the weight of the search curve must be positive and finite")]
    Weight,
}

impl SearchCurve {
    /// The curve from `start` to `end`; `weight` > 0 sets how closely it hugs the middle control
    /// point.
    ///
    /// # Errors
    /// When a range or the weight is invalid, see [`SearchCurveError`].
    pub fn new(start: Posture, end: Posture, order: SearchOrder, weight: f64) -> Result<Self, SearchCurveError> {
        let tilt_ok = 0.0 <= start.tilt && start.tilt <= end.tilt && end.tilt < std::f64::consts::FRAC_PI_2;
        if !tilt_ok {
            return Err(SearchCurveError::Tilt);
        }
        let rotate_ok = start.rotate.abs() <= end.rotate.abs()
            && end.rotate.abs() <= std::f64::consts::PI
            && start.rotate * end.rotate >= 0.0;
        if !rotate_ok {
            return Err(SearchCurveError::Rotate);
        }
        if !(weight > 0.0 && weight.is_finite()) {
            return Err(SearchCurveError::Weight);
        }
        let middle = match order {
            SearchOrder::TiltFirst => Posture { tilt: end.tilt, rotate: start.rotate },
            SearchOrder::RotateFirst => Posture { tilt: start.tilt, rotate: end.rotate },
        };
        Ok(Self { start, middle, end, weight })
    }

    /// Returns the same curve with the other sign of rotate.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let mirror = |p: Posture| Posture { rotate: -p.rotate, ..p };
        Self { start: mirror(self.start), middle: mirror(self.middle), end: mirror(self.end), ..self }
    }

    /// Returns the posture at `u`, which is clamped to 0..=1.
    pub fn at(&self, u: f64) -> Posture {
        let u = u.clamp(0.0, 1.0);
        let (b0, b1, b2) = ((1.0 - u).powi(2), 2.0 * self.weight * u * (1.0 - u), u * u);
        let blend = |v1: f64, v2: f64, v3: f64| (b0 * v1 + b1 * v2 + b2 * v3) / (b0 + b1 + b2);
        Posture {
            tilt: blend(self.start.tilt, self.middle.tilt, self.end.tilt),
            rotate: blend(self.start.rotate, self.middle.rotate, self.end.rotate),
        }
    }

    /// Returns the curve of the same start, order and weight to another end; `None` where that is
    /// not a valid curve.
    pub fn with_end(&self, end: Posture) -> Option<Self> {
        let tilt_first = Posture { tilt: self.end.tilt, rotate: self.start.rotate };
        let order = if self.middle == tilt_first { SearchOrder::TiltFirst } else { SearchOrder::RotateFirst };
        Self::new(self.start, end, order, self.weight).ok()
    }

    /// Returns the largest tilt and rotate of the curve.
    pub fn end(&self) -> Posture {
        self.end
    }

    /// Returns the smallest tilt and rotate of the curve.
    pub fn start(&self) -> Posture {
        self.start
    }
}

/// Length of the path of the tool axis on the unit sphere (against surface and feed) along a
/// [`SearchCurve`]: turns "how fast may the posture change" into a bound on u. Tabulated; the
/// inverse is exact at the table's nodes and monotone between them.
#[derive(Clone, Debug)]
pub struct TurnTable {
    /// Turn from u = 0 to u = k / n, rad.
    turn: Vec<f64>,
}

impl TurnTable {
    const STEPS: usize = 256;

    /// Tabulates a curve.
    pub fn new(curve: &SearchCurve) -> Self {
        let at = |k: usize| curve.at(k as f64 / Self::STEPS as f64);
        let mut turn = vec![0.0];
        for k in 0..Self::STEPS {
            let (p, q) = (at(k), at(k + 1));
            let across = 0.5 * (p.tilt + q.tilt);
            // Rotating at tilt 0 turns nothing; a floor keeps the table strictly increasing.
            let step = (q.tilt - p.tilt).hypot(across.sin() * (q.rotate - p.rotate)).max(1e-12);
            turn.push(turn[k] + step);
        }
        Self { turn }
    }

    /// Returns the turn of the axis from u = 0, rad.
    pub fn turn_at(&self, u: f64) -> f64 {
        let x = u.clamp(0.0, 1.0) * Self::STEPS as f64;
        let k = (x as usize).min(Self::STEPS - 1);
        self.turn[k] + (x - k as f64) * (self.turn[k + 1] - self.turn[k])
    }

    /// Returns the u with this turn, clamped to the curve.
    pub fn u_at(&self, turn: f64) -> f64 {
        let k = self.turn.partition_point(|&t| t <= turn).clamp(1, Self::STEPS) - 1;
        let within = (turn - self.turn[k]) / (self.turn[k + 1] - self.turn[k]);
        ((k as f64 + within) / Self::STEPS as f64).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/search/bezier.rs"]
mod tests;
