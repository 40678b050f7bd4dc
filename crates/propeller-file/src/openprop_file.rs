//! Geometry tables that OpenProp writes (`NAME_Geometry.txt`).

use facemill_sample_parts::Hand;

use crate::columns::TableKind;
use crate::fault::{PropellerFault, PropellerFileError, RowPlace, shown};
use crate::propeller::{Particulars, PropellerFile, SectionForm};
use crate::raw_table::RawTable;
use crate::text::{number, text_of};

/// Title of the table, within the first lines.
const TITLE: &str = "Propeller Geometry Table";

/// Lines that the title is among.
const TITLE_LINES: usize = 10;

/// Columns of OpenProp, and the ones of a radial table that they are.
const COLUMNS: [(&str, &str); 8] = [
    ("r/R", "r_R"),
    ("c/D", "c_D"),
    ("t0/c", "t_c"),
    ("f0/c", "f_c"),
    ("P/D", "P_D"),
    ("pitch", "phi_deg"),
    ("skew", "skew_deg"),
    ("rake/D", "rake_D"),
];
const CHORD: usize = 1;
const THICKNESS: usize = 2;
const RAKE: usize = 7;

/// Names of the section form that both programs have.
const MEAN_LINE: &str = "NACA a=0.8";
const THICKNESS_FORMS: [&str; 2] = ["NACA 66 (DTRC modified)", "NACA66 (DTRC modified)"];

/// Returns whether a file is such a table.
pub(crate) fn is_openprop(bytes: &[u8]) -> bool {
    let lines = bytes.split(|&b| b == b'\n').take(TITLE_LINES);
    lines.into_iter().any(|line| String::from_utf8_lossy(line).trim() == TITLE)
}

/// Values of the lines above the table, each with its line.
#[derive(Default)]
struct HeaderLines<'t> {
    diameter: Option<(&'t str, usize)>,
    blades: Option<(&'t str, usize)>,
    hub: Option<(&'t str, usize)>,
    mean_line: Option<(&'t str, usize)>,
    thickness: Option<(&'t str, usize)>,
}

/// Reads a table.
pub(crate) fn read(file: &str, bytes: &[u8]) -> Result<PropellerFile, PropellerFileError> {
    let mut header = HeaderLines::default();
    let mut lines = text_of(file, bytes)?.lines().enumerate().map(|(k, text)| (k + 1, text));
    for (line, text) in lines.by_ref() {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.first() == Some(&COLUMNS[0].0) {
            if !words.iter().eq(COLUMNS.iter().map(|(name, _)| name)) {
                let other = "is no header of OpenProp 3, which is r/R, c/D, t0/c, f0/c, P/D, pitch, skew, rake/D; write \
                             the table as CSV";
                return Err(PropellerFault::WrongTables(other).at(file, &RowPlace::Text(line)));
            }
            break;
        }
        header.take(text, line);
    }
    let particulars = header.particulars(file)?;
    let rows = rows(file, lines)?;
    let names = COLUMNS.map(|(_, name)| if name == "t_c" { "t_D" } else { name });
    let mut table = RawTable::with_columns(file, &RowPlace::Text(1), TableKind::Radial, &names)?;
    for (place, values) in rows {
        table.push(file, place, values.to_vec())?;
    }
    PropellerFile::of_tables(file, particulars, &table, None)
}

/// Rows of the table: thickness over D, and rake negative aft.
fn rows<'t>(
    file: &str,
    lines: impl Iterator<Item = (usize, &'t str)>,
) -> Result<Vec<(RowPlace, [f64; 8])>, PropellerFileError> {
    let mut rows: Vec<(RowPlace, [f64; 8])> = Vec::new();
    // The line of units comes first.
    for (line, text) in lines.skip(1) {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.is_empty() {
            break;
        }
        let place = RowPlace::Text(line);
        if words.len() != COLUMNS.len() {
            let fault = PropellerFault::WrongLength { given: words.len(), expected: COLUMNS.len() };
            return Err(fault.at(file, &place));
        }
        let mut values = [0.0; 8];
        for (k, word) in words.iter().enumerate() {
            let has_no_chord = k == THICKNESS && values[CHORD] == 0.0;
            values[k] = match number(word) {
                Some(value) => value,
                // Thickness over no chord: OpenProp writes whatever the division gave.
                None if has_no_chord => 0.0,
                None => return Err(PropellerFault::NoNumber(shown(word)).in_column(file, &place, COLUMNS[k].0)),
            };
        }
        values[THICKNESS] =
            if values[CHORD] == 0.0 { tip_thickness(&rows, values[0]) } else { values[THICKNESS] * values[CHORD] };
        // OpenProp's rake is positive aft, and -0 must not reach the mesh.
        values[RAKE] = 0.0 - values[RAKE];
        rows.push((place, values));
    }
    Ok(rows)
}

/// Thickness over D at a radius, on the line through the last two rows.
fn tip_thickness(rows: &[(RowPlace, [f64; 8])], radius: f64) -> f64 {
    let [.., (_, before), (_, last)] = rows else { return 0.0 };
    let slope = (last[THICKNESS] - before[THICKNESS]) / (last[0] - before[0]);
    last[THICKNESS] + slope * (radius - last[0])
}

impl<'t> HeaderLines<'t> {
    fn take(&mut self, text: &'t str, line: usize) {
        let Some((key, value)) = text.split_once(['=', ':']) else { return };
        let key = key.split_whitespace().collect::<Vec<_>>().join(" ");
        // "Meanline  Type: NACA a=0.8" has its colon first.
        let slot = match key.as_str() {
            "Propeller Diameter" => &mut self.diameter,
            "Number of Blades" => &mut self.blades,
            "Propeller Hub Diameter" => &mut self.hub,
            "Meanline Type" => &mut self.mean_line,
            "Thickness Type" => &mut self.thickness,
            _ => return,
        };
        *slot = Some((value.trim(), line));
    }

    fn particulars(&self, file: &str) -> Result<Particulars, PropellerFileError> {
        let missing = |line: &'static str| PropellerFault::MissingKey(line).of(file);
        let diameter = self.diameter.ok_or_else(|| missing("line \"Propeller Diameter = … m\""))?;
        let hub = self.hub.ok_or_else(|| missing("line \"Propeller Hub Diameter = … m\""))?;
        let (blades, line) = self.blades.ok_or_else(|| missing("line \"Number of Blades = …\""))?;
        let n_blades = blades.parse().ok().filter(|n| (2..=12).contains(n)).ok_or_else(|| {
            let fault =
                PropellerFault::UnknownValue { key: "Number of Blades", value: shown(blades), known: "2 to 12" };
            fault.at(file, &RowPlace::Text(line))
        })?;
        let diameter = metres(file, "Propeller Diameter in mm", diameter)?;
        let hub = metres(file, "Propeller Hub Diameter in mm", hub)?;
        let mean_line = self.mean_line.ok_or_else(|| missing("line \"Meanline Type: …\""))?;
        let thickness = self.thickness.ok_or_else(|| missing("line \"Thickness Type: …\""))?;
        known_form(file, "Meanline Type", mean_line, &[MEAN_LINE], "NACA a=0.8, or give the ordinates as CSV")?;
        let known = "NACA 66 (DTRC modified), or give the ordinates as CSV";
        known_form(file, "Thickness Type", thickness, &THICKNESS_FORMS, known)?;
        Ok(Particulars {
            name: None,
            diameter,
            n_blades,
            hand: Hand::Right,
            hub_ratio: hub / diameter,
            hub_length: None,
            sections: SectionForm::Naca66A08,
        })
    }
}

/// A length such as `0.3500 m`, in mm.
fn metres(file: &str, key: &'static str, (text, line): (&str, usize)) -> Result<f64, PropellerFileError> {
    let place = RowPlace::Text(line);
    let given = text.strip_suffix('m').map(str::trim).and_then(number);
    let value = 1000.0 * given.ok_or_else(|| PropellerFault::NoNumber(shown(text)).at(file, &place))?;
    let [least, most] = [1.0, 20_000.0];
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(PropellerFault::OutOfRange { key, value, least, most }.at(file, &place))
}

/// Refuses section forms of OpenProp that are not among known ones; names of cell arrays, one per
/// radius, end in commas.
fn known_form(
    file: &str,
    key: &'static str,
    (value, line): (&str, usize),
    forms: &[&str],
    known: &'static str,
) -> Result<(), PropellerFileError> {
    let mut given = value.split(',').map(str::trim).filter(|name| !name.is_empty()).peekable();
    let is_known = given.peek().is_some() && given.all(|name| forms.iter().any(|f| f.eq_ignore_ascii_case(name)));
    if is_known {
        return Ok(());
    }
    let fault = PropellerFault::UnknownValue { key, value: shown(value), known };
    Err(fault.at(file, &RowPlace::Text(line)))
}
