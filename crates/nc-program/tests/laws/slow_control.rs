//! A slow control for the tests: it takes the lines of a program apart at blanks and remembers
//! words as controls do. It shares nothing with the writers and the readers.

use std::collections::BTreeMap;

/// Look of a dialect's text, written again and independently of its file.
#[derive(Clone, Copy)]
pub(crate) struct Look {
    pub(crate) rapid: &'static str,
    pub(crate) cut: &'static str,
    /// Words that mark a rapid although the motion word is the same.
    pub(crate) rapid_mark: Option<&'static str>,
    /// `;` or `(`.
    pub(crate) comment: char,
    pub(crate) plus: bool,
    pub(crate) point: bool,
    /// Every line has a number without a letter.
    pub(crate) all_numbered: bool,
    /// Whole numbers may have zeros behind a point.
    pub(crate) any_point: bool,
}

/// Where a control is behind a block.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct State {
    pub(crate) is_rapid: bool,
    /// By axis name, in units of the text (mm, deg).
    pub(crate) words: BTreeMap<String, f64>,
    pub(crate) feed: Option<f64>,
    /// Feed in this very block.
    pub(crate) own_feed: Option<f64>,
}

/// Name and text of the number of a word such as `X-1.5`, `X2=4.`, `A3=0.1`, `NX+0.5`.
pub(crate) fn split_word(word: &str) -> Option<(String, String)> {
    if let Some((name, number)) = word.split_once('=') {
        return Some((name.to_owned(), number.to_owned()));
    }
    let at = word.find(|c: char| !c.is_ascii_alphabetic())?;
    let (name, number) = word.split_at(at);
    number.chars().all(|c| c.is_ascii_digit() || "+-.".contains(c)).then(|| (name.to_owned(), number.to_owned()))
}

/// The words of a line without its number and comment.
pub(crate) fn code(line: &str, look: &Look) -> Vec<String> {
    let line = line.split(look.comment).next().unwrap();
    let mut words: Vec<String> = line.split(' ').filter(|w| !w.is_empty()).map(str::to_owned).collect();
    let is_number = |w: &str| !w.is_empty() && w.bytes().all(|b| b.is_ascii_digit());
    if let Some(first) = words.first() {
        let digits = if look.all_numbered { Some(first.as_str()) } else { first.strip_prefix('N') };
        if digits.is_some_and(is_number) {
            words.remove(0);
        }
    }
    words
}

impl State {
    /// Executes a motion block and checks how its numbers are written.
    pub(crate) fn run(&mut self, line: &str, look: &Look, axes: &[&str]) {
        let words = code(line, look);
        for word in &words {
            if word == look.rapid && look.rapid_mark.is_none() {
                self.is_rapid = true;
            } else if word == look.cut {
                self.is_rapid = false;
            }
        }
        if let Some(mark) = look.rapid_mark {
            // Klartext: every motion says what it is, that it has no radius compensation, and
            // whether it is a rapid.
            assert!(words[0] == look.cut && words.iter().any(|w| w == "R0"), "{line}");
            self.is_rapid = words.iter().any(|w| w == mark);
        }
        self.own_feed = None;
        for word in &words {
            let Some((name, number)) = split_word(word) else { continue };
            let is_axis = axes.contains(&name.as_str());
            if !is_axis && name != "F" {
                continue;
            }
            check_number(&number, look, is_axis, line);
            let value: f64 = number.parse().unwrap_or_else(|_| panic!("{word} in {line}"));
            if is_axis {
                self.words.insert(name, value);
            } else {
                self.feed = Some(value);
                self.own_feed = Some(value);
            }
        }
    }
}

fn check_number(number: &str, look: &Look, is_signed: bool, line: &str) {
    let has_sign = number.starts_with(['+', '-']);
    assert!(!look.plus || !is_signed || has_sign, "{number} has no sign in {line}");
    assert!(look.plus || !number.starts_with('+'), "{number} in {line}");
    assert!(!look.point || number.contains('.'), "{number} has no point in {line}");
    assert!(look.point || !number.ends_with('.'), "{number} in {line}");
    assert!(look.any_point || !number.contains('.') || !number.ends_with('0'), "{number} in {line}");
    let value: f64 = number.parse().unwrap();
    assert!(!(value == 0.0 && number.starts_with('-')), "negative zero in {line}");
}
