//! Macro text: what it is, and what it makes unknown.

use crate::read::fanuc::reader::{FanucGuard, FanucReader};
use crate::read::program::{CallKind, MacroKind, NoteKind, ReadBlock, ReadCall, ReadCommand};

impl FanucReader {
    /// A check that raises an alarm or goes on leaves the way as it is written: it takes three
    /// blocks, the branch, the alarm, and the label; or, with words of LinuxCNC, `On IF`, comments
    /// (one of which may be the alarm), and `On ENDIF`. Any other branch may skip blocks or repeat
    /// them, and is noted.
    pub(super) fn follow_guard(&mut self, block: &ReadBlock, kind: Option<MacroKind>, text: &[u8]) {
        let mut is_guarded = false;
        if let Some(guard) = self.guard.take() {
            if guard.is_word {
                if kind == Some(MacroKind::Branch) && self.o_word() == Some((guard.label, b"ENDIF".as_slice())) {
                    guard.bound.into_iter().for_each(|bound| bound.add_check(&mut self.tool_lengths));
                    return;
                }
                self.notes.add(guard.line, NoteKind::Branch, guard.text.as_bytes());
            } else if !guard.has_alarm && kind == Some(MacroKind::Alarm) {
                self.guard = Some(FanucGuard { has_alarm: true, ..guard });
                is_guarded = true;
            } else if !guard.has_alarm || block.number != Some(guard.label) {
                self.notes.add(guard.line, NoteKind::Branch, guard.text.as_bytes());
            } else {
                guard.bound.into_iter().for_each(|bound| bound.add_check(&mut self.tool_lengths));
            }
        }
        let is_branch = kind == Some(MacroKind::Branch);
        let word = self.o_word().filter(|(_, code)| is_branch && code.starts_with(b"IF["));
        let label = word.map(|(label, _)| label).or_else(|| self.branch_label().filter(|_| is_branch));
        match (kind, label) {
            (Some(MacroKind::Branch), Some(label)) => {
                let text = String::from_utf8_lossy(text).into();
                let is_word = word.is_some();
                self.guard = Some(FanucGuard { is_word, line: block.line, text, label, has_alarm: false, bound: None });
            }
            (Some(MacroKind::Branch), None) => self.note(NoteKind::Branch, text),
            (Some(MacroKind::Alarm), _) if !is_guarded => self.note(NoteKind::Branch, text),
            _ => {}
        }
    }

    /// Number and code of `O100 IF […]`, `O100 ENDIF`.
    fn o_word(&self) -> Option<(u32, &[u8])> {
        let code = self.line.code.strip_prefix(b"O")?;
        let digits = code.iter().take_while(|b| b.is_ascii_digit()).count();
        let label = str::from_utf8(&code[..digits]).ok()?.parse().ok()?;
        Some((label, &code[digits..]))
    }

    /// The number of `IF […] GOTO n`.
    fn branch_label(&self) -> Option<u32> {
        let code = str::from_utf8(&self.line.code).ok()?;
        let (condition, label) = code.rsplit_once("GOTO")?;
        label.parse().ok().filter(|_| condition.contains("IF["))
    }

    /// Returns the kind of macro text of the code from `start` on, if it is any.
    pub(super) fn macro_kind(&self, start: usize) -> Option<MacroKind> {
        let code = &self.line.code[start..];
        let starts = |words: &[&[u8]]| words.iter().any(|w| code.starts_with(w));
        match code.first()? {
            b'O' => {
                let is_call = code.windows(4).any(|w| w == b"CALL");
                Some(if is_call { MacroKind::Call } else { MacroKind::Branch })
            }
            b'I' | b'G' | b'W' | b'D' | b'E' | b'T' | b'P' | b'B' if code.get(1)?.is_ascii_uppercase() => {
                if starts(&[b"IF", b"GOTO", b"WHILE", b"DO", b"END", b"THEN", b"ELSE"]) {
                    return Some(MacroKind::Branch);
                }
                starts(&[b"POPEN", b"PCLOS", b"DPRNT", b"BPRNT"]).then_some(MacroKind::Output)
            }
            b'#' => Some(assignment_kind(&code[1..])),
            _ => None,
        }
    }

    pub(super) fn keep_macro(&mut self, kind: Option<MacroKind>, text: &[u8], block: &mut ReadBlock) {
        let Some(kind) = kind else { return };
        match kind {
            MacroKind::Assignment | MacroKind::Alarm | MacroKind::Output => {}
            // The target of a branch is read as it is; the code that branches there may have set
            // any variable.
            MacroKind::Branch => {
                self.variables.forget_all();
                self.has_jumped |= self.line.code.windows(4).any(|w| w == b"GOTO");
            }
            MacroKind::Setting => {
                self.modal.set_frame();
                self.note(NoteKind::NotEvaluated, text);
            }
            MacroKind::ToolVector
            | MacroKind::Call
            | MacroKind::CallBehind
            | MacroKind::VariableWords
            | MacroKind::NotFollowed => {
                self.variables.forget_all();
                self.modal.forget_motion();
                self.note(NoteKind::NotEvaluated, text);
            }
        }
        if kind == MacroKind::Call {
            block.commands.push(ReadCommand::Call(Box::new(word_call(&self.line.code))));
        }
        block.sets_state = true;
        block.commands.push(ReadCommand::Macro { kind, text: String::from_utf8_lossy(text).into_owned() });
    }
}

/// `O<NAME>CALL[1][2]` or `O100CALL`, block number and `/` before it.
fn word_call(code: &[u8]) -> ReadCall {
    let text = String::from_utf8_lossy(code);
    let from_name = text.split_once('O').map_or(&*text, |(_, rest)| rest);
    let (name, arguments) = from_name.split_once("CALL").unwrap_or((from_name, ""));
    let name = name.trim_matches(['<', '>']).to_owned();
    ReadCall { kind: CallKind::Subprogram, name, arguments: arguments.to_owned(), is_modal: false }
}

/// Returns the kind of an assignment `#variable=…`: common variables hold numbers, system variables
/// hold offsets and settings.
pub(super) fn assignment_kind(variable: &[u8]) -> MacroKind {
    let digits = variable.iter().take_while(|b| b.is_ascii_digit()).count();
    let number: Option<u32> = str::from_utf8(&variable[..digits]).ok().and_then(|text| text.parse().ok());
    let is_plain_name =
        variable.starts_with(b"<") && !variable.starts_with(b"<_HAL") && !variable.starts_with(b"<_INI");
    match number {
        Some(3000) => MacroKind::Alarm,
        Some(0..1000) => MacroKind::Assignment,
        None if is_plain_name => MacroKind::Assignment,
        _ => MacroKind::Setting,
    }
}
