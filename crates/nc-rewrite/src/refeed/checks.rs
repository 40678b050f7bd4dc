//! What of a program with F has to be looked at before it gets new ones, and how numbers of F are
//! written.

use facemill_nc_program::{Dialect, Feed, FeedMode, MacroKind, NoteKind, ReadBlock, ReadCommand, ReadMotion, ReadNote};
use facemill_virtual_machine::motion::follow::FollowedCut;
use facemill_virtual_machine::not_unit;

/// What of a program is not evaluated.
#[derive(Default)]
pub(crate) struct Doubts {
    blocks: usize,
    /// Blocks with nothing open but a tool vector, which is followed.
    vectors: usize,
    /// Line of the first one with more.
    first: Option<u32>,
}

impl Doubts {
    pub(crate) fn read(&mut self, block: &ReadBlock) {
        use MacroKind::{Call, NotFollowed, Setting, ToolVector, VariableWords};
        self.blocks += 1;
        let has = |wanted: &[MacroKind]| {
            block.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind, .. } if wanted.contains(kind)))
        };
        if has(&[Call, NotFollowed, Setting, VariableWords]) {
            self.first.get_or_insert(block.line);
        } else {
            self.vectors += usize::from(has(&[ToolVector]));
        }
    }

    pub(crate) fn check(&self, notes: &[ReadNote]) -> Result<(), String> {
        if self.blocks == 0 {
            return Err("has no block: give a program with feeds".to_owned());
        }
        let what =
            "is not evaluated and may move axes, change offsets or skip blocks, so speeds behind it are not known";
        for note in notes {
            match note.kind {
                NoteKind::Branch => return Err(format!("line {}: {} {what}", note.line, note.text)),
                NoteKind::NoDecimalPoint => {
                    return Err(format!(
                        "line {}: {} has a number without a decimal point, which controls may read as thousandths: \
                         write 500. for 500",
                        note.line, note.text
                    ));
                }
                NoteKind::NotEvaluated if note.count > self.vectors => {
                    // The note tells the first line of all, which may be a vector's.
                    return Err(match self.first {
                        Some(line) if line != note.line => format!("line {line}: what it calls or sets {what}"),
                        _ => format!("line {}: {} {what}", note.line, note.text),
                    });
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Refuses vectors of a block that the control takes as they stand and that are not of length 1, as
/// `verify` finds them: where they turn the axes, and so how far they go, is not known.
///
/// # Errors
/// With which vector it is.
pub(crate) fn check_vectors(dialect: Dialect, motion: &ReadMotion) -> Result<(), String> {
    let tool = motion.tool.as_ref().filter(|_| dialect == Dialect::Heidenhain);
    match tool.and_then(|tool| not_unit(tool).next()) {
        Some(why) => Err(format!("its vector is not of length 1, {why}: write it with length 1")),
        None => Ok(()),
    }
}

/// Whether the F of a program looks computed for the tip already: it follows the axes' ways from
/// block to block.
#[derive(Default)]
pub(crate) struct Computed {
    last: Option<f64>,
    /// Cutting blocks behind another one, whose F is not the tip's speed anyhow.
    pairs: usize,
    /// Of them with another F.
    changed: usize,
}

impl Computed {
    pub(crate) fn read(&mut self, cut: &FollowedCut, feed: Option<Feed>) {
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

/// A feed rounded down, as text and as the number that this is: with as many decimals as so many
/// digits take, one at least, and no more than the control takes.
///
/// # Errors
/// When that is zero, or less than the feed by more than [`MOST_LOST`], for want of decimals.
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
    // What is a whole number of units but for the last bits of a double stays it.
    let number = (value * scale * (1.0 + LAST_BITS)).floor() / scale;
    if number < value * (1.0 - MOST_LOST) {
        let lost = 100.0 * (1.0 - number / value);
        return Err(format!(
            "it needs F{value:.9}, and with the {most_decimals} decimals that its control takes F is {number}, {lost:.1} % less: \
             split the block, or give feeds in another mode"
        ));
    }
    let text = number.to_string();
    let text = if always_point && !text.contains('.') { text + "." } else { text };
    Ok((text, number))
}

/// Sees to it that the control's smallest F does not make a block faster than it is to be, by this
/// factor.
///
/// # Errors
/// When it does, by more than is lost to decimals at the most.
pub(crate) fn not_raised(faster: f64, least: f64) -> Result<(), String> {
    if faster <= 1.0 + MOST_LOST {
        return Ok(());
    }
    Err(format!(
        "it needs F{:.4}, and the smallest that the machine knows is {least}, {faster:.1} times as fast: let the tip go faster, or \
         give feed.min_mm_min of the machine file if its control takes less",
        least / faster
    ))
}

/// Share by which what F counts may differ from the tip's way where F is its speed.
const SAME_WAY: f64 = 1e-3;

/// Share by which a feed may differ because its control takes few decimals, or knows none so small.
/// Larger: blocks are slower or faster than asked, and nobody is told; smaller: feeds of which a
/// control takes two digits are refused.
const MOST_LOST: f64 = 0.01;

/// Cutting blocks behind another one from which on something can be said of how F was made.
const FEWEST_PAIRS: usize = 8;

/// By what part a number may be larger than another one from the last bits of doubles.
pub(crate) const LAST_BITS: f64 = 1e-12;

#[cfg(test)]
#[path = "../../tests/unit/refeed/checks.rs"]
mod tests;
