//! Tables as JSON.

use std::fmt;
use std::marker::PhantomData;

use facemill_file_format::from_json;
use facemill_sample_parts::Hand;
use schemars::JsonSchema;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::columns::TableKind;
use crate::fault::{PropellerFault, PropellerFileError, RowPlace};
use crate::propeller::{Particulars, PropellerFile, SectionForm};
use crate::raw_table::{MAX_OFFSETS, MAX_RADII, RawTable};

/// Format of a propeller file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum PropellerFormat {
    /// `facemill-propeller/1`.
    #[default]
    #[serde(rename = "facemill-propeller/1")]
    V1,
}

/// Propeller file: particulars, a row for each radius, and sections. R is half the diameter D.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PropellerJson {
    /// Always `"facemill-propeller/1"`.
    pub format: PropellerFormat,
    /// Name of the propeller in the job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Diameter D. Default: the one given beside the file (`--diameter-mm`).
    #[schemars(range(min = 1, max = 20_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter_mm: Option<f64>,
    /// Number of blades.
    #[schemars(range(min = 2, max = 12))]
    pub blades: u32,
    /// Hand: a right-handed propeller turns clockwise seen from astern when it drives ahead.
    pub hand: PropellerHand,
    /// Diameter of the hub, 0.05 D to 0.5 D.
    #[schemars(range(min = 0))]
    pub hub_diameter_mm: f64,
    /// Length of the hub with its rounded ends, its middle at the middle of the blades' roots.
    /// Default: a little longer than the roots.
    #[schemars(range(min = 0))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hub_length_mm: Option<f64>,
    /// Sections; `offsets` are those of `sections`.
    pub section: PropellerSection,
    /// Rows from the hub's radius or below it to the tip.
    #[schemars(length(min = 4, max = 1000))]
    #[serde(deserialize_with = "rows_at_most")]
    pub rows: Vec<RadialRow>,
    /// Sections by their ordinates, for `section` `offsets` alone: four or more, from the hub's
    /// radius or below it to 0.9 R at least, with the same stations.
    #[serde(default, deserialize_with = "sections_at_most", skip_serializing_if = "Option::is_none")]
    pub sections: Option<Vec<SectionRow>>,
}

/// Hand of a propeller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PropellerHand {
    /// Right-handed.
    Right,
    /// Left-handed: the mirror image.
    Left,
}

/// Sections of a propeller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PropellerSection {
    /// NACA 66 (DTMB modified) thickness about a NACA a = 0.8 mean line; takes thickness and
    /// camber.
    #[serde(rename = "naca66_a08")]
    Naca66A08,
    /// Sections of the Wageningen B series, which have their own camber; takes the thickness.
    WageningenB,
    /// Ordinates of `sections`; takes neither thickness nor camber.
    Offsets,
}

/// Values at a radius. All rows have the same keys: radius, chord and pitch, thickness and camber
/// as the sections take them, skew and rake (default: none). A quantity in several forms agrees
/// within 0.2 % of its largest value, and the length is taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RadialRow {
    /// Radius over R, growing up to 1.
    #[serde(rename = "r_R", skip_serializing_if = "Option::is_none")]
    pub r_over_radius: Option<f64>,
    /// Radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_mm: Option<f64>,
    /// Chord over D; 0 at the tip alone.
    #[serde(rename = "c_D", skip_serializing_if = "Option::is_none")]
    pub c_over_diameter: Option<f64>,
    /// Chord.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chord_mm: Option<f64>,
    /// Pitch over D.
    #[serde(rename = "P_D", skip_serializing_if = "Option::is_none")]
    pub pitch_over_diameter: Option<f64>,
    /// Pitch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch_mm: Option<f64>,
    /// Pitch angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phi_deg: Option<f64>,
    /// Largest thickness over the chord.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_c: Option<f64>,
    /// Largest thickness over D.
    #[serde(rename = "t_D", skip_serializing_if = "Option::is_none")]
    pub t_over_diameter: Option<f64>,
    /// Largest thickness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<f64>,
    /// Largest ordinate of the mean line over the chord.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_c: Option<f64>,
    /// Largest ordinate of the mean line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camber_mm: Option<f64>,
    /// Skew of the middle of the chord, positive against the rotation. Skew along the helix brings
    /// its own rake.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skew_deg: Option<f64>,
    /// Skew by the distance of the leading edge from the generator line, along the helix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leading_edge_mm: Option<f64>,
    /// Rake of the generator line over D, without that of the skew, negative aft.
    #[serde(rename = "rake_D", skip_serializing_if = "Option::is_none")]
    pub rake_over_diameter: Option<f64>,
    /// Rake over R, negative aft.
    #[serde(rename = "rake_R", skip_serializing_if = "Option::is_none")]
    pub rake_over_radius: Option<f64>,
    /// Rake, negative aft.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rake_mm: Option<f64>,
}

/// Ordinates of a section: the heights of both sides above the line through its edges, or camber
/// and thickness; all over the chord or all in mm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SectionRow {
    /// Radius over R.
    #[serde(rename = "r_R", skip_serializing_if = "Option::is_none")]
    pub r_over_radius: Option<f64>,
    /// Radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_mm: Option<f64>,
    /// Stations over the chord, from 0 at the leading edge to 1; five or more.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub x_c: Option<Vec<f64>>,
    /// Suction side over the chord.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub suction_c: Option<Vec<f64>>,
    /// Pressure side over the chord.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub pressure_c: Option<Vec<f64>>,
    /// Suction side.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub suction_mm: Option<Vec<f64>>,
    /// Pressure side.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub pressure_mm: Option<Vec<f64>>,
    /// Full thickness over the chord.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub t_c: Option<Vec<f64>>,
    /// Mean line over the chord.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub f_c: Option<Vec<f64>>,
    /// Full thickness.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<Vec<f64>>,
    /// Mean line.
    #[serde(deserialize_with = "ordinates_at_most", skip_serializing_if = "Option::is_none")]
    pub camber_mm: Option<Vec<f64>>,
}

/// A list of at most `MOST` rows: refused while it is read, before memory holds more.
struct AtMost<T, const MOST: usize>(Vec<T>);

/// An element of a list, as a number of rows of a table.
trait TableRows {
    fn n_rows(&self) -> usize {
        1
    }
}

impl TableRows for RadialRow {}

impl TableRows for f64 {}

impl TableRows for SectionRow {
    /// Stations of its longest list.
    fn n_rows(&self) -> usize {
        self.lists().into_iter().filter_map(|(_, list)| Some(list?.len())).fold(1, usize::max)
    }
}

impl<'de, T: TableRows + Deserialize<'de>, const MOST: usize> Deserialize<'de> for AtMost<T, MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(AtMostVisitor(PhantomData))
    }
}

struct AtMostVisitor<T, const MOST: usize>(PhantomData<T>);

impl<'de, T: TableRows + Deserialize<'de>, const MOST: usize> Visitor<'de> for AtMostVisitor<T, MOST> {
    type Value = AtMost<T, MOST>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a sequence")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Self::Value, A::Error> {
        let (mut list, mut n_rows) = (Vec::new(), 0);
        while let Some(element) = elements.next_element::<T>()? {
            n_rows += element.n_rows();
            if n_rows > MOST {
                return Err(A::Error::custom(PropellerFault::TooLong(MOST)));
            }
            list.push(element);
        }
        Ok(AtMost(list))
    }
}

fn rows_at_most<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<RadialRow>, D::Error> {
    AtMost::<_, MAX_RADII>::deserialize(deserializer).map(|list| list.0)
}

fn sections_at_most<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<SectionRow>>, D::Error> {
    let list = Option::<AtMost<_, MAX_OFFSETS>>::deserialize(deserializer)?;
    Ok(list.map(|list| list.0))
}

fn ordinates_at_most<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<f64>>, D::Error> {
    let list = Option::<AtMost<_, MAX_OFFSETS>>::deserialize(deserializer)?;
    Ok(list.map(|list| list.0))
}

/// Reads a JSON file.
pub(crate) fn read(file: &str, bytes: &[u8], given: Option<f64>) -> Result<PropellerFile, PropellerFileError> {
    let json: PropellerJson = from_json(bytes).map_err(|fault| PropellerFault::Json(fault).of(file))?;
    let missing = || PropellerFault::MissingKey("key \"diameter_mm\"; add it, or give --diameter-mm").of(file);
    let diameter = json.diameter_mm.or(given).ok_or_else(missing)?;
    if !(1.0..=20_000.0).contains(&diameter) {
        let fault = PropellerFault::OutOfRange { key: "diameter_mm", value: diameter, least: 1.0, most: 20_000.0 };
        return Err(fault.of(file));
    }
    let particulars = Particulars {
        name: json.name.as_deref().map(crate::fault::shown),
        diameter,
        n_blades: json.blades,
        hand: match json.hand {
            PropellerHand::Right => Hand::Right,
            PropellerHand::Left => Hand::Left,
        },
        hub_ratio: json.hub_diameter_mm / diameter,
        hub_length: json.hub_length_mm,
        sections: match json.section {
            PropellerSection::Naca66A08 => SectionForm::Naca66A08,
            PropellerSection::WageningenB => SectionForm::WageningenB,
            PropellerSection::Offsets => SectionForm::Offsets,
        },
    };
    let radial = radial_table(file, &json.rows)?;
    let sections = json.sections.as_deref().map(|sections| section_table(file, sections)).transpose()?;
    PropellerFile::of_tables(file, particulars, &radial, sections.as_ref())
}

fn radial_table(file: &str, rows: &[RadialRow]) -> Result<RawTable, PropellerFileError> {
    let mut table: Option<(RawTable, Vec<&str>)> = None;
    for (k, row) in rows.iter().enumerate() {
        let place = RowPlace::Json(format!("rows[{k}]"));
        let given: Vec<(&str, f64)> =
            row.cells().into_iter().filter_map(|(name, value)| Some((name, value?))).collect();
        let (names, values): (Vec<&str>, Vec<f64>) = given.into_iter().unzip();
        if table.is_none() {
            table = Some((RawTable::with_columns(file, &place, TableKind::Radial, &names)?, names.clone()));
        }
        if let Some((table, first)) = &mut table {
            if *first != names {
                return Err(PropellerFault::WrongTables(OTHER_KEYS).at(file, &place));
            }
            table.push(file, place, values)?;
        }
    }
    table.map(|(table, _)| table).ok_or_else(|| PropellerFault::WrongTables("has no rows; add them").of(file))
}

const OTHER_KEYS: &str = "has other keys than the first one; give all of them the same";

fn section_table(file: &str, sections: &[SectionRow]) -> Result<RawTable, PropellerFileError> {
    let mut table: Option<(RawTable, Vec<&str>)> = None;
    for (k, section) in sections.iter().enumerate() {
        let at = |station: usize| RowPlace::Json(format!("sections[{k}], station {station}"));
        let place = RowPlace::Json(format!("sections[{k}]"));
        let radius = [("r_R", section.r_over_radius), ("r_mm", section.r_mm)];
        let radius: Vec<(&str, f64)> = radius.into_iter().filter_map(|(name, r)| Some((name, r?))).collect();
        let lists: Vec<(&str, &Vec<f64>)> =
            section.lists().into_iter().filter_map(|(name, list)| Some((name, list?))).collect();
        let names: Vec<&str> = radius.iter().map(|(n, _)| *n).chain(lists.iter().map(|(n, _)| *n)).collect();
        if table.is_none() {
            table = Some((RawTable::with_columns(file, &place, TableKind::Sections, &names)?, names.clone()));
        }
        let Some((table, first)) = &mut table else { continue };
        if *first != names {
            return Err(PropellerFault::WrongTables(OTHER_KEYS).at(file, &place));
        }
        let n_stations = lists.first().map_or(0, |(_, list)| list.len());
        if let Some((name, list)) = lists.iter().find(|(_, list)| list.len() != n_stations) {
            let fault = PropellerFault::WrongLength { given: list.len(), expected: n_stations };
            return Err(fault.in_column(file, &place, name));
        }
        for station in 0..n_stations {
            let values = radius.iter().map(|(_, r)| *r).chain(lists.iter().map(|(_, list)| list[station]));
            table.push(file, at(station), values.collect())?;
        }
    }
    let empty = || PropellerFault::WrongTables("has no sections; add them").of(file);
    table.map(|(table, _)| table).ok_or_else(empty)
}

impl RadialRow {
    fn cells(&self) -> [(&'static str, Option<f64>); 17] {
        [
            ("r_R", self.r_over_radius),
            ("r_mm", self.r_mm),
            ("c_D", self.c_over_diameter),
            ("chord_mm", self.chord_mm),
            ("P_D", self.pitch_over_diameter),
            ("pitch_mm", self.pitch_mm),
            ("phi_deg", self.phi_deg),
            ("t_c", self.t_c),
            ("t_D", self.t_over_diameter),
            ("thickness_mm", self.thickness_mm),
            ("f_c", self.f_c),
            ("camber_mm", self.camber_mm),
            ("skew_deg", self.skew_deg),
            ("leading_edge_mm", self.leading_edge_mm),
            ("rake_D", self.rake_over_diameter),
            ("rake_R", self.rake_over_radius),
            ("rake_mm", self.rake_mm),
        ]
    }
}

impl SectionRow {
    fn lists(&self) -> [(&'static str, Option<&Vec<f64>>); 9] {
        [
            ("x_c", self.x_c.as_ref()),
            ("suction_c", self.suction_c.as_ref()),
            ("pressure_c", self.pressure_c.as_ref()),
            ("suction_mm", self.suction_mm.as_ref()),
            ("pressure_mm", self.pressure_mm.as_ref()),
            ("t_c", self.t_c.as_ref()),
            ("f_c", self.f_c.as_ref()),
            ("thickness_mm", self.thickness_mm.as_ref()),
            ("camber_mm", self.camber_mm.as_ref()),
        ]
    }
}
