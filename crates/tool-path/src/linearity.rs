//! Deviation of the control from the intended motion between two blocks.

use facemill_cl_data::CuttingLaw;
use facemill_cutter_location::{PoseTest, limited_rotaries};
use facemill_inverse_kinematics::motion::deviation_bound;
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_nc_program::dialect::RoundingBound;

/// Tolerance of motion between blocks, and its contributions.
#[derive(Clone, Copy, Debug)]
pub struct Linearity {
    /// Largest deviation, rounding of the words included, mm.
    pub tolerance: f64,
    /// Rounding of the words.
    pub rounding: RoundingBound,
    /// Motion of the control between blocks.
    pub law: CuttingLaw,
}

/// Fraction of the tolerance that is always left for motion: where rounding uses up more, more
/// blocks would not help.
const LEAST_SHARE: f64 = 0.25;

impl Linearity {
    /// Returns the largest distance of the cutter from the intended way between two positions, and
    /// whether a block between them is too long.
    pub fn judge(&self, test: &PoseTest<'_>, from: &AxisValues, to: &AxisValues) -> (f64, bool) {
        let length = test.cell.tool.gauge_length();
        let radius = test.cell.tool.cutter().radius();
        let motion = deviation_bound(test.cell.machine, self.law, from, to, length).rim(radius);
        let rounding = self.rounding_at(test, to);
        let left = (self.tolerance - rounding).max(LEAST_SHARE * self.tolerance);
        (motion + rounding, motion > left)
    }

    /// Bounds the motion of the cutter's rim by rounding of the words at a position, to first
    /// order.
    fn rounding_at(&self, test: &PoseTest<'_>, axes: &AxisValues) -> f64 {
        let cell = test.cell;
        let length = cell.tool.gauge_length();
        let radius = cell.tool.cutter().radius();
        let here = cell.machine.cl_point(axes, length);
        let mut turned = 0.0;
        for (k, axis) in cell.machine.axes().iter().enumerate() {
            if axis.kind == AxisKind::Rotary {
                let mut moved = *axes;
                moved[k] += self.rounding.rotary;
                let there = cell.machine.cl_point(&moved, length);
                turned += (there.tip - here.tip).norm() + radius * self.rounding.rotary;
            }
        }
        // Where vectors are written, rotary words can come between them.
        self.rounding.linear * 3f64.sqrt() + f64::max(turned, radius * self.rounding.vector)
    }
}

/// Returns axis values with every rotary axis at the full turn nearest to a reference.
pub fn turned_near(test: &PoseTest<'_>, axes: &AxisValues, reference: &AxisValues) -> AxisValues {
    let mut turned = *axes;
    for (k, axis) in test.cell.machine.axes().iter().enumerate() {
        if axis.kind == AxisKind::Rotary {
            let turns = (reference.get_or_zero(k) - axes.get_or_zero(k)) / std::f64::consts::TAU;
            turned[k] += turns.round() * std::f64::consts::TAU;
        }
    }
    turned
}

/// Returns axis values with every endless rotary axis at the full turn nearest to a reference.
/// Limited ones keep their values, because their windings are chosen for the whole operation.
pub fn endless_near(test: &PoseTest<'_>, axes: &AxisValues, reference: &AxisValues) -> AxisValues {
    let mut turned = turned_near(test, axes, reference);
    for k in limited_rotaries(test.cell.machine) {
        turned[k] = axes[k];
    }
    turned
}
