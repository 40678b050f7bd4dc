//! Plan of a setup that has been read, for any number of heads, and its stages in their order.

use facemill_job::failure::Failure;
use facemill_job::format::job_file::{LinkingFile, OperationFile, PairFile, PathFile, SetupFile};
use facemill_job::format::made_from::MadeFrom;
use facemill_job::format::report::links::LinksReport;
use facemill_job::format::report::stock::not_requested;
use facemill_job::load::job::Job;
use facemill_job::load::open_meshes::open_stock;
use facemill_job::stages::{
    ADDED, BETWEEN, CHIPS, CUT, DETOURS, HELP, LAY, LINKS, LOOK, MATERIAL, PICTURE, PLACES, POSTURES, READ, SHORTEN,
    STOCK_BEFORE, Stages, TIMES, WRITE,
};
use facemill_verification::remaining::Remaining;
use facemill_virtual_machine::{Assumption, HeldAsCut, merge_findings, rapid_lines};

use crate::passes::operation::PlannedOperation;
use crate::plan_settings::PlanSettings;
use crate::plan_stock::{CutByPlan, StockToCut};
use crate::planned::{Planned, name_parts, planned_files, posed_passes};
use crate::program::rounds::{HeadsProgram, VerifiedProgram, shorten_links};
use crate::program::run_program::{CERTIFY_STAGES, VERIFY_STAGES};
use crate::program::timing::control_assumption;
use crate::program::width_rounds::best_round;
use crate::report::chip_files::ChipFiles;
use crate::report::cusps_kept::settle_cusps;
use crate::report::efficiencies::efficiencies;
use crate::report::left_above::{left_above, something_to_cut};
use crate::report::operation_times::operation_times;
use crate::report::pass_files::pass_files;
use crate::report::reported_heads::ReportedHeads;
use crate::report::reporting::report;
use crate::stage_clock::Clock;

/// Planning run of a setup.
pub(crate) struct PlanRun<'r> {
    pub settings: PlanSettings,
    /// Stock to cut, if the setup's is to be cut.
    pub stock: Option<&'r StockToCut<'r>>,
    pub stages: &'r dyn Stages,
    /// Checksums of the job's files, as they were before it was planned.
    pub made_from: MadeFrom,
    pub clock: Clock,
}

impl PlanRun<'_> {
    /// Plans a setup: its operations, faster links, and the verified program with the report.
    ///
    /// # Errors
    /// As [`plan_setup`](crate::plan::plan_setup).
    pub(crate) fn plan<'a, H: ReportedHeads<'a, N>, const N: usize>(self, heads: &H) -> Result<Planned, Failure> {
        let Self { settings, stock, stages, made_from, mut clock } = self;
        let scenes = heads.scenes();
        let (job, setup) = (scenes[0].job, scenes[0].setup);
        let (mut moves, picture) = best_round(heads, stages, &mut clock)?;
        something_to_cut(setup, H::operations(&moves))?;
        let to_cut = stock.filter(|_| settings.verify).ok_or_else(|| not_requested(settings.verify).to_owned());
        let (before, links) = match to_cut {
            Ok(stock) => {
                let before = stock.before(job, setup)?;
                let links = shorten_links(heads, &mut moves, &before, stages)?;
                (before, links)
            }
            Err(why) => (Err(why.clone()), Err(why)),
        };
        clock.lap("shorten links");
        let mut program = HeadsProgram { heads, moves, settings, before: &before, links, stages };
        let VerifiedProgram { mut texts, verifications, certificates, cut, seen, added_poses } =
            program.verified(&mut clock)?;
        let HeadsProgram { mut moves, links, .. } = program;
        H::complete(&mut moves);
        let links_report = LinksReport {
            turns: heads.turns(&moves, &texts),
            ..match &links {
                Ok(links) => LinksReport::of(H::report_links(links, &moves, &texts)),
                Err(why) => LinksReport::not_shortened(why.clone()),
            }
        };
        let timing = stages.start(TIMES, 0);
        heads.time(&mut texts)?;
        drop(timing);
        clock.lap("times");
        let operations: &[PlannedOperation<'_>] = H::operations(&moves);
        let heads_of = H::heads_of(&moves);
        let jobs: Vec<&Job> = heads_of.iter().map(|&h| scenes[h].job).collect();
        let verification = verifications.map(|runs| H::merged_run(runs, &moves));
        let certificates = certificates.map(H::merged_proof);
        let rotary_reversals = heads.rotary_reversals(&moves, &texts);
        let timed = H::timed(&texts);
        let mut report = report(&jobs, setup, operations, timed, rotary_reversals, verification, certificates.as_ref());
        heads.add_pairs(&mut report, &moves, &texts, links.as_ref().ok());
        report.made_from = made_from;
        report.totals.mended_blocks = added_poses;
        let CutByPlan { report: of_stock, removals, rest } = cut;
        report.stock = of_stock;
        report.stock.planned_on = setup.planning_stock.to_string();
        report.links = links_report;
        let program = heads.program(&moves, &texts, HeldAsCut::NOTHING);
        report.operations = operation_times(&program.sections[0], timed, removals.as_deref());
        report.assumptions = program.assumptions()?;
        report.assumptions.extend(control_assumption(job, timed));
        report.assumptions.extend(seen.map(|text| Assumption { line: None, text }));
        report.assumptions.extend(open_stock(setup));
        report.findings = merge_findings(report.findings, &rapid_lines(&program.read()?));
        // Also for a program that is not run: meeting the job and doing no harm are different
        // questions.
        let remaining = program.remaining(stages)?;
        let mut open_regions = Vec::new();
        if let Some(remaining) = &remaining {
            let cusps = settle_cusps(&mut report, operations, remaining, (job, setup))?;
            open_regions = remaining.open_regions(cusps);
        }
        let left = remaining.as_ref().map(|r| r.by_line.clone());
        report.remaining = remaining.as_ref().map(|r| r.report.clone());
        let sweeps = remaining.map(Remaining::into_sweeps);
        report.efficiency = efficiencies(&jobs, setup, operations)?;
        let of_heads = operations.iter().zip(&heads_of);
        report.left_above = of_heads.filter_map(|(o, &h)| left_above(scenes[h].job, scenes[h].setup, o)).collect();
        clock.lap("material left");
        let chips = ChipFiles::new(&jobs, &setup.file.name, operations, (timed, &H::cut_lines(&moves, &texts)));
        let passes = pass_files(&jobs, setup, operations, &report);
        let (suffix, state) = name_parts(job, setup, &report);
        let spec = H::spec(&texts).filter(|_| job.clampings().iter().any(|(_, of)| of.len() > 1)).cloned();
        let files = heads.files(texts, &suffix, state)?;
        let posed = posed_passes(operations);
        Ok(Planned {
            rest,
            left,
            posed,
            spec,
            open_regions,
            sweeps,
            ..planned_files(&suffix, (report, certificates), files, picture, (chips, passes), clock)
        })
    }
}

/// Returns whether turns of both heads are sought between the passes of a pair.
fn turns_by_both(job: &Job, setup: &SetupFile, pair: &PairFile) -> bool {
    let is_zigzag = |o: &OperationFile| matches!(&o.path, PathFile::Strategy(s) if s.linking == LinkingFile::Zigzag);
    let mut of_pair = job.operations_of(setup).filter(|(_, o)| o.name == pair.first || o.name == pair.second);
    setup.links.turns && of_pair.all(|(_, o)| is_zigzag(o))
}

/// Returns the stages of one setup's plan, without those of further rounds of laying.
pub(crate) fn stages_of(job: &Job, index: usize, settings: PlanSettings, has_stock: bool) -> Vec<&'static str> {
    let setup = &job.file.setups[index];
    let cuts = has_stock && settings.verify;
    // Of one head alone, or of each of two.
    let of_heads = |names: [&'static str; 3]| if job.second.is_some() { names[1..].to_vec() } else { vec![names[0]] };
    let mut stages = vec![READ];
    stages.extend((job.second.is_none()).then_some(STOCK_BEFORE));
    for (k, (_, operation)) in job.operations_of(setup).enumerate() {
        stages.extend([LAY, POSTURES, DETOURS]);
        // Passes of a file are cut unchanged.
        stages.extend(matches!(operation.path, PathFile::Strategy(_)).then_some(ADDED));
        stages.extend(operation.pattern.is_some().then_some(PLACES));
        stages.push(BETWEEN);
        stages.extend((k == 0).then_some(PICTURE));
        stages.extend([LINKS, CHIPS, HELP]);
        if let Some(pair) = job.file.pairs.iter().find(|pair| pair.second == operation.name) {
            stages.extend(["both heads", "left beside both heads", "left for both heads"]);
            stages.extend(turns_by_both(job, setup, pair).then_some("turns of both heads"));
            stages.extend([ADDED, BETWEEN, "left for both heads"]);
            stages.extend(["left for one head", CHIPS, "left for one head", CHIPS]);
        }
    }
    stages.extend((cuts && setup.links.shorten).then_some(SHORTEN));
    stages.push(WRITE);
    stages.extend(settings.verify.then(|| of_heads(VERIFY_STAGES)).into_iter().flatten());
    stages.extend(settings.certificates.then(|| of_heads(CERTIFY_STAGES)).into_iter().flatten());
    stages.extend((cuts && job.file.verification.cut_stock).then_some([CUT, LOOK]).into_iter().flatten());
    stages.extend([TIMES, MATERIAL]);
    stages
}
