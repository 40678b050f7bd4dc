//! Closed curves through the points of a section, smooth between its corners.

use nalgebra::{Point3, Vector3};

use crate::spline::CubicSpline;
use crate::spline::SplineEnd::{Natural, NotAKnot};

/// Knots by which a curve without corners overlaps itself: an end's condition is felt by a factor
/// of
/// 0.27 less at each knot, so 28 of them leave less than round-off.
const OVERLAP: isize = 28;

/// Parameters of a section's columns: lengths along it.
#[derive(Clone, Debug)]
pub(crate) struct ColumnParameters {
    /// Parameter of each column from 0, and of the first one after a turn.
    lengths: Vec<f64>,
    /// Columns where the curve has a corner, in order.
    pub(crate) corners: Vec<usize>,
}

impl ColumnParameters {
    /// Parameters from the lengths of the gaps behind each column.
    pub(crate) fn new(gaps: &[f64], corners: Vec<usize>) -> Self {
        let mut lengths = vec![0.0];
        for gap in gaps {
            lengths.push(lengths[lengths.len() - 1] + gap);
        }
        Self { lengths, corners }
    }

    /// Number of columns.
    pub(crate) fn n_columns(&self) -> usize {
        self.lengths.len() - 1
    }

    /// Parameter of a column from 0, or after a turn that of the first one.
    pub(crate) fn length(&self, column: usize) -> f64 {
        self.lengths[column]
    }

    /// Parameter of a column, counted on over further turns.
    fn at(&self, column: isize) -> f64 {
        let n = self.n_columns().cast_signed();
        #[expect(clippy::cast_precision_loss, reason = "a few turns")]
        let turns = column.div_euclid(n) as f64;
        self.lengths[column.rem_euclid(n).cast_unsigned()] + turns * self.lengths[self.n_columns()]
    }
}

/// A curve between two corners, or all around.
enum CurvePiece {
    /// One gap between corners.
    Straight([Vector3<f64>; 2]),
    /// Splines over the parameter, one for each coordinate.
    Smooth(Box<[CubicSpline; 3]>),
}

/// Closed curve through one value at each column.
pub(crate) struct SectionCurve<'p> {
    parameters: &'p ColumnParameters,
    pieces: Vec<CurvePiece>,
    /// First column of each piece.
    starts: Vec<usize>,
}

impl<'p> SectionCurve<'p> {
    /// The curve through values, one at each column.
    pub(crate) fn new(parameters: &'p ColumnParameters, values: &[Vector3<f64>]) -> Self {
        let n = parameters.n_columns().cast_signed();
        let value = |column: isize| values[column.rem_euclid(n).cast_unsigned()];
        let smooth = |from: isize, to: isize| {
            let end = if to - from == 2 { Natural } else { NotAKnot };
            let spline = |axis: usize| {
                CubicSpline::new((from..=to).map(|column| (parameters.at(column), value(column)[axis])), end, end)
            };
            CurvePiece::Smooth(Box::new([0, 1, 2].map(spline)))
        };
        let corners = &parameters.corners;
        if corners.is_empty() {
            return Self { parameters, pieces: vec![smooth(-OVERLAP, n + OVERLAP)], starts: vec![0] };
        }
        let ends = corners.iter().skip(1).map(|&c| c.cast_signed()).chain([corners[0].cast_signed() + n]);
        let piece = |(start, end): (&usize, isize)| {
            let start = start.cast_signed();
            if end - start == 1 { CurvePiece::Straight([value(start), value(end)]) } else { smooth(start, end) }
        };
        Self { parameters, pieces: corners.iter().zip(ends).map(piece).collect(), starts: corners.clone() }
    }

    /// Value at a share of the gap behind a column, and its derivative by the parameter.
    pub(crate) fn at(&self, gap: usize, share: f64) -> (Vector3<f64>, Vector3<f64>) {
        let place = self.starts.partition_point(|&start| start <= gap);
        // Before the first corner is the end of the last piece.
        let (piece, turn) =
            if place == 0 { (self.starts.len() - 1, self.parameters.n_columns()) } else { (place - 1, 0) };
        let column = (gap + turn).cast_signed();
        let [from, to] = [column, column + 1].map(|column| self.parameters.at(column));
        match &self.pieces[piece] {
            CurvePiece::Straight([a, b]) => (a + (b - a) * share, (b - a) / (to - from)),
            CurvePiece::Smooth(splines) => {
                let both = [0, 1, 2].map(|axis| splines[axis].value_and_slope(from + (to - from) * share));
                (Vector3::from(both.map(|(value, _)| value)), Vector3::from(both.map(|(_, slope)| slope)))
            }
        }
    }
}

/// Place of a point in the polyline of its section: length of the gap behind it, and the angle by
/// which the polyline turns there, rad.
pub(crate) fn gap_and_turn(section: &[Point3<f64>], column: usize) -> (f64, f64) {
    let n = section.len();
    let [before, here, next] = [column + n - 1, column, column + 1].map(|k| section[k % n]);
    let (from, to) = (here - before, next - here);
    (to.norm(), from.cross(&to).norm().atan2(from.dot(&to)))
}
