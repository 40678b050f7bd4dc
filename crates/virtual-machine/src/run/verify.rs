use facemill_cl_data::{Cancelled, Monitor};
use facemill_nc_program::ReadProgram;
use rayon::prelude::*;

use crate::finding::{Finding, Verification};
use crate::motion::moves::{Move, resolve};
use crate::motion::setup;
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::run::between::BodyFollower;
use crate::run::chunk_result::{ChunkResult, Clearance, nearest};
use crate::run::dead_core::DeadCore;
use crate::run::edges::RunQueries;
use crate::run::report::Report;
use crate::run::rotaries;
use crate::run::scene::RunScene;
use crate::run::surface_normals::SurfaceNormals;
use crate::run::walker::Walker;

/// Moves that one thread runs in one go. What is known from position to position is lost between
/// chunks, so small ones cost queries; the result of large ones comes in few portions. It does not
/// depend on the number of threads.
const MOVES_PER_CHUNK: usize = 128;

/// Of so many moves the clearance is looked at beforehand. More looks cost more than a smaller
/// first guess saves.
const MOVES_PER_SAMPLE: usize = 16;

/// Runs a program that was read from NC text and reports what it would do (VMT, first form).
///
/// Every axis starts at home. Each block's motion is followed by forward kinematics under the
/// machine's motion law, at positions at most [`VerifySettings::max_step`] and
/// [`VerifySettings::max_turn`] apart (proven for the tip, the rim and the tool axis relative to
/// the workpiece; bodies farther from the tip move more). At every position
/// - the depth of the cutter in each obstacle is measured from the distance between the cutter's
///   core and the mesh: below the allowance in cutting moves, in the stock in rapids; the limit is
///   that of the line's section;
/// - the distance of each non-cutting body of tool and machine from each obstacle is compared with
///   the clearances, and so is that of the tool with its cutter and of the head's bodies from each
///   body of the machine's bed and table;
/// - in cutting moves, at positions a twentieth of its radius apart, the core of the cutter's
///   bottom that does not cut is tested against the stock that the rest of the cutter has not
///   removed before in the program;
/// - at the end of a cutting move that names the surface's normal (LN of Heidenhain) that is
///   compared with the part's where the cutter is near it;
/// - axis limits are checked; over every block the speed of each axis and the turn of rotary ones,
///   over every step in stock the ramp angle.
///
/// Of two bodies of the machine those that never move against each other are left out, and those
/// that one joint joins directly: a ram in its guide, a table in its cradle lie within each other
/// by construction.
///
/// Of two heads it is the run of one: the other one's axes are checked too, and its bodies are
/// obstacles that move by them. Of its cutter only what the view has as a body is known.
///
/// Between the positions nothing is worse than at them by more than [`VerifySettings::between`], on
/// the programmed motion ([`BetweenPositions`](crate::finding::BetweenPositions)): positions of the
/// cutter lie near enough to each other for that, and bodies are followed from one to the next
/// until it is known. Ramps, the dead core and the stock on meshes are those of positions. Stock is
/// only known as a thickness on a mesh, or as it was before cutting; obstacles that
/// [`VerifySettings::as_cut`] leaves to the runs that cut are not tested as stock here, and keep
/// their allowance on part and check surfaces. Control tolerance is not added: it is part of the
/// error budget. A ramp is steep when all of the bottom goes down more steeply than the tool may
/// while the cutter is in stock.
///
/// With [`VerifySettings::estimate`] the positions are few and only the edges of bodies are tested:
/// every finding is real, but the absence of findings says nothing of the motion between the
/// positions or of the surfaces between the edges.
///
/// `monitor` advances once by every block of the program. The result does not depend on the number
/// of threads.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels.
pub fn verify(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    monitor: &dyn Monitor,
) -> Result<Verification, VerifyError> {
    setup::check(setup, settings)?;
    let resolved = resolve(program, setup, settings);
    let scene = RunScene::new(setup, settings)?;
    let core = DeadCore::new(&scene, &resolved.moves, monitor)?;
    let normals = SurfaceNormals { scene: &scene, program };
    let queries = RunQueries::new(&scene);
    let chunks: Vec<(usize, &[Move])> = resolved.moves.chunks(MOVES_PER_CHUNK).enumerate().collect();
    let sampled: Result<Vec<ChunkResult>, Cancelled> = chunks
        .par_iter()
        .map(|(k, moves)| {
            monitor.checkpoint()?;
            Ok(sample_clearance(&scene, &queries, k * MOVES_PER_CHUNK, moves))
        })
        .collect();
    let nearest = nearest(sampled?.iter().map(|r| r.clearance));
    let results: Result<Vec<ChunkResult>, Cancelled> = chunks
        .par_iter()
        .with_max_len(1)
        .map(|(k, moves)| run_chunk(&normals, (&queries, core.as_ref()), k * MOVES_PER_CHUNK, moves, nearest, monitor))
        .collect();
    let mut results = results?;
    results.push(rotaries::turns(&scene, &resolved.moves));
    let n_with_moves = resolved.moves.chunk_by(|a, b| a.block == b.block).count();
    monitor.advance(program.blocks.len().saturating_sub(n_with_moves));
    Ok(Report::new(program, &scene, &resolved).assemble(results))
}

/// Adds to findings without a pose, made from the text elsewhere, the position of the machine
/// before the block of their worst line, and the time. Leaves out lines that are no blocks, and
/// blocks at which the place of an axis is not known.
///
/// # Errors
/// When the setup or a setting makes no sense.
pub fn place_findings(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    findings: &mut [Finding],
) -> Result<(), VerifyError> {
    setup::check(setup, settings)?;
    let resolved = resolve(program, setup, settings);
    let scene = RunScene::new(setup, settings)?;
    Report::new(program, &scene, &resolved).place(findings);
    Ok(())
}

fn run_chunk(
    normals: &SurfaceNormals<'_>,
    (queries, core): (&RunQueries, Option<&DeadCore>),
    first: usize,
    moves: &[Move],
    nearest: Option<Clearance>,
    monitor: &dyn Monitor,
) -> Result<ChunkResult, Cancelled> {
    let mut walker = Walker::new(normals.scene, queries, core, nearest);
    let mut follower = normals.scene.settings.estimate.is_none().then(|| BodyFollower::new(normals.scene));
    for (k, m) in moves.iter().enumerate() {
        monitor.checkpoint()?;
        walker.run(first + k, m, monitor)?;
        normals.test(first + k, m, &mut walker.result.episodes);
        if let Some(follower) = &mut follower {
            follower.run(first + k, m, &mut walker.result);
        }
    }
    monitor.advance(moves.chunk_by(|a, b| a.block == b.block).count());
    Ok(walker.result)
}

/// Nearest body at the ends of a few moves. It is one of the places where the smallest clearance
/// may be, and lets the run pass over all that is farther away: most of the program.
fn sample_clearance(scene: &RunScene<'_>, queries: &RunQueries, first: usize, moves: &[Move]) -> ChunkResult {
    let mut walker = Walker::new(scene, queries, None, None);
    for (k, m) in moves.iter().enumerate().step_by(MOVES_PER_SAMPLE) {
        walker.look(first + k, m);
    }
    walker.result
}
