//! The `.inf` file.

use nalgebra::Vector3;

use crate::fault::{BladeFault, BladeFileError};

/// Axis of rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotationAxis {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    Z,
}

impl RotationAxis {
    /// Returns the axis as a unit vector.
    pub fn direction(self) -> Vector3<f64> {
        match self {
            Self::X => Vector3::x(),
            Self::Y => Vector3::y(),
            Self::Z => Vector3::z(),
        }
    }
}

/// Form of an edge, as the keys `Blade 0 LE` and `Blade 0 TE` give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeEnd {
    /// Rounded by an ellipse (`EllipseEnd`).
    Ellipse,
    /// Flat between two corners (`CutOffEnd`).
    CutOff,
}

/// Content of an `.inf` file.
#[derive(Clone, Debug, PartialEq)]
pub struct BladeInfo {
    /// Axis of rotation; z where the file has none.
    pub axis: RotationAxis,
    /// Number of blades around the axis, 1 to 1000.
    pub n_blades: Option<u32>,
    /// Form of leading and trailing edge, where the file has it.
    pub ends: [Option<EdgeEnd>; 2],
    /// Length of the unit of the curve files, mm.
    pub mm_per_unit: f64,
    /// Name of the profile file, and the line that names it.
    pub profile_file: (String, usize),
    /// Name of the hub file, and the line that names it.
    pub hub_file: Option<(String, usize)>,
    /// Name of the shroud file, and the line that names it.
    pub shroud_file: Option<(String, usize)>,
}

const AXIS: &str = "Axis of Rotation";
const BLADES: &str = "Number of Blade Sets";
const PER_SET: &str = "Number of Blades Per Set";
const EDGES: [&str; 2] = ["Blade 0 LE", "Blade 0 TE"];
const UNITS: &str = "Geometry Units";
const COORDINATES: &str = "Coordinate System";
const HUB: &str = "Hub Data File";
const SHROUD: &str = "Shroud Data File";
const PROFILE: &str = "Profile Data File";

/// Keys that are read; others are of no use for the blade's shape.
const KEYS: [&str; 10] = [AXIS, BLADES, UNITS, COORDINATES, HUB, SHROUD, PROFILE, PER_SET, EDGES[0], EDGES[1]];

/// Greatest number of blades.
const MOST_BLADES: u32 = 1000;

/// Units by their names in upper case, mm.
const LENGTHS: [(&str, f64); 14] = [
    ("MM", 1.0),
    ("MILLIMETER", 1.0),
    ("MILLIMETRE", 1.0),
    ("CM", 10.0),
    ("CENTIMETER", 10.0),
    ("CENTIMETRE", 10.0),
    ("M", 1000.0),
    ("METER", 1000.0),
    ("METRE", 1000.0),
    ("IN", 25.4),
    ("INCH", 25.4),
    ("INCHES", 25.4),
    ("FT", 304.8),
    ("FEET", 304.8),
];

impl BladeInfo {
    /// Reads the bytes of an `.inf` file; `file` is its name in errors.
    ///
    /// # Errors
    /// If a key or the unit is missing, a value is unknown, a name leads out of the folder, or
    /// there are splitter blades.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, BladeFileError> {
        let text = text_of(file, bytes)?;
        let mut values: [Option<(&str, usize)>; KEYS.len()] = [None; KEYS.len()];
        for (k, line) in text.lines().enumerate() {
            let line = line.split(['!', '#']).next().unwrap_or_default();
            let Some((key, value)) = line.split_once(':') else { continue };
            let key = key.split_whitespace().collect::<Vec<_>>().join(" ");
            if is_of_splitter(&key) {
                return Err(BladeFileError::at(file, k + 1, BladeFault::Splitter(shown(&key))));
            }
            let Some(known) = KEYS.iter().position(|known| known.eq_ignore_ascii_case(&key)) else { continue };
            let value = value.trim();
            if values[known].is_some_and(|(before, _)| before != value) {
                return Err(BladeFileError::at(file, k + 1, BladeFault::RepeatedKey(KEYS[known])));
            }
            values[known] = Some((value, k + 1));
        }
        let [axis, blades, units, coordinates, hub, shroud, profile, per_set, leading, trailing] = values;
        if let Some((value, line)) = per_set
            && count_of(file, PER_SET, value, line)? > 1
        {
            let fault = BladeFault::Splitter(format!("{PER_SET}: {}", shown(value)));
            return Err(BladeFileError::at(file, line, fault));
        }
        let end =
            |key, entry: Option<(&str, usize)>| entry.map(|(value, line)| edge_end(file, key, value, line)).transpose();
        if let Some((value, line)) = coordinates {
            let known = BladeFault::UnknownValue { key: COORDINATES, value: shown(value), known: "Cartesian" };
            value.eq_ignore_ascii_case("cartesian").then_some(()).ok_or(BladeFileError::at(file, line, known))?;
        }
        let name = |entry: Option<(&str, usize)>| {
            entry.map(|(value, line)| Ok((inner_name(file, value, line)?, line))).transpose()
        };
        let missing = |key| BladeFileError::of_file(file, BladeFault::MissingKey(key));
        Ok(Self {
            axis: axis.map_or(Ok(RotationAxis::Z), |(value, line)| axis_of(file, value, line))?,
            n_blades: blades.map(|(value, line)| count_of(file, BLADES, value, line)).transpose()?,
            ends: [end(EDGES[0], leading)?, end(EDGES[1], trailing)?],
            mm_per_unit: units.map_or(Err(missing(UNITS)), |(value, line)| unit_of(file, value, line))?,
            profile_file: name(profile)?.ok_or_else(|| missing(PROFILE))?,
            hub_file: name(hub)?,
            shroud_file: name(shroud)?,
        })
    }
}

/// Text of a file, without the mark of its byte order.
pub(crate) fn text_of<'t>(file: &str, bytes: &'t [u8]) -> Result<&'t str, BladeFileError> {
    let text = std::str::from_utf8(bytes).map_err(|_| BladeFileError::of_file(file, BladeFault::NoText))?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// A value for a message: printable, and no longer than a line.
pub(crate) fn shown(value: &str) -> String {
    let clean = value.chars().map(|c| if c.is_control() { '?' } else { c });
    let mut text: String = clean.clone().take(60).collect();
    if clean.count() > 60 {
        text.push('…');
    }
    text
}

fn axis_of(file: &str, value: &str, line: usize) -> Result<RotationAxis, BladeFileError> {
    match value.to_ascii_uppercase().as_str() {
        "X" => Ok(RotationAxis::X),
        "Y" => Ok(RotationAxis::Y),
        "Z" => Ok(RotationAxis::Z),
        _ => {
            let fault = BladeFault::UnknownValue { key: AXIS, value: shown(value), known: "X, Y, Z" };
            Err(BladeFileError::at(file, line, fault))
        }
    }
}

fn count_of(file: &str, key: &'static str, value: &str, line: usize) -> Result<u32, BladeFileError> {
    let wrong = || BladeFault::WrongCount { key, value: shown(value), most: MOST_BLADES };
    let number = value.parse().ok().filter(|n| (1..=MOST_BLADES).contains(n));
    number.ok_or_else(|| BladeFileError::at(file, line, wrong()))
}

fn edge_end(file: &str, key: &'static str, value: &str, line: usize) -> Result<EdgeEnd, BladeFileError> {
    let known = [("EllipseEnd", EdgeEnd::Ellipse), ("CutOffEnd", EdgeEnd::CutOff)];
    let found = known.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(value)).map(|(_, end)| end);
    let fault = || BladeFault::UnknownValue { key, value: shown(value), known: "EllipseEnd, CutOffEnd" };
    found.ok_or_else(|| BladeFileError::at(file, line, fault()))
}

/// Returns whether a key describes an edge of another blade than the first one of a set.
fn is_of_splitter(key: &str) -> bool {
    let mut words = key.split(' ');
    let [blade, number, edge] = [words.next(), words.next(), words.next()];
    let is = |word: Option<&str>, names: &[&str]| {
        word.is_some_and(|word| names.iter().any(|name| name.eq_ignore_ascii_case(word)))
    };
    let is_other = number.and_then(|number| number.parse::<u32>().ok()).is_some_and(|number| number > 0);
    is(blade, &["blade"]) && is_other && is(edge, &["le", "te"]) && words.next().is_none()
}

fn unit_of(file: &str, value: &str, line: usize) -> Result<f64, BladeFileError> {
    let unit = LENGTHS.iter().find(|(name, _)| name.eq_ignore_ascii_case(value)).map(|(_, mm)| *mm);
    let fault = || BladeFault::UnknownValue { key: UNITS, value: shown(value), known: "MM, CM, M, IN, FT" };
    unit.ok_or_else(|| BladeFileError::at(file, line, fault()))
}

/// The name of a file below the folder, with `/` between its parts.
fn inner_name(file: &str, value: &str, line: usize) -> Result<String, BladeFileError> {
    let name = value.trim_matches('"').replace('\\', "/");
    let is_inner = name.split('/').all(|part| !matches!(part, "" | "." | "..") && !part.contains([':', '\0']));
    let outside = || BladeFileError::at(file, line, BladeFault::OutsideName(shown(value)));
    is_inner.then_some(name).ok_or_else(outside)
}
