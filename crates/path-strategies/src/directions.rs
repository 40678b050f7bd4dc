//! Directions of parallel planes for a region: by its extent, and by the motion of the rotary axes.

use facemill_cc_path::files::ParallelPlanesFile;
use facemill_cl_data::{CcPoint, ClPoint};
use facemill_cutter_location::cusp::expected_posture;
use facemill_inverse_kinematics::{AxisKind, AxisValues, BranchPreference};
use facemill_job::format::job_file::OperationFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::pass_surface::{extended_region, surface_of};
use facemill_surface_model::CurvatureTensor;
use facemill_tool_model::cl_from_cc;
use facemill_tool_path::segments::LaidTask;
use nalgebra::{Unit, Vector3};

/// Names of the directions of planes, in the order of a comparison.
pub(crate) const DIRECTIONS: [&str; 5] = ["along", "across", "diagonal", "counterdiagonal", CALM];

/// Direction along which the rotary axes move least.
const CALM: &str = "of least rotary motion";

/// Parallel planes of a direction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DirectedPlanes {
    /// One of [`DIRECTIONS`].
    pub(crate) direction: &'static str,
    pub(crate) file: ParallelPlanesFile,
    /// Middle of the region's points, mm.
    pub(crate) middle: [f64; 3],
}

/// Length of the mean of unit normals below which a region has no side to lay planes across.
const NO_SIDE: f64 = 0.3;

/// Largest number of points at which the motion of the rotary axes is estimated.
const MOTION_POINTS: usize = 200;

/// Directions in half a turn whose motion of the rotary axes is estimated: a multiple of four, so
/// that those by the extent are among them.
const TRIALS: usize = 12;

/// Step along the surface for the speeds of the axes, mm.
const STEP: f64 = 1.0;

/// Fraction of the estimated time by which another direction has to be better than those by the
/// extent.
const WORTH: f64 = 0.02;

/// Estimated time over the feed's of a point that the machine does not reach.
const UNREACHED: f64 = 10.0;

/// Returns the parallel planes of an operation by the points laid for it, whose middle extent is
/// `extent`.
pub(crate) fn directed_planes(
    (job, setup): (&Job, &Setup<'_>),
    operation: &OperationFile,
    (extent, tasks): (&Extent, &[LaidTask]),
) -> Vec<DirectedPlanes> {
    let motion = RotaryMotion { job, setup, operation };
    extent.planes().into_iter().chain(motion.calm_planes(extent, tasks)).collect()
}

/// Directions of a region's points.
pub(crate) struct Extent {
    /// Mean of the points, mm.
    middle: Vector3<f64>,
    /// Mean normal.
    toward: Vector3<f64>,
    /// Longer side of the smallest rectangle around the points, across it.
    pub(crate) longest: Vector3<f64>,
}

impl Extent {
    /// Returns the directions of points; `None` if their normals cancel.
    pub(crate) fn of(points: &[CcPoint]) -> Option<Self> {
        let n = points.len().max(1) as f64;
        let mean = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.normal.into_inner()) / n;
        let middle = points.iter().fold(Vector3::zeros(), |sum, p| sum + p.position.coords) / n;
        let toward = mean.try_normalize(NO_SIDE)?;
        let across = [0, 1, 2].map(|k| Vector3::ith(k, 1.0));
        // The first coordinate axis that is far enough from the mean normal: the frame is exact for
        // parts that lie along the axes, and the same for all noise of the normals.
        let u = across.into_iter().find(|a| toward.dot(a).abs() < 0.6)?;
        let u = (u - toward * toward.dot(&u)).try_normalize(1e-9)?;
        let v = toward.cross(&u);
        let flat: Vec<[f64; 2]> =
            points.iter().map(|p| [u.dot(&p.position.coords), v.dot(&p.position.coords)]).collect();
        let longest = longest_side(flat)?;
        let longest = u * longest[0] + v * longest[1];
        Some(Self { middle, toward, longest })
    }

    /// Returns the direction at this fraction of half a turn from the longest extent.
    fn at(&self, turn: f64) -> Vector3<f64> {
        let (sin, cos) = (std::f64::consts::PI * turn).sin_cos();
        self.longest * cos + self.toward.cross(&self.longest) * sin
    }

    /// Returns planes that passes in a direction lie in.
    fn planes_along(&self, direction: &Vector3<f64>) -> ParallelPlanesFile {
        let normal = self.toward.cross(direction);
        let normal = normal * normal[normal.iamax()].signum();
        // Planes that lean from a border by noise would cut the last passes there in crumbs.
        let normal = normal.map(|c| if c.abs() < SNAP { 0.0 } else { c }).normalize();
        // Short numbers, for people who copy them into a job.
        let normal = [0, 1, 2].map(|c| (normal[c] * 1e4).round() / 1e4 + 0.0);
        ParallelPlanesFile { normal, origin_mm: [0.0; 3], from_mm: None, to_mm: None }
    }

    /// Returns the middle to 0.1 mm.
    fn rounded_middle(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| (self.middle[c] * 10.0).round() / 10.0 + 0.0)
    }

    /// Returns planes along and across the longest extent, and between both.
    fn planes(&self) -> [DirectedPlanes; 4] {
        let of = |which: usize, turn: f64| DirectedPlanes {
            direction: DIRECTIONS[which],
            file: self.planes_along(&self.at(turn)),
            middle: self.rounded_middle(),
        };
        [of(0, 0.0), of(1, 0.5), of(2, 0.25), of(3, 0.75)]
    }
}

/// Largest component of a normal, rad, that is taken as noise of the points.
const SNAP: f64 = 0.01;

/// Excess of an area or length over another that is rounding, as a fraction.
const ROUNDING: f64 = 1e-6;

/// Returns the direction of the longer side of the smallest rectangle around points in a plane, as
/// a side of their hull is; of equal rectangles the one whose side is nearest to the first axis, of
/// equal sides that nearer to it. `None` if the points are one.
fn longest_side(points: Vec<[f64; 2]>) -> Option<[f64; 2]> {
    let hull = hull(points);
    let sides = (0..hull.len()).filter_map(|k| {
        let (a, b) = (hull[k], hull[(k + 1) % hull.len()]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        (length > 0.0).then(|| [(b[0] - a[0]) / length, (b[1] - a[1]) / length])
    });
    let mut best: Option<(f64, [f64; 2])> = None;
    for side in sides {
        let extent = |d: [f64; 2]| {
            let along = hull.iter().map(|p| p[0] * d[0] + p[1] * d[1]);
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        let beside = [-side[1], side[0]];
        let [along, across] = [side, beside].map(extent);
        let is_square = (along - across).abs() <= ROUNDING * along.max(across);
        let longer = if is_square { side[0].abs() >= side[1].abs() } else { along > across };
        let side = if longer { side } else { beside };
        let area = along * across;
        let is_better = best.is_none_or(|(least, known)| {
            let is_same = (area - least).abs() <= ROUNDING * least;
            if is_same { side[0].abs() > known[0].abs() + ROUNDING } else { area < least }
        });
        if is_better {
            best = Some((area, side));
        }
    }
    best.map(|(_, side)| side)
}

/// Returns the corners of the convex hull of points in a plane, counterclockwise.
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let turns_left =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while chain.len() >= 2 && !turns_left(chain[chain.len() - 2], chain[chain.len() - 1], p) {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let [mut lower, mut upper] = [half(&mut points.iter().copied()), half(&mut points.iter().rev().copied())];
    // Each chain ends where the other begins.
    lower.pop();
    upper.pop();
    lower.append(&mut upper);
    lower
}

/// Motion of the rotary axes along an operation's region.
struct RotaryMotion<'m, 'j> {
    job: &'m Job,
    setup: &'m Setup<'j>,
    operation: &'m OperationFile,
}

impl RotaryMotion<'_, '_> {
    /// Returns the planes along which the rotary axes cost least time; `None` if planes by the
    /// extent cost hardly more.
    fn calm_planes(&self, extent: &Extent, tasks: &[LaidTask]) -> Option<DirectedPlanes> {
        let all: Vec<(&LaidTask, &CcPoint)> =
            tasks.iter().flat_map(|task| task.pass.points.iter().map(move |cc| (task, cc))).collect();
        let some: Vec<(&LaidTask, &CcPoint)> =
            all.iter().step_by(all.len().div_ceil(MOTION_POINTS).max(1)).copied().collect();
        let within = self.setup.drive_allowance.abs() + ON_SURFACE;
        let extended = extended_region(self.job, self.setup, self.operation).ok().flatten();
        let surface = surface_of(self.setup, extended.as_deref());
        let curved: Vec<(&LaidTask, &CcPoint, Option<CurvatureTensor>)> = some
            .into_iter()
            .map(|(task, cc)| {
                let foot = surface.closest_point(&cc.position, within);
                (task, cc, foot.and_then(|foot| surface.curvature_at(&foot)))
            })
            .collect();
        let time = |number: usize| -> f64 {
            let direction = extent.at(number as f64 / TRIALS as f64);
            // Passes one way and the other: the order of a comparison decides between both.
            let both = [direction, -direction].map(|direction| {
                let of_point = |(task, cc, tensor): &(&LaidTask, &CcPoint, Option<CurvatureTensor>)| {
                    self.time_over_feed(task, cc, tensor.as_ref(), &direction).unwrap_or(UNREACHED)
                };
                curved.iter().map(of_point).sum::<f64>() / curved.len().max(1) as f64
            });
            both[0].min(both[1])
        };
        let times: Vec<f64> = (0..TRIALS).map(time).collect();
        let by_extent = times.iter().step_by(TRIALS / 4).copied().fold(f64::INFINITY, f64::min);
        let (calm, least) = times.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        let file = || extent.planes_along(&extent.at(calm as f64 / TRIALS as f64));
        let planes = || DirectedPlanes { direction: CALM, file: file(), middle: extent.rounded_middle() };
        (*least < (1.0 - WORTH) * by_extent).then(planes)
    }

    /// Returns an estimate of the time over that of the feed at a point, for a pass in a direction
    /// with the expected posture: by the speeds of the rotary axes against their largest ones, a
    /// little above 1 also where these suffice. `None` if the machine does not reach it.
    fn time_over_feed(
        &self,
        task: &LaidTask,
        cc: &CcPoint,
        tensor: Option<&CurvatureTensor>,
        direction: &Vector3<f64>,
    ) -> Option<f64> {
        let here = CcPoint::new(cc.position, cc.normal.into_inner(), *direction).ok()?;
        let cutter = self.job.tool.cutter();
        let posture = expected_posture(cutter, &here, tensor, &task.curve);
        let turned = tensor.map_or_else(Vector3::zeros, |t| t.tensor * here.feed.into_inner());
        let normal = Unit::try_new(here.normal.into_inner() + turned * STEP, 1e-9)?;
        let next = CcPoint::new(here.position + here.feed.into_inner() * STEP, normal.into_inner(), *direction).ok()?;
        let [from, to] = [here, next].map(|cc| cl_from_cc(cutter, &cc, posture));
        let from = self.axes_at(&from, None)?;
        let to = self.axes_at(&to, Some(&from))?;
        let time = STEP / (self.operation.feeds.cutting_mm_min / 60.0);
        let rotary = self.job.machine.axes().iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Rotary);
        let speeds = rotary.map(|(k, axis)| (to[k] - from[k]).abs() / time / axis.max_velocity);
        Some(speeds.fold(0.0, f64::max).hypot(1.0))
    }

    fn axes_at(&self, cl: &ClPoint, before: Option<&AxisValues>) -> Option<AxisValues> {
        let on_table = cl.transformed(&self.setup.table_from_work);
        let length = self.job.tool.gauge_length();
        self.job.machine.nearest_inverse(&on_table, length, before, BranchPreference::Nearest).ok()
    }
}

/// Largest distance of a laid point from its foot on the surface, mm.
const ON_SURFACE: f64 = 0.1;

#[cfg(test)]
#[path = "../tests/unit/directions.rs"]
mod tests;
