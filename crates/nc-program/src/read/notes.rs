use crate::read::program::{NoteKind, ReadNote};

/// Notes of a reader, once per kind.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    notes: Vec<ReadNote>,
}

impl Notes {
    /// Notes a line.
    pub(crate) fn add(&mut self, line: u32, kind: NoteKind, text: &[u8]) {
        let trimmed = || String::from_utf8_lossy(text.trim_ascii());
        match self.notes.iter_mut().find(|note| note.kind == kind) {
            Some(note) => {
                note.count += 1;
                if line < note.line {
                    (note.line, note.text) = (line, trimmed().into());
                }
            }
            None => self.notes.push(ReadNote { line, text: trimmed().into(), count: 1, kind }),
        }
    }

    pub(crate) fn finish(self) -> Vec<ReadNote> {
        self.notes
    }
}
