//! Axes of a channel, and their words.

use facemill_nc_program::dialect::Decimals;
use facemill_nc_program::words::{AxisKind, number_text};
use facemill_nc_program::{AxisLetter, AxisSpec, AxisWords, HeadSpec, ProgramSpec, WriteError};

/// Axes of one channel.
pub(crate) struct Channel<'a> {
    /// 0 or 1.
    pub(crate) index: usize,
    pub(crate) head: &'a HeadSpec,
    pub(crate) axes: Vec<AxisSpec>,
}

/// Axes that move together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    Spindle,
    Across,
    Rotary,
}

impl Channel<'_> {
    pub(crate) fn letters(&self) -> impl Iterator<Item = AxisLetter> + '_ {
        self.axes.iter().map(|a| a.letter)
    }

    pub(crate) fn group(&self, group: Group) -> impl Iterator<Item = AxisLetter> + '_ {
        let of = |a: &AxisSpec| match (a.letter.kind(), a.along_spindle) {
            (AxisKind::Rotary, _) => Group::Rotary,
            (AxisKind::Linear, true) => Group::Spindle,
            (AxisKind::Linear, false) => Group::Across,
        };
        self.axes.iter().filter(move |a| of(a) == group).map(|a| a.letter)
    }
}

/// The two channels. Each has the axes with the number of its head's spindle axis; the first also
/// has the axes without a number.
pub(crate) fn channels<'a>(spec: &ProgramSpec, heads: &'a [HeadSpec]) -> Result<[Channel<'a>; 2], WriteError> {
    let [first, second] = heads else { return Err(facemill_nc_program::HeadError::Count { n: heads.len() }.into()) };
    let numbers = [first, second].map(|h| h.spindle_axis.number());
    let fault = |axis: AxisLetter, why| Err(WriteError::NotInChannels { place: format!("axis {axis}"), why });
    if numbers[0] == numbers[1] {
        return fault(second.spindle_axis, "the axes of the two heads must have two numbers, such as Z1 and Z2");
    }
    if let Some(stranger) = spec.axes.iter().find(|a| a.letter.number() > 0 && !numbers.contains(&a.letter.number())) {
        return fault(stranger.letter, "its number is that of neither head's axes");
    }
    let channel = |index: usize, head: &'a HeadSpec| {
        let is_own = |a: &&AxisSpec| a.letter.number() == numbers[index] || index == 0 && a.letter.number() == 0;
        Channel { index, head, axes: spec.axes.iter().filter(is_own).copied().collect() }
    };
    Ok([channel(0, first), channel(1, second)])
}

/// Positions of all axes of a program, in units of their words' last decimals.
pub(crate) struct WordPositions {
    units: Vec<(AxisLetter, Option<i64>)>,
    decimals: Decimals,
}

impl WordPositions {
    pub(crate) fn new(axes: &[AxisSpec], decimals: Decimals) -> Self {
        Self { units: axes.iter().map(|a| (a.letter, None)).collect(), decimals }
    }

    /// Moves to the positions of these words; returns the axes whose positions change, each with
    /// its signed travel, mm or deg.
    pub(crate) fn go(&mut self, words: &AxisWords, place: &str) -> Result<Vec<(AxisLetter, f64)>, WriteError> {
        let mut changed = Vec::new();
        for word in words.iter() {
            let (letter, value) = (word.letter, word.value);
            let decimals = self.decimals.of(letter.kind());
            let error = || WriteError::Number { place: place.to_owned(), what: "an axis word", value };
            let units = number_text::units(value, decimals).ok_or_else(error)?;
            let missing = || WriteError::NoSuchAxis { place: place.to_owned(), letter };
            let at = self.units.iter_mut().find(|(l, _)| *l == letter).ok_or_else(missing)?;
            let way = (units - at.1.unwrap_or(units)) as f64 / 10f64.powi(decimals.into());
            if at.1 != Some(units) {
                changed.push((letter, way));
            }
            at.1 = Some(units);
        }
        Ok(changed)
    }

    /// First axis without a known position.
    pub(crate) fn unknown(&self) -> Option<AxisLetter> {
        self.units.iter().find(|(_, units)| units.is_none()).map(|(letter, _)| *letter)
    }

    /// Word of an axis at its position, such as `X1=100.` or `C12.5`.
    pub(crate) fn word(&self, letter: AxisLetter) -> String {
        let units = self.units.iter().find(|(l, _)| *l == letter).and_then(|(_, units)| *units).unwrap_or(0);
        let mut text = letter.to_string();
        if letter.number() > 0 {
            text.push('=');
        }
        number_text::push_units(&mut text, units, self.decimals.of(letter.kind()), false);
        text
    }
}

/// Norm of the travels of axes, mm and deg.
pub(crate) fn norm<'a>(ways: impl IntoIterator<Item = &'a (AxisLetter, f64)>) -> f64 {
    ways.into_iter().fold(0.0, |sum: f64, (_, way)| sum.hypot(*way))
}
