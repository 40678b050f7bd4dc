//! Two passes cut at once by two heads that share an axis: its values along the way, and both heads' postures.

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};
use facemill_inverse_kinematics::AxisValues;

use crate::cusp::Strip;
use crate::pair_values::{ValueNode, ValuePath, ValueState};
use crate::pass_cost::CuspScale;
use crate::shared_axis::{PostureRange, SharedAxis, turned_to};
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
    Together(Infeasible),
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
    fn together(&self, mut poses: [FeasiblePose; 2], value: f64, hints: &mut Hints) -> PairOutcome {
        for pose in &mut poses {
            pose.configuration.axes[self.shared] = value;
        }
        let axes = self.joined([&poses[0].configuration.axes, &poses[1].configuration.axes]);
        match self.tests[0].collision(&axes, hints) {
            None => Ok(PairPose { poses, axes }),
            Some(why) => Err(PairBlocked::Together(why)),
        }
    }

    /// One sentence on why both heads cannot be at a station at once.
    pub fn describe(&self, why: &PairBlocked) -> String {
        let axis = &self.tests[0].cell.machine.axes()[self.shared];
        let letter = axis.letter;
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
            PairBlocked::Together(why) => format!("both heads at once: {}", self.tests[0].describe(why)),
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
            let axis =
                SharedAxis { test: self.tests[head], axis: self.shared, range: ranges[head], cc: cc[head], near };
            let tilt = middle(from.poses[head].posture.tilt, to.poses[head].posture.tilt);
            let found = axis.feasible(value, tilt, &mut hints[head]);
            let by_tilt = |p: Posture| p.tilt;
            let found = found.or_else(|_| axis.cheapest(value, tilt, &by_tilt, &mut hints[head]).map(|found| found.0));
            found.map_err(|why| PairBlocked::Head { head, why })
        };
        let poses = [pose_of(0)?, pose_of(1)?];
        self.together(poses, value, &mut Hints::default())
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
    PairPlan { pair, stations, settings, monitor }.plan(start)
}

struct PairPlan<'p, 't, 'a> {
    pair: &'p PairTest<'t, 'a>,
    stations: &'p [PairStation],
    settings: &'p PairSettings,
    monitor: &'p dyn Monitor,
}

impl<'p> PairPlan<'p, '_, '_> {
    fn plan(&self, start: &Configuration) -> Result<Vec<PairOutcome>, Cancelled> {
        let nears = self.nears(start);
        let times = self.times();
        let mut hints = [Hints::default(), Hints::default()];
        let mut nodes: Vec<ValueNode> = Vec::new();
        let mut wanted = self.node_stations();
        loop {
            for station in wanted {
                self.monitor.checkpoint()?;
                let (states, blocked) = self.states(station, &nears[station], &mut hints);
                nodes.push(ValueNode { station, time: times[station], states, blocked });
            }
            nodes.sort_by_key(|n| n.station);
            let values = self.values(&nodes, &times, &nears, &mut hints);
            let found = self.apart(&values, &nears, &mut hints)?;
            // Where the curve between nodes passes what a head can do, its values are looked at, too.
            let is_node = |k: &usize| nodes.binary_search_by_key(k, |n| n.station).is_ok();
            wanted = (0..found.len())
                .filter(|k| matches!(found[*k], Err(PairBlocked::Head { .. })) && !is_node(k))
                .collect();
            if wanted.is_empty() {
                return Ok(found);
            }
        }
    }

    /// The value of the shared axis at every station.
    fn values(
        &self,
        nodes: &[ValueNode],
        times: &[f64],
        nears: &[[Configuration; 2]],
        hints: &mut [Hints; 2],
    ) -> Vec<Result<f64, PairBlocked>> {
        let axis = &self.pair.tests[0].cell.machine.axes()[self.pair.shared];
        let mut path = ValuePath::cheapest(nodes, axis.max_velocity);
        path.smooth(|station, value| {
            let mut stands = |head: usize| {
                let axis = self.axis_at(station, head, &nears[station]);
                axis.cheapest(value, 0.0, &self.cost(head), &mut hints[head]).is_ok()
            };
            stands(0) && stands(1)
        });
        times.iter().enumerate().map(|(k, &time)| path.value(k, time)).collect()
    }

    /// Poses of both heads at the values of the shared axis. Where they are in each other's way, both tilts are raised step by
    /// step: opposite cutters that lean forward part behind their points.
    fn apart(
        &self,
        values: &[Result<f64, PairBlocked>],
        nears: &[[Configuration; 2]],
        hints: &mut [Hints; 2],
    ) -> Result<Vec<PairOutcome>, Cancelled> {
        let mut least = [vec![0.0_f64; values.len()], vec![0.0_f64; values.len()]];
        let mut together = Hints::default();
        let mut rounds = 0;
        loop {
            let first = self.head_poses(0, values, nears, &least[0], &mut hints[0])?;
            let second = self.head_poses(1, values, nears, &least[1], &mut hints[1])?;
            let both = first.into_iter().zip(second).zip(values);
            let found: Vec<PairOutcome> =
                both.map(|((a, b), value)| self.pair.together([a?, b?], (*value)?, &mut together)).collect();
            let mut raised = false;
            for (k, outcome) in found.iter().enumerate() {
                if !matches!(outcome, Err(PairBlocked::Together(_))) {
                    continue;
                }
                for (head, least) in least.iter_mut().enumerate() {
                    let [low, high] = self.settings.ranges[head].tilt;
                    let wanted = least[k].max(low) + (high - low) / f64::from(RAISES);
                    if wanted <= high + 1e-12 {
                        (least[k], raised) = (wanted, true);
                    }
                }
            }
            rounds += 1;
            if !raised || rounds > RAISES {
                return Ok(found);
            }
        }
    }

    /// What a posture of a head costs per second.
    fn cost(&self, head: usize) -> impl Fn(Posture) -> f64 + use<'p> {
        let cutter = *self.pair.tests[head].cell.tool.cutter();
        let scale = CuspScale { cutter, allowed: self.settings.cusps[head] };
        let (strip, most) = (self.settings.strips[head], self.settings.ranges[head].tilt[1].max(VALUE_STEP));
        move |posture| scale.rate(posture, &strip) + TILT_SHARE * (posture.tilt / most).powi(2)
    }

    /// The shared axis as seen by a head at a station.
    fn axis_at(&self, station: usize, head: usize, near: &[Configuration; 2]) -> SharedAxis<'p, '_> {
        SharedAxis {
            test: self.pair.tests[head],
            axis: self.pair.shared,
            range: self.settings.ranges[head],
            cc: self.stations[station].cc[head],
            near: near[head],
        }
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
            for head in 0..2 {
                let test = self.pair.tests[head];
                let cutter = test.cell.tool.cutter();
                let cl = facemill_tool_model::cl_from_cc(cutter, &station.cc[head], self.plain(head));
                if let Ok(configuration) = test.configuration_like(&cl, &near[head]) {
                    near[head] = configuration;
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

    /// Values of the shared axis at which both heads are feasible alone, of a lattice; and why there are none, if so.
    fn states(
        &self,
        station: usize,
        near: &[Configuration; 2],
        hints: &mut [Hints; 2],
    ) -> (Vec<ValueState>, PairBlocked) {
        let axes = [0, 1].map(|head| self.axis_at(station, head, near));
        let values = [axes[0].values(), axes[1].values()];
        let costs = [self.cost(0), self.cost(1)];
        let none = PairBlocked::NoCommonValue(values);
        let [Some(a), Some(b)] = values else { return (Vec::new(), none) };
        let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
        let mut blocked = None;
        let mut states = Vec::new();
        let step = VALUE_STEP;
        for index in (low / step).ceil() as i64..=(high / step).floor() as i64 {
            let value = index as f64 * step;
            let mut cost = 0.0;
            let found = (0..2).try_for_each(|head| {
                let cheapest = axes[head].cheapest(value, 0.0, &costs[head], &mut hints[head]);
                cost += cheapest.map_err(|why| PairBlocked::Head { head, why })?.1;
                Ok(())
            });
            match found {
                Ok(()) => states.push(ValueState { value, cost }),
                Err(why) => blocked = blocked.or(Some(why)),
            }
        }
        (states, blocked.unwrap_or(none))
    }

    /// Poses of one head at the values of the shared axis: the cheapest tilts from the least ones on, with their rate limited
    /// from both sides.
    fn head_poses(
        &self,
        head: usize,
        values: &[Result<f64, PairBlocked>],
        nears: &[[Configuration; 2]],
        least: &[f64],
        hints: &mut Hints,
    ) -> Result<Vec<Result<FeasiblePose, PairBlocked>>, Cancelled> {
        let mut found = Vec::with_capacity(values.len());
        for (k, value) in values.iter().enumerate() {
            self.monitor.checkpoint()?;
            found.push(value.and_then(|value| self.cheapest_at(k, head, value, least[k], nears, hints)));
        }
        for _ in 0..SMOOTHING_ROUNDS {
            let wanted = self.rate_limited(head, &found);
            let mut larger = false;
            for k in 0..found.len() {
                let (Ok(own), Some(wanted), Ok(value)) = (found[k], wanted[k], values[k]) else { continue };
                if wanted > own.posture.tilt + 1e-9
                    && let Ok(raised) = self.cheapest_at(k, head, value, wanted, nears, hints)
                {
                    larger |= raised.posture.tilt > wanted + 1e-9;
                    found[k] = Ok(raised);
                }
            }
            if !larger {
                break;
            }
        }
        Ok(found)
    }

    fn cheapest_at(
        &self,
        station: usize,
        head: usize,
        value: f64,
        least: f64,
        nears: &[[Configuration; 2]],
        hints: &mut Hints,
    ) -> Result<FeasiblePose, PairBlocked> {
        let axis = self.axis_at(station, head, &nears[station]);
        let cheapest = axis.cheapest(value, least, &self.cost(head), hints);
        cheapest.map(|found| found.0).map_err(|why| PairBlocked::Head { head, why })
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

/// Step of the values of the shared axis that are compared, rad.
const VALUE_STEP: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// What the square of a tilt over its largest costs, where a cusp as high as allowed costs 1: enough to decide between postures
/// that leave no cusps.
const TILT_SHARE: f64 = 0.1;

/// Steps in which tilts are raised to keep heads apart.
const RAISES: u32 = 8;

/// Rounds of raising tilts to their neighbours'.
const SMOOTHING_ROUNDS: usize = 4;
