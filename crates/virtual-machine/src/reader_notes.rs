//! What the reader could not decide, as findings.

use facemill_nc_program::{NoteKind, ReadNote, ReadProgram};

use crate::{Finding, FindingKind};

/// One finding for each kind of note that blocks do not tell of themselves, at its first line.
pub(crate) fn findings(program: &ReadProgram) -> impl Iterator<Item = Finding> + '_ {
    program.notes.iter().filter_map(|note| Some(finding(program, note, kind_of(note.kind)?)))
}

fn kind_of(note: NoteKind) -> Option<FindingKind> {
    match note {
        NoteKind::NoDecimalPoint => Some(FindingKind::NoDecimalPoint),
        NoteKind::InchFeed => Some(FindingKind::InchFeed),
        NoteKind::Branch => Some(FindingKind::Branch),
        NoteKind::BehindEnd => Some(FindingKind::BehindEnd),
        // Every block of these is judged by itself.
        NoteKind::NotEvaluated | NoteKind::Skippable => None,
    }
}

fn finding(program: &ReadProgram, note: &ReadNote, kind: FindingKind) -> Finding {
    // Behind the end there are lines and no blocks.
    let index = program.blocks.partition_point(|b| b.line < note.line);
    let block = program.blocks.get(index).filter(|b| b.line == note.line);
    let remedy = match kind {
        FindingKind::NoDecimalPoint => "controls may read 500 as 0.5: write 500.",
        FindingKind::InchFeed => "write the program in mm (G21)",
        FindingKind::Branch => "read as if it went straight on: only a check that raises an alarm is followed",
        _ => "not read behind the end mark %",
    };
    let others = note.count.saturating_sub(1);
    let more = if others > 0 { format!(", and {others} more lines like it") } else { String::new() };
    Finding {
        kind,
        first_line: note.line,
        last_line: note.line,
        worst_line: note.line,
        block_number: block.and_then(|b| b.number),
        block_text: note.text.to_string(),
        body: None,
        obstacle: None,
        axis: None,
        measure: None,
        place_work_mm: None,
        pose: None,
        note: format!("{remedy}{more}"),
    }
}
