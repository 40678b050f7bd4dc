//! Bodies of the machine that tool and head may meet.

use facemill_interference::{MeshTree, solid_mesh};
use facemill_inverse_kinematics::{Carrier, Machine};
use facemill_surface_model::TriMesh;

use crate::Workcell;

/// A body of the machine's bed or table that moves against the workpiece, such as a column or the cradle of a trunnion.
pub(crate) struct MachineObstacle {
    /// Index among the machine's bodies.
    pub(crate) body: usize,
    /// Its core, in its own frame.
    pub(crate) mesh: MeshTree,
    /// Distance that it keeps from others, mm.
    pub(crate) clearance: f64,
}

impl MachineObstacle {
    /// All of a machine.
    pub(crate) fn all(machine: &Machine) -> Vec<Self> {
        let moving = |(_, b): &(usize, &facemill_inverse_kinematics::MachineBody)| {
            b.carrier() != Some(Carrier::Head) && b.joints_from_table() > 0
        };
        let of_body = |(body, b): (usize, &facemill_inverse_kinematics::MachineBody)| {
            let mesh = solid_mesh(&b.body.solid).unwrap_or_else(|_| TriMesh::default());
            Self { body, mesh: MeshTree::new(&mesh), clearance: b.clearance }
        };
        machine.bodies().iter().enumerate().filter(moving).map(of_body).collect()
    }
}

/// Which bodies are tested against which obstacles: those of the workcell, then those of the machine.
///
/// Two bodies of the machine that one joint joins lie within each other by construction (a ram in its guide), and those
/// without a joint between them never move against each other: both are left out. Bodies of bed and table are held against
/// the workpiece, but not against each other: that is a matter of the axes' limits.
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
        let n_axes = cell.machine.axes().len();
        let tool: Vec<bool> = obstacles.iter().map(|o| o.is_none_or(|k| all[k].joints_from_table() < n_axes)).collect();
        let of_body = |i: usize| -> Vec<bool> {
            let meets = |k: usize| {
                let joints = all[i].joints_from_table().abs_diff(all[k].joints_from_table());
                all[i].carrier() == Some(Carrier::Head) && joints > 1
            };
            obstacles.iter().map(|o| o.is_none_or(meets)).collect()
        };
        let moving = (0..all.len()).filter(|&i| all[i].joints_from_table() > 0);
        let n_tool_bodies = cell.tool.collision_bodies().len();
        let bodies = std::iter::repeat_n(tool.clone(), n_tool_bodies).chain(moving.map(of_body)).collect();
        Self { cutter: tool, bodies }
    }
}
