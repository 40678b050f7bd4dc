//! From a line to addresses, names and their values; columns stay those of the line.

use std::ops::Range;

use crate::read::error::{ReadError, ReadFault};
use crate::read::siemens::names;
use crate::read::source::Source;
use crate::read::values::expression::{Syntax, is_name_byte};
use crate::read::values::variables::Variables;
use crate::read::values::{expression, number};
use crate::words::axis_words::AxisLetter;

/// A word of a block: `X10`, `X1=AC(5)`, `TRAORI`, `CYCLE832(…)`, `R1=R2+5`.
#[derive(Clone, Debug)]
pub(super) struct Item {
    /// Bytes of the line that are its name, without a value.
    pub(super) name: Range<usize>,
    /// The letter of an address, 0 for a longer name.
    pub(super) letter: u8,
    /// The 1 of `X1=`, 0 where there is none.
    pub(super) index: u8,
    pub(super) value: Value,
    /// Bytes of the whole item.
    pub(super) span: Range<usize>,
    /// Where the number or expression begins.
    pub(super) value_start: usize,
    pub(super) is_used: bool,
}

/// Text behind a name.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Nothing.
    None,
    /// A number or expression, `None` where it is not known, and how it counts.
    Number(Option<f64>, Count),
    /// `="text"`: the bytes between the marks.
    Text(Range<usize>),
    /// `(…)`: the bytes between the parentheses.
    Arguments(Range<usize>),
}

/// How an axis value counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    /// As G90 or G91 says.
    Modal,
    /// AC.
    Absolute,
    /// IC.
    Incremental,
    /// DC, ACP, ACN: an absolute angle, over the shortest way, in positive or negative sense.
    Shortest,
    Positive,
    Negative,
}

impl Item {
    /// The value where it is a number that is known.
    pub(super) fn number(&self) -> Option<f64> {
        if let Value::Number(value, _) = self.value { value } else { None }
    }

    /// Whether it is a number or expression, known or not.
    pub(super) fn is_number(&self) -> bool {
        matches!(self.value, Value::Number(..))
    }
}

/// A line that is being taken apart: upper case, without its comment.
pub(super) struct SiemensCode<'a> {
    pub(super) text: &'a [u8],
    pub(super) source: &'a Source,
    pub(super) variables: &'a Variables,
}

impl SiemensCode<'_> {
    /// All items from byte `at` on.
    pub(super) fn items(&self, mut at: usize, items: &mut Vec<Item>) -> Result<(), ReadError> {
        loop {
            at = self.skip_blanks(at);
            if at >= self.text.len() {
                return Ok(());
            }
            let item = self.item(at)?;
            at = item.span.end;
            items.push(item);
        }
    }

    fn item(&self, start: usize) -> Result<Item, ReadError> {
        let byte = self.text[start];
        if !(byte.is_ascii_alphabetic() || matches!(byte, b'_' | b'$')) {
            return Err(self.source.error(start, ReadFault::Character(char::from(byte))));
        }
        let next = self.byte(start + 1);
        if byte.is_ascii_alphabetic() && !next.is_some_and(|b| b.is_ascii_alphabetic() || matches!(b, b'_' | b'$')) {
            return self.address(start);
        }
        self.named(start)
    }

    /// `X10`, `X 10`, `X=…`, `X1=…`, `R[5]=…`.
    fn address(&self, start: usize) -> Result<Item, ReadError> {
        let letter = self.text[start];
        let digits = self.text[start + 1..].iter().take_while(|b| b.is_ascii_digit()).count();
        let behind = self.skip_blanks(start + 1 + digits);
        if self.byte(behind) == Some(b'=') && self.byte(behind + 1) != Some(b'=') {
            let name = start..start + 1 + digits;
            let index = match &self.text[start + 1..name.end] {
                [] => 0,
                [digit] => digit - b'0',
                // More digits are R parameters alone.
                _ => u8::MAX,
            };
            return self.with_value(name, letter, index, behind + 1);
        }
        if self.byte(behind) == Some(b'[') && digits == 0 {
            return self.named(start);
        }
        let value_start = self.skip_blanks(start + 1);
        let end = value_start + self.number_length(value_start);
        let text = &self.text[value_start..end];
        let number = number::parse(text).ok_or_else(|| self.no_number(start, end))?;
        // Arguments of a function of the machine's builder (`M202(0.0024)`).
        let open = self.skip_blanks(end);
        let end = match self.byte(open) {
            Some(b'(') if letter == b'M' => self.closing(open, b')')? + 1,
            _ => end,
        };
        Ok(Item {
            name: start..start + 1,
            letter,
            index: 0,
            value: Value::Number(Some(number), Count::Modal),
            span: start..end,
            value_start,
            is_used: false,
        })
    }

    fn no_number(&self, start: usize, end: usize) -> ReadError {
        let name_end = start + self.name_length(start);
        let text = self.string(start..end.max(name_end).max(start + 1));
        let is_name = end <= start + 1;
        self.source.error(start, if is_name { ReadFault::UnknownWord(text) } else { ReadFault::Number(text) })
    }

    /// Sign, digits, point.
    fn number_length(&self, at: usize) -> usize {
        let rest = &self.text[at.min(self.text.len())..];
        let sign = usize::from(matches!(rest.first(), Some(b'+' | b'-')));
        sign + rest[sign..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count()
    }

    /// A name with the text behind it.
    fn named(&self, start: usize) -> Result<Item, ReadError> {
        let mut end = start + self.name_length(start);
        let mut behind = self.skip_blanks(end);
        if self.byte(behind) == Some(b'[') {
            end = self.closing(behind, b']')? + 1;
            behind = self.skip_blanks(end);
        }
        let name = start..end;
        match self.byte(behind) {
            Some(b'=') => self.with_value(name, 0, 0, behind + 1),
            Some(b'(') => {
                let close = self.closing(behind, b')')?;
                let value = Value::Arguments(behind + 1..close);
                Ok(Item {
                    name,
                    letter: 0,
                    index: 0,
                    value,
                    span: start..close + 1,
                    value_start: behind,
                    is_used: false,
                })
            }
            _ => Ok(Item {
                name,
                letter: 0,
                index: 0,
                value: Value::None,
                span: start..end,
                value_start: end,
                is_used: false,
            }),
        }
    }

    fn with_value(&self, name: Range<usize>, letter: u8, index: u8, at: usize) -> Result<Item, ReadError> {
        let start = self.skip_blanks(at);
        let item = |value, end| Item {
            span: name.start..end,
            name: name.clone(),
            letter,
            index,
            value,
            value_start: start,
            is_used: false,
        };
        if self.byte(start) == Some(b'"') {
            let end = self.text_end(start)?;
            return Ok(item(Value::Text(start + 1..end), end + 1));
        }
        let counts = [
            (&b"ACP"[..], Count::Positive),
            (b"ACN", Count::Negative),
            (b"AC", Count::Absolute),
            (b"IC", Count::Incremental),
            (b"DC", Count::Shortest),
        ];
        for (word, count) in counts {
            let open = self.skip_blanks(start + word.len());
            if self.text[start.min(self.text.len())..].starts_with(word) && self.byte(open) == Some(b'(') {
                let parsed = self.expression(name.start, open + 1)?;
                let close = self.skip_blanks(parsed.end);
                if self.byte(close) != Some(b')') {
                    return Err(self.no_expression(name.start, close));
                }
                return Ok(item(Value::Number(parsed.value, count), close + 1));
            }
        }
        match self.expression(name.start, start) {
            Ok(parsed) => Ok(item(Value::Number(parsed.value, Count::Modal), parsed.end)),
            // A list of values (`MEASA[X]=(1,1,-1)`).
            Err(error) if letter == 0 && self.byte(start) == Some(b'(') => {
                let close = self.closing(start, b')').map_err(|_| error)?;
                Ok(item(Value::Arguments(start + 1..close), close + 1))
            }
            Err(error) => Err(error),
        }
    }

    fn expression(&self, start: usize, at: usize) -> Result<expression::Parsed, ReadError> {
        expression::parse(self.text, at, Syntax::Parentheses, self.variables)
            .map_err(|at| self.no_expression(start, at))
    }

    fn no_expression(&self, start: usize, at: usize) -> ReadError {
        let text = self.string(start..self.text.len()).trim_end().to_owned();
        self.source.error(at.min(self.text.len().saturating_sub(1)), ReadFault::Expression(text))
    }

    /// Byte of the mark that closes the one at `open`.
    pub(super) fn closing(&self, open: usize, close: u8) -> Result<usize, ReadError> {
        let (mut depth, mut at) = (0_usize, open);
        while let Some(byte) = self.byte(at) {
            match byte {
                b'"' => at = self.text_end(at)?,
                b'(' | b'[' => depth += 1,
                b')' | b']' => {
                    depth -= 1;
                    if depth == 0 {
                        return if byte == close { Ok(at) } else { Err(self.no_expression(open, at)) };
                    }
                }
                _ => {}
            }
            at += 1;
        }
        Err(self.no_expression(open, open))
    }

    /// Byte of the mark that ends the text that begins at `start`.
    fn text_end(&self, start: usize) -> Result<usize, ReadError> {
        let length = self.text[start + 1..].iter().position(|b| *b == b'"');
        length.map(|n| start + 1 + n).ok_or_else(|| self.no_expression(start, start))
    }

    pub(super) fn name_length(&self, start: usize) -> usize {
        self.text[start.min(self.text.len())..].iter().take_while(|b| is_name_byte(**b)).count()
    }

    pub(super) fn byte(&self, at: usize) -> Option<u8> {
        self.text.get(at).copied()
    }

    pub(super) fn skip_blanks(&self, mut at: usize) -> usize {
        while self.byte(at).is_some_and(|b| b.is_ascii_whitespace()) {
            at += 1;
        }
        at
    }

    pub(super) fn string(&self, bytes: Range<usize>) -> String {
        String::from_utf8_lossy(&self.text[bytes]).into_owned()
    }
}

/// A component of a vector: `A3` to `C5`.
pub(super) fn is_vector(item: &Item) -> bool {
    matches!(item.letter, b'A' | b'B' | b'C') && matches!(item.index, 3..=5)
}

/// Whether an item sets a variable: an R parameter, a system variable, or a name that is none of
/// the control's.
pub(super) fn is_assignment(item: &Item, code: &[u8]) -> bool {
    if item.letter > 0 && item.letter != b'R' {
        return false;
    }
    let name = &code[item.name.clone()];
    let has_value = !matches!(item.value, super::items::Value::None | super::items::Value::Arguments(_));
    let is_r = name.first() == Some(&b'R') && name[1..].iter().all(u8::is_ascii_digit) && name.len() > 1;
    let is_field = name.starts_with(b"R[");
    let text = str::from_utf8(name).unwrap_or_default();
    // Names begin with two letters, so that no address is one.
    let is_long = name.get(1).is_some_and(|b| b.is_ascii_alphabetic() || matches!(b, b'_' | b'$')) || name[0] == b'$';
    let is_of_control = names::meaning(text).is_some() || names::is_not_followed(text);
    let is_word = item.letter == 0 && is_long && !is_of_control && text.parse::<AxisLetter>().is_err();
    has_value && name.len() > 1 && (is_r && item.value_start > item.name.end || is_field || is_word)
}
