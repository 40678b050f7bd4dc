//! Deviation of the motion in a block from the ideal motion between its ends.

mod block;
mod path;

use std::f64::consts::PI;

use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use nalgebra::Vector3;

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::motion::deviation::block::{Block, Derivatives};
use crate::motion::{BlockLaw, OPPOSITE_COSINE, Turn};

/// Deviation of the control's motion in a block from the ideal one: the tip on a straight line, the
/// tool axis turning uniformly in the plane of its ends, both in the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Deviation of the tip, mm.
    pub tip: f64,
    /// Deviation of the tool axis, rad.
    pub axis: f64,
}

impl Deviation {
    /// Returns the deviation of any point of the cutter's rim and bottom, mm: tip + R·δ.
    pub fn rim(&self, radius: f64) -> f64 {
        self.tip + radius * self.axis
    }

    /// Returns the larger value of each.
    #[must_use]
    pub fn max(&self, other: &Self) -> Self {
        Self { tip: self.tip.max(other.tip), axis: self.axis.max(other.axis) }
    }
}

/// Largest excess of a bound over the real deviation, as a fraction of it, before it is sharpened.
const EXCESS: f64 = 0.03;

/// Largest number of parts into which a block is split to sharpen its bound.
const MAX_PARTS: usize = 64;

/// Deviation of the tip, mm, and of the axis, rad, below which no bound is sharpened: far below a
/// control's resolution, far above rounding.
const NEGLIGIBLE: Deviation = Deviation { tip: 1e-6, axis: 1e-9 };

/// Bounds the deviation of the motion in one block from the straight motion between its ends.
///
/// `law` is a [`CuttingLaw`], a [`RapidLaw`] or a [`BlockLaw`]. The bound is a guarantee up to
/// rounding (1e-15 of the travels), not an estimate. It is sharp: for blocks in which the rotary
/// axes turn by some degrees it is within 10 % of the real deviation, mostly within 3 %, where that
/// is more than 1e-6 mm or 1e-9 rad. Zero where no rotary axis moves, except for rapids with a
/// speed for each axis.
///
/// - [`CuttingLaw::AxesLinear`] and [`RapidLaw::Linear`]: from the ideal pose at the same time,
///   which is at least the distance from the ideal path.
/// - [`CuttingLaw::TipAndRotariesLinear`]: the same, the tip without deviation.
/// - [`CuttingLaw::TipLinearVectorTurned`]: none; but π for an axis that reverses, whose turn has
///   no plane.
/// - [`RapidLaw::PerAxis`]: the path bends, and equal times do not give the distance from the
///   straight one. For every pose on the way one pose of the ideal motion has both tip *and* axis
///   within the bound.
///
/// *Proof.* e(t), motion minus ideal motion, vanishes at both ends of the block, and |e‴| ≤ P, a
/// sum over triples of joints. (1) With e″(½) = c, known exactly, a sum over pairs of joints, e is
/// the sum of −t(1−t)·c/2 and of a part whose second derivative is at most P·|t − ½|; so |e|
/// ≤ |c|/8 + P/48 (Green's function of the second derivative; its integral with |t − ½| is largest
/// in the middle, 1/48). (2) e differs from the parabola 4t(1−t)·e(½) by at most P/6·|t(t−½)(t−1)|
/// (interpolation at three times); so |e| ≤ |e(½)| + P·√3/216. (3) Where neither is sharp the block
/// is split into n equal parts: in each |e| is at most the larger end's plus |e″|/(8n²), with |e″|
/// ≤ |c| + P/2 everywhere. For the tool axis e is a chord between unit vectors, converted to an
/// angle by 2·asin(chord/2). Bends are at the ends of parts, where the ideal pose may be chosen; in
/// between it moves evenly from one to the next.
///
/// Missing values count as 0; with values that are not finite the bound is infinite.
pub fn deviation_bound(
    machine: &Machine,
    law: impl Into<BlockLaw>,
    start: &AxisValues,
    end: &AxisValues,
    tool_length: f64,
) -> Deviation {
    if !(start.is_finite() && end.is_finite() && tool_length.is_finite()) {
        return Deviation { tip: f64::INFINITY, axis: f64::INFINITY };
    }
    let [start, end] = &[start, end].map(|q| AxisValues::from_fn(machine.axes().len(), |k| q.get_or_zero(k)));
    match law.into() {
        BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) => {
            let [a, b] = [start, end].map(|q| machine.cl_point(q, tool_length).axis);
            Deviation { tip: 0.0, axis: if a.dot(&b) < OPPOSITE_COSINE { PI } else { 0.0 } }
        }
        BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) => {
            Deviation { tip: 0.0, ..in_equal_time(machine, start, end, tool_length) }
        }
        BlockLaw::Cutting(CuttingLaw::AxesLinear) | BlockLaw::Rapid(RapidLaw::Linear) => {
            in_equal_time(machine, start, end, tool_length)
        }
        BlockLaw::Rapid(RapidLaw::PerAxis) => path::from_path(machine, start, end, tool_length),
    }
}

/// Bounds the distance from the ideal pose at the same time, with all axes moving linearly.
fn in_equal_time(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Deviation {
    let block = Block::new(machine, start, end, tool_length);
    let meant = Meant::new(machine, start, end, tool_length);
    let (tip, mut axis) = (block.tip(), block.axis());
    // The second derivative of the ideal axis is −angle²·axis, the third one has the length angle³.
    let angle = meant.turn.angle;
    axis.second += meant.turn.at(0.5).into_inner() * (angle * angle);
    axis.third += angle.powi(3);
    let found = meant.deviation(&block.middle, 0.5);
    let direct = Deviation {
        tip: tip.largest_from_chord(found.tip),
        axis: angle_of_chord(axis.largest_from_chord(chord_of_angle(found.axis))),
    };
    let sharp = |bound: f64, found: f64, negligible: f64| bound <= (1.0 + EXCESS) * found || bound <= negligible;
    if sharp(direct.tip, found.tip, NEGLIGIBLE.tip) && sharp(direct.axis, found.axis, NEGLIGIBLE.axis) {
        return direct;
    }
    let curvature = Deviation { tip: tip.largest_second() / 8.0, axis: axis.largest_second() / 8.0 };
    let n = parts_for(&curvature, &found);
    let mut largest = found;
    for k in 1..n {
        let t = k as f64 / n as f64;
        largest = largest.max(&meant.deviation(&machine.cl_point(&start.lerp(end, t), tool_length), t));
    }
    let within = 1.0 / (n * n) as f64;
    let split = Deviation {
        tip: largest.tip + curvature.tip * within,
        axis: angle_of_chord(chord_of_angle(largest.axis) + curvature.axis * within),
    };
    Deviation { tip: direct.tip.min(split.tip), axis: direct.axis.min(split.axis) }
}

/// Returns the number of parts after which `curvature`, the largest deviation within an unsplit
/// block, is within the allowed excess.
fn parts_for(curvature: &Deviation, found: &Deviation) -> usize {
    let n = |curvature: f64, found: f64, negligible: f64| (curvature / (EXCESS * found.max(negligible))).sqrt().ceil();
    let tip = n(curvature.tip, found.tip, NEGLIGIBLE.tip);
    // Even, so the middle, which is known already, is among the ends of parts.
    (tip.max(n(curvature.axis, found.axis, NEGLIGIBLE.axis)).clamp(2.0, MAX_PARTS as f64) as usize).next_multiple_of(2)
}

impl Derivatives {
    /// Returns the largest distance from the chord in equal time, from the derivatives and from the
    /// distance in the middle.
    fn largest_from_chord(&self, in_the_middle: f64) -> f64 {
        let by_second = self.second.norm() / 8.0 + self.third / 48.0;
        by_second.min(in_the_middle + self.third * (3f64.sqrt() / 216.0))
    }

    /// Returns the largest second derivative.
    fn largest_second(&self) -> f64 {
        self.second.norm() + 0.5 * self.third
    }
}

fn angle_of_chord(chord: f64) -> f64 {
    2.0 * (0.5 * chord).min(1.0).asin()
}

fn chord_of_angle(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin()
}

/// Ideal motion between two positions.
struct Meant {
    start: ClPoint,
    tip_way: Vector3<f64>,
    turn: Turn,
}

impl Meant {
    fn new(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Self {
        let [a, b] = [start, end].map(|q| machine.cl_point(q, tool_length));
        Self { start: a, tip_way: b.tip - a.tip, turn: Turn::new(&a.axis, &b.axis) }
    }

    /// Returns the deviation of a pose from the ideal one at the fraction `s` of the way.
    fn deviation(&self, cl: &ClPoint, s: f64) -> Deviation {
        let chord = (cl.axis.into_inner() - self.turn.at(s).into_inner()).norm();
        Deviation { tip: (cl.tip - self.start.tip - self.tip_way * s).norm(), axis: angle_of_chord(chord) }
    }
}
