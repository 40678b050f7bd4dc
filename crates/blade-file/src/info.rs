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

/// Form of an edge, as keys such as `Blade 0 LE` and `Blade 0 TE` give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeEnd {
    /// Rounded by an ellipse (`EllipseEnd`).
    Ellipse,
    /// Flat between two corners (`CutOffEnd`).
    CutOff,
}

/// Form of an edge of one blade of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BladeEnd {
    /// Number of the blade in its set, from 0, the main blade.
    pub blade: u32,
    /// Whether it is the leading edge, not the trailing one.
    pub is_leading: bool,
    /// The form.
    pub form: EdgeEnd,
    /// Line that has it.
    pub line: usize,
}

/// Content of an `.inf` file.
#[derive(Clone, Debug, PartialEq)]
pub struct BladeInfo {
    /// Axis of rotation; z where the file has none.
    pub axis: RotationAxis,
    /// Number of blade sets around the axis, 1 to 1000; of blades, where a set is one blade.
    pub n_blades: Option<u32>,
    /// Number of blades per set, 1 to 10, and the line that has it.
    pub blades_per_set: Option<(u32, usize)>,
    /// Forms of edges that the file has, in the order of blades, leading edges first.
    pub ends: Vec<BladeEnd>,
    /// Length of the unit of the curve files, mm.
    pub mm_per_unit: f64,
    /// Names of the profile files, at least one, and the lines that name them.
    pub profile_files: Vec<(String, usize)>,
    /// Name of the hub file, and the line that names it.
    pub hub_file: Option<(String, usize)>,
    /// Name of the shroud file, and the line that names it.
    pub shroud_file: Option<(String, usize)>,
}

const AXIS: &str = "Axis of Rotation";
const BLADES: &str = "Number of Blade Sets";
const PER_SET: &str = "Number of Blades Per Set";
const UNITS: &str = "Geometry Units";
const COORDINATES: &str = "Coordinate System";
const HUB: &str = "Hub Data File";
const SHROUD: &str = "Shroud Data File";
const PROFILE: &str = "Profile Data File";

/// Keys that are read; others are of no use for the blade's shape.
const KEYS: [&str; 7] = [AXIS, BLADES, UNITS, COORDINATES, HUB, SHROUD, PER_SET];

/// Greatest number of blade sets.
const MOST_BLADES: u32 = 1000;

/// Greatest number of blades in a set.
pub(crate) const MOST_PER_SET: u32 = 10;

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
    /// If a key or the unit is missing, a value is unknown, or a name leads out of the folder.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, BladeFileError> {
        let text = text_of(file, bytes)?;
        let mut values: [Option<(&str, usize)>; KEYS.len()] = [None; KEYS.len()];
        let mut ends: Vec<BladeEnd> = Vec::new();
        let mut profile_files: Vec<(String, usize)> = Vec::new();
        for (k, line) in text.lines().enumerate() {
            let line = line.split(['!', '#']).next().unwrap_or_default();
            let Some((key, value)) = line.split_once(':') else { continue };
            let key = key.split_whitespace().collect::<Vec<_>>().join(" ");
            let value = value.trim();
            if let Some((blade, is_leading)) = edge_of_key(&key) {
                let end = BladeEnd { blade, is_leading, form: edge_end(file, &key, value, k + 1)?, line: k + 1 };
                match ends.iter().find(|other| (other.blade, other.is_leading) == (blade, is_leading)) {
                    None => ends.push(end),
                    Some(before) if before.form == end.form => {}
                    Some(_) => return Err(BladeFileError::at(file, k + 1, BladeFault::RepeatedKey(shown(&key)))),
                }
            }
            if PROFILE.eq_ignore_ascii_case(&key) {
                let name = inner_name(file, value, k + 1)?;
                if !profile_files.iter().any(|(other, _)| *other == name) {
                    profile_files.push((name, k + 1));
                }
            }
            let Some(known) = KEYS.iter().position(|known| known.eq_ignore_ascii_case(&key)) else { continue };
            if values[known].is_some_and(|(before, _)| before != value) {
                return Err(BladeFileError::at(file, k + 1, BladeFault::RepeatedKey(KEYS[known].to_owned())));
            }
            values[known] = Some((value, k + 1));
        }
        ends.sort_by_key(|end| (end.blade, !end.is_leading));
        let [axis, blades, units, coordinates, hub, shroud, per_set] = values;
        let per_set = per_set.map(|(value, line)| Ok((count_of(file, PER_SET, (value, MOST_PER_SET), line)?, line)));
        let blades_per_set = per_set.transpose()?;
        if let (None, [_, (_, line), ..]) = (blades_per_set, &profile_files[..]) {
            return Err(BladeFileError::at(file, *line, BladeFault::SecondProfile));
        }
        if let Some((value, line)) = coordinates {
            let known =
                BladeFault::UnknownValue { key: COORDINATES.to_owned(), value: shown(value), known: "Cartesian" };
            value.eq_ignore_ascii_case("cartesian").then_some(()).ok_or(BladeFileError::at(file, line, known))?;
        }
        let name = |entry: Option<(&str, usize)>| {
            entry.map(|(value, line)| Ok((inner_name(file, value, line)?, line))).transpose()
        };
        let missing = |key| BladeFileError::of_file(file, BladeFault::MissingKey(key));
        let n_blades = blades.map(|(value, line)| count_of(file, BLADES, (value, MOST_BLADES), line)).transpose()?;
        let info = Self {
            axis: axis.map_or(Ok(RotationAxis::Z), |(value, line)| axis_of(file, value, line))?,
            n_blades,
            blades_per_set,
            ends,
            mm_per_unit: units.map_or(Err(missing(UNITS)), |(value, line)| unit_of(file, value, line))?,
            profile_files,
            hub_file: name(hub)?,
            shroud_file: name(shroud)?,
        };
        if info.profile_files.is_empty() { Err(missing(PROFILE)) } else { Ok(info) }
    }

    /// Returns the forms of leading and trailing edge of a blade of the set, where the file has
    /// them.
    #[must_use]
    pub fn ends_of(&self, blade: u32) -> [Option<EdgeEnd>; 2] {
        [true, false].map(|is_leading| {
            let of = self.ends.iter().find(|end| end.blade == blade && end.is_leading == is_leading);
            of.map(|end| end.form)
        })
    }

    /// Checks that a set has as many blades as the file says, and forms of the edges of no others.
    pub(crate) fn check_blades(&self, file: &str, found: u32) -> Result<(), BladeFileError> {
        if let Some((given, line)) = self.blades_per_set
            && given != found
        {
            return Err(BladeFileError::at(file, line, BladeFault::WrongBladesPerSet { given, found }));
        }
        match self.ends.iter().find(|end| end.blade >= found) {
            Some(end) => Err(BladeFileError::at(file, end.line, BladeFault::NoSuchBlade { blade: end.blade, found })),
            None => Ok(()),
        }
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
            let fault = BladeFault::UnknownValue { key: AXIS.to_owned(), value: shown(value), known: "X, Y, Z" };
            Err(BladeFileError::at(file, line, fault))
        }
    }
}

fn count_of(file: &str, key: &'static str, (value, most): (&str, u32), line: usize) -> Result<u32, BladeFileError> {
    let wrong = || BladeFault::WrongCount { key, value: shown(value), most };
    let number = value.parse().ok().filter(|n| (1..=most).contains(n));
    number.ok_or_else(|| BladeFileError::at(file, line, wrong()))
}

fn edge_end(file: &str, key: &str, value: &str, line: usize) -> Result<EdgeEnd, BladeFileError> {
    let known = [("EllipseEnd", EdgeEnd::Ellipse), ("CutOffEnd", EdgeEnd::CutOff)];
    let found = known.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(value)).map(|(_, end)| end);
    let fault = || BladeFault::UnknownValue { key: shown(key), value: shown(value), known: "EllipseEnd, CutOffEnd" };
    found.ok_or_else(|| BladeFileError::at(file, line, fault()))
}

/// Returns the blade of a key such as `Blade 0 LE`, and whether it is of the leading edge.
fn edge_of_key(key: &str) -> Option<(u32, bool)> {
    let words: Vec<&str> = key.split(' ').collect();
    let &[blade, number, edge] = &words[..] else { return None };
    let is_leading = edge.eq_ignore_ascii_case("le");
    let is_edge = blade.eq_ignore_ascii_case("blade") && (is_leading || edge.eq_ignore_ascii_case("te"));
    Some((number.parse().ok().filter(|_| is_edge)?, is_leading))
}

fn unit_of(file: &str, value: &str, line: usize) -> Result<f64, BladeFileError> {
    let unit = LENGTHS.iter().find(|(name, _)| name.eq_ignore_ascii_case(value)).map(|(_, mm)| *mm);
    let fault = || BladeFault::UnknownValue { key: UNITS.to_owned(), value: shown(value), known: "MM, CM, M, IN, FT" };
    unit.ok_or_else(|| BladeFileError::at(file, line, fault()))
}

/// The name of a file below the folder, with `/` between its parts.
fn inner_name(file: &str, value: &str, line: usize) -> Result<String, BladeFileError> {
    let name = value.trim_matches('"').replace('\\', "/");
    let is_inner = name.split('/').all(|part| !matches!(part, "" | "." | "..") && !part.contains([':', '\0']));
    let outside = || BladeFileError::at(file, line, BladeFault::OutsideName(shown(value)));
    is_inner.then_some(name).ok_or_else(outside)
}
