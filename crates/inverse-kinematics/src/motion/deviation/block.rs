use facemill_cl_data::ClPoint;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::{AxisValues, MAX_AXES};
use crate::machine::Machine;

/// The joints in the middle of a block, from the table to the tool.
pub(super) struct Block {
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
    /// Tool pose in the middle of the block.
    pub(super) middle: ClPoint,
}

/// Motion of a point in a block, which takes the unit of time.
pub(super) struct Derivatives {
    /// Second derivative in the middle.
    pub(super) second: Vector3<f64>,
    /// Bound for the length of the third derivative over the whole block.
    pub(super) third: f64,
}

impl Block {
    pub(super) fn new(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Self {
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
            middle: cl,
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

    /// Returns the motion of the tip.
    pub(super) fn tip(&self) -> Derivatives {
        Derivatives { second: self.second(&self.tip_velocity), third: self.third_bound(&self.reach) }
    }

    /// Returns the motion of the tool axis.
    pub(super) fn axis(&self) -> Derivatives {
        let reach = self.rotary.map(|rotary| if rotary { 1.0 } else { 0.0 });
        Derivatives { second: self.second(&self.axis_velocity), third: self.third_bound(&reach) }
    }

    /// Returns Σ over pairs of joints: a rotary joint turns the velocities of itself and of all
    /// joints behind it.
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

    /// Returns Σ over triples i ≤ j ≤ k of joints, i and j rotary, of the lengths of their travels
    /// times the reach of k, each as often as the triple can be ordered.
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
