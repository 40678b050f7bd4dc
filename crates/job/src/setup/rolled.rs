//! Words of axes that count to 360 deg, written so that they mean what was planned.

use facemill_inverse_kinematics::{Axis, Rollover};
use facemill_nc_program::{AxisLetter, AxisWords, Block, NcProgram};

/// Writes the words of axes with rollover within a turn, from words that wind on. Where the sign says the way round it is that of
/// the planned way; where the control takes the shorter way, that is the planned one below half a turn.
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

/// An axis, and where it was planned to be last.
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
                // No sign stands before 0.
                if is_back { -(if turned < SMALLEST { 360.0 } else { turned }) } else { turned }
            }
        };
        self.last = Some((planned, written));
        // It has the axis.
        let _ = words.set(self.letter, written);
    }
}

/// Words below this may be written as 0, deg: half of the third decimal, the coarsest of any dialect.
const SMALLEST: f64 = 5e-4;

#[cfg(test)]
mod tests {
    use facemill_inverse_kinematics::{Joint, Machine};

    use crate::setup::rolled::*;

    fn mill(rollover: Rollover) -> Machine {
        let mut file = Machine::head_b_table_c().unwrap().to_file();
        for row in &mut file.workpiece_chain.rows {
            if let Some(Joint::Revolute(joint)) = &mut row.joint {
                joint.rollover = Some(rollover);
            }
        }
        Machine::from_file(file).unwrap()
    }

    /// Words, as a control with the same rollover reads them, lead the planned way.
    #[test]
    fn rolled_words_lead_where_was_planned() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for (rollover, largest) in [(Rollover::Shortest, 179.0), (Rollover::SignDirected, 359.0)] {
            let machine = mill(rollover);
            let c = &machine.axes()[machine.axis_index("C").unwrap()];
            let letter: AxisLetter = "C".parse().unwrap();
            let mut planned = 0.0;
            // Zero is come to from both sides, and a place is told twice.
            let mut all = vec![20.0, 0.0, 0.0, -20.0, 0.0, 350.0, 370.0, 360.0, 100.0];
            for _ in 0..300 {
                planned += largest * (2.0 * random() - 1.0);
                all.push((planned * 1000.0).round() / 1000.0);
            }
            all.retain(|v: &f64| v.is_finite());
            let block = |v: &f64| Block::Rapid { words: AxisWords::from_words([(letter, *v)]).unwrap() };
            let far = |pair: &[f64]| (pair[1] - pair[0]).abs() > largest;
            let steps: Vec<f64> = all
                .iter()
                .scan(0.0, |at, v| {
                    let next = if far(&[*at, *v]) { 0.5 * (*at + *v) } else { *v };
                    *at = next;
                    Some(next)
                })
                .collect();
            let mut program = NcProgram { blocks: steps.iter().map(block).collect() };
            roll(&mut program, machine.axes());
            let mut at = 0.0;
            for (block, planned) in program.blocks.iter().zip(&steps) {
                let Block::Rapid { words } = block else { panic!() };
                let word = words.get(letter).unwrap();
                assert!((-360.0..=360.0).contains(&word) && (word >= 0.0 || rollover == Rollover::SignDirected));
                at = c.led_to(at, 0.0, word.to_radians());
                assert!(
                    (at.to_degrees() - planned).abs() < 1e-6,
                    "{rollover:?}: {word} leads to {}, {planned}",
                    at.to_degrees()
                );
            }
        }
    }
}
