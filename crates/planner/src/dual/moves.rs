//! Entries, exits and links of runs, with both heads moving at once.

use facemill_cl_data::{ClPoint, Monitor};
use facemill_cutter_location::links::approach::{Approach, ApproachSettings, PassEnd, PassEndPose, approach};
use facemill_cutter_location::links::link::{Linker, Waypoint};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PairTest};
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_job::failure::Failure;
use facemill_tool_path::chips::Chip;
use facemill_tool_path::linearity::turned_near;
use facemill_tool_path::moves::{Move, MoveKind, MoveSettings, blocked_way};
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;

use super::runs::{Causes, PairRun};

/// A move of the whole machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DualMove {
    /// Kind of the move.
    pub kind: MoveKind,
    /// Axis values at its end.
    pub axes: AxisValues,
    /// Heads whose tips are programmed with a feed.
    pub working: [bool; 2],
    /// Largest chip of each head's cutter on it; `None` outside the stock, and until it is known.
    pub chips: [Option<Chip>; 2],
}

/// Run with its entry and exit.
#[derive(Clone, Debug)]
pub(crate) struct ReachedRun {
    /// Run without the stops that have no entry or exit.
    pub run: PairRun,
    /// Moves from the clearance surfaces to before its first stop, outermost first.
    pub down: Vec<DualMove>,
    /// Moves from its last stop back to the clearance surfaces.
    pub up: Vec<DualMove>,
}

/// Data for the moves of both heads.
pub(crate) struct DualMover<'r, 'a> {
    /// Both heads.
    pub test: PairTest<'r, 'a>,
    /// One for each head.
    pub settings: [&'r MoveSettings; 2],
}

/// Part of the rapid clearance that remains if a block deviates from the tested path by half of it.
const RAPID_SHARE: f64 = 0.25;

/// Largest turn of a rotary axis that counts as rest, rad: rounding of the inverse solution.
const SAME_ROTARY: f64 = 1e-9;

/// Fractions of the arc radii to try.
const ARC_SHARES: [f64; 3] = [1.0, 0.35, 0.125];

/// Heights above the clearance surfaces that both heads try if the path along them is blocked, mm.
const LIFTS: [f64; 4] = [0.0, 50.0, 150.0, 400.0];

/// Paths of both heads at one end of a run, from beside the cut outward.
struct RunEnds {
    /// Axis values of each head's path, beginning at the cut; every rotary as at the cut.
    ways: [Vec<AxisValues>; 2],
    /// Number of positions of each that belong to the arc and the retract out of stock.
    slow: [usize; 2],
}

impl DualMover<'_, '_> {
    /// Returns runs with entries and exits; runs lose stops at their ends that have none for one of
    /// the heads.
    ///
    /// # Errors
    /// Returns an error if the monitor cancels.
    pub(crate) fn reach(
        &self,
        runs: Vec<PairRun>,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<ReachedRun>, Causes), Failure> {
        let reached: Vec<(Option<ReachedRun>, Causes)> = runs
            .into_par_iter()
            .map(|run| {
                monitor.checkpoint()?;
                let found = self.reach_one(run);
                monitor.advance(1);
                Ok(found)
            })
            .collect::<Result<_, facemill_cl_data::Cancelled>>()?;
        let mut causes = Causes::default();
        let mut all = Vec::new();
        for (run, why) in reached {
            all.extend(run);
            causes.join(why);
        }
        Ok((all, causes))
    }

    fn reach_one(&self, mut run: PairRun) -> (Option<ReachedRun>, Causes) {
        let mut causes = Causes::default();
        let mut found = [None, None];
        for (k, end) in [PassEnd::Entry, PassEnd::Exit].into_iter().enumerate() {
            while found[k].is_none() && run.stops.len() >= 2 {
                match self.end(&run, end) {
                    Ok(moves) => found[k] = Some(moves),
                    Err(why) => {
                        let at = if end == PassEnd::Entry { 0 } else { run.stops.len() - 1 };
                        let stop = run.stops.remove(at);
                        causes.add(why.clone(), why, &stop.cc[0]);
                    }
                }
            }
        }
        match found {
            [Some(mut down), Some(up)] if run.stops.len() >= 2 => {
                down.reverse();
                (Some(ReachedRun { run, down: driven_inward(down), up }), causes)
            }
            _ => (None, causes),
        }
    }

    /// Returns moves from beside one end of a run outward to the clearance surfaces, or the reason
    /// why there are none with the requested arcs. If both heads obstruct each other, it tries
    /// smaller arcs: beyond an edge, opposite cutters come nearer to each other along their
    /// tangents than the arcs lift them.
    fn end(&self, run: &PairRun, end: PassEnd) -> Result<Vec<DualMove>, String> {
        let mut first = None;
        for share in ARC_SHARES {
            match self.end_by(share, run, end) {
                Ok(moves) => return Ok(moves),
                Err(why) => first = first.or(Some(why)),
            }
        }
        Err(first.unwrap_or_default())
    }

    fn end_by(&self, share: f64, run: &PairRun, end: PassEnd) -> Result<Vec<DualMove>, String> {
        let stop = if end == PassEnd::Entry { run.stops.first() } else { run.stops.last() };
        let Some(stop) = stop else { return Err(String::new()) };
        let what = if end == PassEnd::Entry { "entry" } else { "exit" };
        let mut ends = RunEnds { ways: [Vec::new(), Vec::new()], slow: [0; 2] };
        for (h, uncut_left) in run.uncut_left.into_iter().enumerate() {
            let (test, settings) = (self.test.tests[h], self.settings[h]);
            let refused = |why: &Infeasible| format!("head {}: no {what}: {}", h + 1, test.describe(why));
            let pose = &stop.pose.poses[h];
            let at = PassEndPose { end, cc: &stop.cc[h], cl: &pose.cl, configuration: &pose.configuration, uncut_left };
            let shape = if end == PassEnd::Entry { &settings.entry } else { &settings.exit };
            let across = self.still_across(h, &stop.pose.axes);
            let shape = ApproachSettings { still_across: across, ..shape.scaled(share) };
            let Approach { outward, outer, .. } =
                approach(test, &shape, &at, &mut Hints::default()).map_err(|why| refused(&why))?;
            let last = *outward.last().unwrap_or(&pose.cl);
            let from = Waypoint { cl: last, configuration: outer };
            let mut linker = Linker::new(test, &settings.link);
            let out = match across {
                None => linker.way_out(&from),
                Some(across) => linker.straight_out(&from, &across),
            };
            let out = out.map_err(|blocked| refused(&blocked.why))?;
            ends.slow[h] = outward.len();
            let poses = outward.iter().chain(out.iter().map(|w| &w.cl));
            ends.ways[h] = self.standing(h, &pose.configuration, poses).map_err(|why| refused(&why))?;
        }
        self.joined_way(&ends, stop.pose.axes[self.test.shared]).map_err(|(head, why)| {
            format!("no {what} for both heads at once: {}", self.test.tests[head].describe(&why))
        })
    }

    /// Returns the direction in the workpiece frame in which a head cannot move its tool while all
    /// rotary axes rest: with two linear axes the one across both, `None` with three.
    fn still_across(&self, head: usize, axes: &AxisValues) -> Option<Unit<Vector3<f64>>> {
        let machine = self.test.tests[head].cell.machine;
        let linears: Vec<usize> =
            (0..axes.len()).filter(|&k| machine.moves_tool(k) && machine.axes()[k].kind == AxisKind::Linear).collect();
        let [first, second] = linears[..] else { return None };
        let tip = |axes: &AxisValues| self.cl(head, axes).tip;
        let direction = |k: usize| {
            let mut moved = *axes;
            moved[k] += 1.0;
            tip(&moved) - tip(axes)
        };
        Unit::try_new(direction(first).cross(&direction(second)), 1e-6)
    }

    /// Returns axis values at a cut and along poses with its tool axis; the rotary axes rest.
    fn standing<'c>(
        &self,
        head: usize,
        at: &Configuration,
        poses: impl Iterator<Item = &'c ClPoint>,
    ) -> Result<Vec<AxisValues>, Infeasible> {
        let test = self.test.tests[head];
        let mut all = vec![at.axes];
        for cl in poses {
            let mut axes = test.configuration_like(cl, at)?.axes;
            for (k, axis) in test.cell.machine.axes().iter().enumerate() {
                if axis.kind == AxisKind::Rotary {
                    if (axes[k] - at.axes[k]).abs() > SAME_ROTARY {
                        return Err(Infeasible::OtherBranch(at.branch));
                    }
                    axes[k] = at.axes[k];
                }
            }
            all.push(axes);
        }
        Ok(all)
    }

    /// Returns both paths at once, each head at the same fraction of its arc, then of its path out;
    /// the shared axis rests. Every position is on both tested paths, because only linear axes
    /// move.
    fn joined_way(&self, ends: &RunEnds, shared: f64) -> Result<Vec<DualMove>, (usize, Infeasible)> {
        let mut moves = Vec::new();
        let mut hints = [Hints::default(), Hints::default()];
        let slow: [&[AxisValues]; 2] = std::array::from_fn(|h| &ends.ways[h][..=ends.slow[h]]);
        let fast: [&[AxisValues]; 2] = std::array::from_fn(|h| &ends.ways[h][ends.slow[h]..]);
        let mut in_stock = true;
        for (part, is_slow) in [(slow, true), (fast, false)] {
            for of_heads in together(part) {
                let mut axes = self.test.joined([&of_heads[0], &of_heads[1]]);
                axes[self.test.shared] = shared;
                if let Some(why) = self.test.blocked(&axes, &mut hints) {
                    return Err(why);
                }
                let touches = is_slow && (0..2).any(|h| self.in_stock(h, &axes));
                // A move counts as in the stock where one of its ends is.
                let kind = match (is_slow, touches || in_stock) {
                    (false, _) => MoveKind::Rapid,
                    (true, true) => MoveKind::Engage,
                    (true, false) => MoveKind::Approach,
                };
                in_stock = touches;
                moves.push(DualMove { kind, axes, working: [true; 2], chips: [None; 2] });
            }
        }
        Ok(moves)
    }

    fn in_stock(&self, head: usize, axes: &AxisValues) -> bool {
        self.test.tests[head].cutter_in_stock(&self.cl(head, axes), &mut Hints::default())
    }

    /// Returns the pose of a head's tool in the workpiece frame.
    pub(crate) fn cl(&self, head: usize, axes: &AxisValues) -> ClPoint {
        let test = self.test.tests[head];
        test.cell.machine.cl_point(axes, test.cell.tool.gauge_length()).transformed(test.work_from_table())
    }

    /// Returns the axis values after the full turns of the shared axis that bring it nearest to
    /// another position.
    pub(crate) fn turned(&self, axes: &AxisValues, near: &AxisValues) -> AxisValues {
        let machine = self.test.tests[0].cell.machine;
        let mut turned = *axes;
        if machine.axes()[self.test.shared].endless {
            turned[self.test.shared] = turned_near(self.test.tests[0], axes, near)[self.test.shared];
        }
        turned
    }

    /// Returns a rapid from one position to another with all axes at once and both heads on their
    /// clearance surfaces, or farther out if that is blocked.
    ///
    /// # Errors
    /// Returns an error if no height is free.
    pub(crate) fn cross(&self, from: &AxisValues, to: &AxisValues) -> Result<Vec<DualMove>, Failure> {
        let rapid = |axes: AxisValues| DualMove { kind: MoveKind::Rapid, axes, working: [true; 2], chips: [None; 2] };
        let lifted = LIFTS.iter().filter_map(|&lift| match lift {
            0.0 => Some(vec![*to]),
            lift => self.lifted(from, to, lift),
        });
        let mut first = None;
        for way in lifted.chain([self.far_out(from, to)]) {
            let mut at = *from;
            let blocked = way.iter().find_map(|next| {
                let blocked = self.blocked(&at, next);
                at = *next;
                blocked
            });
            match blocked {
                None => return Ok(way.into_iter().map(rapid).collect()),
                Some(why) => first = first.or(Some(why)),
            }
        }
        Err(first.unwrap_or_else(|| Failure::Internal("a link of two heads has no way".to_owned())))
    }

    /// Returns a path over two positions with both heads as far along their spindles as at home.
    fn far_out(&self, from: &AxisValues, to: &AxisValues) -> Vec<AxisValues> {
        let home = self.test.tests[0].cell.machine.home();
        let along = |k: usize| {
            self.test.tests.iter().any(|t| {
                let machine = t.cell.machine;
                let travel = machine.length_compensation_travel();
                machine.moves_tool(k) && travel.is_some_and(|travel| travel.get_or_zero(k).abs() > 0.5)
            })
        };
        let far = |at: &AxisValues| AxisValues::from_fn(at.len(), |k| if along(k) { home[k] } else { at[k] });
        vec![far(from), far(to), *to]
    }

    /// Returns the reason why a rapid block is not free.
    fn blocked(&self, from: &AxisValues, to: &AxisValues) -> Option<Failure> {
        (0..2).find_map(|h| {
            let clearance = RAPID_SHARE * self.settings[h].link.rapid_clearance;
            let block = Linker::new(self.test.tests[h], &self.settings[h].link).rapid_block(from, to, clearance);
            let what = format!("head {}: no way between passes of both heads", h + 1);
            block.err().map(|blocked| blocked_way(self.test.tests[h], &what, &blocked).into())
        })
    }

    /// Returns a path over two positions with both heads farther out than at the ends.
    fn lifted(&self, from: &AxisValues, to: &AxisValues, lift: f64) -> Option<Vec<AxisValues>> {
        Some(vec![self.raised(from, lift)?, self.raised(to, lift)?, *to])
    }

    fn raised(&self, axes: &AxisValues, lift: f64) -> Option<AxisValues> {
        let of = |h: usize| {
            let test = self.test.tests[h];
            let cl = self.cl(h, axes);
            let margin = test.clearance_margin() + lift;
            let clearance = &self.settings[h].link.clearance;
            let raised = match self.still_across(h, axes) {
                None => clearance.retract(&cl, margin),
                Some(across) => clearance.retract_within(&cl, margin, &across),
            };
            let configuration = Configuration { axes: *axes, branch: test.cell.machine.branch_of(axes) };
            self.standing(h, &configuration, std::iter::once(&raised)).ok()?.pop()
        };
        let (a, b) = (of(0)?, of(1)?);
        let mut joined = self.test.joined([&a, &b]);
        joined[self.test.shared] = axes[self.test.shared];
        Some(joined)
    }

    /// Sends the other head home, so that `head` works alone. Returns the rapids from the position
    /// of both heads, and the position after them.
    ///
    /// # Errors
    /// As [`DualMover::cross`].
    pub(crate) fn park_other(
        &self,
        head: usize,
        at: Option<AxisValues>,
    ) -> Result<(Vec<DualMove>, Option<Move>), Failure> {
        let Some(from) = at else { return Ok((Vec::new(), None)) };
        let axes = self.parked(&from, 1 - head);
        let start = Move { kind: MoveKind::Rapid, cl: self.cl(head, &axes), axes, chip: None };
        Ok((self.cross(&from, &axes)?, Some(start)))
    }

    /// Returns the position with one head's own axes at home.
    fn parked(&self, axes: &AxisValues, head: usize) -> AxisValues {
        let machine = self.test.tests[head].cell.machine;
        let home = machine.home();
        let other = self.test.tests[1 - head].cell.machine;
        let own = |k: usize| machine.moves_tool(k) && !other.moves_tool(k);
        AxisValues::from_fn(axes.len(), |k| if own(k) { home[k] } else { axes[k] })
    }
}

/// Reverses moves found from the cut outward, so that they go inward: each has the kind of the path
/// that it covers, which is noted at its outer end.
fn driven_inward(outer_first: Vec<DualMove>) -> Vec<DualMove> {
    let kinds: Vec<MoveKind> = outer_first.iter().map(|m| m.kind).collect();
    let mut inward = outer_first;
    for k in 1..inward.len() {
        inward[k].kind = kinds[k - 1];
    }
    if let Some(first) = inward.first_mut() {
        first.kind = MoveKind::Rapid;
    }
    inward
}

/// Returns positions on two polylines at equal fractions of their lengths: at the corners of both,
/// without the start.
fn together(ways: [&[AxisValues]; 2]) -> Vec<[AxisValues; 2]> {
    let parts = ways.map(parts);
    let mut all: Vec<f64> = parts.iter().flatten().copied().filter(|p| *p > 0.0).collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| *a - *b < 1e-9);
    all.into_iter().map(|part| std::array::from_fn(|h| place(ways[h], &parts[h], part))).collect()
}

/// Returns the fraction of a polyline's length at each of its corners.
fn parts(way: &[AxisValues]) -> Vec<f64> {
    let step = |w: &[AxisValues]| w[0].iter().zip(w[1].iter()).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt();
    let total: f64 = way.windows(2).map(step).sum();
    let mut sum = 0.0;
    let mut parts = vec![0.0];
    for w in way.windows(2) {
        sum += step(w);
        parts.push(if total > 0.0 { sum / total } else { 1.0 });
    }
    if let Some(last) = parts.last_mut().filter(|_| way.len() > 1) {
        *last = 1.0;
    }
    parts
}

fn place(way: &[AxisValues], parts: &[f64], part: f64) -> AxisValues {
    let k = parts.partition_point(|p| *p < part).clamp(1, way.len().max(2) - 1);
    let (Some(a), Some(b)) = (way.get(k - 1), way.get(k)) else { return way[0] };
    let span = parts[k] - parts[k - 1];
    if span > 0.0 { a.lerp(b, ((part - parts[k - 1]) / span).clamp(0.0, 1.0)) } else { *b }
}
