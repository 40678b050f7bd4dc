use crate::words::axis_words::{AxisLetter, AxisWords, TooManyAxes};

/// Where an axis is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisAt {
    /// At this word, mm or deg, in the work offset and compensation of the motion.
    Word(f64),
    /// At this machine value, mm or deg (G53).
    Machine(f64),
    /// At the reference position of this number (1 for G28, 2 and above for G30).
    Reference(u8),
}

/// Position of all axes that are known.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadPosition {
    values: AxisWords,
    /// Bits by index in `values`. An axis in neither is at its word; values of unknown axes have no
    /// meaning.
    machine: u16,
    reference: u16,
    unknown: u16,
    programmed: u16,
    /// Axes that the block sends a way of their own, as increments do.
    ways: u16,
}

impl PartialEq for ReadPosition {
    /// The same axes known at the same places; which the block names does not matter.
    fn eq(&self, other: &Self) -> bool {
        self.iter().count() == other.iter().count() && self.iter().all(|(axis, at)| other.get(axis) == Some(at))
    }
}

impl ReadPosition {
    /// Where an axis is, `None` where the text does not say.
    #[must_use]
    pub fn get(&self, letter: AxisLetter) -> Option<AxisAt> {
        self.at(self.values.index_of(letter)?)
    }

    /// All known axes.
    pub fn iter(&self) -> impl Iterator<Item = (AxisLetter, AxisAt)> + '_ {
        self.values.iter().enumerate().filter_map(|(k, w)| Some((w.letter, self.at(k)?)))
    }

    /// The axes that are at a word (and not at a machine or reference position).
    #[must_use]
    pub fn words(&self) -> AxisWords {
        let mut words = AxisWords::new();
        for (letter, at) in self.iter() {
            if let AxisAt::Word(value) = at {
                // As many as there were.
                let _ = words.set(letter, value);
            }
        }
        words
    }

    /// Whether the block itself names the axis.
    #[must_use]
    pub fn is_programmed(&self, letter: AxisLetter) -> bool {
        self.values.index_of(letter).is_some_and(|k| self.programmed & (1 << k) != 0)
    }

    /// Whether the block names the axis by its way from where it was (increments, words that say
    /// which way round), so that it goes that way on controls that count to 360 deg, too.
    #[must_use]
    pub fn is_way(&self, letter: AxisLetter) -> bool {
        self.values.index_of(letter).is_some_and(|k| self.ways & self.programmed & (1 << k) != 0)
    }

    /// The same position with other words for the axes that are at one; all else is as it was, and
    /// axes of `words` that are not at a word are left out.
    #[must_use]
    pub fn with_words(&self, words: &AxisWords) -> Self {
        let mut out = *self;
        for word in words.iter() {
            if matches!(self.get(word.letter), Some(AxisAt::Word(_))) {
                // As many axes as there were.
                let _ = out.values.set(word.letter, word.value);
            }
        }
        out
    }

    fn at(&self, k: usize) -> Option<AxisAt> {
        let (bit, value) = (1 << k, self.values.value_at(k)?);
        if self.unknown & bit != 0 {
            None
        } else if self.machine & bit != 0 {
            Some(AxisAt::Machine(value))
        } else if self.reference & bit != 0 {
            Some(AxisAt::Reference(value as u8))
        } else {
            Some(AxisAt::Word(value))
        }
    }

    pub(crate) fn set(&mut self, letter: AxisLetter, at: Option<AxisAt>) -> Result<(), TooManyAxes> {
        let value = match at {
            Some(AxisAt::Word(v) | AxisAt::Machine(v)) => v,
            Some(AxisAt::Reference(n)) => n.into(),
            None => 0.0,
        };
        self.values.set(letter, value)?;
        let bit = 1 << self.values.index_of(letter).unwrap_or(0);
        for (mask, is_set) in [
            (&mut self.machine, matches!(at, Some(AxisAt::Machine(_)))),
            (&mut self.reference, matches!(at, Some(AxisAt::Reference(_)))),
            (&mut self.unknown, at.is_none()),
        ] {
            if is_set { *mask |= bit } else { *mask &= !bit }
        }
        self.programmed |= bit;
        self.ways &= !bit;
        Ok(())
    }

    /// Sends an axis a way from where it is, which its word is the end of.
    pub(crate) fn set_way(&mut self, letter: AxisLetter, at: Option<AxisAt>) -> Result<(), TooManyAxes> {
        self.set(letter, at)?;
        self.ways |= 1 << self.values.index_of(letter).unwrap_or(0);
        Ok(())
    }

    /// Starts a block: no axis is named yet.
    pub(crate) fn start_block(&mut self) {
        self.programmed = 0;
    }

    /// Forgets the axes at words: the frame the words refer to has changed and the axes have not
    /// moved.
    pub(crate) fn forget_words(&mut self) {
        self.unknown |= !(self.machine | self.reference);
    }

    /// Forgets one axis where it is at a word.
    pub(crate) fn forget_word(&mut self, letter: AxisLetter) {
        if let Some(k) = self.values.index_of(letter) {
            self.unknown |= (1 << k) & !(self.machine | self.reference);
        }
    }

    /// Forgets everything: something not resolved here may have moved every axis.
    pub(crate) fn forget_all(&mut self) {
        self.unknown = u16::MAX;
        self.machine = 0;
        self.reference = 0;
    }
}
