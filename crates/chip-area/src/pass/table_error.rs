use crate::pass::error::PassError;

/// Reason why a table of cases has no areas: line (from 1, the header and comments counted),
/// column, and remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// There is no line with the names of the columns.
    #[error("the table is empty: begin with a line of column names, such as {known}")]
    NoHeader {
        /// The names that are required.
        known: String,
    },
    /// There is no line below the names of the columns.
    #[error("the table has no case: add a line of values below the names of the columns in line {line}")]
    NoCase {
        /// Line of the header.
        line: usize,
    },
    /// A column has an unknown name.
    #[error("line {line}: there is no column {column:?}; the columns are {known}, and name for a text of your own")]
    UnknownColumn {
        /// Line of the header.
        line: usize,
        /// Its name.
        column: String,
        /// All names.
        known: String,
    },
    /// Two columns have the same name.
    #[error("line {line}: the column {column} is there twice: keep one")]
    RepeatedColumn {
        /// Line of the header.
        line: usize,
        /// Its name.
        column: &'static str,
    },
    /// A required column is missing.
    #[error("line {line}: the column {column} is missing: add it")]
    MissingColumn {
        /// Line of the header.
        line: usize,
        /// Its name.
        column: &'static str,
    },
    /// A line has more or fewer cells than the header.
    #[error(
        "line {line} has {found} cells, the header {expected}: separate cells by commas, use a decimal point, and leave a \
         cell empty where there is no value"
    )]
    CellCount {
        /// The line.
        line: usize,
        /// Cells of the header.
        expected: usize,
        /// Cells of the line.
        found: usize,
    },
    /// A quotation mark has no partner, or there is text beside quoted text.
    #[error("line {line}: quotation marks must enclose a whole cell, and stand twice inside one")]
    Quotes {
        /// The line.
        line: usize,
    },
    /// A cell is not a number.
    #[error("line {line}, column {column}: {text:?} is no number: write it like 12.5")]
    NotANumber {
        /// The line.
        line: usize,
        /// The column.
        column: &'static str,
        /// Text there.
        text: String,
    },
    /// A cell has an unknown word.
    #[error("line {line}, column {column}: {text:?} is none of {known}")]
    UnknownWord {
        /// The line.
        line: usize,
        /// The column.
        column: &'static str,
        /// Text there.
        text: String,
        /// Permitted texts.
        known: &'static str,
    },
    /// A cell is empty that needs a value.
    #[error("line {line}, column {column}: empty, but {reason}: give a value")]
    Empty {
        /// The line.
        line: usize,
        /// The column.
        column: &'static str,
        /// Reason why it needs one.
        reason: &'static str,
    },
    /// A cell has a value that would be ignored.
    #[error("line {line}, column {column}: {text:?}, but {reason}: leave it empty")]
    NotUsed {
        /// The line.
        line: usize,
        /// The column.
        column: &'static str,
        /// Text there.
        text: String,
        /// Reason why it must be empty.
        reason: &'static str,
    },
    /// The case has no chip area.
    #[error("line {line}{}: {source}", column.map(|c| format!(", column {c}")).unwrap_or_default())]
    Section {
        /// The line.
        line: usize,
        /// The column at fault, if there is one.
        column: Option<&'static str>,
        /// Reason.
        source: PassError,
    },
}

impl TableError {
    /// Returns the column at fault, if there is one.
    #[must_use]
    pub fn column(&self) -> Option<&'static str> {
        match *self {
            Self::RepeatedColumn { column, .. }
            | Self::MissingColumn { column, .. }
            | Self::NotANumber { column, .. }
            | Self::UnknownWord { column, .. }
            | Self::Empty { column, .. }
            | Self::NotUsed { column, .. } => Some(column),
            Self::Section { column, .. } => column,
            Self::NoHeader { .. }
            | Self::NoCase { .. }
            | Self::UnknownColumn { .. }
            | Self::CellCount { .. }
            | Self::Quotes { .. } => None,
        }
    }

    /// Returns the fault without line and column: for a case outside of a table.
    #[must_use]
    pub fn problem(&self) -> String {
        let text = self.to_string();
        let place = self.column().map(|column| format!(", column {column}: ")).unwrap_or_else(|| ": ".to_owned());
        let is_line = |start: &str| start.strip_prefix("line ").is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()));
        match text.split_once(&place) {
            Some((start, problem)) if is_line(start) => problem.to_owned(),
            _ => text,
        }
    }
}
