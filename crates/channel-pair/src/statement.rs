//! Lines of a channel program, each of which says one thing.

use crate::fault::SiemensFault;
use facemill_nc_program::words::number_text;
use facemill_nc_program::{AxisLetter, AxisWords};

/// Metric, XY plane, no radius compensation, absolute, feed per minute.
pub(crate) const SAFE_START: &str = "G710 G17 G40 G90 G94";

/// Reference radius of a rotary axis at which 1 deg counts as 1 mm: 180/π mm, the default of
/// controls.
pub(crate) const FGREF: &str = "57.29578";

/// Jump target if the tool has another length; an alarm stops the control there.
pub(crate) const LABEL: &str = "WRONG_TOOL:";

pub(crate) const ALARM: &str = "SETAL(65000)";

/// Largest accepted difference of tool lengths, mm.
pub(crate) const CHECK_TOLERANCE: &str = "0.01";

/// Statement of a line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Statement {
    SafeStart,
    /// FGROUP.
    PathAxes(Vec<AxisLetter>),
    /// FGREF of these axes.
    Radii(Vec<AxisLetter>),
    /// G75 FP=1.
    Home(Vec<AxisLetter>),
    /// WAITM.
    Mark(u32),
    ToolChange,
    Edge,
    /// Length of the tool, mm.
    Check(f64),
    WorkOffset,
    SpindleOn,
    SpindleOff,
    Coolant,
    CoolantOff,
    InverseTime,
    PerMinute,
    Rapid(AxisWords),
    Cut {
        words: AxisWords,
        feed: f64,
    },
    /// s.
    Dwell(f64),
    End,
    Label,
    Alarm,
    Stop,
}

/// Returns the statement of a line without its block number.
pub(crate) fn statement(code: &str) -> Result<Statement, SiemensFault> {
    match code {
        SAFE_START => return Ok(Statement::SafeStart),
        "D1" => return Ok(Statement::Edge),
        "M5" => return Ok(Statement::SpindleOff),
        "M7" | "M8" => return Ok(Statement::Coolant),
        "M9" => return Ok(Statement::CoolantOff),
        "G93" => return Ok(Statement::InverseTime),
        "G94" => return Ok(Statement::PerMinute),
        "M30" => return Ok(Statement::End),
        "M0" => return Ok(Statement::Stop),
        LABEL => return Ok(Statement::Label),
        ALARM => return Ok(Statement::Alarm),
        _ => {}
    }
    let found = mark(code)
        .or_else(|| path_axes(code))
        .or_else(|| radii(code))
        .or_else(|| home(code))
        .or_else(|| tool(code))
        .or_else(|| moves(code));
    found.ok_or_else(|| SiemensFault::NotUnderstood(code.to_owned()))
}

fn mark(code: &str) -> Option<Statement> {
    let number = code.strip_prefix("WAITM(")?.strip_suffix(",1,2)")?;
    Some(Statement::Mark(whole(number)?))
}

fn path_axes(code: &str) -> Option<Statement> {
    let names = code.strip_prefix("FGROUP(")?.strip_suffix(')')?;
    Some(Statement::PathAxes(names.split(',').map(|name| name.parse().ok()).collect::<Option<_>>()?))
}

fn radii(code: &str) -> Option<Statement> {
    let axis = |word: &str| word.strip_prefix("FGREF[")?.strip_suffix(FGREF)?.strip_suffix("]=")?.parse().ok();
    Some(Statement::Radii(code.split(' ').map(axis).collect::<Option<_>>()?))
}

fn home(code: &str) -> Option<Statement> {
    let words = code.strip_prefix("G75 FP=1 ")?;
    let axis = |word: &str| word.strip_suffix("=0")?.parse().ok();
    Some(Statement::Home(words.split(' ').map(axis).collect::<Option<_>>()?))
}

fn tool(code: &str) -> Option<Statement> {
    if let Some(number) = code.strip_prefix('T') {
        return whole(number.strip_suffix(" M6")?).map(|_| Statement::ToolChange);
    }
    if let Some(check) = code.strip_prefix("IF ABS($P_TOOLL[1]-") {
        let label = LABEL.trim_end_matches(':');
        let length = check.strip_suffix(label)?.strip_suffix(" GOTOF ")?.strip_suffix(CHECK_TOLERANCE)?;
        return number(length.strip_suffix(")>")?).map(Statement::Check);
    }
    if let Some(speed) = code.strip_prefix('S') {
        let speed = speed.strip_suffix(" M3").or_else(|| speed.strip_suffix(" M4"))?;
        return whole(speed).map(|_| Statement::SpindleOn);
    }
    let offset = whole(code.strip_prefix('G')?)?;
    matches!(offset, 54..=57 | 505..=599).then_some(Statement::WorkOffset)
}

fn moves(code: &str) -> Option<Statement> {
    if let Some(words) = code.strip_prefix("G0 ") {
        return axis_words(words).map(Statement::Rapid);
    }
    if let Some(seconds) = code.strip_prefix("G4 F") {
        return number(seconds).map(Statement::Dwell);
    }
    let (words, feed) = code.strip_prefix("G1 ")?.rsplit_once(" F")?;
    Some(Statement::Cut { words: axis_words(words)?, feed: number(feed).filter(|f| *f > 0.0)? })
}

/// `X1=100. C-12.5`, each axis once.
fn axis_words(text: &str) -> Option<AxisWords> {
    let mut words = AxisWords::new();
    for word in text.split(' ') {
        let (name, value) = match word.split_once('=') {
            Some((name, value)) => (name, value),
            None => word.split_at_checked(1)?,
        };
        let letter: AxisLetter = name.parse().ok()?;
        let is_new = words.get(letter).is_none() && word.contains('=') == (letter.number() > 0);
        words.set(letter, signed(value).filter(|_| is_new)?).ok()?;
    }
    Some(words)
}

fn whole(text: &str) -> Option<u32> {
    text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok()).flatten()
}

/// With a decimal point, not negative.
fn number(text: &str) -> Option<f64> {
    signed(text).filter(|_| !text.starts_with('-'))
}

fn signed(text: &str) -> Option<f64> {
    number_text::parse(text.as_bytes()).filter(|_| text.contains('.') && !text.starts_with('+'))
}
