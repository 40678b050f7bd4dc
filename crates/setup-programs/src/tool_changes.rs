//! Programs of a clamping that change tools: the verified programs of its tools, one after the
//! other in one text.

use std::ops::Range;

use facemill_job::failure::Failure;
use facemill_job::files::REJECTED;
use facemill_job::load::job::Job;
use facemill_job::validate::setup_names::file_stem;
use facemill_nc_program::read::{AxisAt, CallKind, ReadBlock, ReadCall, ReadCommand};
use facemill_nc_program::{AxisLetter, ProgramSpec, ReadProgram, write_sections};
use facemill_planner::Planned;

use crate::whole_apt::whole_apt;

/// Program of a clamping with the programs of all of its tools.
#[derive(Clone, Debug)]
pub struct JoinedProgram {
    /// Name of the setup in the job file.
    pub setup: String,
    /// Names of its setups with one tool each.
    pub setups: Vec<String>,
    /// Names of those that have nothing to cut, and so no part in the text.
    pub without: Vec<String>,
    /// Name of the file.
    pub name: String,
    /// Its text, and the program of each tool in it; or the reason why there is none.
    pub joined: JoinedText,
    /// Name and text of the APT file of all tools, if there is a program.
    pub apt: Option<(String, Vec<u8>)>,
}

/// Text with the parts of all tools, or the reason why there is none.
pub type JoinedText = Result<(Vec<u8>, Vec<JoinedSection>), String>;

/// Part of a joined program with one tool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JoinedSection {
    /// Name of the setup with this tool.
    pub setup: String,
    /// File of its own program.
    pub program: String,
    /// Number of the tool.
    pub tool: u32,
    /// Line of the tool change.
    pub first_line: u32,
}

/// Largest distance of two places that are the same, mm or deg.
const SAME_PLACE: f64 = 1e-3;

/// Returns the programs that change tools of a planned job: one for each setup of the job file with
/// several tools. Setups with nothing to cut have no part in it.
///
/// Guarantee: the text is read back, and from each tool change on its blocks are those of the
/// program of this tool, with the same positions, feeds and state of the control, so that what is
/// proven of these programs holds for it. Before a change the tool goes home as at the end of its
/// program, with spindle and coolant off.
///
/// # Errors
/// If a text cannot be read back.
pub fn joined_programs<T>(job: &Job, planned: &[(Planned, T)]) -> Result<Vec<JoinedProgram>, Failure> {
    let setups = &job.file.setups;
    let clampings = job.clampings();
    let is_alone = clampings.len() == 1;
    let mut all = Vec::new();
    for (name, of) in clampings.into_iter().filter(|(_, of)| of.len() > 1) {
        let made: Vec<&Planned> = of
            .clone()
            .filter_map(|k| planned.iter().map(|(planned, _)| planned).find(|p| p.report.setup == setups[k].name))
            .collect();
        let suffix = if is_alone { String::new() } else { format!("-{}", file_stem(&name)) };
        let file = format!("program{suffix}.{}", job.post.extension());
        let number = (setups.len() + all.len()) as u32;
        let of_tools: Vec<String> = of.clone().map(|k| setups[k].name.clone()).collect();
        let is_made = |name: &String| made.iter().any(|planned| planned.report.setup == *name);
        let without = of_tools.iter().filter(|name| !is_made(name)).cloned().collect();
        let joined = joined(job, (&name, number), &made, of)?;
        let part = format!("{} - {name}", job.file.name);
        let apt = joined.as_ref().ok().and_then(|(text, _)| whole_apt(&part, &made, (&file, text)));
        let apt = apt.map(|text| (format!("program{suffix}.apt"), text));
        all.push(JoinedProgram { setup: name, setups: of_tools, without, name: file, joined, apt });
    }
    Ok(all)
}

fn joined(job: &Job, (name, number): (&str, u32), made: &[&Planned], of: Range<usize>) -> Result<JoinedText, Failure> {
    if made.is_empty() {
        return Ok(Err("none of its setups has anything to cut".to_owned()));
    }
    if let Some(rejected) = made.iter().find(|p| p.program().is_none_or(|(name, _)| name.contains(REJECTED))) {
        return Ok(Err(format!("the program of \"{}\" has faults", rejected.report.setup)));
    }
    let specs: Option<Vec<&ProgramSpec>> = made.iter().map(|planned| planned.spec.as_ref()).collect();
    let Some(specs) = specs else { return Ok(Err("a program has no specification".to_owned())) };
    // Every part has the name of the whole.
    let job_name = format!("{} - {name}", job.file.name);
    let named = |spec: &&ProgramSpec| ProgramSpec { job_name: job_name.clone(), ..(*spec).clone() };
    let named: Vec<ProgramSpec> = specs.iter().map(named).collect();
    let specs: Vec<&ProgramSpec> = named.iter().collect();
    let text = match write_sections(&specs, &job.post.with_number_after(number)) {
        Ok(written) => written.text,
        Err(why) => return Ok(Err(format!("post: {why}"))),
    };
    let dialect = job.post.dialect();
    let read = match job.read_program(text.as_bytes(), dialect) {
        Ok(read) => read,
        Err(why) => return Ok(Err(format!("its text cannot be read back: {why}"))),
    };
    let home = |letter: AxisLetter| {
        let axis = job.machine.axes().iter().find(|axis| axis.letter.as_str() == letter.to_string())?;
        Some(axis.in_word_unit(axis.home))
    };
    let sections = job.parts_of(&read, of.start);
    let mut found = Vec::new();
    for (k, planned) in made.iter().enumerate() {
        let (program, own) = planned.program().unwrap_or_default();
        let own = job.read_program(own, dialect).map_err(|e| job.unread(&e))?;
        let next = made.get(k + 1).and_then(|next| next.program());
        let next = next.map(|(_, text)| job.read_program(text, dialect).map_err(|e| job.unread(&e))).transpose()?;
        let Some(section) = sections.get(k).filter(|_| sections.len() == made.len()) else {
            let what = format!(
                "its text has {} tool changes for {} tools: a template of your own needs `section` (docs/dialects.md)",
                sections.len(),
                made.len()
            );
            return Ok(Err(what));
        };
        if let Err(line) = is_same(section, &own, next.as_ref(), &home) {
            let what = format!(
                "line {line} is not as in {program}: a template of your own needs `section` (docs/dialects.md)"
            );
            return Ok(Err(what));
        }
        found.push(JoinedSection {
            setup: planned.report.setup.clone(),
            program: program.to_owned(),
            tool: specs[k].tool.number,
            first_line: section.blocks.iter().find(|b| b.changes_tool()).map_or(1, |b| b.line),
        });
    }
    Ok(Ok((text.into_bytes(), found)))
}

/// Compares a section with the program of its tool: from the tool change on its blocks are those of
/// the program up to its end, and then those of the next program up to its tool change.
///
/// # Errors
/// With the first line of the section that differs.
fn is_same(
    section: &ReadProgram,
    own: &ReadProgram,
    next: Option<&ReadProgram>,
    home: &dyn Fn(AxisLetter) -> Option<f64>,
) -> Result<(), u32> {
    let says_something = |b: &&ReadBlock| b.motion.is_some() || !commands(b).is_empty();
    let from_change = |program: &ReadProgram| -> Vec<ReadBlock> {
        let blocks = program.blocks.iter().skip_while(|b| !b.changes_tool());
        blocks.filter(says_something).cloned().collect()
    };
    let here = from_change(section);
    let is_end = |b: &ReadBlock| b.commands.iter().any(|c| matches!(c, ReadCommand::End));
    let there: Vec<ReadBlock> = from_change(own).into_iter().filter(|b| next.is_none() || !is_end(b)).collect();
    let line = |k: usize| here.get(k).or(here.last()).map_or(0, |b: &ReadBlock| b.line);
    for (k, block) in there.iter().enumerate() {
        if here.get(k).is_none_or(|own| !is_same_block(own, block)) {
            return Err(line(k));
        }
    }
    // The way home of the next program, which begins there.
    let before = next.into_iter().flat_map(|next| next.blocks.iter().take_while(|b| !b.changes_tool()));
    let before: Vec<&ReadBlock> = before.filter(says_something).collect();
    let rest = &here[there.len()..];
    // It is run with the tool before, so it may move no axis: all are at home already.
    let is_way_home = |b: &ReadBlock| {
        let home = |(letter, at): (AxisLetter, AxisAt)| match at {
            AxisAt::Reference(number) => number == 1,
            AxisAt::Machine(value) => home(letter).is_some_and(|home| (value - home).abs() < SAME_PLACE),
            AxisAt::Word(_) => false,
        };
        b.motion.as_ref().is_none_or(|m| m.via.as_ref().is_none_or(|via| via.is_empty()) && m.position.iter().all(home))
    };
    let same_way = |(a, b): (&ReadBlock, &&ReadBlock)| {
        let kind = |b: &ReadBlock| b.motion.as_ref().map(|m| m.kind);
        kind(a) == kind(b) && commands(a) == commands(b) && is_way_home(a)
    };
    match rest.iter().zip(&before).position(|pair| !same_way(pair)) {
        Some(k) => Err(line(there.len() + k)),
        None if rest.len() != before.len() => Err(line(there.len() + rest.len().min(before.len()))),
        None => Ok(()),
    }
}

/// Returns whether two blocks have the same motion, feed, state of the control and commands.
pub(crate) fn is_same_block(a: &ReadBlock, b: &ReadBlock) -> bool {
    a.motion == b.motion
        && a.compensation == b.compensation
        && a.lengths == b.lengths
        && a.skippable == b.skippable
        && commands(a) == commands(b)
}

/// Returns what a block does besides its motion: without comments and its program's number, macro
/// text and labels without their numbers.
fn commands(block: &ReadBlock) -> Vec<ReadCommand> {
    let without_digits = |text: &str| text.chars().filter(|c| !c.is_ascii_digit() && *c != '_').collect();
    let kept = block.commands.iter().filter(|c| !matches!(c, ReadCommand::Comment(_) | ReadCommand::ProgramNumber(_)));
    kept.map(|c| match c {
        ReadCommand::Macro { kind, text } => ReadCommand::Macro { kind: *kind, text: without_digits(text) },
        ReadCommand::Call(call) if call.kind == CallKind::Label => {
            ReadCommand::Call(Box::new(ReadCall { name: without_digits(&call.name), ..(**call).clone() }))
        }
        other => other.clone(),
    })
    .collect()
}
