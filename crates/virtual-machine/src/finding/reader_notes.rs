//! Undecided places of the reader, as findings.

use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::{Compensation, NoteKind, ReadBlock, ReadCommand, ReadNote};
use facemill_nc_program::words::StateWord;

use crate::finding::{Finding, FindingKind};

/// One finding for each kind of note that blocks do not tell of themselves, at its first line.
pub(crate) fn findings(program: &ReadProgram) -> impl Iterator<Item = Finding> + '_ {
    program.notes.iter().filter_map(|note| Some(finding(program, note, kind_of(note.kind)?)))
}

fn kind_of(note: NoteKind) -> Option<FindingKind> {
    match note {
        NoteKind::NoDecimalPoint => Some(FindingKind::NoDecimalPoint),
        NoteKind::Branch => Some(FindingKind::Branch),
        NoteKind::BehindEnd => Some(FindingKind::BehindEnd),
        // Every block of these is judged by itself; what feeds in inches rest on is an assumption.
        NoteKind::NotEvaluated | NoteKind::Skippable | NoteKind::InchFeed => None,
        // No kind is left out of the report because this list does not know it.
        _ => Some(FindingKind::UnknownBlock),
    }
}

fn finding(program: &ReadProgram, note: &ReadNote, kind: FindingKind) -> Finding {
    // Behind the end there are lines and no blocks.
    let index = program.blocks.partition_point(|b| b.line < note.line);
    let block = program.blocks.get(index).filter(|b| b.line == note.line);
    let remedy = match kind {
        FindingKind::NoDecimalPoint => "controls may read 500 as 0.5: write 500.",
        FindingKind::Branch => "read as if it went straight on: only a check that raises an alarm is followed",
        _ => "not read behind the end mark %",
    };
    let others = note.count.saturating_sub(1);
    let more = if others > 0 { format!(", and {others} more lines like it") } else { String::new() };
    Finding::of_line(kind, note.line, block.and_then(|b| b.number), &note.text, format!("{remedy}{more}"))
}

/// A program that says nowhere that it ends: cut off on its way to the control, or with its last
/// lines taken away.
pub(crate) fn no_end(program: &ReadProgram) -> Option<Finding> {
    let ends = |b: &ReadBlock| b.commands.contains(&ReadCommand::End) || b.said.has(StateWord::Return);
    if program.goes_on || program.blocks.iter().any(ends) {
        return None;
    }
    let last = program.blocks.last();
    let note = match last.map(|b| b.compensation) {
        Some(Compensation::Rtcp(_)) => "write M30 (M2, END PGM) behind the way home; RTCP is still on here",
        _ => "write M30 (M2, END PGM) behind the way home",
    };
    let (line, number) = last.map_or((1, None), |b| (b.line, b.number));
    Some(Finding::of_line(FindingKind::NoEnd, line, number, last.map_or("", |b| &b.text), note.to_owned()))
}
