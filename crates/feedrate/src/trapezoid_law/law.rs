use facemill_inverse_kinematics::AxisValues;

use super::junction::{OverlapSpeeds, Pace, half_angle, overlap};
use super::queue::{End, Entry, end_speeds, entries};
use super::segment::Segment;
use crate::program_law::{ProgramBlock, ProgramLawError, check_program};
use crate::time_law::{AxisBounds, MotionBounds, MotionLimit};

/// Settings of a control's motion through its queue of blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrapezoidSettings {
    /// Largest distance of the tip from a corner, mm; 0 stops at every corner.
    pub tolerance: f64,
    /// Number of blocks within which the control keeps itself able to stop.
    pub look_ahead: usize,
    /// Cycle of the control, s: no line or arc takes less.
    pub cycle: f64,
}

/// Times of a program's blocks by [`trapezoid_law`], in their order; blocks without motion take
/// none.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TrapezoidLaw {
    /// Times, s. Where two blocks overlap, the time counts for the first one; an arc counts half
    /// for each.
    pub times: Vec<f64>,
    /// Times at the largest speed in each block, s.
    pub peak_times: Vec<f64>,
    /// The limiting factor of each block; `None` without motion.
    pub limits: Vec<Option<MotionLimit>>,
}

/// Times a program on a control that limits acceleration but not jerk, and looks ahead over a
/// number of blocks as long as no rotary axis moves.
///
/// Lines of the linear axes are joined by arcs within the tolerance, or directly where the
/// direction hardly changes; the speed at each joint is one from which the control can stop within
/// its look-ahead. A block that turns a rotary axis, and its neighbours, have no look-ahead: each
/// is run from rest to rest at half of the acceleration, and the next one starts while it stops.
/// This is the trajectory planner of LinuxCNC as it behaves; `docs/time-law.md` has the comparison.
///
/// `is_linear` marks the linear axes, taken as at right angles; bounds of jerk are not used. It is
/// a model of times, not of positions.
///
/// # Errors
/// Invalid limits or blocks, with the index of the block.
///
/// ```
/// use facemill_feedrate::{AxisBounds, ProgramBlock, TrapezoidSettings, trapezoid_law};
/// use facemill_inverse_kinematics::AxisValues;
///
/// let axis = AxisBounds { velocity: 100.0, acceleration: 1000.0, jerk: 1e6 };
/// let block = |x: f64| ProgramBlock { end: AxisValues::from([x]), tip_time: 0.0, exact_stop: false };
/// let settings = TrapezoidSettings { tolerance: 0.0, look_ahead: 50, cycle: 0.001 };
/// let law = trapezoid_law(&AxisValues::zeros(1), &[block(50.0), block(100.0)], (&[axis], &[true]), &settings)?;
/// // 50/100 s at speed and 100/1000 s for the ramps, in each block.
/// assert!(law.times.iter().all(|t| (t - 0.6).abs() < 1e-12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn trapezoid_law(
    start: &AxisValues,
    blocks: &[ProgramBlock],
    (axes, is_linear): (&[AxisBounds], &[bool]),
    settings: &TrapezoidSettings,
) -> Result<TrapezoidLaw, ProgramLawError> {
    MotionBounds::new(axes.to_vec()).check()?;
    check_program(start, blocks.iter().copied(), axes.len().min(is_linear.len()))?;
    let mut segments: Vec<Segment> = Vec::with_capacity(blocks.len());
    let mut at = *start;
    for (k, block) in blocks.iter().enumerate() {
        if let Some(segment) = Segment::new(k, &at, block, (axes, is_linear), settings.cycle) {
            segments.push(segment);
            at = block.end;
        } else if let Some(last) = segments.last_mut() {
            last.exact_stop |= block.exact_stop;
        }
    }
    let entries = entries(&segments, axes, settings);
    let ends = end_speeds(&entries, settings.look_ahead);
    Ok(timed(blocks.len(), &segments, &entries, &ends, settings.tolerance))
}

/// State at the start of an entry: speed, and its way during an overlap.
#[derive(Clone, Copy, Default)]
struct Begun {
    speed: f64,
    way: f64,
}

/// Times the entries of a queue; overlaps pass corners within the tolerance.
pub(crate) fn timed(
    n_blocks: usize,
    segments: &[Segment],
    entries: &[Entry],
    ends: &[f64],
    tolerance: f64,
) -> TrapezoidLaw {
    let mut law =
        TrapezoidLaw { times: vec![0.0; n_blocks], peak_times: vec![0.0; n_blocks], limits: vec![None; n_blocks] };
    let mut begun = Begun::default();
    for (k, entry) in entries.iter().enumerate() {
        let (profile, end) = Profile::new(entry, begun, ends[k]);
        law.count(segments, entry, &profile);
        begun = Begun { speed: end, way: 0.0 };
        if let (End::Overlap, Some(next)) = (entry.end, entries.get(k + 1)) {
            let pace = |e: &Entry| Pace { acceleration: e.acceleration, speed: e.speed, length: e.length };
            let half = half_angle(&segments[entry.segment], &segments[next.segment]);
            let speeds = overlap(pace(entry), pace(next), half, tolerance);
            begun = start_of_next(speeds, &profile, entry.acceleration, next.acceleration);
        }
    }
    law
}

/// Returns the state of the next entry when this one has stopped: it accelerates in the same time
/// as this one slows down.
fn start_of_next(speeds: OverlapSpeeds, profile: &Profile, slowing: f64, starting: f64) -> Begun {
    let leaving = speeds.leaving.min(profile.peak);
    let time = leaving / slowing;
    let speed = (speeds.entering * leaving / speeds.leaving.max(f64::MIN_POSITIVE)).min(starting * time);
    Begun { speed, way: 0.5 * speed * time }
}

/// Speed over an entry: up, constant, down.
struct Profile {
    peak: f64,
    time: f64,
}

impl Profile {
    /// Returns the profile from the begun state to at most a speed at the end, and the speed that
    /// is reached there.
    fn new(entry: &Entry, begun: Begun, most_at_end: f64) -> (Self, f64) {
        let (a, v) = (entry.acceleration, begun.speed);
        let way = (entry.length - begun.way).max(0.0);
        let end = most_at_end.min((v * v + 2.0 * a * way).sqrt());
        let free = (0.5 * (2.0 * a * way + v * v + end * end)).sqrt();
        let peak = entry.speed.min(free).max(v).max(end).max(f64::MIN_POSITIVE);
        let ramps = (2.0 * peak * peak - v * v - end * end) / (2.0 * a);
        let time = (2.0 * peak - v - end) / a + (way - ramps).max(0.0) / peak;
        (Self { peak, time }, end)
    }
}

impl TrapezoidLaw {
    /// Adds an entry's time to its blocks.
    fn count(&mut self, segments: &[Segment], entry: &Entry, profile: &Profile) {
        let own = &segments[entry.segment];
        let next = segments.get(entry.segment + 1).filter(|_| entry.is_arc);
        let share = if next.is_some() { 0.5 } else { 1.0 };
        for segment in [Some(own), next].into_iter().flatten() {
            let block = segment.block;
            self.times[block] += share * profile.time;
            let peak_time = segment.whole / profile.peak;
            let slowest = &mut self.peak_times[block];
            if *slowest == 0.0 || peak_time < *slowest {
                *slowest = peak_time;
            }
            if self.limits[block] != Some(segment.speed_limit) {
                let is_at_speed = profile.peak >= segment.speed * (1.0 - 1e-9);
                let held = MotionLimit::Acceleration(segment.acceleration.1);
                self.limits[block] = Some(if is_at_speed { segment.speed_limit } else { held });
            }
        }
    }
}
