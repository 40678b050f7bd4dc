//! Chips on turns with the tool down.

use facemill_cl_data::{CcPoint, ClPoint};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::FeedsFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::validate::tip_feed::depends_on_chips;
use facemill_tool_model::{Outline, cl_from_cc};
use facemill_tool_path::chips::{Chip, ChipSite, THICKNESS_ACCURACY};
use facemill_tool_path::moves::{PieceMoves, TurnState};
use nalgebra::Point3;

use crate::passes::engagement::{PointEngagement, area, stock_over};

/// Number of places inside a turn whose chip is computed.
const PLACES: usize = 7;

/// Records in every move of a turn the largest chip on it, and in the moves that the turn replaces
/// those at the ends of the passes. `along` are the chips of every piece.
///
/// Inside a turn nothing is known to be cut already: its chips are those of the whole layer, or of
/// the solid, across the feed.
///
/// # Errors
/// If an area cannot be computed.
pub(crate) fn give_turn_chips(
    job: &Job,
    setup: &Setup<'_>,
    feeds: &FeedsFile,
    pieces: &mut [PieceMoves],
    along: &[Vec<PointEngagement>],
) -> Result<(), Failure> {
    for k in 1..pieces.len() {
        let (before, from) = pieces.split_at_mut(k);
        let (before, piece) = (&before[k - 1], &mut from[0]);
        let TurnState::Made(instead) = &mut piece.turn else { continue };
        let (Some(exit), Some(entry)) = (along[k - 1].last(), along[k].first()) else { continue };
        instead.give_chips([exit.chip, entry.chip]);
        let ends = exit.chip.larger(entry.chip);
        let chip = if depends_on_chips(feeds) {
            inner_chips(job, setup, before, piece)?.into_iter().fold(ends, Chip::larger)
        } else {
            ends
        };
        let n = piece.turn_moves().len();
        piece.moves[..n].iter_mut().for_each(|m| m.chip = Some(chip));
    }
    Ok(())
}

/// Returns chips at places inside the turn to a piece.
fn inner_chips(job: &Job, setup: &Setup<'_>, before: &PieceMoves, piece: &PieceMoves) -> Result<Vec<Chip>, Failure> {
    let (Some(last), Some(first)) = (before.piece.cuts.last(), piece.piece.cuts.first()) else { return Ok(Vec::new()) };
    let poses: Vec<ClPoint> = piece.turn_moves().iter().map(|m| m.cl).collect();
    let mut chips = Vec::new();
    for place in 1..=PLACES {
        let share = place as f64 / (PLACES + 1) as f64;
        let at = (share * poses.len() as f64) as usize;
        let (Some(a), Some(b)) = (at.checked_sub(1).and_then(|a| poses.get(a)), poses.get(at)) else { continue };
        let normal = last.cc.normal.lerp(&first.cc.normal, share);
        let Ok(cc) = CcPoint::new(Point3::origin(), normal, b.tip - a.tip) else { continue };
        let posture = cc.posture_of(&b.axis);
        let offset = cl_from_cc(job.tool.cutter(), &cc, posture).tip - cc.position;
        let cc = CcPoint { position: b.tip - offset, ..cc };
        let outline = Outline::new(job.tool.cutter(), posture);
        let top = stock_over(setup, &cc, 0.0, &outline);
        let site = ChipSite::new(outline, &[], top);
        let area = area(&site)?;
        let thickness = if area > 0.0 { site.thickness(THICKNESS_ACCURACY) } else { 0.0 };
        chips.push(Chip { area, thickness, is_known: false, is_air: false });
    }
    Ok(chips)
}
