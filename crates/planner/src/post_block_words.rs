//! Whether a shop's own dialect file adds to every block something that is not its motion.

use std::ops::Range;

use facemill_nc_program::{
    AxisLengths, Block, Compensation, DialectFile, MacroKind, ProgramSpec, ReadBlock, ReadCommand, SaidWords,
    StateWord, WorkOffset, read_program, write_program_with_lines,
};

use crate::Failure;
use crate::load::Job;

/// Keys whose text stands in the first motion alone: modes that hold from there on belong there.
const FIRST_KEYS: [&str; 4] = ["words.absolute", "feeds.g94", "feeds.g93", "feeds.rtcp"];

/// Keys whose text stands in every block of a kind of motion.
const BLOCK_KEYS: [&str; 7] = [
    "words.rapid",
    "words.rapid_end",
    "words.linear",
    "words.linear_end",
    "motion.rtcp.vectors.code",
    "motion.rtcp.vectors.tool",
    "motion.rtcp.vectors.normal",
];

/// State words that may be said again with a motion: what they say is held against what was meant with the block.
const HELD: [StateWord; 5] =
    [StateWord::WorkOffset, StateWord::RadiusOff, StateWord::Unit, StateWord::Distance, StateWord::FeedMode];

/// Sees to it that the motions of a program around `spec`, whose blocks are a plan's, say no more than with the dialect's own
/// words: a stop, a speed, a register or a coolant in every block runs otherwise than was planned, and no block of a plan shows
/// where it comes from.
///
/// The shop's keys are taken one after the other into a file that has the dialect's own, so that the one that adds is known. A
/// file whose text cannot be read on the way is passed over; the last is the shop's.
///
/// # Errors
/// When a block says more, with key and line.
pub(crate) fn nothing_added(job: &Job, spec: &ProgramSpec) -> Result<(), Failure> {
    let value = |rules: &DialectFile| serde_json::to_value(rules).unwrap_or_default();
    let (shop, own) = (value(job.post.rules()), value(&job.post.dialect().file()));
    let pointer = |key: &str| format!("/{}", key.replace('.', "/"));
    let differs = |key: &&str| {
        let (is, was) = (shop.pointer(&pointer(key)), own.pointer(&pointer(key)));
        is.is_some() && was.is_some() && is != was
    };
    let changed: Vec<&str> = FIRST_KEYS.into_iter().chain(BLOCK_KEYS).filter(differs).collect();
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
            if motion.adds_to(before.get(k), FIRST_KEYS.contains(&key)) {
                return Err(told(job, key, shop.pointer(&pointer(key)), motion));
            }
        }
        before = now;
    }
    Ok(())
}

fn told(job: &Job, key: &str, is: Option<&serde_json::Value>, motion: &Motion) -> Failure {
    let name = job.file.post.dialect_file.as_deref().unwrap_or_default();
    let is = is.map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)).unwrap_or_default();
    let Motion { line, text, .. } = motion;
    job.wrong(format!(
        "post.dialect_file: {name}, {key}: `{is}` adds to every such block what is no part of its motion: line {line}, `{text}`; \
         take it out, and what the program shall say once, write into a template of your own (post.template)"
    ))
}

/// What a block with a motion says besides where it goes and how fast.
struct Motion {
    line: u32,
    text: String,
    commands: Vec<ReadCommand>,
    said: SaidWords,
    state: State,
}

/// What holds in a motion, and its arc.
#[derive(Default, PartialEq)]
struct State {
    is_skippable: bool,
    is_inch: bool,
    work_offset: Option<WorkOffset>,
    compensation: Option<Compensation>,
    lengths: AxisLengths,
}

/// The motions of a program by these rules; `None` where they write nothing that can be read.
fn motions(job: &Job, spec: &ProgramSpec, rules: &serde_json::Value) -> Option<Vec<Motion>> {
    let rules: DialectFile = serde_json::from_value(rules.clone()).ok()?;
    let written = write_program_with_lines(spec, &job.post.with_rules(rules)).ok()?;
    let program = read_program(&written.text, job.post.dialect()).ok()?;
    let starts = &written.block_lines;
    let is_motion = |b: &Block| matches!(b, Block::Rapid { .. } | Block::Linear { .. } | Block::LinearVectors { .. });
    let all = spec.program.blocks.iter().enumerate().filter(|(_, block)| is_motion(block));
    let lines = |k: usize| starts[k]..starts.get(k + 1).copied().unwrap_or(starts[k] + 1);
    Some(all.map(|(k, _)| Motion::of(&program.blocks, lines(k), &written.text)).collect())
}

impl Motion {
    /// What the blocks on these lines say together.
    fn of(blocks: &[ReadBlock], lines: Range<u32>, text: &str) -> Self {
        let there = || blocks.iter().filter(|b| lines.contains(&b.line));
        // Comments do nothing, and the vector of a cut is held against the one that was meant.
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

    /// Whether it says more than another one, besides modes where those may be said.
    fn adds_to(&self, before: Option<&Self>, modes_are_free: bool) -> bool {
        let is_free = |c: &&ReadCommand| modes_are_free && matches!(c, ReadCommand::Mode(_));
        let mut new = self.commands.iter().filter(|c| !is_free(c));
        let Some(before) = before else { return new.next().is_some() || self.said != SaidWords::default() };
        new.any(|c| !before.commands.contains(c))
            || before.said.or(self.said) != before.said
            || self.state != before.state
    }
}
