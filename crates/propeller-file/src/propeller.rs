//! Propellers of files: tables and particulars together.

use std::f64::consts::PI;

use facemill_sample_parts::{
    Hand, OffsetUnit, PropellerSpec, PropellerTable, SectionOffsets, SpecError, TablePart, TableSections,
    TableThickness, skew_of_leading_edge,
};

use crate::columns::{ColumnForm, Quantity, TableKind};
use crate::fault::{PropellerFault, PropellerFileError, RowPlace};
use crate::raw_table::{QuantityValues, RawTable};

/// A propeller as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct PropellerFile {
    /// Name, if the file has one.
    pub name: Option<String>,
    /// Diameter D that the file gives, mm.
    pub diameter_mm: f64,
    /// The propeller over its diameter.
    pub table: PropellerTable,
    /// File in errors.
    file: String,
    /// Places of the rows of both tables.
    places: [Vec<RowPlace>; 2],
}

/// Section form that a file names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SectionForm {
    Naca66A08,
    WageningenB,
    Offsets,
}

impl SectionForm {
    /// Names in files, in the order of the forms.
    pub(crate) const NAMES: [(&'static str, Self); 3] =
        [("naca66_a08", Self::Naca66A08), ("wageningen_b", Self::WageningenB), ("offsets", Self::Offsets)];

    fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

/// Particulars of a file, beside its tables; lengths in mm.
#[derive(Clone, Debug)]
pub(crate) struct Particulars {
    pub(crate) name: Option<String>,
    pub(crate) diameter: f64,
    pub(crate) n_blades: u32,
    pub(crate) hand: Hand,
    pub(crate) hub_ratio: f64,
    pub(crate) hub_length: Option<f64>,
    pub(crate) sections: SectionForm,
}

impl PropellerFile {
    /// The propeller at a diameter, mm, or at the file's own.
    ///
    /// # Errors
    /// If the numbers of the tables are out of range or describe no blade
    /// ([`PropellerSpec::from_table`]); names the row.
    pub fn spec(&self, diameter_mm: Option<f64>) -> Result<PropellerSpec, PropellerFileError> {
        let diameter = diameter_mm.unwrap_or(self.diameter_mm);
        PropellerSpec::from_table(self.table.clone(), diameter).map_err(|fault| self.located(fault))
    }

    fn located(&self, fault: SpecError) -> PropellerFileError {
        let place = match &fault {
            SpecError::Table { part: TablePart::Radial, row, .. } => self.places[0].get(*row),
            SpecError::Table { part: TablePart::Sections, row, .. } => self.places[1].get(*row),
            _ => None,
        };
        let place = place.cloned();
        PropellerFileError { place, ..PropellerFault::Shape(fault).of(&self.file) }
    }

    /// Joins what a file says.
    pub(crate) fn of_tables(
        file: &str,
        particulars: Particulars,
        radial: &RawTable,
        sections: Option<&RawTable>,
    ) -> Result<Self, PropellerFileError> {
        let Particulars { name, diameter, n_blades, hand, hub_ratio, hub_length, sections: form } = particulars;
        match (form, sections) {
            (SectionForm::Offsets, None) => {
                let missing = "has no table of sections, which the sections \"offsets\" need; add one";
                return Err(PropellerFault::WrongTables(missing).of(file));
            }
            (SectionForm::Naca66A08 | SectionForm::WageningenB, Some(_)) => {
                let unused = "has a table of sections, but the sections are not \"offsets\"; remove one of them";
                return Err(PropellerFault::WrongTables(unused).of(file));
            }
            _ => {}
        }
        let columns = RadialColumns::read(file, radial, diameter)?;
        let sections_of_table = columns.sections(file, radial, sections, form, diameter)?;
        let table = PropellerTable {
            n_blades: n_blades as usize,
            hand,
            hub_ratio,
            hub_length_ratio: hub_length.map(|length| length / diameter),
            skew: columns.skew(file, radial, diameter)?,
            rake: columns.rake(file, radial, diameter)?,
            radii: columns.radii.values,
            chord: columns.chord.values,
            pitch: columns.pitch.values,
            sections: sections_of_table,
        };
        let places = |table: &RawTable| table.rows.iter().map(|(place, _)| place.clone()).collect();
        let places = [places(radial), sections.map(places).unwrap_or_default()];
        Ok(Self { name, diameter_mm: diameter, table, file: file.to_owned(), places })
    }
}

/// Radius, chord and pitch, over R and D, which the other quantities are measured by.
struct RadialColumns {
    radii: QuantityValues,
    chord: QuantityValues,
    pitch: QuantityValues,
}

/// r/R.
fn radius_ratio(form: ColumnForm, value: f64, diameter: f64) -> f64 {
    match form {
        ColumnForm::Length(mm) => 2.0 * (value * mm) / diameter,
        _ => value,
    }
}

impl RadialColumns {
    fn read(file: &str, table: &RawTable, diameter: f64) -> Result<Self, PropellerFileError> {
        let radii = table.required(file, Quantity::Radius, |_, form, v| radius_ratio(form, v, diameter))?;
        let over_diameter = |form: ColumnForm, value: f64| match form {
            ColumnForm::Length(mm) => value * mm / diameter,
            _ => value,
        };
        let chord = table.required(file, Quantity::Chord, |_, form, v| over_diameter(form, v))?;
        let pitch = table.required(file, Quantity::Pitch, |row, form, v| match form {
            ColumnForm::Degrees => PI * radii.values[row] * v.to_radians().tan(),
            _ => over_diameter(form, v),
        })?;
        Ok(Self { radii, chord, pitch })
    }

    /// Value of a quantity at a row in mm: as the file has it where it is a length.
    fn mm(table: &RawTable, values: &QuantityValues, row: usize, per_ratio: f64) -> f64 {
        match values.form {
            ColumnForm::Length(mm) => table.rows[row].1[values.column] * mm,
            _ => values.values[row] * per_ratio,
        }
    }

    fn skew(&self, file: &str, table: &RawTable, diameter: f64) -> Result<Vec<f64>, PropellerFileError> {
        let skew = table.quantity(file, Quantity::Skew, |row, form, v| match form {
            ColumnForm::Degrees => v.to_radians(),
            ColumnForm::LeadingEdge(mm) => {
                let radius = Self::mm(table, &self.radii, row, 0.5 * diameter);
                let chord = Self::mm(table, &self.chord, row, diameter);
                let pitch = Self::mm(table, &self.pitch, row, diameter);
                skew_of_leading_edge(radius, chord, pitch, v * mm)
            }
            _ => v,
        })?;
        Ok(skew.map_or_else(|| vec![0.0; table.rows.len()], |skew| skew.values))
    }

    fn rake(&self, file: &str, table: &RawTable, diameter: f64) -> Result<Vec<f64>, PropellerFileError> {
        let rake = table.quantity(file, Quantity::Rake, |_, form, v| match form {
            ColumnForm::Length(mm) => v * mm / diameter,
            ColumnForm::OverRadius => 0.5 * v,
            _ => v,
        })?;
        Ok(rake.map_or_else(|| vec![0.0; table.rows.len()], |rake| rake.values))
    }

    /// Largest thickness, in the ratio that the file has.
    fn thickness(&self, file: &str, table: &RawTable, diameter: f64) -> Result<TableThickness, PropellerFileError> {
        let thickness = table.required(file, Quantity::Thickness, |row, form, v| match form {
            ColumnForm::Length(mm) => v * mm / diameter,
            ColumnForm::OverChord => v * self.chord.values[row],
            _ => v,
        })?;
        Ok(match thickness.form {
            ColumnForm::OverChord => {
                TableThickness::OfChord(table.rows.iter().map(|(_, cells)| cells[thickness.column]).collect())
            }
            _ => TableThickness::OfDiameter(thickness.values),
        })
    }

    fn camber(&self, file: &str, table: &RawTable, diameter: f64) -> Result<Vec<f64>, PropellerFileError> {
        let camber = table.required(file, Quantity::Camber, |row, form, v| match form {
            ColumnForm::Length(mm) => v * mm / Self::mm(table, &self.chord, row, diameter),
            _ => v,
        })?;
        Ok(camber.values)
    }

    fn sections(
        &self,
        file: &str,
        radial: &RawTable,
        sections: Option<&RawTable>,
        form: SectionForm,
        diameter: f64,
    ) -> Result<TableSections, PropellerFileError> {
        match (form, sections) {
            (SectionForm::Offsets, Some(sections)) => {
                for quantity in [Quantity::Thickness, Quantity::Camber] {
                    radial.refuse(file, quantity, form.name())?;
                }
                Ok(TableSections::Offsets(offsets(file, sections, diameter)?))
            }
            (SectionForm::WageningenB, _) => {
                radial.refuse(file, Quantity::Camber, form.name())?;
                Ok(TableSections::WageningenB { thickness: self.thickness(file, radial, diameter)? })
            }
            _ => Ok(TableSections::Naca66A08 {
                thickness: self.thickness(file, radial, diameter)?,
                camber: self.camber(file, radial, diameter)?,
            }),
        }
    }
}

/// Sections by their ordinates.
fn offsets(file: &str, table: &RawTable, diameter: f64) -> Result<SectionOffsets, PropellerFileError> {
    debug_assert_eq!(table.kind, TableKind::Sections);
    let radii = table.required(file, Quantity::Radius, |_, form, v| radius_ratio(form, v, diameter))?.values;
    let stations = table.required(file, Quantity::Station, |_, _, v| v)?.values;
    let height = |form: ColumnForm, v: f64| match form {
        ColumnForm::Length(mm) => v * mm / diameter,
        _ => v,
    };
    let has_sides = table.columns.iter().any(|c| matches!(c.quantity, Quantity::Suction | Quantity::Pressure));
    let (first, second) = if has_sides {
        let thickness = [Quantity::Thickness, Quantity::Camber];
        thickness.into_iter().try_for_each(|quantity| table.refuse(file, quantity, "both sides"))?;
        (Quantity::Suction, Quantity::Pressure)
    } else {
        (Quantity::Camber, Quantity::Thickness)
    };
    let [first, second] = [first, second].map(|quantity| table.required(file, quantity, |_, form, v| height(form, v)));
    let (first, second) = (first?, second?);
    if first.form.rank() != second.form.rank() {
        let mixed = "has one ordinate as a length and the other over the chord; give both alike";
        return Err(PropellerFault::WrongTables(mixed).of(file));
    }
    let sides: Vec<[f64; 2]> = first
        .values
        .iter()
        .zip(&second.values)
        .map(|(&a, &b)| if has_sides { [a, b] } else { [a + 0.5 * b, a - 0.5 * b] })
        .collect();
    let unit = if first.form == ColumnForm::OverChord { OffsetUnit::Chord } else { OffsetUnit::Diameter };
    // Of a file without rows, 0.
    let grows = |k: &usize| *k == 0 || radii[*k] == radii[0] && stations[*k] > stations[*k - 1];
    let n_stations = (0..radii.len()).take_while(grows).count();
    if n_stations == 0 {
        return Err(PropellerFault::WrongTables("has a table of sections without rows; add them").of(file));
    }
    check_stations(file, table, &radii, &stations, n_stations)?;
    let rows = |side: usize| {
        sides.chunks(n_stations).map(|section| section.iter().map(|heights| heights[side]).collect()).collect()
    };
    Ok(SectionOffsets {
        radii: radii.iter().copied().step_by(n_stations).collect(),
        stations: stations[..n_stations].to_vec(),
        suction: rows(0),
        pressure: rows(1),
        unit,
    })
}

/// Refuses sections that have other stations than the first one.
fn check_stations(
    file: &str,
    table: &RawTable,
    radii: &[f64],
    stations: &[f64],
    n_stations: usize,
) -> Result<(), PropellerFileError> {
    let describe = |row: usize| match radii.get(row) {
        Some(radius) => format!("x/c {} at r/R {radius}", stations[row]),
        None => "its end".to_owned(),
    };
    for row in n_stations..radii.len().next_multiple_of(n_stations) {
        let (section, station) = (row / n_stations * n_stations, row % n_stations);
        let place = &table.rows[row.min(radii.len() - 1)].0;
        if station == 0 && radii[row] == radii[row - 1] {
            let neither = "is neither a further station nor a new section; order stations by x/c and sections by r/R";
            return Err(PropellerFault::WrongTables(neither).at(file, place));
        }
        let belongs = row < radii.len() && radii[row] == radii[section] && stations[row] == stations[station];
        if !belongs {
            let expected = format!("x/c {}", stations[station]);
            return Err(PropellerFault::UnequalStations(describe(row), expected).at(file, place));
        }
    }
    Ok(())
}
