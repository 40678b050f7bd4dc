use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whether an axis slides or turns; it decides the unit of its words (mm or deg) and their number
/// of decimals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AxisKind {
    /// Words in mm.
    Linear,
    /// Words in deg.
    Rotary,
}

/// Name of a machine axis in NC text: a letter of ISO 841 and, for the second and further axes of
/// that letter, a number (`X`, `B`, `X2`). X, Y, Z, U, V, W are linear, A, B, C rotary.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct AxisLetter {
    letter: u8,
    /// 0 where the name is the letter alone.
    number: u8,
}

/// The text is not the name of an axis.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is no axis name: one of X Y Z U V W A B C, then nothing or a number from 1 to 9")]
pub struct AxisNameError {
    /// The text.
    pub name: String,
}

impl AxisLetter {
    /// The X axis of the first head.
    pub const X: Self = Self { letter: b'X', number: 0 };
    /// The Y axis of the first head.
    pub const Y: Self = Self { letter: b'Y', number: 0 };
    /// The Z axis of the first head.
    pub const Z: Self = Self { letter: b'Z', number: 0 };
    /// Rotation about X.
    pub const A: Self = Self { letter: b'A', number: 0 };
    /// Rotation about Y.
    pub const B: Self = Self { letter: b'B', number: 0 };
    /// Rotation about Z.
    pub const C: Self = Self { letter: b'C', number: 0 };

    /// The axis of a letter (either case) and a number from 1 to 9, or 0 for the letter alone;
    /// `None` where that names no axis.
    #[must_use]
    pub fn new(letter: char, number: u8) -> Option<Self> {
        let letter = letter.to_ascii_uppercase();
        let known = matches!(letter, 'A'..='C' | 'U'..='Z') && number <= 9;
        known.then_some(Self { letter: letter as u8, number })
    }

    /// The letter, upper case.
    #[must_use]
    pub fn letter(self) -> char {
        char::from(self.letter)
    }

    /// The number behind the letter, 0 where there is none.
    #[must_use]
    pub fn number(self) -> u8 {
        self.number
    }

    /// Linear or rotary, by the letter.
    #[must_use]
    pub fn kind(self) -> AxisKind {
        if self.letter <= b'C' { AxisKind::Rotary } else { AxisKind::Linear }
    }
}

impl fmt::Display for AxisLetter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = [self.letter, b'0' + self.number];
        // Padding and width are honoured, so that tables line up.
        f.pad(str::from_utf8(&name[..1 + usize::from(self.number > 0)]).unwrap_or("?"))
    }
}

impl fmt::Debug for AxisLetter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for AxisLetter {
    type Err = AxisNameError;

    fn from_str(name: &str) -> Result<Self, AxisNameError> {
        let mut chars = name.chars();
        let axis = match (chars.next(), chars.next(), chars.next()) {
            (Some(letter), None, _) => Self::new(letter, 0),
            (Some(letter), Some(digit @ '1'..='9'), None) => Self::new(letter, digit as u8 - b'0'),
            _ => None,
        };
        axis.ok_or_else(|| AxisNameError { name: name.to_owned() })
    }
}

impl TryFrom<String> for AxisLetter {
    type Error = AxisNameError;

    fn try_from(name: String) -> Result<Self, AxisNameError> {
        name.parse()
    }
}

impl From<AxisLetter> for String {
    fn from(axis: AxisLetter) -> Self {
        axis.to_string()
    }
}

/// One axis word as it stands in the program: `B-12.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisWord {
    /// Which axis.
    pub letter: AxisLetter,
    /// Programmed value, mm or deg.
    pub value: f64,
}

/// The axis words of one block or position: at most one for an axis, at most
/// [`AxisWords::CAPACITY`], in the order they were first set. It lives on the stack, because a
/// program holds millions of them.
#[derive(Clone, Copy)]
pub struct AxisWords {
    values: [f64; Self::CAPACITY],
    letters: [AxisLetter; Self::CAPACITY],
    len: u8,
}

/// A block or program names more axes than a position can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("axis {letter} is one more than the {} axes a position can hold", AxisWords::CAPACITY)]
pub struct TooManyAxes {
    /// The axis that did not fit.
    pub letter: AxisLetter,
}

impl AxisWords {
    /// Most axes of one program: two heads of four axes with one table, and one to spare.
    pub const CAPACITY: usize = 10;

    /// No words.
    #[must_use]
    pub const fn new() -> Self {
        Self { values: [0.0; Self::CAPACITY], letters: [AxisLetter::X; Self::CAPACITY], len: 0 }
    }

    /// These words; a later word of the same axis replaces the earlier.
    ///
    /// # Errors
    /// When there are more than [`AxisWords::CAPACITY`] axes.
    pub fn from_words(words: impl IntoIterator<Item = (AxisLetter, f64)>) -> Result<Self, TooManyAxes> {
        let mut all = Self::new();
        for (letter, value) in words {
            all.set(letter, value)?;
        }
        Ok(all)
    }

    /// Sets the word of an axis (mm or deg).
    ///
    /// # Errors
    /// When the axis is new and there is no room for it.
    pub fn set(&mut self, letter: AxisLetter, value: f64) -> Result<(), TooManyAxes> {
        let at = self.index_of(letter).unwrap_or(self.len());
        if at == Self::CAPACITY {
            return Err(TooManyAxes { letter });
        }
        self.values[at] = value;
        self.letters[at] = letter;
        self.len = self.len.max(at as u8 + 1);
        Ok(())
    }

    /// The word of an axis, mm or deg.
    #[must_use]
    pub fn get(&self, letter: AxisLetter) -> Option<f64> {
        self.index_of(letter).map(|k| self.values[k])
    }

    /// Place of an axis in [`AxisWords::iter`].
    #[must_use]
    pub fn index_of(&self, letter: AxisLetter) -> Option<usize> {
        self.letters[..self.len()].iter().position(|l| *l == letter)
    }

    pub(crate) fn value_at(&self, index: usize) -> Option<f64> {
        self.values[..self.len()].get(index).copied()
    }

    /// All words, in the order the axes were first set.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = AxisWord> + '_ {
        self.letters[..self.len()].iter().zip(&self.values).map(|(&letter, &value)| AxisWord { letter, value })
    }

    /// Number of words.
    #[must_use]
    pub fn len(&self) -> usize {
        usize::from(self.len)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

impl Default for AxisWords {
    fn default() -> Self {
        Self::new()
    }
}

impl PartialEq for AxisWords {
    /// The same axes with the same values, in any order.
    fn eq(&self, other: &Self) -> bool {
        self.len == other.len && self.iter().all(|word| other.get(word.letter) == Some(word.value))
    }
}

impl fmt::Debug for AxisWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter().map(|w| (w.letter, w.value))).finish()
    }
}

#[cfg(test)]
#[path = "../../tests/unit/words/axis_words.rs"]
mod tests;
