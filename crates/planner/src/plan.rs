//! Complete plan of one setup: path, postures, moves, text, verification, report.

use std::collections::BTreeSet;

use facemill_job::check::post_probe::try_template;
use facemill_job::failure::Failure;
use facemill_job::format::made_from::MadeFrom;
use facemill_job::format::report::links::LinksReport;
use facemill_job::format::report::stock::{PlannedStockReport, not_requested};
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::load::open_meshes::open_stock;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{READ, Stages, TIMES, WRITE};
use facemill_virtual_machine::{
    Assumption, Certificates, Finding, HeldAsCut, Verification, merge_findings, rapid_lines,
};

use crate::dual::plan::plan_dual_setup;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::operation::PlannedOperation;
use crate::passes::setup_context::SetupContext;
use crate::plan_settings::PlanSettings;
use crate::plan_stages::stages_of;
use crate::plan_stock::{CutByPlan, StockBefore, StockToCut};
use crate::planned::{Planned, name_parts, planned_files};
use crate::program::cut_stock::{cut_by_heads, held_as_cut, stock_of_links};
use crate::program::output::{OwnProgram, Texts, check_feeds, time_texts, write_draft, write_texts};
use crate::program::planned_links::PlannedLinks;
use crate::program::planned_turns::{doubted_turns, replace_by_links, turns_report};
use crate::program::refinement::refine;
use crate::program::rounds::{ProgramOfHeads, VerifiedProgram, verified_program};
use crate::program::timing::control_assumption;
use crate::program::width_rounds::best_round;
use crate::report::chip_files::ChipFiles;
use crate::report::efficiencies::efficiencies;
use crate::report::left_above::{left_above, something_to_cut};
use crate::report::pass_files::pass_files;
use crate::report::reporting::report;
use crate::report::rotary_reversals::RotaryReversals;
use crate::stage_clock::Clock;

/// Plans one setup of a job. Its program is tested against the initial stock;
/// [`plan_job`](crate::plan_job::plan_job) cuts it.
///
/// # Errors
/// If the input is wrong, the job cannot be planned under its own terms, or the stages are
/// cancelled.
pub fn plan_setup(job: &Job, index: usize, settings: PlanSettings, stages: &dyn Stages) -> Result<Planned, Failure> {
    planned_setup(job, index, settings, None, stages)
}

/// Plans one setup of a job, and cuts its stock if the program is verified and there is stock.
pub(crate) fn planned_setup(
    job: &Job,
    index: usize,
    settings: PlanSettings,
    stock: Option<&StockToCut<'_>>,
    stages: &dyn Stages,
) -> Result<Planned, Failure> {
    if job.second.is_some() {
        return plan_dual_setup(job, index, settings, stock, stages);
    }
    let mut clock = Clock::new();
    stages.expect(stages_of(job, index, settings, stock.is_some()));
    let reading = stages.start(READ, 0);
    let made_from = MadeFrom::of(job);
    let setup = Setup::read(job, index)?;
    check_winding(job, &setup, index)?;
    let map = z_map(&setup)?;
    let scene = Scene::new(job, &setup, index)?;
    try_template(job, &setup, &scene.words)?;
    drop(reading);
    clock.lap("read");
    let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::All };
    let (mut operations, picture) = best_round(&context, stages, &mut clock)?;
    something_to_cut(&setup, &operations)?;
    let to_cut = stock.filter(|_| settings.verify).ok_or_else(|| not_requested(settings.verify).to_owned());
    let (before, shortened) = match to_cut {
        Ok(stock) => {
            let before = stock.before(job, &setup)?;
            let shortened = shorten_links(&scene, &mut operations, &before, stages)?;
            (before, shortened)
        }
        Err(why) => (Err(why.clone()), Err(why)),
    };
    clock.lap("shorten links");
    let mut head = OneHead { context: &context, operations, settings, before: &before, shortened, stages };
    let VerifiedProgram { mut texts, verifications, certificates, cut: (of_stock, rest), seen, added_poses } =
        verified_program(&mut head, settings, &mut clock)?;
    let links = head.links_report(&texts);
    let operations = head.operations;
    let verification = verifications.map(|[run]| run);
    let certificates = certificates.map(|[proof]| proof);
    let timing = stages.start(TIMES, 0);
    time_texts(&scene, &mut texts)?;
    drop(timing);
    clock.lap("times");
    let rotary_reversals = RotaryReversals::of(job, &operations, &texts);
    let jobs = vec![job; operations.len()];
    let mut report =
        report(&jobs, &setup, &operations, &texts.timed, rotary_reversals, verification, certificates.as_ref());
    report.made_from = made_from;
    report.totals.mended_blocks = added_poses;
    report.stock = of_stock;
    report.links = links;
    let program = OwnProgram { scene: &scene, operations: &operations, texts: &texts, as_cut: HeldAsCut::NOTHING };
    report.assumptions = program.assumptions()?;
    report.assumptions.extend(control_assumption(job, &texts.timed));
    report.assumptions.extend(seen.map(|text| Assumption { line: None, text }));
    report.assumptions.extend(open_stock(&setup));
    report.findings = merge_findings(report.findings, &rapid_lines(&program.read()?));
    // Also for a program that is not run: meeting the job and doing no harm are different
    // questions.
    report.remaining = program.remaining(stages)?;
    report.efficiency = efficiencies(&jobs, &setup, &operations)?;
    report.left_above = operations.iter().filter_map(|o| left_above(job, &setup, o)).collect();
    clock.lap("material left");
    let chips = ChipFiles::new(&jobs, &setup.file.name, &operations, (&texts.timed, &texts.cut_lines()));
    let passes = pass_files(&jobs, &setup, &operations, &report);
    let (suffix, state) = name_parts(job, &setup, &report);
    let files = vec![
        (format!("program{suffix}{state}.{}", job.post.extension()), texts.nc.into_bytes()),
        (format!("program{suffix}{state}.apt"), texts.apt.into_bytes()),
    ];
    Ok(Planned { rest, ..planned_files(&suffix, (report, certificates), files, picture, (chips, passes), clock) })
}

/// Puts links faster than over the clearance surface into the moves; returns them, or the reason
/// why there are none.
fn shorten_links(
    scene: &Scene<'_>,
    operations: &mut [PlannedOperation<'_>],
    before: &StockBefore,
    stages: &dyn Stages,
) -> Result<Result<PlannedLinks, String>, Failure> {
    if !scene.setup.file.links.shorten {
        return Ok(Err("the job says so (links.shorten)".to_owned()));
    }
    let cut = match stock_of_links(scene, before) {
        Ok(cut) => cut,
        Err(why) => return Ok(Err(why)),
    };
    let texts = write_draft(scene, operations)?;
    let program = OwnProgram { scene, operations, texts: &texts, as_cut: HeldAsCut::NOTHING };
    let mut links = PlannedLinks::find(&program, cut, stages)?;
    links.put_in(scene, operations);
    Ok(Ok(links))
}

/// Program of a machine with one head.
struct OneHead<'r, 'a> {
    context: &'r SetupContext<'a>,
    operations: Vec<PlannedOperation<'a>>,
    settings: PlanSettings,
    before: &'r StockBefore,
    /// Faster links, or the reason why none were searched.
    shortened: Result<PlannedLinks, String>,
    stages: &'r dyn Stages,
}

impl OneHead<'_, '_> {
    fn own_program<'p>(&'p self, texts: &'p Texts) -> OwnProgram<'p> {
        let as_cut = held_as_cut(&[self.context.scene], self.before);
        OwnProgram { scene: self.context.scene, operations: &self.operations, texts, as_cut }
    }

    /// Returns the report on the links in the final program.
    fn links_report(&self, texts: &Texts) -> LinksReport {
        let links = match &self.shortened {
            Ok(links) => LinksReport::of(links.report(&self.operations, texts)),
            Err(why) => LinksReport::not_shortened(why.clone()),
        };
        LinksReport { turns: turns_report(&self.operations, &texts.timed), ..links }
    }
}

impl ProgramOfHeads<1> for OneHead<'_, '_> {
    type Texts = Texts;

    fn write(&self) -> Result<Texts, Failure> {
        let _writing = self.stages.start(WRITE, 0);
        write_texts(self.context.scene, &self.operations, self.settings.verify)
    }

    fn verify(&self, texts: &Texts) -> Result<[Verification; 1], Failure> {
        Ok([self.own_program(texts).verify(self.stages)?])
    }

    fn certify(&self, texts: &Texts) -> Result<[Certificates; 1], Failure> {
        Ok([self.own_program(texts).certify(self.stages)?])
    }

    fn refine(&mut self, texts: &Texts, lines: &BTreeSet<u32>) -> usize {
        refine(self.context, &mut self.operations, &texts.cut_blocks_at(lines))
    }

    fn take_back(&mut self, texts: &Texts, doubts: (&[Finding], &[u32]), with_all: bool) -> bool {
        // Found before any move changes its index.
        let turns = doubted_turns(&self.operations, texts, doubts, with_all);
        let links = self.shortened.as_mut().ok();
        let changes_links = links.is_some_and(|links| links.take_back(&mut self.operations, texts, doubts, with_all));
        replace_by_links(&mut self.operations, turns) || changes_links
    }

    fn check_feeds(&self, texts: &Texts, runs: Option<&[Verification; 1]>) -> Result<(), Failure> {
        check_feeds(self.context.scene.job, &texts.timed, runs.map(|[run]| run))
    }

    fn cut(&self, texts: &Texts, runs: Option<&mut [Verification; 1]>) -> Result<(CutByPlan, Option<String>), Failure> {
        let Some([found]) = runs else { return Ok(((PlannedStockReport::not_requested(false), None), None)) };
        let program = self.own_program(texts);
        cut_by_heads(&program.read()?, [program.cutting_head()], self.before, [found], self.stages)
    }
}
