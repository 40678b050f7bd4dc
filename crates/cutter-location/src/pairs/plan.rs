//! Plan of two passes cut at once by two heads that share an axis: its values along the way, and
//! both heads' postures.

use std::f64::consts::TAU;

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};

use crate::cusp::cut_point::Strip;
use crate::pairs::costs::CostTable;
use crate::pairs::shared_axis::{PostureRange, SharedAxis, TILT_STEPS, turned_to};
use crate::pairs::test::{PairBlocked, PairOutcome, PairTest};
use crate::pairs::values::{ValueNode, ValuePath, ValueState};
use crate::passes::cost::CuspScale;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints};

/// CC points that both heads reach at the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairStation {
    /// One for each head.
    pub cc: [CcPoint; 2],
    /// Way along each surface from the station before, mm; 0 at the first.
    pub way: [f64; 2],
}

/// Settings for the postures of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairSettings {
    /// Postures that each head may take.
    pub ranges: [PostureRange; 2],
    /// Feed of each tip along its path, mm/s.
    pub feeds: [f64; 2],
    /// Cusp that is allowed on each side, mm.
    pub cusps: [f64; 2],
    /// Strip between a pass and its neighbour on each side.
    pub strips: [Strip; 2],
    /// Largest change of tilt per path length, rad/mm. Larger: less tilt spent on smoothness, but
    /// heads that jump.
    pub max_turn_per_mm: f64,
    /// Longest way between stations at which values of the shared axis are compared, mm. Larger:
    /// fewer tests, but a shorter stretch that needs another value is missed.
    pub spacing: f64,
}

/// Plans poses of both heads at every station, or the reason why there are none.
///
/// The values of the shared axis are the cheapest sequence over stations at most `spacing` apart.
/// The cost is cusps on both sides against the allowed ones, tilts against their largest, and the
/// axis' speed, each squared. Between these stations the values follow a smooth curve. Postures
/// that leave a cusp above the allowed one, between passes that are `strips` apart, are rejected.
/// At every station each head has the cheapest feasible one of the tilts tried. It is raised where
/// that keeps its change within `max_turn_per_mm` and where the heads would otherwise collide. The
/// result is tested for each head alone and then with the other head.
///
/// `start` is the configuration of the first head at the first station
/// ([`PairTest::configurations_over`] gives one for each branch); the second head takes the branch
/// on which it needs the nearest value of the shared axis.
///
/// # Errors
/// When the monitor cancels.
pub fn plan_pair(
    pair: &PairTest<'_, '_>,
    stations: &[PairStation],
    settings: &PairSettings,
    start: &Configuration,
    monitor: &dyn Monitor,
) -> Result<Vec<PairOutcome>, Cancelled> {
    let plan = PairPlan { pair, stations, settings, monitor };
    let nears = plan.nears(start);
    let axis = |head: usize, station: usize| {
        let (test, range) = (pair.tests[head], settings.ranges[head]);
        SharedAxis::new(test, pair.shared, range, stations[station].cc[head], nears[station][head])
    };
    let axes: Vec<[SharedAxis<'_, '_>; 2]> = (0..stations.len()).map(|k| [axis(0, k), axis(1, k)]).collect();
    let costs = [plan.cost(0), plan.cost(1)];
    plan.with_axes(&Axes { axes, costs })
}

struct PairPlan<'p, 't, 'a> {
    pair: &'p PairTest<'t, 'a>,
    stations: &'p [PairStation],
    settings: &'p PairSettings,
    monitor: &'p dyn Monitor,
}

/// The shared axis as each head sees it at each station, and what its postures cost.
struct Axes<'t, 'a> {
    axes: Vec<[SharedAxis<'t, 'a>; 2]>,
    costs: [CostTable; 2],
}

impl Axes<'_, '_> {
    fn cheapest(
        &self,
        station: usize,
        head: usize,
        value: f64,
        least: f64,
        hints: &mut [Hints; 2],
    ) -> Result<(FeasiblePose, f64), PairBlocked> {
        let cost = |posture: Posture| self.costs[head].at(posture);
        let found = self.axes[station][head].cheapest(value, least, &cost, &mut hints[head]);
        match found {
            Ok((_, cost)) if cost > self.costs[head].most => Err(PairBlocked::Cusp { head }),
            found => found.map_err(|why| PairBlocked::Head { head, why }),
        }
    }
}

/// Poses of one head at each station.
type HeadPoses = Vec<Result<FeasiblePose, PairBlocked>>;

impl PairPlan<'_, '_, '_> {
    fn with_axes(&self, axes: &Axes<'_, '_>) -> Result<Vec<PairOutcome>, Cancelled> {
        let times = self.times();
        let mut hints = [Hints::default(), Hints::default()];
        let mut nodes: Vec<ValueNode> = Vec::new();
        let mut wanted = self.node_stations();
        let mut rounds = 0;
        loop {
            for station in wanted {
                self.monitor.checkpoint()?;
                let (states, blocked) = self.states(station, axes, &mut hints);
                nodes.push(ValueNode { station, time: times[station], states, blocked });
            }
            nodes.sort_by_key(|n| n.station);
            let shared = &self.pair.tests[0].cell.machine.axes()[self.pair.shared];
            let mut path = ValuePath::cheapest(&nodes, shared.max_velocity);
            path.smooth(|station, value| (0..2).all(|h| axes.cheapest(station, h, value, 0.0, &mut hints).is_ok()));
            let values: Vec<Result<f64, PairBlocked>> =
                times.iter().enumerate().map(|(k, &time)| path.value(k, time)).collect();
            let found = self.apart(&values, axes, &mut hints)?;
            // Where the curve between nodes leaves the range of a head, its values are tested, too.
            let is_node = |k: &usize| nodes.binary_search_by_key(k, |n| n.station).is_ok();
            wanted = (0..found.len())
                .filter(|k| {
                    matches!(
                        found[*k],
                        Err(PairBlocked::Head { .. } | PairBlocked::Cusp { .. } | PairBlocked::Together { .. })
                    ) && !is_node(k)
                })
                .collect();
            rounds += 1;
            if wanted.is_empty() || rounds == NODE_ROUNDS {
                return Ok(self.wound(found));
            }
        }
    }

    /// Moves a limited shared axis to turns within its limits: one turn for as many consecutive
    /// stations as possible, the one with the fewest full turns from the values found.
    fn wound(&self, mut found: Vec<PairOutcome>) -> Vec<PairOutcome> {
        let shared = self.pair.shared;
        let mut from = 0;
        while from < found.len() {
            let mut common: Option<[i64; 2]> = None;
            let mut to = from;
            while let Some(Ok(pose)) = found.get(to) {
                let Some([least, most]) = self.pair.turns(pose.axes.get_or_zero(shared)) else { break };
                let both = common.map_or([least, most], |[a, b]| [a.max(least), b.min(most)]);
                if both[0] > both[1] {
                    break;
                }
                (common, to) = (Some(both), to + 1);
            }
            if let Some([least, most]) = common {
                let turn = 0i64.clamp(least, most) as f64 * TAU;
                for pose in found[from..to].iter_mut().flatten() {
                    pose.axes[shared] += turn;
                    pose.poses.iter_mut().for_each(|p| p.configuration.axes[shared] += turn);
                }
            }
            from = to.max(from + 1);
        }
        found
    }

    /// Returns the lattice values of the shared axis at which both heads have a pose at a station,
    /// and the reason if there are none.
    fn states(&self, station: usize, axes: &Axes<'_, '_>, hints: &mut [Hints; 2]) -> (Vec<ValueState>, PairBlocked) {
        let of_heads = &axes.axes[station];
        let values = [of_heads[0].values(), of_heads[1].values()];
        let none = PairBlocked::NoCommonValue(values);
        let [Some(a), Some(b)] = values else { return (Vec::new(), none) };
        let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
        let mut blocked = None;
        let mut states = Vec::new();
        let of_lattice = (low / VALUE_STEP).ceil() as i64..=(high / VALUE_STEP).floor() as i64;
        // The common range may lie between two values of the lattice.
        let between = (of_lattice.is_empty() && low <= high).then_some(0.5 * (low + high));
        for value in of_lattice.map(|index| index as f64 * VALUE_STEP).chain(between) {
            match self.cost_apart(station, value, axes, hints) {
                Ok(cost) => states.push(ValueState { value, cost }),
                // The error names the posture that came nearest to being feasible.
                Err(why) if blocked.is_none_or(|b: PairBlocked| b.progress() < why.progress()) => blocked = Some(why),
                Err(_) => {}
            }
        }
        (states, blocked.unwrap_or(none))
    }

    /// Returns the cost of the cheapest postures at a value at which the heads keep clear of each
    /// other: both tilts raised as in [`PairPlan::apart`].
    fn cost_apart(
        &self,
        station: usize,
        value: f64,
        axes: &Axes<'_, '_>,
        hints: &mut [Hints; 2],
    ) -> Result<f64, PairBlocked> {
        let mut least = self.least_tilts(station);
        let mut together = [Hints::default(), Hints::default()];
        let mut hit = None;
        loop {
            let mut find =
                |head: usize| axes.cheapest(station, head, value, least[head], hints).map_err(|why| hit.unwrap_or(why));
            let [(a, cost_a), (b, cost_b)] = [find(0)?, find(1)?];
            match self.pair.together([a, b], value, &mut together) {
                Ok(_) => return Ok(cost_a + cost_b),
                Err(why) => {
                    hit = Some(why);
                    least = self.raised([&a, &b]).ok_or(why)?;
                }
            }
        }
    }

    /// Returns the least tilts at a station without other requirements.
    fn least_tilts(&self, station: usize) -> [f64; 2] {
        let at_end = station == 0 || station + 1 == self.stations.len();
        self.settings.ranges.map(|range| {
            let [low, high] = range.tilt;
            if at_end { low + END_SHARE * (high - low) } else { low }
        })
    }

    /// Returns the next tilts above those of two poses, as far as there are any; `None` where there
    /// are none.
    fn raised(&self, poses: [&FeasiblePose; 2]) -> Option<[f64; 2]> {
        let next = |h: usize| self.settings.ranges[h].tilts().find(|t| *t > poses[h].posture.tilt + 1e-9);
        let next = [next(0), next(1)];
        let least = |h: usize| next[h].unwrap_or(poses[h].posture.tilt);
        next.iter().any(Option::is_some).then(|| [least(0), least(1)])
    }

    /// Returns poses of both heads at the values of the shared axis. At the ends, where cutters
    /// reach beyond the edges, both tilts are raised; where heads still collide, they are raised
    /// step by step: opposite cutters that lean forward move apart behind their points.
    fn apart(
        &self,
        values: &[Result<f64, PairBlocked>],
        axes: &Axes<'_, '_>,
        hints: &mut [Hints; 2],
    ) -> Result<Vec<PairOutcome>, Cancelled> {
        let n = values.len();
        let mut least: Vec<[f64; 2]> = (0..n).map(|k| self.least_tilts(k)).collect();
        let none = || vec![Err(PairBlocked::Jump); n];
        let mut poses: [HeadPoses; 2] = [none(), none()];
        let mut open: Vec<usize> = (0..n).collect();
        let mut together = [Hints::default(), Hints::default()];
        let mut found: Vec<PairOutcome> = vec![Err(PairBlocked::Jump); n];
        for _ in 0..=TILT_STEPS {
            for (head, poses) in poses.iter_mut().enumerate() {
                self.monitor.checkpoint()?;
                for &k in &open {
                    poses[k] = values[k].and_then(|value| Ok(axes.cheapest(k, head, value, least[k][head], hints)?.0));
                }
                self.smooth_tilts(head, values, axes, poses, hints);
            }
            for k in 0..n {
                found[k] = match (&poses[0][k], &poses[1][k], values[k]) {
                    (Ok(a), Ok(b), Ok(value)) => self.pair.together([*a, *b], value, &mut together),
                    // Nothing to raise tilts to: the reason for raising them is reported.
                    (Err(_), ..) | (_, Err(_), _) if matches!(found[k], Err(PairBlocked::Together { .. })) => found[k],
                    (Err(why), ..) | (_, Err(why), _) => Err(*why),
                    (.., Err(why)) => Err(why),
                };
            }
            open = (0..n).filter(|&k| matches!(found[k], Err(PairBlocked::Together { .. }))).collect();
            let mut raised = false;
            for &k in &open {
                if let (Ok(a), Ok(b)) = (&poses[0][k], &poses[1][k])
                    && let Some(next) = self.raised([a, b])
                {
                    (least[k], raised) = (next, true);
                }
            }
            if !raised {
                break;
            }
        }
        self.round_tilts(values, axes, &mut found, hints)?;
        Ok(found)
    }

    /// Draws tilts toward those of their neighbours where both heads stay feasible, because the
    /// tilts found jump between the few values tried.
    fn round_tilts(
        &self,
        values: &[Result<f64, PairBlocked>],
        axes: &Axes<'_, '_>,
        found: &mut [PairOutcome],
        hints: &mut [Hints; 2],
    ) -> Result<(), Cancelled> {
        let mut together = [Hints::default(), Hints::default()];
        for _ in 0..ROUNDING_ROUNDS {
            self.monitor.checkpoint()?;
            for k in 1..found.len().saturating_sub(1) {
                let ([Ok(before), Ok(own), Ok(behind)], Ok(value)) = (&found[k - 1..=k + 1], values[k]) else {
                    continue;
                };
                let rounded = |head: usize| {
                    let [a, b, c] = [before, own, behind].map(|pose| pose.poses[head].posture.tilt);
                    let wanted = 0.5 * b + 0.25 * (a + c);
                    let is_even = (wanted - b).abs() < EVEN;
                    if is_even {
                        own.poses[head]
                    } else {
                        self.at_tilt(axes, k, head, (value, wanted), hints).unwrap_or(own.poses[head])
                    }
                };
                let poses = [0, 1].map(rounded);
                if poses != own.poses
                    && let Ok(pose) = self.pair.together(poses, value, &mut together)
                {
                    found[k] = Ok(pose);
                }
            }
        }
        Ok(())
    }

    /// Returns the pose of a head at a value of the shared axis and a tilt, next to its present
    /// one; `None` where none is allowed.
    fn at_tilt(
        &self,
        axes: &Axes<'_, '_>,
        station: usize,
        head: usize,
        (value, tilt): (f64, f64),
        hints: &mut [Hints; 2],
    ) -> Option<FeasiblePose> {
        let pose = axes.axes[station][head].feasible(value, tilt, &mut hints[head]).ok()?;
        let cost = &axes.costs[head];
        (cost.at(pose.posture) <= cost.most).then_some(pose)
    }

    /// Raises tilts that are below what their neighbours allow.
    fn smooth_tilts(
        &self,
        head: usize,
        values: &[Result<f64, PairBlocked>],
        axes: &Axes<'_, '_>,
        poses: &mut HeadPoses,
        hints: &mut [Hints; 2],
    ) {
        for _ in 0..SMOOTHING_ROUNDS {
            let wanted = self.rate_limited(head, poses);
            let mut larger = false;
            for k in 0..poses.len() {
                let (Ok(own), Some(wanted), Ok(value)) = (poses[k], wanted[k], values[k]) else { continue };
                if wanted > own.posture.tilt + 1e-9
                    && let Ok((raised, _)) = axes.cheapest(k, head, value, wanted, hints)
                {
                    larger |= raised.posture.tilt > wanted + 1e-9;
                    poses[k] = Ok(raised);
                }
            }
            if !larger {
                break;
            }
        }
    }

    /// Returns the costs of a head's postures.
    fn cost(&self, head: usize) -> CostTable {
        let cutter = *self.pair.tests[head].cell.tool.cutter();
        let scale = CuspScale { cutter, allowed: self.settings.cusps[head] };
        CostTable::new(&scale, &self.settings.strips[head], self.settings.ranges[head])
    }

    /// Returns the configuration of each head at each station in its plain posture, with branch and
    /// windings along the way.
    fn nears(&self, start: &Configuration) -> Vec<[Configuration; 2]> {
        let Some(first) = self.stations.first() else { return Vec::new() };
        let mut near = [*start, self.second_start(first, start)];
        let follow = |station: &PairStation| {
            for (head, near) in near.iter_mut().enumerate() {
                let test = self.pair.tests[head];
                let cutter = test.cell.tool.cutter();
                let cl = facemill_tool_model::cl_from_cc(cutter, &station.cc[head], self.settings.ranges[head].plain());
                if let Ok(mut configuration) = test.configuration_like(&cl, near) {
                    // A limited axis continues past the jump of its turns within the limits.
                    let (shared, kind) = (self.pair.shared, self.pair.kind());
                    let value = configuration.axes.get_or_zero(shared);
                    configuration.axes[shared] = turned_to(kind, value, near.axes.get_or_zero(shared));
                    *near = configuration;
                }
            }
            near
        };
        self.stations.iter().map(follow).collect()
    }

    /// Returns the configuration of the second head at the first station, on the branch whose
    /// shared value is nearest to the first head's.
    fn second_start(&self, station: &PairStation, start: &Configuration) -> Configuration {
        let (shared, kind) = (self.pair.shared, self.pair.kind());
        let wanted = start.axes.get_or_zero(shared);
        let turned = |mut c: Configuration| {
            c.axes[shared] = turned_to(kind, c.axes.get_or_zero(shared), wanted);
            c
        };
        let distance = |c: &Configuration| (c.axes.get_or_zero(shared) - wanted).abs();
        let all = self.pair.configurations_over(1, &station.cc[1], &self.settings.ranges[1]).into_iter().map(turned);
        all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(*start)
    }

    /// Returns the time at each station at the programmed feeds, s; the slower head counts.
    fn times(&self) -> Vec<f64> {
        let mut time = 0.0;
        let feeds = self.settings.feeds;
        let step = |s: &PairStation| {
            time += (s.way[0] / feeds[0]).max(s.way[1] / feeds[1]);
            time
        };
        self.stations.iter().map(step).collect()
    }

    /// Returns the stations at which values are compared: the first, the last, and between them one
    /// for every `spacing`.
    fn node_stations(&self) -> Vec<usize> {
        let mut chosen = Vec::new();
        let mut way = f64::INFINITY;
        for (k, s) in self.stations.iter().enumerate() {
            way += s.way[0].max(s.way[1]);
            if way >= self.settings.spacing || k + 1 == self.stations.len() {
                chosen.push(k);
                way = 0.0;
            }
        }
        chosen
    }

    /// Returns tilts that are nowhere below those found and change by no more than allowed from
    /// neighbour to neighbour.
    fn rate_limited(&self, head: usize, found: &[Result<FeasiblePose, PairBlocked>]) -> Vec<Option<f64>> {
        let mut tilts: Vec<Option<f64>> = found.iter().map(|f| f.as_ref().ok().map(|p| p.posture.tilt)).collect();
        let sweep = |tilts: &mut Vec<Option<f64>>, from: usize, to: usize| {
            let step = self.stations[from.max(to)].way[head] * self.settings.max_turn_per_mm;
            if let (Some(a), Some(b)) = (tilts[from], tilts[to]) {
                tilts[to] = Some(b.max(a - step));
            }
        };
        for k in 1..tilts.len() {
            sweep(&mut tilts, k - 1, k);
        }
        for k in (1..tilts.len()).rev() {
            sweep(&mut tilts, k, k - 1);
        }
        tilts
    }
}

/// Step of the values of the shared axis that are compared, rad.
const VALUE_STEP: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Least tilt at the ends of a way, as part of the range: cutters reach beyond the edges there,
/// with nothing between them.
const END_SHARE: f64 = 0.375;

/// Rounds of testing values of the shared axis where the curve between others is not feasible.
const NODE_ROUNDS: usize = 3;

/// Rounds of drawing tilts to their neighbours'; each spreads a step of the lattice over about one
/// more station.
const ROUNDING_ROUNDS: usize = 8;

/// Tilts nearer than this to their neighbours' stay unchanged, rad.
const EVEN: f64 = 5e-4;

/// Rounds of raising tilts to their neighbours'.
const SMOOTHING_ROUNDS: usize = 4;
