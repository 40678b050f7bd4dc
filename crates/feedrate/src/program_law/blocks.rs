use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use super::corner::{LineMotion, ProgramLine, stops_between};
use super::knots::Grain;
use super::law::{Motion, ProgramLaw};
use super::polyline::Polyline;
use super::rounded::RoundedLine;
use super::section::Section;
use super::spans::Spans;
use crate::time_law::barrier::Scaled;
use crate::time_law::{AxisBounds, MotionBounds, TimeLawError};

/// A block of a program to be timed: a straight line of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgramBlock {
    /// Axis values at its end; it starts where the one before it ends.
    pub end: AxisValues,
    /// Least time by its tip feed, s: the tip's way over the feed (Dc/Fc, FEED (4)); 0 where the
    /// feed is not capped.
    pub tip_time: f64,
    /// Whether the axes stop at its end.
    pub exact_stop: bool,
}

/// Settings of a program's time law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgramSettings {
    /// Largest deviation of each axis from the program's lines where corners are blended, mm or
    /// rad; `None` stops at every corner. Where a blend within it would take longer than a stop,
    /// the axes stop.
    pub tolerance: Option<AxisValues>,
    /// Length of the spans of the law where the path would allow longer ones, as a fraction of the
    /// time in which an axis accelerates from rest to its largest speed. Shorter ones come nearer
    /// to the least time and cost more computing.
    pub resolution: f64,
}

impl ProgramSettings {
    /// Blends corners within this tolerance of each axis, mm or rad.
    pub fn blended(tolerance: AxisValues) -> Self {
        Self { tolerance: Some(tolerance), resolution: 0.15 }
    }

    /// Stops at every corner.
    pub fn stopping() -> Self {
        Self { tolerance: None, resolution: 0.15 }
    }
}

/// Reason why a program has no time law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramLawError {
    /// A limit is wrong.
    #[error(transparent)]
    Bounds(#[from] TimeLawError),
    /// The start position of the program is not finite, or its number of axes differs from the
    /// number of limits.
    #[error("the start has {axes} axes with limits for {bounds}, or a value that is not finite")]
    BadStart {
        /// Axes of the start.
        axes: usize,
        /// Axes with limits.
        bounds: usize,
    },
    /// A block's end is not finite.
    #[error("block {block}: the value of axis {axis} at its end is not finite")]
    NotFinite {
        /// Index of the block, from 0.
        block: usize,
        /// Index of the axis.
        axis: usize,
    },
    /// A block has another number of axes.
    #[error("block {block} has {axes} axes, but limits are given for {bounds}")]
    AxisCount {
        /// Index of the block, from 0.
        block: usize,
        /// Its axes.
        axes: usize,
        /// Axes with limits.
        bounds: usize,
    },
    /// A block's least time is negative or not finite.
    #[error("block {block}: the least time by its tip feed is {tip_time} s, but has to be a finite number from 0 up")]
    BadTipTime {
        /// Index of the block, from 0.
        block: usize,
        /// Given time, s.
        tip_time: f64,
    },
    /// The tolerance is not a positive number for every axis.
    #[error(
        "the blend tolerance of axis {axis} is {value}, but has to be a finite number above 0; leave it out to stop"
    )]
    BadTolerance {
        /// Index of the axis.
        axis: usize,
        /// Given value, mm or rad; 0 where it is missing.
        value: f64,
    },
    /// The resolution is not a positive number.
    #[error("the resolution is {value}, but has to be a finite number above 0")]
    BadResolution {
        /// Given value.
        value: f64,
    },
}

/// Lines shorter than this are left out, s at the axes' largest speeds: 1e-8 mm at 100 mm/s.
const SHORTEST: f64 = 1e-10;

/// Least tolerance, mm or rad; used where the program stops at every corner. Below it rounding
/// would count.
const STRAIGHT: f64 = 1e-9;

/// Computes a fast motion of a program from rest to rest: within velocity, acceleration and jerk of
/// every axis and the tip feed of every block, corners blended within the tolerance, with
/// look-ahead over the whole program.
///
/// Guarantee: no limit is exceeded at any time, proven by Bernstein coefficients to rounding, and
/// no axis is farther from the program's lines than its tolerance. The cost is linear in the number
/// of blocks. The time is not proven to be the least one. Blocks without motion take no time. The
/// result does not depend on the number of threads.
///
/// # Errors
/// Invalid limits, settings or blocks, with the index of the block.
///
/// ```
/// use facemill_feedrate::{AxisBounds, ProgramBlock, ProgramSettings, program_law};
/// use facemill_inverse_kinematics::AxisValues;
///
/// let axis = AxisBounds { velocity: 100.0, acceleration: 1000.0, jerk: 20_000.0 };
/// let block = |x: f64, y: f64| ProgramBlock { end: AxisValues::from([x, y]), tip_time: 0.0, exact_stop: false };
/// let blocks = [block(50.0, 0.0), block(100.0, 10.0)];
/// let start = AxisValues::zeros(2);
/// let blended = ProgramSettings::blended(AxisValues::from([0.05, 0.05]));
/// let law = program_law(&start, &blocks, &[axis, axis], &blended)?;
/// let stopping = program_law(&start, &blocks, &[axis, axis], &ProgramSettings::stopping())?;
/// // With stops X takes 50/100 + 100/1000 + 1000/20000 s in each block.
/// assert!((stopping.total_time() - 1.3).abs() < 1e-9 && law.total_time() < stopping.total_time());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn program_law(
    start: &AxisValues,
    blocks: &[ProgramBlock],
    axes: &[AxisBounds],
    settings: &ProgramSettings,
) -> Result<ProgramLaw, ProgramLawError> {
    program_law_of(start, blocks.iter().copied(), axes, settings)
}

/// Computes [`program_law`] for blocks that are generated on demand, several times and identically
/// each time: a million of them need not be stored.
///
/// # Errors
/// As [`program_law`].
pub fn program_law_of(
    start: &AxisValues,
    blocks: impl ExactSizeIterator<Item = ProgramBlock> + Clone,
    axes: &[AxisBounds],
    settings: &ProgramSettings,
) -> Result<ProgramLaw, ProgramLawError> {
    let bounds = MotionBounds::new(axes.to_vec());
    bounds.check()?;
    check(start, blocks.clone(), axes.len(), settings)?;
    let scaled = Scaled::new(&bounds);
    let tolerance = settings.tolerance.unwrap_or_else(|| AxisValues::from_fn(start.len(), |_| STRAIGHT));
    let grain = grain(axes, settings.resolution);
    let plan = |stretch: Stretch| match stretch {
        Stretch::Line(line) => Motion::Lines(vec![line]),
        Stretch::Lines(polyline) => blended(polyline, &tolerance, &grain, &scaled, axes),
    };
    let (points, stretches) = stretches(start, blocks, axes, settings.tolerance.as_ref());
    let planned: Vec<Motion> = stretches.into_par_iter().map(plan).collect();
    Ok(ProgramLaw::new(points, axes.len(), planned))
}

/// Returns the faster of the possible motions over several lines.
fn blended(polyline: Polyline, tolerance: &AxisValues, grain: &Grain, scaled: &Scaled, axes: &[AxisBounds]) -> Motion {
    // Corners are decided one by one, so blending all of them may still be slower than stopping.
    let stopping: f64 = polyline.stopping(axes).map(|line| line.curve.duration()).sum();
    let lines = polyline.lines() as f64;
    let rounded = || RoundedLine::along(&polyline, axes, tolerance);
    let duration = |rounded: &[RoundedLine]| rounded.iter().map(RoundedLine::duration).sum::<f64>();
    let path = Spans::along(&polyline, tolerance, grain, SPANS_A_LINE);
    let mut is_rounding = true;
    if let Some(path) = path {
        is_rounding = path.bending() as f64 > SMOOTH * lines;
        // Rounded corners are not stored next to the spline: they are computed again where they are
        // faster.
        let others = if is_rounding { stopping.min(duration(&rounded())) } else { stopping };
        let section = Section::plan(&polyline, path, scaled);
        if section.duration() <= others {
            return Motion::Spline(Box::new((polyline, section)));
        }
    }
    let rounded = if is_rounding { rounded() } else { Vec::new() };
    let is_quicker = is_rounding && duration(&rounded) < stopping;
    if is_quicker { Motion::Rounded(rounded) } else { Motion::Lines(polyline.stopping(axes).collect()) }
}

/// Ratio of spans to lines up to which a spline over several lines is so much faster than rounded
/// corners that these are not computed.
const SMOOTH: f64 = 0.7;

/// Ratio of spans to lines up to which a spline over several lines is worth its computing, not
/// counting those for the way from rest and back. With more, each corner has spans of its own, and
/// rounded corners take some percent more or less time for a tenth of the computing.
const SPANS_A_LINE: f64 = 3.0;

/// Motion between two stops.
enum Stretch {
    /// One line.
    Line(LineMotion),
    /// Several lines.
    Lines(Polyline),
}

/// Collects lines until the axes stop.
struct Open<'a> {
    axes: &'a [AxisBounds],
    polyline: Polyline,
    last: Option<ProgramLine>,
    out: Vec<Stretch>,
}

impl Open<'_> {
    fn push(&mut self, block: usize, line: ProgramLine, end: &AxisValues, cap: f64) {
        self.polyline.push(end, line.length, cap, block);
        self.last = Some(line);
    }

    /// Ends the lines so far; the next ones start at `at`.
    fn stop(&mut self, at: &AxisValues) {
        let Some(line) = self.last.take() else { return };
        if self.polyline.lines() == 1 {
            let (block, cap) = (self.polyline.blocks[0], self.polyline.caps[0]);
            self.out.push(Stretch::Line(LineMotion { block, curve: line.alone(), cap }));
            self.polyline.restart(at);
        } else {
            let polyline = std::mem::replace(&mut self.polyline, Polyline::new(at));
            self.out.push(Stretch::Lines(polyline));
        }
    }
}

/// Returns the points at the ends of the blocks, one after the other from the start on, and the
/// stretches between stops. A block without motion ends where the one before it does.
fn stretches(
    start: &AxisValues,
    blocks: impl ExactSizeIterator<Item = ProgramBlock>,
    axes: &[AxisBounds],
    tolerance: Option<&AxisValues>,
) -> (Vec<f64>, Vec<Stretch>) {
    let mut points = Vec::with_capacity((blocks.len() + 1) * axes.len());
    points.extend_from_slice(start.as_slice());
    let mut open = Open { axes, polyline: Polyline::new(start), last: None, out: Vec::new() };
    let mut at = *start;
    for (index, block) in blocks.enumerate() {
        let length = length(&at, &block.end, axes);
        if length > SHORTEST {
            let cap = if block.tip_time > 0.0 { length / block.tip_time } else { f64::INFINITY };
            let line = ProgramLine::new(&at, &block.end, length, cap, axes);
            if open.last.is_some_and(|last| stops_between(&last, &line, open.axes, tolerance)) {
                open.stop(&at);
            }
            open.push(index, line, &block.end, cap);
            at = block.end;
        }
        if block.exact_stop {
            open.stop(&at);
        }
        points.extend_from_slice(at.as_slice());
    }
    open.stop(&at);
    (points, open.out)
}

/// Returns span lengths fine enough for the changes of speed of every axis.
fn grain(axes: &[AxisBounds], resolution: f64) -> Grain {
    let least = |f: fn(&AxisBounds) -> f64| axes.iter().map(f).fold(f64::INFINITY, f64::min);
    // Time from rest to the largest speed; half of it is the way at that speed.
    let rise = least(|b| b.velocity / b.acceleration + b.acceleration / b.jerk);
    Grain { span: resolution * rise, ramp: 0.5 * rise }
}

/// Returns the length of a line, s: axes by the time that they take at their largest speeds.
pub(crate) fn length(from: &AxisValues, to: &AxisValues, axes: &[AxisBounds]) -> f64 {
    axes.iter().enumerate().map(|(k, b)| (to[k] - from[k]) / b.velocity).fold(0.0, f64::hypot)
}

fn check(
    start: &AxisValues,
    blocks: impl Iterator<Item = ProgramBlock>,
    bounds: usize,
    settings: &ProgramSettings,
) -> Result<(), ProgramLawError> {
    if !(settings.resolution > 0.0 && settings.resolution.is_finite()) {
        return Err(ProgramLawError::BadResolution { value: settings.resolution });
    }
    if let Some(tolerance) = &settings.tolerance
        && let Some(axis) = (0..bounds).find(|&k| !(STRAIGHT..f64::INFINITY).contains(&tolerance.get_or_zero(k)))
    {
        return Err(ProgramLawError::BadTolerance { axis, value: tolerance.get_or_zero(axis) });
    }
    check_program(start, blocks, bounds)
}

/// Refuses an invalid start or blocks.
pub(crate) fn check_program(
    start: &AxisValues,
    blocks: impl Iterator<Item = ProgramBlock>,
    bounds: usize,
) -> Result<(), ProgramLawError> {
    if bounds == 0 || start.len() != bounds || !start.is_finite() {
        return Err(ProgramLawError::BadStart { axes: start.len(), bounds });
    }
    for (block, b) in blocks.enumerate() {
        if b.end.len() != bounds {
            return Err(ProgramLawError::AxisCount { block, axes: b.end.len(), bounds });
        }
        if let Some(axis) = b.end.iter().position(|q| !q.is_finite()) {
            return Err(ProgramLawError::NotFinite { block, axis });
        }
        if !(b.tip_time >= 0.0 && b.tip_time.is_finite()) {
            return Err(ProgramLawError::BadTipTime { block, tip_time: b.tip_time });
        }
    }
    Ok(())
}
