//! Fronts that advance over a patch, one after the other.

use facemill_cl_data::CcPoint;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::distance::curve_distance::{CurveDistance, CurveFoot, DistanceStore};
use crate::distance::patch_vertices::on_edge;
use crate::distance::source_curve::SourceCurve;
use crate::error::PathError;
use crate::layout::pass_level::{Gain, PatchTask};
use crate::layout::scallop::lanes::{Lanes, StepSettings};
use crate::layout::scallop::surface_path::{SurfacePath, trace_zero};
use crate::layout::strip_width::allowed_width;
use crate::strategy::patch::Patch;
use crate::strategy::settings::{Direction, Pattern};
use crate::strategy::size::{MAX_CROSSINGS, MAX_LEVELS, StepOverCause};

/// Curves that a front begins at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BaseKind {
    /// A border: the first pass lies half a strip inside.
    Border,
    /// A pass itself, with fronts to both sides.
    Seed,
    /// A front, which goes on to its left.
    Front,
}

/// The curves that the next fronts are measured from.
#[derive(Default)]
struct Base {
    curves: Vec<SourceCurve>,
    kinds: Vec<BaseKind>,
    /// Sum of steps at the nodes of each curve.
    arrivals: Vec<Vec<f64>>,
    /// Gain of the passes of each curve since its last full one.
    cycles: Vec<Gain>,
}

/// Fronts of one step.
pub(crate) struct FrontStep {
    pub(crate) paths: Vec<SurfacePath>,
    /// Sum of steps, mm, at the first node.
    pub(crate) arrival: f64,
    /// The direction of partial passes, which start at an end of the region and join the pass
    /// before inside it.
    pub(crate) starts: Option<Direction>,
}

/// State of the vertices of a patch while fronts advance over it.
pub(crate) struct Advance<'a> {
    context: &'a PatchTask<'a>,
    /// Whether a front has passed.
    pub(crate) behind: Vec<bool>,
    /// Width allowed, mm; NaN where no front has come near.
    pub(crate) widths: Vec<f64>,
    /// Sum of steps to the vertex, mm.
    pub(crate) arrivals: Vec<f64>,
    /// Direction away from the front before.
    pub(crate) away: Vec<Vector3<f64>>,
    pub(crate) fronts: Vec<FrontStep>,
    /// Number of steps where the width allowed was below the smallest step-over.
    pub(crate) n_wide: usize,
    /// Longest step, mm.
    pub(crate) widest: f64,
    /// Distance ahead of the next fronts, mm; NaN between steps.
    values: Vec<f64>,
    store: DistanceStore,
}

/// Stretches of lanes per strip width.
const BINS_PER_WIDTH: f64 = 4.0;

/// Distances are measured so many widths ahead: as far as the pass after the next one matters.
const WIDTHS_AHEAD: f64 = 1.75;

/// Steps in a row that pass no vertex, at most: vertices are a quarter of the largest strip apart,
/// and the narrowest strip is a hundredth of it. More stand still, in triangles that hang together
/// like no surface.
const MOST_IDLE: usize = 64;

/// Cosine of the turn of the direction away from the front between two neighbouring vertices, 37°,
/// from which fronts meet between them.
const MEETING_COS: f64 = 0.8;

impl<'a> Advance<'a> {
    pub(crate) fn new(context: &'a PatchTask<'a>) -> Self {
        let n = context.patch.mesh.vertices().len();
        Self {
            context,
            behind: vec![false; n],
            widths: vec![f64::NAN; n],
            arrivals: vec![f64::NAN; n],
            away: vec![Vector3::zeros(); n],
            fronts: Vec::new(),
            n_wide: 0,
            widest: 0.0,
            values: vec![f64::NAN; n],
            store: DistanceStore::new(context.patch),
        }
    }

    /// Lays fronts from some curves until nothing is ahead of them.
    ///
    /// # Errors
    /// When a width is NaN, there are too many fronts, or the monitor cancels.
    pub(crate) fn run(&mut self, seeds: &[(SurfacePath, BaseKind)]) -> Result<(), PathError> {
        let PatchTask { patch, settings, monitor, .. } = *self.context;
        let mut spacing = settings.max_step_over / BINS_PER_WIDTH;
        let mut base = Base::default();
        for (path, kind) in seeds {
            // A border keeps its corners.
            let spacing = if *kind == BaseKind::Border { 0.0 } else { spacing };
            base.add(path.source(patch, spacing), *kind, |_| 0.0);
            if *kind == BaseKind::Seed {
                self.fronts.push(FrontStep { paths: vec![path.clone()], arrival: 0.0, starts: None });
            }
        }
        let mut reach = WIDTHS_AHEAD * settings.max_step_over;
        let mut idle = 0;
        while !base.curves.is_empty() {
            monitor.checkpoint()?;
            if self.fronts.len() > MAX_LEVELS {
                return Err(self.too_many());
            }
            let (widest, passed) = self.step(&mut base, reach, spacing)?;
            idle = if passed { 0 } else { idle + 1 };
            if idle > MOST_IDLE {
                break;
            }
            spacing = widest / BINS_PER_WIDTH;
            reach = WIDTHS_AHEAD * (1.15 * widest).min(settings.max_step_over);
        }
        Ok(())
    }

    fn too_many(&self) -> PathError {
        let span = self.arrivals.iter().copied().filter(|a| a.is_finite()).fold(0.0, f64::max);
        let cause = StepOverCause { largest: self.context.settings.max_step_over, is_largest: self.n_wide == 0 };
        let (limit, most_crossings) = (MAX_LEVELS, MAX_CROSSINGS);
        PathError::TooManyPasses { limit, most_crossings, span, remedy: cause.remedy(2.0) }
    }

    /// Lays the next fronts; returns the largest width that was met, and whether they passed a
    /// vertex.
    fn step(&mut self, base: &mut Base, reach: f64, spacing: f64) -> Result<(f64, bool), PathError> {
        let PatchTask { patch, vertices, settings, .. } = *self.context;
        let mut cycles = std::mem::take(&mut base.cycles);
        let store = std::mem::take(&mut self.store);
        let is_ahead = |v: u32| !self.behind[v as usize];
        let distance = CurveDistance::with_store(patch, vertices, &base.curves, reach, is_ahead, store);
        self.find_widths(&distance)?;
        let ahead = || distance.reached().iter().filter(|(v, _)| !self.behind[*v as usize]);
        let widest = ahead().map(|(v, _)| self.widths[*v as usize]).fold(settings.min_step_over, f64::max);
        let triangles = self.triangles(&distance);
        let lanes = self.lanes(&distance, &triangles, base, &mut cycles, reach, spacing);
        let mut values = std::mem::take(&mut self.values);
        for v in triangles.iter().flat_map(|&t| patch.mesh.triangles()[t as usize]) {
            values[v as usize] = if self.behind[v as usize] { -1.0 } else { reach };
        }
        for (v, foot) in distance.reached() {
            let value = base.value(&lanes, foot);
            values[*v as usize] = if self.behind[*v as usize] { value.min(-1e-9) } else { value };
        }
        let exact = |edge: [u32; 2], t: f64| {
            let (p, normal) = (on_edge(patch, edge, t), vertices.normal_between(edge, t));
            distance.foot(&edge, &p, &normal).map_or(f64::NAN, |foot| base.value(&lanes, &foot))
        };
        let traced = if lanes.all_done() { Vec::new() } else { trace_zero(patch, &values, &triangles, exact) };
        let next = self.clipped(traced, &distance, base, &lanes, &cycles, spacing);
        let passed = self.pass_by(&distance, base, &lanes, &values);
        let corners = triangles.iter().flat_map(|&t| patch.mesh.triangles()[t as usize]);
        corners.chain(distance.reached().iter().map(|(v, _)| *v)).for_each(|v| values[v as usize] = f64::NAN);
        self.values = values;
        self.store = distance.into_store();
        *base = next;
        Ok((widest, passed))
    }

    /// Takes the widths at vertices ahead that have none.
    fn find_widths(&mut self, distance: &CurveDistance) -> Result<(), PathError> {
        let PatchTask { patch, vertices, settings, strip_width, .. } = *self.context;
        let new = distance.reached().iter().filter(|(v, _)| self.widths[*v as usize].is_nan());
        let new: Vec<&(u32, CurveFoot)> = new.collect();
        let width = |(v, foot): &&(u32, CurveFoot)| {
            let (position, normal) = (patch.mesh.vertices()[*v as usize], vertices.normal(*v));
            let forward = Unit::try_new(foot.away.cross(&normal), 1e-6)
                .or_else(|| Unit::try_new(foot.at.tangent, 1e-9))
                .unwrap_or_else(Vector3::x_axis);
            let feed = if settings.first_direction() == Direction::Forward { forward } else { -forward };
            Ok((*v, allowed_width(&CcPoint { position, normal, feed }, settings, strip_width)?))
        };
        let found: Result<Vec<(u32, f64)>, PathError> =
            new.par_iter().map(width).collect::<Vec<_>>().into_iter().collect();
        let mut is_wide = false;
        for (v, width) in found? {
            is_wide |= width < settings.min_step_over;
            self.widths[v as usize] = width.max(settings.min_step_over);
        }
        self.n_wide += usize::from(is_wide);
        Ok(())
    }

    /// The steps of the next fronts.
    fn lanes(
        &self,
        distance: &CurveDistance,
        triangles: &[u32],
        base: &Base,
        cycles: &mut [Gain],
        reach: f64,
        spacing: f64,
    ) -> Lanes {
        let patch = self.context.patch;
        let mut lanes = Lanes::new(&base.curves, spacing);
        for &t in triangles {
            let v = patch.mesh.triangles()[t as usize];
            let ahead = v.iter().filter(|&&v| !self.behind[v as usize]);
            let corners: Vec<(u32, CurveFoot)> = ahead.filter_map(|&v| Some((v, *distance.foot_of(v)?))).collect();
            let is_met = (0..corners.len()).any(|i| (0..i).any(|j| meets(patch, corners[i], corners[j])));
            let nearest = corners.iter().map(|c| c.1.distance).fold(f64::INFINITY, f64::min);
            let from = if v.iter().any(|&v| self.behind[v as usize]) { 0.0 } else { nearest };
            let entry = |(v, foot): &(u32, CurveFoot)| (base.lane(foot), *foot, self.widths[*v as usize]);
            lanes.enter(&corners.iter().map(entry).collect::<Vec<_>>(), from, is_met);
        }
        lanes.find_steps(&self.step_settings(base, reach), cycles, |curve, way| base.arrival(curve, way));
        lanes
    }

    fn step_settings(&self, base: &Base, reach: f64) -> StepSettings {
        let settings = self.context.settings;
        let are = |kind: BaseKind| base.kinds.iter().all(|k| *k == kind);
        let partial_from = match (settings.pattern, settings.first_direction()) {
            _ if !are(BaseKind::Front) => [false; 2],
            (Pattern::Zigzag, _) => [true; 2],
            (Pattern::OneWay, Direction::Forward) => [true, false],
            (Pattern::OneWay, Direction::Reverse) => [false, true],
        };
        StepSettings {
            share: if are(BaseKind::Border) { 0.5 } else { 1.0 },
            reach,
            partial_from,
            shortest: 1.5 * settings.min_pass_length + 2.0 * settings.edge_margin,
            pass_cost: settings.pass_cost,
        }
    }

    /// The triangles around the vertices ahead in reach, in rising order.
    fn triangles(&self, distance: &CurveDistance) -> Vec<u32> {
        let ahead = distance.reached().iter().filter(|(v, _)| !self.behind[*v as usize]);
        let around = ahead.flat_map(|(v, _)| self.context.vertices.triangles(*v).iter().copied());
        let mut around: Vec<u32> = around.collect();
        around.sort_unstable();
        around.dedup();
        around
    }

    /// Keeps the fronts where a pass is to be laid; they are the base of the next.
    fn clipped(
        &mut self,
        traced: Vec<SurfacePath>,
        distance: &CurveDistance,
        base: &Base,
        lanes: &Lanes,
        cycles: &[Gain],
        spacing: f64,
    ) -> Base {
        let patch = self.context.patch;
        let foot_at = |path: &SurfacePath, k: usize| {
            let (p, t) = (path.nodes[k], path.triangles[k]);
            distance.foot(&patch.mesh.triangles()[t as usize], &p, &patch.normal(t, &p))
        };
        let arrival = |p: &Point3<f64>, t: u32| {
            let foot = distance.foot(&patch.mesh.triangles()[t as usize], p, &patch.normal(t, p))?;
            let (lane, way) = (base.lane(&foot), foot.at.way);
            // Beyond a partial pass, its curve goes on along the pass before.
            let step = if lanes.span(lane).is_some_and(|[from, to]| way < from || way > to) {
                0.0
            } else {
                lanes.step(lane, way)
            };
            Some(base.arrival(foot.curve as usize, way) + step)
        };
        let mut next = Base::default();
        // Full passes, and partial ones from either end of their front.
        let mut kinds: [Vec<SurfacePath>; 3] = Default::default();
        for path in traced {
            let feet: Vec<Option<CurveFoot>> = (0..path.nodes.len()).map(|k| foot_at(&path, k)).collect();
            let keep = |k: usize| feet[k].is_some_and(|f| lanes.holds(base.lane(&f), f.at.way));
            let Some(foot) = (0..feet.len()).filter(|&k| keep(k)).find_map(|k| feet[k]) else { continue };
            let lane = base.lane(&foot);
            let kind = lanes.partial_from(lane).map_or(0, |side| side + 1);
            let parts = path.parts(keep);
            for part in &parts {
                let source = part.source(patch, spacing);
                let source = match (lanes.span(lane), source) {
                    (Some(span), Some(source)) => {
                        let joined = base.curves[foot.curve as usize].joined(&source, span, kind == 2, 4.0 * spacing);
                        (parts.len() == 1).then_some(joined).flatten()
                    }
                    (_, source) => source,
                };
                let cycle = if kind == 0 { Gain::default() } else { cycles[foot.curve as usize] };
                next.add(source, BaseKind::Front, |(p, t)| arrival(&p, t).unwrap_or(0.0));
                next.cycles.last_mut().into_iter().for_each(|c| *c = cycle);
            }
            if kind > 0 && parts.len() != 1 {
                // Its parts do not make one curve: both go on beside each other.
                for part in &parts {
                    next.add(part.source(patch, spacing), BaseKind::Front, |(p, t)| arrival(&p, t).unwrap_or(0.0));
                }
                next.keep(base, foot.curve as usize, cycles[foot.curve as usize]);
            }
            kinds[kind].extend(parts);
        }
        let starts = [None, Some(Direction::Forward), Some(Direction::Reverse)];
        for (paths, starts) in kinds.into_iter().zip(starts).rev() {
            if let Some(first) = paths.first() {
                let arrival = arrival(&first.nodes[0], first.triangles[0]).unwrap_or(0.0);
                self.fronts.push(FrontStep { paths, arrival, starts });
            }
        }
        next
    }

    /// Marks what the fronts have passed; returns whether there was any.
    fn pass_by(&mut self, distance: &CurveDistance, base: &Base, lanes: &Lanes, values: &[f64]) -> bool {
        let mut passed = false;
        for (v, foot) in distance.reached() {
            let v = *v as usize;
            let lane = base.lane(foot);
            if self.behind[v] || (values[v] >= 0.0 && !lanes.is_done(lane, foot.at.way)) {
                continue;
            }
            passed = true;
            self.behind[v] = true;
            self.arrivals[v] = base.arrival(foot.curve as usize, foot.at.way) + foot.distance;
            self.away[v] = foot.away;
            if !lanes.is_done(lane, foot.at.way) {
                self.widest = self.widest.max(lanes.step(lane, foot.at.way));
            }
        }
        passed
    }
}

/// Whether fronts meet between two vertices: they go toward each other, and not alike.
fn meets(patch: &Patch, (a, at_a): (u32, CurveFoot), (b, at_b): (u32, CurveFoot)) -> bool {
    let edge = patch.mesh.vertices()[b as usize] - patch.mesh.vertices()[a as usize];
    are_met(&edge, &at_a.away, &at_b.away)
}

/// Whether fronts meet on an edge between the directions away from them at its ends.
pub(crate) fn are_met(edge: &Vector3<f64>, away_a: &Vector3<f64>, away_b: &Vector3<f64>) -> bool {
    away_a.dot(away_b) < MEETING_COS && edge.dot(&(away_a - away_b)) > 0.0 && away_a.norm() * away_b.norm() > 0.5
}

impl Base {
    fn add(&mut self, curve: Option<SourceCurve>, kind: BaseKind, arrival: impl Fn((Point3<f64>, u32)) -> f64) {
        let Some(curve) = curve else { return };
        self.arrivals.push(curve.positions().map(arrival).collect());
        self.curves.push(curve);
        self.kinds.push(kind);
        self.cycles.push(Gain::default());
    }

    /// Takes a curve of another base over.
    fn keep(&mut self, other: &Self, curve: usize, cycle: Gain) {
        self.arrivals.push(other.arrivals[curve].clone());
        self.curves.push(other.curves[curve].clone());
        self.kinds.push(other.kinds[curve]);
        self.cycles.push(cycle);
    }

    /// The lane of a foot: two for each curve, the left one first; those of seeds alone have both.
    fn lane(&self, foot: &CurveFoot) -> usize {
        let right = self.kinds[foot.curve as usize] == BaseKind::Seed && foot.across < 0.0;
        2 * foot.curve as usize + usize::from(right)
    }

    /// Sum of steps at a way of a curve, mm.
    fn arrival(&self, curve: usize, way: f64) -> f64 {
        self.curves[curve].interpolated(way, &self.arrivals[curve])
    }

    /// Distance of a place ahead of the next front, mm.
    fn value(&self, lanes: &Lanes, foot: &CurveFoot) -> f64 {
        let step = lanes.step(self.lane(foot), foot.at.way);
        let across = match self.kinds[foot.curve as usize] {
            BaseKind::Front => foot.across,
            BaseKind::Seed => foot.across.abs(),
            BaseKind::Border => return foot.distance - step,
        };
        // A front goes straight on beyond its end, but not far.
        let beyond = (foot.at.beyond - step).max(0.0);
        if beyond > 0.0 { across.hypot(beyond).copysign(across) - step } else { across - step }
    }
}
