//! Programs as text: the template of a dialect around a body of blocks, both by the rules of the dialect's file.

mod body;
mod context;
mod lines;
mod motion;
mod template;
mod template_bounds;
mod text;

use std::collections::BTreeSet;

pub(crate) use text::clean_fanuc_comment;

use crate::{HeadSpec, PostSettings, ProgramSpec, SpindleSpec, WriteError, WrittenProgram, number_text};
use body::BodyWriter;
use lines::LineSink;

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

/// Whole revolutions per minute; controls take no decimals there.
pub(crate) fn spindle_speed(rpm: f64, place: &str) -> Result<i64, WriteError> {
    let speed = number_text::units(rpm, 0).filter(|speed| *speed > 0);
    speed.ok_or_else(|| WriteError::Number { place: place.to_owned(), what: "a spindle speed", value: rpm })
}

/// The M word of a spindle.
fn spindle_code(spindle: &SpindleSpec, settings: &PostSettings) -> String {
    let words = &settings.rules.words;
    if spindle.clockwise { words.clockwise.clone() } else { words.counter_clockwise.clone() }
}
