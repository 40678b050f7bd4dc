//! The solid that a body sweeps on a straight line without turning, as intervals of a map's lines.

use std::f64::consts::PI;

use facemill_cl_data::ClPoint;
use nalgebra::Vector3;

use crate::dexel::body::TurnedBody;
use crate::dexel::grid::DexelGrid;
use crate::dexel::lanes::{Verdicts, Wide};
use crate::dexel::placed::Placed;
use crate::dexel::side::{Side, Warm};

/// Directions in which the outline is bounded on each side of a row: it is too wide by some 10⁻³ of the body's radius.
const OUTLINE: usize = 32;

/// A swept solid over the lines of a map; heights in the map's frame.
#[derive(Clone, Debug)]
pub(crate) struct Straight<'a> {
    below: Side<'a>,
    /// The same seen from above: heights negated.
    above: Side<'a>,
    pub(crate) rows: Rows,
    /// Lowest and highest point.
    pub(crate) bounds: [f64; 2],
    /// Planes that all of the solid is above.
    floors: [Floor; 2],
}

/// Lines that may meet the solid: a range of rows, and of each row a range of columns.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub(crate) first: usize,
    /// First and last column; an empty row has first > last.
    pub(crate) columns: Vec<[u32; 2]>,
}

/// z = x·a + y·b + c, with nothing of the solid below it.
#[derive(Clone, Copy, Debug)]
struct Floor([f64; 3]);

/// What the two sides know from the line before.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Warmth {
    pub(crate) below: Warm,
    pub(crate) above: Warm,
}

impl<'a> Straight<'a> {
    /// Tips and axis in the map's frame.
    pub(crate) fn new(body: &'a TurnedBody, from: &ClPoint, to: &ClPoint, grid: &DexelGrid) -> Option<Self> {
        let at_end = ClPoint { tip: to.tip, axis: from.axis };
        let below = Side::new(Placed::new(body, from), Placed::new(body, &at_end));
        let rows = Rows::new(&below, grid)?;
        let above = below.mirrored();
        let z = Vector3::z();
        let bounds = [-below.height_in(&-z), below.height_in(&z)];
        let axis = from.axis.into_inner();
        let under = if axis.z > 0.0 { -axis } else { axis };
        let floors = [Floor::new(&below, -z), Floor::new(&below, if under.z < -0.1 { under } else { -z })];
        Some(Self { below, above, rows, bounds, floors })
    }

    /// Height at which the line enters, and slope of the surface along x there.
    #[inline]
    pub(crate) fn bottom(&self, x: f64, y: f64, warmth: &mut Warmth) -> Option<[f64; 2]> {
        let entry = self.below.entry(x, y, &mut warmth.below)?;
        Some([entry.height, -entry.normal.x / entry.normal.z])
    }

    /// What sixteen lines lose, as far as that is quickly told.
    #[inline(always)]
    pub(crate) fn verdicts(&self, x: &Wide, y: f64, tops: &Wide, floors: &Wide, warmth: &mut Warmth) -> Verdicts {
        self.below.verdicts(x, y, tops, floors, &mut warmth.below)
    }

    /// Height at which the line leaves, and slope of the surface along x there.
    #[inline]
    pub(crate) fn top(&self, x: f64, y: f64, warmth: &mut Warmth) -> Option<[f64; 2]> {
        let entry = self.above.entry(x, y, &mut warmth.above)?;
        Some([-entry.height, entry.normal.x / entry.normal.z])
    }

    /// Whether a point is inside the body at the start or at the end, which is enough to be inside the swept solid.
    #[inline]
    pub(crate) fn holds(&self, x: f64, y: f64, z: f64) -> bool {
        self.below.holds(&Vector3::new(x, y, z))
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

impl Floor {
    fn new(side: &Side, n: Vector3<f64>) -> Self {
        Self([-n.x / n.z, -n.y / n.z, side.height_in(&n) / n.z])
    }

    fn least(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let [a, b, c] = self.0;
        (a * x[0]).min(a * x[1]) + (b * y[0]).min(b * y[1]) + c
    }
}

impl Rows {
    /// By tangents of the outline: never too narrow. `None` where there is no line.
    fn new(side: &Side, grid: &DexelGrid) -> Option<Self> {
        let y = Vector3::y();
        let [first, last] = grid.between(1, -side.height_in(&-y), side.height_in(&y))?;
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
        Some(Self { first, columns: columns.collect() })
    }

    pub(crate) fn last(&self) -> usize {
        self.first + self.columns.len() - 1
    }

    /// First and last column of a row within a range, if any.
    pub(crate) fn within(&self, row: usize, from: usize, to: usize) -> Option<[usize; 2]> {
        let [first, last] = self.columns.get(row.checked_sub(self.first)?)?.map(|c| c as usize);
        let (first, last) = (first.max(from), last.min(to));
        (first <= last).then_some([first, last])
    }

    /// First and last column of all rows.
    pub(crate) fn columns(&self) -> Option<[usize; 2]> {
        let some = self.columns.iter().filter(|c| c[0] <= c[1]);
        some.copied().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).map(|c| c.map(|c| c as usize))
    }
}
