use nalgebra::{Unit as Normalized, Vector3};
use roxmltree::Node;

use crate::import::{ImportError, wrong};

/// Quantity of a number with a unit behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Becomes mm.
    Length,
    /// Becomes deg.
    Angle,
    /// Becomes mm/min.
    LengthPerMinute,
    /// Becomes deg/min.
    AnglePerMinute,
}

impl Unit {
    /// Returns the known units and their size in ours.
    fn known(self) -> &'static [(&'static str, f64)] {
        const DEG: f64 = 180.0 / std::f64::consts::PI;
        match self {
            Self::Length => &[("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)],
            Self::Angle => &[("deg", 1.0), ("rad", DEG)],
            Self::LengthPerMinute => &[("mm/min", 1.0), ("in/min", 25.4), ("mm/s", 60.0)],
            Self::AnglePerMinute => {
                &[("deg/min", 1.0), ("deg/s", 60.0), ("rad/min", DEG), ("rad/s", 60.0 * DEG), ("rpm", 360.0)]
            }
        }
    }
}

/// Reads a number with its unit.
pub(crate) fn number(node: &Node<'_, '_>, attribute: &str, text: &str, unit: Unit) -> Result<f64, ImportError> {
    let text = text.trim();
    let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let end = text.find(|c| !is_number(c)).unwrap_or(text.len());
    let (digits, name) = text.split_at(end);
    let size = unit.known().iter().find(|(known, _)| *known == name.trim()).map(|(_, size)| size);
    let value = digits.parse::<f64>().ok().filter(|v| v.is_finite());
    value.zip(size).map(|(v, s)| v * s).ok_or_else(|| {
        let names: Vec<&str> = unit.known().iter().map(|(known, _)| *known).collect();
        wrong(node, format!("`{attribute}` has \"{text}\", which is no number with a unit of {}", names.join(", ")))
    })
}

/// Reads the requested number of values, with their units.
pub(crate) fn numbers<const N: usize>(
    node: &Node<'_, '_>,
    attribute: &str,
    unit: Unit,
) -> Result<[f64; N], ImportError> {
    let text = node.attribute(attribute).ok_or_else(|| wrong(node, format!("has no attribute `{attribute}`")))?;
    let words: Vec<&str> = text.split_whitespace().collect();
    let words: [&str; N] = words
        .try_into()
        .map_err(|w: Vec<&str>| wrong(node, format!("`{attribute}` has {} numbers, {N} are wanted", w.len())))?;
    let mut values = [0.0; N];
    for (value, word) in values.iter_mut().zip(words) {
        *value = number(node, attribute, word, unit)?;
    }
    Ok(values)
}

/// Reads a vector without a unit, of any length above 0.
pub(crate) fn direction(node: &Node<'_, '_>, attribute: &str) -> Result<Normalized<Vector3<f64>>, ImportError> {
    let text = node.attribute(attribute).ok_or_else(|| wrong(node, format!("has no attribute `{attribute}`")))?;
    let parts: Option<Vec<f64>> = text.split_whitespace().map(|w| w.parse().ok()).collect();
    let vector = parts.filter(|p| p.len() == 3).map(|p| Vector3::new(p[0], p[1], p[2]));
    vector
        .filter(|v| v.iter().all(|x| x.is_finite()))
        .and_then(|v| Normalized::try_new(v, 1e-6))
        .ok_or_else(|| wrong(node, format!("`{attribute}` is \"{text}\", which is no direction of three numbers")))
}
