use facemill_inverse_kinematics::AxisValues;

use crate::program_law::ProgramBlock;
use crate::time_law::{AxisBounds, MotionLimit};

/// Segments shorter than this are left out, s at the axes' largest speeds.
const SHORTEST: f64 = 1e-10;

/// Way of all linear axes below which only the rotary axes move, mm.
const STANDS: f64 = 1e-9;

/// Least time of a control in a segment, in cycles.
pub(crate) const LEAST_CYCLES: f64 = 1.02;

/// A block in a control's queue. Lengths are those of the linear axes, mm, or of the rotary ones,
/// deg, where the linear ones do not move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Index of its block.
    pub block: usize,
    /// Length between its ends.
    pub whole: f64,
    /// Largest speed by feed, axes and cycle.
    pub speed: f64,
    /// The axis or feed that limits it.
    pub speed_limit: MotionLimit,
    /// Acceleration along it by the slowest axis, and that axis.
    pub acceleration: (f64, usize),
    /// Whether a rotary axis moves.
    pub turns: bool,
    /// Unit vector of the linear axes; 0 where they do not move.
    pub direction: AxisValues,
    /// Whether the axes stop at its end.
    pub exact_stop: bool,
}

impl Segment {
    /// Returns the block from one position to the other; `None` without motion.
    pub(crate) fn new(
        block: usize,
        from: &AxisValues,
        to: &ProgramBlock,
        (axes, is_linear): (&[AxisBounds], &[bool]),
        cycle: f64,
    ) -> Option<Self> {
        let way = |k: usize| (to.end[k] - from[k]).abs();
        let norm = |linear: bool| {
            let of_kind = (0..axes.len()).filter(|&k| is_linear[k] == linear);
            of_kind.map(way).fold(0.0, f64::hypot)
        };
        let slowest = |limit: fn(&AxisBounds) -> f64| {
            let of_axis = (0..axes.len()).map(|k| (way(k) / limit(&axes[k]), k));
            of_axis.fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most })
        };
        let (time, slow) = slowest(|b| b.velocity);
        if time <= SHORTEST {
            return None;
        }
        let (linear, rotary) = (norm(true), norm(false));
        let whole = if linear > STANDS { linear } else { rotary.to_degrees() };
        let (square_time, weak) = slowest(|b| b.acceleration);
        let is_fed = to.tip_time > time;
        let direction = AxisValues::from_fn(axes.len(), |k| {
            if is_linear[k] && linear > STANDS { (to.end[k] - from[k]) / linear } else { 0.0 }
        });
        Some(Self {
            block,
            whole,
            speed: whole / time.max(to.tip_time).max(LEAST_CYCLES * cycle),
            speed_limit: if is_fed { MotionLimit::TipFeed } else { MotionLimit::Velocity(slow) },
            acceleration: (whole / square_time, weak),
            turns: rotary > 0.0,
            direction,
            exact_stop: to.exact_stop,
        })
    }

    /// Returns the block from one position to the other, all axes counted alike in these units;
    /// `None` without motion.
    pub(crate) fn over_all_axes(
        block: usize,
        from: &AxisValues,
        to: &ProgramBlock,
        (axes, units): (&[AxisBounds], &[f64]),
    ) -> Option<Self> {
        let way = |k: usize| to.end[k] - from[k];
        let slowest = |limit: fn(&AxisBounds) -> f64| {
            let of_axis = (0..axes.len()).map(|k| (way(k).abs() / limit(&axes[k]), k));
            of_axis.fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most })
        };
        let (time, slow) = slowest(|b| b.velocity);
        if time <= SHORTEST {
            return None;
        }
        let (square_time, weak) = slowest(|b| b.acceleration);
        let whole = (0..axes.len()).map(|k| way(k) * units[k]).fold(0.0, f64::hypot);
        let is_fed = to.tip_time > time;
        Some(Self {
            block,
            whole,
            speed: whole / time.max(to.tip_time),
            speed_limit: if is_fed { MotionLimit::TipFeed } else { MotionLimit::Velocity(slow) },
            acceleration: (whole / square_time, weak),
            turns: false,
            direction: AxisValues::from_fn(axes.len(), |k| way(k) * units[k] / whole),
            exact_stop: to.exact_stop,
        })
    }
}
