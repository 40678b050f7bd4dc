//! Solids that the cutting motions of a program sweep: what the material left on a surface is
//! measured against.

use facemill_cl_data::Monitor;
use facemill_nc_program::ReadProgram;
use facemill_z_map::{CutterMotion, SweptCutter};
use rayon::prelude::*;

use crate::motion::moves::{Move, resolve};
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, segments};

/// Everything that the cutter of a head sweeps in the feed moves of a program that was read from NC
/// text; the `id` of each motion is the line of its block. Rapids cut nothing, and neither do moves
/// of the other head.
///
/// The motion is that of the machine's law for the text, as straight ways with an evenly turning
/// axis: at no time is a point of the cutter farther than `tolerance` (mm) from where it is then.
/// So a height that is measured against it ([`left_heights`](facemill_z_map::left_heights)) is off
/// by no more than that along the normal of the cutter there. A move that the axes cannot follow
/// sweeps nothing; [`verify`](crate::run::verify::verify) reports it.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels. A step of `monitor` is a
/// move.
pub fn swept_by_cuts(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<SweptCutter, VerifyError> {
    crate::motion::setup::check(setup, settings)?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(VerifyError::Setting { field: "tolerance", value: tolerance, needed: "above 0" });
    }
    let cutter = setup.tool.cutter();
    let scene = RunScene::new(setup, settings)?;
    let coarse = Coarseness { tolerance, reach: cutter.radius().hypot(cutter.flute_length()), max_way: f64::INFINITY };
    let resolved = resolve(program, setup, settings);
    let motions = |m: &Move| {
        monitor.checkpoint()?;
        monitor.advance(1);
        let id = program.blocks[m.block].line;
        let motion = |s: &crate::run::segments::Segment| CutterMotion { from: s.from, to: s.to, id };
        let cuts = m.moves_tool && !m.is_rapid;
        let segments = if cuts { segments(&scene, m, &coarse) } else { None };
        Ok(segments.unwrap_or_default().iter().map(motion).collect())
    };
    let of_moves: Vec<Vec<CutterMotion>> =
        resolved.moves.par_iter().map(motions).collect::<Result<_, VerifyError>>()?;
    Ok(SweptCutter::new(cutter, of_moves.concat()))
}
