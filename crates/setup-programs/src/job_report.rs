//! Report on all programs of a job: clampings, tools and operations in their order.

use facemill_job::failure::Failure;
use facemill_job::format::incomplete::incomplete_because;
use facemill_job::format::job_file::{PoseFile, RoleFile, SetupFile};
use facemill_job::format::job_report::{
    ClampingReport, DatumReport, DatumShapeReport, JOB_REPORT_FORMAT, JobReport, PlacementReport, PoseReport,
    SecondToolReport, ToolProgramReport,
};
use facemill_job::format::program_stamp::checksum;
use facemill_job::format::report::operations::OperationReport;
use facemill_job::format::report::outcome::Outcome;
use facemill_job::format::report::stock::OWN_STOCK;
use facemill_job::frames::pose;
use facemill_job::load::job::Job;
use facemill_job::load::obstacle_meshes::datums::{Datum, DatumShape, datums};
use facemill_planner::Planned;
use nalgebra::Isometry3;

use crate::tool_changes::JoinedProgram;

/// Returns the report on a planned job with several programs; `None` for one with a single program.
///
/// # Errors
/// If the mesh of a datum cannot be read.
pub fn job_report<T>(
    job: &Job,
    planned: &[(Planned, T)],
    joined: &[JoinedProgram],
) -> Result<Option<JobReport>, Failure> {
    let setups = &job.file.setups;
    if setups.len() < 2 {
        return Ok(None);
    }
    let all = job.clampings();
    let first = all.first().map(|(name, of)| (name.clone(), &setups[of.start]));
    let change = job.machine.tool_change_time();
    let mut first_datums: Option<Vec<Datum>> = None;
    let mut clampings = Vec::new();
    for (name, of) in &all {
        let at = &setups[of.start];
        let mut programs = Vec::new();
        let mut without_program = Vec::new();
        let of_clamping = joined.iter().find(|program| program.setup == *name && of.len() > 1);
        for k in of.clone() {
            match planned.iter().map(|(planned, _)| planned).find(|p| p.report.setup == setups[k].name) {
                Some(planned) => programs.push(tool_program(job, k, planned, of_clamping)),
                None => without_program.push(setups[k].name.clone()),
            }
        }
        let changes = tool_changes(&programs) as f64 * change.unwrap_or(0.0);
        let (joined_program, joined_blake3, not_joined_because) = match of_clamping {
            Some(JoinedProgram { name, joined: Ok((text, _)), .. }) => (Some(name.clone()), Some(checksum(text)), None),
            Some(JoinedProgram { joined: Err(why), .. }) => (None, None, Some(why.clone())),
            None => (None, None, None),
        };
        let first_planned = planned.iter().map(|(planned, _)| planned).find(|p| p.report.setup == at.name);
        let compared_with = first.as_ref().filter(|(first, _)| first != name);
        let own = datums(job, of.start)?;
        let datums = datum_reports(&own, first_datums.as_deref().unwrap_or(&own), at);
        first_datums.get_or_insert(own);
        clampings.push(ClampingReport {
            name: name.clone(),
            time_s: programs.iter().map(|p| p.time_s).sum::<f64>() + changes,
            placement: placement(at, compared_with.map(|(name, setup)| (name.as_str(), *setup))),
            stock: stock(at, first_planned),
            datums,
            fixtures: fixtures(at),
            joined_program,
            joined_blake3,
            not_joined_because,
            programs,
            without_program,
        });
    }
    Ok(Some(JobReport {
        format: JOB_REPORT_FORMAT.to_owned(),
        job: job.file.name.clone(),
        machine: job.machine.name().to_owned(),
        outcome: planned.iter().map(|(planned, _)| planned.outcome_at_end()).max().unwrap_or(Outcome::Done),
        incomplete_because: planned.iter().flat_map(|(planned, _)| planned.incomplete_at_end()).collect(),
        total_time_s: clampings.iter().map(|c| c.time_s).sum(),
        tool_changes: clampings.iter().map(|c| tool_changes(&c.programs)).sum(),
        tool_change_s: change,
        clampings,
        left_at_end: planned.iter().flat_map(|(planned, _)| &planned.left_at_end).cloned().collect(),
    }))
}

/// Returns a clamping's datums on the table; `first` are those of the first clamping, both in the
/// frame of the part.
fn datum_reports(own: &[Datum], first: &[Datum], setup: &SetupFile) -> Vec<DatumReport> {
    let table_from_part = pose(&setup.table_from_work) * pose(&setup.work_from_part);
    let report = |datum: &Datum| {
        let on_table = datum.moved(&table_from_part);
        let (shape, direction, radius_mm) = match on_table.shape {
            DatumShape::Plane(normal) => (DatumShapeReport::Plane, Some(normal), None),
            DatumShape::Cylinder { axis, radius } => (DatumShapeReport::Cylinder, Some(axis), Some(radius)),
            DatumShape::Other => (DatumShapeReport::Other, None, None),
        };
        DatumReport {
            file: datum.file.clone(),
            group: datum.group.clone(),
            shape,
            place_mm: rounded(on_table.place.coords.into()),
            direction: direction.map(|d| rounded(d.into_inner().into())),
            radius_mm: radius_mm.map(|r| rounded([r; 3])[0]),
            deviation_mm: rounded([datum.deviation; 3])[0],
            in_first: first.contains(datum),
        }
    };
    own.iter().map(report).collect()
}

/// Returns the number of programs that begin with another tool than the one before has.
fn tool_changes(programs: &[ToolProgramReport]) -> usize {
    programs.windows(2).filter(|pair| pair[0].tool_number != pair[1].tool_number).count()
}

fn tool_program(job: &Job, index: usize, planned: &Planned, joined: Option<&JoinedProgram>) -> ToolProgramReport {
    let report = &planned.report;
    let tool = job.for_setup(index).tool;
    let sections = joined.and_then(|program| program.joined.as_ref().ok()).map(|(_, sections)| sections);
    let section = sections.and_then(|all| all.iter().find(|section| section.setup == report.setup));
    let faults = report.findings.iter().filter(|f| f.kind.is_fault()).count();
    let is_report = |name: &&String| name.starts_with("report") && name.ends_with(".json");
    let removed: Option<Vec<f64>> = report.operations.iter().map(|o| o.removed_mm3).collect();
    ToolProgramReport {
        setup: report.setup.clone(),
        programs: report.programs.iter().map(|program| program.file.clone()).collect(),
        blake3: report.programs.first().map(|program| program.blake3.clone()),
        line_in_joined: section.map(|section| section.first_line),
        report: planned.files.iter().map(|(name, _)| name).find(is_report).cloned().unwrap_or_default(),
        tool_number: tool.number(),
        tool: tool.name().to_owned(),
        gauge_length_mm: tool.gauge_length(),
        second_tool: job.second.as_ref().map(|second| SecondToolReport {
            number: second.tool.number(),
            name: second.tool.name().to_owned(),
            gauge_length_mm: second.tool.gauge_length(),
        }),
        planned_on: report.stock.planned_on.clone(),
        time_s: report.operations.iter().map(OperationReport::time_s).sum(),
        removed_mm3: removed.map(|all| all.iter().sum()),
        verified: report.verified,
        faults,
        other_findings: report.findings.len() - faults,
        certified_blocks: report.certified.as_ref().map(|c| [c.blocks, c.certified]),
        planned_fraction: report.totals.planned_fraction,
        incomplete_because: incomplete_because(report),
        operations: report.operations.clone(),
    }
}

fn placement(setup: &SetupFile, compared_with: Option<(&str, &SetupFile)>) -> PlacementReport {
    let table_from_part = |setup: &SetupFile| pose(&setup.table_from_work) * pose(&setup.work_from_part);
    let moved_by = compared_with.map(|(_, first)| table_from_part(setup) * table_from_part(first).inverse());
    PlacementReport {
        work_offset: setup.work_offset.register.clone(),
        work_from_part: stated(&setup.work_from_part),
        table_from_work: stated(&setup.table_from_work),
        compared_with: compared_with.map(|(name, _)| name.to_owned()),
        moved_by: moved_by.as_ref().map(pose_report),
    }
}

fn stated(file: &PoseFile) -> PoseReport {
    pose_report(&pose(file))
}

/// Returns a pose in the report's form; the axis of none is z.
fn pose_report(motion: &Isometry3<f64>) -> PoseReport {
    let turn = motion.rotation.axis_angle();
    let (axis, angle) = turn.map_or(([0.0, 0.0, 1.0], 0.0), |(axis, angle)| (axis.into_inner().into(), angle));
    PoseReport {
        translation_mm: rounded(motion.translation.vector.into()),
        rotation_axis: rounded(axis),
        rotation_deg: rounded([angle.to_degrees(); 3])[0],
    }
}

/// Returns values to 1e-9. Adding 0 turns -0 into 0.
fn rounded(values: [f64; 3]) -> [f64; 3] {
    values.map(|v| (v * 1e9).round() / 1e9 + 0.0)
}

/// Returns the stock before a setup in words: as it is stated, and with what its program began.
fn stock(setup: &SetupFile, planned: Option<&Planned>) -> String {
    let by_others = setup.programs_before.len();
    let others = if by_others == 0 { String::new() } else { format!(", cut by {by_others} program(s) of other jobs") };
    let own = setup.stock.in_words() + &others;
    let Some(stock) = planned.map(|planned| &planned.report.stock) else { return own };
    match (&stock.began_as, &stock.not_cut_because) {
        (Some(began), _) if began == OWN_STOCK => own,
        (Some(began), _) => format!("{own}; {began}"),
        (None, Some(why)) => format!("{own}; nothing was cut: {why}"),
        (None, None) => own,
    }
}

fn fixtures(setup: &SetupFile) -> Vec<String> {
    let mut files: Vec<String> =
        setup.meshes.iter().filter(|mesh| mesh.role == RoleFile::Fixture).map(|mesh| mesh.file.clone()).collect();
    files.sort();
    files.dedup();
    files
}

#[cfg(test)]
#[path = "../tests/unit/job_report.rs"]
mod tests;
