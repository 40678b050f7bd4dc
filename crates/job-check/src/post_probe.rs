//! Check that the reader of the dialect reads what a shop's own dialect file writes.

use facemill_nc_program::dialect::{DialectFile, LengthRule};
use facemill_nc_program::read::{AxisAt, ReadBlock, ReadCommand};
use facemill_nc_program::words::{AxisKind, AxisWord};
use facemill_nc_program::{
    Block, Coolant, CutVectors, FeedMode, NcProgram, ProgramSpec, WordMap, read_program, write_program,
    write_program_with_lines,
};
use nalgebra::{Unit, Vector3};

use crate::post_block_words::nothing_added;
use facemill_job::failure::Failure;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::program_spec::program_spec;

/// Key of dialect files for text around the motions, which the template determines.
struct TemplateKey {
    key: &'static str,
    lines: fn(&DialectFile) -> Vec<String>,
    /// Copies the value of the second file into the first.
    reset: fn(&mut DialectFile, &DialectFile),
}

fn length_lines(rule: &LengthRule) -> Vec<String> {
    rule.before.iter().chain([&rule.code, &rule.end]).cloned().collect()
}

/// Returns the keys that a program of this feed mode depends on.
fn template_keys(mode: FeedMode) -> Vec<TemplateKey> {
    let [on, off] = if mode == FeedMode::Rtcp {
        let on = TemplateKey {
            key: "motion.rtcp.on",
            lines: |d| d.motion.rtcp.as_ref().map(|r| length_lines(&r.on)).unwrap_or_default(),
            reset: |d, own| {
                if let (Some(rule), Some(own)) = (&mut d.motion.rtcp, &own.motion.rtcp) {
                    rule.on = own.on.clone();
                }
            },
        };
        let off = TemplateKey {
            key: "motion.rtcp.off",
            lines: |d| d.motion.rtcp.as_ref().map(|r| r.off.clone()).unwrap_or_default(),
            reset: |d, own| {
                if let (Some(rule), Some(own)) = (&mut d.motion.rtcp, &own.motion.rtcp) {
                    rule.off.clone_from(&own.off);
                }
            },
        };
        [on, off]
    } else {
        let on = TemplateKey {
            key: "words.length",
            lines: |d| length_lines(&d.words.length),
            reset: |d, own| d.words.length = own.words.length.clone(),
        };
        let off = TemplateKey {
            key: "words.length_off",
            lines: |d| d.words.length_off.clone(),
            reset: |d, own| d.words.length_off.clone_from(&own.words.length_off),
        };
        [on, off]
    };
    let change = TemplateKey {
        key: "words.tool_change",
        lines: |d| d.words.tool_change.clone(),
        reset: |d, own| d.words.tool_change.clone_from(&own.words.tool_change),
    };
    let end = TemplateKey {
        key: "words.end",
        lines: |d| d.words.end.clone(),
        reset: |d, own| d.words.end.clone_from(&own.words.end),
    };
    vec![on, off, change, end]
}

/// Finds a key that the shop has changed without effect, because the template has its own text: the
/// shop then means something else than what is written.
fn without_effect(job: &Job, spec: &ProgramSpec, text: &str) -> Result<(), Failure> {
    let own = job.post.dialect().file();
    let has_template = job.file.post.template.is_some();
    for TemplateKey { key, lines, reset } in template_keys(job.post.feed_mode()) {
        let rules = job.post.rules();
        if lines(rules) == lines(&own) {
            continue;
        }
        let mut plain = rules.clone();
        reset(&mut plain, &own);
        let before = write_program_with_lines(spec, &job.post.with_rules(plain));
        let words: Vec<String> = lines(rules)
            .iter()
            .flat_map(|line| line.split_whitespace())
            .filter(|w| !w.contains('{'))
            .map(str::to_owned)
            .collect();
        let is_there = has_template && words.iter().all(|w| text.split_whitespace().any(|there| there == w));
        if before.is_ok_and(|written| written.text == text) && !is_there {
            let name = job.file.post.dialect_file.as_deref().unwrap_or_default();
            let (is, was) = (lines(rules).join(" "), lines(&own).join(" "));
            return Err(job.wrong(format!(
                "post.dialect_file: {name}, {key}: is `{is}` in place of `{was}`, but changes no line of the program: the \
                 template determines it; write it into a template of your own (post.template), or leave the key as it was"
            )));
        }
    }
    Ok(())
}

/// Length of a probe's cut along every axis, mm or deg: every word changes, and every decimal is
/// non-zero.
const PROBE_WAY: f64 = 1.234_567;

/// Feed that one decimal represents exactly.
const PROBE_FEED: f64 = 432.5;

/// Compares what a shop's own dialect file writes with what the reader of the dialect reads, for a
/// program around `spec` with a block of each kind that plans write.
///
/// # Errors
/// If a block is read otherwise than meant, with the line.
pub fn probe(job: &Job, spec: &ProgramSpec) -> Result<(), Failure> {
    let Some(name) = &job.file.post.dialect_file else { return Ok(()) };
    let wrong = |why: String| {
        let reader = job.post.dialect().name();
        job.wrong(format!("post.dialect_file: {name} does not write what the reader of `{reader}` reads: {why}"))
    };
    let spec = ProgramSpec { program: NcProgram { blocks: blocks(job, spec) }, ..spec.clone() };
    let written = write_program_with_lines(&spec, &job.post).map_err(|e| job.wrong(format!("post: {e}")))?;
    without_effect(job, &spec, &written.text)?;
    let program = read_program(&written.text, job.post.dialect()).map_err(|e| wrong(e.to_string()))?;
    let lines: Vec<&str> = written.text.lines().collect();
    for (k, block) in spec.program.blocks.iter().enumerate() {
        let from = written.block_lines[k];
        // Nothing distinguishes the last block's lines from the template's: it is a cut, on one
        // line.
        let to = written.block_lines.get(k + 1).copied().unwrap_or(from + 1);
        let read: Vec<&ReadBlock> = program.blocks.iter().filter(|b| (from..to).contains(&b.line)).collect();
        if let Err(what) = is_read(job, block, &read) {
            let text = lines.get(from as usize - 1).copied().unwrap_or_default();
            return Err(wrong(format!("line {from}, `{text}`, should be {what}")));
        }
    }
    nothing_added(job, &spec)
}

/// Returns a rapid, the commands between passes, and cuts.
fn blocks(job: &Job, spec: &ProgramSpec) -> Vec<Block> {
    let first =
        spec.program.blocks.iter().find_map(|b| if let Block::Rapid { words } = b { Some(*words) } else { None });
    let first = first.unwrap_or_default();
    let moved = |n: f64| {
        let mut words = first;
        for word in first.iter() {
            // As many as there were.
            let _ = words.set(word.letter, word.value + n * PROBE_WAY);
        }
        words
    };
    let feed = PROBE_FEED.max(spec.smallest_feed);
    let mut all = vec![Block::Comment("PROBE".to_owned()), Block::Rapid { words: first }];
    if spec.coolant != Coolant::Off {
        all.push(Block::Coolant(spec.coolant));
    }
    let with_vectors = |n: f64| {
        let tool_axis = Unit::new_normalize(Vector3::new(0.36, -0.48, 0.8));
        let vectors = Box::new(CutVectors { tool_axis, normal: Vector3::z_axis() });
        Block::LinearVectors { words: moved(n), feed, vectors }
    };
    // A cut between the rapids: each says its own motion word.
    all.push(if may_mix(job) { Block::Linear { words: moved(1.0), feed } } else { with_vectors(1.0) });
    all.push(Block::Rapid { words: moved(2.0) });
    if job.second.is_none() {
        all.push(Block::SpindleOn { rpm: spec.spindle.rpm, clockwise: spec.spindle.clockwise, spindle: None });
    }
    if job.post.vector_rule().is_some() {
        all.push(with_vectors(3.0));
    }
    if may_mix(job) {
        all.push(Block::Linear { words: moved(-1.0), feed });
    }
    all
}

/// Returns whether cuts with rotary words can be written.
fn may_mix(job: &Job) -> bool {
    job.post.vector_rule().is_none_or(|rule| rule.between_rotary_words)
}

/// Errors with the intended meaning if the blocks read differ from it.
fn is_read(job: &Job, block: &Block, read: &[&ReadBlock]) -> Result<(), String> {
    let has = |wanted: &ReadCommand| read.iter().any(|b| b.commands.contains(wanted));
    let ok = |is_so: bool, what: &str| if is_so { Ok(()) } else { Err(what.to_owned()) };
    match block {
        Block::Rapid { words } => {
            let motion = read.iter().find_map(|b| b.motion.as_ref()).ok_or("a rapid")?;
            ok(motion.kind.is_rapid(), "a rapid")?;
            words.iter().try_for_each(|word| is_at(job, read, word))
        }
        Block::Linear { words, feed } => {
            is_cut(job, read, *feed)?;
            words.iter().try_for_each(|word| is_at(job, read, word))
        }
        Block::LinearVectors { words, feed, vectors } => {
            is_cut(job, read, *feed)?;
            let mut linear = words.iter().filter(|w| w.letter.kind() == AxisKind::Linear);
            linear.try_for_each(|word| is_at(job, read, word))?;
            let axis = read.iter().find_map(|b| b.motion.as_ref()?.tool.as_ref()?.axis).ok_or("a tool vector")?;
            let apart = (Vector3::from(axis).normalize() - vectors.tool_axis.into_inner()).norm();
            ok(apart <= 1.5 * job.post.rounding_bound().vector, "a tool vector (0.36, -0.48, 0.8)")
        }
        Block::Coolant(coolant) => ok(has(&ReadCommand::Coolant(*coolant)), "the coolant's word"),
        Block::SpindleOn { rpm, clockwise, .. } => {
            let turns = has(&ReadCommand::SpindleOn { clockwise: *clockwise });
            ok(turns && has(&ReadCommand::SpindleSpeed(rpm.round())), "the start of the spindle with its speed")
        }
        Block::Comment(_) => {
            let is_comment = |b: &&ReadBlock| matches!(b.commands.as_slice(), [ReadCommand::Comment(_)]);
            ok(read.iter().all(|b| is_comment(b) && b.motion.is_none()), "a comment")
        }
        _ => Ok(()),
    }
}

/// Errors unless a feed move with this feed was read: not faster, and at most one unit slower.
fn is_cut(job: &Job, read: &[&ReadBlock], feed: f64) -> Result<(), String> {
    let motion = read.iter().find_map(|b| b.motion.as_ref()).ok_or("a feed move")?;
    let mode = job.post.feed_mode();
    let decimals = job.post.decimals();
    let unit = |decimals: u8| 10f64.powi(-i32::from(decimals));
    let unit =
        if mode == facemill_nc_program::FeedMode::G93 { unit(decimals.inverse_time) } else { unit(decimals.feed) };
    let found = motion.feed.filter(|f| f.mode == mode && f.value <= feed + 1e-9 && f.value > feed - unit - 1e-9);
    if motion.kind.is_rapid() || found.is_none() {
        return Err(format!("a feed move with F{feed} of {}", mode.name()));
    }
    Ok(())
}

fn is_at(job: &Job, read: &[&ReadBlock], word: AxisWord) -> Result<(), String> {
    let bound = job.post.rounding_bound();
    let slack = if word.letter.kind() == AxisKind::Linear { bound.linear } else { bound.rotary.to_degrees() };
    let at = read.iter().find_map(|b| b.motion.as_ref()).and_then(|m| m.position.get(word.letter));
    match at {
        Some(AxisAt::Word(value)) if (value - word.value).abs() <= slack * (1.0 + 1e-6) + 1e-12 => Ok(()),
        _ => Err(format!("{}{}", word.letter, word.value)),
    }
}

/// Tries the post's template on a program that only is at home, so that its faults are reported
/// before anything is planned.
///
/// # Errors
/// If no program can be written with it.
pub fn try_template(job: &Job, setup: &Setup<'_>, words: &WordMap) -> Result<(), Failure> {
    let Some((_, operation)) = job.operations_of(setup.file).next() else { return Ok(()) };
    let home = job.machine.home();
    let at_home = words.words(home.as_slice()).map_err(|e| Failure::Internal(e.to_string()))?;
    let mut program = NcProgram { blocks: vec![Block::Rapid { words: at_home }] };
    let spec = program_spec(job, setup, operation, words, &mut program)?;
    write_program(&spec, &job.post).map_err(|e| job.wrong(format!("post: {e}")))?;
    probe(job, &spec)
}
