//! Linear axes that hold the tip in its place.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;

impl Machine {
    /// Returns the rotary values of `q` with the linear values that bring the tip to `tip` (table
    /// frame), as a control does under RTCP. `None` where the machine has not three linear axes, or
    /// they lie in a plane there.
    ///
    /// With the rotary axes at rest the tip is an affine function of the linear ones, so four
    /// forward solutions determine it.
    pub fn with_tip_at(&self, q: &AxisValues, tip: &Point3<f64>, tool_length: f64) -> Option<AxisValues> {
        let axes = self.axes();
        let linears: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Linear).collect();
        let &[x, y, z] = linears.as_slice() else { return None };
        let mut q = *q;
        for k in [x, y, z] {
            q[k] = 0.0;
        }
        let origin = self.cl_point(&q, tool_length).tip;
        let column = |k: usize| {
            let mut one = q;
            one[k] = 1.0;
            self.cl_point(&one, tool_length).tip - origin
        };
        let directions = Matrix3::from_columns(&[column(x), column(y), column(z)]);
        // Unit directions with a smaller determinant lie in a plane for every practical purpose.
        let inverse = (directions.determinant().abs() > 1e-9).then(|| directions.try_inverse()).flatten()?;
        let mut values: Vector3<f64> = inverse * (tip - origin);
        // One refinement removes the loss in the differences of forward solutions.
        values += inverse * (tip - origin - directions * values);
        for (value, k) in values.iter().zip([x, y, z]) {
            q[k] = *value;
        }
        Some(q)
    }
}
