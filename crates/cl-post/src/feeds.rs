//! Feeds that the axes reach within acceleration and jerk.

use facemill_feedrate::ProgramBlock;
use facemill_nc_program::{Block, FeedMode};
use facemill_virtual_machine::program_time::reachable;
use facemill_virtual_machine::program_time::run::{MotionRun, Timer, missing_limits};

use crate::blocks::ToolBlocks;
use crate::fault::PostFault;
use crate::positions::PositionKind;
use crate::report::PostNote;
use crate::scene::PostScene;

/// Lowers the feeds of cuts to those that the axes reach by the law of motion between two stops, as
/// the control runs its blocks. Without the limits of all axes feeds stay, with a note.
///
/// # Errors
/// Only an internal fault.
pub(crate) fn lower_feeds(
    scene: &PostScene<'_>,
    tool_length: f64,
    blocks: &mut ToolBlocks,
    notes: &mut Vec<PostNote>,
) -> Result<(), PostFault> {
    let missing = missing_limits(scene.machine);
    if let Some(first) = missing.first() {
        let text = format!("feeds are those of the file: no law of motion, because {first}");
        if notes.iter().all(|note| note.text != text) {
            notes.push(PostNote::whole(text));
        }
        return Ok(());
    }
    let views = [(scene.machine, tool_length)];
    let tolerance = scene.machine.motion_law().control_tolerance;
    let fault = |e: String| PostFault::Whole(format!("law of motion: {e}"));
    let timer = Timer::new(&views, tolerance).map_err(|e| fault(e.to_string()))?;
    let timer = timer.without_limits().on_control(&scene.post.rules().control_motion);
    for (first, run) in runs_of_cuts(blocks) {
        let law = timer.time(&run).map_err(fault)?;
        for (k, peak_time) in law.peak_times.iter().enumerate() {
            lower(scene, blocks, first + k, *peak_time);
        }
    }
    Ok(())
}

/// Runs of cuts between which the axes stop, each with the index of its first motion.
fn runs_of_cuts(blocks: &ToolBlocks) -> Vec<(usize, MotionRun)> {
    let mut runs: Vec<(usize, MotionRun)> = Vec::new();
    let mut is_open = false;
    for (k, pair) in blocks.motions.windows(2).enumerate() {
        let [(before, from), (block, to)] = pair else { continue };
        let stops = blocks.spec.program.blocks[before + 1..*block].iter().any(|b| !matches!(b, Block::Comment(_)));
        let is_cut = to.kind != PositionKind::Rapid;
        if !is_cut {
            is_open = false;
            continue;
        }
        if stops || !is_open {
            let run = MotionRun { start: from.axes, blocks: Vec::new(), is_rapid: false, vectors: Vec::new() };
            runs.push((k + 1, run));
            is_open = true;
        }
        if let Some((_, run)) = runs.last_mut() {
            run.blocks.push(ProgramBlock { end: to.axes, tip_time: blocks.times[k + 1], exact_stop: false });
        }
    }
    runs
}

/// Lowers the feed of a motion to the one at which it takes as long as at its largest speed.
fn lower(scene: &PostScene<'_>, blocks: &mut ToolBlocks, motion: usize, peak_time: f64) {
    let (block, _) = blocks.motions[motion];
    let before = blocks.times[motion];
    let Block::Linear { feed, .. } = &mut blocks.spec.program.blocks[block] else { return };
    let Some(time) = reachable(before, peak_time).filter(|_| before > 0.0) else { return };
    let least = match scene.post.feed_mode() {
        FeedMode::G94 | FeedMode::Rtcp => scene.machine.feed_range().min,
        // Smallest value that a word can express.
        FeedMode::G93 => 10f64.powi(-i32::from(scene.post.decimals().inverse_time)),
    };
    let new = (*feed * before / time).max(least);
    if new < *feed {
        blocks.times[motion] = before * *feed / new;
        *feed = new;
        blocks.lowered += 1;
    }
}
