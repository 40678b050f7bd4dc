//! Arcs as CAM systems write them.

use nalgebra::{Point3, Unit, Vector3};

use crate::apt_file::AptArc;
use crate::statement::{RawStatement, parse};
use facemill_nc_program::read::{ReadError, ReadFault};

/// Length below which a direction is none.
const NO_LENGTH: f64 = 1e-9;

/// Returns the arc of CIRCLE or MOVARC: centre, axis and, where they are given, radius and angle.
/// Words between the numbers (CENTER, AXIS, RADIUS) are left out. `None` for another form, as that
/// of a circle by its name.
///
/// # Errors
/// If a number is none, or the axis has length zero.
pub(crate) fn circle(raw: &RawStatement, values: &[(usize, &str)], unit: f64) -> Result<Option<AptArc>, ReadError> {
    let mut numbers: Vec<f64> = Vec::new();
    let mut angle = None;
    let mut values = values.iter();
    while let Some(&(at, value)) = values.next() {
        if value.eq_ignore_ascii_case("ANGLE") {
            if let Some(&next) = values.next() {
                angle = Some(raw.number(next)?.to_radians());
            }
        } else if value.eq_ignore_ascii_case("TIMES") {
            return Err(fault(raw, "TIMES (several turns) is not followed: write the arc as GOTO points"));
        } else if !["CENTER", "AXIS", "RADIUS"].iter().any(|word| value.eq_ignore_ascii_case(word)) {
            // A name: the circle is defined elsewhere.
            if numbers.is_empty() && value.starts_with(|c: char| c.is_ascii_alphabetic()) {
                return Ok(None);
            }
            numbers.push(raw.number((at, value))?);
        }
    }
    let Some((&[x, y, z, i, j, k], rest)) = numbers.split_first_chunk() else { return Ok(None) };
    let axis = Unit::try_new(Vector3::new(i, j, k), NO_LENGTH);
    let axis = axis.ok_or_else(|| fault(raw, "the axis of the arc has length zero"))?;
    let center = finite(raw, Point3::new(x, y, z) * unit)?;
    let radius = rest.first().map(|radius| radius * unit).filter(|radius| *radius > 0.0);
    Ok(Some(AptArc { center, axis, radius, angle }))
}

/// Returns the arc of `TLON,GOFWD/ (CIRCLE/ centre, radius),ON,(LINE/ centre, end)` from a point in
/// the direction of INDIRV, with its end; `None` for another form.
///
/// # Errors
/// If a number is none, or the direction does not lead along the circle.
pub(crate) fn along_circle(
    raw: &RawStatement,
    unit: f64,
    from: Option<Point3<f64>>,
    direction: Option<Vector3<f64>>,
) -> Result<Option<(AptArc, Point3<f64>)>, ReadError> {
    let (Some(circle), Some(line)) = (inside(raw, "CIRCLE"), inside(raw, "LINE")) else { return Ok(None) };
    let (Some(&[cx, cy, cz, radius]), Some(&[_, _, _, x, y, z])) = (circle.as_array(), line.as_array()) else {
        return Ok(None);
    };
    let from = from.ok_or_else(|| fault(raw, "there is no point before it"))?;
    let direction = direction.ok_or_else(|| fault(raw, "no INDIRV says in which direction the circle is followed"))?;
    let center = finite(raw, Point3::new(cx, cy, cz) * unit)?;
    let axis = Unit::try_new((from - center).cross(&direction), NO_LENGTH);
    let axis = axis.ok_or_else(|| fault(raw, "INDIRV does not lead along the circle"))?;
    let end = finite(raw, Point3::new(x, y, z) * unit)?;
    Ok(Some((AptArc { center, axis, radius: Some(radius * unit), angle: None }, end)))
}

/// Numbers in the parentheses of a nested definition such as `(CIRCLE/ 1,2,3,4)`.
fn inside(raw: &RawStatement, word: &str) -> Option<Vec<f64>> {
    let text = raw.text.to_ascii_uppercase();
    let start = text.find(&format!("({word}"))? + 1 + word.len();
    let body = text[start..].trim_start().strip_prefix('/')?;
    let body = &body[..body.find(')')?];
    body.split(',').map(|value| parse(value.trim())).collect()
}

fn finite(raw: &RawStatement, point: Point3<f64>) -> Result<Point3<f64>, ReadError> {
    let is_finite = point.coords.iter().all(|v| v.is_finite());
    if is_finite { Ok(point) } else { Err(fault(raw, "a coordinate is too large")) }
}

fn fault(raw: &RawStatement, why: &'static str) -> ReadError {
    raw.error(0, ReadFault::Statement { word: raw.major_word().0, why })
}
