//! Where a program's tool is near stock that a dexel map has no lines for.

use facemill_cl_data::{Aabb, Cancelled, ClPoint, Monitor, Solid};
use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolAssembly;
use facemill_z_map::{DexelGrid, DexelMap};
use rayon::prelude::*;

use crate::motion::moves::{Move, resolve};
use crate::motion::setup;
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, segments};

/// Largest way of a segment, mm: the boxes around segments are longer than the tool by as much.
const MAX_WAY: f64 = 20.0;

/// How far from its true place the tool may be on a segment, mm.
const TOLERANCE: f64 = 1.0;

/// Lines of the blocks, in program order, on which the tool may reach stock beyond the lines of a
/// map that covers a part of the stock only: there [`run_stock`](crate::stock::run::run_stock) sees
/// nothing. `extents` is a box around all the stock, workpiece frame.
///
/// No block is left out: the tool counts as the box around it, dilated by its widest body with its
/// clearance, on every part of its way, and a block that the axes cannot follow counts as reaching.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels.
pub fn blocks_beyond(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    stock: &DexelMap,
    extents: &Aabb,
    monitor: &dyn Monitor,
) -> Result<Vec<u32>, VerifyError> {
    setup::check(setup, settings)?;
    let grid = stock.grid();
    let extents = extents.transformed(&grid.work_from_map().inverse());
    if holds(grid, &extents) {
        return Ok(Vec::new());
    }
    let scene = RunScene::new(setup, settings)?;
    let reach = setup.tool.gauge_length();
    let coarse = Coarseness { tolerance: TOLERANCE, reach, max_way: MAX_WAY };
    let width = widest(setup.tool) + TOLERANCE;
    let is_beyond = |m: &Move| -> Result<bool, Cancelled> {
        monitor.checkpoint()?;
        if !m.moves_tool {
            return Ok(false);
        }
        let Some(segments) = segments(&scene, m, &coarse) else { return Ok(true) };
        Ok(segments.iter().any(|s| {
            let near = meet(&around(grid, [&s.from, &s.to], reach, width), &extents);
            !near.is_empty() && !holds(grid, &near)
        }))
    };
    let moves = resolve(program, setup, settings).moves;
    let beyond: Result<Vec<bool>, Cancelled> = moves.par_iter().map(is_beyond).collect();
    let of_moves = moves.iter().zip(beyond?).filter(|(_, is_beyond)| *is_beyond);
    let mut lines: Vec<u32> = of_moves.map(|(m, _)| program.blocks[m.block].line).collect();
    lines.dedup();
    Ok(lines)
}

/// Whether all of a box, map frame, is over or under the lines' cells.
fn holds(grid: &DexelGrid, part: &Aabb) -> bool {
    let n = grid.n_lines();
    (0..2).all(|k| {
        let [low, high] = [grid.origin()[k], grid.origin()[k] + n[k] as f64 * grid.cell()];
        low <= part.min[k] + ROUNDING && part.max[k] <= high + ROUNDING
    })
}

/// By how much less a map may cover than the box of its stock, mm: rounding of its corners.
const ROUNDING: f64 = 1e-6;

/// The box around the tool at both ends of a segment, map frame, mm.
fn around(grid: &DexelGrid, poses: [&ClPoint; 2], reach: f64, width: f64) -> Aabb {
    let map_from_work = grid.work_from_map().inverse();
    let ends = poses.map(|p| [p.tip, p.tip + p.axis.into_inner() * reach]);
    let ends: Vec<_> = ends.iter().flatten().map(|p| map_from_work * p).collect();
    Aabb::of_points(&ends).dilated(width)
}

fn meet(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb { min: a.min.sup(&b.min), max: a.max.inf(&b.max) }
}

/// Largest distance of a point of the tool from its axis between tip and gauge line, with
/// clearances, mm.
fn widest(tool: &ToolAssembly) -> f64 {
    let bodies = tool.whole().into_iter().map(|body| match body.solid {
        Solid::Frustum(f) => f.radius_low.max(f.radius_high) + f.rounding,
        _ => tool.gauge_length(),
    });
    bodies.fold(tool.cutter().radius(), f64::max)
}
