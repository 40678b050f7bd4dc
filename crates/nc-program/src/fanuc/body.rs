use std::fmt::Write;

use super::{
    lines::LineSink,
    template::{coolant_code, feed_code, spindle_code, spindle_speed},
    text::{clean_comment, comment_pieces, push_axis_word},
};
use crate::{
    AxisKind, AxisLetter, AxisWords, Block, FeedMode, HeadSpec, PostSettings, ProgramSpec, ToolSpec, WriteError,
    number_text,
};

/// Writes blocks as lines and leaves out what the control remembers.
pub(super) struct BodyWriter<'a> {
    spec: &'a ProgramSpec,
    /// Empty for one head.
    heads: &'a [HeadSpec],
    settings: &'a PostSettings,
    sink: &'a mut LineSink,
    modal: Modal,
    /// The line being written; kept for its memory.
    line: String,
    /// Index of the block being written, for errors.
    index: usize,
}

/// What the control is known to remember. Words are in units of their last decimal.
#[derive(Default)]
struct Modal {
    /// Absolute words and feed mode have been said.
    is_set: bool,
    motion: Option<&'static str>,
    words: Vec<(AxisLetter, i64)>,
    feed: Option<i64>,
}

impl<'a> BodyWriter<'a> {
    pub(super) fn new(
        spec: &'a ProgramSpec,
        heads: &'a [HeadSpec],
        settings: &'a PostSettings,
        sink: &'a mut LineSink,
    ) -> Self {
        Self { spec, heads, settings, sink, modal: Modal::default(), line: String::new(), index: 0 }
    }

    /// Writes all blocks and returns the line at which each begins.
    pub(super) fn write(&mut self, blocks: &[Block]) -> Result<Vec<u32>, WriteError> {
        let mut lines = Vec::with_capacity(blocks.len());
        for (index, block) in blocks.iter().enumerate() {
            self.index = index;
            lines.push(self.sink.next_line());
            self.block(block)?;
        }
        Ok(lines)
    }

    fn block(&mut self, block: &Block) -> Result<(), WriteError> {
        match block {
            Block::Comment(text) => self.comment(text),
            Block::Rapid { words } => self.rapid(words),
            Block::Linear { words, feed } => self.linear(words, *feed),
            Block::ToolCall { number } => {
                self.modal = Modal::default();
                self.sink.push_block(&format!("T{number} M6"))
            }
            Block::SpindleOn { rpm, clockwise } => self.spindle_on(*rpm, *clockwise),
            Block::SpindleOff => self.spindle_off(),
            Block::Coolant(coolant) => self.sink.push_block(coolant_code(*coolant)),
            Block::Dwell { seconds } => self.dwell(*seconds),
            Block::WorkOffset(offset) => {
                self.modal.words.clear();
                self.sink.push_block(&offset.to_string())
            }
            Block::LengthCompensation { register, length, words } => self.compensation(*register, *length, words),
            Block::LengthCompensationOff => {
                self.modal.words.clear();
                self.sink.push_block("G49")
            }
            Block::Home { axes } => self.home(axes),
            Block::Stop => self.sink.push_block("M0"),
            Block::End => self.sink.push_block("M30"),
            Block::Raw(text) => {
                self.modal = Modal::default();
                text.lines().map(str::trim).filter(|l| !l.is_empty()).try_for_each(|l| self.sink.push_template_line(l))
            }
        }
    }

    fn comment(&mut self, text: &str) -> Result<(), WriteError> {
        for piece in comment_pieces(&clean_comment(text), self.sink.limit() - 2) {
            self.sink.push_plain(&format!("({piece})"))?;
        }
        Ok(())
    }

    fn spindle_on(&mut self, rpm: f64, clockwise: bool) -> Result<(), WriteError> {
        if !self.heads.is_empty() {
            return Err(
                self.which_head("a spindle that is switched on must be told by its number: leave it to the template")
            );
        }
        let speed = spindle_speed(rpm, &self.place())?;
        self.sink.push_block(&format!("S{speed} {}", spindle_code(clockwise)))
    }

    /// All of them.
    fn spindle_off(&mut self) -> Result<(), WriteError> {
        if self.heads.is_empty() {
            return self.sink.push_block("M5");
        }
        self.heads.iter().try_for_each(|head| self.sink.push_block(&format!("M5 P{}", head.spindle_number)))
    }

    fn rapid(&mut self, words: &AxisWords) -> Result<(), WriteError> {
        self.start_motion("G0");
        self.words(words)?;
        self.sink.push_block(&self.line)
    }

    fn linear(&mut self, words: &AxisWords, feed: f64) -> Result<(), WriteError> {
        self.start_motion("G1");
        self.words(words)?;
        let (decimals, what) = match self.settings.feed_mode {
            FeedMode::G94 | FeedMode::Rtcp => (self.settings.decimals.feed, "a feed in mm/min"),
            FeedMode::G93 => (self.settings.decimals.inverse_time, "a feed in 1/min"),
        };
        let units = self.feed_units(feed, decimals).ok_or_else(|| self.number_error(what, feed))?;
        // Inverse time belongs to its block and is not remembered.
        if self.settings.feed_mode == FeedMode::G93 || self.modal.feed != Some(units) {
            self.space();
            self.line.push('F');
            number_text::push_units(&mut self.line, units, decimals, self.settings.trailing_zeros);
            self.modal.feed = Some(units);
        }
        self.sink.push_block(&self.line)
    }

    /// A feed rounded down, so that no axis is faster than it was to be by the last digit; but not to zero, and a feed per
    /// minute not below the control's smallest, even if that takes less than a unit more. `None` where no word says the
    /// feed: it is below the smallest, or below half a unit.
    fn feed_units(&self, feed: f64, decimals: u8) -> Option<i64> {
        let smallest = match self.settings.feed_mode {
            FeedMode::G94 | FeedMode::Rtcp => self.spec.smallest_feed,
            FeedMode::G93 => 0.0,
        };
        let least = number_text::units_above(smallest, decimals)?;
        let is_sayable = feed > 0.0 && feed >= smallest && number_text::units(feed, decimals)? > 0;
        Some(number_text::units_below(feed, decimals)?.max(least).max(1)).filter(|_| is_sayable)
    }

    fn dwell(&mut self, seconds: f64) -> Result<(), WriteError> {
        let milliseconds = number_text::units(seconds, 3).filter(|ms| *ms >= 0);
        let milliseconds = milliseconds.ok_or_else(|| self.number_error("a dwell", seconds))?;
        self.sink.push_block(&format!("G4 P{milliseconds}"))
    }

    fn compensation(&mut self, register: u32, length: f64, words: &AxisWords) -> Result<(), WriteError> {
        let text = number_text::number(length, 3, true).ok_or_else(|| self.number_error("a length", length))?;
        self.check_length(register, length, words)?;
        let of_register = if self.heads.is_empty() { String::new() } else { format!(" H{register}") };
        self.sink.push_plain(&format!("(TOOL LENGTH {text}{of_register})"))?;
        self.modal.words.clear();
        self.start_motion("G0");
        self.space();
        self.line.push_str(if self.settings.feed_mode == FeedMode::Rtcp { "G43.4" } else { "G43" });
        self.words(words)?;
        // Writing to a String cannot fail.
        let _ = write!(self.line, " H{register}");
        self.sink.push_block(&self.line)
    }

    /// Of several heads: the block names the spindle axis of the head whose register and length it takes, and no other
    /// linear axis.
    fn check_length(&self, register: u32, length: f64, words: &AxisWords) -> Result<(), WriteError> {
        if self.heads.is_empty() {
            return Ok(());
        }
        let mut linear = words.iter().filter(|w| w.letter.kind() == AxisKind::Linear).map(|w| w.letter);
        let axis = linear.next().filter(|_| linear.next().is_none());
        let head = self.heads.iter().find(|h| Some(h.spindle_axis) == axis);
        match head {
            Some(head) if head.tool.length_register == register && head.tool.length == length => Ok(()),
            Some(head) => {
                let ToolSpec { length, length_register, .. } = &head.tool;
                let (name, axis) = (&head.name, head.spindle_axis);
                Err(self
                    .which_head(&format!("{axis} takes H{length_register}, {length} mm, of the head `{name}` alone")))
            }
            None => {
                Err(self.which_head("a length compensation must name one linear axis: the spindle axis of its head"))
            }
        }
    }

    fn which_head(&self, why: &str) -> WriteError {
        WriteError::WhichHead { place: self.place(), why: why.to_owned() }
    }

    fn home(&mut self, axes: &[AxisLetter]) -> Result<(), WriteError> {
        self.modal = Modal::default();
        if axes.is_empty() {
            return Ok(());
        }
        self.line.clear();
        self.line.push_str("G91 G28");
        for axis in axes {
            self.check_axis(*axis)?;
            self.space();
            push_axis_word(&mut self.line, *axis, 0, self.settings);
        }
        self.sink.push_block(&self.line)?;
        self.sink.push_block("G90")
    }

    fn start_motion(&mut self, code: &'static str) {
        self.line.clear();
        if !self.modal.is_set {
            self.modal.is_set = true;
            self.line.push_str("G90 ");
            self.line.push_str(feed_code(self.settings.feed_mode));
        }
        if self.modal.motion != Some(code) {
            self.modal.motion = Some(code);
            self.space();
            self.line.push_str(code);
        }
    }

    /// Words that have changed; all of them where none has, so that every block of the program stays a motion.
    fn words(&mut self, words: &AxisWords) -> Result<(), WriteError> {
        let mut is_changed = false;
        for word in words.iter() {
            self.check_axis(word.letter)?;
            let units = number_text::units(word.value, self.settings.decimals.of(word.letter.kind()));
            let units = units.ok_or_else(|| self.number_error("an axis word", word.value))?;
            if self.modal.remember(word.letter, units) {
                is_changed = true;
                self.push_word(word.letter, units);
            }
        }
        if !is_changed {
            for word in words.iter() {
                if let Some(units) = self.modal.word(word.letter) {
                    self.push_word(word.letter, units);
                }
            }
        }
        Ok(())
    }

    fn push_word(&mut self, axis: AxisLetter, units: i64) {
        self.space();
        push_axis_word(&mut self.line, axis, units, self.settings);
    }

    fn check_axis(&self, letter: AxisLetter) -> Result<(), WriteError> {
        let is_known = self.spec.axes.iter().any(|axis| axis.letter == letter);
        if is_known { Ok(()) } else { Err(WriteError::NoSuchAxis { place: self.place(), letter }) }
    }

    fn space(&mut self) {
        if !self.line.is_empty() {
            self.line.push(' ');
        }
    }

    fn place(&self) -> String {
        format!("block {}", self.index)
    }

    fn number_error(&self, what: &'static str, value: f64) -> WriteError {
        WriteError::Number { place: self.place(), what, value }
    }
}

impl Modal {
    fn word(&self, axis: AxisLetter) -> Option<i64> {
        self.words.iter().find(|(letter, _)| *letter == axis).map(|(_, units)| *units)
    }

    /// Whether the word differs from the one remembered.
    fn remember(&mut self, axis: AxisLetter, units: i64) -> bool {
        match self.words.iter_mut().find(|(letter, _)| *letter == axis) {
            Some((_, known)) => std::mem::replace(known, units) != units,
            None => {
                self.words.push((axis, units));
                true
            }
        }
    }
}
