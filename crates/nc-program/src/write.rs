//! Programs as text: the template of a dialect around a body of blocks, both by the rules of the
//! dialect's file.

mod body;
pub(crate) mod codes;
mod context;
mod lines;
mod motion;
pub(crate) mod offset_table;
mod template;
mod template_bounds;
pub(crate) mod text;

use std::collections::BTreeSet;

use crate::dialect::post_file::PostSettings;
use crate::program::heads::{HeadError, HeadSpec};
use crate::program::spec::ProgramSpec;
use crate::program::write_error::WriteError;
use crate::write::body::BodyWriter;
use crate::write::context::SectionContext;
use crate::write::lines::LineSink;

/// The program, with `\n` line ends. `heads` is empty for a machine of one head.
pub(crate) fn write(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
) -> Result<WrittenProgram, WriteError> {
    let mut written = write_each(&[spec], heads, settings)?;
    let block_lines = written.block_lines.pop().unwrap_or_default();
    Ok(WrittenProgram { text: written.text, block_lines })
}

/// The sections of a program, one for each spec.
fn write_each(
    specs: &[&ProgramSpec],
    heads: &[HeadSpec],
    settings: &PostSettings,
) -> Result<WrittenSections, WriteError> {
    let section = |(k, spec): (usize, &&ProgramSpec)| {
        template::render(spec, heads, settings, SectionContext::new(k, specs.len()))
    };
    let rendered: Vec<Vec<String>> = specs.iter().enumerate().map(section).collect::<Result<_, _>>()?;
    check_sections(&rendered)?;
    let labels: BTreeSet<u32> = rendered.iter().flatten().filter_map(|line| label(line)).collect();
    let mut sink = LineSink::new(settings, labels, specs.iter().map(|spec| spec.program.blocks.len()).sum());
    let mut block_lines = Vec::new();
    for (spec, lines) in specs.iter().zip(&rendered) {
        for line in lines {
            if line == template::BODY {
                block_lines.push(BodyWriter::new(spec, heads, settings, &mut sink).write(&spec.program.blocks)?);
            } else {
                sink.push_template_line(line)?;
            }
        }
    }
    Ok(WrittenSections { text: sink.into_text(), block_lines })
}

/// Refuses sections that begin as the first one does, or share a label: a control would take the
/// second one for the begin of a program, or jump from one into the other.
fn check_sections(rendered: &[Vec<String>]) -> Result<(), WriteError> {
    let mut labels = BTreeSet::new();
    for (k, lines) in rendered.iter().enumerate() {
        if k > 0 && lines.first() == rendered[0].first() {
            return Err(WriteError::SectionBegins { line: lines.first().cloned().unwrap_or_default() });
        }
        let own: BTreeSet<&str> = lines.iter().filter_map(|line| jump_label(line)).collect();
        if let Some(label) = own.iter().find(|label| labels.contains(**label)) {
            return Err(WriteError::RepeatedLabel { label: (*label).to_owned() });
        }
        labels.extend(own);
    }
    Ok(())
}

/// Label that a line is: `N9001`, `LBL 99`, `LENGTH_OK:`, or that of a block such as `O100 IF`.
fn jump_label(line: &str) -> Option<&str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let is_name = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    let (first, rest) = line.split_once(' ').unwrap_or((line, ""));
    let is_block =
        first.starts_with(['O', 'o']) && is_number(&first[1..]) && !rest.starts_with('(') && !rest.is_empty();
    if is_block {
        return Some(first);
    }
    let is_alone = first.starts_with(['N', 'n']) && is_number(&first[1..]) && rest.is_empty()
        || first.eq_ignore_ascii_case("lbl") && is_number(rest)
        || line.strip_suffix(':').is_some_and(is_name);
    is_alone.then_some(line)
}

/// A program that changes tools, as [`write_program`] writes it: one section for each spec, in
/// their order. A section ends with the tool away from the work and spindle and coolant off, and
/// the next one begins with its tool, the check of its length, and the way to its first position as
/// at the start of a program.
///
/// # Errors
/// As [`write_program`], of the first section at fault; [`WriteError::NoSection`] without any.
pub fn write_sections(specs: &[&ProgramSpec], settings: &PostSettings) -> Result<WrittenSections, WriteError> {
    if specs.is_empty() {
        return Err(WriteError::NoSection);
    }
    write_each(specs, &[], settings)
}

/// The text of a program that changes tools, and where the blocks of each section are in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenSections {
    /// The text.
    pub text: String,
    /// For each section the lines of its blocks, as [`WrittenProgram::block_lines`].
    pub block_lines: Vec<Vec<u32>>,
}

/// Block number that a line of the template has already.
fn label(line: &str) -> Option<u32> {
    let digits = line.strip_prefix(['N', 'n'])?.trim_start();
    let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    digits[..end].parse().ok()
}

/// The program in the dialect of the settings, with `\n` line ends; the same input always gives the
/// same bytes.
///
/// Numbers have fixed decimals, no exponent, no negative zero; whether a whole number has a decimal
/// point (`X100.`, or `X100.000` with trailing zeros) and a positive one its sign, the dialect's
/// file says; rotary words are deg. Feeds are rounded down, also inverse times, where a larger
/// number is faster, but not to zero nor below [`ProgramSpec::smallest_feed`]. The first motion of
/// the body states every word it names, absolute mode and feed mode, so that it does not depend on
/// the template.
///
/// # Errors
/// When the template is wrong, the program does not start with a rapid, a number fits no word, or a
/// line breaks the control's rules.
pub fn write_program(spec: &ProgramSpec, settings: &PostSettings) -> Result<String, WriteError> {
    write_program_with_lines(spec, settings).map(|written| written.text)
}

/// A program's text, and where its blocks are in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenProgram {
    /// The text.
    pub text: String,
    /// For each block of [`NcProgram::blocks`](crate::NcProgram::blocks) the line of the text, from
    /// 1, at which it begins; a block that writes nothing has the line of what follows.
    pub block_lines: Vec<u32>,
}

/// [`write_program`], with the line at which each block begins: what a reader of the text calls
/// [`ReadBlock::line`](crate::read::ReadBlock::line).
///
/// # Errors
/// As [`write_program`].
pub fn write_program_with_lines(spec: &ProgramSpec, settings: &PostSettings) -> Result<WrittenProgram, WriteError> {
    write(spec, &[], settings)
}

/// [`write_program_with_lines`] for a machine of several heads, whose axes all stand in one block:
/// `heads` are all of them, and the tool and spindle of `spec` those of the first. The template has
/// them as `heads`.
///
/// Only for dialects with words for each spindle and axes with numbers. FANUC: the length of each
/// head is switched on in a block of its own, for its spindle axis (tool length offset type C), and
/// S, M3, M4 and M5 of each spindle have its number as P.
///
/// # Errors
/// As [`write_program`]; when the heads share a number or an axis, there are not 2 to 4 of them,
/// the first motion says nothing of one, or the feed mode is RTCP, which can follow one tip.
pub fn write_program_of_heads(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
) -> Result<WrittenProgram, WriteError> {
    if heads.is_empty() {
        return Err(HeadError::Count { n: 0 }.into());
    }
    write(spec, heads, settings)
}
