//! Parts of a program for two heads, and the setups that they are planned in.

use facemill_cutter_location::{PairTest, PoseTest, Workcell};
use facemill_job::format::job_file::{OperationFile, PairFile};
use facemill_job::format::report::pairs::PairSplit;
use facemill_job::load::job::Job;
use facemill_job::setup::scene::Scene;
use facemill_tool_path::moves::order::PassOrderReport;
use facemill_tool_path::moves::{Move, MoveKind, MoveSettings, PieceMoves, TurnState};
use facemill_z_map::ZMap;

use crate::dual::moves::{DualMove, DualMover};
use crate::dual::runs::PairRun;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::setup_context::SetupContext;

/// Setup as both heads see it.
pub(crate) struct TwoHeadContext<'a> {
    /// Scene of each head: tool and cutter of the other one are larger than they are in its job,
    /// and as they are on its machine.
    pub scenes: &'a [Scene<'a>; 2],
    pub maps: [&'a ZMap; 2],
    /// Index of the axis that both share.
    pub shared: usize,
}

impl<'a> TwoHeadContext<'a> {
    pub(crate) fn jobs(&self) -> [&'a Job; 2] {
        self.scenes.each_ref().map(|scene| scene.job)
    }

    pub(crate) fn setup_context(&self, head: usize) -> SetupContext<'a> {
        SetupContext { scene: &self.scenes[head], map: self.maps[head], added: AddedPasses::BesideTrimmed }
    }

    pub(crate) fn cell(&self, head: usize, operation: &OperationFile) -> Workcell<'a> {
        self.scenes[head].workcell(operation, self.maps[head])
    }
}

/// Part of the program: one operation, or two at once.
pub(crate) struct ProgramPart<'a> {
    /// Operation of each head, if it has one.
    pub files: [Option<&'a OperationFile>; 2],
    /// Moves with their comments.
    pub sections: Vec<Section>,
    /// Data of a pair for the report, without its times.
    pub pair: Option<PairOutline>,
}

/// Moves under one comment.
pub(crate) struct Section {
    pub comment: String,
    pub moves: Vec<DualMove>,
    /// Run whose stops its moves go to, if both heads cut.
    pub run: Option<PairRun>,
    /// Whether its moves continue a pass that was interrupted to turn an axis back.
    pub goes_on: bool,
    /// How the tool comes from the section before.
    pub turn: SectionTurn,
}

/// Turn with the tool down from the section before, in place of exit, link and entry.
pub(crate) enum SectionTurn {
    /// None was sought.
    NotSought,
    /// There is none, for this reason.
    Refused(String),
    /// The first moves are a turn.
    Made {
        /// Exit of the section before that it replaces.
        exit: Vec<DualMove>,
        /// Link and entry that it replaces.
        lead: Vec<DualMove>,
    },
}

impl Section {
    /// Returns the number of its moves in the turn from the section before.
    pub(crate) fn turn_moves(&self) -> usize {
        self.moves.iter().take_while(|m| m.kind == MoveKind::Turn).count()
    }
}

/// Data of a pair before its times are known.
pub(crate) struct PairOutline {
    pub file: PairFile,
    pub runs: usize,
    pub separate_time: f64,
    pub splits: Vec<PairSplit>,
    /// Report on the order of the runs, if it is not as laid.
    pub order: Option<PassOrderReport>,
}

/// Returns the moves of one head's pieces, piece by piece, and those from the last one back.
pub(crate) fn alone_sections(head: usize, pieces: &[PieceMoves], retract: &[Move]) -> Vec<Section> {
    let mut working = [false; 2];
    working[head] = true;
    let dual = |m: &Move| {
        let mut chips = [None; 2];
        chips[head] = m.chip;
        DualMove { kind: m.kind, axes: m.axes, working, chips }
    };
    let all = |moves: &[Move]| -> Vec<DualMove> { moves.iter().map(dual).collect() };
    let of_pieces = pieces.iter().map(|p| {
        let turn = match &p.turn {
            TurnState::NotSought => SectionTurn::NotSought,
            TurnState::Refused(why) => SectionTurn::Refused(why.clone()),
            TurnState::Made(instead) => {
                let [exit, lead] = instead.moves().map(all);
                SectionTurn::Made { exit, lead }
            }
        };
        let comment = format!("HEAD {} PASS {} PLACE {}", head + 1, p.piece.pass + 1, p.piece.copy + 1);
        let goes_on = p.piece.part.is_some_and(|part| part > 0);
        Section { goes_on, turn, ..section(comment, all(&p.moves)) }
    });
    let retract = section(String::new(), all(retract));
    of_pieces.chain([retract]).collect()
}

pub(crate) fn section(comment: String, moves: Vec<DualMove>) -> Section {
    Section { comment, moves, run: None, goes_on: false, turn: SectionTurn::NotSought }
}

pub(crate) fn cells<'a>(
    context: &TwoHeadContext<'a>,
    first: &OperationFile,
    second: &OperationFile,
) -> [Workcell<'a>; 2] {
    [context.cell(0, first), context.cell(1, second)]
}

pub(crate) fn mover<'r, 'c>(
    context: &TwoHeadContext<'_>,
    tests: &'r [PoseTest<'c>; 2],
    settings: [&'r MoveSettings; 2],
) -> DualMover<'r, 'c> {
    DualMover { test: PairTest { tests: [&tests[0], &tests[1]], shared: context.shared }, settings }
}
