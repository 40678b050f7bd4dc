//! Codes of spindle, coolant and work offset.

use crate::dialect::file::DialectFile;
use crate::dialect::post_file::PostSettings;
use crate::program::spec::SpindleSpec;
use crate::program::write_error::WriteError;
use crate::program::{Coolant, WorkOffset};
use crate::words::number_text;

/// The word of a coolant.
pub(super) fn coolant_code(coolant: Coolant, rules: &DialectFile, place: &str) -> Result<String, WriteError> {
    let words = &rules.words.coolant;
    let (code, what) = match coolant {
        Coolant::Off => (Some(&words.off), "no coolant"),
        Coolant::Flood => (words.flood.as_ref(), "flood coolant"),
        Coolant::Mist => (words.mist.as_ref(), "mist coolant"),
    };
    let (what, name) = (what.to_owned(), rules.name.clone());
    code.cloned().ok_or_else(|| WriteError::NotInDialect { place: place.to_owned(), what, name })
}

/// The word of a work offset, and the lines that select it.
pub(super) fn work_offset(
    offset: WorkOffset,
    rules: &DialectFile,
    place: &str,
) -> Result<(String, Vec<String>), WriteError> {
    let (what, name) = (format!("work offset {}", offset.number()), rules.name.clone());
    let words = rules.work_offset_words(offset);
    words.ok_or_else(|| WriteError::NotInDialect { place: place.to_owned(), what, name })
}

/// Whole revolutions per minute; controls take no decimals there.
pub fn spindle_speed(rpm: f64, place: &str) -> Result<i64, WriteError> {
    let speed = number_text::units(rpm, 0).filter(|speed| *speed > 0);
    speed.ok_or_else(|| WriteError::Number { place: place.to_owned(), what: "a spindle speed", value: rpm })
}

/// The M word of a spindle.
pub(crate) fn spindle_code(spindle: &SpindleSpec, settings: &PostSettings) -> String {
    let words = &settings.rules.words;
    if spindle.clockwise { words.clockwise.clone() } else { words.counter_clockwise.clone() }
}
