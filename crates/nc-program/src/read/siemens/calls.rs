//! Cycles and subprograms.

use crate::read::error::{ReadError, ReadFault};
use crate::read::program::{CallKind, MacroKind, ReadCall, ReadCommand};
use crate::read::siemens::block::SiemensBlock;
use crate::read::siemens::items::{Item, Value};
use crate::read::siemens::{line_macro, names};
use crate::words::axis_words::AxisLetter;

impl SiemensBlock<'_> {
    /// A name that is no word: a cycle of the control, or a subprogram if the block holds nothing
    /// else.
    pub(super) fn call(&mut self, item: &Item, name: &str) -> Result<(), ReadError> {
        let is_alone = self.items.iter().all(|i| i.is_used || i.letter == b'P');
        let is_cycle = names::is_cycle(name);
        // A cycle has parentheses; a subprogram is the first item of its block, and only its number
        // of runs can follow.
        let is_first = self.items.first().is_some_and(|first| first.span == item.span);
        if !(is_alone && is_first) {
            return Err(self.fault(item, ReadFault::UnknownWord));
        }
        self.take(b'P');
        self.keep(item, name, is_cycle, false);
        if names::is_path_cycle(name) {
            return Ok(());
        }
        self.block.commands.push(line_macro(MacroKind::Call, self.line));
        if is_cycle {
            // Cycles give back the modal state that they found.
            self.state.modal.position.forget_all();
        } else {
            self.state.modal.forget_motion();
        }
        Ok(())
    }

    /// `MCALL CYCLE81(…)`, or `MCALL` alone, which ends it.
    pub(super) fn modal_call(&mut self, mcall: &Item) -> Result<(), ReadError> {
        self.state.modal.cycle = None;
        self.state.modal_call = None;
        let Some(k) = self.items.iter().position(|i| i.span.start > mcall.span.start) else { return Ok(()) };
        let item = self.items[k].clone();
        if item.letter > 0 && item.letter != b'L'
            || !matches!(item.value, Value::None | Value::Arguments(_)) && item.letter == 0
        {
            return Err(self.fault(&item, ReadFault::StrayWord));
        }
        self.items[k].is_used = true;
        let name = String::from_utf8_lossy(&self.code[item.name.clone()]).into_owned();
        self.keep(&item, &name, names::is_cycle(&name), true);
        // The cycle's arguments say where the tool is along its axis after the cycle.
        self.state.modal.position.forget_word(AxisLetter::Z);
        match names::drilling_code(&name) {
            Some(code) => self.state.modal.cycle = Some(code),
            None => self.state.modal_call = Some(name),
        }
        Ok(())
    }

    /// `L100 P2`.
    pub(super) fn numbered_call(&mut self) -> Result<(), ReadError> {
        let Some(item) = self.take(b'L') else { return Ok(()) };
        let name = String::from_utf8_lossy(&self.code[item.span.clone()]).into_owned();
        self.call(&item, &name)
    }

    fn keep(&mut self, item: &Item, name: &str, is_cycle: bool, is_modal: bool) {
        let arguments = match &item.value {
            Value::Arguments(bytes) => String::from_utf8_lossy(self.line[bytes.clone()].trim_ascii()).into_owned(),
            _ => String::new(),
        };
        let kind = if is_cycle { CallKind::Cycle } else { CallKind::Subprogram };
        let call = ReadCall { kind, name: name.to_owned(), arguments, is_modal };
        self.block.commands.push(ReadCommand::Call(Box::new(call)));
    }
}
