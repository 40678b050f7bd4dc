//! Choice of the holder in a library with the shortest stick-out that works.

use crate::lengths::lengths_file::HolderReport;
use facemill_job::failure::Failure;
use facemill_tool_model::{AssemblyLength, HolderFile, HolderLibrary, OpenAssembly};

use crate::lengths::FoundLengths;
use crate::lengths::joint::{Joint, JointLengths};
use crate::lengths::lengths_run::is_of_bodies;

/// Holder that works.
struct Works<'a> {
    holder: &'a HolderFile,
    assembly: OpenAssembly,
    found: JointLengths,
}

/// Largest difference of two stick-outs that count as equal, mm.
const SAME: f64 = 1e-6;

/// Tries every holder at its own shortest stick-out that is free, and chooses the one with the
/// shortest; of equal ones the widest at its nose, and of these the first by name.
///
/// If none works, reports the job's own tool with the lengths that it needs.
pub(crate) fn choose(run: &Joint<'_, '_>, library: &HolderLibrary) -> Result<FoundLengths, Failure> {
    let mut reports = Vec::new();
    let mut best: Option<Works<'_>> = None;
    for holder in library.holders() {
        let (report, works) = tried(run, holder)?;
        reports.push(report);
        if let Some(works) = works.filter(|w| best.as_ref().is_none_or(|b| is_better(w, b))) {
            best = Some(works);
        }
    }
    let mut report = match &best {
        Some(Works { assembly, found, .. }) => run.report(found, assembly)?,
        None => {
            let first = &run.runs[0];
            let open = OpenAssembly::open(&first.scene.job.tool);
            let mut report = run.report(&run.lengths(&open, first.request.longest)?, &open)?;
            report.tool = None;
            report
        }
    };
    report.file.holder = best.map(|b| b.holder.name.clone());
    report.file.holders = reports;
    Ok(report)
}

fn is_better(a: &Works<'_>, b: &Works<'_>) -> bool {
    let (one, other) = (a.found.lengths()[1], b.found.lengths()[1]);
    if (one - other).abs() > SAME {
        return one < other;
    }
    let (wide, other) = (a.holder.nose_diameter(), b.holder.nose_diameter());
    if wide == other { a.holder.name < b.holder.name } else { wide > other }
}

fn tried<'a>(run: &Joint<'_, '_>, holder: &'a HolderFile) -> Result<(HolderReport, Option<Works<'a>>), Failure> {
    let mut report = HolderReport {
        name: holder.name.clone(),
        stick_out_mm: None,
        setup: None,
        forced_by: None,
        finding: None,
        why_not: None,
    };
    let assembly = match holder.with_tool(&run.runs[0].scene.job.tool) {
        Ok(assembly) => assembly,
        Err(why) => {
            report.why_not = Some(why.to_string());
            return Ok((report, None));
        }
    };
    let most = holder.stick_out_mm[1];
    let found = run.lengths(&assembly, most)?;
    if let Some((k, (_, by))) = found.hopeless() {
        report.why_not = Some(format!("not free up to its longest stick-out of {most} mm"));
        report.setup = run.setup_of(k);
        report.forced_by = Some(run.runs[k].named(by.clone()));
        return Ok((report, None));
    }
    if let Some((k, by)) = found.forced_by(AssemblyLength::StickOut) {
        report.setup = run.setup_of(k);
        report.forced_by = Some(run.runs[k].named(by.clone()));
    }
    let stick_out = found.lengths()[1];
    if stick_out > most {
        report.why_not = Some(format!("needs a stick-out of {stick_out:.2} mm, its longest is {most} mm"));
        return Ok((report, None));
    }
    if let Some((setup, finding)) = run.findings(&found)?.into_iter().find(|(_, finding)| is_of_bodies(finding)) {
        report.why_not = Some(format!("has a finding with a stick-out of {stick_out:.2} mm"));
        // A place that forces it is of another program, perhaps.
        report.forced_by = report.forced_by.filter(|_| report.setup == setup);
        (report.setup, report.finding) = (setup, Some(finding));
        return Ok((report, None));
    }
    report.stick_out_mm = Some(stick_out);
    Ok((report, Some(Works { holder, assembly, found })))
}
