//! Checks of a program's F before it gets new ones, and the format of F.

use facemill_nc_program::read::{Feed, MacroKind, NoteKind, ReadBlock, ReadCommand, ReadMotion, ReadNote};
use facemill_nc_program::{Dialect, FeedMode};
use facemill_virtual_machine::motion::axis_motion::StraightCut;
use facemill_virtual_machine::not_unit;

use crate::feed_rewrite::FeedRewriteError;

/// Parts of a program that are not evaluated.
#[derive(Default)]
pub(crate) struct Doubts {
    blocks: usize,
    /// Blocks in which only a tool vector is open, which is followed.
    vectors: usize,
    /// Line of the first block with more.
    first: Option<u32>,
}

impl Doubts {
    pub(crate) fn read(&mut self, block: &ReadBlock) {
        use MacroKind::{Call, CallBehind, NotFollowed, Setting, ToolVector, VariableWords};
        self.blocks += 1;
        let has = |wanted: &[MacroKind]| {
            block.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind, .. } if wanted.contains(kind)))
        };
        if has(&[Call, CallBehind, NotFollowed, Setting, VariableWords]) {
            self.first.get_or_insert(block.line);
        } else {
            self.vectors += usize::from(has(&[ToolVector]));
        }
    }

    pub(crate) fn check(&self, notes: &[ReadNote]) -> Result<(), FeedRewriteError> {
        if self.blocks == 0 {
            return Err("has no block: give a program with feeds".to_owned().into());
        }
        let at = |line: u32, why: String| FeedRewriteError::Line { line, why, block_text: None };
        let what = "is not evaluated and may move axes, change offsets or skip blocks, so speeds behind it are unknown";
        for note in notes {
            match note.kind {
                NoteKind::Branch => return Err(at(note.line, format!("{} {what}", note.text))),
                NoteKind::NoDecimalPoint => {
                    let why = format!(
                        "{} has a number without a decimal point, which controls may read as thousandths: write 500. for 500",
                        note.text
                    );
                    return Err(at(note.line, why));
                }
                NoteKind::NotEvaluated if note.count > self.vectors => {
                    // The note has the first line of all, which may be a vector's.
                    return Err(match self.first {
                        Some(line) if line != note.line => at(line, format!("its call or assignment {what}")),
                        _ => at(note.line, format!("{} {what}", note.text)),
                    });
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Refuses vectors of a block that the control takes unchanged and that are not of length 1, as
/// `verify` reports them: their effect on the axes, and so the length of the motion, is unknown.
///
/// # Errors
/// With the vector.
pub(crate) fn check_vectors(dialect: Dialect, motion: &ReadMotion) -> Result<(), String> {
    let tool = motion.tool.as_ref().filter(|_| dialect == Dialect::Heidenhain);
    match tool.and_then(|tool| not_unit(tool).next()) {
        Some(why) => Err(format!("its vector is not of length 1, {why}: write it with length 1")),
        None => Ok(()),
    }
}

/// Detector of F that is computed for the tip already: it follows the axes' motion from block to
/// block.
#[derive(Default)]
pub(crate) struct Computed {
    last: Option<f64>,
    /// Cutting blocks behind another one, whose F is not the tip's speed anyway.
    pairs: usize,
    /// Number of them with another F.
    changed: usize,
}

impl Computed {
    pub(crate) fn read(&mut self, cut: &StraightCut, feed: Option<Feed>) {
        let value = feed.filter(|f| f.mode == FeedMode::G94).map(|f| f.value);
        if let (Some(value), Some(last)) = (value, self.last) {
            let is_tip = (cut.counted - cut.way).abs() <= SAME_WAY * cut.counted;
            self.pairs += usize::from(!is_tip);
            self.changed += usize::from(!is_tip && value != last);
        }
        self.last = value;
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        if self.pairs < FEWEST_PAIRS || 2 * self.changed <= self.pairs {
            return Ok(());
        }
        Err(format!(
            "F changes in {} of {} blocks that follow a cutting block and turn axes, under G94 without RTCP: it looks computed for the axes \
             and is not the speed of the tip. Keep the tip's speeds with --tip-feed keep, or give one with --tip-feed MM_MIN",
            self.changed, self.pairs
        ))
    }
}

/// Rounds a feed down, to text and the number that it represents: with the decimals for so many
/// digits, one at least, and no more than the control accepts.
///
/// # Errors
/// If the result is zero, or less than the feed by more than [`MOST_LOST`], for want of decimals.
pub(crate) fn rounded_down(
    value: f64,
    most_decimals: u8,
    digits: i32,
    always_point: bool,
) -> Result<(String, f64), String> {
    let leading = value.log10().floor().clamp(-9.0, 9.0) as i32;
    let most = i32::from(most_decimals);
    let decimals = (digits - 1 - leading).clamp(most.min(1), most);
    let scale = 10f64.powi(decimals);
    // A whole number of units, apart from the last bits of a double, stays whole.
    let number = (value * scale * (1.0 + LAST_BITS)).floor() / scale;
    if number < value * (1.0 - MOST_LOST) {
        let lost = 100.0 * (1.0 - number / value);
        return Err(format!(
            "it needs F{value:.9}, but with the {most_decimals} decimals that its control accepts F is {number}, {lost:.1} % less: \
             split the block, or give feeds in another mode"
        ));
    }
    let text = number.to_string();
    let text = if always_point && !text.contains('.') { text + "." } else { text };
    Ok((text, number))
}

/// Refuses a block that the control's smallest F makes faster than intended, by this factor.
///
/// # Errors
/// If it does, by more than the largest loss to decimals ([`MOST_LOST`]).
pub(crate) fn not_raised(faster: f64, least: f64) -> Result<(), String> {
    if faster <= 1.0 + MOST_LOST {
        return Ok(());
    }
    Err(format!(
        "it needs F{:.4}, but the smallest that the machine accepts is {least}, {faster:.1} times as fast: let the tip go faster, or \
         give feed.min_mm_min of the machine file if its control takes less",
        least / faster
    ))
}

/// Largest relative difference between the length that F counts and the tip's path if F is its
/// speed.
const SAME_WAY: f64 = 1e-3;

/// Largest relative difference of a feed for want of decimals, or because the control has none so
/// small. Larger: blocks are slower or faster than requested, without notice; smaller: refuses
/// feeds of controls that accept two digits.
const MOST_LOST: f64 = 0.01;

/// Least number of cutting blocks behind another one for a judgement on the origin of F.
const FEWEST_PAIRS: usize = 8;

/// Relative difference from the last bits of doubles.
pub(crate) const LAST_BITS: f64 = 1e-12;

#[cfg(test)]
#[path = "../../tests/unit/feed_rewrite/checks.rs"]
mod tests;
