//! Choice of the holder in a library with the shortest stick-out that works.

use crate::lengths::lengths_file::HolderReport;
use facemill_job::failure::Failure;
use facemill_tool_model::{HolderFile, HolderLibrary, OpenAssembly};
use facemill_virtual_machine::ClearLengths;

use crate::lengths::FoundLengths;
use crate::lengths::lengths_run::{LengthsRun, is_of_bodies};

/// Holder that works.
struct Works<'a> {
    holder: &'a HolderFile,
    assembly: OpenAssembly,
    found: ClearLengths,
}

/// Largest difference of two stick-outs that count as equal, mm.
const SAME: f64 = 1e-6;

/// Tries every holder at its own shortest stick-out that is free, and chooses the one with the
/// shortest; of equal ones the widest at its nose, and of these the first by name.
///
/// If none works, reports the job's own tool with the lengths that it needs.
pub(crate) fn choose(run: &LengthsRun<'_>, library: &HolderLibrary) -> Result<FoundLengths, Failure> {
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
        Some(Works { assembly, found, .. }) => run.lengths_report(found, assembly)?,
        None => {
            let open = OpenAssembly::open(&run.scene.job.tool);
            let mut report = run.lengths_report(&run.lengths(&open, run.request.longest)?, &open)?;
            report.tool = None;
            report
        }
    };
    report.file.holder = best.map(|b| b.holder.name.clone());
    report.file.holders = reports;
    Ok(report)
}

fn is_better(a: &Works<'_>, b: &Works<'_>) -> bool {
    let (one, other) = (a.found.lengths[1], b.found.lengths[1]);
    if (one - other).abs() > SAME {
        return one < other;
    }
    let (wide, other) = (a.holder.nose_diameter(), b.holder.nose_diameter());
    if wide == other { a.holder.name < b.holder.name } else { wide > other }
}

fn tried<'a>(run: &LengthsRun<'_>, holder: &'a HolderFile) -> Result<(HolderReport, Option<Works<'a>>), Failure> {
    let mut report =
        HolderReport { name: holder.name.clone(), stick_out_mm: None, forced_by: None, finding: None, why_not: None };
    let assembly = match holder.with_tool(&run.scene.job.tool) {
        Ok(assembly) => assembly,
        Err(why) => {
            report.why_not = Some(why.to_string());
            return Ok((report, None));
        }
    };
    let most = holder.stick_out_mm[1];
    let found = run.lengths(&assembly, most)?;
    if let Some((_, by)) = &found.hopeless {
        report.why_not = Some(format!("not free up to its longest stick-out of {most} mm"));
        report.forced_by = Some(run.named(by.clone()));
        return Ok((report, None));
    }
    report.forced_by = found.forced_by[1].clone().map(|by| run.named(by));
    if found.lengths[1] > most {
        report.why_not = Some(format!("needs a stick-out of {:.2} mm, its longest is {most} mm", found.lengths[1]));
        return Ok((report, None));
    }
    if let Some(finding) = run.findings(&found)?.into_iter().find(is_of_bodies) {
        report.why_not = Some(format!("has a finding with a stick-out of {:.2} mm", found.lengths[1]));
        report.finding = Some(finding);
        return Ok((report, None));
    }
    report.stick_out_mm = Some(found.lengths[1]);
    Ok((report, Some(Works { holder, assembly, found })))
}
