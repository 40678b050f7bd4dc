//! The solid that a body sweeps, as intervals of a map's lines.

use std::f64::consts::PI;

use facemill_cl_data::ClPoint;
use nalgebra::Vector3;

use crate::dexel::bodies::body::TurnedBody;
use crate::dexel::bodies::lanes::{Verdicts, Wide};
use crate::dexel::bodies::placed::Placed;
use crate::dexel::bodies::side::{Side, Warm};
use crate::dexel::bodies::sweep::{SweepPart, slerp};
use crate::dexel::bodies::turning::Turning;
use crate::dexel::grid::DexelGrid;

/// Directions in which the outline is bounded on each side of a row: it is too wide by some 10⁻³ of
/// the body's radius.
const OUTLINE: usize = 32;

/// A swept solid over the lines of a map; heights in the map's frame.
#[derive(Clone, Debug)]
pub(crate) struct Swept<'a> {
    way: BodyMotion<'a>,
    /// Rows and columns of the lines that may meet the solid.
    pub(crate) window: [[usize; 2]; 2],
    /// The same, closer, once [`Swept::outline`] has been called.
    pub(crate) rows: Rows,
    /// Lowest and highest point.
    pub(crate) bounds: [f64; 2],
    /// Planes that all of the solid is above.
    floors: [Floor; 2],
}

/// How a body moves.
#[derive(Clone, Debug)]
enum BodyMotion<'a> {
    /// Seen from below, and from above with heights negated.
    Straight(Box<[Side<'a>; 2]>),
    Turning(Box<Turning<'a>>),
}

/// Lines that may meet the solid: a range of rows, and of each row a range of columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(crate) first: usize,
    /// First and last column; an empty row has first > last.
    pub(crate) columns: Vec<[u32; 2]>,
}

/// z = x·a + y·b + c, with nothing of the solid below it.
#[derive(Clone, Copy, Debug)]
struct Floor([f64; 3]);

/// Start values of the two sides from the line before.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Warmth {
    pub(crate) below: Warm,
    pub(crate) above: Warm,
}

impl<'a> Swept<'a> {
    /// Without its outline; `None` where it is beside all lines.
    pub(crate) fn straight(body: &'a TurnedBody, [from, to]: [ClPoint; 2], grid: &DexelGrid) -> Option<Self> {
        let at_end = ClPoint { tip: to.tip, axis: from.axis };
        let below = Side::new(Placed::new(body, &from), Placed::new(body, &at_end));
        let above = below.mirrored();
        Self::new(BodyMotion::Straight(Box::new([below, above])), &from.axis, grid)
    }

    /// The same of a part whose axis turns, within the tolerance.
    pub(crate) fn turning(part: &SweepPart<'a>, tolerance: f64, grid: &DexelGrid) -> Option<Self> {
        let axis = slerp(&part.from.axis, &part.to.axis, part.turn, 0.5);
        Self::new(BodyMotion::Turning(Box::new(Turning::new(part, tolerance))), &axis, grid)
    }

    fn new(way: BodyMotion<'a>, axis: &Vector3<f64>, grid: &DexelGrid) -> Option<Self> {
        let between = |k: usize, n: Vector3<f64>| grid.between(k, -way.height_in(&-n), way.height_in(&n));
        let window = [between(1, Vector3::y())?, between(0, Vector3::x())?];
        let z = Vector3::z();
        let bounds = [-way.height_in(&-z), way.height_in(&z)];
        let under = if axis.z > 0.0 { -axis } else { *axis };
        let floors = [Floor::new(&way, -z), Floor::new(&way, if under.z < -0.1 { under } else { -z })];
        Some(Self { way, window, rows: Rows::default(), bounds, floors })
    }

    /// Finds the columns of each row.
    pub(crate) fn outline(&mut self, grid: &DexelGrid) {
        self.rows = Rows::new(&self.way, self.window[0], grid);
    }

    /// Returns the losses of sixteen lines, as far as they are quickly found.
    #[inline(always)]
    pub(crate) fn verdicts(&self, x: &Wide, y: f64, tops: &Wide, floors: &Wide, warm: &mut Warmth) -> Verdicts {
        match &self.way {
            BodyMotion::Straight(sides) => sides[0].verdicts(x, y, tops, floors, &mut warm.below),
            BodyMotion::Turning(turning) => turning.verdicts(x, y, tops, floors, &mut warm.below),
        }
    }

    /// Straight motions that are the same within the tolerance, each seen from below and from
    /// above.
    pub(crate) fn pieces(&self) -> &[[Side<'a>; 2]] {
        match &self.way {
            BodyMotion::Straight(sides) => std::slice::from_ref(sides),
            BodyMotion::Turning(turning) => turning.pieces(),
        }
    }

    /// A height that the solid is not below.
    #[inline(always)]
    pub(crate) fn floor_at(&self, x: f64, y: f64) -> f64 {
        let [Floor([a, b, c]), Floor([d, e, f])] = self.floors;
        let (a, b) = (a * x + b * y + c, d * x + e * y + f);
        if a > b { a } else { b }
    }

    /// A height that the solid is not below over a rectangle.
    pub(crate) fn floor(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        self.floors.iter().map(|f| f.least(x, y)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Returns a bound on the loss of the line at (x, y) by a straight motion, if it may lose anything;
/// its material ends at `highest`.
#[inline]
pub(crate) fn interval(
    [below, above]: &[Side; 2],
    [x, y]: [f64; 2],
    highest: f64,
    warmth: &mut Warmth,
) -> Option<[f64; 2]> {
    let from = below.entry(x, y, &mut warmth.below)?.height;
    if from >= highest {
        return None;
    }
    // Inside the body at the start or at the end is enough to be inside the swept solid.
    if below.holds(&Vector3::new(x, y, highest)) {
        return Some([from, f64::INFINITY]);
    }
    Some([from, -above.entry(x, y, &mut warmth.above)?.height])
}

impl BodyMotion<'_> {
    fn height_in(&self, n: &Vector3<f64>) -> f64 {
        match self {
            BodyMotion::Straight(sides) => sides[0].height_in(n),
            BodyMotion::Turning(turning) => turning.height_in(n),
        }
    }
}

impl Floor {
    fn new(side: &BodyMotion, n: Vector3<f64>) -> Self {
        Self([-n.x / n.z, -n.y / n.z, side.height_in(&n) / n.z])
    }

    fn least(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let [a, b, c] = self.0;
        (a * x[0]).min(a * x[1]) + (b * y[0]).min(b * y[1]) + c
    }
}

impl Rows {
    /// By tangents of the outline: never too narrow.
    fn new(side: &BodyMotion, [first, last]: [usize; 2], grid: &DexelGrid) -> Self {
        // Right: x ≤ a·y + b; left: −x ≤ a·y + b.
        let tangents = [1.0, -1.0].map(|facing| {
            let mut lines = [[0.0; 2]; OUTLINE];
            for (k, line) in lines.iter_mut().enumerate() {
                let (sin, cos) = (PI * ((k as f64 + 0.5) / OUTLINE as f64 - 0.5)).sin_cos();
                let height = side.height_in(&Vector3::new(facing * cos, sin, 0.0));
                *line = [-sin / cos, height / cos];
            }
            lines
        });
        let reach = |lines: &[[f64; 2]; OUTLINE], y: f64| {
            lines.iter().fold(f64::INFINITY, |least, [a, b]| if a * y + b < least { a * y + b } else { least })
        };
        let columns = (first..=last).map(|j| {
            let y = grid.y(j);
            let [right, left] = [reach(&tangents[0], y), -reach(&tangents[1], y)];
            grid.between(0, left, right).map_or([1, 0], |[from, to]| [from as u32, to as u32])
        });
        Self { first, columns: columns.collect() }
    }

    /// First and last column of a row within a range, if any.
    pub(crate) fn within(&self, row: usize, from: usize, to: usize) -> Option<[usize; 2]> {
        let [first, last] = self.columns.get(row.checked_sub(self.first)?)?.map(|c| c as usize);
        let (first, last) = (first.max(from), last.min(to));
        (first <= last).then_some([first, last])
    }
}
