//! Files of programs, with the lines where subprograms begin and end.

use std::collections::BTreeMap;
use std::ops::Range;

use facemill_nc_program::Dialect;

use crate::calls::{
    Call, Target, call, is_plain, is_program_end, is_return, is_sub_end, label, program_begin, program_unit, sub_begin,
};
use crate::line_code::{block_number, line_code};

/// Returns whether a line can be a call that [`crate::expand`] expands: a program without such a
/// line has none. The line may have its end.
#[must_use]
pub fn may_call(line: &[u8], dialect: Dialect) -> bool {
    call(&line_code(line, dialect), dialect).is_some()
}

/// A file with its lines. Every line is taken apart once.
pub(crate) struct Source {
    pub(crate) name: String,
    pub(crate) text: Vec<u8>,
    /// Written line of the first one.
    pub(crate) first_line: u32,
    /// Bytes of each line, with its end.
    lines: Vec<Range<usize>>,
    calls: BTreeMap<usize, Call>,
    /// Lines that run when the file is started.
    main: Vec<Range<usize>>,
    /// Line of the first program of each number.
    numbers: BTreeMap<u32, usize>,
    /// Line of the first block of each number (Haas).
    blocks: BTreeMap<u32, usize>,
    /// Lines within each subprogram of LinuxCNC; of two of one name the first.
    words: BTreeMap<String, Range<usize>>,
    /// Lines of all labels, and for each name its places among them.
    labels: Vec<(usize, bool)>,
    labels_by_name: BTreeMap<String, Vec<usize>>,
    first_end: Option<usize>,
    returns: Vec<usize>,
    /// Begins of programs and marks of a tape, which no subprogram passes.
    limits: Vec<usize>,
    not_plain: Vec<usize>,
    /// First and last line with code, and that code.
    first: Option<(usize, String)>,
    last: Option<(usize, String)>,
}

impl Source {
    pub(crate) fn new(name: String, text: Vec<u8>, first_line: u32, dialect: Dialect) -> Self {
        let mut lines = Vec::new();
        let mut from = 0;
        for line in text.split_inclusive(|byte| *byte == b'\n') {
            lines.push(from..from + line.len());
            from += line.len();
        }
        let mut source = Self {
            name,
            text,
            first_line,
            lines,
            calls: BTreeMap::new(),
            main: Vec::new(),
            numbers: BTreeMap::new(),
            blocks: BTreeMap::new(),
            words: BTreeMap::new(),
            labels: Vec::new(),
            labels_by_name: BTreeMap::new(),
            first_end: None,
            returns: Vec::new(),
            limits: Vec::new(),
            not_plain: Vec::new(),
            first: None,
            last: None,
        };
        source.note_lines(dialect);
        source
    }

    fn note_lines(&mut self, dialect: Dialect) {
        let is_numbered = matches!(dialect, Dialect::Fanuc | Dialect::Haas | Dialect::Mazak);
        // Of the main program: where its next lines begin, where it stops, the mark behind all.
        let (mut from, mut stop, mut mark) = (0, None, None);
        let mut open: Option<(String, usize)> = None;
        for k in 0..self.lines.len() {
            let code = line_code(self.line(k), dialect);
            if dialect == Dialect::Haas
                && let Some(number) = block_number(self.line(k))
            {
                self.blocks.entry(number).or_insert(k);
            }
            if code.is_empty() {
                continue;
            }
            if let Some(call) = call(&code, dialect) {
                self.calls.insert(k, call);
            }
            if !is_plain(&code, dialect) {
                self.not_plain.push(k);
            }
            if is_return(&code, dialect) {
                self.returns.push(k);
            }
            if code == "%" {
                self.limits.push(k);
            }
            if code == "%" || code.starts_with("END PGM") {
                mark = Some(k);
            }
            if is_numbered && let Some(number) = program_begin(&code) {
                self.limits.push(k);
                if !self.numbers.is_empty() {
                    stop = stop.or(Some(k));
                }
                self.numbers.entry(number).or_insert(k);
            }
            if dialect == Dialect::Heidenhain
                && let Some(name) = label(&code)
            {
                self.labels_by_name.entry(name.to_owned()).or_default().push(self.labels.len());
                self.labels.push((k, name == "0"));
            }
            if dialect == Dialect::LinuxCnc {
                if let Some((name, begin)) = open.take_if(|(name, _)| is_sub_end(&code, name)) {
                    self.words.entry(name).or_insert(begin + 1..k);
                    if stop.is_none() {
                        from = k + 1;
                    }
                } else if let Some(name) = sub_begin(&code).filter(|_| open.is_none()) {
                    if stop.is_none() {
                        self.add_main(from..k);
                    }
                    open = Some((name.to_owned(), k));
                }
            }
            if is_program_end(&code, dialect) {
                self.first_end = self.first_end.or(Some(k));
                if open.is_none() {
                    stop = stop.or(Some(k + 1));
                }
            }
            if self.first.is_none() {
                self.first = Some((k, code.clone()));
            }
            self.last = Some((k, code));
        }
        match stop {
            Some(stop) => {
                self.add_main(from..stop);
                self.add_main(mark.filter(|mark| *mark >= stop).map_or(0..0, |mark| mark..mark + 1));
            }
            // A subprogram without an end goes to the end of the file.
            None if open.is_some() => {}
            None => self.add_main(from..self.lines.len()),
        }
    }

    fn add_main(&mut self, lines: Range<usize>) {
        if lines.start < lines.end {
            self.main.push(lines);
        }
    }

    pub(crate) fn line(&self, k: usize) -> &[u8] {
        &self.text[self.lines[k].clone()]
    }

    pub(crate) fn n_lines(&self) -> usize {
        self.lines.len()
    }

    pub(crate) fn call(&self, k: usize) -> Option<&Call> {
        self.calls.get(&k)
    }

    pub(crate) fn main(&self) -> &[Range<usize>] {
        &self.main
    }

    /// Returns the unit of a Heidenhain program, as its first line has it.
    pub(crate) fn unit(&self) -> Option<&str> {
        program_unit(&self.first.as_ref()?.1)
    }

    /// Returns whether every line of these does the same in place of a call.
    pub(crate) fn is_plain(&self, lines: &Range<usize>) -> bool {
        next(&self.not_plain, lines.start).is_none_or(|k| k >= lines.end)
    }

    /// Returns the lines between the begin of a subprogram and its end, if it is in this file.
    pub(crate) fn subprogram(&self, target: &Target) -> Option<Range<usize>> {
        match target {
            Target::Number(number) => self.until_return(self.numbers.get(number)? + 1),
            Target::Block(number) => self.until_return(*self.blocks.get(number)?),
            Target::Word(name) => self.words.get(name).cloned(),
            Target::Label(name) => {
                // A label that the main program passes is no subprogram.
                let main_end = self.first_end?;
                let own = self.labels_by_name.get(name)?;
                let at = *own.get(own.partition_point(|&at| self.labels[at].0 < main_end))?;
                let &(end, is_end) = self.labels.get(at + 1)?;
                is_end.then_some(self.labels[at].0 + 1..end)
            }
            Target::File(_) => None,
        }
    }

    /// Returns the lines up to the first return, if it is of the same program.
    fn until_return(&self, from: usize) -> Option<Range<usize>> {
        let end = next(&self.returns, from)?;
        next(&self.limits, from).is_none_or(|limit| limit > end).then_some(from..end)
    }

    /// Returns the lines of a subprogram that has this file for itself.
    pub(crate) fn whole(&self, target: &Target, dialect: Dialect) -> Option<Range<usize>> {
        let Target::File(name) = target else { return self.subprogram(target) };
        let (first, code) = self.first.as_ref()?;
        if dialect == Dialect::Heidenhain {
            let (end, end_code) = self.last.as_ref()?;
            let is_framed = code.starts_with("BEGIN PGM") && end_code.starts_with("END PGM");
            return is_framed.then_some(first + 1..*end);
        }
        // `PROC NAME` without parameters and attributes is optional.
        let begin = match code.strip_prefix("PROC") {
            Some(behind) if behind.trim_start() == name => first + 1,
            Some(_) => return None,
            None => *first,
        };
        Some(begin..next(&self.returns, begin)?)
    }
}

/// Returns the first of these sorted lines that is not before one.
fn next(lines: &[usize], from: usize) -> Option<usize> {
    lines.get(lines.partition_point(|&k| k < from)).copied()
}
