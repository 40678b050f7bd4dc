//! Words of axes that count to 360 deg: where they lead from where the axis is.

use std::f64::consts::TAU;

use facemill_inverse_kinematics::{Axis, AxisKind};
use facemill_nc_program::read::ReadMotion;
use facemill_nc_program::{AxisLetter, AxisWords};

/// Follows the words of a program, so that those of axes with
/// [rollover](facemill_inverse_kinematics::Rollover) lead where the control takes them. Those of
/// all other axes count as they are.
#[derive(Clone, Debug, Default)]
pub struct RolledWords {
    /// The words behind the last motion, as the text has them.
    programmed: AxisWords,
}

impl RolledWords {
    /// The value that a word of a motion leads to from the value `from`; `zero` is the value of
    /// word 0. A block that does not name an axis with rollover leaves it where it is; increments,
    /// and words that say the way round themselves, are ways.
    #[must_use]
    pub fn value(
        &self,
        axis: &Axis,
        (motion, letter): (&ReadMotion, AxisLetter),
        word: f64,
        zero: f64,
        from: f64,
    ) -> f64 {
        let in_values = |word: f64| if axis.kind == AxisKind::Rotary { word.to_radians() } else { word };
        if !axis.rolls_over() {
            return zero + in_values(word);
        }
        if !motion.position.is_programmed(letter) {
            return from;
        }
        match self.programmed.get(letter).filter(|_| motion.position.is_way(letter)) {
            Some(before) => from + in_values(word - before),
            None => axis.led_to(from, zero, in_values(word)),
        }
    }

    /// The value of a place of the machine that an axis is sent to from the value `from`: of one
    /// with rollover the nearest turn.
    #[must_use]
    pub fn place(axis: &Axis, value: f64, from: f64) -> f64 {
        if axis.rolls_over() { value + TAU * ((from - value) / TAU).round() } else { value }
    }

    /// Goes on behind a motion.
    pub fn go_on(&mut self, motion: &ReadMotion) {
        self.programmed = motion.position.words();
    }
}
