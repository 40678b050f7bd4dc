//! Bounds on the size of what a template makes on its way: the engine counts steps, but not what
//! one of them makes.
//!
//! A template has no variables of its own, and what a loop goes through is of the context or
//! written out. So nothing that is made can grow from round to round: every value is made by one
//! expression in one tag, of at most some hundred texts, and repeated texts are at most a hundred
//! times as long. Filters that make more of their input are bounded themselves. Altogether no value
//! of a program with names of usual length is longer than a megabyte.

use minijinja::value::{Rest, Value, ValueOrKwargs};
use minijinja::{Environment, Error, ErrorKind, State, filters};

/// Longest template, bytes: ten times the longest of those that are shipped.
const LONGEST_TEMPLATE: usize = 64 << 10;

/// Longest tag, bytes.
const LONGEST_TAG: usize = 500;

/// Most times that a text may be repeated.
const MOST_REPEATED: f64 = 100.0;

/// Longest text that a filter may make, bytes.
const LONGEST_TEXT: usize = 4 << 10;

/// Most numbers of a range.
const LONGEST_RANGE: i64 = 1000;

/// Statements that a template may have.
const STATEMENTS: [&str; 6] = ["if", "elif", "else", "endif", "for", "endfor"];

/// Filters without a bound, and without a use in NC text.
const REMOVED_FILTERS: [&str; 8] = ["indent", "batch", "slice", "pprint", "groupby", "map", "zip", "chain"];

/// A fault of a template's source.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SourceFault {
    /// From 1.
    pub(super) line: usize,
    pub(super) message: String,
}

/// Puts bounded filters and functions in place of those without a bound.
pub(super) fn bound(environment: &mut Environment<'_>) {
    REMOVED_FILTERS.iter().for_each(|name| environment.remove_filter(name));
    ["namespace", "dict", "debug"].iter().for_each(|name| environment.remove_global(name));
    environment.add_filter("join", join);
    environment.add_filter("replace", replace);
    environment.add_filter("format", format);
    environment.add_function("range", range);
}

/// That nothing that a template makes can grow from round to round.
///
/// # Errors
/// With the first tag that could.
pub(super) fn check_source(text: &str) -> Result<(), SourceFault> {
    if text.len() > LONGEST_TEMPLATE {
        let message = format!("it has {} bytes, more than {LONGEST_TEMPLATE}", text.len());
        return Err(SourceFault { line: 1, message });
    }
    let mut at = 0;
    while let Some(tag) = next_tag(text, at) {
        let line = 1 + text[..tag.start].matches('\n').count();
        let fault = |message: String| SourceFault { line, message };
        if tag.end - tag.start > LONGEST_TAG && tag.kind != '#' {
            return Err(fault(format!("a tag of more than {LONGEST_TAG} bytes: share it among several")));
        }
        let words = words(tag.inside);
        match tag.kind {
            '%' => check_statement(&words).and_then(|()| check_expression(&words)).map_err(fault)?,
            '{' => check_expression(&words).map_err(fault)?,
            _ => {}
        }
        at = tag.end;
    }
    Ok(())
}

/// A tag: from `{{`, `{%` or `{#` to its end.
struct Tag<'t> {
    kind: char,
    inside: &'t str,
    start: usize,
    end: usize,
}

/// The next tag; one without an end goes to the end of the text.
fn next_tag(text: &str, from: usize) -> Option<Tag<'_>> {
    let openings = text[from..].match_indices('{').map(|(k, _)| from + k);
    let start = openings.into_iter().find(|&k| text[k + 1..].starts_with(['{', '%', '#']))?;
    let kind = char::from(text.as_bytes()[start + 1]);
    let inside = start + 2;
    let length = match kind {
        '#' => text[inside..].find("#}"),
        '%' => end_outside_of_quotes(&text[inside..], "%}"),
        _ => end_outside_of_quotes(&text[inside..], "}}"),
    };
    let (length, end) = length.map_or((text.len() - inside, text.len()), |length| (length, inside + length + 2));
    Some(Tag { kind, inside: &text[inside..inside + length], start, end })
}

fn end_outside_of_quotes(text: &str, end: &str) -> Option<usize> {
    let mut at = 0;
    while at < text.len() {
        if text[at..].starts_with(end) {
            return Some(at);
        }
        at += word(&text[at..]).len();
    }
    None
}

/// The word at the beginning of a tag's text that is not empty: a quoted text, a name or number, or
/// one character. `**` and `//` are one.
fn word(text: &str) -> &str {
    let mut characters = text.char_indices();
    let first = characters.next().map_or(' ', |(_, c)| c);
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let length = if first == '"' || first == '\'' {
        let mut is_escaped = false;
        let end = characters.find(|&(_, c)| {
            let ends = c == first && !is_escaped;
            is_escaped = c == '\\' && !is_escaped;
            ends
        });
        end.map_or(text.len(), |(k, _)| k + 1)
    } else if is_of_name(first) {
        let is_number = first.is_ascii_digit();
        let end = characters.find(|&(_, c)| !(is_of_name(c) || is_number && c == '.'));
        end.map_or(text.len(), |(k, _)| k)
    } else if text.starts_with("**") || text.starts_with("//") {
        2
    } else {
        first.len_utf8()
    };
    &text[..length]
}

fn words(mut text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    while !text.is_empty() {
        let next = word(text);
        if !next.trim().is_empty() {
            words.push(next);
        }
        text = &text[next.len()..];
    }
    words
}

/// A statement is a condition or a loop through something of the context, a list of texts and
/// numbers, or a range.
fn check_statement(words: &[&str]) -> Result<(), String> {
    let words = if let ["-" | "+", rest @ ..] = words { rest } else { words };
    let name = words.first().copied().unwrap_or("");
    if !STATEMENTS.contains(&name) {
        return Err(format!(
            "`{name}` is no statement of NC templates, which have {}: write what it makes where it is needed",
            STATEMENTS.join(", ")
        ));
    }
    if name != "for" {
        return Ok(());
    }
    if words.contains(&"recursive") {
        return Err("a loop of an NC template cannot call itself".to_owned());
    }
    let goes_through = words.iter().skip_while(|w| **w != "in").skip(1).take_while(|w| **w != "if");
    let goes_through: Vec<&str> = goes_through.copied().collect();
    let n_lists = goes_through.iter().filter(|w| **w == "[").count();
    let is_call = |k: usize| k > 0 && goes_through[k - 1].starts_with(|c: char| c.is_alphabetic() || c == '_');
    let has_tuple = (0..goes_through.len()).any(|k| goes_through[k] == "(" && !is_call(k));
    match goes_through.iter().find(|w| ["~", "+", "*", "**", "{"].contains(*w)) {
        Some(word) => Err(format!("a loop of an NC template goes through a list as it is; leave `{word}` out")),
        None if n_lists > 1 || has_tuple => {
            Err("a loop of an NC template goes through one list, without lists in it".to_owned())
        }
        None => Ok(()),
    }
}

/// A text is repeated a bounded number of times, and not one that has been joined or repeated in
/// the same tag.
fn check_expression(words: &[&str]) -> Result<(), String> {
    let stars: Vec<usize> = (0..words.len()).filter(|&k| words[k] == "*").collect();
    let Some(&star) = stars.first() else { return Ok(()) };
    let is_small = |word: Option<&&str>| {
        word.and_then(|w| w.parse::<f64>().ok()).is_some_and(|number| (0.0..=MOST_REPEATED).contains(&number))
    };
    let has_small = is_small(words[..star].last()) || is_small(words.get(star + 1));
    if stars.len() == 1 && has_small && !words.contains(&"~") && !words.contains(&"(") {
        return Ok(());
    }
    Err(format!(
        "`*` needs a number up to {MOST_REPEATED} beside it, which texts may be repeated by, and may be in a tag once, without `~` and brackets"
    ))
}

fn too_long(what: &str) -> Error {
    Error::new(ErrorKind::InvalidOperation, format!("{what} makes more than {LONGEST_TEXT} bytes"))
}

/// Filter `join(separator)`, bounded.
fn join(values: &Value, separator: Option<String>) -> Result<String, Error> {
    let mut text = String::new();
    for (k, value) in values.try_iter()?.enumerate() {
        if value.is_undefined() {
            return Err(Error::from(ErrorKind::UndefinedError));
        }
        let part = value.to_string();
        let between = if k > 0 { separator.as_deref().unwrap_or("") } else { "" };
        if text.len() + between.len() + part.len() > LONGEST_TEXT {
            return Err(too_long("join"));
        }
        text.push_str(between);
        text.push_str(&part);
    }
    Ok(text)
}

/// Filter `replace(from, to)`, bounded.
fn replace(text: String, from: String, to: String) -> Result<String, Error> {
    let n = text.matches(from.as_str()).count();
    if text.len() + n * to.len() > LONGEST_TEXT {
        return Err(too_long("replace"));
    }
    Ok(text.replace(from.as_str(), &to))
}

/// Filter `format(…)`, as in C and Python: `"%04d"|format(7)`. Widths and decimals have two digits
/// at most.
fn format(state: &mut State<'_, '_>, directives: &Value, values: Rest<ValueOrKwargs>) -> Result<Value, Error> {
    let text = directives.to_string();
    let is_wide = text.as_bytes().windows(3).any(|w| w.iter().all(u8::is_ascii_digit));
    if is_wide || text.contains('*') {
        let message = "the widths of format have two digits at most, and are numbers";
        return Err(Error::new(ErrorKind::InvalidOperation, message));
    }
    let made = filters::format(state, directives, values)?;
    if made.as_str().is_some_and(|m| m.len() > LONGEST_TEXT) { Err(too_long("format")) } else { Ok(made) }
}

/// Function `range(…)`, bounded.
fn range(from: i64, to: Option<i64>, step: Option<i64>) -> Result<Vec<i64>, Error> {
    let (from, to, step) = (to.map_or(0, |_| from), to.unwrap_or(from), step.unwrap_or(1));
    let wrong = |why: &str| Err(Error::new(ErrorKind::InvalidOperation, format!("range {why}")));
    if step == 0 {
        return wrong("cannot have steps of 0");
    }
    let length = (i128::from(to) - i128::from(from)) / i128::from(step);
    if length > i128::from(LONGEST_RANGE) {
        return wrong(&format!("has more than {LONGEST_RANGE} numbers"));
    }
    let within = |k: &i64| if step > 0 { *k < to } else { *k > to };
    Ok(std::iter::successors(Some(from), |k| k.checked_add(step)).take_while(within).collect())
}
