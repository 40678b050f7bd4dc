use nalgebra::Point3;

use crate::axes::axis::{AxisKind, Carrier};
use crate::axes::axis_values::AxisValues;
use crate::inverse::axis_ranges::{JointAxisLine, distance, lines_of};
use crate::machine::Machine;
use crate::solver::screw_chain::Screw;

impl Machine {
    /// Returns an upper bound, mm, for the distance of any point of a body from its place on the
    /// bed, at any time while every axis moves one way from one position to another. The body is
    /// given by its index in [`Machine::bodies`].
    ///
    /// Only the axes between body and bed count. A body of one head and one of the other, which may
    /// both move, come nearer to each other by no more than the sum of their ways.
    pub fn body_way_on_bed(&self, body: usize, from: &AxisValues, to: &AxisValues) -> f64 {
        let body = &self.bodies[body];
        let chain = self.chain_to(body);
        let bounds = body.body.solid.aabb();
        let pose = chain.motion_behind(body.n_joints, from) * body.table_from_solid_at_zero;
        let center = pose * nalgebra::center(&bounds.min, &bounds.max);
        let reach = 0.5 * (bounds.max - bounds.min).norm();
        let lines = lines_of(&chain.screws, from);
        let joints = || chain.screws.iter().zip(&lines);
        let n_table = self.n_table();
        if body.n_joints < n_table {
            // From the body inward: the table's joints run from the table to the bed.
            return way(&mut joints().take(n_table).skip(body.n_joints), &center, reach, from, to);
        }
        way(&mut joints().take(body.n_joints).skip(n_table).rev(), &center, reach, from, to)
    }

    /// Returns the same for the tool: all points that are at most `reach` from the tip.
    pub fn tool_way_on_bed(&self, from: &AxisValues, to: &AxisValues, tool_length: f64, reach: f64) -> f64 {
        let lines = lines_of(&self.chain.screws, from);
        let tip = self.cl_point(from, tool_length).tip;
        let joints = self.chain.screws.iter().zip(&lines);
        way(&mut joints.skip(self.n_table()).rev(), &tip, reach, from, to)
    }

    /// Returns the number of joints between table and bed.
    fn n_table(&self) -> usize {
        self.chain.screws.iter().filter(|s| self.axes[s.axis].carried_by == Carrier::Table).count()
    }
}

/// Bounds the way of the points that are at most `reach` from `center`, the joints listed from them
/// inward.
///
/// The motion from the one position to any on the way is the product of the joints' motions about
/// their lines at the first one, the outermost applied first. Each moves a point by its own way
/// times the point's distance from its line, which the joints before have changed by no more than
/// the way so far.
fn way(
    joints: &mut dyn Iterator<Item = (&Screw, &JointAxisLine)>,
    center: &Point3<f64>,
    reach: f64,
    from: &AxisValues,
    to: &AxisValues,
) -> f64 {
    joints.fold(0.0, |way, (screw, line)| {
        let rate = match screw.kind {
            AxisKind::Linear => 1.0,
            AxisKind::Rotary => distance(line, center) + reach + way,
        };
        way + (to.get_or_zero(screw.axis) - from.get_or_zero(screw.axis)).abs() * rate
    })
}
