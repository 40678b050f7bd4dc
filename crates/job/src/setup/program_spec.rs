//! Specification of a setup's program, besides its blocks, for the dialect's writer.

use facemill_inverse_kinematics::{Axis, Machine};
use facemill_nc_program::{
    AxisSpec, AxisWords, Coolant, FeedMode, MappedAxis, NcProgram, ProgramSpec, SpindleSpec, ToolSpec, WordMap,
};
use facemill_tool_model::{SpindleRotation, ToolAssembly};

use crate::failure::Failure;
use crate::format::job_file::{CoolantFile, OperationFile};
use crate::load::job::{Job, Setup};
use crate::setup::rolled::roll;
use crate::setup::word_map::{rtcp_start_axes, table_from_rtcp_words};

/// Returns the words at which RTCP is switched on: linear axes at home, rotary words 0.
fn rtcp_start(job: &Job, words: &WordMap) -> Result<AxisWords, Failure> {
    let at = rtcp_start_axes(&job.machine, words);
    let tip = job.machine.cl_point(&at, job.tool.gauge_length()).tip;
    let tip = table_from_rtcp_words(job, words)?.inverse_transform_point(&tip);
    words.rtcp_words(&tip, at.as_slice()).map_err(|e| Failure::Internal(e.to_string()))
}

/// Returns the control's word for a coolant.
pub fn coolant(file: CoolantFile) -> Coolant {
    match file {
        CoolantFile::Off => Coolant::Off,
        CoolantFile::Flood => Coolant::Flood,
        CoolantFile::Mist | CoolantFile::Air => Coolant::Mist,
    }
}

/// Returns everything that the dialect's writer needs.
///
/// # Errors
/// If an axis has no NC address.
pub fn program_spec(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    words: &WordMap,
    program: &mut NcProgram,
) -> Result<ProgramSpec, Failure> {
    let approach = match job.post.feed_mode() {
        FeedMode::Rtcp => Some(rtcp_start(job, words)?),
        FeedMode::G94 | FeedMode::G93 => None,
    };
    let axes = axis_specs(&job.machine, words);
    roll(program, job.machine.axes());
    Ok(ProgramSpec {
        job_name: format!("{} - {}", job.file.name, setup.file.name),
        tool: tool_spec(&job.tool),
        spindle: SpindleSpec {
            rpm: operation.feeds.spindle_rpm,
            clockwise: job.tool.spindle_rotation() == SpindleRotation::Clockwise,
        },
        coolant: coolant(operation.feeds.coolant),
        work_offset: setup.work_offset,
        axes,
        smallest_feed: job.machine.feed_range().min,
        program: std::mem::take(program),
        rapid: job.machine.motion_law().rapid,
        approach,
    })
}

/// Returns the axes in the form of the dialect's writer.
pub fn axis_specs(machine: &Machine, words: &WordMap) -> Vec<AxisSpec> {
    let spec = |(a, mapped): (&Axis, &MappedAxis)| AxisSpec {
        letter: mapped.letter,
        min: a.in_word_unit(a.min),
        max: a.in_word_unit(a.max),
        along_spindle: mapped.along_spindle.abs() > 0.5,
        work_offset: a.in_word_unit(mapped.offset),
    };
    machine.axes().iter().zip(words.axes()).map(spec).collect()
}

/// Returns a tool in the form of the dialect's writer.
pub fn tool_spec(tool: &ToolAssembly) -> ToolSpec {
    let cutter = tool.cutter();
    ToolSpec {
        number: tool.number(),
        name: tool.name().to_owned(),
        radius: cutter.radius(),
        corner_radius: cutter.corner_radius(),
        length: tool.gauge_length(),
        length_register: tool.length_register(),
    }
}
