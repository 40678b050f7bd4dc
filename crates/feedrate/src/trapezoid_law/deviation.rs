use std::f64::consts::FRAC_PI_4;

use facemill_inverse_kinematics::AxisValues;

use super::law::{TrapezoidLaw, timed};
use super::queue::{End, Entry, end_speeds};
use super::segment::Segment;
use crate::program_law::{ProgramBlock, ProgramLawError, check_program};
use crate::time_law::{AxisBounds, MotionBounds};

/// Sine of a quarter turn less half a corner, below which a corner counts as a full reversal.
const REVERSAL: f64 = 1e-3;

/// Least turn between two short segments, rad: that of Marlin's approximate arccosine.
const LEAST_TURN: f64 = 0.033;

/// Settings of a control that keeps to the lines and slows down at corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationSettings {
    /// Distance from a corner of the arc whose speed is the corner's, mm; the axes stay on the
    /// lines. 0 stops at every corner.
    pub deviation: f64,
    /// Length below which a segment behind a corner of less than 45° bounds the speed there as a
    /// piece of an arc, mm; 0 for none.
    pub small_segments: f64,
    /// Number of blocks within which the control keeps itself able to stop.
    pub look_ahead: usize,
}

/// Times a program on a control that limits acceleration but not jerk, keeps to the lines, and
/// takes a corner at the speed of an arc that would leave it by a small distance.
///
/// All axes count alike, 1 deg as 1 mm: in lengths, directions and corners. At the speed v of a
/// corner with half angle h, as seen from it, the arc's radius is deviation·sin h/(1 − sin h), and
/// v² is the radius times the acceleration that the weakest axis allows in the direction in which
/// the velocity changes. This is the planner of Grbl and of those that come from it. Where the
/// segment behind a corner of θ < 45° is shorter than `small_segments`, v² is at most that
/// acceleration, and no more than the segment's own, times its length over θ, θ counted as 0.033
/// rad at least: so does Marlin below 1 mm. `is_linear` marks the linear axes; bounds of jerk are
/// not used. A model of times, not of positions; not compared with a control.
///
/// # Errors
/// Invalid limits or blocks, with the index of the block.
///
/// ```
/// use facemill_feedrate::{AxisBounds, DeviationSettings, ProgramBlock, deviation_law};
/// use facemill_inverse_kinematics::AxisValues;
///
/// let axis = AxisBounds { velocity: 100.0, acceleration: 1000.0, jerk: 1e6 };
/// let block = |x: f64| ProgramBlock { end: AxisValues::from([x]), tip_time: 0.0, exact_stop: false };
/// let settings =
///     DeviationSettings { deviation: 0.01, small_segments: 0.0, look_ahead: 16 };
/// let law = deviation_law(&AxisValues::zeros(1), &[block(50.0), block(100.0)], (&[axis], &[true]), &settings)?;
/// // 100/100 s at speed and 100/1000 s for the ramps: nothing is lost where the line goes on.
/// assert!((law.times.iter().sum::<f64>() - 1.1).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn deviation_law(
    start: &AxisValues,
    blocks: &[ProgramBlock],
    (axes, is_linear): (&[AxisBounds], &[bool]),
    settings: &DeviationSettings,
) -> Result<TrapezoidLaw, ProgramLawError> {
    MotionBounds::new(axes.to_vec()).check()?;
    check_program(start, blocks.iter().copied(), axes.len().min(is_linear.len()))?;
    let units: Vec<f64> = is_linear.iter().map(|linear| if *linear { 1.0 } else { 1_f64.to_degrees() }).collect();
    let mut segments: Vec<Segment> = Vec::with_capacity(blocks.len());
    let mut at = *start;
    for (k, block) in blocks.iter().enumerate() {
        if let Some(segment) = Segment::over_all_axes(k, &at, block, (axes, &units)) {
            segments.push(segment);
            at = block.end;
        } else if let Some(last) = segments.last_mut() {
            last.exact_stop |= block.exact_stop;
        }
    }
    let entry = |(k, segment): (usize, &Segment)| Entry {
        segment: k,
        length: segment.whole,
        speed: segment.speed,
        acceleration: segment.acceleration.0,
        end: match segments.get(k + 1) {
            Some(next) if !segment.exact_stop => corner(segment, next, (axes, &units), settings),
            _ => End::Stop,
        },
        is_arc: false,
    };
    let entries: Vec<Entry> = segments.iter().enumerate().map(entry).collect();
    let ends = end_speeds(&entries, settings.look_ahead);
    Ok(timed(blocks.len(), &segments, &entries, &ends, 0.0))
}

/// Returns the largest speed between two segments.
fn corner(
    before: &Segment,
    after: &Segment,
    (axes, units): (&[AxisBounds], &[f64]),
    settings: &DeviationSettings,
) -> End {
    let change = |k: usize| after.direction[k] - before.direction[k];
    // |u₂ − u₁| and |u₂ + u₁| of unit vectors are 2·cos h and 2·sin h.
    let cos = 0.5 * (0..axes.len()).map(change).fold(0.0, f64::hypot);
    let sin = 0.5 * (0..axes.len()).map(|k| after.direction[k] + before.direction[k]).fold(0.0, f64::hypot);
    if sin < REVERSAL || settings.deviation <= 0.0 && cos > 0.0 {
        return End::Stop;
    }
    let fed = before.speed.min(after.speed);
    let turn = 2.0 * cos.atan2(sin);
    let is_small = after.whole < settings.small_segments && turn < FRAC_PI_4;
    let on_arc = |acceleration: f64| {
        if is_small { (acceleration * after.whole / turn.max(LEAST_TURN)).sqrt() } else { f64::INFINITY }
    };
    if cos == 0.0 {
        return End::Through(fed.min(on_arc(after.acceleration.0)));
    }
    let share = |k: usize| change(k).abs() / (2.0 * cos * axes[k].acceleration * units[k]);
    let most = (0..axes.len()).map(share).fold(0.0, f64::max).recip();
    // 1 − sin h, a small difference that matters, is cos² h/(1 + sin h).
    let radius = settings.deviation * sin * (1.0 + sin) / (cos * cos);
    End::Through(fed.min((most * radius).sqrt()).min(on_arc(most.min(after.acceleration.0))))
}
