//! Faults of a part's description.

/// Why numbers do not describe a part.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// A number is outside its range, or not a number.
    #[error("{field} is {value}, but must be between {least} and {most}")]
    OutOfRange {
        /// The field, in words of the specification.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Greatest value allowed.
        most: f64,
    },
    /// The mesh would need more rows or columns than [`crate::BladeResolution`] allows.
    #[error("a chord tolerance of {tolerance} mm needs more than {most} rows or columns")]
    TooFine {
        /// Requested tolerance, mm.
        tolerance: f64,
        /// Most rows or columns.
        most: usize,
    },
}

/// `value` when it is within `least..=most`.
pub(crate) fn in_range(field: &'static str, value: f64, least: f64, most: f64) -> Result<f64, SpecError> {
    if value >= least && value <= most { Ok(value) } else { Err(SpecError::OutOfRange { field, value, least, most }) }
}
