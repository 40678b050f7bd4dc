//! Words of statements: frames, cycles, and those that move the tool in ways that are not followed.

use std::collections::BTreeMap;

use facemill_cl_file::{AptFile, AptMeaning, AptStatement};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::fault::PostFault;
use crate::report::{PostNote, PostedWord, Treatment};

/// Words that move tool, part or frame in a way that is not followed: leaving one out would cut
/// elsewhere.
const MOVING: [&str; 32] = [
    "ARCSLP", "CALL", "COPY", "CSYS", "GO", "GOBACK", "GOCLER", "GODOWN", "GOFWD", "GOHOME", "GOLFT", "GORGT", "GOUP",
    "HEAD", "INDEX", "MACRO", "NURBS", "OFFSTL", "ORIGIN", "RETRCT", "ROTABL", "ROTATE", "ROTHED", "SAFPOS", "TERMAC",
    "THREAD", "TLLFT", "TLON", "TLRGT", "TMARK", "TRACUT", "TRANS",
];

/// Major word of a statement, upper case; `$$` of a comment.
pub(crate) fn major_word(text: &str) -> String {
    if text.starts_with("$$") {
        return "$$".to_owned();
    }
    let end = text.find(['/', ' ', ',', '\t']).unwrap_or(text.len());
    text[..end].to_ascii_uppercase()
}

/// Text behind the major word.
pub(crate) fn free_text(text: &str) -> &str {
    let end = text.find(['/', ' ', ',', '\t']).unwrap_or(text.len());
    let rest = text[end..].trim_start();
    rest.strip_prefix('/').unwrap_or(rest).trim()
}

/// Refuses a word that is not understood and moves something.
pub(crate) fn check_unknown(statement: &AptStatement) -> Result<(), PostFault> {
    let word = major_word(&statement.text);
    if MOVING.contains(&word.as_str()) {
        let why =
            format!("{word} is not followed, and moves tool, part or frame; let the CAM system write GOTO points");
        return Err(PostFault::at(statement.line, why));
    }
    Ok(())
}

/// Largest distance of a frame's directions from unit vectors at right angles: rounding of six
/// decimals.
const NOT_RIGID: f64 = 1e-4;

/// Returns the frame of a CSYS: that of its points in that of the part.
///
/// # Errors
/// If its directions are not unit vectors at right angles, or left-handed.
pub(crate) fn frame(rows: &[f64; 12], line: u32) -> Result<Isometry3<f64>, PostFault> {
    let matrix = Matrix3::new(rows[0], rows[1], rows[2], rows[4], rows[5], rows[6], rows[8], rows[9], rows[10]);
    let is_rigid =
        (matrix.transpose() * matrix - Matrix3::identity()).amax() <= NOT_RIGID && matrix.determinant() > 0.0;
    if !is_rigid {
        return Err(PostFault::at(line, "CSYS: its directions are not unit vectors at right angles, right-handed"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    // A frame without a turn must not turn points by rounding.
    let rotation = if matrix == Matrix3::identity() { UnitQuaternion::identity() } else { rotation };
    Ok(Isometry3::from_parts(Translation3::from(Vector3::new(rows[3], rows[7], rows[11])), rotation))
}

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
        | AptMeaning::Tool(_)
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
        | AptMeaning::Cutter { .. }
        | AptMeaning::MultiAxis(_)
        | AptMeaning::ToolAxis
        | AptMeaning::Frame(Some(_)) => Treatment::Applied,
        AptMeaning::Cycle(_)
        | AptMeaning::RadiusCompensation(_)
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
    pub(crate) fn count(&mut self, statement: &AptStatement) {
        let word = major_word(&statement.text);
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

/// Words that are not evaluated and say nothing of the motion: they are for printing, and for the
/// tolerances of another post-processor.
const HARMLESS: [&str; 12] = [
    "CATPROCESS",
    "CLPRNT",
    "DISPLY",
    "DRAFT",
    "LINTOL",
    "MCHTOL",
    "NOPOST",
    "PLOT",
    "PRINT",
    "SEQNO",
    "TITLES",
    "VERIFY",
];

/// Returns whether a program may lack a word that is not understood.
pub(crate) fn is_harmless(word: &str) -> bool {
    HARMLESS.contains(&word)
}

/// Refuses a file without UNITS whose feeds are in inches: its lengths would be taken as mm.
pub(crate) fn check_units(file: &AptFile) -> Result<(), PostFault> {
    if file.statements.iter().any(|s| matches!(s.meaning, AptMeaning::Unit(_))) {
        return Ok(());
    }
    let is_in_inches = |s: &&AptStatement| {
        matches!(s.meaning, AptMeaning::Feed(_) | AptMeaning::FeedPerRevolution(_) | AptMeaning::Cycle(_))
            && free_text(&s.text).split(',').any(|v| ["IPM", "IPR"].iter().any(|u| v.trim().eq_ignore_ascii_case(u)))
    };
    match file.statements.iter().find(is_in_inches) {
        Some(s) => {
            let why =
                "the feed is in inches, and UNITS is missing: put UNITS/INCHES or UNITS/MM before the first point";
            Err(PostFault::at(s.line, why))
        }
        None => Ok(()),
    }
}

/// Coordinate systems that are taken as the frame of the file, and the side of the tool that its
/// points are for.
#[derive(Debug, Default)]
pub(crate) struct Systems {
    /// Text of the first MSYS of NX, without blanks.
    nx: Option<String>,
    /// Numbers of the first CSYS that Creo writes as a comment.
    creo: Option<Vec<f64>>,
    /// Line at which Creo says that points are of the profile and not of the tool.
    profile: Option<u32>,
}

impl Systems {
    /// Takes an MSYS.
    ///
    /// # Errors
    /// If it differs from the one before.
    pub(crate) fn nx(&mut self, statement: &AptStatement) -> Result<(), PostFault> {
        let text = free_text(&statement.text).split_whitespace().collect::<String>();
        if self.nx.get_or_insert_with(|| text.clone()) == &text {
            return Ok(());
        }
        let why = "MSYS differs from the one before: points of several systems are not brought into one; post operations \
                   of one system alone";
        Err(PostFault::at(statement.line, why))
    }

    /// Takes a comment, in which Creo writes its own statements (`$$->`); returns a remark on it.
    ///
    /// # Errors
    /// If its CSYS differs from the one before.
    pub(crate) fn comment(&mut self, statement: &AptStatement) -> Result<Option<PostNote>, PostFault> {
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

    fn creo_system(&mut self, values: &str, line: u32) -> Result<Option<PostNote>, PostFault> {
        // A row may end without a comma where its line does.
        let numbers =
            values.split([',', ' ', '\t']).filter(|v| !v.is_empty()).map(str::parse).collect::<Result<_, _>>();
        let numbers: Vec<f64> =
            numbers.map_err(|_| PostFault::at(line, "CSYS of Creo: its values are not all numbers"))?;
        match &self.creo {
            Some(first) if *first == numbers => Ok(None),
            Some(_) => {
                let why = "CSYS of Creo differs from the one before: points of several systems are not brought into one; \
                           post operations of one system alone";
                Err(PostFault::at(line, why))
            }
            None => {
                let is_own = numbers.iter().enumerate().all(|(k, v)| *v == if k % 5 == 0 { 1.0 } else { 0.0 });
                self.creo = Some(numbers);
                let text = "CSYS of Creo is taken as the frame of the file: its turn and offset are not applied";
                Ok((!is_own).then(|| PostNote::at(line, text)))
            }
        }
    }

    /// Refuses radius compensation of points that are of the profile.
    ///
    /// # Errors
    /// If the file says so.
    pub(crate) fn check_offset(&self, line: u32) -> Result<(), PostFault> {
        match self.profile {
            None => Ok(()),
            Some(said) => {
                let why = format!(
                    "CUTCOM is not written, and the points are of the profile (line {said}): the tool would cut beyond it \
                     by its radius; let the CAM system write OUTPUT_ON_CENTER"
                );
                Err(PostFault::at(line, why))
            }
        }
    }
}
