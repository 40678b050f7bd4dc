//! Passes to plan, the settings of their search, and its results.

use facemill_cl_data::{CcPoint, Pass, Posture};
use nalgebra::{Point3, Unit, Vector3};

use crate::cusp::cut_point::Strip;
use crate::pose::workcell::{FeasiblePose, Infeasible};
use crate::search::SearchSettings;
use crate::search::bezier::SearchCurve;

/// How the postures of a pass are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PostureMode {
    /// The smallest feasible posture of the search curve at every point (CLOPT), raised where that
    /// is needed to keep the turn of the axis within [`PassSettings::max_turn_per_mm`].
    Smallest,
    /// The cheapest sequence over the whole pass, smoothed.
    Smooth(SmoothSettings),
    /// The same posture at every point, rotate counted toward the side of the search curve.
    Fixed(Posture),
    /// The tool axis through a point or line.
    Toward(AxisTarget),
    /// At every point that of the task ([`PassTask::given`]).
    Given,
}

/// Settings of the cheapest sequence of postures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothSettings {
    /// Programmed feed along the path, mm/s. Larger: axes move faster, so their motion counts for
    /// more.
    pub feed: f64,
    /// Allowed cusp, mm. Larger: cusps count for less, motion for more.
    pub cusp: f64,
    /// Strip between a point and the neighbouring pass where none is known.
    pub strip: Strip,
    /// Largest step-over that counts, mm: wider strips count as this wide, because of a gap that no
    /// two passes cover each cuts its side. Infinite for passes that are cut as they are.
    pub widest: f64,
}

/// Target of the tool axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum AxisTarget {
    /// From the CC point to this point, workpiece frame: the spindle is on its side.
    Point(Point3<f64>),
    /// From the CC point to the nearest point of this line, workpiece frame.
    Line {
        /// A point of the line.
        origin: Point3<f64>,
        /// Its direction.
        direction: Unit<Vector3<f64>>,
    },
    /// This direction everywhere: rotary axes at rest.
    Direction(Unit<Vector3<f64>>),
}

impl AxisTarget {
    /// Returns the tool axis at a CC point; `None` where the target is at the point itself.
    pub fn axis_at(&self, cc: &CcPoint) -> Option<Unit<Vector3<f64>>> {
        let target = match *self {
            Self::Direction(direction) => return Some(direction),
            Self::Point(point) => point,
            Self::Line { origin, direction } => {
                origin + direction.into_inner() * (cc.position - origin).dot(&direction)
            }
        };
        Unit::try_new(target - cc.position, 1e-9)
    }
}

/// Settings for the postures along a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSettings {
    /// How each point is searched.
    pub search: SearchSettings,
    /// How the postures of a pass are chosen.
    pub mode: PostureMode,
    /// Largest turn of the tool axis against surface and feed per path length, rad/mm. Where
    /// neighbouring points need different postures, the larger one is approached at this rate from
    /// both sides. Larger: less tilt spent on smoothness, but rotary axes that jump.
    pub max_turn_per_mm: f64,
}

impl PassSettings {
    /// Returns the search of a point where the posture that its neighbours suggest is not feasible;
    /// `None` where the mode allows no other.
    pub fn fallback(&self) -> Option<&SearchSettings> {
        match self.mode {
            PostureMode::Smallest | PostureMode::Smooth(_) => Some(&self.search),
            PostureMode::Fixed(_) | PostureMode::Toward(_) | PostureMode::Given => None,
        }
    }
}

/// A pass and the search curve of its points.
#[derive(Clone, Debug)]
pub struct PassTask {
    /// CC points in cutting order.
    pub pass: Pass<CcPoint>,
    /// Search curve, with the sign of rotate that the cutting direction requires.
    pub curve: SearchCurve,
    /// Strip between each point and the neighbouring pass; may be empty if none is known.
    pub strips: Vec<Option<Strip>>,
    /// Posture of every point in the mode [`PostureMode::Given`], of any sign of rotate; may be
    /// empty in others.
    pub given: Vec<Posture>,
}

/// A pass with the poses of its points.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// A pose or a reason for every CC point.
    pub outcomes: Pass<Outcome>,
    /// How near to the best the sequence is, where one was sought.
    pub optimum: Option<Optimum>,
}

/// Costs of a pass' postures, s: time of cutting, weighted with `(cusp / allowed cusp)²` and with
/// `Σ(speed / speed that is much)²` of the axes, over the points at which postures were chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optimum {
    /// The cheapest sequence in the graph of tested postures: no sequence of these costs less.
    pub graph: f64,
    /// The smoothed sequence, as planned, counted at the same points. It may cost less than the
    /// graph's, because it may take postures between those of the graph.
    pub smoothed: f64,
    /// Points at which postures were chosen and that have a pose.
    pub layers: usize,
    /// Steps between neighbouring points of the planned sequence on which the tool axis turns by
    /// more than the limit, or an axis of the machine would have to be faster than it can at the
    /// programmed feed.
    pub jumps: usize,
}

impl Optimum {
    /// Returns how much more the smoothed sequence costs than the cheapest of the graph, as a
    /// fraction of the latter; 0 where that costs nothing.
    pub fn gap(&self) -> f64 {
        if self.graph > 0.0 { self.smoothed / self.graph - 1.0 } else { 0.0 }
    }

    /// Returns the sum over two passes.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            graph: self.graph + other.graph,
            smoothed: self.smoothed + other.smoothed,
            layers: self.layers + other.layers,
            jumps: self.jumps + other.jumps,
        }
    }
}

/// Result at one CC point.
pub type Outcome = Result<FeasiblePose, Infeasible>;

impl PlannedPass {
    pub(crate) fn empty() -> Self {
        Self { outcomes: Pass::new(Vec::new()), optimum: None }
    }
}
