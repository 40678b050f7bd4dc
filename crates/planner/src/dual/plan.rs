//! Complete plan of one setup of a machine with two heads.

use std::collections::BTreeSet;

use facemill_cutter_location::PoseTest;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::made_from::MadeFrom;
use facemill_job::format::report::links::LinksReport;
use facemill_job::format::report::stock::{PlannedStockReport, not_requested};
use facemill_job::load::HEADS_APART;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::load::open_meshes::open_stock;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{READ, Stages, TIMES, WRITE};
use facemill_verification::merged_heads::proven_for_both;
use facemill_virtual_machine::{
    Assumption, Certificates, Finding, HeldAsCut, Verification, merge_findings, rapid_lines,
};
use nalgebra::Point3;

use super::output::{DualProgram, DualTexts, merged, write_dual_texts};
use super::pair::{PairPlanner, as_piece};
use crate::dual::links::DualLinks;
use crate::dual::parts::{ProgramPart, TwoHeadContext, alone_sections, cells, mover, section};
use crate::dual::refinement::refine;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::move_settings::move_settings;
use crate::passes::operation::{OperationTask, PlannedOperation};
use crate::passes::setup_context::SetupContext;
use crate::plan_settings::PlanSettings;
use crate::plan_stages::stages_of_heads;
use crate::plan_stock::{CutByPlan, StockBefore, StockToCut};
use crate::planned::{Planned, name_parts, planned_files};
use crate::program::cut_stock::{cut_by_heads, held_as_cut, stock_of_links};
use crate::program::output::check_feeds;
use crate::program::rounds::{ProgramOfHeads, VerifiedProgram, verified_program};
use crate::program::timing::control_assumption;
use crate::report::chip_files::ChipFiles;
use crate::report::efficiencies::efficiencies;
use crate::report::left_above::left_above;
use crate::report::pass_files::pass_files;
use crate::report::reporting::report;
use crate::stage_clock::Clock;

/// Plans one setup of a job on a machine with two heads.
///
/// # Errors
/// As [`crate::plan::plan_setup`].
pub(crate) fn plan_dual_setup(
    job: &Job,
    index: usize,
    settings: PlanSettings,
    stock: Option<&StockToCut<'_>>,
    stages: &dyn Stages,
) -> Result<Planned, Failure> {
    let mut clock = Clock::new();
    stages.expect(stages_of_heads(job, index, settings, stock.is_some()));
    let reading = stages.start(READ, 0);
    let made_from = MadeFrom::of(job);
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
    drop(reading);
    clock.lap("read");
    let machines = [&run_by[0].machine, &run_by[1].machine];
    let scenes = Scene::of_heads(jobs, setups, machines, index)?;
    let context = TwoHeadContext { scenes: &scenes, maps: [&maps[0], &maps[1]], shared };
    let mut operations: Vec<(usize, usize, PlannedOperation<'_>)> = Vec::new();
    let mut parts: Vec<ProgramPart<'_>> = Vec::new();
    let mut picture = None;
    let mut at: Option<AxisValues> = None;
    for (k, operation) in jobs[0].operations_of(setups[0].file) {
        let pair = job.file.pairs.iter().find(|p| p.first == operation.name || p.second == operation.name);
        match pair {
            Some(pair) if operations.iter().any(|(_, _, o)| o.operation.name == pair.first) => {}
            Some(pair) => {
                let (planned, part) =
                    PairPlanner { context: &context, pair, stages }.plan(&mut at, &mut picture, &mut clock)?;
                operations.extend(planned);
                parts.push(part);
            }
            None => {
                let head = operation.head as usize - 1;
                let (planned, part) = alone(&context, head, k, &mut at, &mut picture, stages, &mut clock)?;
                operations.push((head, k, planned));
                parts.push(part);
            }
        }
    }
    let to_cut = stock.filter(|_| settings.verify).ok_or_else(|| not_requested(settings.verify).to_owned());
    let (before, shortened) = match to_cut {
        Ok(stock) => {
            let before = stock.before(jobs[0], setups[0])?;
            let shortened = shorten_links(&context, &mut parts, &before, stages)?;
            (before, shortened)
        }
        Err(why) => (Err(why.clone()), Err(why)),
    };
    clock.lap("shorten links");
    let mut both = TwoHeads { context: &context, parts, settings, before: &before, shortened, stages };
    let VerifiedProgram { mut texts, verifications, certificates, cut: (of_stock, rest), seen, added_poses } =
        verified_program(&mut both, settings, &mut clock)?;
    let links = both.links_report(&texts);
    let saved = both.shortened.as_ref().map_or_else(|_| vec![0.0; texts.times.len()], |links| links.saved(&texts));
    let parts = both.parts;
    let (mut planned, heads): (Vec<PlannedOperation<'_>>, Vec<usize>) =
        operations.into_iter().map(|(head, _, o)| (o, head)).unzip();
    with_refined_stops(&mut planned, &parts);
    let jobs_of: Vec<&Job> = heads.iter().map(|&h| jobs[h]).collect();
    let timing = stages.start(TIMES, 0);
    texts.time(&context)?;
    drop(timing);
    clock.lap("times");
    let verification = verifications.map(|v| merged(v, &heads, &parts, &planned));
    let certificates = certificates.as_ref().map(proven_for_both);
    let rotary_reversals = texts.rotary_reversals(&parts, &context);
    let mut report =
        report(&jobs_of, setups[0], &planned, &texts.timed, rotary_reversals, verification, certificates.as_ref());
    report.orders.extend(parts.iter().filter_map(|part| part.pair.as_ref()?.order.clone()));
    report.pairs = texts.pair_reports(&parts, &saved, &context);
    report.made_from = made_from;
    report.totals.mended_blocks = added_poses;
    let program = DualProgram { context: &context, parts: &parts, texts: &texts, as_cut: HeldAsCut::NOTHING };
    report.assumptions = program.assumptions()?;
    report.assumptions.extend(control_assumption(jobs[0], &texts.timed));
    report.assumptions.extend(open_stock(setups[0]));
    report.assumptions.extend(seen.map(|text| Assumption { line: None, text }));
    report.findings = merge_findings(report.findings, &rapid_lines(&program.read()?));
    report.stock = of_stock;
    report.remaining = program.remaining(stages)?;
    report.efficiency = efficiencies(&jobs_of, setups[0], &planned)?;
    report.left_above = planned.iter().zip(&heads).filter_map(|(o, &h)| left_above(jobs[h], setups[h], o)).collect();
    clock.lap("material left");
    report.links = links;
    let (suffix, state) = name_parts(job, setups[0], &report);
    let passes = pass_files(&jobs_of, setups[0], &planned, &report);
    let chips = ChipFiles::new(&jobs_of, &setups[0].file.name, &planned, (&texts.timed, &[]));
    let files = texts.files(&suffix, state)?;
    Ok(Planned { rest, ..planned_files(&suffix, (report, certificates), files, picture, (chips, passes), clock) })
}

/// Writes faster links that are free for both heads into the moves, or returns why there are none.
fn shorten_links(
    context: &TwoHeadContext<'_>,
    parts: &mut [ProgramPart<'_>],
    before: &StockBefore,
    stages: &dyn Stages,
) -> Result<Result<DualLinks, String>, Failure> {
    if !context.scenes[0].setup.file.links.shorten {
        return Ok(Err("the job says so (links.shorten)".to_owned()));
    }
    let cut = match stock_of_links(&context.scenes[0], before) {
        Ok(cut) => cut,
        Err(why) => return Ok(Err(why)),
    };
    let texts = write_dual_texts(context, parts, true)?;
    let program = DualProgram { context, parts, texts: &texts, as_cut: HeldAsCut::NOTHING };
    let links = DualLinks::find(&program, cut, stages)?;
    links.put_in(parts);
    Ok(Ok(links))
}

/// Program of a machine with two heads.
struct TwoHeads<'r, 'a> {
    context: &'r TwoHeadContext<'a>,
    parts: Vec<ProgramPart<'a>>,
    settings: PlanSettings,
    before: &'r StockBefore,
    /// Faster links, or the reason why none were searched.
    shortened: Result<DualLinks, String>,
    stages: &'r dyn Stages,
}

impl<'a> TwoHeads<'_, 'a> {
    fn program<'p>(&'p self, texts: &'p DualTexts) -> DualProgram<'p, 'a> {
        let scenes = self.context.scenes.each_ref();
        DualProgram { context: self.context, parts: &self.parts, texts, as_cut: held_as_cut(&scenes, self.before) }
    }

    /// Returns the report on the links in the final program.
    fn links_report(&self, texts: &DualTexts) -> LinksReport {
        match &self.shortened {
            Ok(links) => LinksReport::of(links.report(&self.parts, texts)),
            Err(why) => LinksReport::not_shortened(why.clone()),
        }
    }
}

impl ProgramOfHeads<2> for TwoHeads<'_, '_> {
    type Texts = DualTexts;

    fn write(&self) -> Result<DualTexts, Failure> {
        let _writing = self.stages.start(WRITE, 0);
        write_dual_texts(self.context, &self.parts, self.settings.verify)
    }

    fn verify(&self, texts: &DualTexts) -> Result<[Verification; 2], Failure> {
        self.program(texts).verify(self.stages)
    }

    fn certify(&self, texts: &DualTexts) -> Result<[Certificates; 2], Failure> {
        self.program(texts).certify(self.stages)
    }

    fn refine(&mut self, texts: &DualTexts, lines: &BTreeSet<u32>) -> usize {
        refine(self.context, &mut self.parts, texts, lines)
    }

    fn take_back(&mut self, texts: &DualTexts, doubts: (&[Finding], &[u32]), with_all: bool) -> bool {
        let Ok(links) = &mut self.shortened else { return false };
        links.take_back(&mut self.parts, texts, doubts, with_all)
    }

    fn check_feeds(&self, texts: &DualTexts, runs: Option<&[Verification; 2]>) -> Result<(), Failure> {
        check_feeds(self.context.scenes[0].job, &texts.timed, runs.map(|[first, _]| first))
    }

    fn cut(
        &self,
        texts: &DualTexts,
        runs: Option<&mut [Verification; 2]>,
    ) -> Result<(CutByPlan, Option<String>), Failure> {
        match runs {
            Some(runs) => {
                let program = self.program(texts);
                let heads = [program.cutting_head(0), program.cutting_head(1)];
                cut_by_heads(&program.read()?, heads, self.before, runs.each_mut(), self.stages)
            }
            None => Ok(((PlannedStockReport::not_requested(false), None), None)),
        }
    }
}

/// Plans an operation that one head machines with the other at home.
fn alone<'a>(
    context: &TwoHeadContext<'a>,
    head: usize,
    index: usize,
    at: &mut Option<AxisValues>,
    picture: &mut Option<String>,
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<(PlannedOperation<'a>, ProgramPart<'a>), Failure> {
    let scene = &context.scenes[head];
    let job = scene.job;
    let operation = &job.file.operations[index];
    let cells = cells(context, operation, operation);
    let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
    let settings = [
        move_settings(context.scenes[0].job, context.scenes[0].setup, operation),
        move_settings(context.scenes[1].job, context.scenes[1].setup, operation),
    ];
    let mover = mover(context, &tests, [&settings[0], &settings[1]]);
    let (parking, from) = mover.park_other(head, *at)?;
    let mut sections = vec![section(format!("HEAD {} ALONE", head + 1), parking)];
    let context = SetupContext { scene, map: context.maps[head], added: AddedPasses::All };
    let task = OperationTask { from, picture: picture.is_none(), ..OperationTask::alone((index, operation)) };
    let (planned, svg) = PlannedOperation::plan(&context, task, stages, clock)?;
    *picture = picture.take().or(svg);
    sections.extend(alone_sections(head, &planned.moves.pieces, &planned.moves.retract));
    *at = planned.moves.last().map(|m| m.axes).or(*at);
    let mut files = [None; 2];
    files[head] = Some(operation);
    Ok((planned, ProgramPart { files, sections, pair: None }))
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
