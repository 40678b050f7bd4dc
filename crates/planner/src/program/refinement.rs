//! Insertion of poses where the written program does not meet its plan.

use std::collections::BTreeSet;

use facemill_cutter_location::{Hints, PoseTest};
use facemill_job::setup::cell::pass_settings;
use facemill_tool_path::linearity::turned_near;
use facemill_tool_path::moves::{Move, MoveKind};
use facemill_tool_path::segments::{Filler, PosePair};
use facemill_virtual_machine::{Certificate, Certificates, Finding, FindingKind, Verification};

use crate::passes::move_settings::cut_linearity;
use crate::passes::operation::PlannedOperation;
use crate::passes::setup_context::SetupContext;
use crate::program::timed::CutBlock;

/// Number of rounds of writing, running and refining: each halves the blocks concerned.
pub(crate) const ROUNDS: usize = 4;

/// Returns the lines of blocks in which the cutter goes deeper than permitted, or that could not be
/// certified.
pub(crate) fn lines_to_refine(
    verification: Option<&Verification>,
    certificates: Option<&Certificates>,
) -> BTreeSet<u32> {
    let findings = verification.iter().flat_map(|v| &v.findings).filter(|f| f.kind == FindingKind::Gouge);
    let gouged = findings.flat_map(|f| f.first_line..=f.last_line);
    // More poses do not cure a fault of the text.
    let is_open = |c: &&Certificate| !c.certified && c.doubted_since_line.is_none();
    let open = certificates.iter().flat_map(|c| &c.certificates).filter(is_open).map(|c| c.line);
    gouged.chain(open).collect()
}

/// Returns the lines of blocks in which the tool assembly comes nearer than its clearances permit.
pub(crate) fn lines_too_near(runs: &[Verification]) -> BTreeSet<u32> {
    let is_near =
        |f: &&Finding| matches!(f.kind, FindingKind::NearMiss | FindingKind::Collision | FindingKind::HolderCollision);
    runs.iter().flat_map(|run| &run.findings).filter(is_near).flat_map(|f| f.first_line..=f.last_line).collect()
}

/// Inserts a tested pose into the middle of each of these blocks, and others beside it where the
/// control would deviate from one to the next; returns the number of inserted poses. A block
/// without a feasible pose stays unchanged.
pub(crate) fn refine(
    SetupContext { scene, map, .. }: &SetupContext<'_>,
    operations: &mut [PlannedOperation<'_>],
    blocks: &[CutBlock],
) -> usize {
    let mut put_in = 0;
    for (index, planned) in operations.iter_mut().enumerate() {
        let cell = scene.workcell(planned.operation, map);
        let test = PoseTest::new(&cell);
        let settings = pass_settings(planned.operation);
        let linearity = cut_linearity(scene.job, planned.operation);
        let mut hints = Hints::default();
        // From the last one on, so that earlier indices stay valid.
        let own: BTreeSet<&CutBlock> = blocks.iter().filter(|b| b.operation == index).collect();
        for b in own.into_iter().rev() {
            let piece = &mut planned.moves.pieces[b.piece];
            let filler = Filler::new(&test, settings.fallback(), piece.piece.curve);
            let pair = PosePair { from: &piece.piece.cuts[b.cut - 1], to: &piece.piece.cuts[b.cut] };
            let Some(cuts) = filler.refined(&linearity, &pair, &mut hints) else { continue };
            put_in += cuts.len();
            let mut axes = piece.moves[b.at - 1].axes;
            // Between the same two points the chip is no larger.
            let chip = piece.moves[b.at].chip;
            let moves: Vec<Move> = cuts
                .iter()
                .map(|cut| {
                    axes = turned_near(&test, &cut.pose.configuration.axes, &axes);
                    Move { kind: MoveKind::Cut, cl: cut.pose.cl, axes, chip }
                })
                .collect();
            piece.moves.splice(b.at..b.at, moves);
            piece.piece.cuts.splice(b.cut..b.cut, cuts);
        }
    }
    put_in
}
