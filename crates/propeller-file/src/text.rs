//! Lines and numbers of text files.

use crate::fault::{PropellerFault, PropellerFileError};

/// Text of a file, without the mark of its byte order.
pub(crate) fn text_of<'t>(file: &str, bytes: &'t [u8]) -> Result<&'t str, PropellerFileError> {
    let text = std::str::from_utf8(bytes).map_err(|_| PropellerFault::NoText.of(file))?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// A finite number.
pub(crate) fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}
