//! Setup of a machine with one head, from its operations to text.

use std::collections::BTreeSet;

use facemill_job::failure::Failure;
use facemill_job::format::report::links::ShortenedLinks;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_nc_program::ProgramSpec;
use facemill_virtual_machine::HeldAsCut;
use facemill_z_map::DexelMap;

use crate::passes::operation::PlannedOperation;
use crate::passes::setup_context::SetupContext;
use crate::program::heads::{Doubts, Heads, RoundTasks};
use crate::program::output::{Texts, gouge_sections, write_draft, write_texts};
use crate::program::planned_links::PlannedLinks;
use crate::program::planned_turns::{doubted_turns, replace_by_links};
use crate::program::refinement::refine;
use crate::program::run_program::RunProgram;
use crate::program::timed::Timed;
use crate::stage_clock::Clock;

/// Setup of a machine with one head.
pub(crate) struct OneHead<'a> {
    pub(crate) context: SetupContext<'a>,
}

impl<'a> Heads<'a, 1> for OneHead<'a> {
    type Moves = Vec<PlannedOperation<'a>>;
    type Texts = Texts;
    type Links = PlannedLinks;

    fn scenes(&self) -> [&Scene<'a>; 1] {
        [self.context.scene]
    }

    fn plan(
        &self,
        round: &RoundTasks<'_, 'a>,
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<(Self::Moves, Option<String>), Failure> {
        let scene = self.context.scene;
        let mut operations: Vec<PlannedOperation<'a>> = Vec::new();
        let mut picture = None;
        for numbered in scene.job.operations_of(scene.setup.file) {
            let from = operations.last().and_then(|o| o.moves.last());
            let task = round.task(numbered, from, picture.is_none());
            let (planned, svg) = PlannedOperation::plan(&self.context, task, stages, clock)?;
            picture = picture.or(svg);
            operations.push(planned);
        }
        Ok((operations, picture))
    }

    fn operations(moves: &Self::Moves) -> &[PlannedOperation<'a>] {
        moves
    }

    fn operations_mut(moves: &mut Self::Moves) -> &mut [PlannedOperation<'a>] {
        moves
    }

    fn write(&self, moves: &Self::Moves, verify: bool) -> Result<Texts, Failure> {
        write_texts(self.context.scene, moves, verify)
    }

    fn write_draft(&self, moves: &Self::Moves) -> Result<Texts, Failure> {
        write_draft(self.context.scene, moves)
    }

    fn timed(texts: &Texts) -> &Timed {
        &texts.timed
    }

    fn spec(texts: &Texts) -> Option<&ProgramSpec> {
        Some(&texts.spec)
    }

    fn program<'p>(&'p self, moves: &Self::Moves, texts: &'p Texts, as_cut: HeldAsCut) -> RunProgram<'p, 1>
    where
        'a: 'p,
    {
        let scene = self.context.scene;
        RunProgram { scenes: [scene], nc: &texts.nc, sections: [gouge_sections(scene, moves, texts)], as_cut }
    }

    fn find_links(
        &self,
        moves: &Self::Moves,
        texts: &Texts,
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<PlannedLinks, Failure> {
        PlannedLinks::find(&self.program(moves, texts, HeldAsCut::NOTHING), (moves, texts), cut, stages)
    }

    fn put_in(&self, links: &mut PlannedLinks, moves: &mut Self::Moves) {
        links.put_in(self.context.scene, moves);
    }

    fn take_back(
        &self,
        links: Option<&mut PlannedLinks>,
        moves: &mut Self::Moves,
        texts: &Texts,
        doubts: Doubts<'_>,
        with_all: bool,
    ) -> bool {
        // Found before any move changes its index.
        let turns = doubted_turns(moves, texts, doubts, with_all);
        let changes_links = links.is_some_and(|links| links.take_back(moves, texts, doubts, with_all));
        replace_by_links(moves, turns) || changes_links
    }

    fn report_links(links: &PlannedLinks, moves: &Self::Moves, texts: &Texts) -> ShortenedLinks {
        links.report(moves, texts)
    }

    fn refine(&self, moves: &mut Self::Moves, texts: &Texts, lines: &BTreeSet<u32>) -> usize {
        refine(&self.context, moves, &texts.cut_blocks_at(lines))
    }
}
