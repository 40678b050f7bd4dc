//! The region in columns across the passes: what fronts are planned on.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::layout::edge_fill::along::Along;
use crate::layout::edge_fill::front::Row;
use crate::layout::levels::Band;
use crate::layout::strip_width::least;
use crate::sections::Sections;
use crate::strategy::patch::Patch;
use crate::strategy::settings::LaySettings;

impl Band {
    /// Of no surface.
    const EMPTY: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        limit: f64::INFINITY,
        requested: f64::INFINITY,
        slope: f64::INFINITY,
    };

    /// That of both together.
    fn least(&self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            limit: self.limit.min(other.limit),
            requested: self.requested.min(other.requested),
            slope: self.slope.min(other.slope),
        }
    }
}

/// Lower and upper border of the region on one column.
#[derive(Clone, Copy, Debug)]
struct Border {
    /// Lowest and highest level.
    outer: [f64; 2],
    /// Largest steps that are allowed there.
    limits: [f64; 2],
    /// Highest level of the lower border, and lowest of the upper: a pass between them is inside
    /// all over the column.
    inner: [f64; 2],
    /// Distance along a border per gain of level on it, at least 1; infinite where it runs along a
    /// level.
    lean: [f64; 2],
    /// Whether each of both leans no more than fronts may.
    is_gentle: [bool; 2],
    /// Whether the upper border has its peak there: it is steep, and beside it neither higher nor
    /// as level as fronts.
    is_peak: bool,
}

/// Levels of the first pass on a column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Lowest one that is inside the region all over it.
    pub(crate) inside: f64,
    /// Highest one: half a strip above the border.
    pub(crate) most: f64,
    /// Whether a front can follow the border.
    pub(crate) is_gentle: bool,
}

/// One column of the region.
struct Column {
    /// Parts between two levels of the grid; slopes are those from one front to the next.
    cells: Vec<Band>,
    /// `None` where the column is empty.
    border: Option<Border>,
    /// Lowest and highest level where it meets the column before it and the one behind it.
    ends: [[f64; 2]; 2],
    /// Length that passes as wide as allowed have below each level of the grid, mm.
    work: Vec<f64>,
    /// Length of a pass on a level of the grid, mm.
    lengths: Vec<f64>,
}

/// The region of a patch, cut into columns of equal width across the passes.
///
/// Levels are those of the sections, or their negatives where cutting begins at the highest, so
/// that passes are planned in rising order.
pub(crate) struct Columns {
    pub(crate) row: Row,
    pub(crate) along: Along,
    /// Coordinate along the passes of each vertex of the patch, mm.
    values: Vec<f64>,
    /// 1, or −1 where levels are negatives.
    pub(crate) sign: f64,
    /// First level, where the grid of levels begins.
    first: f64,
    step: f64,
    n_levels: usize,
    columns: Vec<Column>,
    /// Last level.
    pub(crate) last: f64,
    /// Whether the lower border is the first level on all columns.
    starts_at_level: bool,
}

/// Steepest front: gain of level per way along the passes, 11°. Steeper fronts turn the feed too
/// far from the direction of the sections.
pub(crate) const STEEPEST: f64 = 0.2;

/// Columns of a region; more are wider.
const MOST_COLUMNS: usize = 128;
const LEAST_COLUMNS: usize = 24;
/// Levels of the grid per step of the narrowest strip, and at most.
const LEVELS_PER_STEP: f64 = 4.0;
const MOST_LEVELS: usize = 4096;

impl Columns {
    /// `None` where the passes have no coordinate along them. Fronts go from `first` to `last`.
    pub(crate) fn of(
        patch: &Patch,
        sections: &Sections,
        settings: &LaySettings,
        bands: &[Band],
        [first_level, last_level]: [f64; 2],
        sign: f64,
    ) -> Option<Self> {
        let along = Along::of(patch, sections)?;
        let values: Vec<f64> = patch.mesh.vertices().par_iter().map(|p| along.value(p)).collect();
        let used = patch.mesh.triangles().iter().flatten().map(|&v| values[v as usize]);
        let (start, end) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        if !(end - start).is_finite() || end - start <= 0.0 || last_level <= first_level {
            return None;
        }
        let n = ((end - start) / (0.25 * settings.max_step_over)).ceil();
        let n = (n as usize).clamp(LEAST_COLUMNS, MOST_COLUMNS);
        let row = Row { start, width: (end - start) / n as f64, n };
        let narrowest = bands.iter().map(|b| b.limit).fold(f64::INFINITY, f64::min);
        let n_levels = (LEVELS_PER_STEP * (last_level - first_level) / narrowest).ceil();
        let n_levels = (n_levels as usize).clamp(16, MOST_LEVELS);
        let mut this = Self {
            row,
            along,
            values,
            sign,
            first: first_level,
            step: (last_level - first_level) / n_levels as f64,
            n_levels,
            columns: Vec::new(),
            last: last_level,
            starts_at_level: false,
        };
        // Each column takes its triangles in the same order on any number of threads.
        let mut triangles = vec![Vec::new(); n];
        for (t, corners) in patch.mesh.triangles().iter().enumerate() {
            triangles[this.of_triangle(corners.map(|v| v as usize))].iter_mut().for_each(|at| at.push(t as u32));
        }
        let column = |(i, triangles): (usize, &Vec<u32>)| this.column(patch, sections, bands, i, triangles);
        this.columns = triangles.par_iter().enumerate().map(column).collect();
        this.find_inner_borders();
        Some(this)
    }

    /// The column of an index, with the triangles that reach into it.
    fn column(&self, patch: &Patch, sections: &Sections, bands: &[Band], i: usize, triangles: &[u32]) -> Column {
        let mut column = Column {
            cells: vec![Band::EMPTY; self.n_levels],
            border: None,
            ends: [[f64::INFINITY, f64::NEG_INFINITY]; 2],
            work: vec![0.0; self.n_levels + 1],
            lengths: vec![0.0; self.n_levels],
        };
        for &t in triangles {
            self.add(patch, sections, t as usize, &bands[t as usize], i, &mut column);
        }
        // The work below each level.
        let mut sum = 0.0;
        for w in &mut column.work {
            sum += *w;
            *w = sum;
        }
        column
    }

    /// Enters a triangle into a column.
    fn add(&self, patch: &Patch, sections: &Sections, t: usize, band: &Band, i: usize, column: &mut Column) {
        let bounds = [self.row.at(i), self.row.at(i + 1)];
        let v = patch.mesh.triangles()[t].map(|v| v as usize);
        let triangle = Polygon::triangle(v.map(|v| [self.values[v], self.sign * patch.levels[v]]));
        let share = slanted_share(patch, sections, &self.along, t, v[0]);
        let band = Band { limit: band.limit * share, requested: band.requested * share, ..*band };
        // Length of the levels on the triangle per area of the polygon; where the triangle is seen
        // edge on, there is no telling.
        let area = 0.5 * patch.mesh.scaled_normal(t).norm();
        let flat = triangle.area();
        let stretch = if flat > 1e-9 * area { area * band.slope / flat } else { 0.0 };
        // Only the part between the first level and the last is cut.
        let polygon = triangle.clip(1, [self.first, self.last]).clip(0, bounds);
        if !polygon.corners().is_empty() {
            self.enter(column, &polygon, &band, share, stretch);
            self.border(column, polygon.corners(), bounds, band.limit);
        }
    }

    /// The columns that a triangle reaches into, by the vertices of the patch at its corners.
    pub(crate) fn of_triangle(&self, corners: [usize; 3]) -> std::ops::RangeInclusive<usize> {
        let values = corners.map(|v| self.values[v]);
        let (from, to) = (least(values), -least(values.map(|x| -x)));
        self.row.interval(from).0..=self.row.interval(to).0
    }

    /// Enters a part of a triangle into the cells of its column.
    fn enter(&self, column: &mut Column, polygon: &Polygon, band: &Band, share: f64, stretch: f64) {
        let levels = || polygon.corners().iter().map(|c| c[1]);
        let low = levels().fold(f64::INFINITY, f64::min);
        let high = levels().fold(f64::NEG_INFINITY, f64::max);
        let (from, to) = (self.level_index(low), self.level_index(high));
        for k in from..=to {
            let bounds = [k, k + 1].map(|k| self.first + self.step * k as f64);
            let cell = &mut column.cells[k];
            let (low, high) = (low.max(bounds[0]), high.min(bounds[1]));
            let (limit, requested, slope) = (band.limit, band.requested, band.slope * share);
            *cell = cell.least(&Band { low, high, limit, requested, slope });
            let area = if from == to { polygon.area() } else { polygon.clip(1, bounds).area() };
            column.work[k + 1] += stretch * area / band.limit;
            column.lengths[k] += stretch * area / self.step;
        }
    }

    /// Widens the borders of a column to a part of a triangle in it.
    fn border(&self, column: &mut Column, polygon: &[[f64; 2]], bounds: [f64; 2], limit: f64) {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let border = column.border.get_or_insert(Border {
            outer: none,
            limits: [f64::INFINITY; 2],
            inner: none,
            lean: [1.0; 2],
            is_gentle: [false; 2],
            is_peak: false,
        });
        for &[x, level] in polygon {
            if level < border.outer[0] {
                (border.outer[0], border.limits[0]) = (level, limit);
            }
            if level > border.outer[1] {
                (border.outer[1], border.limits[1]) = (level, limit);
            }
            for (end, bound) in column.ends.iter_mut().zip(bounds) {
                if (x - bound).abs() <= 1e-9 * self.row.width {
                    *end = [end[0].min(level), end[1].max(level)];
                }
            }
        }
    }

    /// Finds the inner borders once all triangles are entered.
    fn find_inner_borders(&mut self) {
        let (inset, width) = (self.inset(), self.row.width);
        let [first, last] = [self.first, self.last];
        let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.columns.len() + 1];
        for (i, column) in self.columns.iter().enumerate() {
            for (end, met) in ends[i..i + 2].iter_mut().zip(column.ends) {
                *end = [end[0].min(met[0]), end[1].max(met[1])];
            }
        }
        for (column, ends) in self.columns.iter_mut().zip(ends.windows(2)) {
            let Some(border) = &mut column.border else { continue };
            let cut = |level: f64| level.clamp(first, last);
            border.outer = border.outer.map(cut);
            let met = |k: usize| [ends[0][k], ends[1][k]].into_iter().filter(|l| l.is_finite()).map(cut);
            let inner = [met(0).fold(border.outer[0], f64::max), met(1).fold(border.outer[1], f64::min)];
            border.lean = [0, 1].map(|k| (width / (inner[k] - border.outer[k]).abs()).hypot(1.0));
            border.is_gentle = border.lean.map(|lean| lean >= (1.0 / STEEPEST).hypot(1.0));
            border.inner = [inner[0] + inset, inner[1] - inset];
        }
        let peaks: Vec<bool> = (0..self.columns.len()).map(|i| self.is_peak(i)).collect();
        for (border, is_peak) in self.columns.iter_mut().map(|c| &mut c.border).zip(peaks) {
            border.iter_mut().for_each(|b| b.is_peak = is_peak);
        }
        let starts_at_level = self.borders().all(|b| b.inner[0] - first <= 2.0 * inset);
        self.starts_at_level = starts_at_level;
    }

    /// Whether the upper border of a column has its peak there.
    fn is_peak(&self, i: usize) -> bool {
        let border_of = |i: usize| self.columns.get(i)?.border.as_ref();
        let Some(border) = border_of(i) else { return false };
        let goes_on = |b: &Border| {
            let gain = b.outer[1] - border.outer[1];
            gain > self.inset() || b.is_gentle[1] && gain >= -self.inset()
        };
        !border.is_gentle[1] && ![i.wrapping_sub(1), i + 1].into_iter().filter_map(border_of).any(goes_on)
    }

    fn borders(&self) -> impl Iterator<Item = &Border> {
        self.columns.iter().filter_map(|c| c.border.as_ref())
    }

    /// Distance of a pass along a border from it: one exactly on it would be cut in crumbs.
    fn inset(&self) -> f64 {
        1e-3 * self.step
    }

    fn level_index(&self, level: f64) -> usize {
        (((level - self.first) / self.step).max(0.0) as usize).min(self.n_levels - 1)
    }

    /// Highest level that the pass after one at `level` may have on a column, so that the strip
    /// between both is nowhere wider than `factor` times the width allowed; infinite where the
    /// column needs no further pass, because the last is within a quarter of a step of the upper
    /// border.
    pub(crate) fn reach(&self, i: usize, level: f64, factor: f64) -> f64 {
        let Some(border) = &self.columns[i].border else { return f64::INFINITY };
        let finished = border.outer[1] - if border.is_peak { 0.5 } else { 0.25 } * border.limits[1] * factor;
        if level >= finished {
            return f64::INFINITY;
        }
        let reach = self.march(i, level, factor);
        let [lower, upper] = self.reach_beside(border, level, factor);
        let reach = if lower.is_finite() { reach.min(lower).max(border.inner[0].min(lower)) } else { reach };
        // The last pass stays inside along all of a border that it can follow.
        let inside = border.inner[1];
        let last = if border.is_gentle[1] && inside >= finished { inside } else { f64::INFINITY };
        // Nothing beside a peak ends on it: the last pass crosses it half a strip below.
        let last = if border.is_peak { last.min(finished) } else { last };
        reach.min(upper).min(last)
    }

    /// Whether each place on the borders is within half a strip of a pass, where the passes lie on
    /// these levels (in rising order) and none is shorter than `shortest`, mm.
    ///
    /// On a border that leans from the levels, passes begin and end, and the first can be a crumb.
    pub(crate) fn borders_served(&self, levels: &[f64], shortest: f64) -> bool {
        let laid = |l: &f64| (0..self.row.n).map(|i| self.length(i, *l)).sum::<f64>() >= shortest;
        let laid: Vec<f64> = levels.iter().copied().filter(laid).collect();
        let Some((&first, &last)) = laid.first().zip(laid.last()) else { return false };
        let in_column = |border: &Border| {
            let begins = first <= border.outer[0] + 0.5 * border.limits[0];
            let ends = last >= border.outer[1] - 0.5 * border.limits[1];
            let reaches = |w: &[f64]| {
                let [lower, upper] = self.reach_beside(border, w[0], 1.0);
                w[1] <= lower.min(upper) + 2.0 * self.inset()
            };
            begins && ends && laid.windows(2).all(reaches)
        };
        self.borders().all(in_column)
    }

    /// Highest levels of the pass after one at `level` that places on the lower and on the upper
    /// border of a column allow; infinite where they have no say.
    ///
    /// A place on a border that leans lies beside the end of the pass before or after it: it is
    /// within half a strip of one of both, where the end is at most `half / lean` of level away.
    fn reach_beside(&self, border: &Border, level: f64, factor: f64) -> [f64; 2] {
        let half = border.limits.map(|limit| 0.5 * limit * factor);
        let [low, high] = border.outer;
        // The lowest place that the end of the pass before does not reach. A pass along a border
        // that is a level has no end beside it.
        let beside = low.max(level + half[0] / border.lean[0]);
        let has_say = !self.starts_at_level && beside <= border.inner[0].max(low);
        let lower = if has_say { beside + half[0] } else { f64::INFINITY };
        // The lowest place on the upper border that the pass before does not reach.
        let beside = border.inner[1].max(level + half[1]);
        let upper = if beside <= high { beside + half[1] / border.lean[1] } else { f64::INFINITY };
        [lower, upper]
    }

    /// Highest level above `level` so that no cell that the step reaches into forbids it, and no
    /// place before a gap of the column is farther than half a strip from the pass at `level`.
    fn march(&self, i: usize, level: f64, factor: f64) -> f64 {
        let column = &self.columns[i];
        let (mut reach, mut narrowest) = (f64::INFINITY, f64::INFINITY);
        let mut top: Option<f64> = None;
        let is_inside = column.border.is_some_and(|border| border.outer[0] < level);
        let from = if level < self.first { 0 } else { self.level_index(level) };
        // Where the column has a gap, what is behind it still forbids.
        for (k, cell) in column.cells.iter().enumerate().skip(from).filter(|(_, cell)| cell.low.is_finite()) {
            let low = cell.low.max(self.first + self.step * k as f64);
            let before_gap = top.filter(|top| low > top + self.inset() && *top < reach);
            if let Some(top) = before_gap.filter(|top| top - level > 0.5 * narrowest) {
                return top;
            }
            if low >= reach {
                break;
            }
            let may_reach = match top {
                // A front in a gap cuts nothing: the next serves all behind the gap.
                None if is_inside && low > level + self.inset() => low + 0.5 * cell.limit * factor,
                _ => cell.low.max(level + cell.limit * factor),
            };
            reach = reach.min(may_reach);
            narrowest = narrowest.min(cell.limit * factor);
            top = Some(cell.high);
        }
        reach
    }

    /// Returns the longest way from one front to the next on a column, and whether it is longer
    /// than allowed: `levels` are those that the fronts may have on it, and `step` the largest
    /// between them.
    pub(crate) fn strip(&self, i: usize, levels: [f64; 2], step: f64) -> (f64, bool) {
        let [from, to] = levels.map(|l| self.level_index(l));
        let cells = self.columns[i].cells[from..=to].iter();
        let cells = cells.filter(|c| c.low < levels[1]);
        cells.fold((0.0, false), |(way, wide), c| {
            // Rounding of levels up to 1e4 mm is no excess.
            (f64::max(way, step / c.slope), wide || c.requested < c.limit && step > c.requested + 1e-9)
        })
    }

    /// Levels of a column for the first pass; `None` where it is empty.
    pub(crate) fn start(&self, i: usize) -> Option<Start> {
        self.columns[i].border.map(|b| Start {
            inside: b.inner[0],
            most: b.outer[0] + 0.5 * b.limits[0],
            is_gentle: b.is_gentle[0],
        })
    }

    /// Whether a pass on a level is inside the region somewhere on a column.
    pub(crate) fn holds(&self, i: usize, level: f64) -> bool {
        level <= self.last && self.length(i, level) > 0.0
    }

    /// Length of a pass on a level of a column, mm; above the last level it is cut on that.
    pub(crate) fn length(&self, i: usize, level: f64) -> f64 {
        if level < self.first { 0.0 } else { self.columns[i].lengths[self.level_index(level)] }
    }

    /// Length that passes as wide as allowed have between two levels of a column, mm.
    pub(crate) fn work(&self, i: usize, from: f64, to: f64) -> f64 {
        (self.work_below(i, to) - self.work_below(i, from)).max(0.0)
    }

    fn work_below(&self, i: usize, level: f64) -> f64 {
        let work = &self.columns[i].work;
        let way = ((level - self.first) / self.step).clamp(0.0, self.n_levels as f64);
        let k = (way as usize).min(self.n_levels - 1);
        work[k] + (work[k + 1] - work[k]) * (way - k as f64)
    }
}

/// The share of its step of level that a facet keeps for fronts up to the steepest, at least a
/// quarter.
///
/// Between two fronts with a step d of level at each place along them, the way at a fixed place
/// along them is d / |∇level × ∇x| · |∇x|, and up the steepest lines of level it is at most d /
/// (|∇level| − s·|∇x · g|), with s the steepest slope and g the direction of ∇level, all within the
/// facet. The shorter of both bounds the distance.
fn slanted_share(patch: &Patch, sections: &Sections, along: &Along, t: usize, v: usize) -> f64 {
    let p = patch.mesh.vertices()[v];
    let (Some(normal), Some(gradient)) = (patch.facet_normal(t as u32), sections.gradient(&p)) else { return 1.0 };
    let tangential = |d: Vector3<f64>| d - normal.into_inner() * normal.dot(&d);
    let (level, x) = (tangential(gradient.into_inner()), tangential(along.gradient(&p)));
    let (slope, length) = (level.norm(), x.norm());
    if slope <= 0.0 || length <= 0.0 {
        return 1.0;
    }
    let fixed = level.cross(&x).norm() / length;
    let steepest = slope - STEEPEST * (x.dot(&level) / slope).abs();
    (fixed.max(steepest) / slope).clamp(0.25, 1.0)
}

/// A convex polygon of up to ten corners: a triangle that is cut at three pairs of bounds.
#[derive(Clone, Copy)]
struct Polygon {
    n: usize,
    corners: [[f64; 2]; 10],
}

impl Polygon {
    fn triangle([a, b, c]: [[f64; 2]; 3]) -> Self {
        let mut this = Self { n: 3, corners: [[0.0; 2]; 10] };
        this.corners[..3].copy_from_slice(&[a, b, c]);
        this
    }

    fn corners(&self) -> &[[f64; 2]] {
        &self.corners[..self.n]
    }

    fn area(&self) -> f64 {
        let corners = self.corners();
        let Some([x, y]) = corners.first() else { return 0.0 };
        let of = |w: &[[f64; 2]]| (w[0][0] - x) * (w[1][1] - y) - (w[1][0] - x) * (w[0][1] - y);
        0.5 * corners.windows(2).map(of).sum::<f64>().abs()
    }

    /// The part between two coordinates, of the axis of that index.
    fn clip(&self, axis: usize, [from, to]: [f64; 2]) -> Self {
        let reaches_below = self.corners().iter().any(|c| c[axis] < from);
        let reaches_above = self.corners().iter().any(|c| c[axis] > to);
        match (reaches_below, reaches_above) {
            (false, false) => *self,
            (true, false) => self.clip_below(axis, 1.0, from),
            (false, true) => self.clip_below(axis, -1.0, -to),
            (true, true) => self.clip_below(axis, 1.0, from).clip_below(axis, -1.0, -to),
        }
    }

    /// The part whose coordinate times a sign is not below a bound.
    fn clip_below(&self, axis: usize, sign: f64, bound: f64) -> Self {
        let inside = |c: &[f64; 2]| sign * c[axis] - bound;
        let mut kept = Self { n: 0, corners: [[0.0; 2]; 10] };
        let corners = self.corners();
        for (k, a) in corners.iter().enumerate() {
            let b = corners.get(k + 1).unwrap_or(&corners[0]);
            let (ha, hb) = (inside(a), inside(b));
            if ha >= 0.0 {
                kept.push(*a);
            }
            if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
                let t = ha / (ha - hb);
                kept.push([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
            }
        }
        kept
    }

    /// Adds a corner; rounding can make a sliver more than convex, and what is beyond ten is lost.
    fn push(&mut self, corner: [f64; 2]) {
        if let Some(at) = self.corners.get_mut(self.n) {
            *at = corner;
            self.n += 1;
        }
    }
}
