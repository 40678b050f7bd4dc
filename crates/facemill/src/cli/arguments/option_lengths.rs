//! Lengths given by options: an error names the option, before any file is read.

use facemill::STOCK_TOLERANCES;
use facemill::new_job::ROTOR_SCALES;

/// Returns a length above 0, mm.
pub(crate) fn above_zero(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|mm: &f64| *mm > 0.0 && mm.is_finite());
    length.ok_or_else(|| "must be a length above 0 mm".to_owned())
}

/// Returns a length of 0 or more, mm.
pub(crate) fn from_zero(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|mm: &f64| *mm >= 0.0 && mm.is_finite());
    length.ok_or_else(|| "must be a length of at least 0 mm".to_owned())
}

/// Returns a tolerance for cutting stock, mm.
pub(crate) fn stock_tolerance(text: &str) -> Result<f64, String> {
    let tolerance = text.parse().ok().filter(|mm| STOCK_TOLERANCES.contains(mm));
    tolerance
        .ok_or_else(|| format!("must be a length from {} to {} mm", STOCK_TOLERANCES.start(), STOCK_TOLERANCES.end()))
}

/// Returns a scale of the example rotor.
pub(crate) fn rotor_scale(text: &str) -> Result<f64, String> {
    let scale = text.parse().ok().filter(|scale| ROTOR_SCALES.contains(scale));
    scale.ok_or_else(|| format!("must be a number from {} to {}", ROTOR_SCALES.start(), ROTOR_SCALES.end()))
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/arguments/option_lengths.rs"]
mod tests;
