//! Bodies that turn with the tool.

use facemill_cl_data::{PlacedSolid, Solid};
use nalgebra::{Isometry3, Vector3};

use crate::pose::machine_obstacles::is_moved_along;
use crate::pose::workcell::{Body, Workcell};

/// A body of revolution about the tool's axis that is fixed to the tool: its place depends on the
/// tool pose alone.
pub(crate) struct SpunBody {
    /// Its place among the bodies that are tested for collision.
    pub(crate) slot: usize,
    pub(crate) body: Body,
    pub(crate) solid: Solid,
    pub(crate) tool_from_solid: Isometry3<f64>,
}

/// Returns the bodies of tool and machine that are fixed to the tool and are bodies of revolution
/// about its axis.
pub(crate) fn spun_bodies(cell: &Workcell<'_>, tool_bodies: &[PlacedSolid]) -> Vec<SpunBody> {
    let machine = cell.machine;
    let home = machine.home();
    let tool_from_table = machine.forward(&home, cell.tool.gauge_length()).inverse();
    let of_tool =
        tool_bodies.iter().enumerate().map(|(k, b)| (Body::Tool(k), b.solid.clone(), b.frame_from_solid, true));
    let moving = machine.body_poses(&home).enumerate().filter(|(_, p)| is_moved_along(p.body));
    let of_machine = moving.map(|(k, p)| {
        let fixed = machine.joints_to_tool(k) == 0;
        (Body::Machine(k), p.body.body.solid.clone(), tool_from_table * p.table_from_solid, fixed)
    });
    of_tool
        .chain(of_machine)
        .enumerate()
        .filter(|(_, (_, solid, pose, fixed))| *fixed && matches!(solid, Solid::Frustum(_)) && is_on_z(pose))
        .map(|(slot, (body, solid, tool_from_solid, _))| SpunBody { slot, body, solid, tool_from_solid })
        .collect()
}

/// Returns whether a frame has its z axis on that of the other, up to rounding: a body of
/// revolution there moves by less than 1e-8 mm when it is turned about that axis.
fn is_on_z(pose: &Isometry3<f64>) -> bool {
    (pose * Vector3::z()).xy().norm() < 1e-12 && pose.translation.vector.xy().norm() < 1e-9
}
