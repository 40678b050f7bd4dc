//! Times of links.

use facemill_feedrate::{ProgramBlock, rapid_time};
use facemill_inverse_kinematics::{Axis, AxisValues, BlockLaw, Machine};
use facemill_virtual_machine::program_time::run::{MotionRun, Timer};
use facemill_virtual_machine::program_time::tolerance::MachineView;

/// Times ways at rapid rate, from rest to rest.
pub struct LinkClock<'a> {
    machine: &'a Machine,
    tool_length: f64,
    /// `None` where the machine file does not give every acceleration and jerk.
    timer: Option<Timer<'a>>,
}

impl<'a> LinkClock<'a> {
    /// Creates the clock of a machine from the view of each head, at least one. It uses
    /// accelerations and jerks if the machine has them, otherwise velocities alone.
    pub fn new(views: &'a [MachineView<'a>]) -> Self {
        let (machine, tool_length) = views[0];
        let timer = Timer::new(views, machine.motion_law().control_tolerance).ok().map(Timer::without_limits);
        Self { machine, tool_length, timer }
    }

    /// Returns whether accelerations and jerks count.
    pub fn is_by_law(&self) -> bool {
        self.timer.is_some()
    }

    /// Returns the time of cuts through positions, from rest to rest, each with the least time that
    /// its feed gives it, s.
    ///
    /// # Errors
    /// If the motion is invalid; the text says why.
    pub fn cut_time(&self, start: &AxisValues, through: &[(AxisValues, f64)]) -> Result<f64, String> {
        let of_axis = |from: &AxisValues, to: &AxisValues| {
            let axes = self.machine.axes().iter().enumerate();
            axes.map(|(k, axis)| (to[k] - from[k]).abs() / axis.max_velocity).fold(0.0, f64::max)
        };
        let Some(timer) = &self.timer else {
            let starts = std::iter::once(start).chain(through.iter().map(|(end, _)| end));
            return Ok(starts.zip(through).map(|(from, (to, tip_time))| tip_time.max(of_axis(from, to))).sum());
        };
        let block = |&(end, tip_time): &(AxisValues, f64)| ProgramBlock { end, tip_time, exact_stop: false };
        let blocks = through.iter().map(block).collect();
        let run = MotionRun { start: *start, blocks, is_rapid: false, vectors: Vec::new() };
        Ok(timer.time(&run)?.times.iter().sum())
    }

    /// Returns a lower bound of the time of any way there, s: that of the slowest axis by itself.
    pub fn least_time(&self, start: &AxisValues, end: &AxisValues) -> f64 {
        let of_axis = |(k, axis): (usize, &Axis)| {
            let way = (end[k] - start[k]).abs();
            match (axis.max_acceleration, axis.max_jerk) {
                (Some(acceleration), Some(jerk)) if self.is_by_law() => {
                    rest_to_rest(way, axis.max_velocity, acceleration, jerk)
                }
                _ => way / axis.max_velocity,
            }
        };
        self.machine.axes().iter().enumerate().map(of_axis).fold(0.0, f64::max)
    }

    /// Returns the time of a way through these positions, s.
    ///
    /// # Errors
    /// If the motion is invalid; the text says why.
    pub fn time(&self, law: BlockLaw, start: &AxisValues, through: &[AxisValues]) -> Result<f64, String> {
        let starts = std::iter::once(start).chain(through);
        let plain: Vec<f64> =
            starts.zip(through).map(|(from, to)| rapid_time(self.machine, law, from, to, self.tool_length)).collect();
        let Some(timer) = &self.timer else { return Ok(plain.iter().sum()) };
        // The law already knows the axes' speeds; a rapid feed of the control is a cap like a tip
        // feed.
        let is_capped = self.machine.feed_range().rapid.is_some();
        let block = |(end, time): (&AxisValues, &f64)| ProgramBlock {
            end: *end,
            tip_time: if is_capped { *time } else { 0.0 },
            exact_stop: false,
        };
        let blocks = through.iter().zip(&plain).map(block).collect();
        let run = MotionRun { start: *start, blocks, is_rapid: true, vectors: Vec::new() };
        Ok(timer.time(&run)?.times.iter().sum())
    }
}

/// Returns the least time of one axis from rest to rest within velocity, acceleration and jerk.
///
/// It reaches its largest speed v in v/a + a/j, or, without reaching its largest acceleration, in
/// 2·√(v/j), and loses it in the same time, at a mean speed of v/2. Where the way is too short for
/// that, v is the speed that the way allows.
fn rest_to_rest(way: f64, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    // Speed from which on the largest acceleration is reached.
    let knee = acceleration * acceleration / jerk;
    let gain = |v: f64| if v >= knee { v / acceleration + acceleration / jerk } else { 2.0 * (v / jerk).sqrt() };
    if velocity * gain(velocity) <= way {
        return 2.0 * gain(velocity) + (way - velocity * gain(velocity)) / velocity;
    }
    let ramp = acceleration / jerk;
    let peak = 0.5 * acceleration * ((ramp * ramp + 4.0 * way / acceleration).sqrt() - ramp);
    if peak >= knee { 2.0 * gain(peak) } else { 4.0 * (0.5 * way / jerk).cbrt() }
}

#[cfg(test)]
#[path = "../../tests/unit/links/clock.rs"]
mod tests;
