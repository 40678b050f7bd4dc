//! Strict JSON files: how every format of the project is read and described.
//!
//! A format is a struct with `Deserialize`, `Serialize`, `JsonSchema` and `deny_unknown_fields`.
//! [`from_json`] reads it and turns whatever is wrong into a [`FormatError`] that names the field,
//! the place in the text, and, for a key that does not exist, the nearest one that does. Enums with
//! data are written externally tagged (`{"box": {…}}`), because serde loses the place of an error
//! inside internally tagged and untagged ones.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `key_limit` | ranges of the numbers of a file, by key |
//!
//! It must not know what the files hold, and opens none.

mod key_limit;

pub use key_limit::KeyLimit;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

/// Fault of a file, with its place and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}{}", self.place(), hint.as_ref().map(|h| format!("; {h}")).unwrap_or_default())]
#[non_exhaustive]
pub struct FormatError {
    /// Path of the field, such as `operations[0].search.tilt_deg`; empty at the top level. The
    /// message has a long one without its middle.
    pub field: String,
    /// Line, from 1; 0 of a value that has no text.
    pub line: usize,
    /// Column, from 1; 0 of a value that has no text.
    pub column: usize,
    /// Fault.
    pub message: String,
    /// Remedy, if one is known.
    pub hint: Option<String>,
}

impl FormatError {
    /// Field and place with the colon behind them.
    fn place(&self) -> String {
        let Self { field, line, column, .. } = self;
        let has_field = !field.is_empty() && field != ".";
        let field = shortened(field);
        match (has_field, *line) {
            (true, 0) => format!("{field}: "),
            (false, 0) => String::new(),
            (true, line) => format!("{field}, line {line}, column {column}: "),
            (false, line) => format!("line {line}, column {column}: "),
        }
    }
}

/// Most steps of a path that a message shows whole, and the steps at both ends of a longer one.
const SHOWN_STEPS: usize = 12;
const FIRST_STEPS: usize = 6;
const LAST_STEPS: usize = 3;

/// Most characters of a path that a message shows whole, and those at both ends of a longer one.
const SHOWN_CHARS: usize = 160;
const FIRST_CHARS: usize = 80;
const LAST_CHARS: usize = 40;

/// Returns a path for a message. Files of nested lists or long keys have paths of any length.
fn shortened(path: &str) -> String {
    let starts = path.char_indices().filter(|(k, c)| *k == 0 || matches!(c, '.' | '['));
    let starts: Vec<usize> = starts.map(|(k, _)| k).collect();
    let mut text = path.to_owned();
    if starts.len() > SHOWN_STEPS {
        text = format!("{}…{}", &path[..starts[FIRST_STEPS]], &path[starts[starts.len() - LAST_STEPS]..]);
    }
    let n_chars = text.chars().count();
    if n_chars > SHOWN_CHARS {
        let first: String = text.chars().take(FIRST_CHARS).collect();
        let last: String = text.chars().skip(n_chars - LAST_CHARS).collect();
        text = format!("{first}…{last}");
    }
    text
}

/// Reads a strict JSON file.
///
/// # Errors
/// When the text is not JSON, a key is unknown, missing or twice there, or a value is of the wrong
/// kind.
pub fn from_json<T: DeserializeOwned>(text: &[u8]) -> Result<T, FormatError> {
    // Editors on some systems start files with a byte order mark, which is no part of the JSON.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut json = serde_json::Deserializer::from_slice(text);
    let value = serde_path_to_error::deserialize(&mut json).map_err(|e| {
        // Where the text ends in the middle, the path ends in "?".
        let field = e.path().to_string();
        let field = field.strip_suffix('?').map_or(field.as_str(), |known| known.trim_end_matches('.'));
        format_error(field.to_owned(), e.inner())
    })?;
    json.end().map_err(|e| format_error(String::new(), &e))?;
    Ok(value)
}

/// Reads a value that was taken from a file and changed, as strictly as [`from_json`] reads the
/// file.
///
/// # Errors
/// When a key is unknown or missing, or a value is of the wrong kind.
pub fn from_value<T: DeserializeOwned>(value: Value) -> Result<T, FormatError> {
    serde_path_to_error::deserialize(value).map_err(|e| format_error(e.path().to_string(), e.inner()))
}

fn format_error(field: String, e: &serde_json::Error) -> FormatError {
    let full = e.to_string();
    let place = format!(" at line {} column {}", e.line(), e.column());
    let mut message = full.strip_suffix(&place).unwrap_or(&full).to_owned();
    if e.is_eof() {
        message = format!("the file ends in the middle ({message})");
    }
    let hint = nearest_key(&message).map(|k| format!("did you mean `{k}`?"));
    FormatError { field, line: e.line(), column: e.column(), message, hint }
}

/// The known key nearest to the unknown one, read from serde's "unknown field `x`, expected one of
/// `a`, `b`".
fn nearest_key(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown field `").or_else(|| message.strip_prefix("unknown variant `"))?;
    let (unknown, rest) = rest.split_once('`')?;
    let known = rest.split('`').skip(1).step_by(2);
    known
        .map(|k| (strsim::damerau_levenshtein(&unknown.to_lowercase(), k), k))
        .min()
        // Farther than half of the word it is a guess, not a typing error.
        .filter(|(distance, k)| *distance <= k.len().max(unknown.len()).div_ceil(2))
        .map(|(_, k)| k.to_owned())
}

/// Writes a format's value as indented JSON with a newline at its end; the same value always gives
/// the same bytes.
///
/// # Panics
/// When the value holds a map with keys that are not strings, which no format of the project does.
pub fn to_json<T: Serialize>(value: &T) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("formats have string keys");
    text.push('\n');
    text
}

/// JSON Schema (draft 2020-12) of a format, as [`to_json`] writes it. Each paragraph of a
/// description is one line, however the comment that it comes from is wrapped.
#[must_use]
pub fn schema<T: JsonSchema>() -> String {
    let settings = SchemaSettings::draft2020_12().with_transform(RecursiveTransform(join_description));
    to_json(&settings.into_generator().into_root_schema_for::<T>())
}

/// Joins the lines of the description of a schema.
fn join_description(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = joined_paragraphs(text);
    }
}

/// Joins the lines of each paragraph by blanks; code between fences, items of lists and rows of
/// tables keep lines of their own.
fn joined_paragraphs(text: &str) -> String {
    let mut joined = String::with_capacity(text.len());
    let mut in_code = false;
    let mut continues = false;
    for line in text.lines() {
        let fence = line.starts_with("```");
        let own_line = in_code || fence || line.is_empty() || ["- ", "* ", "|"].iter().any(|m| line.starts_with(m));
        if !joined.is_empty() {
            joined.push(if continues && !own_line { ' ' } else { '\n' });
        }
        joined.push_str(if in_code { line } else { line.trim() });
        in_code ^= fence;
        continues = !in_code && !fence && !line.is_empty();
    }
    joined
}

#[cfg(test)]
#[path = "../tests/unit/lib.rs"]
mod tests;
