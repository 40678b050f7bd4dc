//! Places of tool and machine at a pose, and their motion to another.

use facemill_cl_data::{ClPoint, Solid};
use facemill_inverse_kinematics::{AxisValues, Carrier, Machine};
use nalgebra::{Isometry3, Point3, UnitQuaternion};

use crate::pose::machine_obstacles::is_moved_along;
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, angle_between};

/// Places of tool and machine at one pose.
pub(crate) struct PlacedMachine<'m> {
    machine: &'m Machine,
    tool_length: f64,
    axes: AxisValues,
    cl: ClPoint,
    tool_reach: f64,
    /// Bodies of the machine that this head brings near the workpiece.
    bodies: Vec<PlacedBody>,
    /// The obstacles among the bodies of the machine.
    obstacles: Vec<PlacedBody>,
    /// Indices of the bodies of this head, and of those of the other one; empty where there is no
    /// other.
    heads: [Vec<usize>; 2],
}

/// A body seen from the tool tip.
struct PlacedBody {
    /// Rotation from the body to the workpiece.
    rotation: UnitQuaternion<f64>,
    /// The tool tip in the body's frame.
    tip: Point3<f64>,
    /// Distance from the tip to the body's farthest point, mm.
    farthest: f64,
}

impl PlacedBody {
    fn new(solid: &Solid, work_from_body: &Isometry3<f64>, tip: &Point3<f64>) -> Self {
        let tip = work_from_body.inverse_transform_point(tip);
        let bounds = solid.aabb();
        let farthest = (bounds.min - tip).abs().sup(&(bounds.max - tip).abs()).norm();
        Self { rotation: work_from_body.rotation, tip, farthest }
    }

    /// Returns the largest motion of a point of the body against one that moves with the tip.
    fn motion_to(&self, other: &Self) -> f64 {
        self.rotation.angle_to(&other.rotation) * self.farthest.max(other.farthest) + (other.tip - self.tip).norm()
    }
}

impl<'m> PlacedMachine<'m> {
    /// Places tool and machine in a configuration.
    pub(crate) fn new(test: &PoseTest<'m>, configuration: &Configuration) -> Self {
        let machine = test.cell.machine;
        let axes = &configuration.axes;
        let work_from_table = test.work_from_table();
        let cl = machine.cl_point(axes, test.cell.tool.gauge_length()).transformed(work_from_table);
        let poses: Vec<_> = machine.body_poses(axes).collect();
        let placed = |k: usize| {
            PlacedBody::new(&poses[k].body.body.solid, &(work_from_table * poses[k].table_from_solid), &cl.tip)
        };
        let moving = (0..poses.len()).filter(|&k| is_moved_along(poses[k].body));
        let of_bed = test.machine_obstacles.iter().filter(|o| !o.is_other_head);
        let of_other: Vec<usize> = test.machine_obstacles.iter().filter(|o| o.is_other_head).map(|o| o.body).collect();
        let of_own =
            (0..poses.len()).filter(|&k| poses[k].body.carrier() == Some(Carrier::Head) && !of_other.is_empty());
        Self {
            machine,
            tool_length: test.cell.tool.gauge_length(),
            axes: *axes,
            bodies: moving.map(placed).collect(),
            obstacles: of_bed.map(|o| placed(o.body)).collect(),
            heads: [of_own.collect(), of_other],
            tool_reach: test.reach(),
            cl,
        }
    }

    /// Returns the largest distance by which any point of tool and machine can come nearer to any
    /// point of workpiece and machine on the way to another configuration, mm, as long as every
    /// body turns one way and the tip moves straight.
    ///
    /// A point moves with the tip, turns about it with its body, and moves as the body does against
    /// the tip (a ram that does not tilt with the tool). The tool is round, so turning about its
    /// own axis moves nothing. Motion on the other side (a column, seen from the workpiece) adds to
    /// it. Against the other head, which moves independently, the motion of either on the bed
    /// counts, by all its axes.
    pub(crate) fn motion_to(&self, other: &Self) -> f64 {
        let largest = |a: &[PlacedBody], b: &[PlacedBody], least: f64| {
            a.iter().zip(b).map(|(a, b)| a.motion_to(b)).fold(least, f64::max)
        };
        let tip = (other.cl.tip - self.cl.tip).norm();
        let of_tool = angle_between(&self.cl.axis, &other.cl.axis) * self.tool_reach;
        let own = tip + largest(&self.bodies, &other.bodies, of_tool);
        let against_bed =
            if self.obstacles.is_empty() { own } else { own + tip + largest(&self.obstacles, &other.obstacles, 0.0) };
        against_bed.max(self.of_both_heads_to(other))
    }

    /// Returns the same for tool and bodies of this head against the bodies of the other head; 0
    /// without one.
    fn of_both_heads_to(&self, other: &Self) -> f64 {
        let [own, others] = &self.heads;
        if others.is_empty() {
            return 0.0;
        }
        let way = |bodies: &[usize]| {
            let ways = bodies.iter().map(|&k| self.machine.body_way_on_bed(k, &self.axes, &other.axes));
            ways.fold(0.0, f64::max)
        };
        let of_tool = self.machine.tool_way_on_bed(&self.axes, &other.axes, self.tool_length, self.tool_reach);
        of_tool.max(way(own)) + way(others)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/pose/placed_machine.rs"]
mod tests;
