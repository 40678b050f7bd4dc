//! Check that a shop's own dialect file adds nothing to a block but its motion.

use std::ops::Range;

use facemill_nc_program::dialect::DialectFile;
use facemill_nc_program::read::{Compensation, MacroKind, ReadBlock, ReadCommand};
use facemill_nc_program::words::{AxisLengths, SaidWords, StateWord};
use facemill_nc_program::{Block, ProgramSpec, WorkOffset, read_program, write_program_with_lines};

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;

/// Keys whose text is in the first motion alone: modes that hold from there on belong there.
const FIRST_KEYS: [&str; 4] = ["words.absolute", "feeds.g94", "feeds.g93", "feeds.rtcp"];

/// Keys whose text is in every block of a kind of motion.
const BLOCK_KEYS: [&str; 7] = [
    "words.rapid",
    "words.rapid_end",
    "words.linear",
    "words.linear_end",
    "motion.rtcp.vectors.code",
    "motion.rtcp.vectors.tool",
    "motion.rtcp.vectors.normal",
];

/// Keys whose text switches the spindle or the coolant between passes; a dwell may accompany it.
const SWITCH_KEYS: [&str; 6] = [
    "words.spindle_on",
    "words.clockwise",
    "words.counter_clockwise",
    "words.coolant.flood",
    "words.coolant.mist",
    "words.coolant.off",
];

/// State words that a motion may repeat: their meaning is compared with the one intended for the
/// block.
const HELD: [StateWord; 5] =
    [StateWord::WorkOffset, StateWord::RadiusOff, StateWord::Unit, StateWord::Distance, StateWord::FeedMode];

/// Checks that the motions of a program around `spec`, whose blocks are a plan's, and the lines
/// that switch spindle and coolant say no more than with the dialect's own words. An additional
/// stop, speed, register or coolant makes the program run otherwise than planned, and no block of a
/// plan shows its origin.
///
/// Moves the shop's keys one by one into a file of the dialect's own, so that the key that adds is
/// known. Passes over an intermediate file whose text cannot be read; the last file is the shop's.
///
/// # Errors
/// If a block says more, with key and line.
pub(crate) fn nothing_added(job: &Job, spec: &ProgramSpec) -> Result<(), Failure> {
    let value = |rules: &DialectFile| serde_json::to_value(rules).unwrap_or_default();
    let (shop, own) = (value(job.post.rules()), value(&job.post.dialect().file()));
    let pointer = |key: &str| format!("/{}", key.replace('.', "/"));
    let differs = |key: &&str| {
        let (is, was) = (shop.pointer(&pointer(key)), own.pointer(&pointer(key)));
        is.is_some() && was.is_some() && is != was
    };
    let changed: Vec<&str> = FIRST_KEYS.into_iter().chain(BLOCK_KEYS).chain(SWITCH_KEYS).filter(differs).collect();
    let mut rules = shop.clone();
    let set = |rules: &mut serde_json::Value, key: &str, from: &serde_json::Value| {
        if let (Some(place), Some(value)) = (rules.pointer_mut(&pointer(key)), from.pointer(&pointer(key))) {
            place.clone_from(value);
        }
    };
    changed.iter().for_each(|key| set(&mut rules, key, &own));
    let mut before = motions(job, spec, &rules).unwrap_or_default();
    for key in changed {
        set(&mut rules, key, &shop);
        let Some(now) = motions(job, spec, &rules) else { continue };
        for (k, motion) in now.iter().enumerate() {
            if motion.adds_to(before.get(k), key) {
                return Err(fault_of_word(job, key, shop.pointer(&pointer(key)), motion));
            }
        }
        before = now;
    }
    Ok(())
}

fn fault_of_word(job: &Job, key: &str, is: Option<&serde_json::Value>, motion: &Motion) -> Failure {
    let name = job.file.post.dialect_file.as_deref().unwrap_or_default();
    let is = is.map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)).unwrap_or_default();
    let Motion { line, text, .. } = motion;
    let what = match key {
        key if FIRST_KEYS.contains(&key) => "to the first motion something that is neither part of it nor a mode",
        key if SWITCH_KEYS.contains(&key) => "a switch of something else",
        _ => "to every such block something that is not part of its motion",
    };
    job.wrong(format!(
        "post.dialect_file: {name}, {key}: `{is}` adds {what}: line {line}, `{text}`; take it out; words that the program needs \
         once belong in a template of your own (post.template)"
    ))
}

/// Content of a block besides target and feed.
struct Motion {
    line: u32,
    text: String,
    commands: Vec<ReadCommand>,
    said: SaidWords,
    state: State,
}

/// State in a motion, and its arc.
#[derive(Default, PartialEq)]
struct State {
    is_skippable: bool,
    is_inch: bool,
    work_offset: Option<WorkOffset>,
    compensation: Option<Compensation>,
    lengths: AxisLengths,
}

/// Returns the motions and switches of a program written by these rules; `None` if the rules write
/// nothing readable.
fn motions(job: &Job, spec: &ProgramSpec, rules: &serde_json::Value) -> Option<Vec<Motion>> {
    let rules: DialectFile = serde_json::from_value(rules.clone()).ok()?;
    let written = write_program_with_lines(spec, &job.post.with_rules(rules)).ok()?;
    let program = read_program(&written.text, job.post.dialect()).ok()?;
    let starts = &written.block_lines;
    let all = spec.program.blocks.iter().enumerate().filter(|(_, block)| !matches!(block, Block::Comment(_)));
    let lines = |k: usize| starts[k]..starts.get(k + 1).copied().unwrap_or(starts[k] + 1);
    Some(all.map(|(k, _)| Motion::of(&program.blocks, lines(k), &written.text)).collect())
}

impl Motion {
    /// Returns the joint content of the blocks on these lines.
    fn of(blocks: &[ReadBlock], lines: Range<u32>, text: &str) -> Self {
        let there = || blocks.iter().filter(|b| lines.contains(&b.line));
        // Comments do nothing, and the vector of a cut is compared with the intended one elsewhere.
        let counts = |c: &&ReadCommand| {
            !matches!(c, ReadCommand::Comment(_) | ReadCommand::Macro { kind: MacroKind::ToolVector, .. })
        };
        let said = there().fold(SaidWords::default(), |said, b| said.or(b.said));
        let motion = there().find_map(|b| b.motion.as_ref());
        Self {
            line: lines.start,
            text: text.lines().nth(lines.start as usize - 1).unwrap_or_default().to_owned(),
            commands: there().flat_map(|b| b.commands.iter().filter(counts).cloned()).collect(),
            said: HELD.into_iter().fold(said, SaidWords::without),
            state: State {
                is_skippable: there().any(|b| b.skippable),
                is_inch: motion.is_some_and(|m| m.is_inch),
                work_offset: motion.map(|m| m.work_offset),
                compensation: motion.map(|m| m.compensation),
                lengths: motion.map(|m| m.lengths).unwrap_or_default(),
            },
        }
    }

    /// Returns whether it says more than another one, apart from the permitted words of a key:
    /// modes that hold from there on, and dwells.
    fn adds_to(&self, before: Option<&Self>, key: &str) -> bool {
        let is_free = |c: &&ReadCommand| match c {
            ReadCommand::Mode(_) => FIRST_KEYS.contains(&key),
            ReadCommand::Dwell(_) => SWITCH_KEYS.contains(&key),
            _ => false,
        };
        let mut new = self.commands.iter().filter(|c| !is_free(c));
        let Some(before) = before else { return new.next().is_some() || self.said != SaidWords::default() };
        new.any(|c| !before.commands.contains(c))
            || before.said.or(self.said) != before.said
            || self.state != before.state
    }
}
