//! Tables as they are written: named columns, and rows of numbers with their places.

use crate::columns::{ColumnForm, Quantity, TableKind, column_named, columns_of, nearest_column};
use crate::fault::{PropellerFault, PropellerFileError, RowPlace};

/// Most rows of a radial table.
pub const MAX_RADII: usize = 1000;

/// Most rows of a table of sections: sections times stations.
pub const MAX_OFFSETS: usize = 20_000;

/// Largest difference of two columns of the same quantity over its largest value: what three digits
/// leave.
const AGREEMENT: f64 = 2e-3;

/// A table of a file.
#[derive(Clone, Debug)]
pub(crate) struct RawTable {
    pub(crate) kind: TableKind,
    pub(crate) columns: Vec<RawColumn>,
    pub(crate) rows: Vec<(RowPlace, Vec<f64>)>,
}

/// A column of a table.
#[derive(Clone, Debug)]
pub(crate) struct RawColumn {
    pub(crate) name: String,
    pub(crate) quantity: Quantity,
    pub(crate) form: ColumnForm,
}

/// A quantity by row, in the unit that the caller converts to.
#[derive(Clone, Debug)]
pub(crate) struct QuantityValues {
    /// Column that the values are from.
    pub(crate) column: usize,
    pub(crate) form: ColumnForm,
    pub(crate) values: Vec<f64>,
}

impl RawTable {
    /// An empty table with these columns; `place` is that of the header.
    pub(crate) fn with_columns(
        file: &str,
        place: &RowPlace,
        kind: TableKind,
        names: &[&str],
    ) -> Result<Self, PropellerFileError> {
        let mut columns: Vec<RawColumn> = Vec::new();
        for &name in names {
            let Some((quantity, form)) = column_named(kind, name) else {
                let (nearest, known) = nearest_column(kind, name);
                let fault = PropellerFault::UnknownColumn { table: kind.name(), nearest, known };
                return Err(fault.in_column(file, place, name));
            };
            if columns.iter().any(|c| c.quantity == quantity && c.form.rank() == form.rank()) {
                return Err(PropellerFault::RepeatedColumn.in_column(file, place, name));
            }
            columns.push(RawColumn { name: name.trim().to_owned(), quantity, form });
        }
        Ok(Self { kind, columns, rows: Vec::new() })
    }

    /// Appends a row; all of its values are numbers.
    pub(crate) fn push(&mut self, file: &str, place: RowPlace, values: Vec<f64>) -> Result<(), PropellerFileError> {
        let most = match self.kind {
            TableKind::Radial => MAX_RADII,
            TableKind::Sections => MAX_OFFSETS,
        };
        if self.rows.len() >= most {
            return Err(PropellerFault::TooLong(most).at(file, &place));
        }
        self.rows.push((place, values));
        Ok(())
    }

    /// Values of a quantity from the preferred one of its columns, turned by `convert` (row, form,
    /// value) into one unit in which the others must agree with it. `None` without a column.
    pub(crate) fn quantity(
        &self,
        file: &str,
        quantity: Quantity,
        convert: impl Fn(usize, ColumnForm, f64) -> f64,
    ) -> Result<Option<QuantityValues>, PropellerFileError> {
        let mut of_quantity: Vec<usize> =
            (0..self.columns.len()).filter(|&k| self.columns[k].quantity == quantity).collect();
        of_quantity.sort_by_key(|&k| self.columns[k].form.rank());
        let mut taken: Option<QuantityValues> = None;
        for column in of_quantity {
            let RawColumn { name, form, .. } = &self.columns[column];
            let values: Vec<f64> =
                self.rows.iter().enumerate().map(|(row, (_, cells))| convert(row, *form, cells[column])).collect();
            let Some(first) = &taken else {
                if let Some(row) = values.iter().position(|v| !v.is_finite()) {
                    return Err(PropellerFault::OverNoChord.in_column(file, &self.rows[row].0, name));
                }
                taken = Some(QuantityValues { column, form: *form, values });
                continue;
            };
            let largest = first.values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            for (row, (&there, &here)) in first.values.iter().zip(&values).enumerate() {
                if here.is_finite() && (here - there).abs() > AGREEMENT * largest {
                    let other = format!("\"{}\"", self.columns[first.column].name);
                    let fault = PropellerFault::Disagreement { other, here, there };
                    return Err(fault.in_column(file, &self.rows[row].0, name));
                }
            }
        }
        Ok(taken)
    }

    /// [`Self::quantity`], refused if there is none.
    pub(crate) fn required(
        &self,
        file: &str,
        quantity: Quantity,
        convert: impl Fn(usize, ColumnForm, f64) -> f64,
    ) -> Result<QuantityValues, PropellerFileError> {
        self.quantity(file, quantity, convert)?.ok_or_else(|| {
            let columns = columns_of(self.kind, quantity);
            let fault = PropellerFault::MissingColumn { table: self.kind.name(), quantity: quantity.name(), columns };
            fault.of(file)
        })
    }

    /// Refuses columns of a quantity that the sections do not use.
    pub(crate) fn refuse(
        &self,
        file: &str,
        quantity: Quantity,
        sections: &'static str,
    ) -> Result<(), PropellerFileError> {
        match (self.columns.iter().find(|c| c.quantity == quantity), self.rows.first()) {
            (Some(column), Some((place, _))) => {
                Err(PropellerFault::UnusedColumn(sections).in_column(file, place, &column.name))
            }
            _ => Ok(()),
        }
    }
}
