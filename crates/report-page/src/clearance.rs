//! Clearances at the ends of blocks.

use facemill_cl_data::{PlacedSolid, Solid};
use facemill_interference::{Interference, MeshTree};
use facemill_inverse_kinematics::{AxisValues, Carrier, Machine};
use facemill_job::load::job::Setup;
use facemill_job::load::obstacle_meshes::{ObstacleMesh, ObstacleRole};
use facemill_tool_model::ToolAssembly;
use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::motion::Segment;

/// Distances above which none is measured, mm.
pub(crate) const FARTHEST: f64 = 100.0;

/// Motions that a thread looks at in a row.
const CHUNK: usize = 256;

/// Returns the distance of tool assembly (without cutter) and bodies of its head from part, check
/// surfaces and fixtures at the end of each motion, mm; of several heads that of the nearer one,
/// and `None` beyond [`FARTHEST`].
///
/// It is measured at these positions alone: between them bodies may be nearer, as verification
/// knows.
pub(crate) fn end_clearances(
    segments: &[Segment],
    setup: &Setup<'_>,
    heads: &[(&Machine, &ToolAssembly)],
) -> Vec<Option<f64>> {
    let counts = |o: &&ObstacleMesh| matches!(o.role, ObstacleRole::Part | ObstacleRole::Check | ObstacleRole::Fixture);
    // Trees are made here: threads that need one at once would make one each.
    let obstacles: Vec<&MeshTree> = setup.obstacles.iter().filter(counts).map(|o| o.tree()).collect();
    let work_from_table = setup.table_from_work.inverse();
    let heads: Vec<MeasuredHead<'_>> = heads
        .iter()
        .map(|(machine, tool)| MeasuredHead { machine, tool: tool.collision_bodies(), length: tool.gauge_length() })
        .collect();
    let of_chunk = |chunk: &[Segment]| {
        let mut hints = vec![None; heads.iter().map(MeasuredHead::n_bodies).sum::<usize>() * obstacles.len()];
        let of_segment = |segment: &Segment| {
            let mut nearest: Option<f64> = None;
            let mut pair = 0;
            for head in &heads {
                for (solid, work_from_solid) in head.bodies_at(&segment.to, &work_from_table) {
                    for obstacle in &obstacles {
                        let hint: &mut Option<u32> = &mut hints[pair];
                        pair += 1;
                        let at_most = nearest.unwrap_or(FARTHEST);
                        let found = obstacle.core_distance(&solid, &work_from_solid, at_most, *hint);
                        if let Some(found) = found {
                            nearest = Some(found.distance.min(at_most));
                            *hint = Some(found.triangle);
                        }
                    }
                }
            }
            nearest
        };
        chunk.iter().map(of_segment).collect::<Vec<_>>()
    };
    segments.par_chunks(CHUNK).map(of_chunk).collect::<Vec<_>>().concat()
}

/// A head with the bodies that are measured.
struct MeasuredHead<'a> {
    machine: &'a Machine,
    tool: Vec<PlacedSolid>,
    length: f64,
}

impl MeasuredHead<'_> {
    fn n_bodies(&self) -> usize {
        let on_head = self.machine.bodies().iter().filter(|b| b.carrier() == Some(Carrier::Head)).count();
        self.tool.len() + on_head
    }

    fn bodies_at(&self, q: &AxisValues, work_from_table: &Isometry3<f64>) -> Vec<(Solid, Isometry3<f64>)> {
        let work_from_tool = work_from_table * self.machine.forward(q, self.length);
        let tool = self.tool.iter().map(|body| (body.solid.clone(), work_from_tool * body.frame_from_solid));
        let on_head = self.machine.body_poses(q).filter(|at| at.body.carrier() == Some(Carrier::Head));
        let on_head = on_head.map(|at| (at.body.body.solid.clone(), work_from_table * at.table_from_solid));
        tool.chain(on_head).collect()
    }
}
