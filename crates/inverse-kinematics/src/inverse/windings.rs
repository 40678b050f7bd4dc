use std::f64::consts::TAU;

use crate::axes::axis::Axis;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;

/// Largest number of returned windings of one axis: a cable is never wound further, though a limit
/// may allow it.
const MOST: usize = 5;

impl Machine {
    /// Returns the same position with its rotary axes at every number of full turns that their
    /// limits allow.
    ///
    /// An endless axis has one winding, its present value: it turns on from there. For an axis with
    /// more than five, the five nearest to home are returned. Ascending, the axes of
    /// [`Machine::axes`] in turn; empty where no turn brings an axis within its limits. The tool
    /// has the same pose in all of them; axes that do not move it keep their values.
    pub fn windings(&self, q: &AxisValues) -> Vec<AxisValues> {
        let mut all = vec![*q];
        for (k, axis) in self.axes.iter().enumerate() {
            if !self.is_rotary(k) || axis.endless {
                continue;
            }
            let turned = turns(axis, q.get_or_zero(k));
            all = all
                .iter()
                .flat_map(|q| {
                    turned.iter().map(|&value| {
                        let mut q = *q;
                        q[k] = value;
                        q
                    })
                })
                .collect();
        }
        all
    }
}

/// Returns the values of an axis at all of its windings, ascending.
fn turns(axis: &Axis, value: f64) -> Vec<f64> {
    let nearest = value + TAU * ((axis.home - value) / TAU).round();
    let reach = MOST as i32;
    let mut values: Vec<f64> =
        (-reach..=reach).map(|n| if n == 0 { nearest } else { nearest + TAU * f64::from(n) }).collect();
    values.retain(|&v| axis.holds(v));
    values.sort_by(|a, b| (a - axis.home).abs().total_cmp(&(b - axis.home).abs()));
    values.truncate(MOST);
    values.sort_by(f64::total_cmp);
    values
}
