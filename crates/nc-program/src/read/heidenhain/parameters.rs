//! FN functions and formulas of Q parameters.

use crate::read::error::{ReadError, ReadFault};
use crate::read::heidenhain::words::HeidenhainCode;
use crate::read::heidenhain::{HeidenhainReader, guards, line_macro};
use crate::read::program::{MacroKind, NoteKind, ReadBlock};
use crate::read::values::expression::Syntax;
use crate::read::values::{expression, functions};

impl HeidenhainReader {
    /// `FN 1: Q1 = +Q2 + +5`.
    pub(super) fn fn_statement(
        &mut self,
        start: usize,
        at: usize,
        line: &[u8],
        block: &mut ReadBlock,
    ) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let digits = code.text[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        let number: Option<u32> = code.string(at..at + digits).parse().ok();
        let colon = code.skip_blanks(at + digits);
        if code.byte(colon) != Some(b':') {
            return Err(code.unknown(start));
        }
        let kind = match number {
            Some(0..=8 | 13) => return self.arithmetic(start, colon + 1, line, block),
            Some(function @ 9..=12) => {
                self.branch(function, colon + 1, line, block);
                return Ok(());
            }
            Some(14) => MacroKind::Alarm,
            // Text, tables that are written, waiting.
            Some(15 | 16 | 20 | 26 | 27 | 38) => MacroKind::Output,
            // Read from the control or a table into a parameter.
            Some(18 | 28) => MacroKind::Assignment,
            Some(17 | 19 | 29 | 37) => MacroKind::Setting,
            _ => return Err(code.unknown(start)),
        };
        match kind {
            MacroKind::Setting => {
                self.setting(line, block);
                return Ok(());
            }
            MacroKind::Alarm if !self.is_guarded() => self.source.note(NoteKind::Branch, line),
            _ => {}
        }
        if kind != MacroKind::Output {
            self.variables.forget_all();
        }
        block.commands.push(line_macro(kind, line));
        Ok(())
    }

    /// FN 9 to FN 12. One whose values say that it does not jump is passed by.
    fn branch(&mut self, function: u32, at: usize, line: &[u8], block: &mut ReadBlock) {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let condition = guards::condition(&code, function, at);
        if condition.is_met != Some(false) {
            self.variables.forget_all();
            if !self.open_guard(block.line, line, condition) {
                self.source.note(NoteKind::Branch, line);
            }
        }
        block.commands.push(line_macro(MacroKind::Branch, line));
    }

    /// FN 0 to 8 and 13: one value, a function of one, or two with an operator.
    fn arithmetic(&mut self, start: usize, at: usize, line: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let (name, mut at) = target(&code, start, at)?;
        let fault = |at: usize| no_expression(&code, start, at);
        let value =
            |at: usize| expression::parse_value(code.text, at, Syntax::Parentheses, code.variables).map_err(fault);
        let (function, behind) = code.name(code.skip_blanks(at));
        let result = if matches!(function, b"SQRT" | b"SIN" | b"COS") {
            let argument = value(behind)?;
            at = argument.end;
            argument.value.and_then(|x| functions::of_one(function, x))
        } else {
            let first = value(at)?;
            at = code.skip_blanks(first.end);
            match code.byte(at) {
                None => first.value,
                Some(byte) => {
                    let (word, behind) = code.name(at);
                    let operand = if word.is_empty() { at + 1 } else { behind };
                    let second = value(operand)?;
                    let operator = if word.is_empty() { vec![byte] } else { word.to_vec() };
                    at = second.end;
                    match (&*operator, first.value, second.value) {
                        (b"+" | b"-" | b"*" | b"DIV" | b"/" | b"LEN" | b"ANG", None, _) => None,
                        (b"+" | b"-" | b"*" | b"DIV" | b"/" | b"LEN" | b"ANG", _, None) => None,
                        (b"+", Some(a), Some(b)) => Some(a + b),
                        (b"-", Some(a), Some(b)) => Some(a - b),
                        (b"*", Some(a), Some(b)) => Some(a * b),
                        (b"DIV" | b"/", Some(a), Some(b)) => Some(a / b),
                        (b"LEN", Some(a), Some(b)) => Some(a.hypot(b)),
                        // In the whole circle, from the opposite and the adjacent side.
                        (b"ANG", Some(a), Some(b)) => Some(a.atan2(b).to_degrees().rem_euclid(360.0)),
                        _ => return Err(no_expression(&code, start, first.end)),
                    }
                }
            }
        };
        if code.skip_blanks(at) < code.text.len() {
            return Err(no_expression(&code, start, code.skip_blanks(at)));
        }
        let is_kept = !block.skippable && !is_of_control(&name);
        self.variables.set(&name, result.filter(|v| v.is_finite() && is_kept));
        block.commands.push(line_macro(MacroKind::Assignment, line));
        Ok(())
    }

    /// `Q1 = Q2 * SIN (Q3 + 5)`, `QS1 = "text"`.
    pub(super) fn formula(&mut self, start: usize, line: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let (name, at) = target(&code, start, start)?;
        if name.starts_with(b"QS") {
            block.commands.push(line_macro(MacroKind::Assignment, line));
            return Ok(());
        }
        let fault = |at: usize| no_expression(&code, start, at);
        let parsed = expression::parse(code.text, at, Syntax::Parentheses, code.variables).map_err(fault)?;
        let end = code.skip_blanks(parsed.end);
        if end < code.text.len() {
            return Err(no_expression(&code, start, end));
        }
        let is_kept = !block.skippable && !is_of_control(&name);
        self.variables.set(&name, parsed.value.filter(|_| is_kept));
        block.commands.push(line_macro(MacroKind::Assignment, line));
        Ok(())
    }
}

/// Q100 to Q199: the control itself sets them, such as Q114 at a tool call.
fn is_of_control(name: &[u8]) -> bool {
    matches!(name, [b'Q', b'1', a, b] if a.is_ascii_digit() && b.is_ascii_digit())
}

/// `Q1 =` at a byte: the parameter, and the byte behind the sign.
fn target(code: &HeidenhainCode, start: usize, at: usize) -> Result<(Vec<u8>, usize), ReadError> {
    let at = code.skip_blanks(at);
    let rest = &code.text[at.min(code.text.len())..];
    let length = rest.iter().take_while(|b| b.is_ascii_alphanumeric()).count();
    let equals = code.skip_blanks(at + length);
    let is_parameter = rest.first() == Some(&b'Q') && rest[..length].last().is_some_and(u8::is_ascii_digit);
    if !is_parameter || code.byte(equals) != Some(b'=') {
        return Err(no_expression(code, start, at));
    }
    Ok((rest[..length].to_vec(), equals + 1))
}

fn no_expression(code: &HeidenhainCode, start: usize, at: usize) -> ReadError {
    let text = code.string(start..code.text.len()).trim_end().to_owned();
    code.source.error(at.min(code.text.len().saturating_sub(1)), ReadFault::Expression(text))
}
