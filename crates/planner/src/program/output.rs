//! Conversion of planned operations to text.

use std::collections::BTreeSet;

use facemill_cl_data::ClPoint;
use facemill_cl_file::{AptCutter, AptMove, AptSpec, write_apt};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::FeedsFile;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::report::{CERTIFICATES_FORMAT, CertificatesFile};
use facemill_job::load::job::Job;
use facemill_job::setup::cell::budget;
use facemill_job::setup::program_spec::{coolant, program_spec};
use facemill_job::setup::scene::Scene;
use facemill_job::validate::tip_feed::programmed_feed;
use facemill_nc_program::{ProgramSpec, SpindleSpec, WrittenProgram, write_program_with_lines};
use facemill_tool_model::SpindleRotation;
use facemill_tool_path::moves::MoveKind;
use facemill_verification::text_times::{ALL_LINES, TimedText};
use facemill_virtual_machine::{Certificates, GougeSection, Verification};

use crate::passes::operation::PlannedOperation;
use crate::program::BlockWriter;
use crate::program::timed::{CutBlock, Timed};
use crate::program::timing::text::time_text;
use crate::program::timing::{WrittenWords, time_program};

/// Mark in a program that was not run on the virtual machine.
pub(crate) const NOT_VERIFIED: &str = "NOT VERIFIED";

/// Texts of a setup.
pub(crate) struct Texts {
    /// Timed blocks; the program itself is in the specification.
    pub timed: Timed,
    /// Specification that the text is written from.
    pub spec: ProgramSpec,
    /// NC text.
    pub nc: String,
    /// APT text.
    pub apt: String,
    /// Line of the NC text, from 1, at which each operation begins.
    pub operation_lines: Vec<u32>,
    /// Line of the NC text of every block of the program.
    pub block_lines: Vec<u32>,
}

impl Texts {
    fn new(timed: Timed, (spec, written): (ProgramSpec, WrittenProgram), apt: String) -> Self {
        let operation_lines = timed.operation_starts.iter().map(|&block| written.block_lines[block]).collect();
        Self { timed, spec, nc: written.text, apt, operation_lines, block_lines: written.block_lines }
    }

    /// Returns the first and last line of a run of moves, each by its index among all.
    pub(crate) fn lines_of_moves(&self, [first, last]: [usize; 2]) -> [u32; 2] {
        let end = self.timed.move_blocks[last] + 1;
        let behind = self.block_lines.get(end).map_or_else(|| self.line_of_move(last), |line| line - 1);
        [self.line_of_move(first), behind.max(self.line_of_move(last))]
    }

    /// Returns the line at which a move begins.
    pub(crate) fn line_of_move(&self, index: usize) -> u32 {
        self.block_lines[self.timed.move_blocks[index]]
    }

    /// Returns the lines of all cutting moves, in program order.
    pub(crate) fn cut_lines(&self) -> Vec<u32> {
        self.timed.cut_blocks.iter().map(|b| self.block_lines[b.block]).collect()
    }

    /// Returns the blocks along passes on these lines.
    pub(crate) fn cut_blocks_at(&self, lines: &BTreeSet<u32>) -> Vec<CutBlock> {
        let on_them = |b: &&CutBlock| lines.contains(&self.block_lines[b.block]);
        self.timed.cut_blocks.iter().filter(on_them).copied().collect()
    }
}

/// Returns timed blocks, NC text and APT text; `verify` says whether the text will be run on the
/// virtual machine.
pub(crate) fn write_texts(
    scene: &Scene<'_>,
    operations: &[PlannedOperation<'_>],
    verify: bool,
) -> Result<Texts, Failure> {
    let job = scene.job;
    let mut timed = blocks(scene, operations, verify)?;
    let written = WrittenWords { job, words: &scene.words, table_from_rtcp_words: scene.written_frame()? };
    let slower = time_program(&[(&job.machine, job.tool.gauge_length())], &written, &mut timed)?;
    timed.slow_down(&slower);
    let (spec, written) = nc_text(scene, operations, &mut timed)?;
    let cutter = job.tool.cutter();
    let apt = AptSpec {
        part_name: spec.job_name.clone(),
        tool_number: spec.tool.number,
        cutter: AptCutter {
            radius: cutter.radius(),
            corner_radius: cutter.corner_radius(),
            height: cutter.flute_length(),
        },
        spindle: spec.spindle,
        coolant: spec.coolant,
        moves: apt_moves(operations, job, verify),
    };
    let apt = write_apt(&apt).map_err(|e| Failure::Internal(e.to_string()))?;
    Ok(Texts::new(timed, (spec, written), apt))
}

/// Returns the NC text with feeds that no motion law has lowered, without APT text: for questions
/// on its path.
pub(crate) fn write_draft(scene: &Scene<'_>, operations: &[PlannedOperation<'_>]) -> Result<Texts, Failure> {
    let mut timed = blocks(scene, operations, true)?;
    let text = nc_text(scene, operations, &mut timed)?;
    Ok(Texts::new(timed, text, String::new()))
}

fn blocks(scene: &Scene<'_>, operations: &[PlannedOperation<'_>], verify: bool) -> Result<Timed, Failure> {
    let mut writer = BlockWriter::new(scene)?;
    if !verify {
        writer.comment(NOT_VERIFIED.to_owned());
    }
    for o in operations {
        writer.operation(o.operation, &o.moves)?;
    }
    Ok(writer.finish())
}

fn nc_text(
    scene @ Scene { job, setup, .. }: &Scene<'_>,
    operations: &[PlannedOperation<'_>],
    timed: &mut Timed,
) -> Result<(ProgramSpec, WrittenProgram), Failure> {
    let first = operations.first().map(|o| o.operation).ok_or_else(|| Failure::Internal("no operation".to_owned()))?;
    let spec = program_spec(job, setup, first, &scene.words, &mut timed.program)?;
    let written = write_program_with_lines(&spec, &setup.post(job)).map_err(|e| job.wrong(format!("post: {e}")))?;
    Ok((spec, written))
}

/// Replaces times by those of the text.
///
/// # Errors
/// Only an internal fault.
pub(crate) fn time_texts(scene: &Scene<'_>, texts: &mut Texts) -> Result<(), Failure> {
    let job = scene.job;
    let written = TimedText {
        text: texts.nc.as_bytes(),
        dialect: job.post.dialect(),
        control: &job.post.rules().control_motion,
        rapids: job.post.rtcp_rapids().unwrap_or_default(),
        block_lines: &texts.block_lines,
        lines: ALL_LINES,
    };
    time_text(&[(scene.machine, scene.tool_length())], scene.motion_context(), &written, &mut texts.timed)
}

fn apt_moves(operations: &[PlannedOperation<'_>], job: &Job, verify: bool) -> Vec<AptMove> {
    let teeth = job.tool.n_inserts();
    let mut before: Option<&FeedsFile> = None;
    let mut moves = Vec::new();
    if !verify {
        moves.push(AptMove::Comment(NOT_VERIFIED.to_owned()));
    }
    for o in operations {
        moves.push(AptMove::Comment(o.operation.name.clone()));
        // Those of the first operation are in the header.
        let feeds = &o.operation.feeds;
        if before.is_some_and(|before| before.spindle_rpm != feeds.spindle_rpm) {
            let clockwise = job.tool.spindle_rotation() == SpindleRotation::Clockwise;
            moves.push(AptMove::Spindle(SpindleSpec { rpm: feeds.spindle_rpm, clockwise }));
        }
        if before.is_some_and(|before| before.coolant != feeds.coolant) {
            moves.push(AptMove::Coolant(coolant(feeds.coolant)));
        }
        before = Some(feeds);
        let linear = |cl: ClPoint, feed: f64| AptMove::Linear { cl, feed };
        let all = o.moves.pieces.iter().flat_map(|p| &p.moves).chain(&o.moves.retract);
        moves.extend(all.map(|m| match m.kind {
            MoveKind::Rapid => AptMove::Rapid(m.cl),
            kind => linear(m.cl, programmed_feed(&o.operation.feeds, teeth, kind, m.chip.as_ref()).mm_min),
        }));
    }
    moves
}

/// Returns the permitted depth of the cutter in each operation of a text.
pub(crate) fn gouge_sections(
    scene: &Scene<'_>,
    operations: &[PlannedOperation<'_>],
    texts: &Texts,
) -> Vec<GougeSection> {
    let section = |(o, &first_line): (&PlannedOperation<'_>, &u32)| GougeSection {
        name: o.operation.name.clone(),
        first_line,
        gouge_limit: budget(scene.job, o.operation).simulated(),
    };
    operations.iter().zip(&texts.operation_lines).map(section).collect()
}

/// Largest relative difference of the time of the written program's cuts from the planned one: F
/// words have few digits.
const SAME_TIME: f64 = 0.02;

/// Checks that the text's feeds have their planned meaning: its cutting blocks take the planned
/// time, as the control counts F.
///
/// # Errors
/// If they do not: a shop's own template or dialect file makes F count other axes, or changes
/// feeds.
pub(crate) fn check_feeds(job: &Job, timed: &Timed, run: Option<&Verification>) -> Result<(), Failure> {
    let planned = timed.passes_time + timed.approach_time;
    // Text that is not understood has findings of its own, and no time.
    let Some(found) = run.filter(|v| v.faults().next().is_none()).map(|v| v.cutting_time_s) else { return Ok(()) };
    if (found - planned).abs() <= SAME_TIME * planned {
        return Ok(());
    }
    let own = job.file.post.template.as_ref().or(job.file.post.dialect_file.as_ref());
    let what = format!(
        "the cutting blocks of the written program take {found:.1} s on the control, {planned:.1} s were planned: its F is not \
         the intended one"
    );
    Err(match own {
        Some(name) => {
            job.wrong(format!("post: {name}: {what} (on a Siemens control FGROUP and FGREF say which axes it counts)"))
        }
        None => Failure::Internal(what),
    })
}

/// Returns the file of the certificates.
pub(crate) fn certificates_json(programs: Vec<ProgramStamp>, certificates: Certificates) -> Vec<u8> {
    facemill_file_format::to_json(&CertificatesFile { format: CERTIFICATES_FORMAT, programs, certificates })
        .into_bytes()
}
