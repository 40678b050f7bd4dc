//! Whether the cutter is in the stock at a pose, or anywhere between two.

use facemill_cl_data::{ClPoint, Solid};
use facemill_interference::{MotionInterval, SweepVerdict};
use nalgebra::{Unit, Vector3};

use crate::pose::obstacle::Obstacle;
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Hints, angle_between, tool_frame};

/// Motion of the cutter, mm, below which a way that cannot be proven free counts as in the stock.
/// Larger: ways that only come near to stock count as in it; smaller: more halvings there.
const FINEST: f64 = 0.01;

impl PoseTest<'_> {
    /// Returns whether the cutter touches the stock or its support at a pose.
    pub fn cutter_in_stock(&self, cl: &ClPoint, hints: &mut Hints) -> bool {
        let work_from_tool = tool_frame(cl);
        hints.gouge.resize(self.cell.obstacles.len(), None);
        self.cell.obstacles.iter().zip(&hints.gouge).any(|(obstacle, hint)| {
            let allowance = obstacle.collision_allowance;
            !obstacle.mesh.verdict_of_all(&self.cutter, allowance, &work_from_tool, *hint).is_free()
        })
    }

    /// Returns whether the cutter is deeper in stock than the gouge tolerance at a pose. The part
    /// itself is no stock, nor is an obstacle without stock on it.
    pub fn cuts_stock(&self, cl: &ClPoint, hints: &mut Hints) -> bool {
        let work_from_tool = tool_frame(cl);
        hints.gouge.resize(self.cell.obstacles.len(), None);
        self.cell.obstacles.iter().zip(&hints.gouge).filter(|(obstacle, _)| obstacle.has_stock()).any(
            |(obstacle, hint)| {
                let stock = obstacle.collision_allowance;
                !obstacle.mesh.verdict_of_all(&self.test_bodies, stock, &work_from_tool, *hint).is_free()
            },
        )
    }

    /// Returns whether the cutter touches stock on the way between two poses: tip straight, axis
    /// turned evenly. The part itself is no stock, nor is an obstacle without stock on it.
    ///
    /// `false` is proven for all of the way; a way that comes nearer than 0.01 mm to stock may
    /// count as in it. Of a mesh that proves nothing of motions, poses between both, no farther
    /// apart than `step` (mm), are tested.
    pub fn meets_stock_between(&self, from: &ClPoint, to: &ClPoint, step: f64, hints: &mut Hints) -> bool {
        let cutter = self.cell.tool.cutter();
        let reach = cutter.flute_length().hypot(cutter.radius());
        hints.gouge.resize(self.cell.obstacles.len(), None);
        self.cell.obstacles.iter().zip(&hints.gouge).filter(|(obstacle, _)| obstacle.has_stock()).any(
            |(obstacle, hint)| {
                let bodies: Vec<Solid> = self.cutter.iter().map(|s| s.dilated(obstacle.collision_allowance)).collect();
                CutterWay { obstacle, bodies, reach, step, hint: *hint }.meets(from, to)
            },
        )
    }
}

/// Way of the cutter past one obstacle.
struct CutterWay<'w, 'a> {
    obstacle: &'w Obstacle<'a>,
    /// Cutter, dilated by the stock on the obstacle.
    bodies: Vec<Solid>,
    /// Distance from the tip within which the whole cutter is, mm.
    reach: f64,
    /// Distance of tested poses where nothing is proven of motions, mm.
    step: f64,
    hint: Option<u32>,
}

impl CutterWay<'_, '_> {
    /// Returns whether the cutter touches the obstacle between two poses.
    fn meets(&self, from: &ClPoint, to: &ClPoint) -> bool {
        let (way, angle) = (to.tip - from.tip, angle_between(&from.axis, &to.axis));
        let length = way.norm() + angle * self.reach;
        let axis = Unit::try_new(from.axis.into_inner() + to.axis.into_inner(), f64::EPSILON);
        // Poses that are no number, and opposite axes, have no middle.
        let (Some(axis), true) = (axis, length.is_finite()) else { return true };
        let middle = ClPoint { tip: nalgebra::center(&from.tip, &to.tip), axis };
        let motion = MotionInterval {
            mesh_from_solid: tool_frame(&middle),
            velocity: way,
            spin: Vector3::zeros(),
            half: 0.5,
            // No point of the cutter turns farther about the tip.
            deviation: 0.5 * angle * self.reach,
        };
        let unproven = self.bodies.iter().find_map(|body| match self.obstacle.mesh.sweep(body, &motion, self.hint) {
            SweepVerdict::Clear => None,
            SweepVerdict::Unproven(triangle) => Some(triangle),
        });
        let Some(triangle) = unproven else { return false };
        let is_free = |body: &Solid| self.obstacle.mesh.verdict(body, &motion.mesh_from_solid, triangle).is_free();
        if !self.bodies.iter().all(is_free) {
            return true;
        }
        match triangle {
            Some(_) if length <= FINEST => true,
            None if length <= self.step.max(FINEST) => false,
            _ => self.meets(from, &middle) || self.meets(&middle, to),
        }
    }
}
