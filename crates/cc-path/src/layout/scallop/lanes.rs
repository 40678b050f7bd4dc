//! Steps of a front: how far it advances at each place along it.

use crate::distance::curve_distance::CurveFoot;
use crate::distance::source_curve::SourceCurve;
use crate::layout::pass_level::Gain;

/// A stretch of a lane: what lies ahead of the front there.
#[derive(Clone, Debug, Default)]
struct Bin {
    /// Parts of the surface: least and largest distance, and the width that they allow, mm.
    ahead: Vec<[f64; 3]>,
    /// Largest distance ahead, mm.
    depth: f64,
    /// Whether another front, or another part of this one, comes from the other side.
    is_met: bool,
}

/// One side of a front, in stretches of equal length.
#[derive(Clone, Debug)]
struct Lane {
    width: f64,
    closed: bool,
    bins: Vec<Bin>,
    /// Whether nothing more is to be laid ahead of a stretch.
    done: Vec<bool>,
    /// Coefficients of the step, a quadratic spline, one for each stretch.
    steps: Vec<f64>,
    /// First and last stretch of a partial pass, and the end that it starts at.
    span: Option<([usize; 2], usize)>,
}

/// Steps of some fronts, on both sides of each.
pub(crate) struct Lanes {
    lanes: Vec<Lane>,
}

/// Settings of a step from one front to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSettings {
    /// Share of the width that the first step has: a half from a border, which is no pass.
    pub(crate) share: f64,
    /// Farthest distance that has been measured, mm.
    pub(crate) reach: f64,
    /// Ends of open fronts, along the curve, from which partial passes may start.
    pub(crate) partial_from: [bool; 2],
    /// Shortest partial pass, mm.
    pub(crate) shortest: f64,
    /// Length of cutting that takes as long as entry, exit and link of a pass, mm.
    pub(crate) pass_cost: f64,
}

/// Steepest change of the arrival along a front, 17°: beyond, the feed would turn too far from the
/// seed's direction.
const STEEPEST: f64 = 0.3;

/// Radius of the bend of fronts beside narrow places, in strip widths. Tighter bends turn the tool
/// axis faster than the feed can follow.
const BEND: f64 = 4.0;

/// The slant of a ridge is looked at over so many stretches to each side.
const SLANT_BINS: f64 = 2.0;

/// A front advances at least by this share of its width, whatever its smoothness costs.
const LEAST_SHARE: f64 = 0.2;

/// The last pass before a border is so far from it, in widths.
const BEFORE_BORDER: f64 = 0.25;

/// Places up to this share of a width beside a pass are cut by it; rounding is no excess.
const REACHED: f64 = 0.501;

/// A partial pass ends where its step is narrower than this share of the width allowed: the pass
/// before has cut there.
const CUT_ALREADY: f64 = 0.1;

/// A partial pass has to bring so many times as much as the full pass alone: less is within the
/// grain of the stretches.
const WORTH: f64 = 1.005;

/// Ends of partial passes that are compared, evenly spread along the front.
const ENDS: usize = 16;

/// A pass from an end of a front that joins the pass before.
struct PartialPass {
    levels: Vec<f64>,
    span: [usize; 2],
    side: usize,
    gain: Gain,
    rate: f64,
}

/// Stretches of a lane at most.
const MOST_BINS: usize = 2048;

impl Lanes {
    /// Lanes of stretches of about `width` (mm) along some curves.
    pub(crate) fn new(curves: &[SourceCurve], width: f64) -> Self {
        let lane = |curve: &SourceCurve| {
            let least = if curve.is_closed() { 4 } else { 1 };
            let n = ((curve.length() / width).ceil() as usize).clamp(least, MOST_BINS);
            Lane {
                width: curve.length() / n as f64,
                closed: curve.is_closed(),
                bins: vec![Bin::default(); n],
                span: None,
                done: vec![false; n],
                steps: vec![0.0; n],
            }
        };
        Self { lanes: curves.iter().flat_map(|c| [lane(c), lane(c)]).collect() }
    }

    /// Enters a triangle by the feet of its corners ahead: the lane of each, its foot, and the
    /// width allowed. `from` is the distance at which the triangle begins.
    pub(crate) fn enter(&mut self, corners: &[(usize, CurveFoot, f64)], from: f64, is_met: bool) {
        let Some(&(lane, ..)) = corners.first() else { return };
        let width = corners.iter().map(|c| c.2).fold(f64::INFINITY, f64::min);
        let depth = corners.iter().map(|c| c.1.distance).fold(0.0, f64::max);
        let one_lane = corners.iter().all(|c| c.0 == lane);
        let bins: Vec<usize> = corners.iter().map(|c| self.lanes[c.0].bin(c.1.at.way)).collect();
        let (low, high) = (bins.iter().copied().min().unwrap_or(0), bins.iter().copied().max().unwrap_or(0));
        let wraps = self.lanes[lane].closed && 2 * (high - low) > self.lanes[lane].bins.len();
        if is_met || !one_lane || wraps {
            for ((lane, foot, _), bin) in corners.iter().zip(bins) {
                let far = foot.distance;
                self.lanes[*lane].bins[bin].enter([from.min(far), far, width], far, is_met);
            }
            return;
        }
        for bin in &mut self.lanes[lane].bins[low..=high] {
            bin.enter([from, depth, width], depth, false);
        }
    }

    /// Finds the steps; `arrival` gives the sum of steps at a way of a curve.
    /// `cycles` are the gains of each curve since its last full pass.
    pub(crate) fn find_steps(
        &mut self,
        settings: &StepSettings,
        cycles: &mut [Gain],
        arrival: impl Fn(usize, f64) -> f64,
    ) {
        for (k, lane) in self.lanes.iter_mut().enumerate() {
            let at = |bin: usize, width: f64| arrival(k / 2, width * (bin as f64 + 0.5));
            let arrivals: Vec<f64> = (0..lane.bins.len()).map(|i| at(i, lane.width)).collect();
            lane.find_steps(settings, &arrivals, &mut cycles[k / 2]);
        }
    }

    /// The end of the curve at which the pass of a lane starts, where it is a partial one.
    pub(crate) fn partial_from(&self, lane: usize) -> Option<usize> {
        self.lanes[lane].span.map(|(_, side)| side)
    }

    /// Ways between which the pass of a lane runs, where it is a partial one.
    pub(crate) fn span(&self, lane: usize) -> Option<[f64; 2]> {
        let lane = &self.lanes[lane];
        lane.span.map(|([from, to], _)| [lane.width * from as f64, lane.width * (to + 1) as f64])
    }

    /// Whether the pass of a lane runs over a way.
    pub(crate) fn holds(&self, lane: usize, way: f64) -> bool {
        let lane = &self.lanes[lane];
        let bin = lane.bin(way);
        !lane.done[bin] && lane.span.is_none_or(|([from, to], _)| (from..=to).contains(&bin))
    }

    /// Step at a way of a lane, mm.
    pub(crate) fn step(&self, lane: usize, way: f64) -> f64 {
        self.lanes[lane].step(way)
    }

    /// Whether nothing more is to be laid ahead of a way of a lane.
    pub(crate) fn is_done(&self, lane: usize, way: f64) -> bool {
        let lane = &self.lanes[lane];
        lane.done[lane.bin(way)]
    }

    /// Whether nothing more is to be laid anywhere.
    pub(crate) fn all_done(&self) -> bool {
        self.lanes.iter().all(|l| l.done.iter().all(|&d| d))
    }
}

impl Bin {
    fn enter(&mut self, part: [f64; 3], depth: f64, is_met: bool) {
        self.ahead.push(part);
        self.depth = self.depth.max(depth);
        self.is_met |= is_met;
    }

    fn sort(&mut self) {
        let order = |a: &[f64; 3], b: &[f64; 3]| {
            let by = |k: usize| a[k].total_cmp(&b[k]);
            by(0).then(by(1)).then(by(2))
        };
        self.ahead.sort_by(order);
    }

    /// Largest step from a distance that no part ahead of it forbids; infinite where there is none.
    fn allowed(&self, covered: f64, share: f64) -> f64 {
        let mut reach = f64::INFINITY;
        for [from, to, width] in &self.ahead {
            if *from >= reach {
                break;
            }
            if *to > covered {
                reach = reach.min(from.max(covered + width * share));
            }
        }
        reach - covered
    }
}

impl Lane {
    fn bin(&self, way: f64) -> usize {
        ((way / self.width).max(0.0) as usize).min(self.bins.len() - 1)
    }

    fn find_steps(&mut self, settings: &StepSettings, arrivals: &[f64], cycle: &mut Gain) {
        let n = self.bins.len();
        self.bins.iter_mut().for_each(Bin::sort);
        let nothing = vec![0.0; n];
        let targets = self.targets(&nothing, settings);
        self.done = targets.iter().map(Option::is_none).collect();
        if self.done.iter().all(|&d| d) {
            // No front: all that has been measured is behind it.
            self.steps = vec![2.0 * settings.reach; n];
            return;
        }
        let full = self.smooth(&targets, &nothing, arrivals, LEAST_SHARE);
        let gain = self.gain(&full, &nothing, [0, n - 1], settings);
        let alone = cycle.and(gain).rate();
        match self.best_partial(&targets, &nothing, arrivals, *cycle, settings) {
            Some(partial) if partial.rate > WORTH * alone => {
                *cycle = cycle.and(partial.gain);
                (self.steps, self.span) = (partial.levels, Some((partial.span, partial.side)));
            }
            _ => (*cycle, self.steps) = (Gain::default(), full),
        }
    }

    /// The partial pass that brings most, together with the full pass after it.
    fn best_partial(
        &self,
        targets: &[Option<f64>],
        covered: &[f64],
        arrivals: &[f64],
        cycle: Gain,
        settings: &StepSettings,
    ) -> Option<PartialPass> {
        let n = self.bins.len();
        if self.closed || n < 4 {
            return None;
        }
        let sides = (0..2).filter(|&side| settings.partial_from[side]);
        let ends = sides.flat_map(|side| (1..ENDS).map(move |k| (side, (n * k).div_ceil(ENDS))));
        let rated = ends.filter_map(|(side, reach)| {
            let mut partial = self.partial(targets, covered, arrivals, side, reach, settings)?;
            let after: Vec<f64> = (0..n)
                .map(|i| if (partial.span[0]..=partial.span[1]).contains(&i) { partial.levels[i] } else { covered[i] })
                .collect();
            let next = self.smooth(&self.targets(&after, settings), &after, arrivals, LEAST_SHARE);
            let full = self.gain(&next, &after, [0, n - 1], settings);
            partial.rate = cycle.and(partial.gain).and(full).rate();
            Some(partial)
        });
        rated.reduce(|best, next| if next.rate > best.rate { next } else { best })
    }

    /// The partial pass from an end over so many stretches, joined to the pass before beyond them.
    fn partial(
        &self,
        targets: &[Option<f64>],
        covered: &[f64],
        arrivals: &[f64],
        side: usize,
        reach: usize,
        settings: &StepSettings,
    ) -> Option<PartialPass> {
        let n = self.bins.len();
        let is_within = |i: usize| if side == 0 { i < reach } else { n - i <= reach };
        let joined: Vec<Option<f64>> =
            (0..n).map(|i| if is_within(i) { targets[i] } else { Some(covered[i]) }).collect();
        let levels = self.smooth(&joined, covered, arrivals, 0.0);
        let gains = |i: usize| targets[i].is_some_and(|t| levels[i] - covered[i] > CUT_ALREADY * (t - covered[i]));
        let inward = |k: usize| if side == 0 { k } else { n - 1 - k };
        let first = (0..n).find(|&k| targets[inward(k)].is_some())?;
        let end = (first..n).find(|&k| !gains(inward(k)))?;
        // It has to join the pass before inside the region.
        if end == first || targets[inward(end)].is_none() {
            return None;
        }
        let span = if side == 0 { [0, end - 1] } else { [n - end, n - 1] };
        let length = self.width * (end - first) as f64;
        if length < settings.shortest {
            return None;
        }
        let gain = self.gain(&levels, covered, span, settings);
        Some(PartialPass { levels, span, side, gain, rate: 0.0 })
    }

    /// Work and cost of a pass over some stretches.
    fn gain(&self, levels: &[f64], covered: &[f64], [from, to]: [usize; 2], settings: &StepSettings) -> Gain {
        let mut gain = Gain { work: 0.0, cost: settings.pass_cost };
        for i in (from..=to).filter(|&i| !self.done[i]) {
            let allowed = self.bins[i].allowed(covered[i], settings.share);
            if allowed.is_finite() && allowed > 0.0 {
                gain.work += self.width * (levels[i] - covered[i]).max(0.0) / allowed;
            }
            gain.cost += self.width;
        }
        gain
    }

    /// Distance of the next pass at each stretch, by three of them each: the step at a stretch lies
    /// between three coefficients. `None` where there is to be none.
    fn targets(&self, covered: &[f64], settings: &StepSettings) -> Vec<Option<f64>> {
        let n = self.bins.len();
        let own: Vec<Option<f64>> = (0..n).map(|i| self.target(i, covered, settings)).collect();
        let lowest = |i: usize| {
            let near = self.beside(i, 0.5 * self.width).filter_map(|k| own[k]).fold(f64::INFINITY, f64::min);
            own[i].map(|o| near.min(o))
        };
        (0..n).map(lowest).collect()
    }

    /// Distance of the next pass at a stretch that is covered up to a distance.
    fn target(&self, i: usize, covered: &[f64], settings: &StepSettings) -> Option<f64> {
        let allowed = self.bins[i].allowed(covered[i], settings.share);
        let (width, depth) = (allowed / settings.share, self.bins[i].depth - covered[i]);
        if !allowed.is_finite() || depth <= REACHED * width {
            return None;
        }
        let allowed = allowed.min(settings.reach / 1.5);
        if self.bins[i].depth >= 0.95 * settings.reach {
            return Some(covered[i] + allowed);
        }
        if self.bins[i].is_met {
            // Fronts that meet at an angle end at the ridge, in the stretch that it leaves: they
            // hold nothing back.
            if let Some(slant) = self.slant_of_ridge(i) {
                return (depth + slant > allowed).then_some(covered[i] + allowed);
            }
            // Within a width of the ridge, the pass along the ridge covers both sides.
            let step = allowed.min(f64::max(depth - 0.5 * width, BEFORE_BORDER * width));
            return (depth > width).then_some(covered[i] + step);
        }
        let goes_on = |k: usize| self.bins[k].depth - covered[k] > self.bins[k].allowed(covered[k], settings.share);
        if depth > allowed || self.beside(i, 0.5 * width).any(goes_on) {
            return Some(covered[i] + allowed);
        }
        Some(covered[i] + allowed.min(depth - BEFORE_BORDER * width))
    }

    /// Change of the depth before the ridge ahead from stretch to stretch, mm; `None` where the
    /// ridge runs along the front rather than across it: where the depth changes less than a front
    /// may turn.
    fn slant_of_ridge(&self, i: usize) -> Option<f64> {
        let beside = self.beside(i, SLANT_BINS * self.width).enumerate();
        let met: Vec<(usize, f64)> =
            beside.filter(|&(_, k)| self.bins[k].is_met).map(|(at, k)| (at, self.bins[k].depth)).collect();
        let (first, last) = (met.first()?.0, met.last()?.0);
        let (low, high) = met.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), m| (low.min(m.1), high.max(m.1)));
        // The mean over all of them: neighbours alone are as uneven as the triangles.
        let slant = (high - low) / (last - first).max(1) as f64;
        (slant > STEEPEST * self.width).then_some(slant)
    }

    /// Stretches within a distance.
    fn beside(&self, i: usize, distance: f64) -> impl Iterator<Item = usize> + use<> {
        let (n, closed) = (self.bins.len() as isize, self.closed);
        let k = ((distance / self.width).ceil() as isize).min(n / 2);
        let at = move |j: isize| if closed { Some(j.rem_euclid(n)) } else { (0..n).contains(&j).then_some(j) };
        (i as isize - k..=i as isize + k).filter_map(at).map(|j| j as usize)
    }

    /// The highest levels below the targets for which the arrival is smooth: the least over all
    /// targets of target + rise, where the rise at a distance is that of an arc that runs out in
    /// the steepest slope. Each step is at least a share of its target.
    fn smooth(&self, targets: &[Option<f64>], covered: &[f64], arrivals: &[f64], least: f64) -> Vec<f64> {
        let n = targets.len();
        let steps = targets.iter().zip(covered).filter_map(|(t, c)| Some(t.as_ref()? - c));
        let widest = steps.fold(0.0, f64::max);
        let highest = targets.iter().flatten().copied().fold(0.0, f64::max);
        let radius = BEND * widest.max(self.width);
        let rise = |k: usize| {
            let (d, arc) = (self.width * k as f64, STEEPEST * radius);
            if d < arc { 0.5 * d * d / radius } else { STEEPEST * (d - 0.5 * arc) }
        };
        // Arrivals differ by slopes up to the steepest, so beyond this nothing holds a step back.
        let most = ((2.0 * highest / STEEPEST + radius) / self.width).ceil() as usize + 1;
        let far = |i: usize, j: usize| if self.closed { i.abs_diff(j).min(n - i.abs_diff(j)) } else { i.abs_diff(j) };
        let rises: Vec<f64> = (0..=most.min(n)).map(rise).collect();
        let level = |i: usize| {
            let near = self.beside(i, self.width * most as f64);
            let held = near.filter_map(|j| Some(arrivals[j] + targets[j]? + rises.get(far(i, j))? - arrivals[i]));
            let held = held.fold(f64::INFINITY, f64::min);
            match targets[i] {
                Some(target) => held.min(target).max(covered[i] + least * (target - covered[i])),
                None if held.is_finite() => held.clamp(covered[i], covered[i] + widest),
                None => covered[i] + widest,
            }
        };
        (0..n).map(level).collect()
    }

    /// The step at a way: a quadratic spline on the stretches.
    fn step(&self, way: f64) -> f64 {
        let n = self.steps.len();
        let x = (way / self.width).clamp(0.0, n as f64);
        let i = (x as usize).min(n - 1);
        let t = x - i as f64;
        let [before, after] =
            if self.closed { [(i + n - 1) % n, (i + 1) % n] } else { [i.saturating_sub(1), (i + 1).min(n - 1)] };
        let weights = [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t];
        [before, i, after].iter().zip(weights).map(|(&k, w)| self.steps[k] * w).sum()
    }
}
