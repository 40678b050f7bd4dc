//! Setup of a machine with any number of heads, as the rounds from operations to a verified program
//! see it.

use std::collections::BTreeSet;

use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::links::ShortenedLinks;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_nc_program::ProgramSpec;
use facemill_tool_path::moves::Move;
use facemill_virtual_machine::{Finding, HeldAsCut};
use facemill_z_map::DexelMap;

use crate::passes::high_places::HighPlaces;
use crate::passes::operation::{Corrections, OperationTask, PlannedOperation};
use crate::program::run_program::RunProgram;
use crate::program::timed::Timed;
use crate::stage_clock::Clock;

/// Operation with the number that it has in the job.
pub(crate) type NumberedOperation<'a> = (usize, &'a OperationFile);

/// Findings of a program, and lines that could not be certified.
pub(crate) type Doubts<'d> = (&'d [Finding], &'d [u32]);

/// Setup of a machine with `N` heads. One head is `N` = 1.
pub(crate) trait Heads<'a, const N: usize> {
    /// Planned operations, with all that their text is written from.
    type Moves;
    /// Texts with their timed blocks.
    type Texts;
    /// Faster links, with the results of their search.
    type Links;

    /// Setup as each head sees it.
    fn scenes(&self) -> [&Scene<'a>; N];

    /// Plans all operations; returns the picture of the solution space in the first round, too.
    ///
    /// # Errors
    /// As [`PlannedOperation::plan`], or if there is no link from one operation to the next.
    fn plan(
        &self,
        round: &RoundTasks<'_, 'a>,
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<(Self::Moves, Option<String>), Failure>;

    /// Returns the operations, in the order of the report.
    fn operations(moves: &Self::Moves) -> &[PlannedOperation<'a>];

    /// Returns the operations to be changed, in the order of the report.
    fn operations_mut(moves: &mut Self::Moves) -> &mut [PlannedOperation<'a>];

    /// Writes timed blocks and texts; `verify` states whether the text will be run on the virtual
    /// machine.
    ///
    /// # Errors
    /// If a block has no feed that axes and control permit, or the post has no words for it.
    fn write(&self, moves: &Self::Moves, verify: bool) -> Result<Self::Texts, Failure>;

    /// Writes the text for questions on its path: its feeds may be those before any motion law.
    ///
    /// # Errors
    /// As [`Heads::write`].
    fn write_draft(&self, moves: &Self::Moves) -> Result<Self::Texts, Failure>;

    /// Returns the timed blocks of texts.
    fn timed(texts: &Self::Texts) -> &Timed;

    /// Returns the specification that a text is written from, if a program with other tools can be
    /// written from it.
    fn spec(_: &Self::Texts) -> Option<&ProgramSpec> {
        None
    }

    /// Returns the text as the virtual machine runs it.
    fn program<'p>(&'p self, moves: &Self::Moves, texts: &'p Self::Texts, as_cut: HeldAsCut) -> RunProgram<'p, N>
    where
        'a: 'p;

    /// Searches for the fastest path of every link that is proven free: of the stock at that time,
    /// which is `cut` with its tolerance, or off the initial stock.
    ///
    /// # Errors
    /// If the stages are cancelled.
    fn find_links(
        &self,
        moves: &Self::Moves,
        texts: &Self::Texts,
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<Self::Links, Failure>;

    /// Writes the faster links into the moves.
    fn put_in(&self, links: &mut Self::Links, moves: &mut Self::Moves);

    /// Restores the links, and replaces the turns, in whose blocks there is a finding or a line
    /// that could not be certified; `with_all` also restores all others if there is one. Returns
    /// whether there was any.
    fn take_back(
        &self,
        links: Option<&mut Self::Links>,
        moves: &mut Self::Moves,
        texts: &Self::Texts,
        doubts: Doubts<'_>,
        with_all: bool,
    ) -> bool;

    /// Returns the report on the links, with their lines in the written program.
    fn report_links(links: &Self::Links, moves: &Self::Moves, texts: &Self::Texts) -> ShortenedLinks;

    /// Refines the blocks of these lines and returns the number of added poses. A block stays as it
    /// is if no pose in it is feasible.
    fn refine(&self, moves: &mut Self::Moves, texts: &Self::Texts, lines: &BTreeSet<u32>) -> usize;
}

/// Corrections of a setup's operations by what the text of the round before has left.
#[derive(Default)]
pub(crate) struct RoundTasks<'w, 'a> {
    tasks: Vec<RoundTask<'w, 'a>>,
}

/// Corrections of one operation.
struct RoundTask<'w, 'a> {
    operation: &'a str,
    corrections: Option<Corrections>,
    before: Option<&'w PlannedOperation<'a>>,
}

impl<'w, 'a> RoundTasks<'w, 'a> {
    /// Returns whether this is the round that lays the passes first.
    pub(crate) fn is_first(&self) -> bool {
        self.tasks.is_empty()
    }

    /// Adds the corrections of an operation; `before` has its passes if they stay where they are.
    pub(crate) fn add(
        &mut self,
        operation: &'a OperationFile,
        corrections: Option<Corrections>,
        before: Option<&'w PlannedOperation<'a>>,
    ) {
        self.tasks.push(RoundTask { operation: &operation.name, corrections, before });
    }

    /// Returns the places of an operation where passes are put in.
    pub(crate) fn high(&self, operation: &OperationFile) -> Option<&HighPlaces> {
        Some(&self.of(operation)?.corrections.as_ref()?.high)
    }

    /// Returns the task of an operation that continues at the end of another one. The solution
    /// space is drawn in the first round, if it is wanted.
    pub(crate) fn task(
        &self,
        (index, operation): NumberedOperation<'a>,
        from: Option<Move>,
        wants_picture: bool,
    ) -> OperationTask<'a, '_> {
        let task = self.of(operation);
        OperationTask {
            from,
            picture: wants_picture && self.is_first(),
            corrections: task.and_then(|task| task.corrections.as_ref()),
            before: task.and_then(|task| task.before),
            ..OperationTask::alone((index, operation))
        }
    }

    fn of(&self, operation: &OperationFile) -> Option<&RoundTask<'w, 'a>> {
        self.tasks.iter().find(|task| task.operation == operation.name)
    }
}
