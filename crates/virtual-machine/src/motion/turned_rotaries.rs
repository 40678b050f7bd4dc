//! Motion of the rotary axes while the tool vector turns evenly in the plane of its ends.

use std::f64::consts::PI;

use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine, Motion};
use nalgebra::Vector3;

use crate::motion::stepping::{rotary_axis, ways};

/// The rotary axes of a motion whose tool vector is turned.
///
/// With d the direction of the rotary axis nearer to the workpiece, which stands still on the
/// table, w = d·a of the tool axis a depends on the other axis alone: w = c₀ + c₁·cos(θ₂ − φ).
pub(crate) struct TurnedRotaries<'a> {
    machine: &'a Machine,
    motion: Motion<'a>,
    ends: [AxisValues; 2],
    /// d, table frame.
    direction: Vector3<f64>,
    /// c₀ and c₁.
    middle: f64,
    amplitude: f64,
    /// Way of the only axis that turns, where it alone turns the vector as it is to turn.
    alone: Option<f64>,
}

/// Smallest distance of the tool axis from the first rotary axis, and of cos(θ₂ − φ) from ±1, as
/// sines, at which rates are given: nearer, they are of no use, and rounded values do not determine
/// a speed.
const NEAREST: f64 = 0.01;

/// By what constant values may differ from rounding.
const STILL: f64 = 1e-9;

/// By how much an axis may be off the right angle, or off the vector, rad: of a metre that is as
/// little as rounding.
const EVEN: f64 = 1e-9;

/// By what the range of w may lack a full one from rounding.
const FULL: f64 = 1e-12;

impl<'a> TurnedRotaries<'a> {
    pub(crate) fn new(
        machine: &'a Machine,
        motion: Motion<'a>,
        [start, end]: [&AxisValues; 2],
        tool_length: f64,
    ) -> Option<Self> {
        let axes = machine.axes();
        let rotaries: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Rotary).collect();
        let &[a, b] = rotaries.as_slice() else { return None };
        let direction =
            |q: &AxisValues, k: usize| rotary_axis(machine, q, k, &machine.forward(q, tool_length), tool_length).0;
        let turned = |k: usize| {
            let mut q = *start;
            q[k] += 1.0;
            q
        };
        // The first one is not turned by the other, and turns it, as they are not parallel.
        let a_is_first = (direction(start, a) - direction(&turned(b), a)).norm() <= STILL;
        let (first, second) = if a_is_first { (a, b) } else { (b, a) };
        let [d, e] = [first, second].map(|k| direction(start, k));
        let axis = machine.cl_point(start, tool_length).axis.into_inner();
        let middle = e.dot(&axis) * d.dot(&e);
        let amplitude = (d.dot(&axis) - middle).hypot(d.dot(&e.cross(&axis)));
        let sound = amplitude >= NEAREST && d.norm() > 0.5 && e.norm() > 0.5;
        // About an axis at right angles to it a vector turns in a plane, and about its own not at
        // all.
        let is_even =
            |direction: &Vector3<f64>| direction.dot(&axis).abs() <= EVEN || direction.cross(&axis).norm() <= EVEN;
        // Past the pole some controls turn the first axis by half a turn instead.
        let side = |q: &AxisValues| machine.cl_point(q, tool_length).axis.cross(&d).dot(&e);
        let stays = [1.0, -1.0].into_iter().any(|sign| [start, end].into_iter().all(|q| sign * side(q) >= -EVEN));
        let way = |k: usize| (end[k] - start[k]).abs();
        let alone = match [way(first), way(second)] {
            [way, 0.0] if is_even(&d) => Some(way),
            [0.0, way] if is_even(&e) && stays => Some(way),
            _ => None,
        };
        let alone = alone.filter(|way| *way < PI);
        sound.then_some(Self { machine, motion, ends: [*start, *end], direction: d, middle, amplitude, alone })
    }

    /// w in the middle of an interval, and the turn over it.
    fn height(&self, from: f64, to: f64) -> (f64, f64) {
        let [a, b] = [from, to].map(|t| self.motion.ideal(t).axis);
        let turn = a.cross(&b).norm().atan2(a.dot(&b));
        (self.motion.ideal(0.5 * (from + to)).axis.dot(&self.direction), turn)
    }

    /// Whether the rotary axes reach the tool axis all over an interval.
    pub(crate) fn is_reached(&self, from: f64, to: f64) -> bool {
        let (height, turn) = self.height(from, to);
        let (low, high) = (self.middle - self.amplitude, self.middle + self.amplitude);
        (high >= 1.0 - FULL || height + 0.5 * turn <= high) && (low <= FULL - 1.0 || height - 0.5 * turn >= low)
    }

    /// Bounds on the sum of the rotary speeds and on that of their accelerations, per length of the
    /// interval; `None` where the axes come near to where they go without bounds, or may change to
    /// their other branch.
    ///
    /// a turns at ω, so that |ẇ| ≤ ω·ρ and |ẅ| ≤ ω²·|w| with ρ² = 1 − w². With z = (w − c₀)/c₁,
    /// θ₂ = φ ± acos z has the speed |ż|/√(1 − z²) and an acceleration of at most |z̈|/√(1 −
    /// z²) + |z|·ż²/√(1 − z²)³. θ₁ is the azimuth of a about d less that of where θ₂ turns the tool
    /// axis to with θ₁ = 0. That of a has a speed of at most ω/ρ and, as ρ² times it is constant,
    /// an acceleration of at most 2·ω²·|w|/ρ². The other one, as a function of θ₂, has derivatives
    /// of at most 1/ρ and 1/ρ + 2/ρ².
    ///
    /// Where one axis alone turns the vector evenly in its plane, or turns about it, axes that go
    /// evenly are a solution, and no other one is as near to the straight way: there are no bounds
    /// to look for, not even where the way begins or ends at the pole.
    pub(crate) fn over(&self, from: f64, to: f64) -> Option<[f64; 2]> {
        if let Some(way) = self.alone {
            return Some([way * (to - from), 0.0]);
        }
        let middle = 0.5 * (from + to);
        let [start, end] = &self.ends;
        let straight = start.lerp(end, middle);
        let [_, off] = ways(self.machine, &straight, &self.motion.at(middle).ok()?);
        let [_, straight_way] = ways(self.machine, start, end);
        if straight_way == 0.0 {
            // The tool axis stands still, and its rotary values are the same all the time.
            return (off <= STILL).then_some([0.0, 0.0]);
        }
        let (height, turn) = self.height(from, to);
        let largest = height.abs() + 0.5 * turn;
        let smallest = (height.abs() - 0.5 * turn).max(0.0);
        let z = ((height - self.middle).abs() + 0.5 * turn) / self.amplitude;
        let (rho, sine) = ((1.0 - largest * largest).sqrt(), (1.0 - z * z).sqrt());
        // Written so that NaN is refused, too.
        if !(rho >= NEAREST && sine >= NEAREST && z < 1.0) {
            return None;
        }
        let dz = turn * (1.0 - smallest * smallest).sqrt() / self.amplitude;
        let ddz = turn * turn * largest / self.amplitude;
        let second = [dz / sine, ddz / sine + z * dz * dz / sine.powi(3)];
        let first = [
            (turn + second[0]) / rho,
            2.0 * largest * (turn / rho).powi(2)
                + (1.0 / rho + 2.0 / (rho * rho)) * second[0] * second[0]
                + second[1] / rho,
        ];
        let speed = first[0] + second[0];
        // The control takes the branch that is nearer to the straight way of the axes. The other
        // one is 2·acos z away in θ₂ alone; what is nearer than half of that all over the interval
        // is the nearest all over it, and has no other winding.
        let farthest = off + 0.5 * (speed + straight_way * (to - from));
        (farthest < z.acos()).then_some([speed, first[1] + second[1]])
    }
}

#[cfg(test)]
#[path = "../../tests/unit/motion/turned_rotaries.rs"]
mod tests;
