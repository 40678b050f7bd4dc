//! Words of statements that say how points are to be taken: their frame, their unit, and whether
//! something moves in a way that is not followed.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::apt_file::{AptFile, AptMeaning, AptStatement};

/// Reason why the points of a file cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {why}")]
pub struct ClFault {
    /// First line of the statement, from 1.
    pub line: u32,
    /// Fault and remedy.
    pub why: String,
}

impl ClFault {
    /// Creates the fault of a statement.
    pub fn at(line: u32, why: impl Into<String>) -> Self {
        Self { line, why: why.into() }
    }
}

/// Words that move tool, part or frame in a way that is not followed: leaving one out would cut
/// elsewhere.
const MOVING: [&str; 31] = [
    "ARCSLP", "CALL", "COPY", "CSYS", "GO", "GOBACK", "GOCLER", "GODOWN", "GOFWD", "GOLFT", "GORGT", "GOUP", "HEAD",
    "INDEX", "MACRO", "NURBS", "OFFSTL", "ORIGIN", "RETRCT", "ROTABL", "ROTATE", "ROTHED", "SAFPOS", "TERMAC",
    "THREAD", "TLLFT", "TLON", "TLRGT", "TMARK", "TRACUT", "TRANS",
];

/// Returns the major word of a statement, upper case; `$$` of a comment.
pub fn major_word(text: &str) -> String {
    if text.starts_with("$$") {
        return "$$".to_owned();
    }
    let end = text.find(['/', ' ', ',', '\t']).unwrap_or(text.len());
    text[..end].to_ascii_uppercase()
}

/// Returns the note on a CSYS whose rows, taken as columns, would be another frame; `None` for a
/// frame without a turn, or turned by half a turn.
pub fn csys_note(rows: &[f64; 12]) -> Option<&'static str> {
    let is_symmetric = [(1, 4), (2, 8), (6, 9)].iter().all(|&(a, b)| (rows[a] - rows[b]).abs() <= NOT_RIGID);
    (!is_symmetric).then_some(
        "CSYS turns: each of its rows is taken as the direction of an axis of its frame, and a coordinate of its origin",
    )
}

/// Returns the text behind the major word.
pub fn free_text(text: &str) -> &str {
    let end = text.find(['/', ' ', ',', '\t']).unwrap_or(text.len());
    let rest = text[end..].trim_start();
    rest.strip_prefix('/').unwrap_or(rest).trim()
}

/// Refuses a word that is not understood and moves something.
pub fn check_word(statement: &AptStatement) -> Result<(), ClFault> {
    let word = major_word(&statement.text);
    if MOVING.contains(&word.as_str()) {
        let why =
            format!("{word} is not followed, and moves tool, part or frame; let the CAM system write GOTO points");
        return Err(ClFault::at(statement.line, why));
    }
    Ok(())
}

/// Largest distance of a frame's directions from unit vectors at right angles: rounding of six
/// decimals.
const NOT_RIGID: f64 = 1e-4;

/// Returns the frame of a CSYS: that of its points in that of the part. Each row of its numbers is
/// the direction of an axis in the part's frame, and a coordinate of the origin there: so holes
/// that a file drills in two frames are at the same places.
///
/// # Errors
/// If its directions are not unit vectors at right angles, or left-handed.
pub fn csys_frame(rows: &[f64; 12], line: u32) -> Result<Isometry3<f64>, ClFault> {
    let directions = Matrix3::new(rows[0], rows[1], rows[2], rows[4], rows[5], rows[6], rows[8], rows[9], rows[10]);
    let matrix = directions.transpose();
    let is_rigid =
        (matrix.transpose() * matrix - Matrix3::identity()).amax() <= NOT_RIGID && matrix.determinant() > 0.0;
    if !is_rigid {
        return Err(ClFault::at(line, "CSYS: its directions are not unit vectors at right angles, right-handed"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    // A frame without a turn must not turn points by rounding.
    let rotation = if matrix == Matrix3::identity() { UnitQuaternion::identity() } else { rotation };
    Ok(Isometry3::from_parts(Translation3::from(Vector3::new(rows[3], rows[7], rows[11])), rotation))
}

/// Returns the note on the unit of a file without UNITS; `None` for one with it.
pub fn unit_note(file: &AptFile) -> Option<String> {
    if has_units(file) {
        return None;
    }
    Some(match file.given_unit {
        Some(unit) => format!("UNITS is missing: lengths are in {unit}, the unit given beside the file"),
        None => "UNITS is missing: lengths are taken as mm".to_owned(),
    })
}

fn has_units(file: &AptFile) -> bool {
    file.statements.iter().any(|s| matches!(s.meaning, AptMeaning::Unit(_)))
}

/// Refuses a file without a unit whose feeds are in inches: its lengths would be taken as mm.
pub fn check_units(file: &AptFile) -> Result<(), ClFault> {
    if file.given_unit.is_some() || has_units(file) {
        return Ok(());
    }
    let is_in_inches = |s: &&AptStatement| {
        matches!(s.meaning, AptMeaning::Feed(_) | AptMeaning::FeedPerRevolution(_) | AptMeaning::Cycle(_))
            && free_text(&s.text).split(',').any(|v| ["IPM", "IPR"].iter().any(|u| v.trim().eq_ignore_ascii_case(u)))
    };
    match file.statements.iter().find(is_in_inches) {
        Some(s) => {
            let why = "the feed is in inches, and UNITS is missing: put UNITS/INCHES or UNITS/MM before the first point, or give \
                 the unit beside the file";
            Err(ClFault::at(s.line, why))
        }
        None => Ok(()),
    }
}

/// Coordinate systems that are taken as the frame of the file, and the side of the tool that its
/// points are for.
#[derive(Debug, Default)]
pub struct ClSystems {
    /// Text of the first MSYS of NX, without blanks.
    nx: Option<String>,
    /// Numbers of the first CSYS that Creo writes as a comment.
    creo: Option<Vec<f64>>,
    /// Line at which Creo says that points are of the profile and not of the tool.
    profile: Option<u32>,
}

impl ClSystems {
    /// Takes an MSYS.
    ///
    /// # Errors
    /// If it differs from the one before.
    pub fn nx(&mut self, statement: &AptStatement) -> Result<(), ClFault> {
        let text = free_text(&statement.text).split_whitespace().collect::<String>();
        if self.nx.get_or_insert_with(|| text.clone()) == &text {
            return Ok(());
        }
        let why = "MSYS differs from the one before: points of several systems are not brought into one; post operations \
                   of one system alone";
        Err(ClFault::at(statement.line, why))
    }

    /// Takes a comment, in which Creo writes its own statements (`$$->`); returns a remark on it.
    ///
    /// # Errors
    /// If its CSYS differs from the one before.
    pub fn comment(&mut self, statement: &AptStatement) -> Result<Option<&'static str>, ClFault> {
        let Some(text) = statement.text.strip_prefix("$$->").map(str::trim_start) else { return Ok(None) };
        let values = free_text(text);
        match major_word(text).as_str() {
            "CUTCOM_GEOMETRY_TYPE" => {
                self.profile = values.eq_ignore_ascii_case("OUTPUT_ON_PROFILE").then_some(statement.line);
                Ok(None)
            }
            "CSYS" => self.creo_system(values, statement.line),
            _ => Ok(None),
        }
    }

    fn creo_system(&mut self, values: &str, line: u32) -> Result<Option<&'static str>, ClFault> {
        // A row may end without a comma where its line does.
        let numbers =
            values.split([',', ' ', '\t']).filter(|v| !v.is_empty()).map(str::parse).collect::<Result<_, _>>();
        let numbers: Vec<f64> =
            numbers.map_err(|_| ClFault::at(line, "CSYS of Creo: its values are not all numbers"))?;
        match &self.creo {
            Some(first) if *first == numbers => Ok(None),
            Some(_) => {
                let why = "CSYS of Creo differs from the one before: points of several systems are not brought into one; \
                           post operations of one system alone";
                Err(ClFault::at(line, why))
            }
            None => {
                let is_own = numbers.iter().enumerate().all(|(k, v)| *v == if k % 5 == 0 { 1.0 } else { 0.0 });
                self.creo = Some(numbers);
                let text = "CSYS of Creo is taken as the frame of the file: its turn and offset are not applied";
                Ok((!is_own).then_some(text))
            }
        }
    }

    /// Refuses radius compensation of points that are of the profile.
    ///
    /// # Errors
    /// If the file says so.
    pub fn check_offset(&self, line: u32) -> Result<(), ClFault> {
        match self.profile {
            None => Ok(()),
            Some(said) => {
                let why = format!(
                    "CUTCOM is not written, and the points are of the profile (line {said}): the tool would cut beyond it \
                     by its radius; let the CAM system write OUTPUT_ON_CENTER"
                );
                Err(ClFault::at(line, why))
            }
        }
    }
}
