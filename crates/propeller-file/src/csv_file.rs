//! Tables as CSV: comment lines with particulars, a header, rows.

use facemill_sample_parts::Hand;

use crate::columns::{TableKind, UNITS, column_named};
use crate::fault::{PropellerFault, PropellerFileError, RowPlace, shown};
use crate::propeller::{Particulars, PropellerFile, SectionForm};
use crate::raw_table::{RawColumn, RawTable};
use crate::text::{number, text_of};

/// Keys of comment lines that have no unit.
const KEYS: [&str; 5] = ["name", "blades", "hand", "hub_ratio", "section"];

/// Keys of comment lines that end in a unit.
const LENGTH_KEYS: [&str; 3] = ["diameter", "hub_diameter", "hub_length"];

/// Names of the hands.
pub(crate) const HANDS: [(&str, Hand); 2] = [("right", Hand::Right), ("left", Hand::Left)];

/// Fault of a text whose first line has no name of a column.
const NO_TABLE: &str = "is no table of a propeller: its first line has no name of a column; write a header line such as \
                        r_R,c_D,P_D,t_c,f_c,skew_deg,rake_D above the rows";

/// Values of the keys, each with its line.
#[derive(Default)]
struct CommentKeys<'t> {
    words: [Option<(&'t str, usize)>; KEYS.len()],
    lengths: [Option<(f64, usize)>; LENGTH_KEYS.len()],
}

/// Reads a CSV file; `given` is the diameter of one that has none, mm.
pub(crate) fn read(file: &str, bytes: &[u8], given: Option<f64>) -> Result<PropellerFile, PropellerFileError> {
    let mut keys = CommentKeys::default();
    let mut tables: Vec<RawTable> = Vec::new();
    let mut separator = None;
    for (k, text) in text_of(file, bytes)?.lines().enumerate() {
        let (text, place) = (text.trim(), RowPlace::Text(k + 1));
        if let Some(comment) = text.strip_prefix('#') {
            keys.take(file, comment, k + 1)?;
            continue;
        } else if text.is_empty() {
            continue;
        }
        let separator = *separator.get_or_insert_with(|| separator_of(text));
        let cells = cells_of(text, separator);
        let is_header = cells.iter().all(|cell| cell.parse::<f64>().is_err());
        match tables.last_mut() {
            Some(table) if !is_header => {
                let row = row_of(file, &place, table, &cells)?;
                table.push(file, place, row)?;
            }
            None if !is_header => {
                let missing = "begins with numbers; write a header line with the names of the columns above them";
                return Err(PropellerFault::WrongTables(missing).at(file, &place));
            }
            _ => {
                let has_stations = cells.iter().any(|cell| {
                    let name = cell.replace('/', "_");
                    name.eq_ignore_ascii_case("x_c") && column_named(TableKind::Sections, cell).is_some()
                });
                let kind = if has_stations { TableKind::Sections } else { TableKind::Radial };
                let is_column = |cell: &&str| column_named(kind, cell).is_some();
                if tables.is_empty() && !cells.iter().any(is_column) {
                    return Err(PropellerFault::WrongTables(NO_TABLE).at(file, &place));
                }
                let table = RawTable::with_columns(file, &place, kind, &cells)?;
                if tables.iter().any(|before| before.kind == kind) {
                    let twice = "is a second header of the same kind; keep one table of radii and one of sections";
                    return Err(PropellerFault::WrongTables(twice).at(file, &place));
                }
                tables.push(table);
            }
        }
    }
    let find = |kind: TableKind| tables.iter().find(|table| table.kind == kind);
    let radial = find(TableKind::Radial).ok_or_else(|| {
        let missing = "has no radial table; write a header line such as r_R,c_D,P_D,t_c,f_c,skew_deg,rake_D and rows";
        PropellerFault::WrongTables(missing).of(file)
    })?;
    let sections = find(TableKind::Sections);
    PropellerFile::of_tables(file, keys.particulars(file, sections.is_some(), given)?, radial, sections)
}

fn separator_of(header: &str) -> Option<char> {
    [';', ',', '\t'].into_iter().find(|c| header.contains(*c))
}

/// Cells of a line without blanks and quotes; without a separator blanks separate.
fn cells_of(text: &str, separator: Option<char>) -> Vec<&str> {
    match separator {
        Some(separator) => text.split(separator).map(clean).collect(),
        None => text.split_whitespace().map(clean).collect(),
    }
}

fn clean(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

fn row_of(file: &str, place: &RowPlace, table: &RawTable, cells: &[&str]) -> Result<Vec<f64>, PropellerFileError> {
    if cells.len() != table.columns.len() {
        let fault = PropellerFault::WrongLength { given: cells.len(), expected: table.columns.len() };
        return Err(fault.at(file, place));
    }
    let value = |(cell, column): (&&str, &RawColumn)| {
        number(cell).ok_or_else(|| PropellerFault::NoNumber(shown(cell)).in_column(file, place, &column.name))
    };
    cells.iter().zip(&table.columns).map(value).collect()
}

impl<'t> CommentKeys<'t> {
    /// Takes `key: value`; other comments are none of its business, unless their key is nearly a
    /// known one.
    fn take(&mut self, file: &str, comment: &'t str, line: usize) -> Result<(), PropellerFileError> {
        let Some((key, value)) = comment.split_once(':') else { return Ok(()) };
        let (key, value, place) = (key.trim(), value.trim(), RowPlace::Text(line));
        let repeated = || PropellerFault::RepeatedKey(shown(key)).at(file, &place);
        if let Some(known) = KEYS.iter().position(|known| *known == key) {
            let before = self.words[known].replace((value, line));
            return if before.is_some() { Err(repeated()) } else { Ok(()) };
        }
        let length = key.rsplit_once('_').and_then(|(base, unit)| {
            let mm = UNITS.iter().find(|(known, _)| *known == unit)?.1;
            Some((LENGTH_KEYS.iter().position(|known| *known == base)?, mm))
        });
        if let Some((known, mm)) = length {
            let given = number(value).ok_or_else(|| PropellerFault::NoNumber(shown(value)).at(file, &place))?;
            let before = self.lengths[known].replace((given * mm, line));
            return if before.is_some() { Err(repeated()) } else { Ok(()) };
        }
        let with_units = ["diameter_mm", "hub_diameter_mm", "hub_length_mm"];
        let distance = |known: &&'static str| strsim::damerau_levenshtein(known, key);
        match KEYS.into_iter().chain(with_units).min_by_key(distance) {
            // A slip away from a key, or two in a longer word: two turn "date" into "name".
            Some(nearest) => {
                let most = match key.chars().count() {
                    0..=3 => 0,
                    4..=5 => 1,
                    _ => 2,
                };
                if distance(&nearest) > most {
                    return Ok(());
                }
                Err(PropellerFault::UnknownKey { key: shown(key), nearest }.at(file, &place))
            }
            None => Ok(()),
        }
    }

    fn particulars(
        &self,
        file: &str,
        has_sections: bool,
        given: Option<f64>,
    ) -> Result<Particulars, PropellerFileError> {
        let missing = |line: &'static str| PropellerFault::MissingKey(line).of(file);
        let [name, blades, hand, hub_ratio, section] = self.words;
        let [diameter, hub_diameter, hub_length] = self.lengths;
        let place = diameter.map(|(_, line)| RowPlace::Text(line));
        let diameter = diameter.map(|(diameter, _)| diameter).or(given);
        let diameter = diameter.ok_or_else(|| missing("line \"# diameter_mm: …\"; add it, or give --diameter-mm"))?;
        let [least, most] = [1.0, 20_000.0];
        if !(least..=most).contains(&diameter) {
            let fault = PropellerFault::OutOfRange { key: "diameter in mm", value: diameter, least, most };
            return Err(PropellerFileError { place, ..fault.of(file) });
        }
        let (blades, line) = blades.ok_or_else(|| missing("line \"# blades: …\"; add it"))?;
        let n_blades = blades.parse().ok().filter(|n| (2..=12).contains(n)).ok_or_else(|| {
            let fault = PropellerFault::UnknownValue { key: "blades", value: shown(blades), known: "2 to 12" };
            fault.at(file, &RowPlace::Text(line))
        })?;
        let hand = hand.ok_or_else(|| missing("line \"# hand: right\" or \"# hand: left\"; add it"))?;
        let hand = one_of(file, "hand", hand, &HANDS, "right, left")?;
        let hub_ratio = match (hub_ratio, hub_diameter) {
            (Some((_, line)), Some(_)) => {
                let twice = PropellerFault::RepeatedKey("hub_diameter and hub_ratio".to_owned());
                return Err(twice.at(file, &RowPlace::Text(line)));
            }
            (Some((value, line)), None) => {
                number(value).ok_or_else(|| PropellerFault::NoNumber(shown(value)).at(file, &RowPlace::Text(line)))?
            }
            (None, Some((hub, _))) => hub / diameter,
            (None, None) => return Err(missing("line \"# hub_diameter_mm: …\" or \"# hub_ratio: …\"; add one")),
        };
        let known = "naca66_a08, wageningen_b, offsets";
        let sections = match section {
            Some(section) => one_of(file, "section", section, &SectionForm::NAMES, known)?,
            None if has_sections => SectionForm::Offsets,
            None => return Err(missing("line \"# section: …\" with naca66_a08, wageningen_b or offsets; add it")),
        };
        Ok(Particulars {
            name: name.map(|(name, _)| shown(name)),
            diameter,
            n_blades,
            hand,
            hub_ratio,
            hub_length: hub_length.map(|(length, _)| length),
            sections,
        })
    }
}

/// The value of a word among known ones, in any case.
pub(crate) fn one_of<T: Copy>(
    file: &str,
    key: &'static str,
    (value, line): (&str, usize),
    values: &[(&str, T)],
    known: &'static str,
) -> Result<T, PropellerFileError> {
    let found = values.iter().find(|(name, _)| name.eq_ignore_ascii_case(value));
    found.map(|(_, value)| *value).ok_or_else(|| {
        let fault = PropellerFault::UnknownValue { key, value: shown(value), known };
        fault.at(file, &RowPlace::Text(line))
    })
}
