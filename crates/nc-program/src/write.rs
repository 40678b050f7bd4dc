//! Programs as text: the template of a dialect around a body of blocks, both by the rules of the
//! dialect's file.

mod body;
pub(crate) mod codes;
mod context;
mod lines;
mod motion;
mod template;
mod template_bounds;
pub(crate) mod text;

use std::collections::BTreeSet;

use crate::dialect::post_file::PostSettings;
use crate::program::heads::{HeadError, HeadSpec};
use crate::program::spec::ProgramSpec;
use crate::program::write_error::WriteError;
use crate::write::body::BodyWriter;
use crate::write::lines::LineSink;

/// The program, with `\n` line ends. `heads` is empty for a machine of one head.
pub(crate) fn write(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
) -> Result<WrittenProgram, WriteError> {
    let lines = template::render(spec, heads, settings)?;
    let labels: BTreeSet<u32> = lines.iter().filter_map(|line| label(line)).collect();
    let mut sink = LineSink::new(settings, labels, spec.program.blocks.len());
    let mut block_lines = Vec::new();
    for line in &lines {
        if line == template::BODY {
            block_lines = BodyWriter::new(spec, heads, settings, &mut sink).write(&spec.program.blocks)?;
        } else {
            sink.push_template_line(line)?;
        }
    }
    Ok(WrittenProgram { text: sink.into_text(), block_lines })
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
