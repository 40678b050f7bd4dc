//! Replanning of the job with shorter assemblies: tilting may let them pass.

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::stages::Stages;
use facemill_nc_rewrite::lengths::{FoundLengths, LengthReport, Posting, ReplanTry};
use facemill_tool_model::{HolderLibrary, OpenAssembly, ToolAssembly};

use crate::plan::plan_setup;
use crate::plan_settings::PlanSettings;
use crate::planned::Planned;

/// Number of stick-outs to try for each holder, from its shortest toward the one that works with
/// the unchanged program.
const STEPS: u32 = 4;

/// Plans the job again with shorter assemblies of the library, the shortest first, and chooses the
/// first that plans no fewer CC points than the assembly found, and whose program has no fault.
///
/// # Errors
/// If the setup cannot be read, or the stages are cancelled.
pub fn replan_with_shorter_tools(
    job: &Job,
    setup: usize,
    library: &HolderLibrary,
    report: &mut FoundLengths,
    stages: &dyn Stages,
) -> Result<(), Failure> {
    let job = &job.for_setup(setup);
    let found = report.tool.clone().map(ToolAssembly::new).transpose();
    let found = found.map_err(|e| Failure::Internal(e.to_string()))?.unwrap_or_else(|| job.tool.clone());
    let base = planned(job, &found, setup, stages)?;
    let base_points = base.map(|p| p.report.totals.planned_points).unwrap_or_default();
    for (holder, tool) in candidates(job, library, found.stick_out())? {
        let mut tried = ReplanTry {
            holder,
            stick_out_mm: tool.stick_out(),
            planned_points: 0,
            lost_points: base_points,
            left_out: Vec::new(),
            faults: 0,
            taken: false,
            why_not: None,
        };
        let made = match planned(job, &tool, setup, stages)? {
            Ok(made) => made,
            Err(why) => {
                tried.why_not = Some(why);
                report.file.replans.push(tried);
                continue;
            }
        };
        tried.planned_points = made.report.totals.planned_points;
        tried.lost_points = base_points.saturating_sub(tried.planned_points);
        tried.left_out.clone_from(&made.report.infeasible);
        tried.faults = made.report.findings.iter().filter(|f| f.kind.is_fault()).count();
        tried.taken = tried.lost_points == 0 && made.is_clean();
        let taken = tried.taken;
        report.file.replans.push(tried);
        if taken {
            take(report, tool, made);
            return Ok(());
        }
    }
    Ok(())
}

/// Returns a plan of the job with another tool, or the reason why it cannot be planned under its
/// own terms.
pub(crate) fn planned(
    job: &Job,
    tool: &ToolAssembly,
    setup: usize,
    stages: &dyn Stages,
) -> Result<Result<Planned, String>, Failure> {
    let job = Job { tool: tool.clone(), ..job.clone() };
    match plan_setup(&job, setup, PlanSettings { verify: true, certificates: false }, stages) {
        Ok(planned) => Ok(Ok(planned)),
        Err(Failure::Infeasible(why)) => Ok(Err(why)),
        Err(failure) => Err(failure),
    }
}

/// Returns assemblies of the library with a shorter stick-out, the shortest first; of equal ones
/// the widest at its nose.
fn candidates(job: &Job, library: &HolderLibrary, below: f64) -> Result<Vec<(String, ToolAssembly)>, Failure> {
    let mut all = Vec::new();
    for holder in library.holders() {
        let Ok(open) = holder.with_tool(&job.tool) else { continue };
        let mut least = [0.0; 4];
        open.rest(&mut least);
        let most = below.min(holder.stick_out_mm[1]);
        for step in 0..STEPS {
            let mut lengths = least;
            lengths[1] += (most - least[1]) * f64::from(step) / f64::from(STEPS);
            if lengths[1] >= below || lengths[1] > holder.stick_out_mm[1] {
                continue;
            }
            open.rest(&mut lengths);
            let tool = open.built(&lengths).map_err(|e| Failure::Internal(e.to_string()))?.tool;
            all.push((holder, tool));
        }
    }
    all.sort_by(|(a, one), (b, other)| {
        let by_length = one.stick_out().total_cmp(&other.stick_out());
        by_length.then(b.nose_diameter().total_cmp(&a.nose_diameter())).then(a.name.cmp(&b.name))
    });
    all.dedup_by(|a, b| a.0.name == b.0.name && a.1 == b.1);
    Ok(all.into_iter().map(|(holder, tool)| (holder.name.clone(), tool)).collect())
}

fn take(report: &mut FoundLengths, tool: ToolAssembly, made: Planned) {
    let file = tool.to_file();
    report.file.holder = report.file.replans.last().map(|t| t.holder.clone());
    report.file.posting = Posting::Again;
    report.file.none_is_free = None;
    report.file.certificates = None;
    report.file.findings = made.report.findings.clone();
    for length in &mut report.file.lengths {
        update_length(length, &tool);
    }
    report.tool = Some(file);
    report.file.replanned_blake3 = made.report.programs.first().map(|program| program.blake3.clone());
    report.replanned = made.files.into_iter().find(|(name, _)| name.starts_with("program") && !name.ends_with(".apt"));
}

/// Updates a length of the assembly of the new plan: the old program no longer forces it.
fn update_length(length: &mut LengthReport, tool: &ToolAssembly) {
    let lengths = OpenAssembly::open(tool).lengths();
    length.length_mm = lengths[length.name as usize];
    length.forced_by = None;
    length.rests_on = Some("the stick-out that the job was planned again with");
}
