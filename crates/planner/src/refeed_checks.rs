//! What of a program with F has to be looked at before it gets new ones, and how numbers of F are written.

use facemill_nc_program::{Feed, FeedMode, MacroKind, NoteKind, ReadBlock, ReadCommand, ReadNote};

use crate::follow::FollowedCut;

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
        use MacroKind::{Call, Setting, ToolVector, VariableWords};
        self.blocks += 1;
        let has = |wanted: &[MacroKind]| {
            block.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind, .. } if wanted.contains(kind)))
        };
        if has(&[Call, Setting, VariableWords]) {
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

/// Whether the F of a program looks computed for the tip already: it follows the axes' ways from block to block.
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

/// A feed rounded down, as text and as the number that this is: with a decimal at least, and with as many of the control's as
/// so many digits take. `None` where that is zero.
pub(crate) fn rounded_down(value: f64, most_decimals: u8, digits: i32, always_point: bool) -> Option<(String, f64)> {
    let leading = value.log10().floor().clamp(-9.0, 9.0) as i32;
    let decimals = (digits - 1 - leading).clamp(1, i32::from(most_decimals).max(1));
    let scale = 10f64.powi(decimals);
    // What is a whole number of units but for the last bits of a double stays it.
    let units = (value * scale * (1.0 + LAST_BITS)).floor();
    let text = format!("{:.*}", usize::try_from(decimals).unwrap_or(1), units / scale);
    let text = text.trim_end_matches('0');
    let plain = text.trim_end_matches('.');
    let value = plain.parse().ok()?;
    (units >= 1.0).then(|| (if always_point { text } else { plain }.to_owned(), value))
}

/// Share by which what F counts may differ from the tip's way where F is its speed.
const SAME_WAY: f64 = 1e-3;

/// Cutting blocks behind another one from which on something can be said of how F was made.
const FEWEST_PAIRS: usize = 8;

/// By what part a number may be larger than another one from the last bits of doubles.
pub(crate) const LAST_BITS: f64 = 1e-12;
