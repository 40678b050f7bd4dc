//! Options and result of a planning run.

use facemill_job::files::REJECTED;
use facemill_job::format::incomplete::{incomplete_at_end, incomplete_because};
use facemill_job::format::job_report::LeftAtEnd;
use facemill_job::format::program_stamp::{programs_among, stamp_apt, stamped_svg};
use facemill_job::format::report::Report;
use facemill_job::format::report::outcome::Outcome;
use facemill_job::load::job::{Job, Setup};
use facemill_job::validate::setup_names::file_stem;
use facemill_nc_program::ProgramSpec;
use facemill_tool_path::segments::PassSegment;
use facemill_verification::remaining::open_regions::OpenRegion;
use facemill_verification::remaining::{LeftByLine, ProgramSweeps};
use facemill_virtual_machine::Certificates;
use facemill_z_map::DexelMap;

use crate::passes::operation::PlannedOperation;
use crate::program::output::certificates_json;
use crate::report::chip_files::ChipFiles;
use crate::report::pass_files::PassFiles;
use crate::stage_clock::Clock;

/// A planned setup: files to be written and the report on them.
pub struct Planned {
    /// Names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// Name and content of a table of the chips at all CC points, which is optional output.
    pub chip_table: (String, Vec<u8>),
    /// The report; it is one of the files, too.
    pub report: Report,
    /// Rest of the stock after the program, if the stock was cut.
    pub rest: Option<DexelMap>,
    /// Heights that the written program leaves beside its blocks, if they were measured.
    pub left: Option<LeftByLine>,
    /// Postures of the passes, of which maps can be made ([`posture_maps`](crate::posture_maps)).
    pub posed: Vec<PosedPass>,
    /// Specification that the program is written from, of a job with several tools.
    pub spec: Option<ProgramSpec>,
    /// Operations whose limits this program does not keep, with what is left on their regions after
    /// all programs of the job that were planned with it.
    pub left_at_end: Vec<LeftAtEnd>,
    /// Regions of these operations, for later programs.
    pub(crate) open_regions: Vec<OpenRegion>,
    /// All that the program cuts, until the regions of those before it are lowered.
    pub(crate) sweeps: Option<ProgramSweeps>,
    /// Wall time of each stage, s; not deterministic.
    pub timings: Vec<(&'static str, f64)>,
}

/// Piece of a pass in a place of the pattern, with its tested postures.
#[derive(Clone, Debug)]
pub struct PosedPass {
    /// Name of the operation.
    pub operation: String,
    /// The piece.
    pub(crate) piece: PassSegment,
}

impl Planned {
    /// Returns the outcome of the plan.
    pub fn outcome(&self) -> Outcome {
        if self.report.findings.iter().any(|f| f.kind.is_fault()) {
            Outcome::Faulty
        } else if !incomplete_because(&self.report).is_empty() {
            Outcome::Incomplete
        } else {
            Outcome::Done
        }
    }

    /// Returns the reasons why it does less than the job requires, after all programs of the job,
    /// in words.
    pub fn incomplete_at_end(&self) -> Vec<String> {
        incomplete_at_end(&self.report, &self.left_at_end)
    }

    /// Returns the outcome of the plan after all programs of the job: limits that later programs
    /// keep are kept.
    pub fn outcome_at_end(&self) -> Outcome {
        match self.outcome() {
            Outcome::Incomplete if self.incomplete_at_end().is_empty() => Outcome::Done,
            outcome => outcome,
        }
    }

    /// Returns name and text of its program, the first one of two heads.
    pub fn program(&self) -> Option<(&str, &[u8])> {
        let name = &self.report.programs.first()?.file;
        self.files.iter().find(|(file, _)| file == name).map(|(name, text)| (name.as_str(), text.as_slice()))
    }

    /// Returns the program with its file, if it has no faults: nobody runs another one, and setups
    /// behind it meet the stock that it would cut.
    pub fn program_to_run(&self) -> Option<(&str, &[u8])> {
        self.program().filter(|(name, _)| !name.contains(REJECTED))
    }

    /// Returns whether the program can be run as it is and meets the job.
    pub fn is_clean(&self) -> bool {
        self.outcome() == Outcome::Done
    }
}

/// Returns the variable parts of the names of a setup's files: for all files the setup's name, if
/// there are several setups; for programs a mark if they have faults, so that no one takes them for
/// programs to run.
pub(crate) fn name_parts(job: &Job, setup: &Setup<'_>, report: &Report) -> (String, &'static str) {
    let suffix = if job.file.setups.len() > 1 { format!("-{}", file_stem(&setup.file.name)) } else { String::new() };
    let state = if report.findings.iter().any(|f| f.kind.is_fault()) { REJECTED } else { "" };
    (suffix, state)
}

/// Returns a planned setup: its programs with their certificates, report, passes and pictures.
pub(crate) fn planned_files(
    suffix: &str,
    (mut report, certificates): (Report, Option<Certificates>),
    mut files: Vec<(String, Vec<u8>)>,
    picture: Option<String>,
    (chips, passes): (ChipFiles, Vec<PassFiles>),
    clock: Clock,
) -> Planned {
    let programs = programs_among(&files);
    stamp_apt(&mut files, &programs);
    let certificates = certificates.map(|c| certificates_json(programs.clone(), c));
    files.extend(certificates.map(|json| (format!("certificates{suffix}.json"), json)));
    let chips = chips.of(&programs);
    report.programs.clone_from(&programs);
    files.push((format!("report{suffix}.json"), facemill_file_format::to_json(&report).into_bytes()));
    files.extend(picture.map(|svg| (format!("solution-space{suffix}.svg"), stamped_svg(svg, &programs).into_bytes())));
    files.push((format!("chips{suffix}.svg"), chips.svg.into_bytes()));
    for PassFiles { number, path, picture } in passes {
        files.push((format!("passes{suffix}{number}.json"), path.into_bytes()));
        files.push((format!("passes{suffix}{number}.svg"), stamped_svg(picture, &programs).into_bytes()));
    }
    let chip_table = (format!("chips{suffix}.csv"), chips.csv.into_bytes());
    Planned {
        files,
        chip_table,
        report,
        rest: None,
        left: None,
        posed: Vec::new(),
        spec: None,
        left_at_end: Vec::new(),
        open_regions: Vec::new(),
        sweeps: None,
        timings: clock.laps,
    }
}

/// Returns the pieces of all operations, in the order of the program.
pub(crate) fn posed_passes(operations: &[PlannedOperation<'_>]) -> Vec<PosedPass> {
    let of = |o: &PlannedOperation<'_>| {
        let pieces = o.moves.pieces.iter().map(|moves| moves.piece.clone());
        pieces.map(|piece| PosedPass { operation: o.operation.name.clone(), piece }).collect::<Vec<_>>()
    };
    operations.iter().flat_map(of).collect()
}
