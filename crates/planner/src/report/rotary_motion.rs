//! Motion of the rotary axes along passes.

use facemill_inverse_kinematics::{AxisKind, Machine};
use facemill_job::format::report::RotaryReport;
use facemill_tool_path::segments::Cut;

/// Largest amplitude that counts as rounding, rad.
const DEAD_BAND: f64 = 0.01 * std::f64::consts::PI / 180.0;

/// Returns the motion of each rotary axis, with the tool tip at this feed, mm/s.
pub(crate) fn rotary_report(machine: &Machine, passes: &[&[Cut]], feed: f64) -> Vec<RotaryReport> {
    let rotary = machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary);
    rotary
        .map(|(axis, a)| {
            let mut sum = Sum::default();
            for cuts in passes {
                let (times, values) = motion(cuts, axis, a.has_no_stops(), feed);
                sum.reversals += reversals(&values);
                sum.add(&times, &values);
            }
            RotaryReport {
                axis: a.letter.to_string(),
                reversals: sum.reversals,
                largest_velocity_deg_s: sum.velocity.to_degrees(),
                largest_acceleration_deg_s2: sum.acceleration.to_degrees(),
                mean_acceleration_deg_s2: (sum.square / sum.time.max(f64::MIN_POSITIVE)).sqrt().to_degrees(),
            }
        })
        .collect()
}

/// Returns times and values of an axis along a pass, without full turns between neighbours of an
/// endless one.
fn motion(cuts: &[Cut], axis: usize, endless: bool, feed: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut times, mut values): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut tip = None;
    for cut in cuts {
        let value = cut.pose.configuration.axes.get_or_zero(axis);
        let (Some(before), Some(&last), Some(&time)) = (tip, values.last(), times.last()) else {
            tip = Some(cut.pose.cl.tip);
            times.push(0.0);
            values.push(value);
            continue;
        };
        let turns = if endless { ((value - last) / std::f64::consts::TAU).round() } else { 0.0 };
        let way: f64 = (cut.pose.cl.tip - before).norm();
        // Where the tip is at rest, no time passes.
        if way > 0.0 {
            times.push(time + way / feed);
            values.push(value - turns * std::f64::consts::TAU);
            tip = Some(cut.pose.cl.tip);
        }
    }
    (times, values)
}

#[derive(Default)]
struct Sum {
    reversals: usize,
    velocity: f64,
    acceleration: f64,
    /// Integral of the square of the acceleration.
    square: f64,
    time: f64,
}

impl Sum {
    fn add(&mut self, times: &[f64], values: &[f64]) {
        let velocity = |k: usize| (values[k + 1] - values[k]) / (times[k + 1] - times[k]);
        for k in 0..values.len().saturating_sub(1) {
            self.velocity = self.velocity.max(velocity(k).abs());
        }
        for k in 1..values.len().saturating_sub(1) {
            let span = 0.5 * (times[k + 1] - times[k - 1]);
            let acceleration = (velocity(k) - velocity(k - 1)) / span;
            self.acceleration = self.acceleration.max(acceleration.abs());
            self.square += acceleration * acceleration * span;
            self.time += span;
        }
    }
}

/// Returns the number of turning points of a sequence: extremes from which it returns by more than
/// the dead band.
fn reversals(values: &[f64]) -> usize {
    let Some(&first) = values.first() else { return 0 };
    // Lowest and highest since the last turning point; once the direction is known, the end in that
    // direction counts.
    let (mut low, mut high) = (first, first);
    let (mut rising, mut count) = (None, 0);
    for &v in values {
        (low, high) = (low.min(v), high.max(v));
        let (fell, rose) = (high - v > DEAD_BAND, v - low > DEAD_BAND);
        let turned_to = match rising {
            Some(true) if fell => Some(false),
            Some(false) if rose => Some(true),
            None if fell || rose => Some(rose),
            _ => None,
        };
        if turned_to.is_some() {
            count += usize::from(rising.is_some());
            rising = turned_to;
            (low, high) = (v, v);
        }
    }
    count
}

#[cfg(test)]
#[path = "../../tests/unit/report/rotary_motion.rs"]
mod tests;
