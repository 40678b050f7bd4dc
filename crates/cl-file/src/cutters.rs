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
/// `None` for other comments, also with a name in its place. No page of PTC describes it (CL data
/// commands lists `$$` as "comment or command for the use of Creo NC"); files of Creo have this
/// form.
pub(super) fn of_creo(raw: &RawStatement, unit: f64) -> Option<FileCutter> {
    let (word, values) = raw.text.strip_prefix("$$->")?.split_once('/')?;
    if !word.trim().eq_ignore_ascii_case("CUTTER") {
        return None;
    }
    let diameter = parse(values.split(',').next()?.trim())?;
    Some(FileCutter::Mill(FileMill {
        word: CutterWord::Creo,
        diameter: diameter * unit,
        corner_radius: None,
        corner_center: [0.0; 2],
        bottom_deg: 0.0,
        side_deg: 0.0,
    }))
}

/// Largest difference of a length of a file's cutter from a tool's that is none, mm: rounding, and
/// a tool as measured.
const SAME_CUTTER: f64 = 0.01;

impl FileCutter {
    /// Returns how it differs from a mill without angles, of this diameter and corner radius (mm),
    /// that `own` names; `None` if it does not. CUTTER without a corner radius is a flat end mill,
    /// Creo gives the diameter alone.
    #[must_use]
    pub fn difference(&self, [own_diameter, own_corner]: [f64; 2], own: &str) -> Option<String> {
        let mill = match self {
            Self::Mill(mill) => mill,
            Self::Other(kind) => return Some(format!("TLDATA/{kind} is no mill, and {own} is one")),
        };
        let word = mill.word.name();
        let differs = |a: f64, b: f64| (a - b).abs() > SAME_CUTTER;
        let corner = mill.corner_radius.or((mill.word != CutterWord::Creo).then_some(0.0));
        if differs(mill.diameter, own_diameter) || corner.is_some_and(|corner| differs(corner, own_corner)) {
            let and_corner = match (mill.corner_radius, corner) {
                (Some(corner), _) => format!(" and corner radius {corner:.3} mm"),
                (None, Some(_)) => " mm and no corner radius".to_owned(),
                (None, None) => " mm".to_owned(),
            };
            return Some(format!(
                "{word} has diameter {:.3}{and_corner}, {own} diameter {own_diameter:.3} and corner radius {own_corner:.3} mm",
                mill.diameter
            ));
        }
        let angle = [("bottom", mill.bottom_deg), ("side", mill.side_deg)].into_iter().find(|(_, deg)| *deg != 0.0);
        if let Some((place, deg)) = angle {
            return Some(format!("{word} has an angle of {deg} deg at its {place}, {own} none"));
        }
        // Zero is how some systems leave the centre of the corner out.
        let [out, up] = mill.corner_center;
        let [own_out, own_up] = [0.5 * own_diameter - own_corner, own_corner];
        let is_elsewhere = (out != 0.0 && differs(out, own_out)) || (up != 0.0 && differs(up, own_up));
        is_elsewhere.then(|| {
            format!(
                "{word} has the centre of its corner {out:.3} mm from the axis and {up:.3} mm above the tip, {own} {own_out:.3} \
                 and {own_up:.3} mm"
            )
        })
    }

    /// Takes the lengths as so many times what they were.
    pub(super) fn scale(&mut self, times: f64) {
        if let Self::Mill(mill) = self {
            mill.diameter *= times;
            mill.corner_radius = mill.corner_radius.map(|corner| corner * times);
            mill.corner_center = mill.corner_center.map(|length| length * times);
        }
    }
}

/// Cutter of the cuts at a place of a file: the last one that it describes. One that has cut is
/// not that of the next tool, which may come without a description.
#[derive(Clone, Debug, Default)]
pub struct CutterInForce {
    cutter: Option<(u32, FileCutter)>,
    has_cut: bool,
}

impl CutterInForce {
    /// Takes a cutter that the file describes on this line.
    pub fn describe(&mut self, line: u32, cutter: &FileCutter) {
        (self.cutter, self.has_cut) = (Some((line, cutter.clone())), false);
    }

    /// Takes the call of another tool.
    pub fn change_tool(&mut self) {
        self.cutter.take_if(|_| self.has_cut);
    }

    /// Returns the cutter of a cut, with its line, if it is described.
    pub fn cut(&mut self) -> Option<(u32, &FileCutter)> {
        self.has_cut = true;
        self.cutter.as_ref().map(|(line, cutter)| (*line, cutter))
    }
}

fn fault(raw: &RawStatement, word: &str, why: &'static str) -> ReadError {
    raw.error(0, ReadFault::Statement { word: word.to_owned(), why })
}
