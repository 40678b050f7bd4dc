use nalgebra::{Point2, Vector2};

use crate::section::level_curve::{Branch, LevelCurve};
use crate::section::tool_section::{Form, PARALLEL, ToolSection, arc_integral};

/// Stock between the surface and its offset by the depth of cut, in the frame of the tool (y along
/// its axis, origin at a CC point).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// Signed curvature of the surface: > 0 convex, < 0 concave.
    pub(crate) curvature: f64,
    /// Surface of the part.
    pub(crate) part: LevelCurve,
    /// Surface of the stock.
    pub(crate) stock: LevelCurve,
    /// x of the leftmost and rightmost points of both.
    sides: [[Option<f64>; 2]; 2],
}

/// The stock's side of a straight border: `outward`·p ≤ `level`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Border {
    /// Unit normal, away from the stock.
    pub(crate) outward: Vector2<f64>,
    pub(crate) level: f64,
}

/// A tool in the stock, and the earlier cuts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut<'a> {
    pub(crate) layer: &'a Layer,
    pub(crate) tool: &'a ToolSection,
    /// Ends of the stock.
    pub(crate) borders: [Option<Border>; 2],
    /// Earlier positions of the same tool.
    pub(crate) before: [Option<ToolSection>; 2],
    /// The CC point: stock connected to it is cut, if nothing has been cut before.
    pub(crate) seed: Point2<f64>,
}

/// One edge of a piece as a function of x.
#[derive(Clone, Copy, Debug)]
enum Edge {
    Part(Branch),
    Stock(Branch),
    Tool(Form),
    /// Of one of the tools before.
    Before(usize, Form),
    Border(usize),
}

/// The points over `x` between two edges that do not cross there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    x: [f64; 2],
    low: Edge,
    high: Edge,
    /// Heights of both edges in the middle.
    y: [f64; 2],
}

impl Layer {
    /// Creates stock `depth` thick on a surface through the origin with this normal there.
    pub(crate) fn new(curvature: f64, normal: Vector2<f64>, depth: f64) -> Self {
        let part = LevelCurve::offset_of_surface(curvature, normal, 0.0);
        let stock = LevelCurve::offset_of_surface(curvature, normal, depth);
        Self { curvature, part, stock, sides: [part.extremes(), stock.extremes()] }
    }

    /// Returns whether a tool that touches the surface at `contact` is below it. Above a plane or a
    /// convex surface a tool needs only its axis above the tangent. In a concave one its bottom
    /// must be inside the circle, and the flute must have left the stock of this cut before it
    /// meets the surface again.
    pub(crate) fn is_gouged_by(&self, tool: &ToolSection, contact: Point2<f64>) -> bool {
        if self.curvature >= 0.0 {
            return false;
        }
        let slack = PARALLEL * 2.0 * tool.rim.half_width();
        let alone = Cut { layer: self, tool, borders: [None; 2], before: [None; 2], seed: contact };
        tool.least_value(&self.part) < -slack || alone.meets_the_far_side()
    }
}

impl Border {
    fn line(&self) -> LevelCurve {
        LevelCurve::line(self.outward, self.level)
    }

    /// Returns whether it is a function of x.
    fn is_slanted(&self) -> bool {
        self.outward.y.abs() > PARALLEL
    }
}

impl Cut<'_> {
    /// Returns the area of the stock inside the tool that is connected to the CC point, minus
    /// earlier cuts.
    pub(crate) fn area(&self) -> f64 {
        self.piece().iter().filter_map(|slab| self.left_over(slab)).map(|slab| self.area_of(&slab)).sum()
    }

    /// Returns whether the tool runs into the far side of a concave surface before it has left the
    /// stock of the cut.
    pub(crate) fn meets_the_far_side(&self) -> bool {
        self.layer.curvature < 0.0
            && !self.is_over_the_hollow()
            && self.piece().iter().any(|slab| matches!(slab.high, Edge::Part(Branch::Far)))
    }

    /// Returns whether the tool is only over the hollow of a concave surface's stock: every
    /// vertical line has separate stock of the near and of the far side.
    fn is_over_the_hollow(&self) -> bool {
        let [Some(a), Some(b)] = self.layer.sides[1] else { return false };
        let [low, high] = self.tool.range();
        self.layer.curvature < 0.0 && a.min(b) < low && high < a.max(b)
    }

    /// Returns the stock in the tool that is connected to the seed, ignoring earlier cuts, as
    /// slabs.
    ///
    /// Between two neighbouring crossings of the outlines the edges of every piece are the same
    /// curves throughout, so the decomposition is exact up to rounding, and equal or touching
    /// outlines only add slabs of no area.
    pub(crate) fn piece(&self) -> Vec<Slab> {
        // Largest gap between two pieces that are one, relative to the tool's extent: rounding
        // thins a piece away where it touches the next. Larger: neighbouring pieces merge. Smaller:
        // rounding divides a chip.
        const TOUCH: f64 = 1e-10;
        let touch = TOUCH * 2.0 * self.tool.rim.half_width();
        let mut slabs = Vec::with_capacity(32);
        let sides = if self.is_over_the_hollow() { 1 } else { 2 };
        for x in self.cuts().windows(2) {
            self.slabs_between([x[0], x[1]], sides, touch, &mut slabs);
        }
        // On a plane or a convex surface the tool is above the tangent, so it cuts a convex piece
        // of everything below the stock's surface, and all of that is stock. Slabs of the near side
        // without a gap are one piece too.
        let gap = |pair: &[Slab]| pair[0].x[1] != pair[1].x[0] || pair[1].y[0] >= pair[1].y[1];
        if self.layer.curvature >= 0.0 || (sides == 1 && !slabs.windows(2).any(gap)) {
            slabs
        } else {
            self.connected(slabs, touch)
        }
    }

    /// Returns x of the CC point; a corner that touches there is off it by rounding.
    fn seed_x(&self) -> f64 {
        let [low, high] = self.tool.range();
        self.seed.x.clamp(low, high)
    }

    /// Returns every x at which an edge may begin, end, or be replaced by another, in order, within
    /// the tool's range.
    fn cuts(&self) -> Vec<f64> {
        let (range, layer) = (self.tool.range(), self.layer);
        let mut cuts = Vec::with_capacity(32);
        let mut add = |x: f64| {
            if range[0] <= x && x <= range[1] {
                cuts.push(x);
            }
        };
        // At the CC point the outline touches the part, so it must not be the middle of a slab.
        [range[0], range[1], self.seed_x()].into_iter().for_each(&mut add);
        layer.sides.iter().flatten().flatten().copied().for_each(&mut add);
        self.tool.kinks().into_iter().flatten().for_each(&mut add);
        self.tool.crossings(&layer.stock, |p| add(p.x));
        for before in self.before.iter().flatten() {
            before.range().into_iter().chain(before.kinks().into_iter().flatten()).for_each(&mut add);
            before.crossings(&layer.stock, |p| add(p.x));
            self.tool.crossing_with(before).into_iter().for_each(&mut add);
        }
        if let [Some(left), Some(right)] = &self.before {
            left.crossing_with(right).into_iter().for_each(&mut add);
        }
        for border in self.borders.iter().flatten() {
            self.border_cuts(border, &mut add);
        }
        cuts.sort_unstable_by(f64::total_cmp);
        cuts.dedup();
        cuts
    }

    fn border_cuts(&self, border: &Border, mut add: impl FnMut(f64)) {
        if !border.is_slanted() {
            return add(border.level / border.outward.x);
        }
        let line = border.line();
        for curve in [self.layer.part, self.layer.stock]
            .iter()
            .chain(&self.borders.iter().flatten().map(Border::line).collect::<Vec<_>>())
        {
            line.crossings(curve).into_iter().flatten().for_each(|p| add(p.x));
        }
        self.tool.crossings(&line, |p| add(p.x));
        self.before.iter().flatten().for_each(|before| before.crossings(&line, |p| add(p.x)));
    }

    fn slabs_between(&self, x: [f64; 2], sides: usize, touch: f64, slabs: &mut Vec<Slab>) {
        let middle = 0.5 * (x[0] + x[1]);
        let bottom = Edge::Tool(self.tool.form_over(middle));
        let outside = |b: &Border| !b.is_slanted() && b.outward.x * middle > b.level;
        if self.borders.iter().flatten().any(outside) {
            return;
        }
        let y_bottom = self.y_at(bottom, middle);
        for (low, high) in layer_over(middle, self.layer).into_iter().take(sides).flatten() {
            let (mut high, mut y_high) = (high, self.y_at(high, middle));
            if y_bottom > y_high + touch {
                continue;
            }
            let (mut low, mut y_low) = (low, self.y_at(low, middle));
            if y_bottom > y_low {
                (low, y_low) = (bottom, y_bottom);
            }
            for (i, border) in self.borders.iter().enumerate() {
                let Some(border) = border.filter(Border::is_slanted) else { continue };
                let y = self.y_at(Edge::Border(i), middle);
                if border.outward.y > 0.0 && y < y_high {
                    (high, y_high) = (Edge::Border(i), y);
                } else if border.outward.y < 0.0 && y > y_low {
                    (low, y_low) = (Edge::Border(i), y);
                }
            }
            if y_low <= y_high + touch {
                slabs.push(Slab { x, low, high, y: [y_low, y_high] });
            }
        }
    }

    /// Returns the part of a slab that has not been cut before.
    fn left_over(&self, slab: &Slab) -> Option<Slab> {
        let middle = 0.5 * (slab.x[0] + slab.x[1]);
        let (mut high, mut y_high) = (slab.high, slab.y[1]);
        for (i, before) in self.before.iter().enumerate() {
            let Some(before) = before else { continue };
            let [from, to] = before.range();
            if from <= middle && middle <= to {
                let edge = Edge::Before(i, before.form_over(middle));
                let y = self.y_at(edge, middle);
                if y < y_high {
                    (high, y_high) = (edge, y);
                }
            }
        }
        (slab.y[0] < y_high).then_some(Slab { high, ..*slab })
    }

    /// Returns the slabs that are connected to one that touches the seed.
    fn connected(&self, mut slabs: Vec<Slab>, touch: f64) -> Vec<Slab> {
        let seed = Point2::new(self.seed_x(), self.seed.y);
        let touches = |s: &Slab| {
            s.x.contains(&seed.x)
                && self.y_at(s.low, seed.x) <= seed.y + touch
                && seed.y - touch <= self.y_at(s.high, seed.x)
        };
        let mut taken: Vec<bool> = slabs.iter().map(touches).collect();
        let mut open: Vec<usize> = (0..slabs.len()).filter(|&i| taken[i]).collect();
        while let Some(i) = open.pop() {
            // At most two slabs are over the same x, so neighbours of a slab are not farther away
            // in the list.
            for j in i.saturating_sub(3)..slabs.len().min(i + 4) {
                if !taken[j] && self.join(&slabs[i], &slabs[j], touch) {
                    taken[j] = true;
                    open.push(j);
                }
            }
        }
        let mut taken = taken.into_iter();
        slabs.retain(|_| taken.next() == Some(true));
        slabs
    }

    /// Returns whether two adjacent slabs have points in common, or miss that by no more than
    /// `touch`.
    fn join(&self, a: &Slab, b: &Slab, touch: f64) -> bool {
        let x = if a.x[1] == b.x[0] {
            a.x[1]
        } else if a.x[0] == b.x[1] {
            a.x[0]
        } else {
            return false;
        };
        let low = self.y_at(a.low, x).max(self.y_at(b.low, x));
        low <= self.y_at(a.high, x).min(self.y_at(b.high, x)) + touch
    }

    #[inline]
    fn y_at(&self, edge: Edge, x: f64) -> f64 {
        match edge {
            Edge::Part(branch) => self.layer.part.y_at(x, branch),
            Edge::Stock(branch) => self.layer.stock.y_at(x, branch),
            Edge::Tool(form) => self.tool.y_at(x, form),
            Edge::Before(i, form) => self.before[i].map_or(f64::INFINITY, |tool| tool.y_at(x, form)),
            Edge::Border(i) => self.borders[i].map_or(f64::INFINITY, |b| (b.level - b.outward.x * x) / b.outward.y),
        }
    }

    /// Returns ∫ y dx over `x` in closed form.
    fn integral(&self, edge: Edge, x: [f64; 2]) -> f64 {
        let arc = |bulge: f64| arc_integral(x, x.map(|x| self.y_at(edge, x)), bulge);
        match edge {
            Edge::Part(Branch::Near) => arc(self.layer.part.curvature()),
            Edge::Part(Branch::Far) => arc(-self.layer.part.curvature()),
            Edge::Stock(Branch::Near) => arc(self.layer.stock.curvature()),
            Edge::Stock(Branch::Far) => arc(-self.layer.stock.curvature()),
            Edge::Tool(form) => self.tool.integral(x, form),
            Edge::Before(i, form) => self.before[i].map_or(f64::INFINITY, |tool| tool.integral(x, form)),
            Edge::Border(_) => arc(0.0),
        }
    }

    /// Returns whether a point is in one of the slabs.
    pub(crate) fn holds(&self, slabs: &[Slab], p: &Point2<f64>) -> bool {
        slabs.iter().any(|slab| {
            let [from, to] = slab.x;
            from <= p.x && p.x <= to && self.y_at(slab.low, p.x) <= p.y && p.y <= self.y_at(slab.high, p.x)
        })
    }

    fn area_of(&self, slab: &Slab) -> f64 {
        (self.integral(slab.high, slab.x) - self.integral(slab.low, slab.x)).max(0.0)
    }
}

/// Returns the layer on the vertical line at `x`. Nothing below a convex part is listed: a tool
/// that is not below the surface does not reach it.
fn layer_over(x: f64, layer: &Layer) -> [Option<(Edge, Edge)>; 2] {
    use Branch::{Far, Near};
    let (part, stock) = (layer.part.reach(x) >= 0.0, layer.stock.reach(x) >= 0.0);
    if layer.curvature >= 0.0 {
        match (stock, part) {
            (false, _) => [None; 2],
            (true, true) => [Some((Edge::Part(Near), Edge::Stock(Near))), None],
            (true, false) => [Some((Edge::Stock(Far), Edge::Stock(Near))), None],
        }
    } else {
        match (stock, part) {
            (_, false) => [None; 2],
            (false, true) => [Some((Edge::Part(Near), Edge::Part(Far))), None],
            (true, true) => [Some((Edge::Part(Near), Edge::Stock(Near))), Some((Edge::Stock(Far), Edge::Part(Far)))],
        }
    }
}
