use facemill_cl_data::CuttingLaw;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::{AxisKind, AxisValues, MAX_AXES, Machine, motion::turned_axis};

/// How far the control's motion in a block is from what was meant: the tip on a straight line, the tool axis turning
/// uniformly in the plane of its ends, both in the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Of the tip, mm.
    pub tip: f64,
    /// Of the tool axis, rad.
    pub axis: f64,
}

impl Deviation {
    /// Deviation of any point of the cutter's rim and bottom, mm: tip + R·δ.
    pub fn rim(&self, radius: f64) -> f64 {
        self.tip + radius * self.axis
    }
}

/// Upper bound for the deviation of a cutting move from the straight motion between its ends.
///
/// A guarantee up to rounding (1e-15 of the travels), not an estimate. A curve with the ends of its chord and |p″| ≤ M
/// over unit time stays within M/8 of it; p″ of the chain is known exactly in the middle of the block, and how much it
/// changes toward the ends is bounded by the third derivative. The true deviation is of second order in the block's length,
/// the excess of the bound of third order: of the deviation typically a hundredth where the rotaries turn by 0.2°, a tenth
/// at 2°, several times it at 20°. Zero where no rotary axis moves.
///
/// Values that are missing count as 0; with values that are not finite the bound is not either.
pub fn deviation_bound(
    machine: &Machine,
    law: CuttingLaw,
    start: &AxisValues,
    end: &AxisValues,
    tool_length: f64,
) -> Deviation {
    match law {
        CuttingLaw::TipLinearVectorTurned => Deviation::default(),
        CuttingLaw::TipAndRotariesLinear => Deviation { tip: 0.0, ..axes_linear(machine, start, end, tool_length) },
        CuttingLaw::AxesLinear => axes_linear(machine, start, end, tool_length),
    }
}

fn axes_linear(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Deviation {
    let block = Block::new(machine, start, end, tool_length);
    let (tip_second, tip_change) = block.tip_derivatives();
    let (axis_second, axis_change) = block.axis_derivatives();
    let [a, b] = [start, end].map(|q| machine.cl_point(q, tool_length).axis);
    let turn = a.cross(&b).norm().atan2(a.dot(&b));
    // The axis that is meant has the second derivative −turn²·axis, and a third one of length turn³.
    let meant = turned_axis(&a, &b, 0.5).into_inner() * (turn * turn);
    let chord = ((axis_second + meant).norm() + 0.5 * (axis_change + turn.powi(3))) / 8.0;
    Deviation { tip: (tip_second.norm() + 0.5 * tip_change) / 8.0, axis: 2.0 * (0.5 * chord).min(1.0).asin() }
}

/// The joints in the middle of a block, from the table to the tool.
struct Block {
    n: usize,
    rotary: [bool; MAX_AXES],
    /// Travel of every joint.
    travel: [f64; MAX_AXES],
    direction: [Vector3<f64>; MAX_AXES],
    /// Velocity of the tip and of the tool axis per unit of the joint.
    tip_velocity: [Vector3<f64>; MAX_AXES],
    axis_velocity: [Vector3<f64>; MAX_AXES],
    /// Bound for the length of `tip_velocity` over the whole block.
    reach: [f64; MAX_AXES],
}

impl Block {
    fn new(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Self {
        let screws = &machine.chain.screws;
        let middle = start.lerp(end, 0.5);
        let cl = machine.cl_point(&middle, tool_length);
        let zeros = [Vector3::zeros(); MAX_AXES];
        let mut block = Self {
            n: screws.len(),
            rotary: [false; MAX_AXES],
            travel: [0.0; MAX_AXES],
            direction: zeros,
            tip_velocity: zeros,
            axis_velocity: zeros,
            reach: [0.0; MAX_AXES],
        };
        let mut motion = Isometry3::identity();
        for (k, screw) in screws.iter().enumerate() {
            block.rotary[k] = screw.kind == AxisKind::Rotary;
            block.travel[k] = end.get_or_zero(screw.axis) - start.get_or_zero(screw.axis);
            let direction = motion.rotation * screw.direction.into_inner();
            block.direction[k] = direction;
            if block.rotary[k] {
                block.tip_velocity[k] = direction.cross(&(cl.tip - motion * Point3::from(screw.point)));
                block.axis_velocity[k] = direction.cross(&cl.axis);
            } else {
                block.tip_velocity[k] = direction;
            }
            motion *= screw.motion(middle.get_or_zero(screw.axis));
        }
        // The distance of the tip from a rotary axis changes only with the joints behind it.
        let mut change = 0.0;
        for k in (0..block.n).rev() {
            block.reach[k] = if block.rotary[k] { block.tip_velocity[k].norm() + 0.5 * change } else { 1.0 };
            change += block.travel[k].abs() * block.reach[k];
        }
        block
    }

    /// Second derivative of the tip in the middle of the block and a bound for the third one all along it.
    fn tip_derivatives(&self) -> (Vector3<f64>, f64) {
        (self.second(&self.tip_velocity), self.third_bound(&self.reach))
    }

    /// The same for the tool axis.
    fn axis_derivatives(&self) -> (Vector3<f64>, f64) {
        let reach = self.rotary.map(|rotary| if rotary { 1.0 } else { 0.0 });
        (self.second(&self.axis_velocity), self.third_bound(&reach))
    }

    /// Σ over pairs of joints: a rotary joint turns the velocities of itself and of all joints behind it.
    fn second(&self, velocity: &[Vector3<f64>; MAX_AXES]) -> Vector3<f64> {
        let mut behind = Vector3::zeros();
        let mut sum = Vector3::zeros();
        for k in (0..self.n).rev() {
            let own = velocity[k] * self.travel[k];
            if self.rotary[k] {
                sum += self.direction[k].cross(&(own + behind * 2.0)) * self.travel[k];
            }
            behind += own;
        }
        sum
    }

    /// Σ over triples i ≤ j ≤ k of joints, i and j rotary, of the lengths of their travels times the reach of k, each as
    /// often as the triple can be ordered.
    fn third_bound(&self, reach: &[f64; MAX_AXES]) -> f64 {
        let mut sum = 0.0;
        for i in (0..self.n).filter(|&i| self.rotary[i]) {
            for j in (i..self.n).filter(|&j| self.rotary[j]) {
                for (k, reach) in reach.iter().enumerate().take(self.n).skip(j) {
                    let orders = match (i == j, j == k) {
                        (true, true) => 1.0,
                        (false, false) => 6.0,
                        _ => 3.0,
                    };
                    sum += orders * (self.travel[i] * self.travel[j] * self.travel[k]).abs() * reach;
                }
            }
        }
        sum
    }
}
