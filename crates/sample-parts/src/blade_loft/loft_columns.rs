//! Columns of a lofted blade's mesh: the surface along the span at places around the sections, and
//! where they end.

use nalgebra::{Point3, Unit, Vector3};

use crate::blade_loft::endwalls::{Endwalls, HubLine, HubSector, LoftEnd, RevolvedWall};
use crate::blade_loft::loft_surface::{BladeLoft, SpanCurve};
use crate::blade_loft::section_curve::SectionCurve;
use crate::spec_error::LoftError;

/// Distance from a wall up to which a point of a section is its own end, mm. Larger: points move.
/// Smaller: facets thinner than the digits of files.
const SNAP: f64 = 1e-3;

/// Share of the span by which a column is made longer, where it ends before the wall.
const EXTENSION: f64 = 0.1;

/// Places of a column where it is looked at between two sections.
const LOOKS: u32 = 4;

/// Steps of the search for the place where a column meets a wall.
const MOST_STEPS: usize = 80;

/// One column.
pub(crate) struct LoftColumn {
    point: SpanCurve,
    around: SpanCurve,
    /// Span parameters of its ends.
    pub(crate) ends: [f64; 2],
}

/// Ends of a loft: walls, and how the blade ends there.
pub(crate) struct LoftEnds {
    pub(crate) walls: [Option<RevolvedWall>; 2],
    pub(crate) kinds: [LoftEnd; 2],
    pub(crate) sector: Option<HubSector>,
}

/// Share of the span up to which a section that goes through a wall was meant to lie on it: points
/// of sections and walls are given to about as many digits. Cut there, the surface would end in
/// slivers with a kink.
const NEAR_WALL: f64 = 2e-4;

/// Names of the walls.
const WALLS: [&str; 2] = ["hub", "shroud"];

fn no_hub() -> LoftError {
    LoftError::WrongWall { wall: WALLS[0], what: "is missing, so that there is no sector of it" }
}

impl BladeLoft {
    /// Returns the line of the blade on the hub, for the sector of another blade of its set.
    ///
    /// # Errors
    /// If there is no hub, or it is no surface of revolution.
    pub fn line_on_hub(&self, walls: &Endwalls) -> Result<HubLine, LoftError> {
        if walls.hub.is_empty() {
            return Err(no_hub());
        }
        let middle = self.points_at(0.5 * self.span[self.span.len() - 1]);
        let wall = RevolvedWall::new(WALLS[0], &walls.axis, &walls.hub, &middle)?;
        Ok(HubLine::of(&wall, &self.points_at(0.0)))
    }
}

impl LoftEnds {
    /// Ends without walls.
    pub(crate) fn sections() -> Self {
        Self { walls: [None, None], kinds: [LoftEnd::Section; 2], sector: None }
    }

    /// Ends at walls.
    pub(crate) fn of(loft: &BladeLoft, given: &Endwalls, tolerance: f64) -> Result<Self, LoftError> {
        let last = loft.span[loft.span.len() - 1];
        let points = [0.0, 0.5 * last, last].map(|at| loft.points_at(at));
        let mut ends = Self::sections();
        for (end, curve) in [&given.hub, &given.shroud].into_iter().enumerate() {
            if curve.is_empty() {
                continue;
            }
            let wall = RevolvedWall::new(WALLS[end], &given.axis, curve, &points[1])?;
            let heights = || points[2 * end].iter().map(|p| wall.height(p));
            let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
            ends.kinds[end] = if low < -tolerance.max(NEAR_WALL * last) {
                LoftEnd::Wall
            } else if low.abs().max(high) <= tolerance {
                LoftEnd::SectionOnWall
            } else {
                LoftEnd::SectionBeforeWall { gap_mm: low.abs().max(high) }
            };
            ends.walls[end] = Some(wall);
        }
        if let Some(sector) = &given.hub_sector {
            match (&ends.walls[0], ends.kinds[0]) {
                (None, _) => return Err(no_hub()),
                (_, LoftEnd::SectionBeforeWall { gap_mm }) => return Err(LoftError::HubNotReached { gap_mm }),
                _ => ends.sector = Some(sector.clone()),
            }
        }
        Ok(ends)
    }

    /// Vertices of each line across a sector of the hub in so many parts, and corners of the wall;
    /// none without a sector.
    pub(crate) fn hub_work(&self, parts: usize) -> [usize; 2] {
        let wall = self.walls[0].as_ref().filter(|_| self.sector.is_some());
        wall.map_or([0; 2], |wall| [parts.saturating_mul(4), wall.lengths.len()])
    }

    /// Wall that a blade ends on, within the tolerance.
    pub(crate) fn met_wall(&self, end: usize) -> Option<&RevolvedWall> {
        let is_met = matches!(self.kinds[end], LoftEnd::Wall | LoftEnd::SectionOnWall);
        self.walls[end].as_ref().filter(|_| is_met)
    }
}

impl LoftColumn {
    /// The column at a share of the gap behind a column of points; `curves` are those of the
    /// sections.
    pub(crate) fn new(
        loft: &BladeLoft,
        curves: &[SectionCurve<'_>],
        (gap, share): (usize, f64),
        ends: &LoftEnds,
    ) -> Result<Self, LoftError> {
        let (points, around): (Vec<_>, Vec<_>) = curves.iter().map(|curve| curve.at(gap, share)).unzip();
        let [point, around] = [points, around].map(|values| SpanCurve::new(&loft.span, &values));
        let whole = [0.0, loft.span[loft.span.len() - 1]];
        let mut column = Self { point, around, ends: whole };
        for (end, name) in WALLS.into_iter().enumerate() {
            if let (Some(wall), LoftEnd::Wall) = (&ends.walls[end], ends.kinds[end]) {
                let off = |gap_mm| LoftError::BeforeWall { wall: name, point: gap, gap_mm };
                column.ends[end] = column.end_at(&loft.span, wall, end).map_err(off)?;
            }
        }
        if column.ends[0] >= column.ends[1] {
            return Err(LoftError::WallsCross { point: gap });
        }
        Ok(column)
    }

    /// Point and derivatives around and across the sections.
    pub(crate) fn at(&self, span: &[f64], at: f64) -> (Point3<f64>, [Vector3<f64>; 2]) {
        let (point, across) = self.point.at(span, at);
        (point.into(), [self.around.at(span, at).0, across])
    }

    /// Point.
    pub(crate) fn point(&self, span: &[f64], at: f64) -> Point3<f64> {
        self.point.at(span, at).0.into()
    }

    /// Span parameter at which the column meets a wall, seen from the middle; otherwise its
    /// distance from there.
    fn end_at(&self, span: &[f64], wall: &RevolvedWall, end: usize) -> Result<f64, f64> {
        let n = span.len() - 1;
        let height = |at: f64| wall.height(&self.point(span, at));
        let mut looks: Vec<f64> = (0..n)
            .flat_map(|k| (0..LOOKS).map(move |j| (k, f64::from(j) / f64::from(LOOKS))))
            .map(|(k, share)| span[k] + share * (span[k + 1] - span[k]))
            .chain([span[n]])
            .collect();
        looks.push(span[n] * (1.0 + EXTENSION));
        looks.insert(0, -span[n] * EXTENSION);
        let middle = 0.5 * span[n];
        let mut outward: Vec<f64> = looks.into_iter().filter(|at| (*at < middle) == (end == 0)).collect();
        if end == 0 {
            outward.reverse();
        }
        let mut inside = (middle, height(middle));
        if inside.1 <= 0.0 {
            return Err(-inside.1);
        }
        let mut nearest = inside.1;
        for at in outward {
            let here = (at, height(at));
            if here.1 <= 0.0 {
                let found = crossing(inside, here, height);
                let section = span.iter().copied().min_by(|a, b| (a - found).abs().total_cmp(&(b - found).abs()));
                let on = |s: &f64| (self.point(span, *s) - self.point(span, found)).norm() <= SNAP;
                return Ok(section.filter(on).unwrap_or(found));
            }
            nearest = here.1;
            inside = here;
        }
        Err(nearest)
    }
}

/// Where a function is zero between two places of different sign, by false position whose weights
/// are halved on the side that stays (Illinois).
fn crossing(mut a: (f64, f64), mut b: (f64, f64), height: impl Fn(f64) -> f64) -> f64 {
    let [start, end] = [a.0, b.0];
    for _ in 0..MOST_STEPS {
        if b.1 == 0.0 || (b.0 - a.0).abs() <= 1e-15 * (end - start).abs() {
            break;
        }
        let at = (b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1)).clamp(start.min(end), start.max(end));
        let here = (at, height(at));
        if here.1.abs() < 1e-11 {
            return at;
        }
        if (here.1 > 0.0) == (b.1 > 0.0) {
            a.1 *= 0.5;
        } else {
            a = b;
        }
        b = here;
    }
    b.0
}

/// Outward unit normal where the surface has one.
pub(crate) fn checked_normal(
    loft: &BladeLoft,
    derivatives: &[Vector3<f64>; 2],
    to_next: &Vector3<f64>,
    folded: LoftError,
) -> Result<Unit<Vector3<f64>>, LoftError> {
    let normal = loft.normal(derivatives).ok_or(folded.clone())?;
    if derivatives[0].dot(to_next) <= 0.0 {
        return Err(folded);
    }
    Ok(normal)
}
