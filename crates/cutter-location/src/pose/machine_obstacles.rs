//! Bodies of the machine that tool and head may meet.

use facemill_cl_data::{Aabb, Solid};
use facemill_interference::{MeshTree, solid_mesh};
use facemill_inverse_kinematics::{Carrier, Machine, MachineBody};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};

use crate::pose::workcell::Workcell;

/// Returns whether this head brings a body of the machine near the workpiece. Bodies of another
/// head are tested against the workpiece in that head's own view.
pub(crate) fn is_moved_along(body: &MachineBody) -> bool {
    body.joints_from_table() > 0 && body.carrier() != Some(Carrier::OtherHead)
}

/// A ball around a body, in the body's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    center: Point3<f64>,
    radius: f64,
}

impl Ball {
    /// Encloses a solid as it is dilated.
    pub(crate) fn around(solid: &Solid) -> Self {
        Self::around_box(&solid.aabb())
    }

    /// Encloses several solids in one frame.
    pub(crate) fn around_all(solids: &[Solid]) -> Self {
        let all = solids.iter().map(Solid::aabb).reduce(|a, b| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) });
        all.map_or(Self { center: Point3::origin(), radius: 0.0 }, |bounds| Self::around_box(&bounds))
    }

    fn around_box(bounds: &Aabb) -> Self {
        let center = nalgebra::center(&bounds.min, &bounds.max);
        Self { center, radius: 0.5 * (bounds.max - bounds.min).norm() }
    }

    /// Returns whether the two balls, and so their contents, are farther apart than `gap`, mm.
    pub(crate) fn is_beyond(&self, other: &Self, other_from_self: &Isometry3<f64>, gap: f64) -> bool {
        let reach = self.radius + other.radius + gap + ROUNDING;
        (other_from_self * self.center - other.center).norm_squared() > reach * reach
    }
}

/// Largest rounding error of the places of two bodies, mm: far more than of metres to 1e-12.
const ROUNDING: f64 = 1e-6;

/// A body of the machine's bed or table that moves against the workpiece, such as a column or the
/// cradle of a trunnion; or one of the other head.
pub(crate) struct MachineObstacle {
    /// Index among the machine's bodies.
    pub(crate) body: usize,
    /// Its core, in its own frame.
    pub(crate) mesh: MeshTree,
    /// Distance that it keeps from others, mm.
    pub(crate) clearance: f64,
    /// Ball around it, clearance included.
    pub(crate) ball: Ball,
    /// Whether it is one of the other head.
    pub(crate) is_other_head: bool,
}

impl MachineObstacle {
    /// Returns all of a machine.
    pub(crate) fn all(machine: &Machine) -> Vec<Self> {
        let moving = |(_, b): &(usize, &MachineBody)| b.carrier() != Some(Carrier::Head) && b.joints_from_table() > 0;
        let of_body = |(body, b): (usize, &MachineBody)| {
            let mesh = solid_mesh(&b.body.solid).unwrap_or_else(|_| TriMesh::default());
            let is_other_head = b.carrier() == Some(Carrier::OtherHead);
            let ball = Ball::around(&b.body.solid);
            Self { body, mesh: MeshTree::new(&mesh), clearance: b.clearance, ball, is_other_head }
        };
        machine.bodies().iter().enumerate().filter(moving).map(of_body).collect()
    }
}

/// Pairs of bodies and obstacles to test: obstacles of the workcell, then those of the machine.
///
/// Two pairs of machine bodies are left out: bodies connected by one joint lie within each other by
/// construction (a ram in its guide), and bodies without a joint between them never move against
/// each other. Bodies of bed and table are tested against the workpiece, but not against each
/// other: the axes' limits cover that. Bodies of the other head are tested against tool, cutter and
/// the bodies of this head; the other head's own test checks them against workpiece, table and bed.
pub(crate) struct Meetings {
    /// Of the cutter.
    pub(crate) cutter: Vec<bool>,
    /// Of the tool's other bodies, then of the machine's that move against the workpiece.
    pub(crate) bodies: Vec<Vec<bool>>,
}

impl Meetings {
    pub(crate) fn new(cell: &Workcell<'_>, machine_obstacles: &[MachineObstacle]) -> Self {
        let all = cell.machine.bodies();
        let of_cell = cell.obstacles.iter().map(|o| o.machine_body);
        let obstacles: Vec<Option<usize>> = of_cell.chain(machine_obstacles.iter().map(|o| Some(o.body))).collect();
        let tool: Vec<bool> = obstacles.iter().map(|o| o.is_none_or(|k| cell.machine.joints_to_tool(k) > 0)).collect();
        let of_body = |i: usize| -> Vec<bool> {
            let meets = |k: usize| all[i].carrier() == Some(Carrier::Head) && cell.machine.joints_between(i, k) > 1;
            obstacles.iter().map(|o| o.is_none_or(meets)).collect()
        };
        let moving = (0..all.len()).filter(|&i| is_moved_along(&all[i]));
        let n_tool_bodies = cell.tool.collision_bodies().len();
        let bodies = std::iter::repeat_n(tool.clone(), n_tool_bodies).chain(moving.map(of_body)).collect();
        Self { cutter: tool, bodies }
    }
}
