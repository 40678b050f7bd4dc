use nalgebra::{Point3, Vector3};

use crate::layout::along::Along;
use crate::strategy::Strategy;

/// Places of a row of equal intervals of the coordinate along the passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// Where the first interval begins, mm.
    pub(crate) start: f64,
    /// Width of an interval, mm.
    pub(crate) width: f64,
    /// Number of intervals, at least one.
    pub(crate) n: usize,
}

impl Row {
    /// The interval at a coordinate, the first or last beyond the ends, and the share of it before
    /// the coordinate.
    pub(crate) fn interval(&self, x: f64) -> (usize, f64) {
        let way = (x - self.start) / self.width;
        let i = (way.max(0.0) as usize).min(self.n - 1);
        (i, (way - i as f64).clamp(0.0, 1.0))
    }

    /// Where an interval begins, mm.
    pub(crate) fn at(&self, i: usize) -> f64 {
        self.start + self.width * i as f64
    }
}

/// A front: the level of a pass as a function of the coordinate along it.
///
/// A quadratic B-spline on the intervals of a row. Interval i depends on coefficients i to i + 2
/// with weights that are not negative and sum up to 1, so on it the level, the step to another front
/// and the slope lie between those of the coefficients.
#[derive(Clone, Debug)]
pub(crate) struct Front {
    /// Levels at the coefficients: two more than the row has intervals.
    pub(crate) levels: Vec<f64>,
    /// First and last interval that the pass runs over.
    pub(crate) span: [usize; 2],
    /// Whether the pass leaves out a part of the region at one end, where it joins the pass before.
    pub(crate) joins: [bool; 2],
}

impl Front {
    /// The level at a coordinate, and its slope.
    pub(crate) fn at(&self, row: &Row, x: f64) -> (f64, f64) {
        let (i, t) = row.interval(x);
        let c = &self.levels[i..i + 3];
        let weights = [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t];
        let level = c.iter().zip(weights).map(|(c, w)| c * w).sum();
        (level, ((c[1] - c[0]) * (1.0 - t) + (c[2] - c[1]) * t) / row.width)
    }

    /// Mean level on an interval.
    pub(crate) fn mean(&self, i: usize) -> f64 {
        (self.levels[i] + 4.0 * self.levels[i + 1] + self.levels[i + 2]) / 6.0
    }

    /// Least and largest level on an interval, from outside.
    pub(crate) fn bounds(&self, i: usize) -> (f64, f64) {
        let c = &self.levels[i..i + 3];
        (c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
    }
}

/// A surface through space that cuts a pass out of the drive surface: a level of the strategy, or a
/// front.
#[derive(Clone, Copy)]
pub(crate) struct LevelSet<'a> {
    pub(crate) strategy: &'a Strategy,
    /// Level of the strategy; with a front, 0.
    pub(crate) level: f64,
    pub(crate) front: Option<FrontSet<'a>>,
}

/// A front on its coordinate.
#[derive(Clone, Copy)]
pub(crate) struct FrontSet<'a> {
    pub(crate) front: &'a Front,
    pub(crate) row: &'a Row,
    pub(crate) along: &'a Along,
    /// 1; −1 where fronts count levels from the highest down.
    pub(crate) sign: f64,
}

impl FrontSet<'_> {
    /// Level of the strategy that the front has at a place.
    fn level(&self, p: &Point3<f64>) -> f64 {
        self.sign * self.front.at(self.row, self.along.value(p)).0
    }

    /// Gradient of the level in space.
    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        self.along.gradient(p) * (self.sign * self.front.at(self.row, self.along.value(p)).1)
    }

    /// Whether the pass runs over a place.
    pub(crate) fn covers(&self, p: &Point3<f64>) -> bool {
        let i = self.row.interval(self.along.value(p)).0;
        self.front.span[0] <= i && i <= self.front.span[1]
    }
}

impl<'a> LevelSet<'a> {
    /// A level of a strategy.
    pub(crate) fn of_level(strategy: &'a Strategy, level: f64) -> Self {
        Self { strategy, level, front: None }
    }

    /// A front over the levels of a strategy.
    pub(crate) fn of_front(strategy: &'a Strategy, front: FrontSet<'a>) -> Self {
        Self { strategy, level: 0.0, front: Some(front) }
    }

    /// Value at a place; the pass is where it is [`LevelSet::level`].
    pub(crate) fn value(&self, p: &Point3<f64>) -> f64 {
        self.strategy.level(p) - self.front.map_or(0.0, |f| f.level(p))
    }

    /// Direction in which the value rises, not of unit length; `None` where there is none.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let level = self.strategy.gradient(p)?.into_inner();
        Some(self.front.map_or(level, |f| level - f.gradient(p)))
    }

    /// Whether the value is linear between two points.
    pub(crate) fn is_linear(&self) -> bool {
        self.front.is_none() && self.strategy.is_linear()
    }

    /// Fraction of the way from `a` to `b` at which the value is the level, in 0..1.
    ///
    /// Exact up to rounding where one end is below and the other is not; where both are on the same
    /// side, the end whose value is nearer.
    pub(crate) fn crossing(&self, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
        if self.front.is_none() {
            return self.strategy.crossing(a, b, self.level);
        }
        let (at_a, at_b) = (self.value(a), self.value(b));
        if (at_a >= self.level) == (at_b >= self.level) {
            return if at_a.abs() <= at_b.abs() { 0.0 } else { 1.0 };
        }
        bracketed_root(|t| self.value(&(a + (b - a) * t)), [at_a, at_b])
    }
}

/// Root of a continuous function in 0..1 with values of different signs at the ends (zero counts as
/// positive), to rounding: regula falsi by the Illinois rule (Dowell and Jarratt 1971).
fn bracketed_root(f: impl Fn(f64) -> f64, ends: [f64; 2]) -> f64 {
    let (mut a, mut b) = ((0.0, ends[0]), (1.0, ends[1]));
    // The rule gains more than a digit per step near a root; halving makes up for kinks.
    for k in 0..100 {
        let t = if k % 8 == 7 { 0.5 * (a.0 + b.0) } else { a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1) };
        let t = t.clamp(f64::min(a.0, b.0), f64::max(a.0, b.0));
        let value = f(t);
        if value.abs() <= 1e-12 || t == a.0 || t == b.0 {
            return t;
        }
        if (value >= 0.0) == (b.1 >= 0.0) {
            a.1 *= 0.5;
        } else {
            a = b;
        }
        b = (t, value);
    }
    b.0
}
