//! Sections of a program as subprograms.

use facemill_nc_program::Dialect;
use facemill_nc_program::dialect::{DialectFile, Numbering, SubprogramRule};

use crate::calls::label;
use crate::line_code::{block_number, line_code};
use crate::sections::Section;

/// Words, numbers and names of subprograms.
#[derive(Clone, Copy, Debug)]
pub struct SplitSettings<'a> {
    /// The control.
    pub dialect: Dialect,
    /// Its dialect file.
    pub rules: &'a DialectFile,
    /// Words of subprograms.
    pub rule: &'a SubprogramRule,
    /// Number of the first one.
    pub first_number: u32,
    /// Number of the main program, part of all names.
    pub program_number: u32,
    /// First part of names, upper-case letters: `PASS` gives `PASS_1001_1`.
    pub prefix: &'a str,
}

/// Main program with its subprograms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SplitProgram {
    /// Text of the main program, with subprograms that are in its file.
    pub main: String,
    /// Names and texts of the subprograms' own files.
    pub files: Vec<(String, String)>,
    /// Number behind the last one.
    pub next_number: u32,
}

/// Why a program has no subprograms.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SplitError {
    /// There is nothing to call.
    #[error("it has no passes")]
    Empty,
    /// The numbers of the control do not suffice.
    #[error(
        "{n} subprograms from number {first} on go beyond {last}, the last one of {control}; take a smaller \
         subprograms.first_number, or `\"per\": \"operation\"`"
    )]
    Numbers {
        /// Number of subprograms.
        n: usize,
        /// First number.
        first: u32,
        /// Largest number.
        last: u32,
        /// The control.
        control: String,
    },
    /// A file would be outside of the program's folder, or have no name that all systems take.
    #[error(
        "`{name}` of the dialect file is no name of a subprogram's file: it must be letters, digits, `_`, `-` and points, and \
         begin with a letter or a digit"
    )]
    FileName {
        /// The name.
        name: String,
    },
    /// A number is in use.
    #[error(
        "number {number} of a subprogram is in use in line {line} of the program; take another subprograms.first_number"
    )]
    Taken {
        /// The number.
        number: u32,
        /// Line of the flat program.
        line: u32,
    },
}

/// Takes sections out of a flat program as subprograms, and calls each where it was. Lines keep
/// their text; where every line has a number, main program and files are numbered anew.
///
/// # Errors
/// Without sections, or if numbers do not suffice or are in use.
pub fn split(text: &str, sections: &[Section], settings: &SplitSettings<'_>) -> Result<SplitProgram, SplitError> {
    let SplitSettings { rules, rule, first_number, .. } = *settings;
    if sections.is_empty() {
        return Err(SplitError::Empty);
    }
    let last = first_number as u64 + sections.len() as u64 - 1;
    if last > u64::from(rule.last_number) {
        let (n, first, last, control) = (sections.len(), first_number, rule.last_number, rules.name.clone());
        return Err(SplitError::Numbers { n, first, last, control });
    }
    let numbers = first_number..first_number + sections.len() as u32;
    check_free(text, &numbers, settings)?;
    let is_numbered = rules.lines.numbering == Numbering::EveryLine;
    let continued = rules.lines.continued.as_deref();
    let lines = if is_numbered { without_numbers(text, continued) } else { text.lines().collect() };
    let mut main: Vec<String> = Vec::new();
    let mut subprograms: Vec<Vec<String>> = Vec::new();
    let mut files: Vec<(String, String)> = Vec::new();
    let finish = |lines: &[String]| if is_numbered { numbered(lines, continued) } else { joined(lines) };
    let mut next = 0;
    for (k, section) in sections.iter().enumerate() {
        let (from, to) = (section.first_line as usize - 1, (section.last_line as usize).min(lines.len()));
        main.extend(lines[next..from.max(next)].iter().map(|line| (*line).to_owned()));
        let words = words_of(settings, k, &section.name);
        main.push(words.call.clone());
        let body = lines[from.max(next)..to].iter().map(|line| (*line).to_owned());
        let all: Vec<String> = words.begin.iter().cloned().chain(body).chain(words.end.iter().cloned()).collect();
        if words.file.is_empty() {
            subprograms.push(all);
        } else if !is_file_name(&words.file) {
            return Err(SplitError::FileName { name: words.file });
        } else {
            files.push((words.file, finish(&all)));
        }
        next = to;
    }
    let rest = lines[next..].iter().map(|line| (*line).to_owned());
    main.extend(rest);
    let at = if rule.in_front {
        0
    } else {
        // Behind the end of the main program, before the mark behind all programs.
        let is_mark = |line: &String| line.trim() == "%" || line.trim_start().starts_with("END PGM");
        main.iter().rposition(is_mark).filter(|at| *at > 0).unwrap_or(main.len())
    };
    main.splice(at..at, subprograms.into_iter().flatten());
    Ok(SplitProgram { main: finish(&main), files, next_number: numbers.end })
}

/// Returns whether a text is the name of a file in the program's folder, on every system.
fn is_file_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'.'))
}

/// Returns the words of a subprogram.
fn words_of(settings: &SplitSettings<'_>, k: usize, name: &str) -> SubprogramRule {
    let number = settings.first_number + k as u32;
    let digits = usize::from(settings.rules.program.digits);
    let id = format!("{}_{}_{}", settings.prefix, settings.program_number, k + 1);
    let comment = format!("{name} - SUBPROGRAM OF {}", settings.program_number);
    settings.rule.filled(&[
        ("number", &number.to_string()),
        ("padded", &format!("{number:0digits$}")),
        ("id", &id),
        ("lower_id", &id.to_lowercase()),
        ("name", &comment),
    ])
}

/// Refuses numbers of blocks and labels that the program has.
fn check_free(text: &str, numbers: &std::ops::Range<u32>, settings: &SplitSettings<'_>) -> Result<(), SplitError> {
    let in_text = settings.rule.numbers_of_program && settings.rule.file.is_empty();
    if !in_text || !settings.rule.call.contains("{number}") {
        return Ok(());
    }
    for (k, line) in text.lines().enumerate() {
        let number = if settings.dialect == Dialect::Heidenhain {
            label(&line_code(line.as_bytes(), settings.dialect)).and_then(|label| label.parse().ok())
        } else {
            block_number(line.as_bytes())
        };
        if let Some(number) = number.filter(|number| numbers.contains(number)) {
            return Err(SplitError::Taken { number, line: k as u32 + 1 });
        }
    }
    Ok(())
}

/// Returns the lines without the numbers that every line has, but one behind a line that goes on.
fn without_numbers<'t>(text: &'t str, continued: Option<&str>) -> Vec<&'t str> {
    let mut is_continued = false;
    let line = |line: &'t str| {
        let rest = line.trim_start_matches(|c: char| c.is_ascii_digit());
        let own = if is_continued || rest.len() == line.len() { line } else { rest.trim_start() };
        is_continued = goes_on(line, continued);
        own
    };
    text.lines().map(line).collect()
}

fn goes_on(line: &str, continued: Option<&str>) -> bool {
    continued.is_some_and(|mark| line.ends_with(mark))
}

/// Returns a text whose every line has its number.
fn numbered(lines: &[String], continued: Option<&str>) -> String {
    let mut text = String::new();
    let (mut number, mut is_continued) = (0, false);
    for line in lines {
        if !is_continued {
            text.push_str(&format!("{number} "));
            number += 1;
        }
        text.push_str(line);
        text.push('\n');
        is_continued = goes_on(line, continued);
    }
    text
}

fn joined(lines: &[String]) -> String {
    lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect()
}
