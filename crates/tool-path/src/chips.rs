//! Chip section at one point of a pass (CHIP, with the outline of the tilted cutter seen along the
//! feed).

use facemill_chip_area::{CutterEnd, CutterPose, OutlineError, chip_area_between_outlines, largest_thickness};
use facemill_cutter_location::cusp::Ridge;
use facemill_tool_model::Outline;

use crate::outline_table::OutlineTable;

/// Accuracy of a section area, as a fraction of it.
pub const AREA_ACCURACY: f64 = 1e-3;

/// Accuracy of the areas of the thinnest chips, mm²: a millionth of a large one. A smaller value
/// spends most of the time on negligible chips.
pub const SMALLEST_AREA: f64 = 1e-3;

/// Accuracy of a chip's thickness, as a fraction of the feed per tooth, where feeds depend on it.
pub const THICKNESS_ACCURACY: f64 = 1e-3;

/// The same where the thickness is only reported.
pub const ROUGH_THICKNESS: f64 = 0.02;

/// Area below which nothing is cut, mm²: rounding where the stock ends at the part's surface.
const NOTHING: f64 = 1e-6;

/// Chip of the cutter at a point of a pass, or the largest between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chip {
    /// Section of the chip across the feed, mm².
    pub area: f64,
    /// Largest thickness of the chip as a fraction of the feed per tooth.
    pub thickness: f64,
    /// Whether the surface left by the pass before is known; where it is not, the cutter is assumed
    /// to be in full stock.
    pub is_known: bool,
    /// Whether nothing is cut there, nor anywhere within the cutter's reach along the feed.
    pub is_air: bool,
}

impl Chip {
    /// Returns a chip that is not less than either.
    pub fn larger(self, other: Self) -> Self {
        Self {
            area: self.area.max(other.area),
            thickness: self.thickness.max(other.thickness),
            is_known: self.is_known && other.is_known,
            is_air: self.is_air && other.is_air,
        }
    }
}

/// Top of the stock in the section across the feed: height along the normal over the lateral
/// coordinate y, to the left of the feed from the CC point, mm.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum StockTop {
    /// A layer of uniform thickness on a surface of this curvature (1/mm, positive where the part
    /// is convex).
    Layer {
        /// Thickness, mm.
        thickness: f64,
        /// Curvature of the surface, 1/mm.
        curvature: f64,
    },
    /// A solid: heights at evenly spaced places from one y to another, none of them less than at
    /// its neighbours.
    Solid {
        /// First and last y, mm.
        extent: [f64; 2],
        /// Heights, mm.
        heights: Vec<f64>,
    },
}

impl StockTop {
    /// Returns the height at y; −∞ where there is none.
    pub fn at(&self, y: f64) -> f64 {
        match self {
            Self::Layer { thickness, curvature } => thickness + circle_height(*curvature, *thickness, y),
            Self::Solid { extent, heights } => {
                let last = heights.len() - 1;
                let place = ((y - extent[0]) / (extent[1] - extent[0]) * last as f64).clamp(0.0, last as f64);
                let k = (place as usize).min(last - 1);
                heights[k] + (heights[k + 1] - heights[k]) * (place - k as f64)
            }
        }
    }
}

impl StockTop {
    /// Returns the largest height over an interval.
    fn highest(&self, [from, to]: [f64; 2]) -> f64 {
        match self {
            // Away from the CC point a convex surface falls and a concave one rises.
            Self::Layer { curvature, .. } if *curvature > 0.0 => self.at(0f64.clamp(from, to)),
            Self::Layer { .. } => self.at(from).max(self.at(to)),
            Self::Solid { extent, heights } => {
                let last = heights.len() - 1;
                let place = |y: f64| ((y - extent[0]) / (extent[1] - extent[0]) * last as f64).clamp(0.0, last as f64);
                let between = place(from).ceil() as usize..=place(to).floor() as usize;
                let inside = heights.get(between).unwrap_or_default().iter().copied();
                inside.fold(self.at(from).max(self.at(to)), f64::max)
            }
        }
    }
}

/// Section across the feed at a point of a pass.
pub struct ChipSite {
    /// Outline of the cutter.
    own: Outline,
    /// Its heights.
    heights: OutlineTable,
    /// Heights of the outlines of the passes cut before, at most one on each side.
    before: Vec<OutlineTable>,
    top: StockTop,
    /// Lateral range in which the outline is below the stock's top.
    range: (f64, f64),
}

impl ChipSite {
    /// Creates the section at a point with this outline, beside the passes cut before to which the
    /// ridges lead.
    pub fn new<'r>(own: Outline, ridges: impl IntoIterator<Item = &'r Ridge>, top: StockTop) -> Self {
        let range = engaged(&own, &top);
        let before = ridges.into_iter().map(|r| OutlineTable::new(&r.neighbour, range)).collect();
        Self { own, heights: OutlineTable::new(&own, range), before, top, range }
    }

    /// Returns the height that the passes before have left at y; infinite where there was none.
    fn left_at(&self, y: f64) -> f64 {
        self.before.iter().filter_map(|b| b.height_at(y)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest height that the passes before have left over an interval: an outline is
    /// convex, so it is highest at one of the ends, and several together leave no more than each of
    /// them.
    fn most_left(&self, [from, to]: [f64; 2]) -> f64 {
        let height = |b: &OutlineTable, y: f64| b.height_at(y).unwrap_or(f64::INFINITY);
        self.before.iter().map(|b| height(b, from).max(height(b, to))).fold(f64::INFINITY, f64::min)
    }

    /// Returns the section of the chip, mm²: the stock above the surface that this pass removes and
    /// the neighbouring ones, cut before, have not. Without a neighbour the cutter is in full
    /// stock.
    ///
    /// The estimated error is at most [`AREA_ACCURACY`] of it, or [`SMALLEST_AREA`] where that is
    /// more. 0 where nothing is cut.
    pub fn area(&self) -> Result<f64, OutlineError> {
        let (from, to) = self.range;
        let at = |accuracy: f64| {
            let before = |y: f64| Some(self.left_at(y)).filter(|height| height.is_finite());
            let own = |y: f64| self.heights.height_at(y);
            chip_area_between_outlines(before, own, |y| self.top.at(y), from..=to, accuracy)
        };
        let needed = |area: f64| SMALLEST_AREA.max(AREA_ACCURACY * area);
        let mut accuracy = FIRST_ACCURACY;
        let mut area = at(accuracy)?;
        while accuracy > needed(area) {
            accuracy = needed(area - accuracy);
            area = at(accuracy)?;
        }
        Ok(if area < NOTHING { 0.0 } else { area })
    }

    /// Returns the largest thickness of the chip as a fraction of the feed per tooth: not too
    /// small, except for the accuracy of the tables, and at most `accuracy` too large.
    pub fn thickness(&self, accuracy: f64) -> f64 {
        let (cutter, axis, tip) = (self.own.cutter(), self.own.axis(), self.own.tip());
        let pose = CutterPose {
            cutter: CutterEnd { radius: cutter.radius(), corner_radius: cutter.corner_radius() },
            flute_length: cutter.flute_length(),
            axis: axis.into(),
            tip: tip.into(),
        };
        let highest = |interval: [f64; 2]| self.top.highest(interval).min(self.most_left(interval));
        largest_thickness(&pose, highest, accuracy)
    }
}

/// Returns the lateral range in which an outline is below the stock's top, from the first such
/// place to the last; the whole outline where none of the tested places is.
fn engaged(own: &Outline, top: &StockTop) -> (f64, f64) {
    let phi = |k: usize| (k as f64 / RANGE_PLACES as f64 - 0.5) * std::f64::consts::PI;
    let is_in = |phi: f64| {
        let p = own.point_at(phi);
        p.y < top.at(p.x)
    };
    let all = || (0..=RANGE_PLACES).filter(|&k| is_in(phi(k)));
    let (Some(first), Some(last)) = (all().next(), all().next_back()) else { return own.extent() };
    let end = |inside: usize, outside: Option<usize>| {
        let (mut inner, mut outer) = (phi(inside), outside.map_or(phi(inside), phi));
        for _ in 0..RANGE_BISECTIONS {
            let middle = 0.5 * (inner + outer);
            if is_in(middle) { inner = middle } else { outer = middle }
        }
        own.point_at(outer).x
    };
    let behind = (last < RANGE_PLACES).then_some(last + 1);
    (end(first, first.checked_sub(1)), end(last, behind))
}

/// Accuracy that is tried first, mm²: enough for face mill chips of 50 mm².
const FIRST_ACCURACY: f64 = 0.05;

/// Places along an outline at which it is compared with the stock's top; even, so the contact is
/// one of them.
const RANGE_PLACES: usize = 64;

/// Bisections for the ends of the range: they reduce a 64th of the outline's normals to almost
/// nothing.
const RANGE_BISECTIONS: u32 = 30;

/// Returns the height over the tangent of a circle of this curvature, moved outward by `offset`, at
/// `y` from the point of contact; −∞ beyond the side of a convex one, level beyond that of a
/// concave one.
fn circle_height(curvature: f64, offset: f64, y: f64) -> f64 {
    if curvature == 0.0 {
        return 0.0;
    }
    let radius = 1.0 / curvature + offset;
    let inside = radius * radius - y * y;
    if inside < 0.0 {
        return if curvature > 0.0 { f64::NEG_INFINITY } else { radius.abs() };
    }
    // Avoids the cancellation in R − √(R² − y²).
    -y * y / (radius + inside.sqrt() * radius.signum())
}

#[cfg(test)]
#[path = "../tests/unit/chips.rs"]
mod tests;
