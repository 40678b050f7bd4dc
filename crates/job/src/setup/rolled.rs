//! Words of axes that count to 360 deg, written so that they mean the planned motion.

use facemill_inverse_kinematics::{Axis, Rollover};
use facemill_nc_program::{AxisLetter, AxisWords, Block, NcProgram};

/// Writes the words of axes with rollover within a turn, from words that wind on. If the sign gives
/// the direction of rotation, it is that of the planned motion; if the control takes the shorter
/// way, the planned motion is the shorter one below half a turn.
pub fn roll(program: &mut NcProgram, axes: &[Axis]) {
    let mut all: Vec<Rolled> = axes.iter().filter(|a| a.rolls_over()).filter_map(Rolled::new).collect();
    for block in &mut program.blocks {
        let (Block::Rapid { words }
        | Block::Linear { words, .. }
        | Block::LinearVectors { words, .. }
        | Block::LengthCompensation { words, .. }) = block
        else {
            continue;
        };
        all.iter_mut().for_each(|axis| axis.write(words));
    }
}

/// Axis with its last planned position.
struct Rolled {
    letter: AxisLetter,
    is_signed: bool,
    /// The planned word and the written one, deg.
    last: Option<(f64, f64)>,
}

impl Rolled {
    fn new(axis: &Axis) -> Option<Self> {
        let letter = axis.letter.as_str().parse().ok()?;
        Some(Self { letter, is_signed: axis.rollover == Some(Rollover::SignDirected), last: None })
    }

    fn write(&mut self, words: &mut AxisWords) {
        let Some(planned) = words.get(self.letter) else { return };
        let written = match self.last {
            Some((before, written)) if before == planned => written,
            last => {
                let turned = planned.rem_euclid(360.0);
                let is_back = self.is_signed && last.map_or(planned, |(before, _)| planned - before) < 0.0;
                // 0 has no sign.
                if is_back { -(if turned < SMALLEST { 360.0 } else { turned }) } else { turned }
            }
        };
        self.last = Some((planned, written));
        // The words have the axis.
        let _ = words.set(self.letter, written);
    }
}

/// Words below this may be written as 0, deg: half of the third decimal, the coarsest of any
/// dialect.
const SMALLEST: f64 = 5e-4;

#[cfg(test)]
#[path = "../../tests/unit/setup/rolled.rs"]
mod tests;
