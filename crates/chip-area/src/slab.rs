use nalgebra::Point2;

use crate::level_curve::{Branch, LevelCurve, segment_area};

/// Stock between the surface and its offset by the depth of cut, in the frame of the tool (y along its axis, origin at
/// the first CC point).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    /// Signed curvature of the surface: > 0 convex, < 0 concave.
    pub(crate) curvature: f64,
    /// Surface of the part.
    pub(crate) part: LevelCurve,
    /// Surface of the stock.
    pub(crate) stock: LevelCurve,
}

/// Section of a tool in its own frame: everything above a lower outline over an interval of x.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolSection {
    /// Where the tool is over x.
    pub(crate) range: [f64; 2],
    /// Its outline from below.
    pub(crate) bottom: Bottom,
}

/// Lower outline of a tool.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bottom {
    /// Flat at this y.
    Flat(f64),
    /// Lower half of a circle.
    Ball(Point2<f64>, f64),
}

/// One edge of a piece as a function of x.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Edge {
    Part(Branch),
    Stock(Branch),
    Bottom(Bottom),
}

/// The points over `x` between two edges that do not cross there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    pub(crate) x: [f64; 2],
    pub(crate) low: Edge,
    pub(crate) high: Edge,
}

impl Bottom {
    fn curve(&self) -> LevelCurve {
        match *self {
            Self::Flat(y) => LevelCurve::horizontal(y),
            Self::Ball(center, radius) => LevelCurve::circle(center, radius),
        }
    }

    fn y_at(&self, x: f64) -> f64 {
        match *self {
            Self::Flat(y) => y,
            Self::Ball(c, r) => c.y - ((r - (x - c.x)) * (r + (x - c.x))).max(0.0).sqrt(),
        }
    }
}

impl Edge {
    fn y_at(&self, x: f64, layer: &Layer) -> f64 {
        match self {
            Self::Part(branch) => layer.part.y_at(x, *branch),
            Self::Stock(branch) => layer.stock.y_at(x, *branch),
            Self::Bottom(bottom) => bottom.y_at(x),
        }
    }

    /// Curvature, positive where the arc is above its chord.
    fn bulge(&self, layer: &Layer) -> f64 {
        match self {
            Self::Bottom(Bottom::Flat(_)) => 0.0,
            Self::Bottom(Bottom::Ball(_, r)) => -1.0 / r,
            Self::Part(Branch::Near) => layer.part.curvature(),
            Self::Part(Branch::Far) => -layer.part.curvature(),
            Self::Stock(Branch::Near) => layer.stock.curvature(),
            Self::Stock(Branch::Far) => -layer.stock.curvature(),
        }
    }

    /// ∫ y dx over `x` in closed form: trapezoid and circular segment.
    fn integral(&self, x: [f64; 2], layer: &Layer) -> f64 {
        let (y0, y1) = (self.y_at(x[0], layer), self.y_at(x[1], layer));
        let width = x[1] - x[0];
        let bulge = self.bulge(layer);
        0.5 * width * (y0 + y1) + segment_area(bulge.abs(), width.hypot(y1 - y0)).copysign(bulge)
    }
}

impl Slab {
    pub(crate) fn area(&self, layer: &Layer) -> f64 {
        (self.high.integral(self.x, layer) - self.low.integral(self.x, layer)).max(0.0)
    }

    /// Whether the slabs have points of the vertical line at `x` in common, or miss that by no more than `touch`.
    fn joins(&self, other: &Self, x: f64, layer: &Layer, touch: f64) -> bool {
        let low = self.low.y_at(x, layer).max(other.low.y_at(x, layer));
        low <= self.high.y_at(x, layer).min(other.high.y_at(x, layer)) + touch
    }
}

/// The piece of `layer` inside `tool` and not inside `without` that touches `seed`, as slabs.
///
/// Between two neighbouring crossings of the outlines the edges of every piece are the same curves all the way, so the
/// decomposition is exact up to rounding, and equal or touching outlines only add slabs of no area.
pub(crate) fn piece_at(
    layer: &Layer,
    tool: &ToolSection,
    without: Option<&ToolSection>,
    seed: Point2<f64>,
) -> Vec<Slab> {
    // What may be missing between two pieces that are one, relative to the tool's extent: rounding thins a chip away
    // where the two positions touch. Larger, and neighbouring pieces run together; smaller, and rounding cuts a chip.
    const TOUCH: f64 = 1e-10;
    let touch = TOUCH * (tool.range[1] - tool.range[0]);
    let cuts = cuts(layer, tool, without, seed.x);
    let between = |x: &[f64]| slabs_between([x[0], x[1]], layer, tool, without, touch);
    connected_to(seed, cuts.windows(2).flat_map(between).collect(), layer, touch)
}

/// Every x at which an edge of a piece may begin, end, or give way to another, in order, within the tool's range.
fn cuts(layer: &Layer, tool: &ToolSection, without: Option<&ToolSection>, seed: f64) -> Vec<f64> {
    let mut curves = vec![layer.part, layer.stock, tool.bottom.curve()];
    let mut cuts = vec![tool.range[0], tool.range[1], seed];
    if let Some(first) = without {
        curves.push(first.bottom.curve());
        cuts.extend(first.range);
    }
    for (i, a) in curves.iter().enumerate() {
        cuts.extend(a.extremes().into_iter().flatten());
        cuts.extend(curves[..i].iter().flat_map(|b| a.crossings(b)).flatten());
    }
    cuts.retain(|&x| tool.range[0] <= x && x <= tool.range[1]);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts
}

fn slabs_between(
    x: [f64; 2],
    layer: &Layer,
    tool: &ToolSection,
    without: Option<&ToolSection>,
    touch: f64,
) -> impl Iterator<Item = Slab> {
    let middle = 0.5 * (x[0] + x[1]);
    let y = move |edge: &Edge| edge.y_at(middle, layer);
    let bottom = Edge::Bottom(tool.bottom);
    let ceiling = without
        .filter(|first| first.range[0] <= middle && middle <= first.range[1])
        .map(|first| Edge::Bottom(first.bottom));
    layer_over(middle, layer).into_iter().flatten().filter_map(move |(low, high)| {
        let low = if y(&bottom) > y(&low) { bottom } else { low };
        let high = ceiling.filter(|c| y(c) < y(&high)).unwrap_or(high);
        (y(&low) <= y(&high) + touch).then_some(Slab { x, low, high })
    })
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

/// The slabs that hang together with one that touches `seed`.
fn connected_to(seed: Point2<f64>, slabs: Vec<Slab>, layer: &Layer, touch: f64) -> Vec<Slab> {
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
