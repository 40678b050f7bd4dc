//! Choice of rotary positions by a control when a program gives the tool's axis as a vector.

#[cfg(test)]
#[path = "../../tests/unit/inverse/control_choice_laws.rs"]
mod laws;

use std::f64::consts::{FRAC_PI_2, TAU};

use facemill_cl_data::ClPoint;
use nalgebra::{Unit, Vector3};

use crate::axes::axis::{Axis, AxisLetter};
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::solver::Solver;
use crate::solver::inverse_solution::Unreachable;

/// Smallest angle between the tool axis, on its way too, and the rotary axis nearest to the
/// workpiece at which a choice is returned, rad. Nearer to the pole, controls have settings of
/// their own for the motion of their axes, and the decimals of a vector turn that axis by more than
/// thirty times the turn of the tool. Smaller: choices that nobody knows are returned; larger:
/// choices that all controls make alike are refused.
pub const POLE_CONE: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// How much farther than by the factor another position must be for the choice to be clear, rad:
/// rounding of near values, and any constant that a control adds to a comparison. Smaller relies on
/// controls to distinguish nearly equal ways; larger refuses short ways.
const CLEARLY: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Largest ratio of the ways of two rotary axes between the measures of different controls: the sum
/// of two ways is up to twice the larger one. A position more than twice as far by its larger way
/// is farther by the sum, and by every norm between the two.
const BY_ANY_NORM: f64 = 2.0;

/// Largest excess over a limit that counts as rounding, rad.
const AT_LIMIT: f64 = 1e-9;

/// Angle between the tool and a vector below which the control turns nothing, rad: the accuracy of
/// the solution. A program cannot express so small a turn. Smaller would turn the axes by rounding
/// where a vector is repeated; larger would take a different vector for the same one.
const STILL: f64 = 1e-12;

/// Reason why it is not known where a control turns the rotary axes to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnclearChoice {
    /// The machine has not three linear and two rotary axes.
    #[error(
        "what a control does with a tool vector is followed on machines with three linear and two rotary axes alone"
    )]
    OtherMachine,
    /// No position has this tool axis and tip.
    #[error("no position of the axes does: {0}")]
    Unreachable(#[from] Unreachable),
    /// The tool axis is too near to a rotary axis, at its end or on its way.
    #[error(
        "the tool comes within {:.3} deg of the direction of axis {axis}, where controls differ in what it does", angle.to_degrees()
    )]
    Pole {
        /// The rotary axis nearest to the workpiece.
        axis: AxisLetter,
        /// The smallest angle, rad.
        angle: f64,
    },
    /// The nearest position is not within the limits.
    #[error("the nearest position would have axis {axis} at {:.3} deg, beyond its limit", value.to_degrees())]
    BeyondLimit {
        /// The axis.
        axis: AxisLetter,
        /// Its value, rad.
        value: f64,
    },
    /// Another position is nearly as near.
    #[error(
        "the axes can turn by up to {:.3} deg or, to another position, by up to {:.3} deg: which way a control takes is \
         not clear", near.to_degrees(), far.to_degrees()
    )]
    TwoWays {
        /// Largest turn of an axis to the nearest position, rad.
        near: f64,
        /// The same to the next one, rad.
        far: f64,
    },
}

/// A position and the largest turn of a rotary axis to it.
struct Candidate {
    values: AxisValues,
    turn: f64,
    /// First rotary axis that is beyond its limits.
    beyond: Option<usize>,
}

impl Machine {
    /// Returns the position that a control takes for a tool axis given as a vector, from the
    /// present axis values. Among all positions within the limits of the rotary axes, on every
    /// branch and at every full turn, it is the one with the smallest largest turn of a rotary
    /// axis. `cl` is in the table frame. Limits of linear axes are not tested.
    ///
    /// Where the tool has the direction of the vector already, to 1e-12 rad, the rotary axes keep
    /// their values to the last bit, as they do in all blocks that repeat a vector.
    ///
    /// Every other position within the limits is guaranteed to have a largest turn of more than
    /// twice that and 5°, so a control that compares sums takes the same one. The tool stays
    /// [`POLE_CONE`] away from the pole if it turns in the plane of both directions. The forward
    /// solution differs from `cl` by at most 1e-9 mm and 1e-12 rad.
    ///
    /// # Errors
    /// When there is no such position: the control's behaviour is then unknown.
    pub fn control_choice(
        &self,
        from: &AxisValues,
        cl: &ClPoint,
        tool_length: f64,
    ) -> Result<AxisValues, UnclearChoice> {
        let Solver::Closed { rotaries, .. } = &self.solver else { return Err(UnclearChoice::OtherMachine) };
        let pole = rotaries.first.direction;
        let now = self.cl_point(from, tool_length).axis;
        let angle = smallest_angle(&now, &cl.axis, &pole);
        if angle.is_nan() || angle < POLE_CONE {
            return Err(UnclearChoice::Pole { axis: self.axes[rotaries.first.axis].letter, angle });
        }
        let is_within = [rotaries.first.axis, rotaries.second.axis].iter().all(|&k| !is_beyond(&self.axes[k], from[k]));
        if is_within && now.dot(&cl.axis) > 0.0 && now.cross(&cl.axis).norm() <= STILL {
            return Ok(self.with_tip_at(from, &cl.tip, tool_length).ok_or(Unreachable::Inaccurate)?);
        }
        let mut all = self.candidates([rotaries.first.axis, rotaries.second.axis], from, cl, tool_length)?;
        all.sort_by(|a, b| a.turn.total_cmp(&b.turn));
        if let Some(beyond) = all.first().and_then(|c| c.beyond) {
            let (axis, value) = (self.axes[beyond].letter, all[0].values[beyond]);
            return Err(UnclearChoice::BeyondLimit { axis, value });
        }
        let mut within = all.iter().filter(|c| c.beyond.is_none());
        let nearest = within.next().ok_or(Unreachable::Inaccurate)?;
        match within.next() {
            Some(next) if next.turn <= BY_ANY_NORM * nearest.turn + CLEARLY => {
                Err(UnclearChoice::TwoWays { near: nearest.turn, far: next.turn })
            }
            _ => Ok(nearest.values),
        }
    }

    /// Returns all positions, each rotary axis at the full turn nearest to its present value and
    /// one to either side of it.
    fn candidates(
        &self,
        rotary: [usize; 2],
        from: &AxisValues,
        cl: &ClPoint,
        tool_length: f64,
    ) -> Result<Vec<Candidate>, Unreachable> {
        let mut all = Vec::new();
        for solution in self.unlimited(cl, tool_length, from)?.iter() {
            for n in 0..9 {
                let mut values = solution.values;
                for (k, turns) in rotary.into_iter().zip([n / 3 - 1, n % 3 - 1]) {
                    if turns != 0 {
                        values[k] += TAU * f64::from(turns);
                    }
                }
                let turn = rotary.into_iter().map(|k| (values[k] - from[k]).abs()).fold(0.0, f64::max);
                let beyond = rotary.into_iter().find(|&k| is_beyond(&self.axes[k], values[k]));
                all.push(Candidate { values, turn, beyond });
            }
        }
        Ok(all)
    }
}

fn is_beyond(axis: &Axis, value: f64) -> bool {
    !axis.endless && !(axis.min - AT_LIMIT..=axis.max + AT_LIMIT).contains(&value)
}

/// Returns the smallest angle between a line and a vector that turns evenly from `a` to `b` in
/// their plane, rad.
fn smallest_angle(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>, line: &Vector3<f64>) -> f64 {
    let angle = |v: &Vector3<f64>| line.cross(v).norm().atan2(line.dot(v).abs());
    let ends = angle(a).min(angle(b));
    let Some(normal) = Unit::try_new(a.cross(b), 0.0) else { return ends };
    // The direction in the plane nearest to the line is the line without its component along the
    // normal.
    let nearest = line - normal.into_inner() * normal.dot(line);
    let is_passed = |v: &Vector3<f64>| a.cross(v).dot(&normal) >= 0.0 && v.cross(b).dot(&normal) >= 0.0;
    if is_passed(&nearest) || is_passed(&-nearest) { FRAC_PI_2 - angle(&normal) } else { ends }
}
