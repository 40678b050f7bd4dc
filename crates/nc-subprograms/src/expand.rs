//! Calls replaced by the blocks of subprograms.

use std::collections::BTreeMap;
use std::ops::Range;

use facemill_nc_program::Dialect;

use crate::calls::Target;
use crate::line_map::LineMap;
use crate::sources::Source;

/// Most calls within each other; controls have 4 to 19.
const DEEPEST: usize = 16;

/// Name and bytes of a file.
type NamedFile = (String, Vec<u8>);

/// Largest expanded text, and most bytes of the files that are called.
const LARGEST: usize = 1 << 28;

/// Most lines of subprograms, and runs of them. 256 MiB of usual blocks have fewer.
const MOST_STEPS: u32 = 20_000_000;

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
    /// Repetitions of repetitions.
    #[error("{file}, line {line}: with the calls up to here subprograms run more than {MOST_STEPS} blocks")]
    TooLong {
        /// File of the call.
        file: String,
        /// Its line there, from 1.
        line: u32,
    },
    /// The files of subprograms are too large.
    #[error("{file}, line {line}: with the file that is called here subprograms have more than 256 MiB")]
    FilesTooLarge {
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
        let file = self.file(written);
        (&file.name, written.saturating_sub(file.first_line) + 1)
    }

    /// Returns the text of a written line, without blanks at its ends; empty behind the last one.
    #[must_use]
    pub fn written_text(&self, written: u32) -> String {
        let file = self.file(written);
        let mut lines = file.text.split(|byte| *byte == b'\n');
        let line = lines.nth(written.saturating_sub(file.first_line) as usize).unwrap_or_default();
        String::from_utf8_lossy(line.trim_ascii()).into_owned()
    }

    fn file(&self, written: u32) -> &ExpandedFile {
        let behind = self.files.partition_point(|file| file.first_line <= written);
        &self.files[behind.saturating_sub(1)]
    }
}

/// Expands the calls of a program: M98 P (FANUC, Haas, Mazak), M97 P (Haas), O CALL (LinuxCNC),
/// CALL LBL and CALL PGM (Heidenhain), and names alone (Siemens), each alone in its block, without
/// arguments. Subprograms are sought in the text, then by `file`, which gets the names that a file
/// may have and returns the name and the bytes of the one that exists.
///
/// Returns `None` where no call is expanded: the text is what runs. A call stays as it is where its
/// subprogram is missing, has no end, has branches, jumps, local variables or an end of the
/// program, counts in another unit (Heidenhain), or is defined behind the call (LinuxCNC). Names
/// with a folder stay, too: `file` does not know where the control looks.
///
/// # Errors
/// If calls are nested too deeply or run too many blocks, or files or the text become too large.
pub fn expand(
    text: &[u8],
    name: &str,
    dialect: Dialect,
    file: &dyn Fn(&[String]) -> Option<NamedFile>,
) -> Result<Option<ExpandedProgram>, ExpandError> {
    let mut work = Expansion {
        dialect,
        file,
        sources: vec![Source::new(name.to_owned(), text.to_vec(), 1, dialect)],
        known: BTreeMap::new(),
        of_files: BTreeMap::new(),
        n_called_bytes: 0,
        out: Vec::new(),
        lines: LineMap::default(),
        n_calls: 0,
        n_steps: 0,
        main_line: 0,
    };
    for range in work.sources[0].main().to_vec() {
        work.append((0, range), 0)?;
    }
    let Expansion { sources, out, lines, n_calls, .. } = work;
    if n_calls == 0 {
        return Ok(None);
    }
    let of = |source: Source| ExpandedFile { name: source.name, text: source.text, first_line: source.first_line };
    Ok(Some(ExpandedProgram { text: out, lines, files: sources.into_iter().map(of).collect(), n_calls }))
}

/// Returns a text whose lines with a number in front count on from the first of them: for an
/// expanded program of a control that numbers every line (Heidenhain), where lines of subprograms
/// have numbers of their own.
#[must_use]
pub fn renumbered(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let mut next: Option<u64> = None;
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let digits = line.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let number = std::str::from_utf8(&line[..digits]).ok().and_then(|digits| digits.parse::<u64>().ok());
        let Some(number) = number else {
            out.extend_from_slice(line);
            continue;
        };
        let own = next.unwrap_or(number);
        out.extend_from_slice(own.to_string().as_bytes());
        out.extend_from_slice(&line[digits..]);
        next = Some(own.saturating_add(1));
    }
    out
}

/// Lines of a source.
type Lines = (usize, Range<usize>);

struct Expansion<'f> {
    dialect: Dialect,
    file: &'f dyn Fn(&[String]) -> Option<NamedFile>,
    sources: Vec<Source>,
    known: BTreeMap<LinePlace, Option<Lines>>,
    /// Sources that were sought as files.
    of_files: BTreeMap<Target, Option<usize>>,
    n_called_bytes: usize,
    out: Vec<u8>,
    lines: LineMap,
    n_calls: usize,
    n_steps: u32,
    /// Line of the main program that runs.
    main_line: usize,
}

/// All that decides which lines a call means: the source of the call, which labels depend on, its
/// target, and whether subprograms of this name are defined by now in the main program and above
/// the call (LinuxCNC).
type LinePlace = (usize, Target, [bool; 2]);

impl Expansion<'_> {
    /// Appends lines of a source, with the subprograms that they call.
    fn append(&mut self, (source, lines): Lines, depth: usize) -> Result<(), ExpandError> {
        for k in lines {
            if depth == 0 {
                self.main_line = k;
            } else {
                self.step(source, k)?;
            }
            let called = self.sources[source].call(k).cloned();
            let found = match called {
                Some(called) => self.subprogram(source, k, called.target)?.map(|lines| (lines, called.times)),
                None => None,
            };
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
                let (file, line) = self.place(source, k);
                return Err(ExpandError::TooDeep { file, line });
            }
            self.n_calls += 1;
            for _ in 0..times {
                self.step(source, k)?;
                self.append(lines.clone(), depth + 1)?;
                if self.out.len() > LARGEST {
                    let (file, line) = self.place(source, k);
                    return Err(ExpandError::TooLarge { file, line });
                }
            }
        }
        Ok(())
    }

    /// Counts a line of a subprogram, or a run of one.
    fn step(&mut self, source: usize, k: usize) -> Result<(), ExpandError> {
        self.n_steps += 1;
        if self.n_steps <= MOST_STEPS {
            return Ok(());
        }
        let (file, line) = self.place(source, k);
        Err(ExpandError::TooLong { file, line })
    }

    fn place(&self, source: usize, k: usize) -> (String, u32) {
        (self.sources[source].name.clone(), k as u32 + 1)
    }

    /// Returns the lines of a subprogram that does the same in place of its call in line `k`.
    fn subprogram(&mut self, source: usize, k: usize, target: Target) -> Result<Option<Lines>, ExpandError> {
        let is_above = |at: usize, line: usize| {
            matches!(target, Target::Word(_)) && self.sources[at].subprogram(&target).is_some_and(|sub| sub.end < line)
        };
        let is_defined = [is_above(0, self.main_line), source > 0 && is_above(source, k)];
        let place = (source, target, is_defined);
        if let Some(known) = self.known.get(&place) {
            return Ok(known.clone());
        }
        let found = self.find(&place, k)?.filter(|(of, lines)| self.sources[*of].is_plain(lines));
        self.known.insert(place, found.clone());
        Ok(found)
    }

    fn find(&mut self, (source, target, is_defined): &LinePlace, k: usize) -> Result<Option<Lines>, ExpandError> {
        let (dialect, source) = (self.dialect, *source);
        let in_text = |at: usize| Some((at, self.sources[at].subprogram(target)?));
        let own = in_text(source);
        let found = match target {
            // Labels and blocks are those of the calling program, others also of the main one.
            Target::Block(_) | Target::Label(_) => return Ok(own),
            Target::Word(_) => {
                // The interpreter knows those that it has read, and seeks a file for others.
                let [in_main, above] = *is_defined;
                let known = if above { own.clone() } else { None }.or_else(|| in_text(0).filter(|_| in_main));
                if known.is_none() && (own.is_some() || in_text(0).is_some()) {
                    return Ok(None);
                }
                known
            }
            _ => own.or_else(|| in_text(0)),
        };
        if found.is_some() {
            return Ok(found);
        }
        let Some(at) = self.source_of_file(target, source, k)? else { return Ok(None) };
        let of_file = &self.sources[at];
        let caller = &self.sources[source];
        if dialect == Dialect::Heidenhain && (caller.unit().is_none() || caller.unit() != of_file.unit()) {
            return Ok(None);
        }
        Ok(of_file.whole(target, dialect).map(|lines| (at, lines)))
    }

    /// Returns the source that is the file of a subprogram, which line `k` calls.
    fn source_of_file(&mut self, target: &Target, source: usize, k: usize) -> Result<Option<usize>, ExpandError> {
        if let Some(known) = self.of_files.get(target) {
            return Ok(*known);
        }
        let names = file_names(target, self.dialect);
        let found = if names.is_empty() { None } else { (self.file)(&names) };
        let at = match found {
            None => None,
            Some((name, text)) => {
                let known = self.sources.iter().position(|source| source.name == name);
                Some(match known {
                    Some(at) => at,
                    None => self.add_source(name, text, source, k)?,
                })
            }
        };
        self.of_files.insert(target.clone(), at);
        Ok(at)
    }

    fn add_source(&mut self, name: String, text: Vec<u8>, source: usize, k: usize) -> Result<usize, ExpandError> {
        self.n_called_bytes = self.n_called_bytes.saturating_add(text.len());
        if self.n_called_bytes > LARGEST {
            let (file, line) = self.place(source, k);
            return Err(ExpandError::FilesTooLarge { file, line });
        }
        let first_line = self.sources.last().map_or(1, |last| last.first_line + last.n_lines() as u32);
        self.sources.push(Source::new(name, text, first_line, self.dialect));
        Ok(self.sources.len() - 1)
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
