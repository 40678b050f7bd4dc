//! Programs as text: the template of a dialect around a body of blocks, both by the rules of the dialect's file.

mod body;
pub(crate) mod codes;
mod context;
mod lines;
mod motion;
mod template;
mod template_bounds;
mod text;

use std::collections::BTreeSet;

use crate::WrittenProgram;
use crate::dialect::post_file::PostSettings;
use crate::program::heads::HeadSpec;
use crate::program::spec::ProgramSpec;
use crate::program::write_error::WriteError;
use crate::write::body::BodyWriter;
use crate::write::lines::LineSink;

pub(crate) use crate::write::text::clean_fanuc_comment;

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
