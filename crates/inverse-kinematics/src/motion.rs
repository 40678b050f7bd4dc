//! Motion of a control between two positions, and its deviation from the planned one.

pub(crate) mod deviation;
pub(crate) mod linearise;

pub use crate::motion::deviation::{Deviation, deviation_bound};
pub use crate::motion::linearise::{
    Linearisation, LineariseError, Linearised, MotionTolerance, PoseFraction, linearise,
};

use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use nalgebra::{Unit, Vector3};

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::solver::inverse_solution::Unreachable;

/// Motion of the control in one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockLaw {
    /// A cutting move.
    Cutting(CuttingLaw),
    /// A rapid.
    Rapid(RapidLaw),
}

impl From<CuttingLaw> for BlockLaw {
    fn from(law: CuttingLaw) -> Self {
        Self::Cutting(law)
    }
}

impl From<RapidLaw> for BlockLaw {
    fn from(law: RapidLaw) -> Self {
        Self::Rapid(law)
    }
}

/// Motion of the control from one programmed position to the next.
///
/// [`Motion::at`] returns the axis values at the fraction t of the block's time, 0 ≤ t ≤ 1; both
/// ends are met exactly. Limits are not checked: a control that is commanded beyond them runs into
/// its stop, and a replay has to show that.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    machine: &'a Machine,
    law: BlockLaw,
    start: AxisValues,
    end: AxisValues,
    start_cl: ClPoint,
    end_cl: ClPoint,
    tool_length: f64,
}

/// Reason why a block has no motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// An axis value or the tool length is NaN or infinite, or there are not as many values as
    /// axes.
    #[error("the block's positions are not {n_axes} finite axis values each")]
    BadValues {
        /// Number of axes of the machine.
        n_axes: usize,
    },
    /// The tool vector would have to turn in the plane of its two ends, and they are opposite.
    #[error("the tool axis reverses within the block, which leaves the plane of its turn open")]
    OppositeAxes,
}

/// Cosine below which two tool axes count as opposite: 1e-7 rad from it the plane of the turn is
/// known only to 1e-9.
pub(crate) const OPPOSITE_COSINE: f64 = -1.0 + 5e-15;

impl<'a> Motion<'a> {
    /// Creates the motion of `machine` between two positions under `law`, with this tool length.
    ///
    /// # Errors
    /// When a value is not finite, or the tool axis reverses under
    /// [`CuttingLaw::TipLinearVectorTurned`].
    pub fn new(
        machine: &'a Machine,
        law: BlockLaw,
        start: &AxisValues,
        end: &AxisValues,
        tool_length: f64,
    ) -> Result<Self, MotionError> {
        let n_axes = machine.axes().len();
        let sound = |q: &AxisValues| q.len() == n_axes && q.is_finite();
        if !(sound(start) && sound(end) && tool_length.is_finite()) {
            return Err(MotionError::BadValues { n_axes });
        }
        let start_cl = machine.cl_point(start, tool_length);
        let end_cl = machine.cl_point(end, tool_length);
        let turned = law == BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
        if turned && start_cl.axis.dot(&end_cl.axis) < OPPOSITE_COSINE {
            return Err(MotionError::OppositeAxes);
        }
        Ok(Self { machine, law, start: *start, end: *end, start_cl, end_cl, tool_length })
    }

    /// Returns axis values at the fraction `t` of the block's time; `t` outside 0..1 counts as the
    /// nearer end, NaN as the start.
    ///
    /// Under [`CuttingLaw::TipLinearVectorTurned`] the branch is the one nearer to the straight
    /// line between the ends, which is the continuous one when both ends are on the same branch.
    ///
    /// # Errors
    /// Only under the RTCP laws: [`Unreachable::Singular`] or [`Unreachable::Tip`] where the linear
    /// axes cannot follow the tip, [`Unreachable::Direction`] where the turning tool vector leaves
    /// the reach of the rotary axes.
    pub fn at(&self, t: f64) -> Result<AxisValues, Unreachable> {
        if t <= 0.0 || t.is_nan() {
            return Ok(self.start);
        }
        if t >= 1.0 {
            return Ok(self.end);
        }
        let straight = self.start.lerp(&self.end, t);
        match self.law {
            BlockLaw::Cutting(CuttingLaw::AxesLinear) | BlockLaw::Rapid(RapidLaw::Linear) => Ok(straight),
            BlockLaw::Rapid(RapidLaw::PerAxis) => Ok(per_axis(self.machine, &self.start, &self.end, t)),
            BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) => {
                let tip = self.ideal(t).tip;
                self.machine.with_linears(&straight, &tip, self.tool_length)
            }
            BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) => self.turned(t, &straight),
        }
    }

    /// Returns tip and tool axis at the fraction `t` of the block's time, table frame.
    ///
    /// # Errors
    /// As [`Motion::at`].
    pub fn cl_at(&self, t: f64) -> Result<ClPoint, Unreachable> {
        Ok(self.machine.cl_point(&self.at(t)?, self.tool_length))
    }

    /// Returns the motion that a planner intends between two poses: the tip on a straight line, the
    /// tool axis turning uniformly in the plane of its ends. Opposite axes are connected through an
    /// arbitrary plane that contains both.
    pub fn ideal(&self, t: f64) -> ClPoint {
        let tip = self.start_cl.tip + (self.end_cl.tip - self.start_cl.tip) * t;
        ClPoint { tip, axis: turned_axis(&self.start_cl.axis, &self.end_cl.axis, t) }
    }

    fn turned(&self, t: f64, straight: &AxisValues) -> Result<AxisValues, Unreachable> {
        let all = self.machine.unlimited(&self.ideal(t), self.tool_length, straight)?;
        let turn = |q: &AxisValues| -> f64 {
            (0..q.len()).filter(|&k| self.machine.is_rotary(k)).map(|k| (q[k] - straight[k]).abs()).sum()
        };
        let nearer = |a: AxisValues, b: AxisValues| if turn(&b) < turn(&a) { b } else { a };
        all.iter().map(|s| s.values).reduce(nearer).ok_or(Unreachable::Singular)
    }
}

/// Returns a position in which every axis runs at its own largest speed until it arrives; the
/// slowest one takes the whole time.
pub(crate) fn per_axis(machine: &Machine, start: &AxisValues, end: &AxisValues, t: f64) -> AxisValues {
    let elapsed = t * machine.travel_time(start, end);
    AxisValues::from_fn(start.len(), |k| {
        let way = end.get_or_zero(k) - start[k];
        let done = machine.axes()[k].max_velocity * elapsed;
        if done >= way.abs() { end.get_or_zero(k) } else { start[k] + done.copysign(way) }
    })
}

/// Returns the unit vector at the fraction `t` of the turn from `a` to `b` in their plane.
pub(crate) fn turned_axis(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>, t: f64) -> Unit<Vector3<f64>> {
    Turn::new(a, b).at(t)
}

/// An even turn of a unit vector in the plane of its ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    start: Vector3<f64>,
    /// Direction of the turn, at right angles to the start.
    across: Vector3<f64>,
    /// The whole turn, rad, 0 to π.
    pub(crate) angle: f64,
}

impl Turn {
    pub(crate) fn new(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> Self {
        let normal = a.cross(b);
        let sine = normal.norm();
        let across = Unit::try_new(normal, 1e-300).map_or_else(|| any_normal(a), |n| n.cross(a));
        Self { start: a.into_inner(), across, angle: sine.atan2(a.dot(b)) }
    }

    /// Returns the vector at the fraction `t` of the turn.
    pub(crate) fn at(&self, t: f64) -> Unit<Vector3<f64>> {
        let (sin, cos) = (self.angle * t).sin_cos();
        Unit::new_normalize(self.start * cos + self.across * sin)
    }

    /// Returns the fraction of the turn at which the vector is nearest to `axis`; below 0 or above
    /// 1 outside the turn.
    pub(crate) fn fraction_of(&self, axis: &Vector3<f64>) -> f64 {
        axis.dot(&self.across).atan2(axis.dot(&self.start)) / self.angle
    }
}

fn any_normal(a: &Unit<Vector3<f64>>) -> Vector3<f64> {
    a.cross(&Vector3::ith(a.iamin(), 1.0)).normalize()
}
