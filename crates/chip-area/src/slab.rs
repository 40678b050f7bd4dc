use nalgebra::{Point2, Vector2};

use crate::level_curve::{Branch, LevelCurve};
use crate::tool_section::{Bottom, PARALLEL, ToolSection, arc_integral};

/// Stock between the surface and its offset by the depth of cut, in the frame of the tool (y along its axis, origin at
/// a CC point).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// Signed curvature of the surface: > 0 convex, < 0 concave.
    pub(crate) curvature: f64,
    /// Surface of the part.
    pub(crate) part: LevelCurve,
    /// Surface of the stock.
    pub(crate) stock: LevelCurve,
}

/// The stock's side of a straight border: `outward`·p ≤ `level`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Border {
    /// Unit normal, away from the stock.
    pub(crate) outward: Vector2<f64>,
    pub(crate) level: f64,
}

/// A tool in the stock, and what of it has been cut before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut<'a> {
    pub(crate) layer: &'a Layer,
    pub(crate) tool: &'a ToolSection,
    /// Where the stock ends.
    pub(crate) borders: [Option<Border>; 2],
    /// Where the same tool has been.
    pub(crate) before: [Option<ToolSection>; 2],
    /// The CC point: what hangs together with it is cut, if nothing has been cut before.
    pub(crate) seed: Point2<f64>,
}

/// One edge of a piece as a function of x.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Edge {
    Part(Branch),
    Stock(Branch),
    Bottom(Bottom),
    Border(Border),
}

/// The points over `x` between two edges that do not cross there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    pub(crate) x: [f64; 2],
    pub(crate) low: Edge,
    pub(crate) high: Edge,
}

impl Layer {
    /// Stock `depth` thick on a surface through the origin with this normal there.
    pub(crate) fn new(curvature: f64, normal: Vector2<f64>, depth: f64) -> Self {
        Self {
            curvature,
            part: LevelCurve::offset_of_surface(curvature, normal, 0.0),
            stock: LevelCurve::offset_of_surface(curvature, normal, depth),
        }
    }

    /// Whether a tool that touches the surface at `contact` is below it. Above a plane or a convex surface a tool is
    /// wherever its axis is above the tangent; in a concave one its bottom must be inside the circle, and the flute must
    /// have left the stock of this cut before it meets the surface again.
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

    /// Whether it is a function of x.
    fn is_slanted(&self) -> bool {
        self.outward.y.abs() > PARALLEL
    }
}

impl Edge {
    fn y_at(&self, x: f64, layer: &Layer) -> f64 {
        match self {
            Self::Part(branch) => layer.part.y_at(x, *branch),
            Self::Stock(branch) => layer.stock.y_at(x, *branch),
            Self::Bottom(bottom) => bottom.y_at(x),
            Self::Border(b) => (b.level - b.outward.x * x) / b.outward.y,
        }
    }

    /// Curvature of a circle or line, positive where the arc is above its chord.
    fn bulge(&self, layer: &Layer) -> f64 {
        match self {
            Self::Part(Branch::Near) => layer.part.curvature(),
            Self::Part(Branch::Far) => -layer.part.curvature(),
            Self::Stock(Branch::Near) => layer.stock.curvature(),
            Self::Stock(Branch::Far) => -layer.stock.curvature(),
            Self::Bottom(_) | Self::Border(_) => 0.0,
        }
    }

    /// ∫ y dx over `x` in closed form.
    fn integral(&self, x: [f64; 2], layer: &Layer) -> f64 {
        match self {
            Self::Bottom(bottom) => bottom.integral(x),
            _ => arc_integral(x, x.map(|x| self.y_at(x, layer)), self.bulge(layer)),
        }
    }
}

impl Slab {
    fn area(&self, layer: &Layer) -> f64 {
        (self.high.integral(self.x, layer) - self.low.integral(self.x, layer)).max(0.0)
    }

    /// Whether the slabs have points of the vertical line at `x` in common, or miss that by no more than `touch`.
    fn joins(&self, other: &Self, x: f64, layer: &Layer, touch: f64) -> bool {
        let low = self.low.y_at(x, layer).max(other.low.y_at(x, layer));
        low <= self.high.y_at(x, layer).min(other.high.y_at(x, layer)) + touch
    }
}

impl Cut<'_> {
    /// Area of the stock that hangs together with the CC point inside the tool, less what has been cut before.
    pub(crate) fn area(&self) -> f64 {
        self.piece().iter().filter_map(|slab| self.left_over(slab)).map(|slab| slab.area(self.layer)).sum()
    }

    /// Whether the tool runs into the far side of a concave surface before it has left the stock of the cut.
    pub(crate) fn meets_the_far_side(&self) -> bool {
        let [left, right] = self.layer.stock.extremes();
        let range = self.tool.range();
        let beside = |x: Option<f64>| x.is_some_and(|x| range[0] < x && x < range[1]);
        // A vertical line that crosses the hollow has stock of the near and of the far side apart from each other.
        self.layer.curvature < 0.0
            && (beside(left) || beside(right) || self.layer.stock.reach(0.5 * (range[0] + range[1])) < 0.0)
            && self.piece().iter().any(|slab| matches!(slab.high, Edge::Part(Branch::Far)))
    }

    /// The stock in the tool that hangs together with the seed, nothing cut before, as slabs.
    ///
    /// Between two neighbouring crossings of the outlines the edges of every piece are the same curves all the way, so
    /// the decomposition is exact up to rounding, and equal or touching outlines only add slabs of no area.
    fn piece(&self) -> Vec<Slab> {
        // What may be missing between two pieces that are one, relative to the tool's extent: rounding thins a piece
        // away where it touches the next. Larger, and neighbouring pieces run together; smaller, and rounding cuts a
        // chip.
        const TOUCH: f64 = 1e-10;
        let touch = TOUCH * 2.0 * self.tool.rim.half_width();
        let mut slabs = Vec::with_capacity(32);
        for x in self.cuts().windows(2) {
            self.slabs_between([x[0], x[1]], touch, &mut slabs);
        }
        self.connected(slabs, touch)
    }

    /// x of the CC point; a corner that touches there is beside it by rounding.
    fn seed_x(&self) -> f64 {
        let [low, high] = self.tool.range();
        self.seed.x.clamp(low, high)
    }

    /// Every x at which an edge may begin, end, or give way to another, in order, within the tool's range.
    fn cuts(&self) -> Vec<f64> {
        let (range, layer) = (self.tool.range(), self.layer);
        let mut cuts = Vec::with_capacity(32);
        let mut add = |x: f64| {
            if range[0] <= x && x <= range[1] {
                cuts.push(x);
            }
        };
        [range[0], range[1], self.seed_x()].into_iter().for_each(&mut add);
        if layer.curvature != 0.0 {
            let extremes = layer.part.extremes().into_iter().chain(layer.stock.extremes());
            extremes.flatten().for_each(&mut add);
        }
        self.tool.kinks().into_iter().flatten().for_each(&mut add);
        self.tool.crossings(&layer.stock, &mut add);
        for before in self.before.iter().flatten() {
            before.range().into_iter().chain(before.kinks().into_iter().flatten()).for_each(&mut add);
            before.crossings(&layer.stock, &mut add);
            self.tool.crossings_with(before, &mut add);
        }
        if let [Some(left), Some(right)] = &self.before {
            left.crossings_with(right, &mut add);
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
            line.crossings(curve).into_iter().flatten().for_each(&mut add);
        }
        self.tool.crossings(&line, &mut add);
        self.before.iter().flatten().for_each(|before| before.crossings(&line, &mut add));
    }

    fn slabs_between(&self, x: [f64; 2], touch: f64, slabs: &mut Vec<Slab>) {
        let middle = 0.5 * (x[0] + x[1]);
        let y = |edge: &Edge| edge.y_at(middle, self.layer);
        let bottom = Edge::Bottom(self.tool.bottom_over(middle));
        let outside = |b: &Border| !b.is_slanted() && b.outward.x * middle > b.level;
        if self.borders.iter().flatten().any(outside) {
            return;
        }
        for (mut low, mut high) in layer_over(middle, self.layer).into_iter().flatten() {
            if y(&bottom) > y(&low) {
                low = bottom;
            }
            for border in self.borders.iter().flatten().filter(|b| b.is_slanted()) {
                let edge = Edge::Border(*border);
                let end = if border.outward.y > 0.0 { &mut high } else { &mut low };
                if (y(&edge) - y(end)) * border.outward.y < 0.0 {
                    *end = edge;
                }
            }
            if y(&low) <= y(&high) + touch {
                slabs.push(Slab { x, low, high });
            }
        }
    }

    /// What has not been cut before of a slab.
    fn left_over(&self, slab: &Slab) -> Option<Slab> {
        let middle = 0.5 * (slab.x[0] + slab.x[1]);
        let mut high = slab.high;
        for before in self.before.iter().flatten() {
            let range = before.range();
            let edge = Edge::Bottom(before.bottom_over(middle));
            if range[0] <= middle && middle <= range[1] && edge.y_at(middle, self.layer) < high.y_at(middle, self.layer)
            {
                high = edge;
            }
        }
        (slab.low.y_at(middle, self.layer) < high.y_at(middle, self.layer)).then_some(Slab { high, ..*slab })
    }

    /// The slabs that hang together with one that touches the seed.
    fn connected(&self, slabs: Vec<Slab>, touch: f64) -> Vec<Slab> {
        let (seed, layer) = (Point2::new(self.seed_x(), self.seed.y), self.layer);
        let mut taken: Vec<bool> = slabs
            .iter()
            .map(|s| {
                s.x.contains(&seed.x)
                    && s.low.y_at(seed.x, layer) <= seed.y + touch
                    && seed.y - touch <= s.high.y_at(seed.x, layer)
            })
            .collect();
        let mut open: Vec<usize> = (0..slabs.len()).filter(|&i| taken[i]).collect();
        while let Some(i) = open.pop() {
            for j in 0..slabs.len() {
                let shared = slabs[i].x.into_iter().find(|x| slabs[j].x.contains(x));
                if !taken[j] && shared.is_some_and(|x| slabs[i].joins(&slabs[j], x, layer, touch)) {
                    taken[j] = true;
                    open.push(j);
                }
            }
        }
        slabs.into_iter().zip(taken).filter_map(|(s, taken)| taken.then_some(s)).collect()
    }
}

/// The layer on the vertical line at `x`. Below a convex part nothing is listed: a tool that is not below the surface
/// does not get there.
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
