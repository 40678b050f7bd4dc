//! Statements of a program, in order.

use crate::fault::{SiemensFault, SiemensReadError};
use crate::statement::{Statement, statement};

/// Statements of a text, one by one.
pub(crate) struct Statements {
    pub(crate) channel: usize,
    all: Vec<(u32, Statement)>,
    next: usize,
    last_line: u32,
}

impl Statements {
    pub(crate) fn new(channel: usize, text: &str) -> Result<Self, SiemensReadError> {
        let (mut all, mut last_line) = (Vec::new(), 1);
        for (k, line) in text.lines().enumerate() {
            last_line = u32::try_from(k + 1).unwrap_or(u32::MAX);
            if line.starts_with(';') {
                continue;
            }
            let error = |fault| SiemensReadError { channel, line: last_line, fault };
            let code = without_number(line).ok_or_else(|| error(SiemensFault::NotUnderstood(line.to_owned())))?;
            all.push((last_line, statement(code).map_err(error)?));
        }
        Ok(Self { channel, all, next: 0, last_line })
    }

    pub(crate) fn line(&self) -> u32 {
        self.all.get(self.next).map_or(self.last_line, |(line, _)| *line)
    }

    pub(crate) fn error(&self, fault: SiemensFault) -> SiemensReadError {
        SiemensReadError { channel: self.channel, line: self.line(), fault }
    }

    pub(crate) fn is_over(&self) -> bool {
        self.next == self.all.len()
    }

    /// Takes the next statement if `pick` accepts it.
    pub(crate) fn take<T>(&mut self, pick: impl Fn(&Statement) -> Option<T>) -> Option<(u32, T)> {
        let (line, statement) = self.all.get(self.next)?;
        let found = (*line, pick(statement)?);
        self.next += 1;
        Some(found)
    }

    pub(crate) fn expect<T>(
        &mut self,
        expected: &'static str,
        pick: impl Fn(&Statement) -> Option<T>,
    ) -> Result<(u32, T), SiemensReadError> {
        let fault = if self.is_over() { SiemensFault::Ends { expected } } else { SiemensFault::NotHere { expected } };
        let error = self.error(fault);
        self.take(pick).ok_or(error)
    }

    pub(crate) fn expect_one(&mut self, expected: &'static str, wanted: &Statement) -> Result<(), SiemensReadError> {
        self.expect(expected, |s| (s == wanted).then_some(())).map(|_| ())
    }
}

/// Returns a line without its block number, such as `N12 `.
fn without_number(line: &str) -> Option<&str> {
    let Some(rest) = line.strip_prefix('N') else { return Some(line) };
    let (number, code) = rest.split_once(' ')?;
    (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then_some(code)
}
