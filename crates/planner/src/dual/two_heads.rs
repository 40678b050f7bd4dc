//! Setup of a machine with two heads, from its operations to text.

use std::collections::BTreeSet;

use facemill_cutter_location::PoseTest;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::Report;
use facemill_job::format::report::links::{ShortenedLinks, TurnsReport};
use facemill_job::load::HEADS_APART;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{READ, Stages};
use facemill_verification::merged_heads::proven_for_both;
use facemill_virtual_machine::{Certificates, HeldAsCut, Verification};
use facemill_z_map::DexelMap;
use nalgebra::Point3;

use super::output::{DualTexts, gouge_sections, merged, write_dual_texts};
use super::pair::{PairPlanner, as_piece};
use crate::dual::links::DualLinks;
use crate::dual::parts::{ProgramPart, TwoHeadContext, alone_sections, cells, mover, section};
use crate::dual::refinement::refine;
use crate::dual::turns::{doubted_turns, replace_by_links, turns_report};
use crate::passes::extra_passes::AddedPasses;
use crate::passes::move_settings::move_settings;
use crate::passes::operation::PlannedOperation;
use crate::passes::setup_context::SetupContext;
use crate::plan_run::PlanRun;
use crate::planned::Planned;
use crate::program::heads::{Doubts, Heads, NumberedOperation, RoundTasks};
use crate::program::run_program::RunProgram;
use crate::program::timed::Timed;
use crate::report::reported_heads::ReportedHeads;
use crate::report::rotary_reversals::RotaryReversals;
use crate::stage_clock::Clock;

/// Plans one setup of a job on a machine with two heads.
///
/// # Errors
/// As [`crate::plan::plan_setup`].
pub(crate) fn with_two_heads(job: &Job, index: usize, mut run: PlanRun<'_>) -> Result<Planned, Failure> {
    let reading = run.stages.start(READ, 0);
    let planned_by = [job.seen_by(0, HEADS_APART), job.seen_by(1, HEADS_APART)];
    let run_by = [job.seen_by(0, 0.0), job.seen_by(1, 0.0)];
    let jobs = [&planned_by[0], &planned_by[1]];
    let setups = [Setup::read(jobs[0], index)?, Setup::read(jobs[1], index)?];
    let setups = [&setups[0], &setups[1]];
    check_winding(job, setups[0], index)?;
    let maps = [z_map(setups[0])?, z_map(setups[1])?];
    let machine = &job.machine;
    let shared: Vec<usize> = (0..machine.axes().len()).filter(|k| machine.is_shared(*k)).collect();
    let [shared] = shared[..] else {
        return Err(job.wrong(format!("machine: its two heads share {} axes; pairs are planned for one", shared.len())));
    };
    let machines = [&run_by[0].machine, &run_by[1].machine];
    let scenes = Scene::of_heads(jobs, setups, machines, index)?;
    drop(reading);
    run.clock.lap("read");
    run.plan(&TwoHeads { context: TwoHeadContext { scenes: &scenes, maps: [&maps[0], &maps[1]], shared } })
}

/// Setup of a machine with two heads.
pub(crate) struct TwoHeads<'a> {
    pub(crate) context: TwoHeadContext<'a>,
}

/// Operations of both heads, with the parts of the program that they are cut in.
pub(crate) struct DualOperations<'a> {
    operations: Vec<PlannedOperation<'a>>,
    /// Head of every operation.
    heads: Vec<usize>,
    pub(crate) parts: Vec<ProgramPart<'a>>,
}

impl<'a> Heads<'a, 2> for TwoHeads<'a> {
    type Moves = DualOperations<'a>;
    type Texts = DualTexts;
    type Links = DualLinks;

    fn scenes(&self) -> [&Scene<'a>; 2] {
        self.context.scenes.each_ref()
    }

    fn plan(
        &self,
        round: &RoundTasks<'_, 'a>,
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<(Self::Moves, Option<String>), Failure> {
        let scene = &self.context.scenes[0];
        let mut planned = DualOperations { operations: Vec::new(), heads: Vec::new(), parts: Vec::new() };
        let mut picture = None;
        let mut at: Option<AxisValues> = None;
        for (k, operation) in scene.job.operations_of(scene.setup.file) {
            let pair = scene.job.file.pairs.iter().find(|p| p.first == operation.name || p.second == operation.name);
            match pair {
                Some(pair) if planned.operations.iter().any(|o| o.operation.name == pair.first) => {}
                Some(pair) => {
                    let planner = PairPlanner { context: &self.context, pair, round, stages };
                    let (operations, part) = planner.plan(&mut at, &mut picture, clock)?;
                    planned.operations.extend(operations);
                    planned.heads.extend([0, 1]);
                    planned.parts.push(part);
                }
                None => {
                    let head = operation.head as usize - 1;
                    let own = self.context.scenes[head].job.operations_of(scene.setup.file).find(|(own, _)| *own == k);
                    let own = own.ok_or_else(|| Failure::Internal("heads with other operations".to_owned()))?;
                    let (operation, part) = self.alone(head, own, round, (&mut at, &mut picture), stages, clock)?;
                    planned.operations.push(operation);
                    planned.heads.push(head);
                    planned.parts.push(part);
                }
            }
        }
        Ok((planned, picture))
    }

    fn operations(moves: &Self::Moves) -> &[PlannedOperation<'a>] {
        &moves.operations
    }

    fn operations_mut(moves: &mut Self::Moves) -> &mut [PlannedOperation<'a>] {
        &mut moves.operations
    }

    fn write(&self, moves: &Self::Moves, verify: bool) -> Result<DualTexts, Failure> {
        write_dual_texts(&self.context, &moves.parts, verify)
    }

    fn write_draft(&self, moves: &Self::Moves) -> Result<DualTexts, Failure> {
        write_dual_texts(&self.context, &moves.parts, true)
    }

    fn timed(texts: &DualTexts) -> &Timed {
        &texts.timed
    }

    fn program<'p>(&'p self, moves: &Self::Moves, texts: &'p DualTexts, as_cut: HeldAsCut) -> RunProgram<'p, 2>
    where
        'a: 'p,
    {
        let sections = gouge_sections(&self.context, &moves.parts, texts);
        RunProgram { scenes: self.context.scenes.each_ref(), nc: &texts.nc, sections, as_cut }
    }

    fn find_links(
        &self,
        moves: &Self::Moves,
        texts: &DualTexts,
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<DualLinks, Failure> {
        DualLinks::find(&self.program(moves, texts, HeldAsCut::NOTHING), (&moves.parts, texts), cut, stages)
    }

    fn put_in(&self, links: &mut DualLinks, moves: &mut Self::Moves) {
        links.put_in(&mut moves.parts);
    }

    fn take_back(
        &self,
        mut links: Option<&mut DualLinks>,
        moves: &mut Self::Moves,
        texts: &DualTexts,
        doubts: Doubts<'_>,
        with_all: bool,
    ) -> bool {
        let parts = &mut moves.parts;
        // Found before any move changes its place.
        let turns = doubted_turns(parts, texts, doubts, with_all);
        let of_links = links.as_mut();
        let changes_links = of_links.is_some_and(|links| links.take_back(parts, texts, doubts, with_all));
        replace_by_links(parts, links, turns) || changes_links
    }

    fn report_links(links: &DualLinks, moves: &Self::Moves, texts: &DualTexts) -> ShortenedLinks {
        links.report(&moves.parts, texts)
    }

    fn refine(&self, moves: &mut Self::Moves, texts: &DualTexts, lines: &BTreeSet<u32>) -> usize {
        refine(&self.context, &mut moves.parts, texts, lines)
    }
}

impl<'a> ReportedHeads<'a, 2> for TwoHeads<'a> {
    fn heads_of(moves: &Self::Moves) -> Vec<usize> {
        moves.heads.clone()
    }

    fn complete(moves: &mut Self::Moves) {
        with_refined_stops(&mut moves.operations, &moves.parts);
    }

    fn time(&self, texts: &mut DualTexts) -> Result<(), Failure> {
        texts.time(&self.context)
    }

    fn merged_run(runs: [Verification; 2], moves: &Self::Moves) -> Verification {
        merged(runs, &moves.heads, &moves.parts, &moves.operations)
    }

    fn merged_proof(proofs: [Certificates; 2]) -> Certificates {
        proven_for_both(&proofs)
    }

    fn rotary_reversals(&self, moves: &Self::Moves, texts: &DualTexts) -> RotaryReversals {
        texts.rotary_reversals(&moves.parts, &self.context)
    }

    fn turns(&self, moves: &Self::Moves, texts: &DualTexts) -> Option<TurnsReport> {
        turns_report(&moves.parts, texts, &self.context)
    }

    fn cut_lines(moves: &Self::Moves, texts: &DualTexts) -> Vec<u32> {
        texts.cut_lines(&moves.parts)
    }

    fn add_pairs(&self, report: &mut Report, moves: &Self::Moves, texts: &DualTexts, links: Option<&DualLinks>) {
        let saved = links.map_or_else(|| vec![0.0; texts.times.len()], |links| links.saved(texts));
        report.orders.extend(moves.parts.iter().filter_map(|part| part.pair.as_ref()?.order.clone()));
        report.pairs = texts.pair_reports(&moves.parts, &saved, &self.context);
    }

    fn files(&self, texts: DualTexts, suffix: &str, state: &str) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        texts.files(suffix, state)
    }
}

impl<'a> TwoHeads<'a> {
    /// Plans an operation that one head machines with the other at home.
    fn alone(
        &self,
        head: usize,
        (index, operation): NumberedOperation<'a>,
        round: &RoundTasks<'_, 'a>,
        (at, picture): (&mut Option<AxisValues>, &mut Option<String>),
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<(PlannedOperation<'a>, ProgramPart<'a>), Failure> {
        let context = &self.context;
        let cells = cells(context, operation, operation);
        let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
        let settings = [0, 1].map(|h| move_settings(context.scenes[h].job, context.scenes[h].setup, operation));
        let mover = mover(context, &tests, [&settings[0], &settings[1]]);
        let (parking, from) = mover.park_other(head, *at)?;
        let mut sections = vec![section(format!("HEAD {} ALONE", head + 1), parking)];
        let of_head = SetupContext { added: AddedPasses::All, ..context.setup_context(head) };
        let task = round.task((index, operation), from, picture.is_none());
        let (planned, svg) = PlannedOperation::plan(&of_head, task, stages, clock)?;
        *picture = picture.take().or(svg);
        sections.extend(alone_sections(head, &planned.moves.pieces, &planned.moves.retract));
        *at = planned.moves.last().map(|m| m.axes).or(*at);
        let mut files = [None; 2];
        files[head] = Some(operation);
        Ok((planned, ProgramPart { files, sections, pair: None }))
    }
}

/// Adds the stops of refined runs to the pieces of pairs.
fn with_refined_stops(operations: &mut [PlannedOperation<'_>], parts: &[ProgramPart<'_>]) {
    let mut operations = operations.iter_mut();
    for part in parts {
        for head in (0..2).filter(|&h| part.files[h].is_some()) {
            let Some(operation) = operations.next() else { return };
            let runs = part.sections.iter().filter_map(|s| s.run.as_ref());
            for (piece, run) in operation.moves.pieces.iter_mut().zip(runs) {
                let counted: Vec<Point3<f64>> =
                    piece.piece.cuts.iter().filter(|c| !c.inserted).map(|c| c.cc.position).collect();
                *piece = as_piece(head, run, &piece.piece);
                piece.piece.cuts.iter_mut().for_each(|c| c.inserted |= !counted.contains(&c.cc.position));
            }
        }
    }
}
