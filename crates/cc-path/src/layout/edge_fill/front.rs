use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::layout::edge_fill::along::Along;

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

    /// Coordinate of a coefficient, or of a place between two: that of the middle of the interval
    /// on which it weighs most, mm.
    pub(crate) fn of_coefficient(&self, k: f64) -> f64 {
        self.start + self.width * (k - 0.5)
    }

    /// Where an interval begins, mm.
    pub(crate) fn at(&self, i: usize) -> f64 {
        self.start + self.width * i as f64
    }
}

/// A front: the level of a pass as a function of the coordinate along it.
///
/// A quadratic B-spline on the intervals of a row. Interval i depends on coefficients i to i + 2
/// with weights that are not negative and sum up to 1, so on it the level, the step to another
/// front and the slope lie between those of the coefficients.
#[derive(Clone, Debug)]
pub(crate) struct Front {
    /// Levels at the coefficients: two more than the row has intervals.
    pub(crate) levels: Vec<f64>,
    /// First and last interval that the pass runs over.
    pub(crate) span: [usize; 2],
    /// Coordinates between which it runs; infinite where it runs to the end of the span, mm.
    pub(crate) ends: [f64; 2],
    /// Whether the pass leaves out a part of the region at one end, where it joins the pass before.
    pub(crate) joins: [bool; 2],
}

impl Front {
    /// The level at a coordinate.
    fn level(&self, row: &Row, x: f64) -> f64 {
        let (i, t) = row.interval(x);
        let weights = [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t];
        self.levels[i..i + 3].iter().zip(weights).map(|(c, w)| c * w).sum()
    }

    /// Slope of the level at a coordinate.
    fn slope(&self, row: &Row, x: f64) -> f64 {
        let (i, t) = row.interval(x);
        let c = &self.levels[i..i + 3];
        ((c[1] - c[0]) * (1.0 - t) + (c[2] - c[1]) * t) / row.width
    }

    /// Intervals that the pass runs over as a whole.
    pub(crate) fn whole_columns(&self) -> Range<usize> {
        let [from, to] = self.ends.map(|end| usize::from(end.is_finite()));
        self.span[0] + from..self.span[1] + 1 - to
    }

    /// Mean level on an interval.
    pub(crate) fn mean(&self, i: usize) -> f64 {
        mean(&self.levels[i..i + 3])
    }

    /// Least and largest level on an interval, from outside.
    pub(crate) fn bounds(&self, i: usize) -> (f64, f64) {
        let c = &self.levels[i..i + 3];
        (c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
    }
}

/// Mean level on an interval, by its three coefficients.
pub(crate) fn mean(levels: &[f64]) -> f64 {
    (levels[0] + 4.0 * levels[1] + levels[2]) / 6.0
}

/// A front on its coordinate.
#[derive(Clone, Copy)]
pub(crate) struct FrontSet<'a> {
    pub(crate) front: &'a Front,
    pub(crate) row: &'a Row,
    pub(crate) along: &'a Along,
    /// 1; −1 where fronts count levels from the highest down.
    pub(crate) sign: f64,
    /// Level beyond which nothing is cut, counted as by the front.
    pub(crate) last: f64,
}

impl FrontSet<'_> {
    /// Level of the sections that the front has at a place.
    pub(crate) fn level(&self, p: &Point3<f64>) -> f64 {
        self.sign * self.front.level(self.row, self.along.value(p))
    }

    /// Gradient of the level in space.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        self.along.gradient(p) * (self.sign * self.front.slope(self.row, self.along.value(p)))
    }

    /// Whether the pass runs over a place.
    pub(crate) fn covers(&self, p: &Point3<f64>) -> bool {
        let x = self.along.value(p);
        let i = self.row.interval(x).0;
        let [from, to] = self.front.ends;
        from <= x
            && x <= to
            && self.front.span[0] <= i
            && i <= self.front.span[1]
            && self.front.level(self.row, x) <= self.last
    }
}
