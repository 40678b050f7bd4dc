//! The job's dialect file and template, and whether what they write is what the reader reads.

use std::path::Path;

use facemill_nc_program::{
    AxisAt, AxisKind, AxisWord, Block, Coolant, CutVectors, DialectFile, NcProgram, PostError, PostSettings,
    ProgramSpec, ReadBlock, ReadCommand, Template, read_program, write_program_with_lines,
};
use nalgebra::{Unit, Vector3};

use crate::job_file::JobFile;
use crate::load::Job;
use crate::{Failure, files};

/// Reads the files that the job's `post` names, and checks them.
///
/// # Errors
/// When a file cannot be read or is wrong; the message names file and field.
pub(crate) fn read_post(job_path: &Path, file: &JobFile) -> Result<PostSettings, Failure> {
    let beside = |name: &str| job_path.parent().unwrap_or(Path::new("")).join(name);
    let post = &file.post;
    let template = match &post.template {
        None => None,
        Some(name) => {
            let path = beside(name);
            let text = String::from_utf8(files::read(&path)?)
                .map_err(|e| Failure::input(&path, format!("not UTF-8 text: {e}")))?;
            Some(Template { name: name.clone(), text })
        }
    };
    let Some(name) = &post.dialect_file else {
        return post.settings(template).map_err(|e| Failure::input(job_path, format!("post.{e}")));
    };
    let path = beside(name);
    let rules: DialectFile =
        facemill_file_format::from_json(&files::read(&path)?).map_err(|e| Failure::input(&path, e))?;
    let template = template.unwrap_or_else(|| post.dialect.template());
    post.settings_of(rules, template).map_err(|e| match e {
        PostError::Dialect { field, why } => Failure::input(&path, format!("{field}: {why}")),
        other => Failure::input(job_path, format!("post.{other}")),
    })
}

/// How far a probe's cut goes along every axis, mm or deg: no word stays as it was, and every decimal is one.
const PROBE_WAY: f64 = 1.234_567;

/// A feed that stays the same with one decimal.
const PROBE_FEED: f64 = 432.5;

/// Holds what a shop's own dialect file writes against what the reader of the dialect reads: a program around `spec` with a
/// block of each kind that plans write.
///
/// # Errors
/// When a block is not read as it is meant, with the line.
pub(crate) fn probe(job: &Job, spec: &ProgramSpec) -> Result<(), Failure> {
    let Some(name) = &job.file.post.dialect_file else { return Ok(()) };
    let wrong = |why: String| {
        let reader = job.post.dialect().name();
        job.wrong(format!("post.dialect_file: {name} does not write what the reader of `{reader}` reads: {why}"))
    };
    let spec = ProgramSpec { program: NcProgram { blocks: blocks(job, spec) }, ..spec.clone() };
    let written = write_program_with_lines(&spec, &job.post).map_err(|e| job.wrong(format!("post: {e}")))?;
    let program = read_program(&written.text, job.post.dialect()).map_err(|e| wrong(e.to_string()))?;
    let lines: Vec<&str> = written.text.lines().collect();
    for (k, block) in spec.program.blocks.iter().enumerate() {
        let from = written.block_lines[k];
        // The last block's lines are told apart from the template's by nothing: it is a cut, on one line.
        let to = written.block_lines.get(k + 1).copied().unwrap_or(from + 1);
        let read: Vec<&ReadBlock> = program.blocks.iter().filter(|b| (from..to).contains(&b.line)).collect();
        if let Err(what) = is_read(job, block, &read) {
            let text = lines.get(from as usize - 1).copied().unwrap_or_default();
            return Err(wrong(format!("line {from}, `{text}`, should be {what}")));
        }
    }
    Ok(())
}

/// A rapid, the commands between passes, and cuts.
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
    all.push(Block::Linear { words: moved(1.0), feed });
    all.push(Block::Rapid { words: moved(2.0) });
    if job.second.is_none() {
        all.push(Block::SpindleOn { rpm: spec.spindle.rpm, clockwise: spec.spindle.clockwise, spindle: None });
    }
    if job.post.vector_rule().is_some() {
        let tool_axis = Unit::new_normalize(Vector3::new(0.36, -0.48, 0.8));
        let vectors = Box::new(CutVectors { tool_axis, normal: Vector3::z_axis() });
        all.retain(|b| !matches!(b, Block::Linear { .. }) || may_mix(job));
        all.push(Block::LinearVectors { words: moved(3.0), feed, vectors });
    }
    if may_mix(job) {
        all.push(Block::Linear { words: moved(-1.0), feed });
    }
    all
}

/// Whether cuts with rotary words can be written.
fn may_mix(job: &Job) -> bool {
    job.post.vector_rule().is_none_or(|rule| rule.between_rotary_words)
}

/// Whether what was read is what was meant; else what was meant.
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

/// Whether a feed move with this feed was read, the feed not faster and not more than a unit slower.
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
