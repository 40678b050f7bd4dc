//! Faults with file, row and column.

use std::fmt;

use facemill_file_format::FormatError;
use facemill_sample_parts::SpecError;

/// Where a row of a table is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// Line of a text, from 1.
    Text(usize),
    /// Element of a JSON file, such as `rows[3]`.
    Json(String),
}

impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(line) => write!(f, "line {line}"),
            Self::Json(path) => f.write_str(path),
        }
    }
}

/// Why a file describes no propeller: the fault, and where it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{file}{}{}: {fault}",
    .place.as_ref().map(|place| format!(", {place}")).unwrap_or_default(),
    .column.as_ref().map(|column| format!(", column {column}")).unwrap_or_default()
)]
pub struct PropellerFileError {
    /// File, as the caller named it.
    pub file: String,
    /// Row, if the fault is at one.
    pub place: Option<RowPlace>,
    /// Column as the file names it, if the fault is in one.
    pub column: Option<String>,
    /// The fault.
    pub fault: Box<PropellerFault>,
}

/// Fault of a propeller file, with the remedy in its text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PropellerFault {
    /// Bytes that are no text.
    #[error("is not text in UTF-8; export it as text")]
    NoText,
    /// JSON that is not of the format.
    #[error("{0}")]
    Json(FormatError),
    /// A key that must be there is missing.
    #[error("has no {0}")]
    MissingKey(&'static str),
    /// A key is there twice, or in two units.
    #[error("\"{0}\" is given twice; keep one")]
    RepeatedKey(String),
    /// A key that is nearly a known one.
    #[error("key \"{key}\" is unknown; did you mean \"{nearest}\"?")]
    UnknownKey {
        /// The key.
        key: String,
        /// Known key nearest to it.
        nearest: &'static str,
    },
    /// A value that is not among those known.
    #[error("{key} is \"{value}\"; write one of {known}")]
    UnknownValue {
        /// The key.
        key: &'static str,
        /// Its value.
        value: String,
        /// Values that are read.
        known: &'static str,
    },
    /// A value that is no number, or not finite.
    #[error("\"{0}\" is no number; write one with a decimal point")]
    NoNumber(String),
    /// A number out of its range.
    #[error("{key} is {value}; it lies between {least} and {most}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Least value.
        least: f64,
        /// Greatest value.
        most: f64,
    },
    /// A column name that is not known.
    #[error("is no column of the {table}; did you mean \"{nearest}\"? Known are {known}")]
    UnknownColumn {
        /// The table.
        table: &'static str,
        /// Known column nearest to it.
        nearest: &'static str,
        /// Known columns.
        known: String,
    },
    /// A column is there twice.
    #[error("is there twice; remove one")]
    RepeatedColumn,
    /// No column has a quantity that the sections need.
    #[error("the {table} has no column of the {quantity}; add one of {columns}")]
    MissingColumn {
        /// The table.
        table: &'static str,
        /// The quantity.
        quantity: &'static str,
        /// Columns that have it.
        columns: String,
    },
    /// A column has a quantity that the sections do not use.
    #[error("is not used with the sections \"{0}\"; remove the column, or name other sections")]
    UnusedColumn(&'static str),
    /// A row has another number of values than the header.
    #[error("has {given} values for {expected} columns; correct the row")]
    WrongLength {
        /// Values of the row.
        given: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// Two columns have the same quantity with different values.
    #[error("disagrees with column {other}: {here} against {there} in the same unit; correct one of them")]
    Disagreement {
        /// The other column.
        other: String,
        /// Value here.
        here: f64,
        /// Value there.
        there: f64,
    },
    /// A quantity over the chord where the chord is 0.
    #[error("has a length where the chord is 0; give it over the chord")]
    OverNoChord,
    /// A section whose stations are not those of the first one.
    #[error("has {0} where the first section has {1}; give all sections the same stations x/c")]
    UnequalStations(String, String),
    /// More rows than are read.
    #[error("has more than {0} rows; thin them out")]
    TooLong(usize),
    /// A table is missing or there twice.
    #[error("{0}")]
    WrongTables(&'static str),
    /// Numbers that describe no blade.
    #[error("{0}")]
    Shape(SpecError),
}

impl PropellerFault {
    /// The fault of a whole file.
    pub(crate) fn of(self, file: &str) -> PropellerFileError {
        PropellerFileError { file: file.to_owned(), place: None, column: None, fault: Box::new(self) }
    }

    /// The fault of a row.
    pub(crate) fn at(self, file: &str, place: &RowPlace) -> PropellerFileError {
        PropellerFileError { place: Some(place.clone()), ..self.of(file) }
    }

    /// The fault of a value.
    pub(crate) fn in_column(self, file: &str, place: &RowPlace, column: &str) -> PropellerFileError {
        PropellerFileError { column: Some(format!("\"{}\"", shown(column))), ..self.at(file, place) }
    }
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
