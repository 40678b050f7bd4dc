//! The smooth surface of a lofted blade.

use nalgebra::{Point3, Unit, Vector3};

use crate::blade_loft::loft_edges::{
    EdgeColumns, LONGEST_END, ROUND_SHARE, chord_ends, columns_about, flat_end, groups_of_gaps, ordered,
};
use crate::blade_loft::section_curve::{ColumnParameters, SectionCurve, gap_and_turn};
use crate::spec_error::LoftError;
use crate::spline::CubicSpline;
use crate::spline::SplineEnd::{Natural, NotAKnot};

/// Angle by which all sections turn at a corner, at least. Larger: corners of flat ends that are
/// not marked become waves. Smaller: coarse round edges become corners.
const CORNER: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Least number of points of a section.
const LEAST_POINTS: usize = 8;

/// Sections of a blade from root to tip.
///
/// All have the same number of points, and points of equal index belong together.
#[derive(Clone, Debug, Default)]
pub struct BladeSections {
    /// Points of each section in their order around it, the first one not repeated, mm.
    pub sections: Vec<Vec<Point3<f64>>>,
    /// Whether the line from the last to the first point is a flat end and not a part of the curve.
    pub is_cut_off: bool,
    /// Points at the corners of a flat leading edge, or twice the point of a rounded one.
    pub leading: Option<[usize; 2]>,
    /// Points at the trailing edge, as for the leading edge.
    pub trailing: Option<[usize; 2]>,
    /// Form of leading and trailing edge, where it is known.
    pub forms: [Option<EdgeForm>; 2],
}

/// Form of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeForm {
    /// Rounded: the curve is smooth there, however few points it has.
    Round,
    /// Flat between two corners.
    Flat,
}

/// Smooth blade through the points of its sections.
///
/// Around each section it is a cubic spline over the mean length along the sections, broken at
/// corners: those of flat ends, and where all sections turn by more than 60°, but not at edges that
/// are known as rounded. Across the sections it is a cubic spline over their mean distance. So it
/// has two continuous derivatives but at corners, and goes through every point.
pub struct BladeLoft {
    /// Splines over the span for each column.
    columns: Vec<SpanCurve>,
    /// Span parameter of each section.
    pub(crate) span: Vec<f64>,
    pub(crate) parameters: ColumnParameters,
    /// Leading and trailing edge.
    pub(crate) edges: [EdgeColumns; 2],
    /// Group of the gap behind each column.
    pub(crate) groups: Vec<usize>,
    /// Whether columns run counter-clockwise, seen from the tip.
    pub(crate) is_counter_clockwise: bool,
}

/// A curve over the span, through one value at each section.
pub(crate) enum SpanCurve {
    Straight([Vector3<f64>; 2]),
    Smooth(Box<[CubicSpline; 3]>),
}

impl BladeLoft {
    /// The blade through sections. `downstream` says how far downstream a point is: it tells the
    /// leading edge from the trailing edge where no edge is marked.
    ///
    /// # Errors
    /// If there are fewer than two sections or eight points, their numbers differ, numbers are not
    /// finite, neighbours coincide, points of equal index do not belong together, so that the
    /// surface folds, or an edge that is known as flat has no two corners.
    pub fn new(given: &BladeSections, downstream: impl Fn(&Point3<f64>) -> f64) -> Result<Self, LoftError> {
        let sections = &given.sections;
        check_points(given)?;
        let (n, middle) = (sections[0].len(), &sections[sections.len() / 2]);
        let mut corners: Vec<usize> =
            (0..n).filter(|&k| sections.iter().all(|section| gap_and_turn(section, k).1 > CORNER)).collect();
        let flat = [given.leading, given.trailing].into_iter().flatten().filter(|[a, b]| a != b);
        corners.extend(flat.flatten());
        corners.extend(given.is_cut_off.then_some([0, n - 1]).into_iter().flatten());
        corners.sort_unstable();
        corners.dedup();
        let edges = edges_of(given, middle, &mut corners, downstream)?;
        let parameters = ColumnParameters::new(&mean_gaps(sections), corners);
        let mut span = vec![0.0];
        for pair in sections.windows(2) {
            let steps = pair[0].iter().zip(&pair[1]).map(|(a, b)| (b - a).norm());
            span.push(span[span.len() - 1] + mean(steps, n));
        }
        let column = |k: usize| sections.iter().map(|section| section[k].coords).collect::<Vec<_>>();
        let columns = (0..n).map(|k| SpanCurve::new(&span, &column(k))).collect();
        let is_counter_clockwise = area(&sections[0]).dot(&step(&sections[0], &sections[1])) > 0.0;
        let groups = groups_of_gaps(middle, edges);
        Ok(Self { columns, span, parameters, edges, groups, is_counter_clockwise })
    }

    /// Curve around the blade at a share of the way from one section to the next.
    pub(crate) fn curve(&self, section: usize, share: f64) -> SectionCurve<'_> {
        let at = self.span[section] + share * (self.span[section + 1] - self.span[section]);
        let points: Vec<_> = self.columns.iter().map(|column| column.at(&self.span, at).0).collect();
        SectionCurve::new(&self.parameters, &points)
    }

    /// Curves around the blade at its sections.
    pub(crate) fn section_curves(&self) -> Vec<SectionCurve<'_>> {
        let last = self.span.len() - 1;
        (0..=last).map(|k| if k < last { self.curve(k, 0.0) } else { self.curve(k - 1, 1.0) }).collect()
    }

    /// Points of all columns at a place of the span.
    pub(crate) fn points_at(&self, at: f64) -> Vec<Point3<f64>> {
        self.columns.iter().map(|column| column.at(&self.span, at).0.into()).collect()
    }

    /// The outward normal of derivatives around and across; none where the surface is degenerate.
    pub(crate) fn normal(&self, [around, across]: &[Vector3<f64>; 2]) -> Option<Unit<Vector3<f64>>> {
        let normal = around.cross(across) * if self.is_counter_clockwise { 1.0 } else { -1.0 };
        Unit::try_new(normal, 1e-9 * around.norm() * across.norm())
    }
}

impl SpanCurve {
    pub(crate) fn new(span: &[f64], values: &[Vector3<f64>]) -> Self {
        if let [first, second] = values {
            return Self::Straight([*first, *second]);
        }
        let end = if values.len() == 3 { Natural } else { NotAKnot };
        let spline =
            |axis: usize| CubicSpline::new(span.iter().zip(values).map(|(at, value)| (*at, value[axis])), end, end);
        Self::Smooth(Box::new([0, 1, 2].map(spline)))
    }

    /// Value and derivative; beyond the ends it goes on as a straight line.
    pub(crate) fn at(&self, span: &[f64], at: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Straight([a, b]) => (a + (b - a) * (at / span[1]), (b - a) / span[1]),
            Self::Smooth(splines) => {
                let both = [0, 1, 2].map(|axis| splines[axis].value_and_slope(at));
                (Vector3::from(both.map(|(value, _)| value)), Vector3::from(both.map(|(_, slope)| slope)))
            }
        }
    }
}

/// Leading and trailing edge. Takes the corners out of those that are known as rounded.
fn edges_of(
    given: &BladeSections,
    middle: &[Point3<f64>],
    corners: &mut Vec<usize>,
    downstream: impl Fn(&Point3<f64>) -> f64,
) -> Result<[EdgeColumns; 2], LoftError> {
    let found = marked_or_found(given, middle, corners, &downstream);
    let chord = (middle[found[1][0]] - middle[found[0][0]]).norm();
    for (edge, form) in found.into_iter().zip(given.forms) {
        if form == Some(EdgeForm::Round) {
            let is_round = columns_about(middle, edge, ROUND_SHARE * chord);
            corners.retain(|corner| !is_round.contains(corner));
        }
    }
    let mut edges = marked_or_found(given, middle, corners, &downstream);
    for ((edge, form), name) in edges.iter_mut().zip(given.forms).zip(["leading", "trailing"]) {
        if form == Some(EdgeForm::Flat) && edge[0] == edge[1] {
            *edge =
                flat_end(middle, corners, edge[0], LONGEST_END * chord).ok_or(LoftError::NoFlatEnd { edge: name })?;
        }
    }
    Ok(edges)
}

fn marked_or_found(
    given: &BladeSections,
    middle: &[Point3<f64>],
    corners: &[usize],
    downstream: &impl Fn(&Point3<f64>) -> f64,
) -> [EdgeColumns; 2] {
    let n = middle.len();
    let marked = [given.leading, given.trailing].map(|edge| edge.map(|edge| ordered(n, edge)));
    if let [Some(leading), Some(trailing)] = marked {
        return [leading, trailing];
    }
    let mut ends = chord_ends(middle, corners);
    let distance = |end: &EdgeColumns, edge: &EdgeColumns| (middle[end[0]] - middle[edge[0]]).norm();
    let is_reversed = match marked {
        [Some(leading), _] => distance(&ends[1], &leading) < distance(&ends[0], &leading),
        [_, Some(trailing)] => distance(&ends[0], &trailing) < distance(&ends[1], &trailing),
        _ => downstream(&middle[ends[1][0]]) < downstream(&middle[ends[0][0]]),
    };
    if is_reversed {
        ends.swap(0, 1);
    }
    [marked[0].unwrap_or(ends[0]), marked[1].unwrap_or(ends[1])]
}

fn check_points(given: &BladeSections) -> Result<(), LoftError> {
    let sections = &given.sections;
    let n = sections.first().map_or(0, Vec::len);
    if sections.len() < 2 || n < LEAST_POINTS {
        return Err(LoftError::TooFew { sections: sections.len(), points: n });
    }
    let marks = [given.leading, given.trailing];
    if marks.iter().flatten().flatten().any(|&mark| mark >= n) || marks[0].is_some() && marks[0] == marks[1] {
        return Err(LoftError::WrongMarks);
    }
    for (k, section) in sections.iter().enumerate() {
        let coincide = |j: usize| gap_and_turn(section, j).0 == 0.0 || k > 0 && section[j] == sections[k - 1][j];
        if section.len() != n {
            return Err(LoftError::Unequal { section: k, points: section.len(), first: n });
        }
        if section.iter().any(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(LoftError::NotFinite { section: k });
        }
        if let Some(point) = (0..n).find(|&j| coincide(j)) {
            return Err(LoftError::Coincident { section: k, point });
        }
    }
    Ok(())
}

/// Length of the gap behind each column, mean of the sections' shares of their own lengths.
fn mean_gaps(sections: &[Vec<Point3<f64>>]) -> Vec<f64> {
    let mut gaps = vec![0.0; sections[0].len()];
    for section in sections {
        let own: Vec<f64> = (0..section.len()).map(|k| gap_and_turn(section, k).0).collect();
        let whole: f64 = own.iter().sum();
        gaps.iter_mut().zip(own).for_each(|(gap, own)| *gap += own / whole);
    }
    gaps
}

fn mean(values: impl Iterator<Item = f64>, n: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far fewer points than 2^52")]
    let n = n as f64;
    values.sum::<f64>() / n
}

/// Mean step from one section to another, times the number of points.
fn step(from: &[Point3<f64>], to: &[Point3<f64>]) -> Vector3<f64> {
    from.iter().zip(to).fold(Vector3::zeros(), |sum, (a, b)| sum + (b - a))
}

/// Twice the area that points enclose, as a vector across it.
fn area(points: &[Point3<f64>]) -> Vector3<f64> {
    let sides = points.iter().zip(points.iter().cycle().skip(1));
    sides.fold(Vector3::zeros(), |sum, (a, b)| sum + (a - points[0]).cross(&(b - points[0])))
}
