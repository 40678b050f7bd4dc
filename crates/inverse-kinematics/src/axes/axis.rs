use std::f64::consts::TAU;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fraction of a turn within which a way of half a turn counts as the one that turns on: rounding
/// of words.
const HALF_TURNS_ON: f64 = 1e-9;

/// Fraction of a turn within which two places are one: rounding of words. Larger: an intended short
/// way is not made; smaller: a whole turn is made by rounding.
const SAME_PLACE: f64 = 1e-9;

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisKind {
    /// Prismatic: values in mm.
    Linear,
    /// Revolute: values in rad.
    Rotary,
}

/// Side of a machine that an axis or a body belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// The tool's side, between bed and spindle.
    Head,
    /// The workpiece's side, between bed and table.
    Table,
    /// On a machine with two heads, the side of the head whose tool the view does not move: between
    /// bed and its spindle. Its axes do not move this view's tool; its bodies are obstacles for it.
    OtherHead,
}

/// Address of an axis in NC text: a letter, and a number for a second head (`B`, `X2`).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct AxisLetter {
    // The number comes first so that the derived order is that of NC words: X Y Z A B C, then the
    // second head.
    number: u8,
    rank: u8,
    text: [u8; 2],
}

impl AxisLetter {
    /// Reads one of X Y Z A B C U V W, optionally with one digit from 1 to 9 behind it; `None` for
    /// anything else.
    pub fn parse(text: &str) -> Option<Self> {
        let (letter, number) = match *text.as_bytes() {
            [letter] => (letter, 0),
            [letter, digit @ b'1'..=b'9'] => (letter, digit),
            _ => return None,
        };
        let rank = b"XYZABCUVW".iter().position(|&known| known == letter)?;
        Some(Self { number, rank: u8::try_from(rank).ok()?, text: [letter, number] })
    }

    /// The address as written in NC text.
    pub fn as_str(&self) -> &str {
        let n = if self.number == 0 { 1 } else { 2 };
        // Only ASCII ever gets in.
        std::str::from_utf8(&self.text[..n]).unwrap_or_default()
    }
}

impl fmt::Display for AxisLetter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for AxisLetter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl PartialEq<str> for AxisLetter {
    fn eq(&self, other: &str) -> bool {
        self.as_str() == other
    }
}

impl PartialEq<&str> for AxisLetter {
    fn eq(&self, other: &&str) -> bool {
        self.as_str() == *other
    }
}

/// One programmable axis of a machine. Lengths in mm, angles in rad, times in s.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Address in NC text.
    pub letter: AxisLetter,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Smallest value; −∞ for an endless axis.
    pub min: f64,
    /// Largest value; +∞ for an endless axis.
    pub max: f64,
    /// Largest speed, mm/s or rad/s.
    pub max_velocity: f64,
    /// Largest acceleration, mm/s² or rad/s², where the file gives it.
    pub max_acceleration: Option<f64>,
    /// Largest jerk, mm/s³ or rad/s³, where the file gives it.
    pub max_jerk: Option<f64>,
    /// Value of the home position, within the limits.
    pub home: f64,
    /// Whether a rotary axis turns without limit; not where its wind-up is limited.
    pub endless: bool,
    /// Largest wind-up from home of an axis without stops, rad; its limits are there.
    pub max_wind_up: Option<f64>,
    /// How the control reads the words of an endless axis; `None` where the file does not say, so
    /// that words wind on.
    pub rollover: Option<Rollover>,
    /// Side of the machine that carries it.
    pub carried_by: Carrier,
}

impl Axis {
    /// Returns whether a rotary axis has no stops, even if its wind-up is limited.
    pub fn has_no_stops(&self) -> bool {
        self.endless || self.max_wind_up.is_some()
    }

    /// Returns whether words of the axis count to 360 deg.
    pub fn rolls_over(&self) -> bool {
        matches!(self.rollover, Some(Rollover::Shortest | Rollover::SignDirected))
    }

    /// Returns the value that an absolute word leads to from the value `from`; the word is in the
    /// unit of values, `offset` its zero. Exactly their sum where words wind on.
    pub fn led_to(&self, from: f64, offset: f64, word: f64) -> f64 {
        match self.rollover {
            None | Some(Rollover::None) => offset + word,
            Some(Rollover::Shortest) => {
                let target = offset + word;
                target + TAU * ((from - target) / TAU + HALF_TURNS_ON).round()
            }
            Some(Rollover::SignDirected) => {
                let target = offset + word.abs();
                // The present place is reached without a turn.
                let turns = (from - target) / TAU;
                let turns =
                    if word.is_sign_negative() { (turns + SAME_PLACE).floor() } else { (turns - SAME_PLACE).ceil() };
                target + TAU * turns
            }
        }
    }

    /// Returns whether `value` is within the limits, both ends included.
    pub fn holds(&self, value: f64) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// Returns a difference of axis values in the unit of NC words: mm stay mm, rad become degrees.
    pub fn in_word_unit(&self, value: f64) -> f64 {
        match self.kind {
            AxisKind::Linear => value,
            AxisKind::Rotary => value.to_degrees(),
        }
    }
}

/// How the control of an endless axis takes a word: what `C10.` does behind `C350.`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rollover {
    /// Words wind on: behind `C350.` a `C10.` turns the axis back by 340°.
    None,
    /// Words count to 360°, and the axis goes the shorter way: on by 20°. Half a turn goes on;
    /// controls differ there, so runs list it under `assumptions`.
    Shortest,
    /// Words count to 360°, and their sign gives the sense: `C10.` goes on by 20°, `C-10.` back by
    /// 340° to the same place.
    SignDirected,
}

#[cfg(test)]
#[path = "../../tests/unit/axes/axis.rs"]
mod tests;
