use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_2, PI};

use crate::pass::CutterEnd;

/// A cutter in its place in the section across the feed: origin at the CC point, y to the left of
/// the feed, z along the surface normal, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutterPose {
    /// Its end.
    pub cutter: CutterEnd,
    /// Length of its flute along the axis, from the tip, mm; at least the corner radius.
    pub flute_length: f64,
    /// Unit vector along its axis from the tip to the spindle: along the feed, to its left, along
    /// the normal.
    pub axis: [f64; 3],
    /// y and z of its tip, the middle of the bottom.
    pub tip: [f64; 2],
}

/// Returns the largest thickness of the chip as a fraction of the feed per tooth: the largest f·n
/// over the engaged part of the cutting surface, with the unit feed f and the outward normal n.
/// Times the feed per tooth it is the thickest place of the chip.
///
/// `highest` returns the remaining stock in the section: over an interval of y the largest height
/// up to which there is material, −∞ where there is none; too large a value gives too large a
/// result. Engaged are the points of corner, bottom and flute whose normal has a component along
/// the feed, and that are not above the remaining stock at their y. 0 where there are none.
///
/// The result is an upper bound, found by dividing corner, flute and bottom into cells, those that
/// may be thickest first. Where `highest` is exact and continuous, it is at most `accuracy` above
/// the value of some point; that is an estimate where it jumps. `docs/chip-area.md` derives the
/// surface.
///
/// ```
/// use facemill_chip_area::{CutterEnd, CutterPose, largest_thickness};
///
/// // A round insert of radius 6, upright, 2 mm deep in full stock: the sine of the angle at the stock's top.
/// let cutter = CutterEnd { radius: 40.0, corner_radius: 6.0 };
/// let pose = CutterPose { cutter, flute_length: 10.0, axis: [0.0, 0.0, 1.0], tip: [0.0, 0.0] };
/// let share = largest_thickness(&pose, |_| 2.0, 1e-3);
/// let depth: f64 = 2.0 / 6.0;
/// let exact = (2.0 * depth - depth * depth).sqrt();
/// assert!(share >= exact && share <= exact + 1e-3);
/// ```
pub fn largest_thickness(pose: &CutterPose, highest: impl Fn([f64; 2]) -> f64, accuracy: f64) -> f64 {
    let surface = Surface::new(pose);
    let may_engage = |cell: &Cell| {
        let [y, z] = surface.extent(cell);
        z[0] <= highest(y)
    };
    let mut open: BinaryHeap<Cell> = surface.cells().filter(|c| c.bound > 0.0 && may_engage(c)).collect();
    if open.is_empty() {
        return 0.0;
    }
    let (mut found, mut looked_at) = (0.0, 0);
    while let Some(cell) = open.peek().copied() {
        looked_at += 1;
        if cell.bound <= found + accuracy || looked_at > MAX_CELLS {
            return found.max(cell.bound);
        }
        open.pop();
        for half in surface.halves(&cell) {
            if half.bound <= found || !may_engage(&half) {
                continue;
            }
            let (share, [y, z]) = surface.middle(&half);
            if share > found && z <= highest([y, y]) {
                found = share;
            }
            open.push(half);
        }
    }
    found
}

/// Largest number of cells, after which the bound is returned as it is: it still is a bound.
const MAX_CELLS: usize = 50_000;

/// A part of the cutting surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CutterPart {
    Corner,
    Flute,
    Bottom,
}

/// A piece of a part: angles about the axis, counted from the feed, and the part's own coordinate.
#[derive(Clone, Copy, Debug)]
struct Cell {
    part: CutterPart,
    phi: [f64; 2],
    /// On the corner the angle of the normal from the axis downward (rad), on the flute the height
    /// over the middle of the rim, on the bottom the distance from its middle (mm).
    along: [f64; 2],
    /// Bound on f·n for all of its points.
    bound: f64,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cell {}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cell {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// The cutting surface. With e(φ) = u·cos φ + v·sin φ across the axis a, u that of the feed, and M
/// the middle of the rim: the corner is M + (ρ + r·sin θ)·e − r·cos θ·a with the normal sin θ·e −
/// cos θ·a, the flute M + R·e + h·a with the normal e, the bottom M + q·e − r·a with the normal −a.
struct Surface {
    rim: f64,
    corner: f64,
    flute: f64,
    /// f·a and f·u.
    along: f64,
    across: f64,
    /// y and z of the rim's middle M, of a, u and v.
    middle: [f64; 2],
    axis: [f64; 2],
    u: [f64; 2],
    v: [f64; 2],
}

impl Surface {
    fn new(pose: &CutterPose) -> Self {
        let CutterEnd { radius, corner_radius: corner } = pose.cutter;
        let [along, y, z] = pose.axis;
        let across = y.hypot(z);
        // u = (f − (f·a)·a)/across and v = a × u; with the axis along the feed any two directions
        // across it.
        let (u, v) = if across > 0.0 {
            ([-along * y / across, -along * z / across], [z / across, -y / across])
        } else {
            ([1.0, 0.0], [0.0, 1.0])
        };
        Self {
            rim: radius - corner,
            corner,
            flute: (pose.flute_length - corner).max(0.0),
            along,
            across,
            middle: [pose.tip[0] + corner * y, pose.tip[1] + corner * z],
            axis: [y, z],
            u,
            v,
        }
    }

    /// Returns the cells that cover all of it.
    fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        const SECTORS: u32 = 12;
        let sectors = (0..SECTORS).map(|k| [k, k + 1].map(|k| PI * (2.0 * f64::from(k) / f64::from(SECTORS) - 1.0)));
        sectors.flat_map(move |phi| {
            let parts = [
                (self.corner > 0.0, CutterPart::Corner, FRAC_PI_2),
                (true, CutterPart::Flute, self.flute),
                (self.rim > 0.0, CutterPart::Bottom, self.rim),
            ];
            let there = parts.into_iter().filter(|(is_there, ..)| *is_there);
            there.map(move |(_, part, to)| self.cell(part, phi, [0.0, to]))
        })
    }

    fn cell(&self, part: CutterPart, phi: [f64; 2], along: [f64; 2]) -> Cell {
        let across = self.across * cos_range(phi)[1];
        // f·n = sin θ·f·u·cos φ − cos θ·f·a, at most √(..)·cos(θ − θ of the largest); sin θ is not
        // below 0.
        let bound = match part {
            CutterPart::Corner => {
                let largest = across.atan2(-self.along);
                across.hypot(self.along) * cos_range(along.map(|theta| theta - largest))[1]
            }
            CutterPart::Flute => across,
            CutterPart::Bottom => -self.along,
        };
        Cell { part, phi, along, bound }
    }

    /// Returns the radius about the axis and the height over the rim's middle.
    fn profile(&self, part: CutterPart, along: f64) -> [f64; 2] {
        match part {
            CutterPart::Corner => {
                let (sin, cos) = along.sin_cos();
                [self.rim + self.corner * sin, -self.corner * cos]
            }
            CutterPart::Flute => [self.rim + self.corner, along],
            CutterPart::Bottom => [along, -self.corner],
        }
    }

    /// Returns ranges of y and z that hold all points of a cell.
    fn extent(&self, cell: &Cell) -> [[f64; 2]; 2] {
        let [[q0, h0], [q1, h1]] = cell.along.map(|along| self.profile(cell.part, along));
        std::array::from_fn(|k| {
            let e = sinusoid_range(self.u[k], self.v[k], cell.phi);
            // Both radius and height grow along the profile.
            let out = [(q0 * e[0]).min(q1 * e[0]), (q0 * e[1]).max(q1 * e[1])];
            let up = [h0 * self.axis[k], h1 * self.axis[k]];
            [self.middle[k] + out[0] + up[0].min(up[1]), self.middle[k] + out[1] + up[0].max(up[1])]
        })
    }

    /// Returns f·n, and y and z, in the middle of a cell.
    fn middle(&self, cell: &Cell) -> (f64, [f64; 2]) {
        let [phi, along] = [cell.phi, cell.along].map(|[a, b]| 0.5 * (a + b));
        let (sin, cos) = phi.sin_cos();
        let [q, h] = self.profile(cell.part, along);
        let at = std::array::from_fn(|k| self.middle[k] + q * (self.u[k] * cos + self.v[k] * sin) + h * self.axis[k]);
        let share = match cell.part {
            CutterPart::Corner => {
                let (sin_theta, cos_theta) = along.sin_cos();
                sin_theta * self.across * cos - cos_theta * self.along
            }
            CutterPart::Flute => self.across * cos,
            CutterPart::Bottom => -self.along,
        };
        (share, at)
    }

    /// Returns both halves of a cell, divided where that narrows its points and normals more.
    fn halves(&self, cell: &Cell) -> [Cell; 2] {
        let Cell { part, phi, along, .. } = *cell;
        let radius = self.rim + self.corner;
        let around = phi[1] - phi[0];
        let [[q0, h0], [q1, h1]] = along.map(|along| self.profile(part, along));
        let spread = |k: usize| {
            let e = sinusoid_range(self.u[k], self.v[k], phi);
            [radius * (e[1] - e[0]), (q1 - q0) * e[0].abs().max(e[1].abs()) + (h1 - h0) * self.axis[k].abs()]
        };
        let ([y_phi, y_along], [z_phi, z_along]) = (spread(0), spread(1));
        // Heights decide which points are engaged; so does the lateral place of a point where the
        // remaining stock is steep.
        let turn = self.corner.max(SMALLEST_TURN * radius);
        let by_phi = z_phi + SIDEWAYS * y_phi + turn * around * around;
        let by_along = z_along
            + SIDEWAYS * y_along
            + if part == CutterPart::Corner { self.corner * (along[1] - along[0]) } else { 0.0 };
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        if by_phi >= by_along {
            let m = middle(phi);
            [self.cell(part, [phi[0], m], along), self.cell(part, [m, phi[1]], along)]
        } else {
            let m = middle(along);
            [self.cell(part, phi, [along[0], m]), self.cell(part, phi, [m, along[1]])]
        }
    }
}

/// Weight of a lateral step against one in height where cells are divided; it changes only the
/// number of cells.
const SIDEWAYS: f64 = 0.2;

/// Weight of a turn of the normal where there is no corner, as a fraction of the radius; it changes
/// only the number of cells.
const SMALLEST_TURN: f64 = 0.05;

/// Returns the smallest and largest cosine of the angles between two, which are not more than 2π
/// apart.
fn cos_range([from, to]: [f64; 2]) -> [f64; 2] {
    let ends = [from.cos(), to.cos()];
    let holds = |angle: f64| ((from - angle) / (2.0 * PI)).ceil() * (2.0 * PI) + angle <= to;
    let low = if holds(PI) { -1.0 } else { ends[0].min(ends[1]) };
    let high = if holds(0.0) { 1.0 } else { ends[0].max(ends[1]) };
    [low, high]
}

/// Returns the smallest and largest value of u·cos φ + v·sin φ.
fn sinusoid_range(u: f64, v: f64, [from, to]: [f64; 2]) -> [f64; 2] {
    let (size, phase) = (u.hypot(v), v.atan2(u));
    cos_range([from - phase, to - phase]).map(|c| size * c)
}
