//! Complete plan of one setup: path, postures, moves, text, verification, report.

use facemill_job::check::post_probe::try_template;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::LinkStockFile;
use facemill_job::format::made_from::MadeFrom;
use facemill_job::format::report::links::LinksReport;
use facemill_job::format::report::stock::{PlannedStockReport, not_asked};
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::load::open_meshes::open_stock;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::word_map::word_map;
use facemill_job::stages::{READ, Stages, TIMES, WRITE};
use facemill_nc_program::WordMap;
use facemill_verification::stock_run::CutRequest;
use facemill_verification::sub_cell_check::{is_cut_known, machine_as_cut, seen_between, seen_of_rest};
use facemill_virtual_machine::{Assumption, Certificates, HeldAsCut, Verification, merge_findings, rapid_lines};

use crate::dual::plan::plan_dual_setup;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::operation::{PlannedOperation, SetupContext};
use crate::plan_stages::stages_of;
use crate::plan_stock::{CutByPlan, StockBefore, StockToCut, cut_by_plan};
use crate::planned::{PlanSettings, Planned, name_parts, planned_files};
use crate::program::output::{OwnProgram, Texts, check_feeds, time_texts, write_draft, write_texts};
use crate::program::planned_links::PlannedLinks;
use crate::program::refinement::{ROUNDS, lines_to_refine, refine};
use crate::program::timing::control_assumption;
use crate::report::chip_files::ChipFiles;
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
    let words = word_map(job, &setup, index)?;
    try_template(job, &setup, &words)?;
    drop(reading);
    clock.lap("read");
    let ground = SetupContext { job, setup: &setup, map: &map, added: AddedPasses::All };
    let mut operations: Vec<PlannedOperation<'_>> = Vec::new();
    let mut picture = None;
    for operation in job.operations_of(setup.file) {
        let from = operations.last().and_then(|o| o.moves.last());
        let (planned, svg) = PlannedOperation::plan(&ground, operation, from, picture.is_none(), stages, &mut clock)?;
        picture = picture.or(svg);
        operations.push(planned);
    }
    let asked = stock.filter(|_| settings.verify).ok_or_else(|| not_asked(settings.verify).to_owned());
    let (before, shortened) = match asked {
        Ok(stock) => {
            let before = stock.before(job, &setup)?;
            let shortened = shorten_links(&ground, &mut operations, &words, &before, stages)?;
            (before, shortened)
        }
        Err(why) => (Err(why.clone()), Err(why)),
    };
    clock.lap("shorten links");
    let sound = Rounds { ground: &ground, words: &words, settings, before: &before, stages };
    let Sound { mut texts, verification, certificates, cut: (of_stock, rest), seen, mended, links } =
        sound.program(&mut operations, shortened, &mut clock)?;
    let timing = stages.start(TIMES, 0);
    time_texts(job, &words, &mut texts)?;
    drop(timing);
    clock.lap("times");
    let turning = RotaryReversals::of(job, &operations, &texts);
    let jobs = vec![job; operations.len()];
    let mut report = report(&jobs, &setup, &operations, &texts.timed, turning, verification, certificates.as_ref());
    report.made_from = made_from;
    report.totals.mended_blocks = mended;
    report.stock = of_stock;
    report.links = links;
    let program = OwnProgram {
        job,
        setup: &setup,
        operations: &operations,
        words: &words,
        texts: &texts,
        as_cut: HeldAsCut::NOTHING,
    };
    report.assumptions = program.assumptions()?;
    report.assumptions.extend(control_assumption(job, &texts.timed));
    report.assumptions.extend(seen.map(|text| Assumption { line: None, text }));
    report.assumptions.extend(open_stock(&setup));
    report.findings = merge_findings(report.findings, &rapid_lines(&program.read()?));
    // Also for a program that is not run: meeting the job and doing no harm are different
    // questions.
    report.remaining = program.remaining(stages)?;
    clock.lap("material left");
    let chips = ChipFiles::new(&jobs, &setup.file.name, &operations, (&texts.timed, &texts.cut_lines()));
    let (suffix, state) = name_parts(job, &setup, &report);
    let files = vec![
        (format!("program{suffix}{state}.{}", job.post.extension()), texts.nc.into_bytes()),
        (format!("program{suffix}{state}.apt"), texts.apt.into_bytes()),
    ];
    Ok(Planned { rest, ..planned_files(&suffix, (report, certificates), files, picture, chips, clock) })
}

/// Puts links faster than over the clearance surface into the moves; returns them, or the reason
/// why there are none.
fn shorten_links(
    SetupContext { job, setup, .. }: &SetupContext<'_>,
    operations: &mut [PlannedOperation<'_>],
    words: &WordMap,
    before: &StockBefore,
    stages: &dyn Stages,
) -> Result<Result<PlannedLinks, String>, Failure> {
    if !setup.file.links.shorten {
        return Ok(Err("the job says so (links.shorten)".to_owned()));
    }
    let cut = match (setup.file.links.stock, before) {
        (LinkStockFile::AtFirst, _) => None,
        (LinkStockFile::AsCut, Ok((stock, _))) => Some((stock.clone(), job.file.verification.stock_tolerance_mm)),
        (LinkStockFile::AsCut, Err(why)) => return Ok(Err(format!("the stock is not cut: {why}"))),
    };
    let texts = write_draft(job, setup, operations, words)?;
    let program = OwnProgram { job, setup, operations, words, texts: &texts, as_cut: HeldAsCut::NOTHING };
    let mut links = PlannedLinks::find(&program, cut, stages)?;
    links.put_in(operations);
    Ok(Ok(links))
}

/// Data for writing, running, refining and cutting a program.
struct Rounds<'r, 'a> {
    ground: &'r SetupContext<'a>,
    words: &'r WordMap,
    settings: PlanSettings,
    before: &'r StockBefore,
    stages: &'r dyn Stages,
}

/// Program with all results on it.
struct Sound {
    texts: Texts,
    verification: Option<Verification>,
    certificates: Option<Certificates>,
    cut: CutByPlan,
    /// Description of the check between the lines of the cut stock, if the plan depends on them.
    seen: Option<String>,
    mended: usize,
    links: LinksReport,
}

impl Rounds<'_, '_> {
    /// Returns which bodies are tested only against the stock at that time: if links may go through
    /// cut regions, tool and rapids, by its lines; and bodies of the machine, if all its possible
    /// remains are known.
    fn as_cut(&self) -> HeldAsCut {
        let SetupContext { job, setup, .. } = self.ground;
        let (Ok((stock, began_as)), LinkStockFile::AsCut) = (self.before, setup.file.links.stock) else {
            return HeldAsCut::NOTHING;
        };
        let (cell, tolerance) = (stock.grid().cell(), job.file.verification.stock_tolerance_mm);
        HeldAsCut { tool: true, machine: began_as.is_own() && is_cut_known(&[&job.tool], cell, tolerance) }
    }
}

/// Number of rounds in which links with findings get their old paths back before all of them do.
const LINK_ROUNDS: usize = 3;

impl Rounds<'_, '_> {
    /// Writes the program until no block needs refinement and no faster link has a finding.
    fn program(
        &self,
        operations: &mut [PlannedOperation<'_>],
        mut shortened: Result<PlannedLinks, String>,
        clock: &mut Clock,
    ) -> Result<Sound, Failure> {
        let SetupContext { job, setup, .. } = self.ground;
        let (mut mended, mut round) = (0, 0);
        loop {
            round += 1;
            let (texts, mut verification, certificates) = self.mended(operations, &mut mended, clock)?;
            let certified = certificates.iter().flat_map(|c| &c.certificates);
            let open: Vec<u32> = certified.filter(|c| !c.certified).map(|c| c.line).collect();
            let mut take_back = |run: Option<&Verification>, operations: &mut [PlannedOperation<'_>]| {
                let Some((links, run)) = shortened.as_mut().ok().zip(run) else { return false };
                links.take_back(operations, &texts, (&run.findings, &open), round == LINK_ROUNDS)
            };
            if take_back(verification.as_ref(), operations) {
                continue;
            }
            check_feeds(job, &texts.timed, verification.as_ref())?;
            let program =
                OwnProgram { job, setup, operations, words: self.words, texts: &texts, as_cut: self.as_cut() };
            let tolerance = job.file.verification.stock_tolerance_mm;
            let cut_stock = |request: &CutRequest| program.cut_stock(request, self.stages);
            let cut = verification
                .as_mut()
                .map(|found| cut_by_plan(self.before, tolerance, ([found], program.as_cut.tool), cut_stock));
            let cut = cut.unwrap_or_else(|| Ok((PlannedStockReport::not_asked(false), None)))?;
            let mut seen = None;
            if let (Some(report), Some(found)) = (&cut.0.cut, verification.as_mut()) {
                match (program.as_cut.tool, cut.0.began_as_own()) {
                    (true, true) => {
                        program.between_lines(report, found, self.stages)?;
                        seen = Some(seen_between(&[&job.tool], report.cell_mm, report.tolerance_mm));
                    }
                    (true, false) => seen = Some(seen_of_rest(report.cell_mm)),
                    (false, true) if program.hold_machine_as_cut(report, found, self.stages)? => {
                        seen = Some(machine_as_cut(report.cell_mm, report.tolerance_mm));
                    }
                    (false, _) => {}
                }
            }
            clock.lap("cut the stock");
            if take_back(verification.as_ref(), operations) {
                continue;
            }
            // Faults that the cut stock has removed hid the times.
            check_feeds(job, &texts.timed, verification.as_ref())?;
            let links = match shortened {
                Ok(links) => LinksReport::of(links.report(operations, &texts)),
                Err(why) => LinksReport::not_shortened(why),
            };
            return Ok(Sound { texts, verification, certificates, cut, seen, mended, links });
        }
    }

    fn written(&self, operations: &[PlannedOperation<'_>], clock: &mut Clock) -> Result<Written, Failure> {
        let (SetupContext { job, setup, .. }, words, settings) = (self.ground, self.words, self.settings);
        let writing = self.stages.start(WRITE, 0);
        let texts = write_texts(job, setup, operations, words, settings.verify)?;
        drop(writing);
        clock.lap("program");
        let program = OwnProgram { job, setup, operations, words, texts: &texts, as_cut: self.as_cut() };
        let verification = if settings.verify { Some(program.verify(self.stages)?) } else { None };
        clock.lap("verify");
        let certificates = if settings.certificates { Some(program.certify(self.stages)?) } else { None };
        clock.lap("certify");
        Ok((texts, verification, certificates))
    }

    /// Writes the program until no block needs refinement, or the rounds are used up.
    fn mended(
        &self,
        operations: &mut [PlannedOperation<'_>],
        mended: &mut usize,
        clock: &mut Clock,
    ) -> Result<Written, Failure> {
        for round in 1.. {
            let (texts, verification, certificates) = self.written(operations, clock)?;
            let lines = lines_to_refine(verification.as_ref(), certificates.as_ref());
            let blocks = if round == ROUNDS { Vec::new() } else { texts.cut_blocks_at(&lines) };
            let put_in = refine(self.ground, operations, &blocks);
            clock.lap("mend");
            if put_in == 0 {
                return Ok((texts, verification, certificates));
            }
            *mended += put_in;
        }
        Err(Failure::Internal("rounds without end".to_owned()))
    }
}

/// Texts of the operations, with the results of running and proving them.
type Written = (Texts, Option<Verification>, Option<Certificates>);
