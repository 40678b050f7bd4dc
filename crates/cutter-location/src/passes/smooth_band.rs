//! Smooth sequence of rotary positions through chosen ones, inside the feasible set.

use std::cell::Cell;

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};
use facemill_inverse_kinematics::{AxisKind, AxisValues, Branch};
use facemill_tool_model::cl_from_cc;
use nalgebra::{Unit, Vector3};

use crate::passes::band::smoothed;
use crate::passes::cost::{MotionScale, NEARLY};
use crate::passes::smooth_pass::{Node, PassClock, PassStep, SmoothPass};
use crate::passes::task::Outcome;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints, Infeasible};
use crate::search;

/// Rounds of smoothing: each binds the points that were not feasible in the one before.
const ROUNDS: usize = 6;

/// Factor by which the weight of a point that was not feasible grows.
const TIGHTER: f64 = 30.0;

/// Tilts that are tried above one that is not feasible, rad.
const RAISES: [f64; 8] = [0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064];

/// Postures nearer to a tested one than this count as equal to it, rad.
const SAME: f64 = 1e-6;

/// Smooths the rotary axes of a pass.
pub(crate) struct Band<'b, 's, 'a> {
    pass: &'b SmoothPass<'s, 'a>,
    clock: &'b PassClock,
    scale: &'b MotionScale,
    /// Time scale below which changes are smoothed away, s.
    tau: f64,
    rotary: Vec<usize>,
    beside: Cell<BandProgress>,
}

/// Results of the search beside the search curve so far.
#[derive(Clone, Copy, Default)]
struct BandProgress {
    /// The last posture found.
    last: Option<Posture>,
    /// Points in a row without one.
    in_vain: usize,
}

/// Points in a row without a posture beside the curve after which only every [`SELDOM`]th is
/// searched.
const PATIENCE: usize = 20;

/// See [`PATIENCE`].
const SELDOM: usize = 10;

/// A stretch of points on one branch of the machine.
struct Stretch {
    first: usize,
    last: usize,
    branch: Branch,
    /// For each rotary axis, the value wanted at each point.
    targets: Vec<Vec<f64>>,
    /// How strongly each point is bound to it.
    weights: Vec<f64>,
}

/// Knowledge of a point.
#[derive(Clone)]
enum Known {
    /// Nothing yet.
    Open,
    /// The pose at a posture.
    Free(FeasiblePose),
    /// The pose of another posture than the smooth one, which is infeasible.
    Bound(FeasiblePose),
    /// No posture is feasible.
    Never(Infeasible),
}

impl<'b, 's, 'a> Band<'b, 's, 'a> {
    pub(crate) fn new(pass: &'b SmoothPass<'s, 'a>, clock: &'b PassClock, scale: &'b MotionScale, tau: f64) -> Self {
        let axes = pass.test.cell.machine.axes();
        let rotary = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Rotary).collect();
        Self { pass, clock, scale, tau, rotary, beside: Cell::default() }
    }

    /// Returns poses of all points, along a smooth band through chosen nodes where that is
    /// feasible. A point without a feasible posture near the band gets the first feasible one of
    /// its search curve.
    pub(crate) fn through(
        &self,
        nodes: &[(usize, Node)],
        hints: &mut Hints,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Outcome>, Cancelled> {
        let n = self.pass.task.pass.points.len();
        if nodes.is_empty() {
            return (0..n)
                .map(|k| {
                    monitor.checkpoint()?;
                    Ok(self.searched(k, None, None, hints))
                })
                .collect();
        }
        let mut known = vec![Known::Open; n];
        for mut stretch in self.stretches(nodes) {
            for round in 0..ROUNDS {
                monitor.checkpoint()?;
                if !self.round(&mut stretch, &mut known, round + 1 == ROUNDS, hints) {
                    break;
                }
            }
        }
        Ok(known.into_iter().map(outcome).collect())
    }

    /// Returns one stretch for every run of nodes on the same branch; points between two runs
    /// belong to the first.
    fn stretches(&self, nodes: &[(usize, Node)]) -> Vec<Stretch> {
        let n = self.pass.task.pass.points.len();
        let runs: Vec<&[(usize, Node)]> =
            nodes.chunk_by(|a, b| a.1.configuration.branch == b.1.configuration.branch).collect();
        let first = |r: usize| if r == 0 { 0 } else { runs[r][0].0 };
        (0..runs.len())
            .map(|r| {
                let last = if r + 1 == runs.len() { n - 1 } else { first(r + 1) - 1 };
                self.stretch(runs[r], first(r), last)
            })
            .collect()
    }

    /// Interpolates the wanted postures between the chosen ones.
    fn stretch(&self, run: &[(usize, Node)], first: usize, last: usize) -> Stretch {
        let mut targets = vec![Vec::with_capacity(last + 1 - first); self.rotary.len()];
        let mut near = run[0].1.configuration;
        for k in first..=last {
            near = self.reached(k, self.between(run, k), &near);
            for (axis, targets) in self.rotary.iter().zip(&mut targets) {
                targets.push(near.axes.get_or_zero(*axis));
            }
        }
        let times = &self.clock.times;
        let n = times.len();
        let share = |k: usize| 0.5 * (times[(k + 1).min(n - 1)] - times[k.saturating_sub(1)]);
        let weights = (first..=last).map(share).collect();
        Stretch { first, last, branch: run[0].1.configuration.branch, targets, weights }
    }

    /// Returns the posture at a point interpolated between the nodes on both sides: the tool axis
    /// turns against surface and feed at an even rate over the way, so no faster than between the
    /// nodes.
    fn between(&self, run: &[(usize, Node)], k: usize) -> Posture {
        let next = run.partition_point(|(point, _)| *point <= k);
        let (Some((a, before)), Some((b, after))) = (next.checked_sub(1).map(|j| &run[j]), run.get(next)) else {
            return run[next.saturating_sub(1)].1.posture;
        };
        let lengths = &self.clock.lengths;
        let share = (lengths[k] - lengths[*a]) / (lengths[*b] - lengths[*a]);
        turned(before.posture, after.posture, share)
    }

    /// Returns the machine's configuration in a posture at a point, on the branch of `near` and at
    /// the turns nearest to it; `near` itself where the machine cannot reach the posture on that
    /// branch.
    fn reached(&self, k: usize, posture: Posture, near: &Configuration) -> Configuration {
        let cl = cl_from_cc(self.pass.test.cell.tool.cutter(), &self.pass.task.pass.points[k], posture);
        self.pass.test.configuration_like(&cl, near).unwrap_or(*near)
    }

    /// Smooths, tests changed points, and binds infeasible ones to a feasible posture; returns
    /// whether another round is worth while.
    fn round(&self, stretch: &mut Stretch, known: &mut [Known], is_last: bool, hints: &mut Hints) -> bool {
        let times = &self.clock.times[stretch.first..=stretch.last];
        let bands: Vec<Vec<f64>> =
            stretch.targets.iter().map(|targets| smoothed(times, targets, &stretch.weights, self.tau)).collect();
        let mut bound = false;
        for (at, known) in known[stretch.first..=stretch.last].iter_mut().enumerate() {
            let k = stretch.first + at;
            if matches!(known, Known::Never(_)) {
                continue;
            }
            let configuration = self.standing(stretch.branch, bands.iter().map(|band| band[at]));
            let posture = self.posture(k, &configuration.axes);
            if matches!(known, Known::Free(pose) if is_same(pose.posture, posture)) {
                continue;
            }
            let cc = &self.pass.task.pass.points[k];
            let tried = self.pass.test.try_posture(cc, posture, Some(&configuration), hints);
            if let Some(pose) = tried.ok().filter(|pose| pose.configuration.branch == stretch.branch) {
                *known = Known::Free(pose);
                continue;
            }
            let wanted = self.standing(stretch.branch, stretch.targets.iter().map(|targets| targets[at]));
            let wanted = self.posture(k, &wanted.axes);
            *known = match self.raised(k, [posture, wanted], &configuration, hints) {
                // On the other branch the axes differ: the band cannot pass through this pose.
                Ok(pose) if pose.configuration.branch != stretch.branch => Known::Bound(pose),
                Ok(pose) => {
                    bound = true;
                    for (axis, targets) in stretch.targets.iter_mut().enumerate() {
                        targets[at] = pose.configuration.axes.get_or_zero(self.rotary[axis]);
                    }
                    stretch.weights[at] *= TIGHTER;
                    Known::Bound(pose)
                }
                Err(why) => Known::Never(why),
            };
        }
        !is_last && (self.rebound(stretch, known) || bound)
    }

    /// Binds points whose smooth posture turns too fast, or leaves too high a cusp while their
    /// wanted posture leaves a lower one; returns whether there was any.
    fn rebound(&self, stretch: &mut Stretch, known: &[Known]) -> bool {
        let mut any = false;
        for k in stretch.first..=stretch.last {
            let at = k - stretch.first;
            let Known::Free(pose) = &known[k] else { continue };
            let beside = at.checked_sub(1).and_then(|_| match &known[k - 1] {
                Known::Free(before) => Some(before),
                _ => None,
            });
            let too_fast = beside.is_some_and(|before| {
                let step = PassStep { clock: self.clock, scale: self.scale, points: [k - 1, k] };
                self.pass.is_beyond(&step, [before, pose])
            });
            if too_fast {
                stretch.weights[at - 1] *= TIGHTER;
            }
            if too_fast || self.leaves_too_much(stretch, k, pose.posture) {
                stretch.weights[at] *= TIGHTER;
                any = true;
            }
        }
        any
    }

    /// Returns whether a posture leaves a higher cusp than allowed and than the wanted one.
    fn leaves_too_much(&self, stretch: &Stretch, k: usize, posture: Posture) -> bool {
        let (scale, strip) = (self.pass.cusp_scale(), self.pass.strip(k));
        let height = scale.height(posture, &strip);
        let wanted = || {
            let at = k - stretch.first;
            let standing = self.standing(stretch.branch, stretch.targets.iter().map(|t| t[at]));
            scale.height(self.posture(k, &standing.axes), &strip)
        };
        height > NEARLY && height > 1.001 * wanted()
    }

    /// Returns a feasible posture near one that is not: with more tilt, one step beyond the first
    /// such one where that is also feasible, because the band will not keep to it exactly; else the
    /// posture that the band was to pass through; else the first one of the search curve, or one
    /// beside it.
    fn raised(&self, k: usize, [posture, wanted]: [Posture; 2], near: &Configuration, hints: &mut Hints) -> Outcome {
        let cc = &self.pass.task.pass.points[k];
        let mut first = None;
        for raise in RAISES {
            let tilt = posture.tilt + raise;
            if tilt > self.pass.task.curve.end().tilt {
                break;
            }
            let tried = self.pass.test.try_posture(cc, Posture { tilt, ..posture }, Some(near), hints);
            let on_branch = tried.ok().filter(|pose| pose.configuration.branch == near.branch);
            match (on_branch, first) {
                (Some(pose), None) => first = Some(pose),
                (Some(pose), Some(_)) => return Ok(pose),
                (None, Some(pose)) => return Ok(pose),
                (None, None) => {}
            }
        }
        let on_branch = |pose: &FeasiblePose| pose.configuration.branch == near.branch;
        let as_wanted =
            |hints: &mut Hints| self.pass.test.try_posture(cc, wanted, Some(near), hints).ok().filter(on_branch);
        let first = first.or_else(|| as_wanted(hints));
        first.map_or_else(|| self.searched(k, Some(wanted), Some(near), hints), Ok)
    }

    fn searched(&self, k: usize, wanted: Option<Posture>, near: Option<&Configuration>, hints: &mut Hints) -> Outcome {
        let (cc, curve) = (&self.pass.task.pass.points[k], &self.pass.task.curve);
        let found = search(self.pass.test, cc, curve, &self.pass.settings.search, 0.0, near, hints);
        found.map(|found| found.pose).or_else(|why| self.beside_the_curve(k, wanted, near, hints).ok_or(why))
    }

    /// Searches a feasible posture of a fine lattice over the ranges: where the whole curve is
    /// blocked, a narrow place beside it may be free. The posture found at the point before is
    /// tried first, then those of the lattice, the nearest to the wanted one first, or the smallest
    /// tilt first without one. After many points in a row without a result, only some points are
    /// searched so closely.
    fn beside_the_curve(
        &self,
        k: usize,
        wanted: Option<Posture>,
        near: Option<&Configuration>,
        hints: &mut Hints,
    ) -> Option<FeasiblePose> {
        let cc = &self.pass.task.pass.points[k];
        let mut beside = self.beside.get();
        let mut free = |posture: &Posture| self.pass.test.try_posture(cc, *posture, near, hints).ok();
        let again = beside.last.and_then(|posture| free(&posture));
        let is_skipped = beside.in_vain >= PATIENCE && !beside.in_vain.is_multiple_of(SELDOM);
        let found =
            again.or_else(|| if is_skipped { None } else { self.fine_postures(cc, wanted).iter().find_map(free) });
        beside.in_vain = if found.is_some() { 0 } else { beside.in_vain + 1 };
        beside.last = found.map(|pose| pose.posture).or(beside.last);
        self.beside.set(beside);
        found
    }

    /// Returns the fine lattice, the postures whose tool axis is nearest to that of the wanted one
    /// first.
    fn fine_postures(&self, cc: &CcPoint, wanted: Option<Posture>) -> Vec<Posture> {
        let mut postures: Vec<Posture> = self.pass.fine.postures.iter().map(|p| self.pass.signed(*p)).collect();
        if let Some(axis) = wanted.map(|posture| cc.tool_axis(posture)) {
            let cos = |posture: &Posture| cc.tool_axis(*posture).dot(&axis);
            postures.sort_by(|a, b| cos(b).total_cmp(&cos(a)));
        }
        postures
    }

    /// Returns the configuration with these rotary values.
    fn standing(&self, branch: Branch, rotary: impl Iterator<Item = f64>) -> Configuration {
        let mut axes: AxisValues = self.pass.test.cell.machine.home();
        for (&k, value) in self.rotary.iter().zip(rotary) {
            axes[k] = value;
        }
        Configuration { axes, branch }
    }

    /// Returns the posture of a rotary position at a point, brought into the ranges of the search.
    /// With three rotary axes a smoothed position gives the tool axis, but brings the tip to its
    /// place only with the rotary values that are solved for when the posture is tested.
    fn posture(&self, k: usize, axes: &AxisValues) -> Posture {
        let test = self.pass.test;
        let on_table = test.cell.machine.cl_point(axes, test.cell.tool.gauge_length());
        let axis = on_table.transformed(test.work_from_table()).axis;
        self.pass.within_ranges(self.pass.task.pass.points[k].posture_of(&axis))
    }
}

/// Returns the posture at a share of the shortest turn of the tool axis between two postures.
fn turned(from: Posture, to: Posture, share: f64) -> Posture {
    let seen = |p: Posture| {
        let (sin, cos) = p.tilt.sin_cos();
        Unit::new_unchecked(Vector3::new(sin * p.rotate.cos(), sin * p.rotate.sin(), cos))
    };
    let (a, b) = (seen(from), seen(to));
    let axis = a.try_slerp(&b, share, 1e-9).unwrap_or(if share < 0.5 { a } else { b });
    let aside = axis.x.hypot(axis.y);
    // Upright, rotate has no say: it changes evenly.
    let rotate = if aside > 1e-9 { axis.y.atan2(axis.x) } else { from.rotate + (to.rotate - from.rotate) * share };
    Posture { tilt: aside.atan2(axis.z), rotate }
}

fn outcome(known: Known) -> Outcome {
    match known {
        Known::Free(pose) | Known::Bound(pose) => Ok(pose),
        Known::Never(why) => Err(why),
        // Every point is in a stretch.
        Known::Open => Err(Infeasible::TooLong),
    }
}

/// Returns whether two postures are the same for the tool axis and for the contact.
fn is_same(a: Posture, b: Posture) -> bool {
    (a.tilt - b.tilt).abs() <= SAME && (a.rotate - b.rotate).abs() <= SAME
}

#[cfg(test)]
#[path = "../../tests/unit/passes/smooth_band.rs"]
mod tests;
