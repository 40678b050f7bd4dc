//! Faster links of a plan: put into its moves before its program is run, so that every text of it
//! has them.

use std::collections::BTreeMap;

use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::links::ShortenedLinks;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::moves::{Move, MoveKind};
use facemill_virtual_machine::Finding;
use facemill_z_map::DexelMap;

use crate::passes::operation::PlannedOperation;
use crate::program::link_search::{LineMatch, LinkSearch, RapidLines, RunLines, SearchedLinks};
use crate::program::output::Texts;
use crate::program::run_program::RunProgram;

/// Links between the passes of a setup, with the results of the search.
pub(crate) struct PlannedLinks {
    searched: SearchedLinks,
    /// Replaced rapids, by the index of their run.
    replaced: BTreeMap<usize, ReplacedRapids>,
}

/// Rapids that a faster path replaces.
struct ReplacedRapids {
    goal: Goal,
    /// Rapids behind the operation before, if the link begins there.
    behind: Vec<Move>,
    /// Rapids to the piece, without the last one.
    to_piece: Vec<Move>,
}

/// Piece that a link goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Goal {
    /// Index of its operation.
    operation: usize,
    /// Its index there.
    piece: usize,
}

/// All rapids to a piece, by the indices of their moves in the program.
struct RapidRun {
    goal: Goal,
    /// Indices of the first and the last one; `None` where a turn leads to the piece.
    moves: Option<[usize; 2]>,
    /// Reason why they must stay.
    hold: Option<&'static str>,
}

/// Returns the rapids to every piece but the first one of all, in program order. A piece keeps the
/// index of its run when a turn to it is replaced by a link.
fn rapid_runs(operations: &[PlannedOperation<'_>]) -> Vec<RapidRun> {
    let mut runs = Vec::new();
    // Index of the next move, and of the first one behind the operation before.
    let (mut at, mut behind) = (0, None);
    for (operation, o) in operations.iter().enumerate() {
        for (piece, moves) in o.moves.pieces.iter().map(|p| &p.moves).enumerate() {
            let rapids = leading_rapids(moves);
            let first = if piece == 0 { behind.take() } else { Some(at) };
            if let Some(first) = first {
                let hold = if piece == 0 { change_before(operations, operation) } else { None };
                let moves = (rapids > 0).then(|| [first, at + rapids - 1]);
                runs.push(RapidRun { goal: Goal { operation, piece }, moves, hold });
            }
            at += moves.len();
        }
        behind = Some(at);
        at += o.moves.retract.len();
    }
    runs
}

fn leading_rapids(moves: &[Move]) -> usize {
    moves.iter().take_while(|m| m.kind == MoveKind::Rapid).count()
}

/// Returns the change of the program between two operations, which happens far from the part, on
/// the present link.
fn change_before(operations: &[PlannedOperation<'_>], operation: usize) -> Option<&'static str> {
    let [before, now] = [operation.checked_sub(1)?, operation].map(|k| &operations[k].operation.feeds);
    let changes = before.spindle_rpm != now.spindle_rpm || before.coolant != now.coolant;
    changes.then_some("spindle or coolant change on it")
}

impl Goal {
    /// Returns the index of the operation whose rapids behind it belong to the link.
    fn operation_before(&self) -> Option<usize> {
        if self.piece == 0 { self.operation.checked_sub(1) } else { None }
    }
}

impl PlannedLinks {
    /// Searches for the fastest path of every link that is proven free: of the stock at that time,
    /// which is `cut` with its tolerance, or off the initial stock.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn find(
        program: &RunProgram<'_, 1>,
        (operations, texts): (&[PlannedOperation<'_>], &Texts),
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<Self, Failure> {
        let [scene] = program.scenes;
        let Scene { job, setup, .. } = scene;
        let text = program.read()?;
        let at = program.setup(0);
        let views = [(&job.machine, job.tool.gauge_length())];
        let lines = |run: RapidRun| RunLines { lines: run.moves.map(|at| texts.lines_of_moves(at)), hold: run.hold };
        let search = LinkSearch {
            heads: &[scene.link_scene()],
            clock: &LinkClock::new(&views),
            words: scene.link_words(),
            compensation: scene.compensation(),
            text: &text,
            rapids: RapidLines {
                runs: rapid_runs(operations).into_iter().map(lines).collect(),
                rule: LineMatch::Within,
            },
            clearance: setup.file.rapid_clearance_mm,
        };
        let searched = match cut {
            Some(cut) => search.in_cut_stock(&[&at], cut, stages)?,
            None => search.off_first_stock(&[&at], stages)?,
        };
        Ok(Self { searched, replaced: BTreeMap::new() })
    }

    /// Puts the faster paths into the moves.
    pub(crate) fn put_in(&mut self, scene: &Scene<'_>, operations: &mut [PlannedOperation<'_>]) {
        let runs = rapid_runs(operations);
        for (run, faster) in self.searched.faster_paths() {
            let goal = runs[run].goal;
            let behind = goal.operation_before().map(|k| std::mem::take(&mut operations[k].moves.retract));
            let moves = &mut operations[goal.operation].moves.pieces[goal.piece].moves;
            // The last one stays: the start of the entry, to the last bit.
            let end = leading_rapids(moves).saturating_sub(1);
            let to_piece = moves.splice(..end, rapids(scene, &faster.over)).collect();
            self.replaced.insert(run, ReplacedRapids { goal, behind: behind.unwrap_or_default(), to_piece });
        }
    }

    /// Restores the old paths of links in whose blocks the program has a finding or a line that
    /// could not be certified, and if requested those of all others; returns whether there were
    /// any.
    pub(crate) fn take_back(
        &mut self,
        operations: &mut [PlannedOperation<'_>],
        texts: &Texts,
        doubts: (&[Finding], &[u32]),
        with_all: bool,
    ) -> bool {
        let runs = rapid_runs(operations);
        let lines = |run: usize| Some(texts.lines_of_moves(runs.get(run)?.moves?));
        let removed = self.searched.take_back(&lines, doubts, with_all);
        for (run, faster) in &removed {
            let Some(ReplacedRapids { goal, behind, to_piece }) = self.replaced.remove(run) else { continue };
            operations[goal.operation].moves.pieces[goal.piece].moves.splice(..faster.over.len(), to_piece);
            if let Some(before) = goal.operation_before() {
                operations[before].moves.retract = behind;
            }
        }
        !removed.is_empty()
    }

    /// Returns the report on the links, by the lines of the written program.
    pub(crate) fn report(&self, operations: &[PlannedOperation<'_>], texts: &Texts) -> ShortenedLinks {
        let runs = rapid_runs(operations);
        self.searched.report(&|run| Some(texts.lines_of_moves(runs.get(run)?.moves?)))
    }
}

/// Returns rapids over these positions.
fn rapids(Scene { job, setup, .. }: &Scene<'_>, over: &[AxisValues]) -> Vec<Move> {
    let work_from_table = setup.table_from_work.inverse();
    let at = |axes: &AxisValues| {
        let cl = job.machine.cl_point(axes, job.tool.gauge_length()).transformed(&work_from_table);
        Move { kind: MoveKind::Rapid, cl, axes: *axes, chip: None }
    };
    over.iter().map(at).collect()
}

#[cfg(test)]
#[path = "../../tests/unit/program/planned_links.rs"]
mod tests;
