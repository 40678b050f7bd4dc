//! Where the text leaves open what the control does, so that nothing is proven of its motion.

use facemill_nc_program::ReadProgram;

use crate::finding::{FindingKind, TextFault, reader_notes};

/// Lines whose motion is not known to be the simulated one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Doubt {
    /// The line of the fault.
    pub(crate) line: u32,
    /// The last line that it puts in doubt.
    last: u32,
    /// Fault.
    pub(crate) what: String,
}

/// All doubts of a program, by line.
#[derive(Clone, Debug)]
pub(crate) struct Doubts(Vec<Doubt>);

impl Doubts {
    /// Of the faults of a text, and of what the reader could not decide.
    pub(crate) fn new(program: &ReadProgram, faults: &[TextFault]) -> Self {
        let of_faults = faults.iter().map(|f| {
            let (line, last) = (program.blocks[f.block].line, program.blocks[f.last].line);
            let axis = f.axis.map_or_else(String::new, |a| format!(", {a}"));
            (f.kind, line, last, format!("{}{axis}, {}", f.kind, f.note))
        });
        let of_notes = reader_notes::findings(program)
            .map(|f| (f.kind, f.first_line, f.last_line, format!("{}, {}", f.kind, f.note)));
        let all = of_faults.chain(of_notes).filter_map(|(kind, line, last, what)| {
            let last = match scope(kind) {
                Scope::Nothing => return None,
                Scope::Block => last,
                Scope::Behind => u32::MAX,
            };
            Some(Doubt { line, last, what })
        });
        let mut all: Vec<Doubt> = all.collect();
        all.sort_by_key(|d| d.line);
        Self(all)
    }

    /// Every fault, by its line.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Doubt> {
        self.0.iter()
    }

    /// The first fault that puts a line in doubt: one on the line itself before those that last
    /// from lines above.
    pub(crate) fn of_line(&self, line: u32) -> Option<&Doubt> {
        let behind = self.0.partition_point(|d| d.line <= line);
        let first = self.0.partition_point(|d| d.line < line);
        let own = self.0[first..behind].first();
        own.or_else(|| self.0[..first].iter().find(|d| d.last >= line))
    }
}

/// Scope of the doubt that a fault raises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// No motion: spindle, feed, text that is not run.
    Nothing,
    /// The blocks to which it applies.
    Block,
    /// Everything from there on: where the axes are, which tool is in the spindle, or which blocks
    /// are run.
    Behind,
}

/// A kind that is not listed as harmless is not.
fn scope(kind: FindingKind) -> Scope {
    match kind {
        FindingKind::NoFeed | FindingKind::SpindleOff | FindingKind::SpindleSense | FindingKind::BehindEnd => {
            Scope::Nothing
        }
        FindingKind::NoTool | FindingKind::UnsafeToolChange => Scope::Block,
        _ => Scope::Behind,
    }
}
