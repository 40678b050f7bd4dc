//! A program for a tool of another length.

use facemill_nc_program::read::{AxisAt, Compensation, ReadMotion};
use facemill_nc_program::{AxisWords, ReadProgram, WordMap, WordMapError};

use crate::motion::setup::VirtualSetup;

/// Words that change by less are those that were there, mm or deg: rounding.
const SAME_WORD: f64 = 1e-7;

/// A word map with another tool length, mm.
///
/// # Errors
/// When it is no length.
pub fn words_of_length(words: &WordMap, length: f64) -> Result<WordMap, WordMapError> {
    WordMap::new(words.axes().to_vec(), words.work_offset(), length)
}

/// The program posted for a tool of another length, with which `words` is: at the end of every
/// block with length compensation the tip and the rotary axes are where they were, and so are the
/// linear axes that hold the tip there.
///
/// Words of the tip (RTCP), of axes without compensation, and of the machine stay as they are, and
/// so do those of machines whose head does not turn. Of blocks whose place the text does not tell
/// nothing is changed, nor of feeds: a program for a head that turns is posted again by whatever
/// made it. What its comments say of the tool's length is left out.
///
/// The setup is that of the program as it is. Its machine has three linear axes; with two nothing
/// is changed.
#[must_use]
pub fn posted_for_length(program: &ReadProgram, setup: &VirtualSetup<'_>, words: &WordMap) -> ReadProgram {
    let mut posted = program.clone();
    posted.tool_lengths.clear();
    // The words that stand behind a block.
    let mut modal = AxisWords::new();
    for motion in posted.blocks.iter_mut().filter_map(|b| b.motion.as_mut()) {
        if !matches!(motion.compensation, Compensation::Length(_)) {
            continue;
        }
        let is_at_words = motion.position.iter().all(|(_, at)| matches!(at, AxisAt::Word(_)));
        if is_at_words {
            post(motion, setup, words);
            modal = motion.position.words();
        } else {
            keep(motion, &modal);
        }
    }
    posted
}

/// Axes that a block does not send anywhere, while others go to a place of the machine, stay where
/// they were posted.
fn keep(motion: &mut ReadMotion, modal: &AxisWords) {
    let stays = |letter| !motion.position.is_programmed(letter);
    let kept = AxisWords::from_words(modal.iter().filter(|w| stays(w.letter)).map(|w| (w.letter, w.value)));
    // Some of the axes that there were.
    motion.position = motion.position.with_words(&kept.unwrap_or_default());
}

fn post(motion: &mut ReadMotion, setup: &VirtualSetup<'_>, words: &WordMap) {
    let (machine, length) = (setup.machine, setup.tool.gauge_length());
    let Ok(joints) = setup.words.joints_at(motion, machine.home().as_slice()) else { return };
    let mut axes = machine.home();
    for (k, joint) in joints.into_iter().enumerate() {
        axes[k] = joint;
    }
    let tip = machine.cl_point(&axes, length).tip;
    let Some(held) = machine.with_tip_at(&axes, &tip, words.tool_length()) else { return };
    let Ok(mut new) = words.words(held.as_slice()) else { return };
    for word in motion.position.words().iter() {
        if new.get(word.letter).is_some_and(|value| (value - word.value).abs() < SAME_WORD) {
            // It has the axis.
            let _ = new.set(word.letter, word.value);
        }
    }
    motion.position = motion.position.with_words(&new);
}
