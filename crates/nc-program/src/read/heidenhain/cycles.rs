//! Cycles: described, run, and what they set at once.

use crate::program::WorkOffset;
use crate::read::error::{ReadError, ReadFault};
use crate::read::heidenhain::statements::push_call;
use crate::read::heidenhain::words::HeidenhainCode;
use crate::read::heidenhain::{HeidenhainReader, line_macro};
use crate::read::program::{CallKind, MacroKind, ReadBlock, ReadCommand};
use crate::read::values::expression;
use crate::read::values::expression::Syntax;
use crate::words::said_words::StateWord;

/// Effect of a definition at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Effect {
    /// Nothing before it is called.
    None,
    /// It changes the frame of the words.
    Frame,
    /// It selects the preset that words refer to.
    Preset,
    /// A pause.
    Dwell,
    /// It runs at once, or it is not known.
    Runs,
}

fn effect(number: u32) -> Effect {
    match number {
        // Tolerance, and what is run where it is called: drilling, pockets, studs, slots, contours,
        // a program, facing.
        32
        | 1..=6
        | 12..=18
        | 20..=25
        | 27..=29
        | 39
        | 200..=209
        | 225
        | 230..=233
        | 240
        | 241
        | 251..=258
        | 262..=267
        | 270..=276 => Effect::None,
        7 | 8 | 10 | 11 | 19 | 26 => Effect::Frame,
        247 => Effect::Preset,
        9 => Effect::Dwell,
        _ => Effect::Runs,
    }
}

/// Effect of a line of a cycle that sets a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FrameStep {
    /// `CYCL DEF 7.0 DATUM SHIFT`: nothing; what it is to be follows.
    Title,
    /// It takes back what it names.
    Off,
    /// It sets a frame, or what it does is not known.
    On,
}

/// `arguments` is the text behind the cycle's number: `.1 X+10`. Off are shifts and turns of 0,
/// factors of 1 and a mirror without axes. A tilt is never off here.
fn frame_step(number: u32, arguments: &str) -> FrameStep {
    let (step, words) = arguments.split_once(' ').unwrap_or((arguments, ""));
    if step == ".0" && number != 19 && is_title(words) {
        return FrameStep::Title;
    }
    let text: String = words.split_whitespace().collect();
    let all = |is_off: fn(&str, f64) -> bool| {
        words_of(&text).is_some_and(|words| !words.is_empty() && words.iter().all(|(name, value)| is_off(name, *value)))
    };
    let is_off = match number {
        7 => all(|_, value| value == 0.0),
        8 => step == ".1" && text.is_empty(),
        10 => all(|name, value| matches!(name, "ROT" | "IROT") && value == 0.0),
        11 => all(|name, value| name == "SCL" && value == 1.0),
        26 => all(|name, value| name.starts_with("CC") || value == 1.0),
        _ => false,
    };
    if is_off { FrameStep::Off } else { FrameStep::On }
}

/// Whether the text behind `.0` is a name alone: letters, as `AXIS-SPEC. SCALING` has them, no
/// single one that would be an axis, and no number or parameter.
fn is_title(words: &str) -> bool {
    let is_name =
        |word: &str| word.len() > 1 && word.bytes().all(|b| b.is_ascii_alphabetic() || matches!(b, b'-' | b'.'));
    words.split_whitespace().all(is_name)
}

/// Names and numbers of a text without blanks (`X+0Y+0`); `None` where it is anything else.
fn words_of(mut text: &str) -> Option<Vec<(&str, f64)>> {
    let mut all = Vec::new();
    while !text.is_empty() {
        let (name, rest) = text.split_at(text.find(|c: char| !c.is_ascii_uppercase())?);
        let end = rest.find(|c: char| c.is_ascii_uppercase()).unwrap_or(rest.len());
        let (value, rest) = rest.split_at(end);
        if name.is_empty() {
            return None;
        }
        all.push((name, value.parse().ok()?));
        text = rest;
    }
    Some(all)
}

impl HeidenhainReader {
    /// `CYCL DEF 200 DRILLING Q200=2 …`, `CYCL DEF 7.1 X+10`; the cycle's name.
    pub(super) fn cycle_definition(
        &mut self,
        start: usize,
        at: usize,
        line: &[u8],
        block: &mut ReadBlock,
    ) -> Result<String, ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let digits = code.text[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        let name = code.string(at..at + digits);
        let fault = |_| code.source.error(start, ReadFault::Number(code.string(start..at + digits).trim().to_owned()));
        let number: u32 = name.parse().map_err(fault)?;
        let arguments = code.string(at + digits..code.text.len()).trim().to_owned();
        match effect(number) {
            Effect::None => push_call(block, CallKind::Definition, name.clone(), arguments, false),
            Effect::Frame => {
                let step = frame_step(number, &arguments);
                push_call(block, CallKind::Definition, name.clone(), arguments, false);
                self.state.is_tilted |= number == 19;
                match step {
                    FrameStep::Title => {}
                    FrameStep::Off => self.cancel_frame(),
                    FrameStep::On => self.setting(line, block),
                }
            }
            Effect::Preset => push_call(block, CallKind::Definition, name.clone(), arguments, false),
            Effect::Dwell => {
                if let Some(seconds) = arguments.split_once("DWELL").and_then(|(_, s)| s.trim().parse::<f64>().ok()) {
                    block.commands.push(ReadCommand::Dwell(seconds));
                }
                push_call(block, CallKind::Definition, name.clone(), arguments, false);
            }
            Effect::Runs => self.moving_cycle(&name, &arguments, line, block),
        }
        self.take_parameters(at + digits);
        if number == 247 && line.trim_ascii_end().last() != Some(&b'~') {
            self.preset(at + digits, line, block);
        }
        Ok(name)
    }

    /// Something of the control that moves the axes by itself.
    pub(super) fn moving_cycle(&mut self, name: &str, arguments: &str, line: &[u8], block: &mut ReadBlock) {
        push_call(block, CallKind::Cycle, name.to_owned(), arguments.to_owned(), false);
        self.state.modal.position.forget_all();
        block.commands.push(line_macro(MacroKind::Call, line));
    }

    /// `CYCL CALL`, `CYCL CALL POS …`, `CYCL CALL PAT`: where the tool is behind it, the cycle
    /// says.
    pub(super) fn cycle_call(&mut self, at: usize, line: &[u8], block: &mut ReadBlock) {
        let arguments = String::from_utf8_lossy(&self.code[at..]).trim().to_owned();
        push_call(block, CallKind::Defined, "CYCL CALL".to_owned(), arguments.clone(), false);
        self.state.modal.position.forget_all();
        block.commands.push(line_macro(MacroKind::Call, line));
        let functions = arguments.split_whitespace().filter_map(|w| w.strip_prefix('M')?.parse::<u32>().ok());
        for code in functions {
            self.state.simple_function(code, block);
        }
    }

    /// A further line of what the line before began.
    pub(super) fn continuation(&mut self, name: &str, line: &[u8], start: usize, block: &mut ReadBlock) {
        let end = self.code.trim_ascii_end().len().max(start);
        let arguments = String::from_utf8_lossy(line[start..end].trim_ascii()).into_owned();
        push_call(block, CallKind::Arguments, name.to_owned(), arguments, false);
        self.take_parameters(start);
        if name == "247" {
            self.preset(start, line, block);
        }
    }

    /// Selects the preset that Q339 of these arguments says.
    fn preset(&mut self, start: usize, line: &[u8], block: &mut ReadBlock) {
        let is_said = self.code[start..].windows(4).any(|word| word == b"Q339");
        let number = self.variables.get(b"Q339").filter(|n| is_said && n.fract() == 0.0 && (1.0..1e4).contains(n));
        match number.and_then(|n| WorkOffset::new(n as u16)) {
            Some(offset) => {
                block.said.add(StateWord::WorkOffset);
                self.state.modal.set_offset(offset);
            }
            None => self.setting(line, block),
        }
    }

    /// Sets the Q parameters that are among arguments.
    fn take_parameters(&mut self, start: usize) {
        let mut at = start;
        while let Some(found) = self.code[at.min(self.code.len())..].iter().position(|b| *b == b'=') {
            let equals = at + found;
            let name = self.code[..equals].trim_ascii_end();
            let length = name.iter().rev().take_while(|b| b.is_ascii_alphanumeric()).count();
            let name = name[name.len() - length..].to_vec();
            let parsed = expression::parse(&self.code, equals + 1, Syntax::Parentheses, &self.variables);
            let value = parsed.ok().and_then(|p| p.value);
            self.variables.set(&name, value);
            at = equals + 1;
        }
    }
}
