use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass, Posture};
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::cusp::Strip;
use crate::lattice::Lattice;
use crate::pass_cost::{CuspScale, CuspTable};
use crate::smooth_pass::SmoothPass;
use crate::{FeasiblePose, Found, Hints, Infeasible, PoseTest, SearchCurve, SearchSettings, TurnTable, search};

/// How the postures of a pass are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PostureMode {
    /// At every point the smallest feasible posture of its search curve (CLOPT), raised where that is needed to keep the turn
    /// of the axis within [`PassSettings::max_turn_per_mm`].
    Smallest,
    /// The cheapest sequence over the whole pass, smoothed.
    Smooth(SmoothSettings),
    /// The same posture at every point, rotate counted toward the side that the search curve turns to.
    Fixed(Posture),
    /// The tool axis through a point or line.
    Toward(AxisTarget),
}

/// What the cheapest sequence of postures is counted by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothSettings {
    /// Programmed feed along the path, mm/s. Larger: axes move faster, so that their motion counts for more.
    pub feed: f64,
    /// Cusp that is allowed, mm. Larger: cusps count for less, motion for more.
    pub cusp: f64,
    /// What lies between a point and the neighbouring pass where that is not known.
    pub strip: Strip,
}

/// What the tool axis points to.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

impl AxisTarget {
    /// Tool axis at a CC point; `None` where the target is at the point itself.
    pub fn axis_at(&self, cc: &CcPoint) -> Option<Unit<Vector3<f64>>> {
        let target = match *self {
            Self::Point(point) => point,
            Self::Line { origin, direction } => {
                origin + direction.into_inner() * (cc.position - origin).dot(&direction)
            }
        };
        Unit::try_new(target - cc.position, 1e-9)
    }
}

/// How postures follow each other along a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSettings {
    /// How each point is searched.
    pub search: SearchSettings,
    /// How the postures of a pass are chosen.
    pub mode: PostureMode,
    /// Largest turn of the tool axis against surface and feed per path length, rad/mm. Where neighbouring points need
    /// different postures, the larger one is approached at this rate from both sides. Larger: less tilt spent on smoothness,
    /// but rotary axes that jump.
    pub max_turn_per_mm: f64,
}

impl PassSettings {
    /// How a point is searched where the posture that its neighbours suggest is not feasible; `None` where the mode allows no
    /// other.
    pub fn fallback(&self) -> Option<&SearchSettings> {
        match self.mode {
            PostureMode::Smallest | PostureMode::Smooth(_) => Some(&self.search),
            PostureMode::Fixed(_) | PostureMode::Toward(_) => None,
        }
    }
}

/// A pass and the curve its points are searched along.
#[derive(Clone, Debug)]
pub struct PassTask {
    /// CC points in cutting order.
    pub pass: Pass<CcPoint>,
    /// Search curve, with the sign of rotate that the cutting direction asks for.
    pub curve: SearchCurve,
    /// What lies between each point and the neighbouring pass; may be empty where nothing is known.
    pub strips: Vec<Option<Strip>>,
}

/// A pass with the poses of its points.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// A pose or a reason for every CC point.
    pub outcomes: Pass<Outcome>,
    /// How near to the best the sequence is, where one was sought.
    pub optimum: Option<Optimum>,
}

/// What the postures of a pass cost, in s: time of cutting, weighted with `(cusp / allowed cusp)²` and with
/// `Σ(speed / speed that is much)²` of the axes, over the points at which postures were chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optimum {
    /// The cheapest sequence in the graph of tested postures: no sequence of these costs less.
    pub graph: f64,
    /// The smoothed sequence, as planned, counted at the same points. It may cost less than the graph's, because it may take
    /// postures between those of the graph.
    pub smoothed: f64,
    /// Points at which postures were chosen and that have a pose.
    pub layers: usize,
    /// Steps between neighbouring points of the planned sequence on which the tool axis turns by more than the limit, or an
    /// axis of the machine would have to be faster than it can at the programmed feed.
    pub jumps: usize,
}

impl Optimum {
    /// How much more the smoothed sequence costs than the cheapest of the graph, as part of the latter; 0 where that costs
    /// nothing.
    pub fn gap(&self) -> f64 {
        if self.graph > 0.0 { self.smoothed / self.graph - 1.0 } else { 0.0 }
    }

    /// The sum over two passes.
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

/// What became of one CC point.
pub type Outcome = Result<FeasiblePose, Infeasible>;

/// Finds a pose for every CC point of every pass (CLOPT, items 3 and 4 of the method), as the mode asks.
///
/// `Smallest`: each point gets the smallest feasible posture of its curve; then the postures are raised where that is needed
/// to keep the turn of the axis along the pass below `max_turn_per_mm`, each raised one tested again (a raised posture that is
/// not feasible gives way to the next feasible one above it, or else to the point's own smallest).
///
/// `Smooth`: postures of a lattice over the search's ranges are tested at layers along the pass; the cheapest sequence is the
/// shortest way through them; the rotary axes are smoothed along it, and each point is tested in the posture that results. One
/// that is not feasible is raised until it is, and the band bent there; a point for which that fails gets the first feasible
/// posture of its curve, so that no point is left out that `Smallest` plans, or one beside the curve.
///
/// `Fixed` and `Toward` take the posture that they ask for or none.
///
/// Every pose has been tested as it stands. The result does not depend on the number of threads. The monitor advances by one
/// for every CC point.
///
/// # Errors
/// When the monitor cancels.
pub fn plan_passes(
    test: &PoseTest<'_>,
    tasks: &[PassTask],
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<Vec<PlannedPass>, Cancelled> {
    let grounds = match &settings.mode {
        PostureMode::Smooth(smooth) => Grounds::of(test, tasks, smooth),
        _ => Vec::new(),
    };
    tasks
        .par_iter()
        .map(|task| match &settings.mode {
            PostureMode::Smallest => smallest(test, task, settings, monitor),
            PostureMode::Smooth(smooth) => {
                let own = grounds.iter().find(|g| g.serves(&task.curve));
                let Some(Grounds { lattice, fine, cusps, .. }) = own else { return Ok(PlannedPass::empty()) };
                SmoothPass { test, task, settings, smooth, lattice, fine, cusps }.plan(monitor)
            }
            PostureMode::Fixed(amount) => {
                let turn = if task.curve.end().rotate < 0.0 { -1.0 } else { 1.0 };
                let posture = Posture { rotate: turn * amount.rotate, ..*amount };
                prescribed(test, task, |_| Some(posture), monitor)
            }
            PostureMode::Toward(target) => {
                prescribed(test, task, |cc| target.axis_at(cc).map(|axis| cc.posture_of(&axis)), monitor)
            }
        })
        .collect()
}

impl PlannedPass {
    fn empty() -> Self {
        Self { outcomes: Pass::new(Vec::new()), optimum: None }
    }
}

/// What the passes of one search range have in common.
struct Grounds {
    curve: SearchCurve,
    lattice: Lattice,
    fine: Lattice,
    cusps: CuspTable,
}

impl Grounds {
    /// One for every search range among the tasks that have points.
    fn of(test: &PoseTest<'_>, tasks: &[PassTask], smooth: &SmoothSettings) -> Vec<Self> {
        let known = tasks.iter().flat_map(|t| t.strips.iter().flatten().copied());
        let strips: Vec<Strip> = known.chain([smooth.strip]).collect();
        let scale = CuspScale { cutter: *test.cell.tool.cutter(), allowed: smooth.cusp };
        let mut all: Vec<Self> = Vec::new();
        for task in tasks.iter().filter(|t| !t.pass.points.is_empty()) {
            if !all.iter().any(|g| g.serves(&task.curve)) {
                let lattice = Lattice::new(&task.curve);
                let cusps = CuspTable::new(&scale, &lattice.postures, &strips);
                all.push(Self { curve: task.curve, lattice, fine: Lattice::fine(&task.curve), cusps });
            }
        }
        all
    }

    /// Whether a curve has the same ranges, to either side.
    fn serves(&self, curve: &SearchCurve) -> bool {
        *curve == self.curve || *curve == self.curve.mirrored()
    }
}

/// Postures that something else than the search decides: feasible or not.
fn prescribed(
    test: &PoseTest<'_>,
    task: &PassTask,
    posture: impl Fn(&CcPoint) -> Option<Posture>,
    monitor: &dyn Monitor,
) -> Result<PlannedPass, Cancelled> {
    let mut hints = Hints::default();
    let mut near = None;
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(task.pass.points.len());
    for cc in &task.pass.points {
        monitor.checkpoint()?;
        let outcome = match posture(cc).filter(|p| p.tilt < std::f64::consts::FRAC_PI_2) {
            Some(posture) => test.try_posture(cc, posture, near.as_ref(), &mut hints),
            None => Err(Infeasible::FromBelow),
        };
        near = outcome.as_ref().ok().map(|pose| pose.configuration).or(near);
        outcomes.push(outcome);
        monitor.advance(1);
    }
    Ok(PlannedPass { outcomes: Pass::new(outcomes), optimum: None })
}

fn smallest(
    test: &PoseTest<'_>,
    task: &PassTask,
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<PlannedPass, Cancelled> {
    let mut hints = Hints::default();
    let mut smallest: Vec<Result<Found, Infeasible>> = Vec::with_capacity(task.pass.points.len());
    for cc in &task.pass.points {
        monitor.checkpoint()?;
        let near = smallest.last().and_then(|r| r.as_ref().ok()).map(|f| f.pose.configuration);
        smallest.push(search(test, cc, &task.curve, &settings.search, 0.0, near.as_ref(), &mut hints));
        monitor.advance(1);
    }
    let mut found = smallest;
    for _ in 0..SMOOTHING_ROUNDS {
        let wanted = rate_limited(&task.pass, &found, &task.curve, settings.max_turn_per_mm);
        if !raise_to(test, task, settings, &wanted, &mut found, &mut hints) {
            break;
        }
        monitor.checkpoint()?;
    }
    let outcomes = Pass::new(found.into_iter().map(|r| r.map(|f| f.pose)).collect());
    Ok(PlannedPass { outcomes, optimum: None })
}

/// Raising one posture can ask for more at its neighbours when the raised one was not feasible; each round spreads that
/// by one rate-limited ramp, and more than a few rounds mean that the feasible set itself jumps.
const SMOOTHING_ROUNDS: usize = 4;

/// The smallest u at each point that is not below its own and changes by no more than the allowed turn from its neighbours.
fn rate_limited(
    pass: &Pass<CcPoint>,
    found: &[Result<Found, Infeasible>],
    curve: &SearchCurve,
    max_turn_per_mm: f64,
) -> Vec<Option<f64>> {
    let table = TurnTable::new(curve);
    let mut turn: Vec<Option<f64>> = found.iter().map(|r| r.as_ref().ok().map(|f| table.turn_at(f.u))).collect();
    let n = turn.len();
    let sweep = |turn: &mut Vec<Option<f64>>, from: usize, to: usize| {
        let step = (pass.points[to].position - pass.points[from].position).norm();
        if let (Some(a), Some(b)) = (turn[from], turn[to]) {
            turn[to] = Some(b.max(a - max_turn_per_mm * step));
        }
    };
    for k in 1..n {
        sweep(&mut turn, k - 1, k);
    }
    for k in (1..n).rev() {
        sweep(&mut turn, k, k - 1);
    }
    turn.into_iter().map(|t| t.map(|t| table.u_at(t))).collect()
}

/// Tests the wanted postures; returns whether any had to become larger than wanted.
fn raise_to(
    test: &PoseTest<'_>,
    task: &PassTask,
    settings: &PassSettings,
    wanted: &[Option<f64>],
    found: &mut [Result<Found, Infeasible>],
    hints: &mut Hints,
) -> bool {
    let mut larger = false;
    for k in 0..found.len() {
        let (Some(wanted), Ok(own)) = (wanted[k], found[k]) else { continue };
        if wanted <= own.u + 1e-9 {
            continue;
        }
        let cc = &task.pass.points[k];
        let near = k.checked_sub(1).and_then(|j| found[j].as_ref().ok()).map(|f| f.pose.configuration);
        if let Ok(raised) = search(test, cc, &task.curve, &settings.search, wanted, near.as_ref(), hints) {
            larger |= raised.u > wanted + settings.search.u_tolerance;
            found[k] = Ok(raised);
        }
    }
    larger
}
