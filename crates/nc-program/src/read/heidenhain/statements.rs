//! Beginnings of blocks, and their consequences.

use crate::read::error::{ReadError, ReadFault};
use crate::read::heidenhain::motion::TENTH_OF_INCH;
use crate::read::heidenhain::words::HeidenhainCode;
use crate::read::heidenhain::{HeidenhainReader, line_macro};
use crate::read::length_check::LengthVariables;
use crate::read::program::{CallKind, MacroKind, NoteKind, Plane, ReadBlock, ReadCall, ReadCommand, ToolLengthNote};
use crate::read::unfollowed::Cause;
use crate::read::values::expression;
use crate::read::values::expression::Syntax;
use crate::words::said_words::StateWord;

impl HeidenhainReader {
    /// Reads a block; the name of what may go on in the next line.
    pub(super) fn statement(
        &mut self,
        line: &[u8],
        start: usize,
        block: &mut ReadBlock,
    ) -> Result<Option<String>, ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let (first, second_at) = code.name(start);
        let (second, third_at) = code.name(second_at);
        let rest = |at: usize| code.string(at..code.text.len()).trim().to_owned();
        match (first, second) {
            (b"BEGIN", b"PGM") => self.begin(third_at, block),
            (b"END", b"PGM") => {
                block.sets_state = false;
                block.commands.push(ReadCommand::End);
            }
            (b"BLK", b"FORM") | (b"WITH", b"STOCK") => block.commands.push(line_macro(MacroKind::Output, line)),
            (b"TOOL", b"CALL") => self.tool_call(third_at, line, block)?,
            (b"TOOL", b"DEF") => self.tool_definition(third_at, line, block)?,
            (b"CYCL", b"DEF") => return Ok(Some(self.cycle_definition(start, third_at, line, block)?)),
            (b"CYCL", b"CALL") => self.cycle_call(third_at, line, block),
            (b"TCH", b"PROBE") => {
                let name = format!("TCH PROBE {}", rest(third_at).split_whitespace().next().unwrap_or_default());
                self.moving_cycle(&name, &rest(third_at), line, block);
                return Ok(Some(name));
            }
            (b"PATTERN" | b"CONTOUR", b"DEF") | (b"SEL", b"PATTERN" | b"CONTOUR" | b"CYCLE") => {
                let name = code.string(start..third_at).trim().to_owned();
                let arguments = rest(third_at);
                push_call(block, CallKind::Definition, name.clone(), arguments, false);
                return Ok(Some(name));
            }
            (b"SEL", b"PGM" | b"TABLE") => {
                push_call(
                    block,
                    CallKind::Definition,
                    code.string(start..third_at).trim().to_owned(),
                    rest(third_at),
                    false,
                );
            }
            (b"CALL", _) => self.call(start, second_at, line, block),
            (b"LBL", _) => {
                push_call(block, CallKind::Label, format!("LBL {}", rest(second_at)), String::new(), false);
                self.variables.forget_all();
            }
            (b"PLANE", _) => {
                let (name, arguments) = (format!("PLANE {}", String::from_utf8_lossy(second)), rest(third_at));
                self.plane(&name, &arguments, line, block);
                return Ok(Some(name));
            }
            (b"TRANS" | b"FUNCTION", _) => return self.function_statement(start, line, block),
            (b"FN", _) => {
                let bound = self.length_check(start);
                self.fn_statement(start, second_at, line, block)?;
                self.guard_bound(block.line, bound);
            }
            (b"Q" | b"QL" | b"QR" | b"QS", _) => {
                self.length_check(start);
                self.formula(start, line, block)?;
            }
            (b"DECLARE", _) | (b"IF", _) => self.branch_or_text(first == b"IF", line, block),
            (b"STOP", _) => {
                block.commands.push(ReadCommand::Stop { optional: false });
                self.motion_block(b"L", second_at, line, block)?;
            }
            (b"L" | b"LN" | b"LP" | b"CC" | b"CR" | b"CP", _) => {
                let first = first.to_vec();
                self.motion_block(&first, second_at, line, block)?;
            }
            // `C+30` is the axis.
            (b"C", _) if !self.code.get(start + 1).is_some_and(|b| matches!(b, b'+' | b'-' | b'0'..=b'9')) => {
                self.motion_block(b"C", second_at, line, block)?;
            }
            (b"CT" | b"CTP" | b"RND" | b"CHF" | b"APPR" | b"DEP", _) => {
                let is_corner = matches!(first, b"RND" | b"CHF");
                let is_departure = first == b"DEP";
                let why = "an arc or corner that follows from the blocks around it is not followed";
                self.contour(start, if is_corner { Cause::Corner } else { Cause::Block }, why, block);
                if is_departure {
                    self.state.modal.unfollowed.end(Cause::Radius);
                }
            }
            (b"FPOL" | b"FL" | b"FLT" | b"FC" | b"FCT" | b"FSELECT" | b"SPL", _) => {
                self.contour(start, Cause::Block, "free contours and splines are not followed", block);
            }
            _ if first.len() > 2 && code.words(start).is_err() => {
                // A statement that is not known may move, call or set anything.
                block.commands.push(line_macro(MacroKind::Call, line));
                self.state.modal.forget_motion();
                self.state.pole = [None; 3];
                self.state.polar = [None; 2];
            }
            // A block of words alone: M functions, or one axis.
            _ => self.motion_block(b"L", start, line, block)?,
        }
        Ok(None)
    }

    /// A block of a contour whose words say no positions by themselves; its M functions are read.
    fn contour(&mut self, start: usize, cause: Cause, why: &'static str, block: &mut ReadBlock) {
        let text = String::from_utf8_lossy(&self.code[start..]).into_owned();
        self.state.modal.unfollowed.begin(cause, why);
        if cause != Cause::Corner {
            self.state.modal.feed = None;
        }
        for word in text.split_whitespace() {
            match word {
                "RL" | "RR" => {
                    let why = "cutter radius compensation moves the tool off the words";
                    self.state.modal.unfollowed.begin(Cause::Radius, why);
                }
                "R0" => self.state.modal.unfollowed.end(Cause::Radius),
                _ => {
                    if let Some(code) = word.strip_prefix('M').and_then(|number| number.parse().ok()) {
                        if self.state.simple_function(code, block) {
                            continue;
                        }
                        let why = "a function beside a contour that changes what later words mean is not followed";
                        self.state.modal.unfollowed.begin(Cause::Forever, why);
                    }
                }
            }
        }
    }

    /// Takes note of the length that a line compares that of the tool with; returns a bound.
    fn length_check(&mut self, start: usize) -> Option<ToolLengthNote> {
        self.source.length_check(&self.code[start..], LengthVariables::QParameter, self.state.modal.is_inch)
    }

    /// `BEGIN PGM name MM`.
    fn begin(&mut self, at: usize, block: &mut ReadBlock) {
        let text = String::from_utf8_lossy(&self.code[at..]).trim().to_owned();
        let is_inch = text.split_whitespace().next_back() == Some("INCH");
        self.state.modal.is_inch = is_inch;
        self.state.modal.inch_feed = is_inch.then_some(TENTH_OF_INCH);
        block.said.add(StateWord::Unit);
        block.commands.push(ReadCommand::Comment(text));
    }

    /// `TOOL CALL 5 Z S3000 F500 DL+0.1`, `TOOL CALL "NAME" Z`, `TOOL CALL S4000`.
    fn tool_call(&mut self, mut at: usize, line: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let mut has_unknown = false;
        let mut changes_length = false;
        let mut tool = None;
        match code.byte(at) {
            Some(b'"') => {
                let end = code.text[at + 1..].iter().position(|b| *b == b'"').map(|n| at + 1 + n);
                let end =
                    end.ok_or_else(|| code.source.error(at, ReadFault::Expression(code.string(at..code.text.len()))))?;
                let name = String::from_utf8_lossy(&line[at + 1..end]).into_owned();
                block.commands.extend([ReadCommand::ToolName(name), ReadCommand::ToolChange]);
                tool = Some(Some(0));
                at = end + 1;
            }
            Some(b'0'..=b'9' | b'Q' | b'+') => {
                let parsed = expression::parse_value(code.text, at, Syntax::Parentheses, code.variables);
                let parsed = parsed.map_err(|at| code.unknown(at.min(code.text.len() - 1)))?;
                let number = parsed.value.filter(|v| (0.0..=99_999_999.0).contains(v));
                match (parsed.value, number) {
                    (Some(_), None) => {
                        return Err(code.source.error(at, ReadFault::Number(code.string(at..parsed.end))));
                    }
                    (_, Some(n)) if n.fract() == 0.0 => {
                        block.commands.push(ReadCommand::Tool(n as u32));
                        tool = Some((n > 0.0).then_some(n as u32));
                    }
                    // A step of an indexed tool.
                    (_, Some(_)) => {
                        block.commands.push(ReadCommand::ToolName(code.string(at..parsed.end)));
                        tool = Some(Some(0));
                    }
                    (None, None) => (has_unknown, tool) = (true, Some(Some(0))),
                }
                block.commands.push(ReadCommand::ToolChange);
                at = parsed.end;
            }
            _ => {}
        }
        let mut feed = None;
        let mut plane = None;
        loop {
            at = code.skip_blanks(at);
            let rest = &code.text[at.min(code.text.len())..];
            let Some(byte) = rest.first() else { break };
            let is_value =
                |at: usize| code.byte(at).is_some_and(|b| matches!(b, b'+' | b'-' | b'.' | b'Q' | b'0'..=b'9'));
            let name = [&b"DR2"[..], b"DL", b"DR", b"S", b"F"].into_iter().find(|name| rest.starts_with(name));
            match (name, byte) {
                (Some(name), _) => {
                    let value_at = code.skip_blanks(at + name.len());
                    let parsed = expression::parse_value(code.text, value_at, Syntax::Parentheses, code.variables);
                    let Some(parsed) = parsed.ok().filter(|_| is_value(value_at)) else {
                        let end = value_at.min(code.text.len());
                        return Err(code
                            .source
                            .error(at, ReadFault::Number(code.string(at..end).trim_end().to_owned())));
                    };
                    match name {
                        b"S" => block.commands.extend(parsed.value.map(ReadCommand::SpindleSpeed)),
                        b"F" => feed = Some(parsed.value),
                        b"DL" => changes_length = parsed.value != Some(0.0),
                        _ => {}
                    }
                    has_unknown |= parsed.value.is_none();
                    at = parsed.end;
                }
                (None, b'X' | b'Y' | b'Z') => {
                    plane = Some([Plane::Yz, Plane::Zx, Plane::Xy][usize::from(byte - b'X')]);
                    at += 1;
                }
                _ => return Err(code.unknown(at)),
            }
        }
        if let Some(tool) = tool {
            self.state.tool = tool;
            self.state.tool_feed = feed.flatten();
            self.state.update_compensation();
        } else if let Some(feed) = feed {
            self.state.tool_feed = feed;
        }
        self.state.modal.plane = plane.unwrap_or(self.state.modal.plane);
        if changes_length {
            self.setting(line, block);
        }
        if has_unknown {
            block.commands.push(line_macro(MacroKind::VariableWords, line));
        }
        Ok(())
    }

    /// `TOOL DEF 7` makes a tool ready; with L or R it sets its length and radius.
    fn tool_definition(&mut self, at: usize, line: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let text = code.string(at..code.text.len());
        match text.trim().parse() {
            Ok(number) => block.commands.push(ReadCommand::NextTool(number)),
            Err(_) if text.trim().is_empty() => {
                return Err(code
                    .source
                    .error(at.min(code.text.len().saturating_sub(1)), ReadFault::Number("TOOL DEF".into())));
            }
            Err(_) if text.trim().starts_with(['"', 'Q']) => {}
            Err(_) => self.setting(line, block),
        }
        Ok(())
    }

    /// `CALL LBL 5 REP 3`, `CALL PGM NAME.H`, `CALL SELECTED PGM`.
    fn call(&mut self, start: usize, at: usize, line: &[u8], block: &mut ReadBlock) {
        let end = self.code.trim_ascii_end().len().max(at);
        let text = String::from_utf8_lossy(line[at.min(line.len())..end.min(line.len())].trim_ascii()).into_owned();
        let repetition = text.to_ascii_uppercase().find(" REP");
        let (name, arguments) = repetition.map_or((&*text, ""), |at| text.split_at(at));
        push_call(block, CallKind::Subprogram, name.trim().to_owned(), arguments.trim().to_owned(), false);
        block.commands.push(line_macro(MacroKind::Call, &line[start..]));
        self.state.modal.forget_motion();
        self.state.pole = [None; 3];
        self.state.polar = [None; 2];
    }

    /// A tilted plane: TURN and MOVE turn the rotary axes at once, STAY does not. PLANE RESET STAY
    /// moves nothing, and behind it words count as before any tilt.
    fn plane(&mut self, name: &str, arguments: &str, line: &[u8], block: &mut ReadBlock) {
        push_call(block, CallKind::Cycle, name.to_owned(), arguments.to_owned(), false);
        let stays = arguments.split_whitespace().any(|word| word == "STAY");
        let is_reset = name == "PLANE RESET";
        let was_tilted = std::mem::replace(&mut self.state.is_tilted, !is_reset);
        if stays && is_reset {
            if was_tilted {
                self.state.modal.position.forget_words();
                self.state.pole = [None; 3];
            }
        } else if stays {
            self.setting(line, block);
        } else {
            self.state.modal.position.forget_all();
            block.commands.push(line_macro(MacroKind::Call, line));
        }
    }

    /// `FUNCTION …` and `TRANS …`.
    fn function_statement(
        &mut self,
        start: usize,
        line: &[u8],
        block: &mut ReadBlock,
    ) -> Result<Option<String>, ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let text = code.string(start..code.text.len());
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            ["FUNCTION", "TCPM", arguments @ ..] => {
                let joined = arguments.join(" ");
                let unfollowed = &mut self.state.modal.unfollowed;
                if joined.contains("AXIS SPAT") {
                    unfollowed.begin(Cause::Vectors, "angles of the tool instead of a vector are not followed");
                } else if joined.contains("REFPNT") && !joined.contains("REFPNT TIP-TIP") {
                    unfollowed
                        .begin(Cause::Vectors, "words of another point of the tool than its tip are not followed");
                } else {
                    unfollowed.end(Cause::Vectors);
                }
                self.state.has_tcpm = true;
                self.state.has_axis_feed = joined.contains("F CONT");
                block.commands.push(ReadCommand::Mode(words.join(" ")));
                self.state.update_compensation();
            }
            ["FUNCTION", "RESET", "TCPM"] => {
                block.said.add(StateWord::RtcpOff);
                self.state.modal.unfollowed.end(Cause::Vectors);
                self.state.has_tcpm = false;
                self.state.update_compensation();
            }
            ["FUNCTION", "MODE", "MILL"] => self.state.modal.unfollowed.end(Cause::Mapping),
            ["FUNCTION", "MODE", "MILL", ..] => {
                self.state
                    .modal
                    .unfollowed
                    .begin(Cause::Forever, "kinematics that are chosen by a name are not followed");
            }
            ["FUNCTION", "MODE", ..] => {
                self.state.modal.unfollowed.begin(Cause::Mapping, "a mode other than milling is not followed");
            }
            ["FUNCTION", "DWELL", rest @ ..] => {
                let seconds = rest.concat().strip_prefix("TIME").and_then(|t| t.parse().ok());
                block.commands.push(ReadCommand::Dwell(seconds.filter(|s: &f64| s.is_finite()).unwrap_or(0.0)));
            }
            ["TRANS", "DATUM" | "MIRROR" | "ROTATION" | "SCALE", "RESET"] => self.cancel_frame(),
            _ => {
                let name = words.iter().take(2).copied().collect::<Vec<_>>().join(" ");
                self.setting(line, block);
                return Ok(Some(name));
            }
        }
        Ok(Some("FUNCTION".to_owned()))
    }

    /// Something that the words depend on is set.
    pub(super) fn setting(&mut self, line: &[u8], block: &mut ReadBlock) {
        self.state.modal.set_frame();
        self.state.pole = [None; 3];
        block.commands.push(line_macro(MacroKind::Setting, line));
    }

    /// A frame is switched off, which none is taken to be on before.
    pub(super) fn cancel_frame(&mut self) {
        self.state.modal.cancel_frame();
        if self.state.modal.has_frame {
            self.state.pole = [None; 3];
        }
    }

    pub(super) fn branch_or_text(&mut self, is_branch: bool, line: &[u8], block: &mut ReadBlock) {
        self.variables.forget_all();
        if is_branch {
            self.source.note(NoteKind::Branch, line);
        }
        block.commands.push(line_macro(if is_branch { MacroKind::Branch } else { MacroKind::Assignment }, line));
    }
}

pub(super) fn push_call(block: &mut ReadBlock, kind: CallKind, name: String, arguments: String, is_modal: bool) {
    block.commands.push(ReadCommand::Call(Box::new(ReadCall { kind, name, arguments, is_modal })));
}
