use facemill_cl_data::ClPoint;

use crate::inverse::is_exact;
use crate::machine::Machine;
use crate::solver::inverse_solution::{InverseSolution, Unreachable};

impl Machine {
    /// Returns all solutions of [`Machine::inverse`] at all of their [windings](Machine::windings):
    /// every branch, and for a limited rotary axis every number of full turns that its limits
    /// allow, up to the five nearest to home.
    ///
    /// Each is within the limits, and its forward solution differs from `cl` by at most 1e-9 mm and
    /// 1e-12 rad. A [free](InverseSolution::free_axis) axis is at home or at full turns from it.
    ///
    /// For a caller that chooses by itself which way an axis winds:
    ///
    /// ```
    /// use facemill_cl_data::ClPoint;
    /// use facemill_inverse_kinematics::Machine;
    /// use nalgebra::{Point3, Unit, Vector3};
    ///
    /// let machine = Machine::head_b_table_c()?;
    /// let axis = Unit::new_normalize(Vector3::new(0.2, 0.0, 1.0));
    /// let pose = ClPoint { tip: Point3::new(50.0, 20.0, 30.0), axis };
    /// let [nearest, all] = [machine.inverse(&pose, 250.0)?.len(), machine.all_solutions(&pose, 250.0)?.len()];
    /// assert!(all >= nearest && nearest >= 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Machine::inverse`].
    pub fn all_solutions(&self, cl: &ClPoint, tool_length: f64) -> Result<Vec<InverseSolution>, Unreachable> {
        let solutions = self.inverse(cl, tool_length)?;
        let mut all = Vec::new();
        for solution in solutions.iter() {
            let wound =
                self.windings(&solution.values).into_iter().map(|values| InverseSolution { values, ..solution });
            all.extend(wound.filter(|s| {
                let at = self.cl_point(&s.values, tool_length);
                let turned = (0..s.values.len()).filter(|&k| self.is_rotary(k)).map(|k| s.values[k].abs()).sum();
                is_exact(&(at.tip - cl.tip), &(at.axis.into_inner() - cl.axis.into_inner()), turned)
            }));
        }
        if all.is_empty() { Err(Unreachable::Inaccurate) } else { Ok(all) }
    }
}
