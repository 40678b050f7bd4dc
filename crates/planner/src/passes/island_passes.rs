//! Passes over high places that no pass between two others reaches: corners of a region, and places
//! where fronts meet at an angle.

use std::collections::BTreeSet;

use facemill_cl_data::{CcPoint, Pass, Posture};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::cusp::strips::{NearestCuts, strip_width};
use facemill_job::failure::Failure;
use facemill_job::stages::Stages;
use facemill_surface_model::{Surface, place_islands};
use facemill_tool_model::FeedCurvature;
use facemill_tool_path::moves::lead::CutRegion;
use facemill_tool_path::segments::LaidTask;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Unit, Vector3};

use crate::passes::extra_passes::{Extra, ExtraPasses, Interposer, PlannedExtra, PlannedPath};
use crate::passes::high_places::HighPlace;

/// Distance from a pass that the same round has put in between others, as a share of its strip,
/// within which a high place is served.
const SERVED: f64 = 0.5;

/// The same from any other cut: beside it, it leaves more than its strip says, and another
/// direction may not.
const SERVED_BEFORE: f64 = 0.1;

/// Most islands that get passes of their own: more make a different plan.
const MOST_ISLANDS: usize = 16;

/// Most passes over one island.
const MOST_LINES: usize = 4;

/// Shortest step toward the border of the region, as a share of the step along a pass.
const LAST_STEP: f64 = 1.0 / 16.0;

/// Most steps of a pass to either side.
const MOST_STEPS: usize = 1000;

/// Passes over high places, by what they need to know of the operation.
#[derive(Clone, Copy)]
pub(crate) struct IslandSettings<'r> {
    /// Region to be cut.
    pub(crate) region: &'r dyn CutRegion,
    /// Largest distance of points along a pass, mm.
    pub(crate) step: f64,
    /// Largest step-over, mm.
    pub(crate) most_step_over: f64,
}

/// Points without a posture, with the reason.
type Refused = Vec<(Point3<f64>, String)>;

impl Interposer<'_, '_> {
    /// Returns passes over the islands of high places that the passes of a path do not serve, to be
    /// cut behind all others. An island that a further round finds high again gets passes in
    /// another direction.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn over_islands(
        &self,
        path: &PlannedPath,
        settings: IslandSettings<'_>,
        extra: &mut ExtraPasses,
        stages: &dyn Stages,
    ) -> Result<Vec<PlannedExtra>, Failure> {
        let Some(high) = self.high else { return Ok(Vec::new()) };
        let planned = path.planned().passes();
        let cuts = NearestCuts::new(planned.into_iter().map(|pass| pass.points).collect());
        let put_in = NearestCuts::new(extra.put_in.clone());
        let found = islands(high.places(), 0.5 * settings.most_step_over);
        let mut kept = Vec::new();
        for island in
            found.iter().filter(|island| !self.is_served(island, [&cuts, &put_in], &settings)).take(MOST_ISLANDS)
        {
            kept.extend(self.over(path, &cuts, island, (&settings, &mut extra.refused, stages))?);
        }
        extra.over = kept.iter().map(PlannedExtra::n_runs).sum();
        Ok(kept)
    }

    /// Returns the passes over an island, of all directions those with the fewest infeasible
    /// points.
    fn over(
        &self,
        path: &PlannedPath,
        cuts: &NearestCuts,
        island: &[HighPlace],
        (settings, refused, stages): (&IslandSettings<'_>, &mut Refused, &dyn Stages),
    ) -> Result<Vec<PlannedExtra>, Failure> {
        let mut best: Option<(usize, Vec<PlannedExtra>, Refused)> = None;
        for extras in self.candidates(path, cuts, island, settings) {
            let points: usize = extras.iter().map(|e| e.task.pass.points.len()).sum();
            let mut reasons = Refused::new();
            let planned = self.plan(path, extras, &mut reasons, stages)?;
            let feasible: usize = planned.iter().map(PlannedExtra::n_points).sum();
            let missed = points - feasible;
            if feasible > 0 && best.as_ref().is_none_or(|(least, ..)| missed < *least) {
                best = Some((missed, planned, reasons));
            }
        }
        let Some((_, planned, reasons)) = best else { return Ok(Vec::new()) };
        refused.extend(reasons);
        Ok(planned)
    }

    /// Returns passes over an island in several directions, those first that no round has tried.
    fn candidates(
        &self,
        path: &PlannedPath,
        cuts: &NearestCuts,
        island: &[HighPlace],
        settings: &IslandSettings<'_>,
    ) -> Vec<Vec<Extra>> {
        let weight: f64 = island.iter().map(|p| p.height).sum();
        let middle = island.iter().fold(Vector3::zeros(), |sum, p| sum + p.position.coords * p.height) / weight;
        let sum = island.iter().fold(Vector3::zeros(), |sum, p| sum + p.normal.into_inner() * p.height);
        let (Some(normal), Some(like)) = (Unit::try_new(sum, 1e-6), nearest_task(path, &middle.into())) else {
            return Vec::new();
        };
        let Some(nearest) = cuts.nearest(&middle.into(), &normal) else { return Vec::new() };
        let wide = self.strip_of(nearest.posture, settings);
        // As fine as the passes of the strategy, which follow the surface within its chord.
        let settings = &IslandSettings { step: settings.step.min(mean_step(like)), ..*settings };
        let mut ways = ways_over(island, &middle, &normal, &nearest.cc.feed);
        let n_ways = ways.len();
        ways.rotate_left((n_rounds(island) - 1) % n_ways);
        let of_way = |along: Unit<Vector3<f64>>| {
            let frame = IslandFrame { middle: middle.into(), normal, along };
            let lines = frame.lines(island, wide, self.least_length);
            let strip = Strip::on_plane(lines.apart);
            let extra = |aside: &f64| {
                let points = self.line(&frame, *aside, lines.reach, (island, settings));
                let task = LaidTask { pass: Pass::new(points), ..like.clone() };
                let is_pass = task.pass.points.len() >= 2;
                is_pass.then_some(Extra { before: path.tasks.len(), task, strip: Some(strip) })
            };
            lines.asides.iter().filter_map(extra).collect::<Vec<_>>()
        };
        ways.into_iter().map(of_way).filter(|extras| !extras.is_empty()).collect()
    }

    /// Returns whether all places of an island are near enough to cuts and passes put in.
    fn is_served(
        &self,
        island: &[HighPlace],
        [cuts, put_in]: [&NearestCuts; 2],
        settings: &IslandSettings<'_>,
    ) -> bool {
        let is_near = |place: &HighPlace, cuts: &NearestCuts, within: f64| {
            cuts.nearest(&place.position, &place.normal).is_some_and(|cut| {
                let away = (cut.cc.position - place.position).norm();
                away <= within * self.strip_of(cut.posture, settings)
            })
        };
        island.iter().all(|place| is_near(place, put_in, SERVED) || is_near(place, cuts, SERVED_BEFORE))
    }

    /// Returns the width of the strip that a posture cuts down to the permitted cusp on a plane,
    /// mm.
    fn strip_of(&self, posture: Posture, settings: &IslandSettings<'_>) -> f64 {
        strip_width(
            self.tests.plain.cell.tool.cutter(),
            posture,
            &FeedCurvature::default(),
            self.cusp,
            settings.most_step_over,
        )
    }

    /// Returns points of the surface in a plane along the normal of an island, at a distance aside
    /// of its middle, as far as given before and behind it and at most to the border of the region.
    fn line(
        &self,
        frame: &IslandFrame,
        aside: f64,
        reach: [f64; 2],
        (island, settings): (&[HighPlace], &IslandSettings<'_>),
    ) -> Vec<CcPoint> {
        let plane = Plane { through: frame.middle + frame.across() * aside, across: frame.across() };
        let walk = Walk { surface: self.surface, allowance: self.allowance, plane, settings };
        let Some(start) = walk.start(island) else { return Vec::new() };
        let ahead = (start.0 - frame.middle).dot(&frame.along);
        let before = walk.walked(start, -frame.along.into_inner(), ahead - reach[0]);
        let behind = walk.walked(start, frame.along.into_inner(), reach[1] - ahead);
        let points: Vec<(Point3<f64>, Vector3<f64>)> = before.into_iter().rev().chain([start]).chain(behind).collect();
        let last = points.len() - 1;
        let feed = |k: usize| points[(k + 1).min(last)].0 - points[k.saturating_sub(1)].0;
        (0..points.len()).filter_map(|k| CcPoint::new(points[k].0, points[k].1, feed(k)).ok()).collect()
    }
}

/// Returns the number of rounds that have found places of an island high.
fn n_rounds(island: &[HighPlace]) -> usize {
    island.iter().map(|p| p.round).collect::<BTreeSet<_>>().len()
}

/// Plane in which a pass over an island lies.
struct Plane {
    through: Point3<f64>,
    across: Vector3<f64>,
}

/// Steps along the surface in a plane.
struct Walk<'w> {
    surface: &'w Surface,
    allowance: f64,
    plane: Plane,
    settings: &'w IslandSettings<'w>,
}

/// Place of a pass and the normal there.
type Step = (Point3<f64>, Vector3<f64>);

impl Walk<'_> {
    /// Returns the place where a pass begins in both directions: at the middle of an island, or
    /// where the region does not go on there, at the nearest of its places to the pass.
    fn start(&self, island: &[HighPlace]) -> Option<Step> {
        let off = |p: &HighPlace| (p.position - self.plane.through).dot(&self.plane.across).abs();
        let nearest = || island.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        self.at(&self.plane.through).or_else(|| self.at(&nearest()?.position))
    }

    /// Returns the place of a pass near a point, in the plane up to a share of the way; `None` off
    /// the region.
    fn at(&self, near: &Point3<f64>) -> Option<Step> {
        let Self { surface, allowance, plane, settings } = self;
        let mut on = *near;
        for _ in 0..3 {
            let foot = surface.closest_point(&on, settings.most_step_over)?;
            let normal = surface.normal_at(&foot).into_inner();
            on = foot.position + normal * *allowance;
            let beside = (on - plane.through).dot(&plane.across);
            if beside.abs() <= IN_PLANE {
                return settings.region.holds(0, &on).then_some((on, normal));
            }
            on -= plane.across * beside;
        }
        None
    }

    /// Returns places one after the other from a start, at most `far` (mm) away from it.
    fn walked(&self, start: Step, way: Vector3<f64>, far: f64) -> Vec<Step> {
        let (mut found, mut at, mut step, mut left) = (Vec::new(), start, self.settings.step, far);
        let shortest = LAST_STEP * step;
        while left > shortest && step > shortest && found.len() < MOST_STEPS {
            let tangent = self.plane.across.cross(&at.1);
            let Some(tangent) = Unit::try_new(tangent * tangent.dot(&way).signum(), 1e-6) else { break };
            let next = self.at(&(at.0 + tangent.into_inner() * step.min(left)));
            match next.filter(|next| (next.0 - at.0).dot(&tangent) > 0.5 * step.min(left)) {
                Some(next) => {
                    left -= (next.0 - at.0).norm();
                    found.push(next);
                    at = next;
                }
                None => step *= 0.5,
            }
        }
        found
    }
}

/// Distance from its plane at which a place counts as in it, mm.
const IN_PLANE: f64 = 0.05;

/// Frame of an island.
struct IslandFrame {
    middle: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    along: Unit<Vector3<f64>>,
}

/// Lines over an island: distances aside of its middle, how far apart, and from where to where.
struct Lines {
    asides: Vec<f64>,
    apart: f64,
    reach: [f64; 2],
}

impl IslandFrame {
    fn across(&self) -> Vector3<f64> {
        self.normal.cross(&self.along)
    }

    /// Returns lines that cut all places of an island with strips of a width, each half a strip
    /// longer at both ends and at least `least_length` (mm) long.
    fn lines(&self, island: &[HighPlace], wide: f64, least_length: f64) -> Lines {
        let range = |axis: &Vector3<f64>| {
            let at = island.iter().map(|p| (p.position - self.middle).dot(axis));
            at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(t), high.max(t)])
        };
        let [low, high] = range(&self.across());
        let n = ((high - low) / wide).ceil().clamp(1.0, MOST_LINES as f64);
        let apart = (high - low) / n;
        let asides = (0..n as usize).map(|k| low + (k as f64 + 0.5) * apart).collect();
        let [from, to] = range(&self.along);
        let more = (0.5 * wide).max(0.5 * (least_length - (to - from)));
        Lines { asides, apart: apart.max(0.5 * wide), reach: [from - more, to + more] }
    }
}

/// Returns the directions over an island: along it, across, along the cuts beside it, and across
/// them; each with the feed of those cuts as far as it can be.
fn ways_over(
    island: &[HighPlace],
    middle: &Vector3<f64>,
    normal: &Unit<Vector3<f64>>,
    feed: &Unit<Vector3<f64>>,
) -> Vec<Unit<Vector3<f64>>> {
    let flat = |v: Vector3<f64>| v - normal.into_inner() * v.dot(normal);
    let scatter = island.iter().fold(Matrix3::zeros(), |sum, p| {
        let way = flat(p.position.coords - middle);
        sum + way * way.transpose()
    });
    let eigen = SymmetricEigen::new(scatter);
    let longest = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let mut ways: Vec<Unit<Vector3<f64>>> = Vec::new();
    for way in [longest, feed.into_inner()] {
        let Some(along) = Unit::try_new(flat(way), 1e-6) else { continue };
        for way in [along, Unit::new_normalize(normal.cross(&along))] {
            let way = if way.dot(feed) < 0.0 { -way } else { way };
            if ways.iter().all(|other| other.dot(&way).abs() < SAME_WAY) {
                ways.push(way);
            }
        }
    }
    ways
}

/// Cosine between two directions from which they are one: 15°.
const SAME_WAY: f64 = 0.966;

/// Returns the pass with the point nearest to a place.
fn nearest_task<'p>(path: &'p PlannedPath, place: &Point3<f64>) -> Option<&'p LaidTask> {
    let distance = |task: &LaidTask| {
        task.pass.points.iter().map(|cc| (cc.position - place).norm_squared()).fold(f64::INFINITY, f64::min)
    };
    let all = path.tasks.iter().map(|task| (distance(task), task));
    all.reduce(|best, other| if other.0 < best.0 { other } else { best }).map(|(_, task)| task)
}

/// Returns the mean distance of the points of a pass, mm.
fn mean_step(task: &LaidTask) -> f64 {
    let points = &task.pass.points;
    let length: f64 = points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum();
    length / points.len().saturating_sub(1).max(1) as f64
}

/// Returns groups of places, each within `reach` (mm) of another one of its group and facing the
/// same half space, those with the highest places first.
fn islands(places: &[HighPlace], reach: f64) -> Vec<Vec<HighPlace>> {
    let on: Vec<_> = places.iter().map(|p| (p.position, p.normal)).collect();
    let of = |island: Vec<usize>| island.into_iter().map(|k| places[k]).collect::<Vec<_>>();
    let mut found: Vec<Vec<HighPlace>> = place_islands(&on, reach).into_iter().map(of).collect();
    let highest = |island: &[HighPlace]| island.iter().map(|p| p.height).fold(0.0, f64::max);
    found.sort_by(|a, b| highest(b).total_cmp(&highest(a)));
    found
}

#[cfg(test)]
#[path = "../../tests/unit/passes/island_passes.rs"]
mod tests;
