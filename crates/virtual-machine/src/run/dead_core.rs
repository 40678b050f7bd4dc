//! The middle of a face mill, which does not cut: is it in stock that nothing has removed before?

use std::collections::HashMap;
use std::f64::consts::TAU;

use facemill_cl_data::{Cancelled, ClPoint, Monitor, RoundFrustum, Solid};
use facemill_inverse_kinematics::Motion;
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use crate::motion::moves::Move;
use crate::motion::setup::ObstacleKind;
use crate::run::scene::{Role, RunScene, SceneObstacle, cl_of};
use crate::run::track::{Shape, Track};

/// The part of the cutter's bottom that does not cut, and everything that its ring has cut before.
///
/// The core is recessed, and the maker's largest ramp angle θ says by how much: on a straight ramp
/// the ring clears the way down to the height of its inner edge as it passes, and the far edge of
/// the core, a core's diameter behind, comes over that place 2·c·tan θ lower. So the core at that
/// height above the bottom may be in no stock but what the ring has removed: a plunge, a tool that
/// goes with its low edge behind, and an entry that is too steep leave some.
///
/// The ring's way is known as poses of all cutting moves of the program, a twentieth of the core's
/// radius apart; only those before a position count for it. Between them the ring is taken to reach
/// as much farther inward.
pub(crate) struct DeadCore {
    cutter: Cutter,
    /// The sampled disc, for asking whether any of it is near stock.
    shape: Shape,
    /// Points of the core where its recess ends, tool frame.
    samples: Vec<Point3<f64>>,
    /// Radius from which on the ring cuts, mm.
    inner: f64,
    /// Largest way of tip and rim between two poses, mm.
    spacing: f64,
    poses: Vec<CutPose>,
    /// Poses by the cell of their tip.
    cells: HashMap<[i32; 3], Vec<u32>>,
    cell: f64,
}

/// The tool in a cutting move.
#[derive(Clone, Copy, Debug)]
struct CutPose {
    cl: ClPoint,
    move_index: usize,
    /// Fraction of the move's time.
    at: f64,
}

/// How deep the core is in stock, and a point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InStock {
    /// Depth of the end of the core's recess below the stock's surface, mm.
    pub(crate) depth: f64,
    /// Workpiece frame.
    pub(crate) place: Point3<f64>,
    /// Index of the obstacle with the stock.
    pub(crate) obstacle: usize,
}

/// Where a position is in the program: its move, and the fraction of the move's time.
pub(crate) type Moment = (usize, f64);

/// Poses on the way over a radius of the core. More cost memory and time, fewer make the ring reach
/// farther inward.
const POSES_PER_RADIUS: f64 = 20.0;

/// Radii of the circles that the core is sampled on, in radii of the core, and points on each. The
/// outer one leaves room for what the ring is taken to reach inward.
const CIRCLES: [(f64, u32); 3] = [(0.0, 1), (0.45, 8), (0.8, 16)];

/// Added to the recess and taken off the stock, mm: rounding of words and of depths. Larger misses
/// as much of a core in stock, smaller reports rounding.
const SLACK: f64 = 0.05;

impl DeadCore {
    /// `None` where the tool cuts at its centre, may plunge, or nothing has stock on it.
    pub(crate) fn new(scene: &RunScene<'_>, moves: &[Move], monitor: &dyn Monitor) -> Result<Option<Self>, Cancelled> {
        let tool = scene.setup.tool;
        let radius = tool.dead_core_radius();
        let recess = recess(tool);
        if scene.settings.as_cut.tool || radius <= 0.0 || !recess.is_finite() || !scene.obstacles.iter().any(has_stock)
        {
            return Ok(None);
        }
        let circle = |(part, n): (f64, u32)| {
            (0..n).map(move |k| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
                Point3::new(part * radius * cos, part * radius * sin, recess)
            })
        };
        let outer = CIRCLES[2].0 * radius;
        let disc = RoundFrustum { z_low: recess, z_high: recess, radius_low: outer, radius_high: outer, rounding: 0.0 };
        let spacing = radius / POSES_PER_RADIUS;
        let cutter = *tool.cutter();
        let mut core = Self {
            cutter,
            shape: Shape::core_of(&Solid::Frustum(disc)),
            samples: CIRCLES.into_iter().flat_map(circle).collect(),
            inner: radius - spacing,
            spacing,
            poses: Vec::new(),
            cells: HashMap::new(),
            cell: cutter.radius().hypot(cutter.flute_length()),
        };
        for (index, m) in moves.iter().enumerate().filter(|(_, m)| !m.is_rapid) {
            monitor.checkpoint()?;
            core.add(scene, index, m);
        }
        Ok(Some(core))
    }

    /// Largest way between two positions at which the core is looked at, mm.
    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    fn add(&mut self, scene: &RunScene<'_>, move_index: usize, m: &Move) {
        let Ok(motion) = Motion::new(scene.setup.machine, m.law, &m.start, &m.end, scene.tool_length) else { return };
        let pose = |at: f64| -> Option<CutPose> {
            let axes = motion.at(at).ok()?;
            let work_from_tool = scene.work_from_table * scene.setup.machine.forward(&axes, scene.tool_length);
            Some(CutPose { cl: cl_of(&work_from_tool), move_index, at })
        };
        let Some((start, end)) = pose(0.0).zip(pose(1.0)) else { return };
        let turn = (end.cl.axis.into_inner() - start.cl.axis.into_inner()).norm();
        let way = (end.cl.tip - start.cl.tip).norm() + self.cutter.radius() * turn;
        // The cast saturates; no move of a machine has that many.
        let n = (way / self.spacing).ceil().clamp(1.0, 1e6) as u32;
        for k in 0..=n {
            let Some(pose) = pose(f64::from(k) / f64::from(n)) else { return };
            let index = self.poses.len() as u32;
            self.cells.entry(cell_of(&pose.cl.tip, self.cell)).or_default().push(index);
            self.poses.push(pose);
        }
    }

    /// The deepest point of the core in stock that is still there at this moment. `tracks` has one
    /// for each obstacle.
    pub(crate) fn in_stock(
        &self,
        scene: &RunScene<'_>,
        tracks: &mut [Track],
        work_from_tool: &Isometry3<f64>,
        moment: Moment,
    ) -> Option<InStock> {
        let n_before = self.poses.partition_point(|p| (p.move_index, p.at) < moment);
        // On most of a pass the ring was everywhere a moment before: this test is first, because it
        // costs least.
        let uncut = self.samples.iter().map(|s| work_from_tool * s).filter(|p| !self.is_cut_lately(p, n_before));
        let uncut: Vec<Point3<f64>> = uncut.collect();
        if uncut.is_empty() {
            return None;
        }
        let placed = self.shape.placed(*work_from_tool);
        let mut deepest = None::<InStock>;
        for (obstacle, o) in scene.obstacles.iter().enumerate().filter(|(_, o)| has_stock(o)) {
            if tracks[obstacle].nearest_within(o.stock, &self.shape, &placed, o.mesh()).is_none() {
                continue;
            }
            for place in &uncut {
                let Some(depth) = depth_in_stock(place, o) else { continue };
                if deepest.is_none_or(|d| depth > d.depth) && !self.is_cut(place, n_before) {
                    deepest = Some(InStock { depth, place: *place, obstacle });
                }
            }
        }
        deepest
    }

    /// Whether the ring cut this point on the way of some diameters before.
    fn is_cut_lately(&self, p: &Point3<f64>, n_before: usize) -> bool {
        let n = (4.0 * self.cutter.radius() / self.spacing) as usize;
        self.poses[n_before.saturating_sub(n)..n_before].iter().rev().any(|pose| self.cuts(&pose.cl, p))
    }

    /// Whether the ring cut this point at any time before.
    fn is_cut(&self, p: &Point3<f64>, n_before: usize) -> bool {
        let [x, y, z] = cell_of(p, self.cell);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
        around.filter_map(|cell| self.cells.get(&cell)).any(|poses| {
            poses.iter().map(|&k| k as usize).take_while(|&k| k < n_before).any(|k| self.cuts(&self.poses[k].cl, p))
        })
    }

    /// Whether a point is in the ring of a pose.
    fn cuts(&self, cl: &ClPoint, p: &Point3<f64>) -> bool {
        let from_tip: Vector3<f64> = p - cl.tip;
        let z = from_tip.dot(&cl.axis);
        if !(-SLACK..=self.cutter.flute_length()).contains(&z) {
            return false;
        }
        let radius_sq = from_tip.norm_squared() - z * z;
        let r = self.cutter.corner_radius();
        // The bottom's border rises with the corner.
        let below = (r - z.max(0.0)).max(0.0);
        let outer = self.cutter.radius() - r + (r * r - below * below).max(0.0).sqrt();
        radius_sq >= self.inner * self.inner && radius_sq <= outer * outer
    }
}

/// Height above the bottom at which the core may not meet stock, mm.
pub(crate) fn recess(tool: &ToolAssembly) -> f64 {
    if tool.max_ramp_angle() >= std::f64::consts::FRAC_PI_2 {
        return f64::INFINITY;
    }
    2.0 * tool.dead_core_radius() * tool.max_ramp_angle().tan() + SLACK
}

fn has_stock(o: &SceneObstacle<'_>) -> bool {
    match o.role {
        Role::Work(ObstacleKind::Stock) => true,
        Role::Work(ObstacleKind::Part | ObstacleKind::Check) => o.stock > SLACK,
        Role::Work(ObstacleKind::Fixture) | Role::Machine => false,
    }
}

/// How deep a point is in the uncut stock of an obstacle, mm; `None` where it is outside or less
/// than [`SLACK`] within.
fn depth_in_stock(p: &Point3<f64>, o: &SceneObstacle<'_>) -> Option<f64> {
    let point = RoundFrustum { z_low: 0.0, z_high: 0.0, radius_low: 0.0, radius_high: 0.0, rounding: 0.0 };
    let (solid, pose) = (Solid::Frustum(point), Isometry3::from(Translation3::from(p.coords)));
    let distance = |at_most: f64| o.mesh().core_distance(&solid, &pose, at_most, None).map(|s| s.distance);
    let depth = if o.role == Role::Work(ObstacleKind::Stock) {
        if o.mesh().verdict(&solid, &pose, None).is_free() {
            return None;
        }
        distance(f64::INFINITY)?
    } else {
        o.stock - distance(o.stock)?
    };
    (depth > SLACK).then_some(depth)
}

fn cell_of(p: &Point3<f64>, cell: f64) -> [i32; 3] {
    [p.x, p.y, p.z].map(|v| (v / cell).floor() as i32)
}
