use crate::axes::axis::{Axis, AxisLetter};
use crate::axes::axis_values::AxisValues;
use crate::machine_file::error::MachineError;
use crate::solver::screw_chain::ScrewChain;

/// Number of poses tested. A pose that is singular by chance is not followed by seven more.
const POSES: u32 = 8;

/// Singular value, as a fraction of the largest, up to which joints depend on each other. Files in
/// degrees with nine digits leave 1e-9; a larger value at one pose in eight is a machine that can
/// be steered there.
const DEPENDENT: f64 = 1e-8;

/// Share of a joint in a motion from which on its axis is named.
const TAKES_PART: f64 = 1e-3;

/// Refuses a chain of five joints in which some can move without moving the tool in every pose, so
/// the others do not suffice for tip and tool axis anywhere.
pub(crate) fn refuse_degenerate(chain: &ScrewChain, axes: &[Axis]) -> Result<(), MachineError> {
    let mut takes_part = [false; 5];
    for pose in 0..POSES {
        // Multiples of square roots of primes: no right angles, no two alike.
        let values = [2.0_f64, 3.0, 5.0, 7.0, 11.0].map(|p| (f64::from(pose + 1) * p.sqrt()).fract() * 5.0 - 2.5);
        let q = AxisValues::from_fn(axes.len(), |k| values[k % 5]);
        let (velocities, _) = chain.tool_velocities(&q, 130.0 + 17.0 * f64::from(pose));
        let svd = velocities.svd(false, true);
        let Some(motions) = svd.v_t else { return Ok(()) };
        let limit = DEPENDENT * svd.singular_values.max();
        if svd.singular_values.min() > limit {
            return Ok(());
        }
        for (motion, _) in motions.row_iter().zip(&svd.singular_values).filter(|(_, size)| **size <= limit) {
            for (takes_part, value) in takes_part.iter_mut().zip(&motion) {
                *takes_part |= value.abs() > TAKES_PART;
            }
        }
    }
    let named = chain.screws.iter().zip(takes_part).filter(|(_, takes_part)| *takes_part);
    let mut letters: Vec<AxisLetter> = named.map(|(s, _)| axes[s.axis].letter).collect();
    letters.sort();
    Err(MachineError::DependentAxes { axes: letters })
}
