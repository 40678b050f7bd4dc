//! Calls replaced by the blocks of subprograms.

use std::collections::BTreeMap;
use std::ops::Range;

use facemill_nc_program::Dialect;

use crate::calls::{Target, call, is_plain, is_program_end, is_return, is_sub_end, label, program_begin, sub_begin};
use crate::line_code::{block_number, line_code};
use crate::line_map::LineMap;

/// Most calls within each other; controls have 4 to 19.
const DEEPEST: usize = 16;

/// Name and bytes of a file.
type NamedFile = (String, Vec<u8>);

/// Largest expanded text, bytes.
const LARGEST: usize = 1 << 28;

/// Why calls cannot be expanded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpandError {
    /// Subprograms call each other without end, or nearly so.
    #[error("{file}, line {line}: more than {DEEPEST} calls within each other; a subprogram calls itself")]
    TooDeep {
        /// File of the call.
        file: String,
        /// Its line there, from 1.
        line: u32,
    },
    /// The expanded text is too large.
    #[error("{file}, line {line}: with the calls up to here the program has more than 256 MiB")]
    TooLarge {
        /// File of the call.
        file: String,
        /// Its line there, from 1.
        line: u32,
    },
}

/// A program whose calls are replaced by the blocks of subprograms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpandedProgram {
    /// The text as the control runs it, without lines of subprograms that are not called.
    pub text: Vec<u8>,
    /// Written line of each of its lines.
    pub lines: LineMap,
    /// The main program, then the files of subprograms in the order of their first calls.
    pub files: Vec<ExpandedFile>,
    /// Calls that were expanded.
    pub n_calls: usize,
}

/// File of an expanded program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpandedFile {
    /// Its name.
    pub name: String,
    /// Its bytes.
    pub text: Vec<u8>,
    /// Written line of its first line: lines of all files count on.
    pub first_line: u32,
}

impl ExpandedProgram {
    /// Returns the file of a written line, and the line in it, from 1.
    #[must_use]
    pub fn place(&self, written: u32) -> (&str, u32) {
        let behind = self.files.partition_point(|file| file.first_line <= written);
        let file = &self.files[behind.saturating_sub(1)];
        (&file.name, written.saturating_sub(file.first_line) + 1)
    }
}

/// Expands the calls of a program: M98 P (FANUC, Haas, Mazak), M97 P (Haas), O CALL (LinuxCNC),
/// CALL LBL and CALL PGM (Heidenhain), and names alone (Siemens), each alone in its block, without
/// arguments. Subprograms are sought in the text, then by `file`, which gets the names that a file
/// may have and returns the name and the bytes of the one that exists.
///
/// Returns `None` where no call is expanded: the text is what runs. A call stays as it is where its
/// subprogram is missing, or has branches, jumps, local variables or an end of the program.
///
/// # Errors
/// If calls are nested too deeply, or the text becomes too large.
pub fn expand(
    text: &[u8],
    name: &str,
    dialect: Dialect,
    file: &dyn Fn(&[String]) -> Option<NamedFile>,
) -> Result<Option<ExpandedProgram>, ExpandError> {
    let mut work = Expansion {
        dialect,
        file,
        sources: Vec::new(),
        known: BTreeMap::new(),
        out: Vec::new(),
        lines: LineMap::default(),
        n_calls: 0,
    };
    work.add_source(name.to_owned(), text.to_vec());
    let main = work.sources[0].main(dialect);
    for range in main {
        work.append((0, range), 0)?;
    }
    let Expansion { sources, out, lines, n_calls, .. } = work;
    if n_calls == 0 {
        return Ok(None);
    }
    let of = |source: Source| ExpandedFile { name: source.name, text: source.text, first_line: source.first_line };
    Ok(Some(ExpandedProgram { text: out, lines, files: sources.into_iter().map(of).collect(), n_calls }))
}

/// A file with its lines.
struct Source {
    name: String,
    text: Vec<u8>,
    /// Bytes of each line, with its end.
    lines: Vec<Range<usize>>,
    /// Written line of the first one.
    first_line: u32,
}

impl Source {
    fn line(&self, k: usize) -> &[u8] {
        &self.text[self.lines[k].clone()]
    }

    fn code(&self, k: usize, dialect: Dialect) -> String {
        line_code(self.line(k), dialect)
    }

    /// Returns the lines that run when the file is started.
    fn main(&self, dialect: Dialect) -> Vec<Range<usize>> {
        let n = self.lines.len();
        let mut parts: Vec<Range<usize>> = Vec::new();
        let mut add = |from: usize, to: usize| {
            if from < to {
                parts.push(from..to);
            }
        };
        let (mut from, mut k, mut has_begun) = (0, 0, false);
        while k < n {
            let code = self.code(k, dialect);
            if dialect == Dialect::LinuxCnc
                && let Some(name) = sub_begin(&code)
            {
                add(from, k);
                let end = (k..n).find(|&j| is_sub_end(&self.code(j, dialect), name)).map_or(n, |j| j + 1);
                (from, k) = (end, end);
                continue;
            }
            if is_numbered(dialect) && program_begin(&code).is_some() {
                if has_begun {
                    break;
                }
                has_begun = true;
            }
            k += 1;
            if is_program_end(&code, dialect) {
                break;
            }
        }
        add(from, k);
        // The mark behind all programs.
        let is_last = |code: &str| code == "%" || code.starts_with("END PGM");
        if let Some(last) = (k..n).rev().find(|&j| is_last(&self.code(j, dialect))) {
            add(last, last + 1);
        }
        parts
    }

    /// Returns the lines between the begin of a subprogram and its end, if it is in this file.
    fn subprogram(&self, target: &Target, dialect: Dialect) -> Option<Range<usize>> {
        let n = self.lines.len();
        let code = |k: usize| self.code(k, dialect);
        let until_return = |from: usize| (from..n).find(|&k| is_return(&code(k), dialect)).map(|end| from..end);
        match target {
            Target::Number(number) => until_return((0..n).find(|&k| program_begin(&code(k)) == Some(*number))? + 1),
            Target::Block(number) => until_return((0..n).find(|&k| block_number(self.line(k)) == Some(*number))?),
            Target::Word(name) => {
                let begin = (0..n).find(|&k| sub_begin(&code(k)) == Some(name))?;
                let end = (begin..n).find(|&k| is_sub_end(&code(k), name))?;
                Some(begin + 1..end)
            }
            Target::Label(name) => {
                // A label that the main program passes is no subprogram.
                let main_end = (0..n).find(|&k| is_program_end(&code(k), dialect))?;
                let begin = (main_end..n).find(|&k| label(&code(k)) == Some(name))?;
                let end = (begin + 1..n).find(|&k| label(&code(k)).is_some())?;
                (label(&code(end)) == Some("0")).then_some(begin + 1..end)
            }
            Target::File(_) => None,
        }
    }

    /// Returns the lines of a subprogram that has this file for itself.
    fn whole(&self, target: &Target, dialect: Dialect) -> Option<Range<usize>> {
        let n = self.lines.len();
        let Target::File(name) = target else { return self.subprogram(target, dialect) };
        let is_code = |k: &usize| !self.code(*k, dialect).is_empty();
        let first = (0..n).find(is_code)?;
        if dialect == Dialect::Heidenhain {
            let end = (0..n).rev().find(is_code)?;
            let frames =
                self.code(first, dialect).starts_with("BEGIN PGM") && self.code(end, dialect).starts_with("END PGM");
            return frames.then_some(first + 1..end);
        }
        // `PROC NAME` without parameters and attributes is optional.
        let begin = match self.code(first, dialect) {
            code if code == format!("PROC{name}") => first + 1,
            code if code.starts_with("PROC") => return None,
            _ => first,
        };
        let end = (begin..n).find(|&k| is_return(&self.code(k, dialect), dialect)).unwrap_or(n);
        Some(begin..end)
    }
}

/// Returns whether programs of a control have numbers.
fn is_numbered(dialect: Dialect) -> bool {
    matches!(dialect, Dialect::Fanuc | Dialect::Haas | Dialect::Mazak)
}

/// Lines of a source.
type Lines = (usize, Range<usize>);

struct Expansion<'f> {
    dialect: Dialect,
    file: &'f dyn Fn(&[String]) -> Option<NamedFile>,
    sources: Vec<Source>,
    /// Subprograms by the source of the call, which labels depend on, and the target.
    known: BTreeMap<(usize, Target), Option<Lines>>,
    out: Vec<u8>,
    lines: LineMap,
    n_calls: usize,
}

impl Expansion<'_> {
    fn add_source(&mut self, name: String, text: Vec<u8>) -> usize {
        let mut lines = Vec::new();
        let mut from = 0;
        for line in text.split_inclusive(|byte| *byte == b'\n') {
            lines.push(from..from + line.len());
            from += line.len();
        }
        let first_line = self.sources.last().map_or(1, |last| last.first_line + last.lines.len() as u32);
        self.sources.push(Source { name, text, lines, first_line });
        self.sources.len() - 1
    }

    /// Appends lines of a source, with the subprograms that they call.
    fn append(&mut self, (source, lines): Lines, depth: usize) -> Result<(), ExpandError> {
        for k in lines {
            let code = self.sources[source].code(k, self.dialect);
            let called = call(&code, self.dialect);
            let found = called.and_then(|called| Some((self.subprogram(source, &called.target)?, called.times)));
            let place = || (self.sources[source].name.clone(), k as u32 + 1);
            let Some((lines, times)) = found else {
                let at = &self.sources[source];
                self.out.extend_from_slice(at.line(k));
                if !self.out.ends_with(b"\n") {
                    self.out.push(b'\n');
                }
                self.lines.push(at.first_line + k as u32);
                continue;
            };
            if depth == DEEPEST {
                let (file, line) = place();
                return Err(ExpandError::TooDeep { file, line });
            }
            self.n_calls += 1;
            for _ in 0..times {
                self.append(lines.clone(), depth + 1)?;
                if self.out.len() > LARGEST {
                    let (file, line) = (self.sources[source].name.clone(), k as u32 + 1);
                    return Err(ExpandError::TooLarge { file, line });
                }
            }
        }
        Ok(())
    }

    /// Returns the lines of a subprogram that does the same in place of its call.
    fn subprogram(&mut self, source: usize, target: &Target) -> Option<Lines> {
        if let Some(known) = self.known.get(&(source, target.clone())) {
            return known.clone();
        }
        let found = self.find(source, target).filter(|(of, lines)| {
            let mut codes = lines.clone().map(|k| self.sources[*of].code(k, self.dialect));
            codes.all(|code| is_plain(&code, self.dialect))
        });
        self.known.insert((source, target.clone()), found.clone());
        found
    }

    fn find(&mut self, source: usize, target: &Target) -> Option<Lines> {
        let dialect = self.dialect;
        // Labels and blocks are those of the calling program, others also of the main one.
        let places: &[usize] = match target {
            Target::Block(_) | Target::Label(_) => &[source],
            _ => &[source, 0],
        };
        if let Some(found) = places.iter().find_map(|&at| Some((at, self.sources[at].subprogram(target, dialect)?))) {
            return Some(found);
        }
        let names = file_names(target, dialect);
        let (name, text) = if names.is_empty() { None } else { (self.file)(&names) }?;
        let known = self.sources.iter().position(|source| source.name == name);
        let at = known.unwrap_or_else(|| self.add_source(name, text));
        Some((at, self.sources[at].whole(target, dialect)?))
    }
}

/// Returns the names that the file of a subprogram may have.
fn file_names(target: &Target, dialect: Dialect) -> Vec<String> {
    let with = |stems: &[String], endings: &[&str]| -> Vec<String> {
        stems.iter().flat_map(|stem| endings.iter().map(move |ending| format!("{stem}{ending}"))).collect()
    };
    match target {
        Target::Number(n) => {
            let stems = [format!("O{n:04}"), format!("O{n:05}"), format!("O{n}"), format!("{n}")];
            with(&stems, &["", ".nc", ".cnc", ".eia", ".txt"])
        }
        Target::Word(name) => with(&[name.trim_matches(['<', '>']).to_lowercase()], &[".ngc"]),
        Target::File(name) => {
            let endings: &[&str] = if dialect == Dialect::Heidenhain { &[".h"] } else { &[".spf", ".mpf"] };
            with(std::slice::from_ref(name), endings)
        }
        Target::Block(_) | Target::Label(_) => Vec::new(),
    }
}
