//! Branches that change nothing of what is run: those that do not jump, and those that jump over an
//! alarm.

use crate::read::heidenhain::HeidenhainReader;
use crate::read::heidenhain::words::HeidenhainCode;
use crate::read::program::ToolLengthNote;
use crate::read::values::expression;
use crate::read::values::expression::Syntax;

/// `FN 12: IF … GOTO LBL 99`, and whether the alarm that it jumps over has been read.
#[derive(Debug)]
pub(super) struct HeidenhainGuard {
    number: u32,
    line: Box<[u8]>,
    label: Vec<u8>,
    has_alarm: bool,
    /// How long the tool has to be for the alarm not to be raised.
    bound: Option<ToolLengthNote>,
}

/// A branch as it stands.
pub(super) struct Condition {
    /// Whether it jumps; `None` where that is not known.
    pub(super) is_met: Option<bool>,
    /// Where to; `None` where it is not said in these words.
    label: Option<Vec<u8>>,
}

impl HeidenhainReader {
    /// Opens a guard for a branch; `false` where its label does not say where it leads.
    pub(super) fn open_guard(&mut self, number: u32, line: &[u8], condition: Condition) -> bool {
        self.guard = condition.label.map(|label| HeidenhainGuard {
            number,
            line: line.into(),
            label,
            has_alarm: false,
            bound: None,
        });
        self.guard.is_some()
    }

    /// Keeps a bound of the tool's length that the branch of this line is for.
    pub(super) fn guard_bound(&mut self, number: u32, bound: Option<ToolLengthNote>) {
        if let Some(guard) = self.guard.as_mut().filter(|guard| guard.number == number) {
            guard.bound = bound;
        }
    }

    /// Whether an alarm follows a branch that jumps over it.
    pub(super) fn is_guarded(&self) -> bool {
        self.guard.is_some()
    }

    /// A check that raises an alarm or goes on leaves the way as it is written: the branch, the
    /// alarm, stops, and the label. Any other block between makes it a branch like others, which is
    /// noted.
    pub(super) fn end_guard(&mut self) {
        if let Some(guard) = self.guard.take() {
            self.source.note_line(guard.number, crate::read::program::NoteKind::Branch, &guard.line);
        }
    }

    /// Keeps a guard open for the blocks that may stand in it, and closes it at its label.
    pub(super) fn follow_guard(&mut self, start: usize) {
        let Some(guard) = &mut self.guard else { return };
        let words: Vec<&[u8]> =
            self.code[start..].split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        let is_alarm = matches!(words.as_slice(), [b"FN", number, ..] if number.starts_with(b"14:") || *number == b"14")
            || words.first().is_some_and(|word| word.starts_with(b"FN14:"));
        match words.as_slice() {
            _ if is_alarm && !guard.has_alarm => guard.has_alarm = true,
            [b"M0" | b"STOP"] if guard.has_alarm => {}
            [b"LBL", label] if guard.has_alarm && *label == guard.label => {
                guard.bound.into_iter().for_each(|bound| bound.add_check(&mut self.source.tool_lengths));
                self.guard = None;
            }
            _ => self.end_guard(),
        }
    }
}

/// Reads the text behind the colon of FN 9 to FN 12: `IF +Q1 GT +0.01 GOTO LBL 99`.
pub(super) fn condition(code: &HeidenhainCode, function: u32, at: usize) -> Condition {
    let nothing = Condition { is_met: None, label: None };
    let value = |at: usize| expression::parse_value(code.text, at, Syntax::Parentheses, code.variables).ok();
    let word = |at: usize| code.name(code.skip_blanks(at));
    let (b"IF", at) = word(at) else { return nothing };
    let Some(first) = value(at) else { return nothing };
    let (operator, at) = word(first.end);
    let is_own = matches!((function, operator), (9, b"EQU") | (10, b"NE") | (11, b"GT") | (12, b"LT"));
    let Some(second) = value(at).filter(|_| is_own) else { return nothing };
    let is_met = first.value.zip(second.value).map(|(a, b)| match function {
        9 => a == b,
        10 => a != b,
        11 => a > b,
        _ => a < b,
    });
    let (b"GOTO", at) = word(second.end) else { return nothing };
    let (b"LBL", at) = word(at) else { return nothing };
    let label = code.text[at..].trim_ascii().to_vec();
    // LBL 0 ends what is called; it is no place.
    let is_place = !label.is_empty() && label != b"0" && !label.iter().any(u8::is_ascii_whitespace);
    Condition { is_met, label: is_place.then_some(label) }
}
