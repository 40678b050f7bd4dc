use crate::dialect::fill;
use crate::dialect::post_file::PostSettings;
use crate::dialect::word_rule::HomeWords;
use crate::program::heads::HeadSpec;
use crate::program::spec::{ProgramSpec, SpindleSpec, ToolSpec};
use crate::program::write_error::WriteError;
use crate::program::{Block, FeedMode};
use crate::words::axis_words::{AxisKind, AxisLetter, AxisWords};
use crate::words::number_text;
use crate::write::codes::{spindle_code, spindle_speed};
use crate::write::lines::LineSink;
use crate::write::motion::{Move, WrittenState};
use crate::write::text::{clean_comment, comment_pieces, push_axis_word};

/// Writes blocks as lines and leaves out what the control remembers.
pub(super) struct BodyWriter<'s, 'a> {
    pub(super) spec: &'a ProgramSpec,
    /// Empty for one head.
    heads: &'a [HeadSpec],
    pub(super) settings: &'a PostSettings,
    pub(super) sink: &'s mut LineSink<'a>,
    pub(super) modal: WrittenState,
    /// The line being written; kept for its memory.
    pub(super) line: String,
    /// Index of the block being written, for errors.
    index: usize,
}

impl<'s, 'a> BodyWriter<'s, 'a> {
    pub(super) fn new(
        spec: &'a ProgramSpec,
        heads: &'a [HeadSpec],
        settings: &'a PostSettings,
        sink: &'s mut LineSink<'a>,
    ) -> Self {
        Self { spec, heads, settings, sink, modal: WrittenState::default(), line: String::new(), index: 0 }
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
        let words = &self.settings.rules.words;
        match block {
            Block::Comment(text) => self.comment(text),
            Block::Rapid { words } => self.rapid(words),
            Block::Linear { words, feed } => self.cut(words, *feed, None),
            Block::LinearVectors { words, feed, vectors } => self.cut(words, *feed, Some(vectors)),
            Block::ToolCall { number } => {
                self.modal = WrittenState::default();
                self.lines(&words.tool_change, &[("number", &number.to_string())])
            }
            Block::SpindleOn { rpm, clockwise, spindle } => {
                self.spindle_on(SpindleSpec { rpm: *rpm, clockwise: *clockwise }, *spindle)
            }
            Block::SpindleOff => self.spindle_off(),
            Block::Coolant(coolant) => {
                let code = super::codes::coolant_code(*coolant, &self.settings.rules, &self.place())?;
                self.sink.push_block(&code)
            }
            Block::Dwell { seconds } => self.dwell(*seconds),
            Block::WorkOffset(offset) => {
                self.modal.words.clear();
                let (_, lines) = super::codes::work_offset(*offset, &self.settings.rules, &self.place())?;
                self.lines(&lines, &[])
            }
            Block::LengthCompensation { register, length, words } => self.compensation(*register, *length, words),
            Block::LengthCompensationOff => self.compensation_off(),
            Block::Home { axes } => self.home(axes),
            Block::Stop => self.lines(&words.stop, &[]),
            Block::End => self.lines(&words.end, &[]),
            Block::Raw(text) => {
                self.modal = WrittenState::default();
                text.lines().map(str::trim).filter(|l| !l.is_empty()).try_for_each(|l| self.sink.push_template_line(l))
            }
        }
    }

    /// Lines of the dialect's file.
    fn lines(&mut self, lines: &[String], values: &[(&str, &str)]) -> Result<(), WriteError> {
        lines.iter().try_for_each(|line| self.sink.push_block(&fill(line, values)))
    }

    fn comment(&mut self, text: &str) -> Result<(), WriteError> {
        for piece in comment_pieces(&clean_comment(text, &self.settings.rules.comments), self.sink.comment_limit()) {
            self.sink.push_comment(piece)?;
        }
        Ok(())
    }

    fn spindle_on(&mut self, spindle: SpindleSpec, number: Option<u32>) -> Result<(), WriteError> {
        let words = &self.settings.rules.words;
        let is_known = |n: u32| self.heads.iter().any(|head| head.spindle_number == n);
        let lines = match number {
            None if self.heads.is_empty() => &words.spindle_on,
            None => return Err(self.which_head("one of several spindles must be named by its number")),
            Some(n) if !self.heads.is_empty() && !is_known(n) => {
                return Err(self.which_head(&format!("spindle {n} is that of no head")));
            }
            Some(n) => {
                let what = format!("spindle {n}");
                let error = || WriteError::NotInDialect { place: self.place(), what, name: self.name() };
                &words.spindles.as_ref().ok_or_else(error)?.on
            }
        };
        let speed = spindle_speed(spindle.rpm, &self.place())?.to_string();
        let code = spindle_code(&spindle, self.settings);
        let number = number.unwrap_or(1).to_string();
        let m = code.trim_start_matches('M');
        self.lines(lines, &[("rpm", &speed), ("code", &code), ("m", m), ("spindle", &number)])
    }

    /// All of them.
    fn spindle_off(&mut self) -> Result<(), WriteError> {
        let words = &self.settings.rules.words;
        match &words.spindles {
            Some(spindles) if !self.heads.is_empty() => self.heads.iter().try_for_each(|head| {
                let number = head.spindle_number.to_string();
                spindles.off.iter().try_for_each(|line| self.sink.push_block(&fill(line, &[("spindle", &number)])))
            }),
            _ => self.lines(&words.spindle_off, &[]),
        }
    }

    fn dwell(&mut self, seconds: f64) -> Result<(), WriteError> {
        let ms = number_text::units(seconds, 3).filter(|ms| *ms >= 0);
        let ms = ms.ok_or_else(|| self.number_error("a dwell", seconds))?;
        let mut s = String::new();
        number_text::push_units(&mut s, ms, 3, true);
        self.lines(&self.settings.rules.words.dwell, &[("ms", &ms.to_string()), ("s", &s)])
    }

    fn compensation(&mut self, register: u32, length: f64, words: &AxisWords) -> Result<(), WriteError> {
        let text = number_text::number(length, 3, true).ok_or_else(|| self.number_error("a length", length))?;
        self.check_length(register, length, words)?;
        let of_register = if self.heads.is_empty() { String::new() } else { format!(" H{register}") };
        self.sink.push_comment(&format!("TOOL LENGTH {text}{of_register}"))?;
        let settings = self.settings;
        let rule = match (&settings.rules.motion.rtcp, settings.feed_mode) {
            (Some(rtcp), FeedMode::Rtcp) => &rtcp.on,
            _ => &settings.rules.words.length,
        };
        let register = register.to_string();
        let values = [("register", register.as_str()), ("law", settings.law_code())];
        self.modal.words.clear();
        self.lines(&rule.before, &values)?;
        self.start_motion(Move::Rapid);
        self.push_text(&rule.code);
        self.words(words)?;
        self.push_text(&fill(&rule.end, &values));
        self.push_text(&settings.rules.words.rapid_end);
        self.sink.push_block(&self.line)
    }

    fn compensation_off(&mut self) -> Result<(), WriteError> {
        self.modal.words.clear();
        let rules = &self.settings.rules;
        let lines = match (&rules.motion.rtcp, self.settings.feed_mode) {
            (Some(rtcp), FeedMode::Rtcp) => &rtcp.off,
            _ => &rules.words.length_off,
        };
        if lines.is_empty() {
            let what = "words without the tool's length".to_owned();
            return Err(WriteError::NotInDialect { place: self.place(), what, name: self.name() });
        }
        self.lines(lines, &[])
    }

    /// Of several heads: the block names the spindle axis of the head whose register and length it
    /// takes, and no other linear axis.
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
        self.modal = WrittenState::default();
        if axes.is_empty() {
            return Ok(());
        }
        let settings = self.settings;
        let rule = &settings.rules.words.home;
        if settings.feed_mode == FeedMode::Rtcp && !rule.under_rtcp {
            let why = "axes go home behind the end of RTCP alone: leave it to the template";
            return Err(WriteError::NotInDialect { place: self.place(), what: why.to_owned(), name: self.name() });
        }
        self.lines(&rule.before, &[])?;
        self.line.clear();
        self.push_text(&rule.code);
        for axis in axes {
            self.check_axis(*axis)?;
            let value = match rule.words {
                HomeWords::Zeros => 0.0,
                HomeWords::MachineValues => settings.home_of(*axis)?,
            };
            let units = number_text::units(value, settings.decimals.of(axis.kind()));
            let units = units.ok_or_else(|| self.number_error("an axis word", value))?;
            self.space();
            push_axis_word(&mut self.line, *axis, units, settings);
        }
        self.push_text(&rule.end);
        self.sink.push_block(&self.line)?;
        self.lines(&rule.after, &[])
    }

    pub(super) fn check_axis(&self, letter: AxisLetter) -> Result<(), WriteError> {
        let is_known = self.spec.axes.iter().any(|axis| axis.letter == letter);
        if is_known { Ok(()) } else { Err(WriteError::NoSuchAxis { place: self.place(), letter }) }
    }

    pub(super) fn place(&self) -> String {
        format!("block {}", self.index)
    }

    fn name(&self) -> String {
        self.settings.rules.name.clone()
    }

    pub(super) fn number_error(&self, what: &'static str, value: f64) -> WriteError {
        WriteError::Number { place: self.place(), what, value }
    }
}
