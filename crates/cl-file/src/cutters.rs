//! Cutters of CUTTER, of TLDATA (NX) and of Creo's comments.

use facemill_nc_program::read::{ReadError, ReadFault};

use crate::apt_file::{CutterWord, FileCutter, FileMill};
use crate::statement::{RawStatement, parse};

/// Returns the cutter of CUTTER: diameter, corner radius, distance of the corner's centre from the
/// axis and from the tip, angle of the bottom and of the side, height (ISO 4343). Values behind the
/// corner radius that are no numbers count as not written.
///
/// # Errors
/// If it has no diameter, or diameter or corner radius is no number.
pub(super) fn of_cutter(raw: &RawStatement, values: &[(usize, &str)], unit: f64) -> Result<FileCutter, ReadError> {
    let diameter = values.first().ok_or_else(|| fault(raw, "CUTTER", "expected a diameter"))?;
    let other = |k: usize| values.get(k).and_then(|(_, value)| parse(value)).unwrap_or(0.0);
    Ok(FileCutter::Mill(FileMill {
        word: CutterWord::Cutter,
        diameter: raw.number(*diameter)? * unit,
        corner_radius: values.get(1).map(|value| Ok(raw.number(*value)? * unit)).transpose()?,
        corner_center: [other(2) * unit, other(3) * unit],
        bottom_deg: other(4),
        side_deg: other(5),
    }))
}

/// Returns the cutter of TLDATA, by which NX begins an operation; `None` if it names no kind.
///
/// TLDATA/MILL has 5, 7 or 10 values: diameter, lower radius, length, taper angle, tip angle; x and
/// y of the centre of the lower radius; upper radius, x and y of its centre. Source: the reader of
/// NX files by STEP Tools Inc. (2017, `AptContext`, `command_TLDATA`), which lists the values of
/// each kind.
///
/// # Errors
/// If a mill's diameter or lower radius is missing or no number.
pub(super) fn of_tldata(
    raw: &RawStatement,
    values: &[(usize, &str)],
    unit: f64,
) -> Result<Option<FileCutter>, ReadError> {
    let kind = values.first().map(|(_, kind)| kind.to_ascii_uppercase()).filter(|kind| !kind.is_empty());
    match kind {
        None => Ok(None),
        Some(kind) if kind == "MILL" => {
            let [_, diameter, radius, ..] = values else {
                return Err(fault(raw, "TLDATA", "expected diameter and lower radius behind MILL"));
            };
            let other = |k: usize| values.get(k).and_then(|(_, value)| parse(value)).unwrap_or(0.0);
            Ok(Some(FileCutter::Mill(FileMill {
                word: CutterWord::Tldata,
                diameter: raw.number(*diameter)? * unit,
                corner_radius: Some(raw.number(*radius)? * unit),
                corner_center: [other(6) * unit, other(7) * unit],
                bottom_deg: other(5),
                side_deg: other(4),
            })))
        }
        Some(kind) => Ok(Some(FileCutter::Other(kind))),
    }
}

/// Returns the cutter of `$$-> CUTTER / d`, a comment in which Creo gives the diameter alone;
/// `None` for other comments. No page of PTC describes it (CL data commands lists `$$` as "comment
/// or command for the use of Creo NC"); files of Creo have this form.
///
/// # Errors
/// If it has no diameter, or one that is no number.
pub(super) fn of_creo(raw: &RawStatement, unit: f64) -> Result<Option<FileCutter>, ReadError> {
    let Some(text) = raw.text.strip_prefix("$$->") else { return Ok(None) };
    let (word, values) = text.split_once('/').unwrap_or((text, ""));
    if !word.trim().eq_ignore_ascii_case("CUTTER") {
        return Ok(None);
    }
    let values = raw.values(raw.text.len() - values.len());
    let diameter = values.first().ok_or_else(|| fault(raw, "CUTTER", "expected a diameter"))?;
    Ok(Some(FileCutter::Mill(FileMill {
        word: CutterWord::Creo,
        diameter: raw.number(*diameter)? * unit,
        corner_radius: None,
        corner_center: [0.0; 2],
        bottom_deg: 0.0,
        side_deg: 0.0,
    })))
}

fn fault(raw: &RawStatement, word: &str, why: &'static str) -> ReadError {
    raw.error(0, ReadFault::Statement { word: word.to_owned(), why })
}
