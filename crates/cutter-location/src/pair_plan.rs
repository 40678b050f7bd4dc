//! Two passes cut at once by two heads that share an axis: its values along the way, and both heads' postures.

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};
use facemill_inverse_kinematics::AxisValues;

use crate::cusp::Strip;
use crate::pair_values::{ValueNode, ValuePath, ValueState};
use crate::pass_cost::CuspScale;
use crate::shared_axis::{PostureRange, SharedAxis, TILT_STEPS, turned_to};
use crate::{Configuration, FeasiblePose, Hints, Infeasible, PoseTest};

/// Two heads of one machine that share an axis. Both tests are of views of the same machine, whose axes are the same in the
/// same order, the first of the head that is numbered 0.
#[derive(Clone, Copy)]
pub struct PairTest<'t, 'a> {
    /// One test for each head.
    pub tests: [&'t PoseTest<'a>; 2],
    /// Index of the axis that both share.
    pub shared: usize,
}

/// CC points that both heads are at at the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairStation {
    /// One for each head.
    pub cc: [CcPoint; 2],
    /// Way along each surface from the station before, mm; 0 at the first.
    pub way: [f64; 2],
}

/// How the postures of a pair are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairSettings {
    /// Postures that each head may take.
    pub ranges: [PostureRange; 2],
    /// Feed of each tip along its path, mm/s.
    pub feeds: [f64; 2],
    /// Cusp that is allowed on each side, mm.
    pub cusps: [f64; 2],
    /// What lies between a pass and its neighbour on each side.
    pub strips: [Strip; 2],
    /// Largest change of tilt per path length, rad/mm. Larger: less tilt spent on smoothness, but heads that jump.
    pub max_turn_per_mm: f64,
    /// Longest way between stations at which values of the shared axis are compared, mm. Larger: less to test, but what
    /// needs another value for a shorter stretch is passed over.
    pub spacing: f64,
}

/// Both heads at a station, tested together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairPose {
    /// One for each head; its configuration has the other head's axes where they are parked.
    pub poses: [FeasiblePose; 2],
    /// All axes, both heads at the station.
    pub axes: AxisValues,
}

/// Why both heads cannot be at a station at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairBlocked {
    /// No value of the shared axis is among those that both heads can stand at with their postures; told are the values of
    /// each, rad or mm, where it has some.
    NoCommonValue([Option<[f64; 2]>; 2]),
    /// The values before and behind are too far apart for the axis to go on from one to the other.
    Jump,
    /// At the value of the shared axis a head has no feasible posture.
    Head {
        /// The head, 0 or 1.
        head: usize,
        /// Why its first posture with that value cannot be taken; `None` where it has none.
        why: Option<Infeasible>,
    },
    /// Each head can stand there alone, but not both.
    Together {
        /// The head whose tool or bodies meet something, 0 or 1.
        head: usize,
        /// What they meet.
        why: Infeasible,
    },
}

/// What was found at a station.
pub type PairOutcome = Result<PairPose, PairBlocked>;

impl<'t, 'a> PairTest<'t, 'a> {
    /// Axis values with each head as its own values say, and the shared axis as the first head's.
    pub fn joined(&self, of_heads: [&AxisValues; 2]) -> AxisValues {
        let moves = |head: usize, axis: usize| self.tests[head].cell.machine.moves_tool(axis);
        let from_second = |k: usize| moves(1, k) && !moves(0, k);
        AxisValues::from_fn(of_heads[0].len(), |k| of_heads[usize::from(from_second(k))].get_or_zero(k))
    }

    /// Both poses at one value of the shared axis as one stand of the machine, which is tested: each head was tested alone.
    ///
    /// # Errors
    /// What one head hits of the other.
    fn together(&self, mut poses: [FeasiblePose; 2], value: f64, hints: &mut [Hints; 2]) -> PairOutcome {
        for pose in &mut poses {
            pose.configuration.axes[self.shared] = value;
        }
        let axes = self.joined([&poses[0].configuration.axes, &poses[1].configuration.axes]);
        match self.blocked(&axes, hints) {
            None => Ok(PairPose { poses, axes }),
            Some((head, why)) => Err(PairBlocked::Together { head, why }),
        }
    }

    /// What one of the heads hits at axis values, and which head. Both are asked: what a head keeps off of the other one is
    /// larger than that one's own body.
    pub fn blocked(&self, axes: &AxisValues, hints: &mut [Hints; 2]) -> Option<(usize, Infeasible)> {
        (0..2).find_map(|head| Some((head, self.tests[head].collision(axes, &mut hints[head])?)))
    }

    /// What stations that are blocked for the same cause have in common.
    pub fn cause(&self, why: &PairBlocked) -> String {
        match why {
            PairBlocked::NoCommonValue(_) => format!("no common {}", self.letter()),
            other => self.describe(other),
        }
    }

    fn letter(&self) -> String {
        self.tests[0].cell.machine.axes()[self.shared].letter.to_string()
    }

    /// One sentence on why both heads cannot be at a station at once.
    pub fn describe(&self, why: &PairBlocked) -> String {
        let axis = &self.tests[0].cell.machine.axes()[self.shared];
        let letter = self.letter();
        match why {
            PairBlocked::NoCommonValue(values) => {
                let of = |head: usize| match values[head] {
                    Some([low, high]) => {
                        let word = |v| axis.in_word_unit(v);
                        format!("head {} needs {letter} from {:.1} to {:.1}", head + 1, word(low), word(high))
                    }
                    None => format!("head {} reaches it with none", head + 1),
                };
                format!("no common {letter}: {}, {}", of(0), of(1))
            }
            PairBlocked::Jump => format!("{letter} would have to jump"),
            PairBlocked::Head { head, why } => {
                let what = match why {
                    Some(why) => self.tests[*head].describe(why),
                    None => "no posture of the range".to_owned(),
                };
                format!("head {} at the common {letter}: {what}", head + 1)
            }
            PairBlocked::Together { head, why } => format!("both heads at once: {}", self.tests[*head].describe(why)),
        }
    }
}

impl PairTest<'_, '_> {
    /// Both heads at CC points between two stops, with the shared axis and both tilts halfway between theirs.
    ///
    /// # Errors
    /// Why they cannot be there.
    pub fn halfway(
        &self,
        ranges: &[PostureRange; 2],
        cc: &[CcPoint; 2],
        [from, to]: [&PairPose; 2],
        hints: &mut [Hints; 2],
    ) -> PairOutcome {
        let middle = |a: f64, b: f64| 0.5 * (a + b);
        let value = middle(from.axes.get_or_zero(self.shared), to.axes.get_or_zero(self.shared));
        let mut pose_of = |head: usize| {
            let near = from.poses[head].configuration;
            let axis = SharedAxis::new(self.tests[head], self.shared, ranges[head], cc[head], near);
            let tilt = middle(from.poses[head].posture.tilt, to.poses[head].posture.tilt);
            let found = axis.feasible(value, tilt, &mut hints[head]);
            let by_tilt = |p: Posture| p.tilt;
            let found = found.or_else(|_| axis.cheapest(value, tilt, &by_tilt, &mut hints[head]).map(|found| found.0));
            found.map_err(|why| PairBlocked::Head { head, why })
        };
        let poses = [pose_of(0)?, pose_of(1)?];
        self.together(poses, value, &mut [Hints::default(), Hints::default()])
    }
}

/// Poses of both heads at every station, or why there are none.
///
/// The values of the shared axis are the cheapest sequence over stations at most `spacing` apart: cusps on both sides against
/// the allowed ones, tilts against their largest, and the axis' speed, each squared. Between them they follow a smooth
/// curve. At every station each head has the cheapest feasible tilt of those looked at, raised where that keeps its change
/// within `max_turn_per_mm` and where the heads would else be in each other's way, and is tested as it stands, alone and
/// then with the other head.
///
/// `start` is how the first head stands at the first station; the second one takes the branch on which it needs the nearest
/// value of the shared axis.
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
        found.map_err(|why| PairBlocked::Head { head, why })
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
            // Where the curve between nodes passes what a head can do, its values are looked at, too.
            let is_node = |k: &usize| nodes.binary_search_by_key(k, |n| n.station).is_ok();
            wanted = (0..found.len())
                .filter(|k| {
                    matches!(found[*k], Err(PairBlocked::Head { .. } | PairBlocked::Together { .. })) && !is_node(k)
                })
                .collect();
            rounds += 1;
            if wanted.is_empty() || rounds == NODE_ROUNDS {
                return Ok(found);
            }
        }
    }

    /// Values of the shared axis at which both heads can stand at a station at once, of a lattice; and why there are none, if so.
    fn states(&self, station: usize, axes: &Axes<'_, '_>, hints: &mut [Hints; 2]) -> (Vec<ValueState>, PairBlocked) {
        let of_heads = &axes.axes[station];
        let values = [of_heads[0].values(), of_heads[1].values()];
        let none = PairBlocked::NoCommonValue(values);
        let [Some(a), Some(b)] = values else { return (Vec::new(), none) };
        let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
        let mut blocked = None;
        let mut states = Vec::new();
        for index in (low / VALUE_STEP).ceil() as i64..=(high / VALUE_STEP).floor() as i64 {
            let value = index as f64 * VALUE_STEP;
            match self.cost_apart(station, value, axes, hints) {
                Ok(cost) => states.push(ValueState { value, cost }),
                Err(why) => blocked = blocked.or(Some(why)),
            }
        }
        (states, blocked.unwrap_or(none))
    }

    /// What the cheapest postures at a value cost with which the heads are not in each other's way: both tilts raised as in
    /// [`PairPlan::apart`].
    fn cost_apart(
        &self,
        station: usize,
        value: f64,
        axes: &Axes<'_, '_>,
        hints: &mut [Hints; 2],
    ) -> Result<f64, PairBlocked> {
        let mut least = self.least_tilts(station);
        let mut together = [Hints::default(), Hints::default()];
        loop {
            let mut find = |head: usize| axes.cheapest(station, head, value, least[head], hints);
            let [(a, cost_a), (b, cost_b)] = [find(0)?, find(1)?];
            match self.pair.together([a, b], value, &mut together) {
                Ok(_) => return Ok(cost_a + cost_b),
                Err(why) => least = self.raised([&a, &b]).ok_or(why)?,
            }
        }
    }

    /// Least tilts at a station where nothing else asks for more.
    fn least_tilts(&self, station: usize) -> [f64; 2] {
        let at_end = station == 0 || station + 1 == self.stations.len();
        self.settings.ranges.map(|range| {
            let [low, high] = range.tilt;
            if at_end { low + END_SHARE * (high - low) } else { low }
        })
    }

    /// The next tilts above those of two poses, as far as there are any; `None` where there are none.
    fn raised(&self, poses: [&FeasiblePose; 2]) -> Option<[f64; 2]> {
        let next = |h: usize| self.settings.ranges[h].tilts().find(|t| *t > poses[h].posture.tilt + 1e-9);
        let next = [next(0), next(1)];
        let least = |h: usize| next[h].unwrap_or(poses[h].posture.tilt);
        next.iter().any(Option::is_some).then(|| [least(0), least(1)])
    }

    /// Poses of both heads at the values of the shared axis. At the ends, where cutters reach beyond the edges, both tilts are
    /// raised; where heads are in each other's way still, they are raised step by step: opposite cutters that lean forward
    /// part behind their points.
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
        Ok(found)
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

    /// What postures of a head cost.
    fn cost(&self, head: usize) -> CostTable {
        let cutter = *self.pair.tests[head].cell.tool.cutter();
        let scale = CuspScale { cutter, allowed: self.settings.cusps[head] };
        CostTable::new(&scale, &self.settings.strips[head], self.settings.ranges[head])
    }

    /// The posture that a head has where nothing asks for another.
    fn plain(&self, head: usize) -> Posture {
        let PostureRange { tilt, rotate } = self.settings.ranges[head];
        Posture { tilt: tilt[0], rotate: 0.0_f64.clamp(rotate[0], rotate[1]) }
    }

    /// How each head would stand at each station in its plain posture: branch and windings along the way.
    fn nears(&self, start: &Configuration) -> Vec<[Configuration; 2]> {
        let Some(first) = self.stations.first() else { return Vec::new() };
        let mut near = [*start, self.second_start(first, start)];
        let follow = |station: &PairStation| {
            for (head, near) in near.iter_mut().enumerate() {
                let test = self.pair.tests[head];
                let cutter = test.cell.tool.cutter();
                let cl = facemill_tool_model::cl_from_cc(cutter, &station.cc[head], self.plain(head));
                if let Ok(configuration) = test.configuration_like(&cl, near) {
                    *near = configuration;
                }
            }
            near
        };
        self.stations.iter().map(follow).collect()
    }

    /// How the second head stands at the first station: on the branch whose shared value is nearest to the first head's.
    fn second_start(&self, station: &PairStation, start: &Configuration) -> Configuration {
        let (test, shared) = (self.pair.tests[1], self.pair.shared);
        let kind = test.cell.machine.axes()[shared].kind;
        let wanted = start.axes.get_or_zero(shared);
        let turned = |mut c: Configuration| {
            c.axes[shared] = turned_to(kind, c.axes.get_or_zero(shared), wanted);
            c
        };
        let all = test.lifted_configurations(&station.cc[1], self.plain(1)).into_iter().map(turned);
        let distance = |c: &Configuration| (c.axes.get_or_zero(shared) - wanted).abs();
        all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(*start)
    }

    /// When each station is passed at the programmed feeds, the slower head counts, s.
    fn times(&self) -> Vec<f64> {
        let mut time = 0.0;
        let feeds = self.settings.feeds;
        let step = |s: &PairStation| {
            time += (s.way[0] / feeds[0]).max(s.way[1] / feeds[1]);
            time
        };
        self.stations.iter().map(step).collect()
    }

    /// Stations at which values are compared: the first, the last, and between them one for every `spacing`.
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

    /// Tilts that are nowhere below those found and change by no more than allowed from neighbour to neighbour.
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

/// Costs of postures per second, on a grid over a range; linear between its nodes, which is close enough to choose by.
struct CostTable {
    range: PostureRange,
    /// By tilt, then rotate.
    rates: Vec<[f64; ROTATE_NODES]>,
}

/// Nodes of a [`CostTable`].
const TILT_NODES: usize = 17;
const ROTATE_NODES: usize = 33;

impl CostTable {
    fn new(scale: &CuspScale, strip: &Strip, range: PostureRange) -> Self {
        let most = range.tilt[1].max(VALUE_STEP);
        let rate = |i: usize, j: usize| {
            let posture =
                Posture { tilt: node(range.tilt, i, TILT_NODES), rotate: node(range.rotate, j, ROTATE_NODES) };
            scale.rate(posture, strip) + TILT_SHARE * (posture.tilt / most).powi(2)
        };
        Self { range, rates: (0..TILT_NODES).map(|i| std::array::from_fn(|j| rate(i, j))).collect() }
    }

    fn at(&self, posture: Posture) -> f64 {
        let place = |[low, high]: [f64; 2], value: f64, n: usize| {
            let x = if high > low { (value - low) / (high - low) * (n - 1) as f64 } else { 0.0 };
            let k = (x.max(0.0) as usize).min(n - 2);
            (k, (x - k as f64).clamp(0.0, 1.0))
        };
        let (i, s) = place(self.range.tilt, posture.tilt, TILT_NODES);
        let (j, t) = place(self.range.rotate, posture.rotate, ROTATE_NODES);
        let along = |i: usize| self.rates[i][j] * (1.0 - t) + self.rates[i][j + 1] * t;
        along(i) * (1.0 - s) + along(i + 1) * s
    }
}

fn node([low, high]: [f64; 2], k: usize, n: usize) -> f64 {
    low + (high - low) * k as f64 / (n - 1) as f64
}

/// Step of the values of the shared axis that are compared, rad.
const VALUE_STEP: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// What the square of a tilt over its largest costs, where a cusp as high as allowed costs 1: enough to decide between postures
/// that leave no cusps.
const TILT_SHARE: f64 = 0.1;

/// Least tilt at the ends of a way, as part of the range: cutters reach beyond the edges there, with nothing between them.
const END_SHARE: f64 = 0.375;

/// Rounds of looking at values of the shared axis where the curve between others is not feasible.
const NODE_ROUNDS: usize = 3;

/// Rounds of raising tilts to their neighbours'.
const SMOOTHING_ROUNDS: usize = 4;
