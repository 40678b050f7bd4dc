//! Dialect file and template of a job.

use std::collections::BTreeMap;
use std::path::Path;

use facemill_nc_program::dialect::{DialectFile, PostError, Template};
use facemill_nc_program::read::ReadError;
use facemill_nc_program::{Dialect, PostSettings, ReadProgram, read_program};

use crate::failure::Failure;
use crate::format::job_file::JobFile;
use crate::load::job::Job;
use crate::load::job_files::JobFiles;

/// Reads the files that the job's `post` names, and checks them.
///
/// # Errors
/// If a file cannot be read or is wrong; the message names file and field.
pub fn read_post(job_path: &Path, file: &JobFile, files: &JobFiles) -> Result<PostSettings, Failure> {
    let beside = |name: &str| job_path.parent().unwrap_or(Path::new("")).join(name);
    let post = &file.post;
    let template = match &post.template {
        None => None,
        Some(name) => {
            let path = beside(name);
            let text = String::from_utf8(files.text(&path)?.into_owned())
                .map_err(|e| Failure::input(&path, format!("not UTF-8 text: {e}")))?;
            Some(Template { name: name.clone(), text })
        }
    };
    let Some(name) = &post.dialect_file else {
        return post.settings(template).map_err(|e| Failure::input(job_path, format!("post.{e}")));
    };
    let path = beside(name);
    let rules = dialect_file(&path, &files.text(&path)?, post.dialect, "post.dialect")?;
    let template = template.unwrap_or_else(|| post.dialect.template());
    post.settings_of(rules.clone(), template).map_err(|e| match e {
        PostError::Dialect { field, why } => Failure::input(&path, format!("{field}: {why}")),
        other => Failure::input(job_path, format!("post.{other}{}", said_by(&rules, name, &other))),
    })
}

/// Reads a shop's dialect file for a control of a dialect, and checks it.
///
/// # Errors
/// If the file cannot be read, has a wrong field, or has the words of another dialect; the message
/// names `dialect_key` as the remedy then.
pub fn read_dialect_file(path: &Path, dialect: Dialect, dialect_key: &str) -> Result<DialectFile, Failure> {
    let rules = dialect_file(path, &crate::files::read(path)?, dialect, dialect_key)?;
    match rules.check() {
        Ok(()) => Ok(rules),
        Err(PostError::Dialect { field, why }) => Err(Failure::input(path, format!("{field}: {why}"))),
        Err(other) => Err(Failure::input(path, other)),
    }
}

/// Returns the dialect file in a text, unless it has the words of another dialect.
fn dialect_file(path: &Path, text: &[u8], own: Dialect, dialect_key: &str) -> Result<DialectFile, Failure> {
    let rules: DialectFile = facemill_file_format::from_json(text).map_err(|e| Failure::input(path, e))?;
    let Some(other) = control_of(&rules, own) else { return Ok(rules) };
    let (own, other) = (own.name(), other.name());
    let what = format!(
        "is a dialect file of {other}, but {dialect_key} is {own}, whose reader and template do not know its words: set \
         {dialect_key} to {other}, or make the file from that of {own}"
    );
    Err(Failure::input(path, what))
}

impl Job {
    /// Reads a program as one for a control. For the job's own control, harmless functions and
    /// rapids under RTCP are those of the job's dialect file.
    ///
    /// # Errors
    /// As [`read_program`].
    pub fn read_program(&self, text: &[u8], dialect: Dialect) -> Result<ReadProgram, ReadError> {
        let mut program = read_program(text, dialect)?;
        if dialect == self.post.dialect() {
            program.harmless_functions.clone_from(&self.post.rules().harmless_functions);
            program.rtcp_rapids = self.post.rules().rtcp_rapids();
        }
        Ok(program)
    }
}

/// Returns the key of the dialect file of this name that sets the largest value of a number of
/// `post`; empty if it sets none.
fn said_by(rules: &DialectFile, name: &str, error: &PostError) -> String {
    let PostError::Range { field, value, max, .. } = error else { return String::new() };
    let most = &rules.numbers.max_decimals;
    let (key, limit) = match *field {
        "program_number" => ("program.last_number", rules.program.last_number),
        "max_line_length" => ("lines.max_length", rules.lines.max_length.into()),
        "decimals.linear" => ("numbers.max_decimals.linear", most.linear.into()),
        "decimals.rotary" => ("numbers.max_decimals.rotary", most.rotary.into()),
        "decimals.feed" => ("numbers.max_decimals.feed", most.feed.into()),
        "decimals.inverse_time" => ("numbers.max_decimals.inverse_time", most.inverse_time.into()),
        _ => return String::new(),
    };
    if limit == *max && value > max { format!(", the {key} of {name}") } else { String::new() }
}

/// Returns the control whose own file these rules were made from, if it is not `own`: the one from
/// which the fewest words differ. Ignores numbers and switches, which every shop sets for its
/// control, and omitted words.
fn control_of(rules: &DialectFile, own: Dialect) -> Option<Dialect> {
    let found = words(rules);
    let apart = |dialect: Dialect| {
        let known = words(&dialect.file());
        found.iter().filter(|(place, word)| known.get(*place) != Some(*word)).count()
    };
    let nearest = Dialect::ALL.into_iter().min_by_key(|d| apart(*d))?;
    (apart(nearest) < apart(own)).then_some(nearest)
}

/// Keys of dialect files whose texts are not words of programs.
const NO_WORDS: [&str; 5] = ["note", "absent", "law", "laws", "rapids"];

/// Returns the texts that a dialect file writes into programs, by their place: every text, and
/// every list of texts as a whole.
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

#[cfg(test)]
#[path = "../../tests/unit/load/post_load.rs"]
mod tests;
