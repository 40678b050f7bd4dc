//! How long a link takes.

use facemill_feedrate::{ProgramBlock, rapid_time};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Machine};

use crate::timing::{Run, Timer, View};

/// Times ways at rapid rate, from rest to rest.
pub(crate) struct LinkClock<'a> {
    machine: &'a Machine,
    tool_length: f64,
    /// `None` where the machine file does not give every acceleration and jerk.
    timer: Option<Timer<'a>>,
}

impl<'a> LinkClock<'a> {
    /// On a machine's view, by its accelerations and jerks where it has them, else by its velocities alone.
    pub(crate) fn new(views: &'a [View<'a>; 1]) -> Self {
        let (machine, tool_length) = views[0];
        let timer = Timer::new(views, machine.motion_law().control_tolerance).ok().map(Timer::without_limits);
        Self { machine, tool_length, timer }
    }

    /// Whether accelerations and jerks count.
    pub(crate) fn is_by_law(&self) -> bool {
        self.timer.is_some()
    }

    /// Time of a way through these positions, s.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn time(&self, law: BlockLaw, start: &AxisValues, through: &[AxisValues]) -> Result<f64, String> {
        let starts = std::iter::once(start).chain(through);
        let plain: Vec<f64> =
            starts.zip(through).map(|(from, to)| rapid_time(self.machine, law, from, to, self.tool_length)).collect();
        let Some(timer) = &self.timer else { return Ok(plain.iter().sum()) };
        // By the axes' speeds the law knows better; a rapid feed of the control caps as a tip feed does.
        let is_capped = self.machine.feed_range().rapid.is_some();
        let block = |(end, time): (&AxisValues, &f64)| ProgramBlock {
            end: *end,
            tip_time: if is_capped { *time } else { 0.0 },
            exact_stop: false,
        };
        let run = Run { start: *start, blocks: through.iter().zip(&plain).map(block).collect(), is_rapid: true };
        Ok(timer.time(&run)?.times.iter().sum())
    }
}
