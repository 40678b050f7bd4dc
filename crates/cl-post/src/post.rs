//! A CL file to its program.

use std::path::Path;

use facemill_cl_data::Monitor;
use facemill_cl_file::AptFile;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::setup::word_map::word_frame;
use facemill_nc_program::{ProgramSpec, write_sections};
use facemill_tool_model::SpindleRotation;
use facemill_verification::text_times::{TimedText, times_of_text};
use facemill_virtual_machine::motion::axis_motion::MotionContext;

use crate::blocks::{ToolBlocks, blocks};
use crate::fault::PostFault;
use crate::feeds::lower_feeds;
use crate::positions::{Position, positions};
use crate::read_back::{WrittenPart, compare};
use crate::report::{POST_FORMAT, PostDeviation, PostNote, PostReport, PostedTool, Remarks};
use crate::scene::{PostOptions, PostScene, PostTool};
use crate::steps::{FileSteps, PathMove, Step, ToolPart, steps};

/// A program and its report.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Posted {
    /// Text of the program.
    pub text: String,
    /// Its report. Names and checksums of files are those that the caller gave.
    pub report: PostReport,
    /// Whether the text is what the file says. If not, it must not be run.
    pub is_as_meant: bool,
    /// Faults of the report that a run against the part without a finding disproves: rapids in
    /// which rotary axes turn anew without a lift.
    unproven: Vec<PostNote>,
}

impl Posted {
    /// Makes remarks of the faults that a run against the part disproves. Does nothing unless the
    /// report has such runs of all tools, without a fault.
    pub fn take_proof(&mut self) {
        let report = &mut self.report;
        let mut runs = report.verifications.iter();
        if report.verifications.len() != report.tools.len() || runs.any(|v| v.verification.faults().next().is_some()) {
            return;
        }
        report.faults.retain(|fault| !self.unproven.contains(fault));
        report.notes.append(&mut self.unproven);
    }
}

/// Posts a CL file, and reads the program back.
///
/// `cl_file` names the file, `program` is the path of the program to be; nothing is opened. The
/// monitor counts the moves of the file, and those that are added.
///
/// # Errors
/// With the line: a statement that cannot be written, or a pose or motion that the machine cannot
/// follow; without it: settings, machine or template do not go together, or the monitor cancels.
pub fn post_cl(
    file: &AptFile,
    cl_file: ProgramStamp,
    program: &Path,
    scene: &PostScene<'_>,
    options: &PostOptions,
    monitor: &dyn Monitor,
) -> Result<Posted, PostFault> {
    options.check()?;
    let FileSteps { name, parts, words, mut faults, notes } = steps(file, options, monitor)?;
    let name = name.unwrap_or_else(|| options.name.clone());
    let mut remarks = Remarks { notes, ..Remarks::default() };
    let mut made = Vec::new();
    for part in &parts {
        made.push(MadePart::new(scene, options, (part, &name), &mut remarks, monitor)?);
    }
    let specs: Vec<&ProgramSpec> = made.iter().map(|part| &part.blocks.spec).collect();
    monitor.checkpoint()?;
    let written = write_sections(&specs, scene.post)?;
    let of_text: Vec<WrittenPart<'_>> = made
        .iter()
        .zip(&written.block_lines)
        .map(|(part, block_lines)| WrittenPart {
            tool: part.tool,
            blocks: &part.blocks,
            moves: &part.moves,
            block_lines,
        })
        .collect();
    let compared = compare(scene, &written.text, &of_text, options.tolerance);
    let tools = posted_tools(scene, &parts, (&made, &compared.times), (&written.text, &written.block_lines));
    let is_as_meant = compared.faults.is_empty();
    let Remarks { notes, unproven, other_cutters } = remarks;
    faults.extend(other_cutters);
    faults.extend(compared.faults);
    faults.extend(unproven.iter().cloned());
    let stamps = (cl_file, ProgramStamp::new(program, written.text.as_bytes()));
    let report = report(scene, stamps, tools, compared.deviation);
    let report = PostReport { words, faults, notes, ..report };
    Ok(Posted { text: written.text, report, is_as_meant, unproven })
}

fn report(
    scene: &PostScene<'_>,
    (cl_file, program): (ProgramStamp, ProgramStamp),
    tools: Vec<PostedTool>,
    deviation: PostDeviation,
) -> PostReport {
    PostReport {
        format: POST_FORMAT,
        cl_file,
        program,
        machine: scene.machine.name().to_owned(),
        dialect: scene.post.dialect().name().to_owned(),
        feed_mode: scene.post.feed_mode(),
        checked_against_part: false,
        tools,
        deviation,
        words: Vec::new(),
        faults: Vec::new(),
        notes: Vec::new(),
        verifications: Vec::new(),
    }
}

/// A tool's part with its blocks.
struct MadePart<'a> {
    tool: &'a PostTool<'a>,
    moves: Vec<PathMove>,
    blocks: ToolBlocks,
}

impl<'a> MadePart<'a> {
    fn new(
        scene: &'a PostScene<'_>,
        options: &PostOptions,
        (part, name): (&ToolPart, &str),
        remarks: &mut Remarks,
        monitor: &dyn Monitor,
    ) -> Result<Self, PostFault> {
        let tool = scene.tool(part.tool, part.line)?;
        check_tool(tool, part, options, remarks);
        let mut part = ToolPart { steps: part.steps.clone(), cutters: Vec::new(), registers: Vec::new(), ..*part };
        add_ends(&mut part, options, &mut remarks.notes)?;
        let moves: Vec<PathMove> =
            part.steps.iter().filter_map(|step| if let Step::Move(m) = step { Some(*m) } else { None }).collect();
        let measures = (tool.tool.gauge_length(), tool.tool.cutter().radius());
        let found: Vec<Position> = positions(scene, measures, options, &moves, remarks, monitor)?;
        let mut blocks = blocks(scene, tool, &part, (&moves, &found), name)?;
        if options.law_feeds {
            lower_feeds(scene, measures.0, &mut blocks, &mut remarks.notes)?;
        }
        Ok(Self { tool, moves, blocks })
    }
}

/// Remarks on a tool that is not the file's. Another cutter is a fault: the tip is programmed, and
/// the part gets another shape.
fn check_tool(tool: &PostTool<'_>, part: &ToolPart, options: &PostOptions, remarks: &mut Remarks) {
    let Remarks { notes, other_cutters, .. } = remarks;
    let is_meant = options.other_cutters.contains(&tool.tool.number());
    let list = if is_meant { &mut *notes } else { other_cutters };
    let (cutter, own_name) = (tool.tool.cutter(), format!("the file of T{}", tool.tool.number()));
    let own = [2.0 * cutter.radius(), cutter.corner_radius()];
    for (line, cutter) in &part.cutters {
        let why = cutter.difference(own, &own_name);
        list.extend(why.map(|why| PostNote::at(*line, format!("ANOTHER CUTTER: {why}"))));
    }
    let (number, own) = (tool.tool.number(), tool.tool.length_register());
    for (line, register) in part.registers.iter().filter(|(_, register)| *register != own) {
        let called =
            if *register == 0 { "no length register".to_owned() } else { format!("length register {register}") };
        let text = format!("the file calls {called} for T{number}, and the file of T{number} has {own}: that is taken");
        notes.push(PostNote::at(*line, text));
    }
    let clockwise = tool.tool.spindle_rotation() == SpindleRotation::Clockwise;
    let is_against = |step: &Step| matches!(step, Step::SpindleOn(spindle) if spindle.clockwise != clockwise);
    if clockwise != part.spindle.clockwise || part.steps.iter().any(is_against) {
        let text = format!("the spindle turns against the sense in the file of T{}", tool.tool.number());
        notes.push(PostNote::at(part.line, text));
    }
}

/// Begins and ends a part away from the cut: a part that begins or ends with one is refused
/// without a retract, because the template goes to the first position and home at rapid rate.
fn add_ends(part: &mut ToolPart, options: &PostOptions, notes: &mut Vec<PostNote>) -> Result<(), PostFault> {
    let is_cut = |step: &Step| matches!(step, Step::Move(m) if m.feed.is_some());
    let is_move = |step: &Step| matches!(step, Step::Move(_));
    let above = |m: &PathMove, by: f64| {
        let cl = m.cl.translated(m.cl.axis.into_inner() * by);
        Step::Move(PathMove { cl, feed: None, is_point: false, is_chord: false, ..*m })
    };
    let first = part.steps.iter().position(is_move);
    if let Some((at, Step::Move(m))) = first.map(|at| (at, &part.steps[at]))
        && m.feed.is_some()
    {
        let Some(retract) = options.retract else {
            let why = "the tool begins with a cut, and would come to it at rapid rate: put FROM or RAPID before it, or \
                       permit a retract (--retract-mm), from which it comes along its axis";
            return Err(PostFault::at(m.line, why));
        };
        notes.push(PostNote::at(m.line, format!("the tool comes to its first cut from {retract} mm along its axis")));
        let step = above(m, retract);
        part.steps.insert(at, step);
    }
    let last = part.steps.iter().rposition(is_move);
    if let Some((at, Step::Move(m))) = last.filter(|at| is_cut(&part.steps[*at])).map(|at| (at, &part.steps[at])) {
        match options.retract {
            Some(retract) => {
                notes
                    .push(PostNote::at(m.line, format!("the tool leaves its last cut by {retract} mm along its axis")));
                let step = above(m, retract);
                part.steps.insert(at + 1, step);
            }
            None => {
                let why = "the tool ends in a cut, and would go home from there at rapid rate: put RAPID and a point \
                           behind it, or permit a retract (--retract-mm), which lifts it along its axis";
                return Err(PostFault::at(m.line, why));
            }
        }
    }
    Ok(())
}

fn posted_tools(
    scene: &PostScene<'_>,
    parts: &[ToolPart],
    (made, times): (&[MadePart<'_>], &[[f64; 2]]),
    (text, block_lines): (&str, &[Vec<u32>]),
) -> Vec<PostedTool> {
    let first_line = |k: usize| block_lines.get(k).and_then(|lines| lines.first()).copied();
    let each = parts.iter().zip(made).zip(times).enumerate();
    each.map(|(k, ((part, of), constant))| {
        let is_inserted = |(_, position): &&(usize, Position)| !position.is_point;
        let begin = if k == 0 { 0 } else { first_line(k).unwrap_or(0) };
        let end = first_line(k + 1).unwrap_or(u32::MAX);
        let timed = TimedText {
            text: text.as_bytes(),
            dialect: scene.post.dialect(),
            control: &scene.post.rules().control_motion,
            rapids: scene.post.rules().rtcp_rapids(),
            block_lines: &[],
            lines: begin..end,
        };
        let machine = scene.machine;
        let tool_length = of.tool.tool.gauge_length();
        let frame = word_frame(machine, &of.tool.words);
        let at = MotionContext { machine, tool_length, words: &of.tool.words, frame, work_offset: None };
        PostedTool {
            number: of.tool.tool.number(),
            name: of.tool.tool.name().to_owned(),
            cl_line: part.line,
            program_line: first_line(k).unwrap_or(1),
            points: part.points,
            repeated: of.blocks.repeated,
            blocks: of.blocks.motions.len(),
            inserted: of.blocks.motions.iter().filter(is_inserted).count(),
            arcs: part.arcs,
            lowered_feeds: of.blocks.lowered,
            times: times_of_text(&[(machine, tool_length)], at, &timed, *constant),
        }
    })
    .collect()
}
