//! Positions between which the control stays near the ideal motion between poses.

mod error;
mod segment;

use facemill_cl_data::ClPoint;

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::motion::BlockLaw;
use crate::motion::deviation::Deviation;
use crate::motion::linearise::segment::{Segment, Step, Trial};

pub use crate::motion::linearise::error::LineariseError;

/// Tolerances of the control's motion between two positions against the ideal motion. All of them
/// have to hold; infinity means no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionTolerance {
    /// Tolerance of the tip, mm.
    pub tip: f64,
    /// Tolerance of the tool axis, rad.
    pub axis: f64,
    /// Tolerance of any point of the cutter's rim, mm; see [`Deviation::rim`].
    pub rim: f64,
    /// Radius of the rim, mm.
    pub radius: f64,
}

impl MotionTolerance {
    /// Returns the same tolerance for tip and rim of a cutter with this radius, mm, and none for
    /// the axis itself.
    pub fn of_cutter(tolerance: f64, radius: f64) -> Self {
        Self { tip: tolerance, axis: f64::INFINITY, rim: tolerance, radius }
    }

    /// Returns the largest fraction of a tolerance that a deviation uses up: up to 1 all of them
    /// hold.
    pub fn used_by(&self, deviation: &Deviation) -> f64 {
        let parts = [deviation.tip / self.tip, deviation.axis / self.axis, deviation.rim(self.radius) / self.rim];
        // An infinite deviation over an infinite tolerance is NaN, and violates it.
        parts.into_iter().map(|part| if part.is_nan() { f64::INFINITY } else { part }).fold(0.0, f64::max)
    }

    fn check(&self) -> Result<(), LineariseError> {
        let sound = |v: f64, least: f64| v >= least;
        let field = if !sound(self.tip, LEAST_TOLERANCE.tip) {
            "tip"
        } else if !sound(self.axis, LEAST_TOLERANCE.axis) {
            "axis"
        } else if !sound(self.rim, LEAST_TOLERANCE.tip) {
            "rim"
        } else if !(self.radius >= 0.0 && self.radius.is_finite()) {
            "radius"
        } else {
            return Ok(());
        };
        Err(LineariseError::BadTolerance { field })
    }
}

/// Smallest tolerances, mm and rad: a thousand times the accuracy of the inverse solution. Below,
/// its rounding would decide whether a block holds.
const LEAST_TOLERANCE: Deviation = Deviation { tip: 1e-6, axis: 1e-9 };

/// Requirements of [`linearise`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearisation {
    /// Motion of the control between two positions.
    pub law: BlockLaw,
    /// Distance from the tip to the spindle nose, mm.
    pub tool_length: f64,
    /// Tolerance of that motion against the ideal one.
    pub tolerance: MotionTolerance,
    /// Largest number of positions inserted between two neighbouring poses.
    pub max_between: usize,
}

impl Linearisation {
    /// Sets at most 10,000 positions between two poses: half a turn of a rotary axis beside a pole,
    /// with a fixed tip, takes about a thousand.
    pub fn new(law: impl Into<BlockLaw>, tool_length: f64, tolerance: MotionTolerance) -> Self {
        Self { law: law.into(), tool_length, tolerance, max_between: 10_000 }
    }
}

/// A place of the ideal motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFraction {
    /// Index of the pose at or before it.
    pub pose: usize,
    /// Fraction of the motion to the next pose, 0 ≤ fraction < 1; exactly 0 at the pose itself.
    pub fraction: f64,
}

impl std::fmt::Display for PoseFraction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.fraction == 0.0 {
            write!(f, "pose {}", self.pose)
        } else {
            write!(f, "{:.5} of the way from pose {} to pose {}", self.fraction, self.pose, self.pose + 1)
        }
    }
}

/// Positions that hold a tolerance, and their bounds.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Linearised {
    /// Axis values of the given and the inserted poses, in the order of motion.
    pub positions: Vec<AxisValues>,
    /// Origin of each position.
    pub source: Vec<PoseFraction>,
    /// The largest bounds over all blocks, separately for tip and axis.
    pub bound: Deviation,
    /// The largest bound for the rim over all blocks, mm.
    pub rim: f64,
    /// Index of the position at the start of the block that uses up most of a tolerance; where the
    /// control turns the tool vector itself, of the block in which a rotary axis turns farthest.
    pub at: usize,
}

/// Returns positions between which the control stays within the tolerance of the ideal motion
/// between `poses`: from each to the next the tip on a straight line, the tool axis turning evenly
/// in the plane of its ends.
///
/// Every pose is kept, reached to 1e-9 mm and 1e-12 rad and within the limits. Positions are
/// inserted between poses only where [`deviation_bound`](crate::motion::deviation::deviation_bound)
/// exceeds the tolerance, as few as it requires, and such that all blocks between two poses use up
/// about the same fraction of it. The way starts at the position that is first reached from `start`
/// with every axis at its largest speed, and stays on that branch and winding of the rotary axes.
/// The branch changes only within a block that is proven to hold the tolerance: where the tool axis
/// passes through the pole itself, or closer to it than the tolerance. Where the first pose is at
/// the pole, its free axis takes the value that the first pose beside the pole needs.
///
/// Limits hold at the positions, and between them where axes move linearly. Under the RTCP laws the
/// linear axes bend between positions; [`Machine::axis_ranges`] returns by how much. Where the
/// control turns the tool vector itself, no tolerance is used up; positions are inserted such that
/// no rotary axis turns by more than 90° in a block, which leaves no doubt about its sense.
///
/// No poses give no positions. The result depends only on the arguments.
///
/// ```
/// use facemill_cl_data::{ClPoint, CuttingLaw};
/// use facemill_inverse_kinematics::motion::{Linearisation, MotionTolerance, linearise};
/// use facemill_inverse_kinematics::Machine;
/// use nalgebra::{Point3, Unit, Vector3};
///
/// let machine = Machine::head_b_table_c()?;
/// let pose = |x: f64, lean: f64| ClPoint {
///     tip: Point3::new(x, 300.0, 400.0),
///     axis: Unit::new_normalize(Vector3::new(0.2, lean, 1.0)),
/// };
/// let poses = [pose(900.0, 0.1), pose(905.0, 0.12), pose(950.0, 0.3)];
/// // 0.01 mm at the tip and at the rim of a cutter with a radius of 40 mm.
/// let tolerance = MotionTolerance::of_cutter(0.01, 40.0);
/// let settings = Linearisation::new(CuttingLaw::AxesLinear, 260.0, tolerance);
/// let way = linearise(&machine, &poses, &machine.home(), &settings)?;
/// assert!(way.rim <= 0.01 && way.positions.len() > poses.len());
/// for (q, source) in way.positions.iter().zip(&way.source) {
///     println!("{source}: {:?}", q.as_slice());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`LineariseError`], with the place: no motion is bent to avoid an error.
pub fn linearise(
    machine: &Machine,
    poses: &[ClPoint],
    start: &AxisValues,
    settings: &Linearisation,
) -> Result<Linearised, LineariseError> {
    settings.tolerance.check()?;
    let n_axes = machine.axes().len();
    if start.len() != n_axes || !start.is_finite() || !settings.tool_length.is_finite() {
        return Err(LineariseError::BadStart { n_axes });
    }
    let mut out = Linearised::with_capacity(poses.len());
    if poses.is_empty() {
        return Ok(out);
    }
    let mut stand = Trial::first(machine, poses, start, settings.tool_length)?;
    out.push(stand.values, 0, 0.0);
    let mut most_used = 0.0;
    for (pose, ends) in poses.windows(2).enumerate() {
        for step in Segment::new(machine, settings, pose, [&ends[0], &ends[1]], stand)?.steps()?.as_slice() {
            if step.used > most_used {
                (most_used, out.at) = (step.used, out.positions.len() - 1);
            }
            out.add(step, settings.tolerance.radius);
            stand = step.stand;
            let (pose, fraction) = if step.to < 1.0 { (pose, step.to) } else { (pose + 1, 0.0) };
            out.push(stand.values, pose, fraction);
        }
    }
    Ok(out)
}

impl Linearised {
    fn with_capacity(n: usize) -> Self {
        let (positions, source) = (Vec::with_capacity(n), Vec::with_capacity(n));
        Self { positions, source, bound: Deviation::default(), rim: 0.0, at: 0 }
    }

    fn push(&mut self, values: AxisValues, pose: usize, fraction: f64) {
        self.positions.push(values);
        self.source.push(PoseFraction { pose, fraction });
    }

    fn add(&mut self, step: &Step, radius: f64) {
        self.bound = self.bound.max(&step.deviation);
        self.rim = self.rim.max(step.deviation.rim(radius));
    }
}
