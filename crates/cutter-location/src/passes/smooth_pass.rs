//! The cheapest sequence of postures along a pass: shortest way over layers of feasible postures,
//! then a smooth band through it.

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass, Posture};
use facemill_inverse_kinematics::Machine;
use nalgebra::Vector3;

use crate::cusp::cut_point::Strip;
use crate::passes::cost::{CuspScale, MotionScale, Scaled};
use crate::passes::graph::{Chosen, ChosenNode, PassGraph};
use crate::passes::smooth_band::Band;
use crate::passes::task::{Optimum, Outcome, PassSettings, PassTask, PlannedPass, SmoothSettings};
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints};
use crate::search::lattice::Lattice;

/// Data for the choice of postures of one pass.
pub(crate) struct SmoothPass<'s, 'a> {
    pub(crate) test: &'s PoseTest<'a>,
    pub(crate) task: &'s PassTask,
    pub(crate) settings: &'s PassSettings,
    pub(crate) smooth: &'s SmoothSettings,
    pub(crate) lattice: &'s Lattice,
    /// Lattice for points where the coarse lattice and the search find nothing.
    pub(crate) fine: &'s Lattice,
}

/// A posture at a CC point that the machine can take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) posture: Posture,
    pub(crate) configuration: Configuration,
    pub(crate) scaled: Scaled,
    /// Tool axis by its parts along feed, left and normal.
    pub(crate) axis: Vector3<f64>,
    /// Cost of cusps per second.
    pub(crate) cusp_rate: f64,
}

/// Factor on the distance of layers: a turn from one posture of the lattice to the next but one is
/// within the limit.
const SPACINGS: f64 = 1.5;

/// Time scale of smoothing, as a part of the time between layers.
const SMOOTHING: f64 = 1.0;

/// Smallest number of layers of a pass, where it has so many points.
const FEWEST: f64 = 4.0;

impl SmoothPass<'_, '_> {
    /// Plans poses of all CC points, and measures how near to the best the sequence is.
    pub(crate) fn plan(&self, monitor: &dyn Monitor) -> Result<PlannedPass, Cancelled> {
        let n = self.task.pass.points.len();
        if n == 0 {
            return Ok(PlannedPass { outcomes: Pass::new(Vec::new()), optimum: None });
        }
        let clock = PassClock::new(&self.task.pass.points, self.smooth.feed);
        let spacing = SPACINGS * self.lattice.spacing / self.settings.max_turn_per_mm;
        let wanted = clock.layers(spacing.min(clock.length() / FEWEST));
        let layer_time = clock.times[n - 1] / (wanted.len() - 1).max(1) as f64;
        let scale =
            MotionScale::new(self.test.cell.machine, layer_time, self.settings.max_turn_per_mm * self.smooth.feed);
        let mut hints = Hints::default();
        let mut graph = PassGraph::new(self, &clock, &scale, wanted);
        // Ends, because every round takes nodes out of the graph.
        let (outcomes, chosen) = loop {
            let chosen = graph.cheapest(&mut hints, monitor)?;
            let nodes: Vec<(usize, Node)> = chosen.nodes.iter().map(|c| (c.point, c.node)).collect();
            let band = Band::new(self, &clock, &scale, SMOOTHING * layer_time);
            let outcomes = band.through(&nodes, &mut hints, monitor)?;
            let fallen = chosen.nodes.iter().filter(|c| outcomes[c.point].is_err());
            if fallen.map(|c| graph.remove(c, &mut hints)).count() == 0 {
                break (outcomes, chosen);
            }
        };
        let optimum = Some(self.optimum(&graph, &chosen, &outcomes));
        monitor.advance(n);
        Ok(PlannedPass { outcomes: Pass::new(outcomes), optimum })
    }

    /// Returns the excess of a turn against the surface over the limit, 0 within it; as the chord
    /// of the turn.
    pub(crate) fn excess(&self, from: &Vector3<f64>, to: &Vector3<f64>, gap: Gap) -> f64 {
        turn_excess(self.settings.max_turn_per_mm, from, to, gap)
    }

    pub(crate) fn cusp_scale(&self) -> CuspScale {
        CuspScale { cutter: *self.test.cell.tool.cutter(), allowed: self.smooth.cusp }
    }

    /// Returns the strip that decides on the cusps at a point.
    pub(crate) fn strip(&self, point: usize) -> Strip {
        let strip = self.task.strips.get(point).copied().flatten().unwrap_or(self.smooth.strip);
        Strip { step_over: strip.step_over.min(self.smooth.widest), ..strip }
    }

    /// Returns a posture with rotate to the pass's side.
    pub(crate) fn signed(&self, amount: Posture) -> Posture {
        let negative = self.task.curve.end().rotate < 0.0;
        Posture { rotate: if negative { -amount.rotate } else { amount.rotate }, ..amount }
    }

    /// Returns the posture of the search's ranges that is nearest in tilt and in rotate.
    pub(crate) fn within_ranges(&self, posture: Posture) -> Posture {
        let (start, end) = (self.task.curve.start(), self.task.curve.end());
        let (low, high) = (start.rotate.min(end.rotate), start.rotate.max(end.rotate));
        let middle = 0.5 * (low + high);
        let turns = ((middle - posture.rotate) / std::f64::consts::TAU).round();
        let rotate = posture.rotate + turns * std::f64::consts::TAU;
        Posture { tilt: posture.tilt.clamp(start.tilt, end.tilt), rotate: rotate.clamp(low, high) }
    }

    /// Returns the costs of the chosen sequence and of the smoothed one, counted alike.
    fn optimum(&self, graph: &PassGraph<'_, '_, '_>, chosen: &Chosen, outcomes: &[Outcome]) -> Optimum {
        let (clock, scale) = (graph.clock, graph.scale);
        let mut optimum = Optimum { graph: chosen.cost, ..Optimum::default() };
        let mut before: Option<(usize, Node)> = None;
        for &ChosenNode { point, share, ref node, .. } in &chosen.nodes {
            let Ok(pose) = &outcomes[point] else { continue };
            let cc = &self.task.pass.points[point];
            let own = Node {
                posture: pose.posture,
                configuration: pose.configuration,
                scaled: scale.scaled(&pose.configuration.axes),
                axis: seen_from(cc, &cc.tool_axis(pose.posture)),
                cusp_rate: if pose.posture == node.posture {
                    node.cusp_rate
                } else {
                    self.cusp_scale().rate(pose.posture, &self.strip(point))
                },
            };
            optimum.smoothed += share * own.cusp_rate;
            match &before {
                Some((last, from)) => optimum.smoothed += graph.step(from, &own, clock.gap(*last, point)),
                None => optimum.smoothed += graph.start(&own),
            }
            optimum.layers += 1;
            before = Some((point, own));
        }
        optimum.jumps = self.jumps(outcomes);
        optimum
    }

    /// Returns whether the way from a pose to that of a later point is beyond a limit: the tool
    /// axis turns too far against the surface for its length, or a machine axis would have to be
    /// faster than it can.
    pub(crate) fn is_beyond(&self, step: &PassStep<'_>, [from, to]: [&FeasiblePose; 2]) -> bool {
        let PassStep { clock, scale, points: [a, b] } = *step;
        let gap = clock.gap(a, b);
        let seen = |k: usize, pose: &FeasiblePose| {
            let cc = &self.task.pass.points[k];
            seen_from(cc, &cc.tool_axis(pose.posture))
        };
        let scaled = |pose: &FeasiblePose| scale.scaled(&pose.configuration.axes);
        self.excess(&seen(a, from), &seen(b, to), gap) > 0.0 || scale.excess(&scaled(from), &scaled(to), gap.time) > 0.0
    }

    /// Counts steps between neighbouring points that are beyond a limit.
    fn jumps(&self, outcomes: &[Outcome]) -> usize {
        let limits = (self.settings.max_turn_per_mm, self.smooth.feed);
        steps_beyond_limits(self.test.cell.machine, &self.task.pass, outcomes, limits)
    }
}

/// Counts steps between neighbouring points of a pass on which the tool axis turns against the
/// surface by more than a largest turn, rad/mm, or a machine axis would have to be faster than it
/// can at a feed, mm/s, as [`Optimum::jumps`] does. Steps without a pose at an end do not count.
pub fn steps_beyond_limits(
    machine: &Machine,
    pass: &Pass<CcPoint>,
    outcomes: &[Outcome],
    (max_turn_per_mm, feed): (f64, f64),
) -> usize {
    let points = &pass.points;
    let clock = PassClock::new(points, feed);
    let scale = MotionScale::new(machine, 1.0, max_turn_per_mm * feed);
    let beyond = |k: &usize| {
        let [Ok(from), Ok(to)] = [&outcomes[k - 1], &outcomes[*k]] else { return false };
        let gap = clock.gap(k - 1, *k);
        let axes = [(&points[k - 1], from), (&points[*k], to)].map(|(cc, p)| seen_from(cc, &cc.tool_axis(p.posture)));
        let [a, b] = [from, to].map(|pose| scale.scaled(&pose.configuration.axes));
        turn_excess(max_turn_per_mm, &axes[0], &axes[1], gap) > 0.0 || scale.excess(&a, &b, gap.time) > 0.0
    };
    (1..points.len().min(outcomes.len())).filter(beyond).count()
}

/// Returns the excess of a turn against the surface over the limit, rad/mm; 0 within it; as the
/// chord of the turn.
fn turn_excess(max_turn_per_mm: f64, from: &Vector3<f64>, to: &Vector3<f64>, gap: Gap) -> f64 {
    let limit = max_turn_per_mm * gap.length * (1.0 + 1e-9);
    let chord_sq = (to - from).norm_squared();
    if chord_sq <= limit * limit { 0.0 } else { chord_sq.sqrt() / limit }
}

/// A step from one point of a pass to a later one.
pub(crate) struct PassStep<'c> {
    pub(crate) clock: &'c PassClock,
    pub(crate) scale: &'c MotionScale,
    pub(crate) points: [usize; 2],
}

/// Way and time from one point to another.
#[derive(Clone, Copy)]
pub(crate) struct Gap {
    pub(crate) length: f64,
    pub(crate) time: f64,
}

/// Times at which the cutter passes the points, at the programmed feed.
pub(crate) struct PassClock {
    /// Way along the CC points, mm.
    pub(crate) lengths: Vec<f64>,
    /// Time, s.
    pub(crate) times: Vec<f64>,
}

/// Points nearer to each other than this count as this far apart, mm.
const NEAREST: f64 = 1e-3;

impl PassClock {
    fn new(points: &[CcPoint], feed: f64) -> Self {
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            let step = (pair[1].position - pair[0].position).norm().max(NEAREST);
            lengths.push(lengths[lengths.len() - 1] + step);
        }
        Self { times: lengths.iter().map(|l| l / feed).collect(), lengths }
    }

    fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    pub(crate) fn gap(&self, from: usize, to: usize) -> Gap {
        Gap { length: self.lengths[to] - self.lengths[from], time: self.times[to] - self.times[from] }
    }

    /// Returns points about `spacing` apart, including both ends, none nearer than `spacing` but
    /// the last.
    fn layers(&self, spacing: f64) -> Vec<usize> {
        let last = self.lengths.len() - 1;
        let mut points = vec![0];
        for k in 1..last {
            let from = self.lengths[points[points.len() - 1]];
            if self.lengths[k] - from >= spacing && self.lengths[last] - self.lengths[k] >= 0.5 * spacing {
                points.push(k);
            }
        }
        if last > 0 {
            points.push(last);
        }
        points
    }
}

/// Returns an axis by its parts along feed, left and normal of a CC point.
pub(crate) fn seen_from(cc: &CcPoint, axis: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(cc.feed.dot(axis), cc.left().dot(axis), cc.normal.dot(axis))
}
