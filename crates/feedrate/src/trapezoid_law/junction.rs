use super::law::TrapezoidSettings;
use super::segment::{LEAST_CYCLES, Segment};
use crate::time_law::AxisBounds;

/// Fraction of an axis' acceleration that a change of direction within one cycle may require.
const KINK: f64 = 0.1;

/// Fraction of the acceleration across an arc: a half remains along it.
const ACROSS: f64 = 0.866_025_403_784_438_6;

/// Largest distance of an arc from its corner, as a fraction of a segment's length.
const REACH: f64 = 0.25;

/// Turns nearer to a full reversal than this end in a stop, rad.
const REVERSAL: f64 = std::f64::consts::PI / 90.0;

/// Motion of a control between two segments.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Junction {
    /// The control stops.
    Stop,
    /// Lets the next segment start while this one stops.
    Overlap,
    /// The control passes at this speed at most; the change of direction takes this fraction of the
    /// acceleration on both sides.
    Through { speed: f64, share: f64 },
    /// The control rounds the corner by an arc.
    Arc(Arc),
}

/// An arc in place of a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    /// Largest speed, mm/s.
    pub speed: f64,
    /// Length, mm.
    pub length: f64,
    /// Length that it takes of the lines on both sides, mm.
    pub cut: f64,
    /// Acceleration along it, mm/s².
    pub acceleration: f64,
}

/// Speeds at which two segments overlap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverlapSpeeds {
    /// Speed from which the first one stops while the second one starts.
    pub leaving: f64,
    /// Speed of the second one when the first one has stopped.
    pub entering: f64,
}

/// Largest acceleration, speed and length of a segment.
#[derive(Clone, Copy)]
pub(crate) struct Pace {
    pub acceleration: f64,
    pub speed: f64,
    pub length: f64,
}

impl Pace {
    /// Returns the largest speed between two stops.
    fn reachable(&self) -> f64 {
        (self.acceleration * self.length).sqrt().min(self.speed)
    }
}

/// Returns half of the angle between two segments as seen from the corner, rad: π/2 where they
/// continue straight on.
pub(crate) fn half_angle(before: &Segment, after: &Segment) -> f64 {
    let along: f64 = before.direction.iter().zip(after.direction.iter()).map(|(a, b)| a * b).sum();
    0.5 * (-along).clamp(-1.0, 1.0).acos()
}

/// Returns the speeds of an overlap: it lasts no longer than half of either segment, and passes the
/// corner within the tolerance.
pub(crate) fn overlap(before: Pace, after: Pace, half_angle: f64, tolerance: f64) -> OverlapSpeeds {
    let (v, w) = (before.reachable(), after.reachable());
    let longest = (before.length / v).min(after.length / w);
    let time = longest.min((v / before.acceleration).max(w / after.acceleration));
    let cos = half_angle.cos();
    let within = if cos > 1e-3 { 2.0 * (before.acceleration * tolerance / cos).sqrt() } else { f64::INFINITY };
    OverlapSpeeds {
        leaving: v.min(time * before.acceleration).min(within),
        entering: w.min(time * after.acceleration).min(within),
    }
}

impl Junction {
    /// Returns the junction behind `before`, whose remaining length is `left` mm after the junction
    /// in front of it.
    pub(crate) fn between(
        before: &Segment,
        after: &Segment,
        left: f64,
        axes: &[AxisBounds],
        settings: &TrapezoidSettings,
    ) -> Self {
        if before.exact_stop || settings.tolerance <= 0.0 {
            return Self::Stop;
        }
        if before.turns || after.turns {
            return Self::Overlap;
        }
        let half = half_angle(before, after);
        if 2.0 * half < REVERSAL {
            return Self::Stop;
        }
        let speed = before.speed.min(after.speed);
        let share = kink_share(before, after, speed, axes, settings.cycle);
        if share < KINK {
            return Self::Through { speed, share };
        }
        let through = speed * KINK / share;
        let arc = Arc::new(before, after, left, half, axes, settings);
        let pace = |s: &Segment, length| Pace { acceleration: 0.5 * s.acceleration.0, speed: s.speed, length };
        let overlapped = overlap(pace(before, left), pace(after, 0.5 * after.whole), half, settings.tolerance);
        let along = 0.25 * half.sin() * (overlapped.leaving + overlapped.entering);
        if along > arc.speed && along > through {
            Self::Overlap
        } else if through > arc.speed {
            Self::Through { speed: through, share: KINK }
        } else {
            Self::Arc(arc)
        }
    }
}

/// Returns the fraction of the weakest axis' acceleration that the change of direction requires
/// within one cycle.
fn kink_share(before: &Segment, after: &Segment, speed: f64, axes: &[AxisBounds], cycle: f64) -> f64 {
    let of_axis = |k: usize| (after.direction[k] - before.direction[k]).abs() * speed / (cycle * axes[k].acceleration);
    (0..axes.len()).map(of_axis).fold(0.0, f64::max)
}

impl Arc {
    /// Returns the widest arc that both lines and the tolerance allow.
    fn new(
        before: &Segment,
        after: &Segment,
        left: f64,
        half: f64,
        axes: &[AxisBounds],
        settings: &TrapezoidSettings,
    ) -> Self {
        let moved = |k: &usize| before.direction[*k] != 0.0 || after.direction[*k] != 0.0;
        let most = (0..axes.len()).filter(moved).map(|k| axes[k].acceleration).fold(f64::INFINITY, f64::min);
        let tolerance = settings.tolerance.min(REACH * before.whole).min(REACH * after.whole);
        // 1 − sin is a small difference that matters.
        let open = 2.0 * (0.5 * (std::f64::consts::FRAC_PI_2 - half)).sin().powi(2);
        let by_tolerance = half.cos() * tolerance / open;
        let cut = by_tolerance.min(left).min(0.5 * after.whole);
        let (radius, turn) = (half.tan() * cut, std::f64::consts::PI - 2.0 * half);
        let speed = before.speed.max(after.speed).min((ACROSS * most * radius).sqrt());
        let across = (speed * speed / (radius * most)).min(ACROSS);
        Self { speed, length: radius * turn, cut, acceleration: most * (1.0 - across * across).sqrt() }
    }

    /// Returns the same together with the rest of the line in front of it.
    pub(crate) fn with_line(self, length: f64) -> Self {
        Self { length: self.length + length, ..self }
    }

    /// Limits the speed to that allowed by a control's cycle.
    pub(crate) fn within_cycle(self, cycle: f64) -> Self {
        Self { speed: self.speed.min(self.length / (LEAST_CYCLES * cycle)), ..self }
    }
}
