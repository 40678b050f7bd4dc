//! Words of statements: their treatment, and cycles.

use std::collections::BTreeMap;

use facemill_cl_file::{AptMeaning, AptStatement, free_text, major_word};

use crate::report::{PostedWord, Treatment};

/// A cycle whose places are not worked on.
#[derive(Clone, Debug)]
pub(crate) struct Cycle {
    /// Line of its statement.
    pub(crate) line: u32,
    /// Height above a place at which the tool goes from one to the next, mm.
    pub(crate) lift: f64,
    /// Its text.
    pub(crate) text: String,
    /// Places so far.
    pub(crate) places: usize,
}

/// Words of a cycle whose number is a height above the place.
const HEIGHTS: [&str; 4] = ["RAPTO", "RTRCTO", "RETURN", "CLEAR"];

impl Cycle {
    /// Returns the cycle of a statement; `unit` is mm per unit of the file.
    pub(crate) fn new(statement: &AptStatement, unit: f64) -> Self {
        let values: Vec<&str> = free_text(&statement.text).split(',').map(str::trim).collect();
        let height = |pair: &[&str]| {
            let is_height = HEIGHTS.iter().any(|word| pair[0].eq_ignore_ascii_case(word));
            pair[1].parse::<f64>().ok().filter(|v| is_height && v.is_finite())
        };
        let lift = values.windows(2).filter_map(height).fold(0.0, f64::max) * unit;
        Self { line: statement.line, lift, text: statement.text.to_string(), places: 0 }
    }
}

/// Returns whether the text of a statement is for the operator.
pub(crate) fn is_text(word: &str) -> bool {
    ["PPRINT", "INSERT", "TPRINT"].contains(&word)
}

/// Returns whether a statement names an operation, as NX does.
pub(crate) fn is_operation(word: &str, text: &str) -> bool {
    word == "TOOLPATH" || word == "TOOL" && text.to_ascii_uppercase().starts_with("PATH/")
}

/// Returns the treatment of a statement.
pub(crate) fn treatment(statement: &AptStatement, word: &str) -> Treatment {
    match &statement.meaning {
        AptMeaning::PartName(_)
        | AptMeaning::Tool { .. }
        | AptMeaning::Spindle { .. }
        | AptMeaning::SpindleOff
        | AptMeaning::SpindleOn
        | AptMeaning::Coolant(_)
        | AptMeaning::Dwell(Some(_))
        | AptMeaning::Stop { optional: false }
        | AptMeaning::Feed(_)
        | AptMeaning::FeedPerRevolution(_)
        | AptMeaning::Rapid
        | AptMeaning::Circle
        | AptMeaning::End
        | AptMeaning::Point(_) => Treatment::Written,
        AptMeaning::Comment if is_text(word) => Treatment::AsComment,
        AptMeaning::Auxiliary if is_operation(word, free_text(&statement.text)) => Treatment::AsComment,
        AptMeaning::Unit(_)
        | AptMeaning::Cutter(_)
        | AptMeaning::MultiAxis(_)
        | AptMeaning::ToolAxis
        | AptMeaning::Frame(Some(_)) => Treatment::Applied,
        AptMeaning::Cycle(_)
        | AptMeaning::RadiusCompensation(true)
        | AptMeaning::Dwell(None)
        | AptMeaning::Stop { optional: true } => Treatment::NotWritten,
        AptMeaning::Unknown if word == "MSYS" => Treatment::Applied,
        AptMeaning::Unknown if is_harmless(word) => Treatment::NoEffect,
        AptMeaning::Unknown => Treatment::Unknown,
        _ => Treatment::NoEffect,
    }
}

/// Counts the words of a file.
#[derive(Debug, Default)]
pub(crate) struct WordCounts {
    pub(crate) words: Vec<PostedWord>,
    /// Place of every word in the list.
    index: BTreeMap<String, usize>,
}

impl WordCounts {
    /// Counts a statement. A word with several treatments has the one that loses most.
    /// Creo's cutter is a word of its own among its comments.
    pub(crate) fn count(&mut self, statement: &AptStatement) {
        let mut word = major_word(&statement.text);
        if word == "$$" && matches!(statement.meaning, AptMeaning::Cutter(_)) {
            word = "$$-> CUTTER".to_owned();
        }
        let treatment = treatment(statement, &word);
        match self.index.get(&word) {
            Some(&k) => {
                let known = &mut self.words[k];
                known.count += 1;
                known.treatment = known.treatment.max(treatment);
            }
            None => {
                self.index.insert(word.clone(), self.words.len());
                self.words.push(PostedWord { word, first_line: statement.line, count: 1, treatment });
            }
        }
    }
}

/// Words that are not evaluated and say nothing of the motion: they are for printing, for the
/// tolerances of another post-processor, and for the tape of the control (REWIND).
const HARMLESS: [&str; 13] = [
    "CATPROCESS",
    "CLPRNT",
    "DISPLY",
    "DRAFT",
    "LINTOL",
    "MCHTOL",
    "NOPOST",
    "PLOT",
    "PRINT",
    "REWIND",
    "SEQNO",
    "TITLES",
    "VERIFY",
];

/// Returns whether a program may lack a word that is not understood.
pub(crate) fn is_harmless(word: &str) -> bool {
    HARMLESS.contains(&word)
}
