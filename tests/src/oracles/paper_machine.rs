//! The head-B, table-C mill of FEED, written down from the paper's equation (9).

use nalgebra::{Point3, Unit, Vector3};

use crate::oracles::interpreter::Axes;

/// Distance from the B pivot to the spindle's face of the preset machine, mm.
pub const PIVOT_TO_FACE: f64 = 350.0;

/// Tip and axis of the tool on the table (FEED (9)): `pivot_length` is l, from the B pivot to the
/// tip.
///
/// `Px = cosC·X − sinC·Y − l·sinB·cosC`, `Py = sinC·X + cosC·Y − l·sinB·sinC`, `Pz = Z + l −
/// l·cosB`. The axis is what (9) implies: from the tip to the pivot.
pub fn tool_on_table(at: &Axes, pivot_length: f64) -> (Point3<f64>, Unit<Vector3<f64>>) {
    let (sin_b, cos_b) = at.b.to_radians().sin_cos();
    let (sin_c, cos_c) = at.c.to_radians().sin_cos();
    let l = pivot_length;
    let tip = Point3::new(
        cos_c * at.x - sin_c * at.y - l * sin_b * cos_c,
        sin_c * at.x + cos_c * at.y - l * sin_b * sin_c,
        at.z + l - l * cos_b,
    );
    (tip, Unit::new_normalize(Vector3::new(sin_b * cos_c, sin_b * sin_c, cos_b)))
}
