//! Statements that are read as a whole, and assignments.

use crate::read::error::{ReadError, ReadFault};
use crate::read::length_check::LengthVariables;
use crate::read::program::{CallKind, MacroKind, NoteKind, ReadBlock, ReadCall, ReadCommand};
use crate::read::siemens::items::{SiemensCode, is_assignment};
use crate::read::siemens::names::Statement;
use crate::read::siemens::{SiemensGuard, SiemensReader, line_macro};
use crate::read::values::expression;
use crate::read::values::expression::Syntax;

impl SiemensReader {
    pub(super) fn statement(
        &mut self,
        statement: Statement,
        line: &[u8],
        start: usize,
        block: &mut ReadBlock,
    ) -> Result<(), ReadError> {
        block.sets_state = true;
        match statement {
            Statement::Branch => {
                let is_inch = self.state.modal.is_inch;
                let bound = self.source.length_check(&self.code, LengthVariables::SystemVariable, is_inch);
                self.variables.forget_all();
                self.has_jumped |= self.code.windows(4).any(|w| w == b"GOTO");
                match self.label_ahead() {
                    Some(label) => {
                        let guard =
                            SiemensGuard { number: block.line, line: line.into(), label, has_alarm: false, bound };
                        self.guard = Some(guard);
                    }
                    None => self.source.note(NoteKind::Branch, line),
                }
                block.commands.push(line_macro(MacroKind::Branch, line));
            }
            Statement::Definition => {
                self.definition(start)?;
                block.commands.push(line_macro(MacroKind::Assignment, line));
            }
            Statement::Heading => block.commands.push(line_macro(MacroKind::Assignment, line)),
            Statement::Message => {
                block.sets_state = false;
                block.commands.push(ReadCommand::Comment(self.message(line, start)?));
            }
            Statement::Output => block.commands.push(line_macro(MacroKind::Output, line)),
            Statement::Alarm => {
                if self.guard.is_none() {
                    self.source.note(NoteKind::Branch, line);
                }
                block.commands.push(line_macro(MacroKind::Alarm, line));
            }
            Statement::Call => {
                let text = line[start..self.code.len()].trim_ascii();
                let text = String::from_utf8_lossy(text).into_owned();
                let (_, name) = text.split_once([' ', '(']).unwrap_or(("", ""));
                let name = name.trim_matches([' ', '(', ')', '"']).to_owned();
                let call = ReadCall { kind: CallKind::Subprogram, name, arguments: String::new(), is_modal: false };
                block.commands.push(ReadCommand::Call(Box::new(call)));
                block.commands.push(line_macro(MacroKind::Call, line));
                self.source.note(NoteKind::NotEvaluated, line);
                self.variables.forget_all();
                self.state.modal.forget_motion();
            }
        }
        Ok(())
    }

    /// The label of `IF … GOTOF LABEL`.
    fn label_ahead(&self) -> Option<Vec<u8>> {
        let code = self.code.trim_ascii();
        let at = code.windows(5).position(|w| w == b"GOTOF")?;
        let label = code[at + 5..].trim_ascii();
        let is_name = label.len() > 1 && label.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_');
        let has_condition = code[..at].windows(2).any(|w| w == b"IF");
        (is_name && has_condition).then(|| label.to_vec())
    }

    /// `MSG("text")`.
    fn message(&self, line: &[u8], start: usize) -> Result<String, ReadError> {
        let code = SiemensCode { text: &self.code, source: &self.source, variables: &self.variables };
        let open = code.skip_blanks(start + code.name_length(start));
        if code.byte(open) != Some(b'(') {
            return Err(self.source.error(start, ReadFault::Expression(code.string(start..code.text.len()))));
        }
        let close = code.closing(open, b')')?;
        let behind = code.skip_blanks(close + 1);
        if let Some(byte) = code.byte(behind) {
            return Err(self.source.error(behind, ReadFault::Character(char::from(byte))));
        }
        let text = String::from_utf8_lossy(line[open + 1..close].trim_ascii()).into_owned();
        Ok(text.trim_matches('"').to_owned())
    }

    /// `DEF REAL A, B=5, C[3]`: what is not given begins as 0.
    fn definition(&mut self, start: usize) -> Result<(), ReadError> {
        let code = SiemensCode { text: &self.code, source: &self.source, variables: &self.variables };
        let mut values = Vec::new();
        // DEF and the type, which may have a length (`STRING[20]`).
        let mut at = code.skip_blanks(start + code.name_length(start));
        loop {
            let length = code.name_length(at);
            let name = code.string(at..at + length);
            at = code.skip_blanks(at + length);
            if length == 0 {
                break;
            }
            let is_more = ["SYNR", "SYNW", "SYNRW", "CHAN", "NCK"].contains(&name.as_str());
            if !is_more {
                if code.byte(at) == Some(b'[') {
                    at = code.skip_blanks(code.closing(at, b']')? + 1);
                }
                break;
            }
        }
        loop {
            let length = code.name_length(at);
            if length < 2 {
                let text = code.string(start..code.text.len()).trim_end().to_owned();
                return Err(self.source.error(at.min(code.text.len().saturating_sub(1)), ReadFault::Expression(text)));
            }
            let name = code.text[at..at + length].to_vec();
            at = code.skip_blanks(at + length);
            let mut value = Some(0.0);
            if code.byte(at) == Some(b'[') {
                at = code.skip_blanks(code.closing(at, b']')? + 1);
                value = None;
            }
            if code.byte(at) == Some(b'=') {
                let parsed = expression::parse(code.text, at + 1, Syntax::Parentheses, code.variables);
                let fault = |at: usize| {
                    let text = code.string(start..code.text.len()).trim_end().to_owned();
                    self.source.error(at.min(code.text.len() - 1), ReadFault::Expression(text))
                };
                let parsed = parsed.map_err(fault)?;
                (value, at) = (parsed.value, code.skip_blanks(parsed.end));
            }
            values.push((name, value));
            match code.byte(at) {
                Some(b',') => at = code.skip_blanks(at + 1),
                None => break,
                Some(byte) => return Err(self.source.error(at, ReadFault::Character(char::from(byte)))),
            }
        }
        for (name, value) in values {
            self.variables.set(&name, value);
        }
        Ok(())
    }

    /// Takes note of assignments, behind all words: those still had the values before.
    pub(super) fn assign(&mut self, line: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let mut is_plain = false;
        for item in self.items.iter().filter(|i| is_assignment(i, &self.code)) {
            let name = &self.code[item.name.clone()];
            match name.first() {
                // Data of the control itself: offsets, tool data.
                Some(b'$') => {
                    self.state.modal.set_frame();
                    block.commands.push(line_macro(MacroKind::Setting, line));
                    self.source.note(NoteKind::NotEvaluated, line);
                }
                _ => {
                    is_plain = true;
                    // R5 is R[5]; an element of a field is not remembered.
                    // Whether a block with `/` is run, a switch decides.
                    self.variables.set(name, item.number().filter(|_| !block.skippable));
                }
            }
        }
        if is_plain {
            block.commands.push(line_macro(MacroKind::Assignment, line));
        }
        Ok(())
    }
}
