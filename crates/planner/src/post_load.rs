//! The job's dialect file and template, and whether what they write is what the reader reads.

use std::collections::BTreeMap;
use std::path::Path;

use facemill_nc_program::{
    AxisAt, AxisKind, AxisWord, Block, Coolant, CutVectors, Dialect, DialectFile, FeedMode, LengthRule, NcProgram,
    PostError, PostSettings, ProgramSpec, ReadBlock, ReadCommand, Template, read_program, write_program_with_lines,
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
    if let Some(other) = control_of(&rules, post.dialect) {
        let (own, other) = (post.dialect.name(), other.name());
        let what = format!(
            "is a dialect file of {other}, and post.dialect is {own}, whose reader and template do not know its words: set \
             post.dialect to {other}, or make the file from that of {own}"
        );
        return Err(Failure::input(&path, what));
    }
    let template = template.unwrap_or_else(|| post.dialect.template());
    post.settings_of(rules, template).map_err(|e| match e {
        PostError::Dialect { field, why } => Failure::input(&path, format!("{field}: {why}")),
        other => Failure::input(job_path, format!("post.{other}")),
    })
}

/// The control whose own file these rules were made from, where that is not `own`: the one of the fewest words that it does not
/// write so. Numbers and switches, which every shop sets as its control takes them, do not count, nor do words left out.
fn control_of(rules: &DialectFile, own: Dialect) -> Option<Dialect> {
    let found = words(rules);
    let apart = |dialect: Dialect| {
        let known = words(&dialect.file());
        found.iter().filter(|(place, word)| known.get(*place) != Some(*word)).count()
    };
    let nearest = Dialect::ALL.into_iter().min_by_key(|d| apart(*d))?;
    (apart(nearest) < apart(own)).then_some(nearest)
}

/// Keys of dialect files whose texts are no words of programs.
const NO_WORDS: [&str; 5] = ["note", "absent", "law", "laws", "rapids"];

/// What a dialect file writes into programs, by its place: every text, and every list of texts as a whole.
fn words(rules: &DialectFile) -> BTreeMap<String, serde_json::Value> {
    fn add(at: &str, value: &serde_json::Value, all: &mut BTreeMap<String, serde_json::Value>) {
        use serde_json::Value::{Array, Object, String};
        match value {
            Object(keys) => {
                let said = keys.iter().filter(|(key, _)| !NO_WORDS.contains(&key.as_str()));
                said.for_each(|(key, value)| add(&format!("{at}/{key}"), value, all));
            }
            Array(items) if items.iter().any(|item| item.is_object()) => {
                items.iter().enumerate().for_each(|(k, item)| add(&format!("{at}/{k}"), item, all));
            }
            Array(_) | String(_) => drop(all.insert(at.to_owned(), value.clone())),
            _ => {}
        }
    }
    let mut all = BTreeMap::new();
    let file = serde_json::to_value(rules).unwrap_or_default();
    for part in ["feeds", "motion", "words"] {
        add(part, &file[part], &mut all);
    }
    all
}

/// A key of dialect files that says what stands around the motions, which is the template's.
struct TemplateKey {
    key: &'static str,
    lines: fn(&DialectFile) -> Vec<String>,
    /// Takes the value of the second into the first.
    reset: fn(&mut DialectFile, &DialectFile),
}

fn length_lines(rule: &LengthRule) -> Vec<String> {
    rule.before.iter().chain([&rule.code, &rule.end]).cloned().collect()
}

/// Keys that a program of this feed mode depends on.
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

/// A key that the shop has changed and that changes nothing, because the template says it: then the shop means something
/// else than what is written.
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
                "post.dialect_file: {name}, {key}: is `{is}` in place of `{was}`, and no line of the program changes by it: the \
                 template says it; write it into a template of your own (post.template), or leave the key as it was"
            )));
        }
    }
    Ok(())
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
    without_effect(job, &spec, &written.text)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A dialect file with values changed at places, and keys taken away (`None`).
    fn changed(dialect: Dialect, changes: &[(&str, &str, Option<serde_json::Value>)]) -> DialectFile {
        let mut file = serde_json::to_value(dialect.file()).unwrap();
        for (object, key, value) in changes {
            let object = file.pointer_mut(object).unwrap().as_object_mut().unwrap();
            match value {
                Some(value) => drop(object.insert((*key).to_owned(), value.clone())),
                None => drop(object.remove(*key).unwrap()),
            }
        }
        serde_json::from_value(file).unwrap()
    }

    /// What a shop sets as its control takes it: no words.
    fn shop_numbers() -> Vec<(&'static str, &'static str, Option<serde_json::Value>)> {
        let four = serde_json::json!({"linear": 4, "rotary": 4, "feed": 4, "inverse_time": 4});
        vec![
            ("/numbers", "max_decimals", Some(four)),
            ("/numbers", "numbered_axes", Some(false.into())),
            ("/lines", "max_length", Some(128.into())),
            ("/program", "last_number", Some(9999.into())),
            ("", "several_heads", None),
        ]
    }

    #[test]
    fn numbers_that_a_shop_sets_make_no_file_of_another_control() {
        for dialect in Dialect::ALL {
            assert_eq!(control_of(&changed(dialect, &shop_numbers()), dialect), None, "{}", dialect.name());
        }
    }

    #[test]
    fn words_that_a_shop_leaves_out_make_no_file_of_another_control() {
        let mut changes = shop_numbers();
        let one_law = serde_json::json!([{"law": "tip_and_rotaries_linear", "code": ""}]);
        changes.push(("/motion/rtcp", "cutting", Some(one_law)));
        changes.push(("/words", "spindles", None));
        changes.push(("/words", "end", Some(serde_json::json!(["M9", "M30"]))));
        assert_eq!(control_of(&changed(Dialect::Fanuc, &changes), Dialect::Fanuc), None);
    }

    #[test]
    fn files_of_other_words_are_refused_under_every_other_control() {
        for from in Dialect::ALL {
            let file = changed(from, &shop_numbers());
            for own in Dialect::ALL.into_iter().filter(|own| *own != from) {
                assert_eq!(control_of(&file, own), Some(from), "{} under {}", from.name(), own.name());
            }
        }
    }
}
