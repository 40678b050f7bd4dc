//! From a block of motion to its words; columns stay those of the line.

use std::ops::Range;

use crate::read::error::{ReadError, ReadFault};
use crate::read::source::Source;
use crate::read::values::expression::{Syntax, is_name_byte};
use crate::read::values::variables::Variables;
use crate::read::values::{expression, number};
use crate::words::axis_words::AxisLetter;

/// Meaning of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Axis(AxisLetter),
    /// `IX+5`.
    Incremental(AxisLetter),
    /// NX, NY, NZ.
    Normal(usize),
    /// TX, TY, TZ.
    ToolVector(usize),
    /// PR, PA, IPR, IPA.
    PolarRadius,
    PolarAngle,
    PolarRadiusBy,
    PolarAngleBy,
    /// DR+, DR-.
    Direction {
        clockwise: bool,
    },
    /// R0.
    NoCompensation,
    /// RL, RR, and R+ or R- of one axis.
    Compensation,
    /// FZ, FU, FT: a feed per tooth or turn, or a time.
    OtherFeed,
    /// `R+10` of CR.
    Radius,
    Feed,
    FeedMax,
    FeedAuto,
    Speed,
    Function,
    /// Of an M function: MB, LA, and F behind M128.
    Parameter,
}

/// A word and its value.
#[derive(Clone, Debug)]
pub(super) struct HeidenhainWord {
    pub(super) key: Key,
    /// `None` where it has none, or where it is not known.
    pub(super) value: Option<f64>,
    pub(super) span: Range<usize>,
    pub(super) value_start: usize,
}

/// A line that is being taken apart: upper case, without its comment.
pub(super) struct HeidenhainCode<'a> {
    pub(super) text: &'a [u8],
    pub(super) source: &'a Source,
    pub(super) variables: &'a Variables,
}

/// Names of words, the longer ones first, with what they are; axes and M functions are not among
/// them.
const NAMES: [(&[u8], Key); 16] = [
    (b"IPA", Key::PolarAngleBy),
    (b"IPR", Key::PolarRadiusBy),
    (b"PA", Key::PolarAngle),
    (b"PR", Key::PolarRadius),
    (b"NX", Key::Normal(0)),
    (b"NY", Key::Normal(1)),
    (b"NZ", Key::Normal(2)),
    (b"TX", Key::ToolVector(0)),
    (b"TY", Key::ToolVector(1)),
    (b"TZ", Key::ToolVector(2)),
    (b"MB", Key::Parameter),
    (b"LA", Key::Parameter),
    (b"M", Key::Function),
    (b"S", Key::Speed),
    (b"F", Key::Feed),
    (b"R", Key::Radius),
];

impl HeidenhainCode<'_> {
    /// All words from byte `at` on.
    pub(super) fn words(&self, mut at: usize) -> Result<Vec<HeidenhainWord>, ReadError> {
        let mut words: Vec<HeidenhainWord> = Vec::new();
        loop {
            at = self.skip_blanks(at);
            if at >= self.text.len() {
                return Ok(words);
            }
            let function = words.iter().rev().find(|w| w.key != Key::Parameter);
            let function = function.filter(|w| w.key == Key::Function).and_then(|w| w.value);
            let axis = self.byte(at).and_then(|b| AxisLetter::new(char::from(b), 0));
            let word = match function {
                // Of these functions the axes that follow are arguments, with or without a number.
                Some(94.0 | 118.0 | 138.0) if axis.is_some() => self.argument(at),
                Some(112.0 | 124.0) if matches!(self.byte(at), Some(b'T' | b'A' | b'E')) => self.argument(at),
                Some(103.0 | 128.0 | 140.0) => {
                    let word = self.word(at)?;
                    let is_feed = matches!(word.key, Key::Feed | Key::FeedMax);
                    HeidenhainWord { key: if is_feed { Key::Parameter } else { word.key }, ..word }
                }
                _ => self.word(at)?,
            };
            at = word.span.end;
            words.push(word);
        }
    }

    /// An axis behind an M function.
    fn argument(&self, start: usize) -> HeidenhainWord {
        let plain = HeidenhainWord { key: Key::Parameter, value: None, span: start..start + 1, value_start: start + 1 };
        self.plain_number(Key::Parameter, start, self.skip_blanks(start + 1)).unwrap_or(plain)
    }

    fn word(&self, start: usize) -> Result<HeidenhainWord, ReadError> {
        let rest = &self.text[start..];
        let plain =
            |key, length| HeidenhainWord { key, value: None, span: start..start + length, value_start: start + length };
        if let Some(word) = self.fixed(start) {
            return Ok(word);
        }
        let has_sign = rest.starts_with(b"R+") || rest.starts_with(b"R-");
        let is_number = rest.get(2).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'.' | b'Q'));
        if rest.starts_with(b"RL") || rest.starts_with(b"RR") || has_sign && !is_number {
            return Ok(plain(Key::Compensation, 2));
        }
        if [&b"FZ"[..], b"FU", b"FT"].iter().any(|name| rest.starts_with(name)) {
            return self.valued(Key::OtherFeed, start, 2);
        }
        if let Some((name, key)) = NAMES.iter().find(|(name, _)| rest.starts_with(name)) {
            // `MB MAX`.
            let value = self.skip_blanks(start + name.len());
            if *key == Key::Parameter && self.text[value.min(self.text.len())..].starts_with(b"MAX") {
                return Ok(plain(*key, value + 3 - start));
            }
            return self.valued(*key, start, name.len());
        }
        let letter = |at: usize| self.byte(at).and_then(|b| AxisLetter::new(char::from(b), 0));
        match (self.byte(start), letter(start)) {
            (_, Some(axis)) => self.valued(Key::Axis(axis), start, 1),
            (Some(b'I'), None) => match letter(start + 1) {
                Some(axis) => self.valued(Key::Incremental(axis), start, 2),
                None => Err(self.unknown(start)),
            },
            _ => Err(self.unknown(start)),
        }
    }

    /// Words without a value: FMAX, FAUTO, DR+, R0.
    fn fixed(&self, start: usize) -> Option<HeidenhainWord> {
        let rest = &self.text[start..];
        let word = |key, length: usize, value_start: usize| HeidenhainWord {
            key,
            value: None,
            span: start..start + length,
            value_start: start + value_start,
        };
        if rest.first() == Some(&b'F') {
            let value = self.skip_blanks(start + 1);
            let text = &self.text[value.min(self.text.len())..];
            for (name, key) in [(&b"MAX"[..], Key::FeedMax), (b"AUTO", Key::FeedAuto)] {
                if text.starts_with(name) {
                    return Some(word(key, value + name.len() - start, value - start));
                }
            }
        }
        if rest.starts_with(b"DR") {
            let sign = self.skip_blanks(start + 2);
            let clockwise = match self.byte(sign)? {
                b'-' => true,
                b'+' => false,
                _ => return None,
            };
            return Some(word(Key::Direction { clockwise }, sign + 1 - start, 2));
        }
        let is_off = rest.starts_with(b"R0") && !matches!(rest.get(2), Some(b'0'..=b'9' | b'.'));
        is_off.then(|| word(Key::NoCompensation, 2, 1))
    }

    fn valued(&self, key: Key, start: usize, length: usize) -> Result<HeidenhainWord, ReadError> {
        let value_start = self.skip_blanks(start + length);
        if let Some(word) = self.plain_number(key, start, value_start) {
            return Ok(word);
        }
        let is_value = self.byte(value_start).is_some_and(|b| matches!(b, b'+' | b'-' | b'.' | b'Q' | b'0'..=b'9'));
        let parsed = expression::parse_value(self.text, value_start, Syntax::Parentheses, self.variables);
        match parsed.ok().filter(|_| is_value) {
            Some(parsed) => Ok(HeidenhainWord { key, value: parsed.value, span: start..parsed.end, value_start }),
            None if self.byte(value_start).is_none_or(|b| !b.is_ascii_alphabetic()) => {
                let end = value_start
                    + self.text[value_start.min(self.text.len())..].iter().take_while(|b| **b > b' ').count();
                let text = self.string(start..end.max(start + length));
                Err(self.source.error(start, ReadFault::Number(text)))
            }
            None => Err(self.unknown(start)),
        }
    }

    /// A word whose value is a number: most words of a program, faster than as an expression.
    fn plain_number(&self, key: Key, start: usize, value_start: usize) -> Option<HeidenhainWord> {
        let rest = self.text.get(value_start..)?;
        let sign = usize::from(matches!(rest.first(), Some(b'+' | b'-')));
        let length = sign + rest[sign..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
        let value = number::parse(&rest[..length])?;
        Some(HeidenhainWord { key, value: Some(value), span: start..value_start + length, value_start })
    }

    /// The word at a byte is none of the control's.
    pub(super) fn unknown(&self, start: usize) -> ReadError {
        let length = self.text[start..].iter().take_while(|b| is_name_byte(**b)).count();
        let fault = match length {
            0 => ReadFault::Character(char::from(self.text[start])),
            _ => ReadFault::UnknownWord(self.string(start..start + length)),
        };
        self.source.error(start, fault)
    }

    pub(super) fn unsupported(&self, span: Range<usize>, why: &'static str) -> ReadError {
        let word = self.string(span.clone());
        self.source.error(span.start, ReadFault::Unsupported { word, why })
    }

    pub(super) fn stray(&self, word: &HeidenhainWord) -> ReadError {
        self.source.error(word.span.start, ReadFault::StrayWord(self.string(word.span.clone())))
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

    /// The letters that begin at a byte, and the byte behind them and their blanks.
    pub(super) fn name(&self, at: usize) -> (&[u8], usize) {
        let rest = &self.text[at.min(self.text.len())..];
        let length = rest.iter().take_while(|b| b.is_ascii_alphabetic()).count();
        (&rest[..length], self.skip_blanks(at + length))
    }

    pub(super) fn string(&self, bytes: Range<usize>) -> String {
        String::from_utf8_lossy(&self.text[bytes]).into_owned()
    }
}
