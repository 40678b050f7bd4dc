//! Passes and operations of a program of `facemill`, by its comments.

use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::{AxisAt, ReadBlock, ReadCommand};

/// Lines of a program that become a subprogram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// First line, from 1.
    pub first_line: u32,
    /// Last line.
    pub last_line: u32,
    /// Its name, a comment of the program.
    pub name: String,
}

/// Returns the passes of a program: each from its comment `PASS n PLACE m` to its last motion
/// before the next pass, the way home or the next tool. So the way to a pass belongs to it, and the
/// way back from the last one to that.
#[must_use]
pub fn pass_sections(program: &ReadProgram) -> Vec<Section> {
    let blocks = &program.blocks;
    let starts: Vec<usize> = (0..blocks.len()).filter(|&k| pass_name(&blocks[k]).is_some()).collect();
    let section = |&start: &usize| {
        let behind = blocks[start + 1..].iter().take_while(|b| pass_name(b).is_none() && !leaves_the_work(b));
        let last = behind.filter(|b| b.motion.is_some()).last()?;
        let name = pass_name(&blocks[start])?.to_owned();
        Some(Section { first_line: blocks[start].line, last_line: last.line, name })
    };
    starts.iter().filter_map(section).collect()
}

/// Returns the operations of a program: all passes behind a comment that is their name, with the
/// comments of the passes.
#[must_use]
pub fn operation_sections(program: &ReadProgram) -> Vec<Section> {
    let blocks = &program.blocks;
    let mut all: Vec<Section> = Vec::new();
    for pass in pass_sections(program) {
        let at = blocks.partition_point(|b| b.line < pass.first_line);
        // A name that is too long for a line has several.
        let named = blocks[..at].iter().rev().take_while(|b| comment_of(b).is_some() && pass_name(b).is_none());
        let mut names: Vec<&str> = named.filter_map(comment_of).collect();
        names.reverse();
        match all.last_mut() {
            Some(last) if names.is_empty() => last.last_line = pass.last_line,
            _ => all.push(Section { name: names.join(" "), ..pass }),
        }
    }
    all
}

/// Returns the comment of a block that has nothing else.
fn comment_of(block: &ReadBlock) -> Option<&str> {
    match block.commands.as_slice() {
        [ReadCommand::Comment(text)] if block.motion.is_none() => Some(text.trim()),
        _ => None,
    }
}

fn pass_name(block: &ReadBlock) -> Option<&str> {
    let text = comment_of(block)?;
    let (number, place) = text.strip_prefix("PASS ")?.split_once(" PLACE ")?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    (is_number(number) && is_number(place)).then_some(text)
}

/// Returns whether a block goes home or changes the tool.
fn leaves_the_work(block: &ReadBlock) -> bool {
    let by_machine =
        |m: &facemill_nc_program::read::ReadMotion| m.position.iter().any(|(_, at)| !matches!(at, AxisAt::Word(_)));
    block.changes_tool() || block.motion.as_ref().is_some_and(by_machine)
}
