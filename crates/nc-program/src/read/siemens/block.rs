//! Effects of the words of a block on the state of the control.

use crate::program::Coolant;
use crate::read::error::{ReadError, ReadFault};
use crate::read::program::{MacroKind, ReadBlock, ReadCommand};
use crate::read::siemens::items::{Item, Value, is_assignment, is_vector};
use crate::read::siemens::names::Name;
use crate::read::siemens::{SiemensReader, State, line_macro, names};
use crate::read::source::Source;
use crate::read::unfollowed::Cause;
use crate::words::axis_words::AxisLetter;
use crate::words::said_words::StateWord;

/// mm per inch.
pub(super) const INCH: f64 = 25.4;

/// Role of the axis words of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Where to go.
    Target,
    /// Where to go, in machine values (SUPA, G153, G53).
    MachineTarget,
    /// Axes that go to the reference point, or to a fixed point of this number.
    Reference(u8),
    /// Values of a frame, a setting or a pole.
    Data,
    /// There are none: F and S are times (G4).
    Dwell,
}

/// A block being read. Its G words are in `g_codes`, its calls in `calls`, its moves in `motion`.
pub(super) struct SiemensBlock<'a> {
    pub(super) source: &'a Source,
    pub(super) state: &'a mut State,
    pub(super) code: &'a [u8],
    pub(super) items: &'a mut [Item],
    pub(super) line: &'a [u8],
    pub(super) block: &'a mut ReadBlock,
    pub(super) role: Role,
    pub(super) has_inch_feed: bool,
    /// A word whose value is not known.
    pub(super) has_unknown: bool,
}

impl SiemensReader {
    /// Resolves the items and fills the block; whether it gives a feed in inches.
    pub(super) fn interpret(&mut self, line: &[u8], block: &mut ReadBlock) -> Result<bool, ReadError> {
        let mut reading = SiemensBlock {
            source: &self.source,
            state: &mut self.state,
            code: &self.code,
            items: &mut self.items,
            line,
            block,
            role: Role::Target,
            has_inch_feed: false,
            has_unknown: false,
        };
        reading.check_repeated()?;
        reading.state.modal.position.start_block();
        reading.assignments();
        reading.g_codes()?;
        reading.names()?;
        reading.unfollowed_words();
        reading.functions()?;
        reading.tool_and_edge()?;
        reading.feed_and_speed()?;
        reading.motion()?;
        reading.check_all_used()?;
        reading.end_block();
        Ok(reading.has_inch_feed)
    }
}

impl SiemensBlock<'_> {
    /// Every word but G, M, H and those with an index of their own occurs once in a block.
    fn check_repeated(&self) -> Result<(), ReadError> {
        for (k, item) in self.items.iter().enumerate() {
            let name = &self.code[item.name.clone()];
            let is_axis = item.letter > 0 && !matches!(item.letter, b'G' | b'M' | b'H' | b'R');
            if is_axis && self.items[..k].iter().any(|other| &self.code[other.name.clone()] == name) {
                return Err(self.fault(item, ReadFault::Repeated));
            }
        }
        Ok(())
    }

    /// Assignments are done behind all words of the block.
    fn assignments(&mut self) {
        for item in &mut *self.items {
            item.is_used = is_assignment(item, self.code);
        }
    }

    fn names(&mut self) -> Result<(), ReadError> {
        for k in 0..self.items.len() {
            let item = self.items[k].clone();
            if item.is_used || item.letter > 0 || self.axis_of(&item).is_some() {
                continue;
            }
            self.items[k].is_used = true;
            let name = String::from_utf8_lossy(&self.code[item.name.clone()]).into_owned();
            match names::meaning(&name) {
                Some(meaning) => self.name(k, &item, meaning)?,
                None if matches!(item.value, Value::None | Value::Arguments(_)) => self.call(&item, &name)?,
                None if names::is_not_followed(&name) => self.setting(self.role),
                None => return Err(self.fault(&item, ReadFault::UnknownWord)),
            }
        }
        Ok(())
    }

    fn name(&mut self, k: usize, item: &Item, meaning: Name) -> Result<(), ReadError> {
        match meaning {
            Name::Mode => self.keep_mode(item),
            Name::TransformationOn | Name::TransformationOff => {
                self.state.is_transformed = meaning == Name::TransformationOn;
                let is_first = match &item.value {
                    Value::Arguments(bytes) => matches!(self.code[bytes.clone()].trim_ascii(), b"" | b"1"),
                    _ => true,
                };
                if self.state.is_transformed && !is_first {
                    self.leave(Cause::Mapping, "a transformation other than the first is not followed");
                }
                if meaning == Name::TransformationOff {
                    self.say(StateWord::RtcpOff);
                    self.state.modal.unfollowed.end(Cause::Mapping);
                }
                self.state.update_compensation();
            }
            Name::Frame => self.frame(item),
            Name::Setting => self.setting(self.role),
            Name::Machine => self.role = Role::MachineTarget,
            Name::ModalCall => self.modal_call(item)?,
            Name::SpindlePosition => self.block.commands.push(ReadCommand::Function(19)),
            // Of the arc or the fixed point, which take them.
            Name::Turns | Name::Radius | Name::Angle | Name::FixedPoint => self.items[k].is_used = false,
            Name::Return => {
                self.say(StateWord::Return);
                self.block.commands.push(ReadCommand::End);
            }
            // RNDM=0 ends what RNDM began.
            Name::NotFollowed(Cause::Corners, _) if item.number() == Some(0.0) => {
                self.state.modal.unfollowed.end(Cause::Corners);
            }
            Name::NotFollowed(cause, why) => self.leave(cause, why),
        }
        Ok(())
    }

    /// Stops following words, in this block or from here on.
    pub(super) fn leave(&mut self, cause: Cause, why: &'static str) {
        if cause == Cause::Path {
            self.state.modal.motion = None;
        }
        self.state.modal.unfollowed.begin(cause, why);
    }

    /// Words say no positions while what they do is not followed; of a corner they do, for later
    /// ones.
    fn unfollowed_words(&mut self) {
        let is_home = matches!(self.role, Role::Reference(_) | Role::Dwell);
        if self.state.modal.unfollowed.loses_all() && !is_home {
            self.role = Role::Data;
        }
    }

    /// Ends a block; nothing is known of an axis that any of its words may move.
    fn end_block(&mut self) {
        let moves = self.items.iter().any(|i| self.axis_of(i).is_some() || is_vector(i));
        self.state.modal.end_block(self.block, moves);
    }

    pub(super) fn say(&mut self, word: StateWord) {
        self.block.said.add(word);
    }

    /// Keeps a mode of the path as it stands.
    pub(super) fn keep_mode(&mut self, item: &Item) {
        let text = String::from_utf8_lossy(&self.line[item.span.clone()]).into_owned();
        self.block.commands.push(ReadCommand::Mode(text));
    }

    /// TRANS, ROT, SCALE and MIRROR alone in a block switch all programmable frames off, TOROTOF
    /// and PAROTOF those of the tool and the workpiece. All else sets a frame.
    fn frame(&mut self, item: &Item) {
        // Any other name with a value, as RPL, would be a variable.
        let is_alone = item.value == Value::None && self.items.len() == 1;
        let is_off =
            matches!(&self.code[item.name.clone()], b"TRANS" | b"ROT" | b"SCALE" | b"MIRROR" | b"TOROTOF" | b"PAROTOF");
        if is_alone && is_off {
            self.state.modal.cancel_frame();
        } else {
            self.setting(Role::Data);
        }
    }

    /// Something that the words depend on is set; in a block of data its axis words are part of it.
    pub(super) fn setting(&mut self, role: Role) {
        self.role = role;
        self.state.modal.set_frame();
        self.block.commands.push(line_macro(MacroKind::Setting, self.line));
    }

    fn functions(&mut self) -> Result<(), ReadError> {
        for k in 0..self.items.len() {
            if self.items[k].letter == b'M' && !self.items[k].is_used {
                let item = self.items[k].clone();
                self.items[k].is_used = true;
                if item.index > 0 {
                    self.block.commands.push(ReadCommand::Spindle(item.index.into()));
                }
                let Some(code) = self.whole(&item)? else { continue };
                self.function(code);
            }
        }
        Ok(())
    }

    fn function(&mut self, code: u32) {
        if code == 17 {
            self.say(StateWord::Return);
        }
        let command = match code {
            0 | 1 => ReadCommand::Stop { optional: code == 1 },
            2 | 17 | 30 => ReadCommand::End,
            3 | 4 => ReadCommand::SpindleOn { clockwise: code == 3 },
            5 => ReadCommand::SpindleOff,
            6 => {
                // By default, controls activate the first edge with a tool.
                self.state.edge = Some(1);
                self.state.update_compensation();
                ReadCommand::ToolChange
            }
            7 => ReadCommand::Coolant(Coolant::Mist),
            8 => ReadCommand::Coolant(Coolant::Flood),
            9 => ReadCommand::Coolant(Coolant::Off),
            _ => ReadCommand::Function(code),
        };
        self.block.commands.push(command);
    }

    fn tool_and_edge(&mut self) -> Result<(), ReadError> {
        if let Some(item) = self.take(b'T') {
            let command = match &item.value {
                Value::Text(bytes) => {
                    Some(ReadCommand::ToolName(String::from_utf8_lossy(&self.line[bytes.clone()]).into_owned()))
                }
                _ => self.whole(&item)?.map(ReadCommand::Tool),
            };
            // The name of the called tool precedes the change to it.
            self.block.commands.splice(0..0, command);
        }
        if let Some(item) = self.take(b'D') {
            match self.whole(&item)? {
                Some(edge) => {
                    self.say(StateWord::LengthRegister);
                    self.state.edge = Some(edge);
                    self.state.update_compensation();
                }
                None => self.setting(self.role),
            }
        }
        while let Some(item) = self.take(b'H') {
            let text = String::from_utf8_lossy(&self.line[item.span.clone()]).into_owned();
            self.block.commands.push(ReadCommand::Auxiliary(text));
        }
        Ok(())
    }

    fn feed_and_speed(&mut self) -> Result<(), ReadError> {
        if self.role == Role::Dwell {
            self.dwell();
            return Ok(());
        }
        while let Some(item) = self.take(b'S') {
            if !item.is_number() {
                return Err(self.fault(&item, ReadFault::Number));
            }
            if item.index > 0 {
                self.block.commands.push(ReadCommand::Spindle(item.index.into()));
            }
            let speed = item.number();
            self.has_unknown |= speed.is_none();
            self.block.commands.extend(speed.map(ReadCommand::SpindleSpeed));
        }
        let feed = self.take(b'F');
        if let Some(item) = feed {
            if !item.is_number() || item.index > 0 {
                return Err(self.fault(&item, ReadFault::Number));
            }
            let is_inch = self.state.has_inch_feed && !self.state.modal.inverse_time;
            self.has_inch_feed = is_inch;
            self.has_unknown |= item.number().is_none();
            self.state.modal.feed = item.number().map(|f| if is_inch { f * INCH } else { f });
            self.block.feed_place.set_word(item.span.clone(), item.value_start);
        } else if self.state.modal.inverse_time {
            // The time of another block is none of this one's.
            self.state.modal.feed = None;
        }
        Ok(())
    }

    /// F is s; S is turns of the spindle, whose time the text does not say.
    fn dwell(&mut self) {
        if let Some(item) = self.take(b'F') {
            self.has_unknown |= item.number().is_none();
            self.block.commands.extend(item.number().map(ReadCommand::Dwell));
        } else if self.take(b'S').is_some() {
            self.block.commands.push(ReadCommand::Dwell(0.0));
        }
    }

    fn check_all_used(&mut self) -> Result<(), ReadError> {
        for item in &*self.items {
            let is_known =
                self.axis_of(item).is_some() || matches!(item.letter, b'I' | b'J' | b'K' | b'P' | b'F' | b'S');
            let is_data = self.role == Role::Data && (is_known || self.state.modal.unfollowed.loses_all());
            if !item.is_used && !is_data {
                let is_word = is_known || item.letter == 0;
                return Err(self.fault(item, if is_word { ReadFault::StrayWord } else { ReadFault::UnknownWord }));
            }
        }
        if self.has_unknown {
            self.block.commands.push(line_macro(MacroKind::VariableWords, self.line));
        }
        Ok(())
    }

    /// The axis that an item is of: `X`, `X1`, `B2`; vectors (`A3`) are none.
    pub(super) fn axis_of(&self, item: &Item) -> Option<AxisLetter> {
        let is_vector = matches!(item.letter, b'A' | b'B' | b'C') && matches!(item.index, 3..=5);
        let axis =
            if item.letter > 0 && !is_vector { AxisLetter::new(char::from(item.letter), item.index) } else { None };
        axis.filter(|_| item.is_number())
    }

    /// The item of a letter that nothing has used, marked as used.
    pub(super) fn take(&mut self, letter: u8) -> Option<Item> {
        let item = self.items.iter_mut().find(|i| i.letter == letter && !i.is_used)?;
        item.is_used = true;
        Some(item.clone())
    }

    /// The item of a name that nothing has used, marked as used.
    pub(super) fn take_name(&mut self, name: &str) -> Option<Item> {
        let code = self.code;
        let is_it = |i: &&mut Item| i.letter == 0 && !i.is_used && &code[i.name.clone()] == name.as_bytes();
        let item = self.items.iter_mut().find(is_it)?;
        item.is_used = true;
        Some(item.clone())
    }

    /// A whole number, `None` where it is not known.
    pub(super) fn whole(&mut self, item: &Item) -> Result<Option<u32>, ReadError> {
        match item.value {
            Value::Number(Some(value), _) if value.fract() == 0.0 && (0.0..=99_999_999.0).contains(&value) => {
                Ok(Some(value as u32))
            }
            Value::Number(None, _) => {
                self.has_unknown = true;
                Ok(None)
            }
            _ => Err(self.fault(item, ReadFault::Number)),
        }
    }

    pub(super) fn fault(&self, item: &Item, fault: impl FnOnce(String) -> ReadFault) -> ReadError {
        let text = String::from_utf8_lossy(&self.code[item.span.clone()]).into_owned();
        self.source.error(item.span.start, fault(text))
    }

    pub(super) fn unsupported(&self, item: &Item, why: &'static str) -> ReadError {
        self.fault(item, |word| ReadFault::Unsupported { word, why })
    }
}
