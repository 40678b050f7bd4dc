use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;

/// Largest deviation of X, Y and Z from unit vectors at right angles for a control to use them as
/// coordinates.
const SQUARE: f64 = 1e-9;

impl Machine {
    /// Returns the frame of a control's X, Y and Z under a work offset, fixed to the table: its
    /// origin is the gauge point at the axis values `offset`, its directions are those in which
    /// positive X, Y and Z move the tool against the table there. Table frame from that frame.
    ///
    /// With the rotary axes at their offsets, the tip's coordinates in it are the words of the axes
    /// under length compensation; under RTCP they are so in every pose. `None` for a machine
    /// without axes X, Y and Z (for one head of two: X1, Y1 and Z1, or X2, Y2 and Z2), or where
    /// they are not at right angles.
    pub fn work_coordinates(&self, offset: &AxisValues) -> Option<Isometry3<f64>> {
        let origin = self.cl_point(offset, 0.0).tip;
        let direction = |letter: &str| -> Option<Vector3<f64>> {
            let k = self.own_axis(letter)?;
            let mut moved = *offset;
            moved[k] += 1.0;
            Some(self.cl_point(&moved, 0.0).tip - origin)
        };
        let directions = Matrix3::from_columns(&[direction("X")?, direction("Y")?, direction("Z")?]);
        let is_square = (directions.tr_mul(&directions) - Matrix3::identity()).amax() < SQUARE;
        if !is_square || directions.determinant() < 0.0 {
            return None;
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(directions));
        Some(Isometry3::from_parts(origin.into(), rotation))
    }

    /// Returns the axis with this letter that moves the tool; the one with a number (X2) where
    /// there is none without.
    fn own_axis(&self, letter: &str) -> Option<usize> {
        let own = |k: &usize| self.moves_tool(*k);
        let numbered = |k: &usize| self.axes()[*k].letter.as_str().starts_with(letter);
        let mut all = (0..self.axes().len()).filter(own).filter(numbered);
        self.axis_index(letter).filter(own).or_else(|| all.next())
    }
}

#[cfg(test)]
#[path = "../../tests/unit/machine/work_frame.rs"]
mod tests;
