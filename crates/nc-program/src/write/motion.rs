//! Motion blocks: words of axes, tool vectors and feeds, without what the control remembers.

use crate::dialect::file::{NumberRule, VectorRule};
use crate::program::write_error::WriteError;
use crate::program::{CutVectors, FeedMode};
use crate::words::axis_words::{AxisKind, AxisLetter, AxisWord, AxisWords};
use crate::words::number_text;
use crate::write::body::BodyWriter;
use crate::write::text::{push_axis_word, push_number};

/// How far from 1 the length of a tool axis or normal may be. Larger takes vectors that are wrong;
/// smaller refuses some for the rounding of their making.
const UNIT_LENGTH: f64 = 1e-6;

/// State that the control is known to remember. Words are in units of their last decimal.
#[derive(Default)]
pub(super) struct WrittenState {
    /// Absolute words and feed mode have been said.
    is_set: bool,
    motion: Option<Move>,
    pub(super) words: Vec<(AxisLetter, i64)>,
    vectors: Option<[i64; 3]>,
    feed: Option<i64>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Move {
    Rapid,
    Cut,
}

/// Largest inverse time, 1/min: a block of 60 µs. Larger numbers do not fit a control's words.
const LARGEST_INVERSE_TIME: f64 = 999_999.0;

impl BodyWriter<'_, '_> {
    pub(super) fn rapid(&mut self, words: &AxisWords) -> Result<(), WriteError> {
        self.start_motion(Move::Rapid);
        self.words(words)?;
        // The rotary words turn the tool away from the vector said before.
        self.modal.vectors = None;
        self.push_text(&self.settings.rules.words.rapid_end);
        self.sink.push_block(&self.line)
    }

    /// `vectors` are written where the settings ask for them.
    pub(super) fn cut(&mut self, words: &AxisWords, feed: f64, vectors: Option<&CutVectors>) -> Result<(), WriteError> {
        match (self.settings.vector_rule(), vectors) {
            (Some(rule), Some(vectors)) => self.vector_words(words, vectors, rule)?,
            (Some(rule), None) if !rule.between_rotary_words => {
                return Err(WriteError::NoVectors { place: self.place() });
            }
            _ => {
                self.start_motion(Move::Cut);
                self.words(words)?;
                // The rotary words turn the tool away from the vector said before.
                self.modal.vectors = None;
                self.push_text(&self.settings.rules.words.linear_end);
            }
        }
        self.feed(feed)?;
        self.sink.push_block(&self.line)
    }

    fn vector_words(&mut self, words: &AxisWords, vectors: &CutVectors, rule: &VectorRule) -> Result<(), WriteError> {
        if rule.code.is_empty() {
            self.start_motion(Move::Cut);
        } else {
            self.line.clear();
            self.push_text(&rule.code);
            self.modal.motion = None;
        }
        let mut linear = AxisWords::new();
        for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Linear) {
            // As many as there were.
            let _ = linear.set(word.letter, word.value);
        }
        if rule.complete {
            self.all_linear_words(&linear)?
        } else {
            self.words(&linear)?
        }
        // The control turns the rotary axes to where it finds them.
        self.modal.words.retain(|(letter, _)| letter.kind() == AxisKind::Linear);
        if let Some(names) = &rule.normal {
            let normal = self.vector_units(&vectors.normal, "a surface normal")?;
            self.push_vector(names, normal);
        }
        let axis = self.vector_units(&vectors.tool_axis, "a tool axis")?;
        if rule.complete || self.modal.vectors != Some(axis) {
            self.push_vector(&rule.tool, axis);
        }
        self.modal.vectors = Some(axis);
        Ok(())
    }

    fn vector_units(&self, vector: &nalgebra::Vector3<f64>, what: &'static str) -> Result<[i64; 3], WriteError> {
        let length = vector.norm();
        let is_unit = (length - 1.0).abs() <= UNIT_LENGTH;
        // NaN is none, too.
        if !is_unit {
            return Err(self.number_error(what, length));
        }
        Ok(self.settings.vector_units(vector))
    }

    fn push_vector(&mut self, names: &[String; 3], units: [i64; 3]) {
        let numbers = self.settings.rules.numbers;
        for (name, units) in names.iter().zip(units) {
            self.push_text(name);
            push_number(&mut self.line, units, numbers.vector_decimals, self.settings.trailing_zeros, numbers);
        }
    }

    fn feed(&mut self, feed: f64) -> Result<(), WriteError> {
        let settings = self.settings;
        let (feed, decimals, what) = match settings.feed_mode {
            FeedMode::G94 | FeedMode::Rtcp => (feed, settings.decimals.feed, "a feed in mm/min"),
            // A block that would take less time takes as much as the largest number says.
            FeedMode::G93 if feed.is_finite() => {
                (feed.min(LARGEST_INVERSE_TIME), settings.decimals.inverse_time, "a feed in 1/min")
            }
            FeedMode::G93 => (feed, settings.decimals.inverse_time, "a feed in 1/min"),
        };
        let units = self.feed_units(feed, decimals).ok_or_else(|| self.number_error(what, feed))?;
        // Inverse time belongs to its block and is not remembered.
        if settings.feed_mode == FeedMode::G93 || self.modal.feed != Some(units) {
            self.push_text("F");
            let unsigned = NumberRule { plus_sign: false, ..settings.rules.numbers };
            push_number(&mut self.line, units, decimals, settings.trailing_zeros, unsigned);
            self.modal.feed = Some(units);
        }
        Ok(())
    }

    /// A feed rounded down, so that no axis is faster than it was to be by the last digit; but not
    /// to zero, and a feed per minute not below the control's smallest, even if that takes less
    /// than a unit more. `None` where no word says the feed: it is below the smallest, or below
    /// half a unit.
    fn feed_units(&self, feed: f64, decimals: u8) -> Option<i64> {
        let smallest = match self.settings.feed_mode {
            FeedMode::G94 | FeedMode::Rtcp => self.spec.smallest_feed,
            FeedMode::G93 => 0.0,
        };
        let least = number_text::units_above(smallest, decimals)?;
        let is_sayable = feed > 0.0 && feed >= smallest && number_text::units(feed, decimals)? > 0;
        Some(number_text::units_below(feed, decimals)?.max(least).max(1)).filter(|_| is_sayable)
    }

    pub(super) fn start_motion(&mut self, motion: Move) {
        self.line.clear();
        let rules = &self.settings.rules;
        if !self.modal.is_set {
            self.modal.is_set = true;
            self.push_text(&rules.words.absolute);
            self.push_text(rules.feed_code(self.settings.feed_mode).unwrap_or_default());
        }
        if self.modal.motion != Some(motion) || !rules.words.motion_is_modal {
            self.modal.motion = Some(motion);
            self.push_text(match motion {
                Move::Rapid => &rules.words.rapid,
                Move::Cut => &rules.words.linear,
            });
        }
    }

    /// Words that have changed; all of them where none has, so that every block of the program
    /// stays a motion.
    pub(super) fn words(&mut self, words: &AxisWords) -> Result<(), WriteError> {
        let mut is_changed = false;
        for word in words.iter() {
            let units = self.word_units(word)?;
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

    /// Words of all linear axes, those that the block does not name as they were.
    fn all_linear_words(&mut self, words: &AxisWords) -> Result<(), WriteError> {
        for word in words.iter() {
            let units = self.word_units(word)?;
            self.modal.remember(word.letter, units);
        }
        for axis in self.spec.axes.iter().filter(|a| a.letter.kind() == AxisKind::Linear) {
            let error = || WriteError::UnknownWord { place: self.place(), letter: axis.letter };
            let units = self.modal.word(axis.letter).ok_or_else(error)?;
            self.push_word(axis.letter, units);
        }
        Ok(())
    }

    fn word_units(&self, word: AxisWord) -> Result<i64, WriteError> {
        self.check_axis(word.letter)?;
        let units = number_text::units(word.value, self.settings.decimals.of(word.letter.kind()));
        units.ok_or_else(|| self.number_error("an axis word", word.value))
    }

    fn push_word(&mut self, axis: AxisLetter, units: i64) {
        self.space();
        push_axis_word(&mut self.line, axis, units, self.settings);
    }

    /// Appends words behind a blank.
    pub(super) fn push_text(&mut self, text: &str) {
        if !text.is_empty() {
            self.space();
            self.line.push_str(text);
        }
    }

    pub(super) fn space(&mut self) {
        if !self.line.is_empty() {
            self.line.push(' ');
        }
    }
}

impl WrittenState {
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
