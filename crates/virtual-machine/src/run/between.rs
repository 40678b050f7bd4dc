//! Motion of bodies between two tested positions, followed until their distance is known within a
//! tolerance.

#[cfg(test)]
#[path = "../../tests/unit/run/between_laws.rs"]
mod laws;

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use facemill_cl_data::{RoundFrustum, Solid};
use facemill_inverse_kinematics::{AxisValues, Motion};
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3};

use crate::finding::Measure;
use crate::finding::episodes::{Contact, Key};
use crate::motion::moves::Move;
use crate::motion::rates::{Parts, RateBounds, Rates};
use crate::motion::setup::VerifySettings;
use crate::motion::spans::Spans;
use crate::motion::stepping::{MAX_TURN, ways};
use crate::run::chunk_result::{ChunkResult, Clearance};
use crate::run::cutter_depth::CutterTrack;
use crate::run::scene::{Frame, Mount, Role, RunScene, cl_of};
use crate::run::track::{Placement, Shape, Track};

/// By how much the motion between two positions of the cutter on the work may leave the straight
/// way, mm.
pub(crate) const CUTTER_BULGE: f64 = 0.005;

/// Halvings of a part of a move, on which no axis turns by more than a turn. Shorter intervals only
/// fight rounding, or stand at a place that the axes cannot follow.
const MAX_HALVINGS: u32 = 18;

/// Halvings of an interval without a bound: next to a place that the axes cannot follow it takes
/// some.
const MAX_BLIND: u32 = 6;

/// Way of the cutter on the work between two positions, mm: the settings', or less where its edge
/// could come deeper between them than [`VerifySettings::between`].
///
/// A point that goes straight past the edge, and is no deeper at both ends of its way, is deepest
/// in the middle, where it goes at 45 degrees to both sides; see [`edge_depth`].
pub(crate) fn cutter_step(cutter: &Cutter, settings: &VerifySettings) -> f64 {
    let edge = (settings.between - CUTTER_BULGE).max(CUTTER_BULGE);
    let r = cutter.corner_radius();
    let way = if edge <= (1.0 - FRAC_1_SQRT_2) * r {
        2.0 * (edge * (2.0 * r - edge)).sqrt()
    } else if edge <= r {
        2.0 * (edge + (SQRT_2 - 1.0) * r)
    } else {
        2.0 * SQRT_2 * edge
    };
    settings.max_step.min(way)
}

/// How deep in an edge of radius `r` the middle of a straight way is whose ends are on its border,
/// at most, mm: that of a chord of the round; where the way reaches beyond it, of one from side to
/// side, up to the middle of the round and deeper.
fn edge_depth(way: f64, r: f64) -> f64 {
    if way <= SQRT_2 * r {
        r - (r * r - 0.25 * way * way).sqrt()
    } else if way <= 2.0 * SQRT_2 * r {
        0.5 * way - (SQRT_2 - 1.0) * r
    } else {
        0.5 * FRAC_1_SQRT_2 * way
    }
}

/// How much deeper than at the tested positions the cutter is in part, check surfaces and fixtures
/// between them at most, mm, below the upper edge of its flute.
pub(crate) fn cutter_between(cutter: &Cutter, settings: &VerifySettings) -> f64 {
    let (step, turn, r) = (cutter_step(cutter, settings), settings.max_turn, cutter.corner_radius());
    // Seen from the tool, which turns on the way.
    let turned = (2.0 * turn * step + turn * turn * cutter.radius().hypot(cutter.flute_length())) / 8.0;
    edge_depth(step, r) + CUTTER_BULGE + turned
}

/// Follows non-cutting bodies, and the cutter against bodies of the machine, over whole moves.
///
/// Over an interval of time a body goes from one pose to another, D apart. A point of it that is
/// accelerated by at most a over the interval is at most a/8 beside its straight way, so that the
/// distance from an obstacle is nowhere below half of what the distances at both ends leave of D,
/// less a/8. Where that is too little the interval is halved, until D/2 + a/8 is within the
/// tolerance: then the distance is nowhere less than at one end by more than that.
pub(crate) struct BodyFollower<'a> {
    scene: &'a RunScene<'a>,
    pairs: Vec<Pair>,
    /// The whole cutter.
    cutter: Shape,
}

/// Body and obstacle, with the known distances from pose to pose.
struct Pair {
    what: What,
    obstacle: usize,
    parts: Parts,
    track: Track,
    cutter_track: CutterTrack,
}

/// Moving body.
#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    Body(usize),
    Cutter,
}

/// An interval within which no axis of a rapid stops.
struct Stretch<'m> {
    index: usize,
    m: &'m Move,
    motion: &'m Motion<'m>,
    rates: &'m RateBounds<'m>,
    ends: [Posed; 2],
}

/// The machine at a time.
struct Posed {
    t: f64,
    axes: AxisValues,
    work_from_tool: Isometry3<f64>,
    work_from_bodies: Vec<Isometry3<f64>>,
}

/// A part of a stretch for one pair.
struct Interval {
    ends: [End; 2],
    halvings: u32,
    /// Halvings since a bound should have been known.
    blind: u32,
}

/// A pair at a time.
#[derive(Clone, Copy)]
struct End {
    t: f64,
    axes: AxisValues,
    work_from_tool: Isometry3<f64>,
    /// The body in the frame of the obstacle's mesh.
    at: Placement,
    /// The tool in the same frame.
    tool: Isometry3<f64>,
}

impl<'a> BodyFollower<'a> {
    pub(crate) fn new(scene: &'a RunScene<'a>) -> Self {
        let cutter = scene.setup.tool.cutter();
        let (radius, z_high) = (cutter.radius(), cutter.flute_length());
        let whole = RoundFrustum { z_low: 0.0, z_high, radius_low: radius, radius_high: radius, rounding: 0.0 };
        let n_bodies = scene.bodies.len();
        let pairs = scene.obstacles.iter().enumerate().flat_map(|(obstacle, o)| {
            // On the work the cutter's positions are near enough to each other as they are.
            let cutter = (o.meets_cutter && o.role == Role::Machine).then_some(What::Cutter);
            let bodies = (0..n_bodies).filter(move |&k| scene.bodies[k].meets[obstacle]).map(What::Body);
            let parts = if scene.is_on_other_head(o) { Parts::BothHeads } else { Parts::OneHead };
            cutter.into_iter().chain(bodies).map(move |what| Pair {
                what,
                obstacle,
                parts,
                track: Track::default(),
                cutter_track: CutterTrack::default(),
            })
        });
        Self { scene, pairs: pairs.collect(), cutter: Shape::core_of(&Solid::Frustum(whole)) }
    }

    /// Follows one move, which can be reached. Where no bound is known, its index is added to
    /// `open` of the result.
    pub(crate) fn run(&mut self, index: usize, m: &Move, result: &mut ChunkResult) {
        let (machine, length) = (self.scene.setup.machine, self.scene.tool_length);
        let Ok(motion) = Motion::new(machine, m.law, &m.start, &m.end, length) else { return };
        let other = self.scene.other.as_ref().map(|(view, length)| (view, *length));
        let rates = RateBounds::new(machine, motion, m.law, [&m.start, &m.end], length).with_other(other);
        let spans = Spans::new(machine, m.law, [&m.start, &m.end], length);
        let mut pairs = std::mem::take(&mut self.pairs);
        for ends in spans.parts {
            // That the axes cannot follow is a finding of its own.
            let Some(posed) = self.posed(&motion, ends[0]).zip(self.posed(&motion, ends[1])) else { break };
            let stretch = Stretch { index, m, motion: &motion, rates: &rates, ends: [posed.0, posed.1] };
            let of_one = rates.over(ends[0], ends[1], Parts::OneHead);
            for pair in &mut pairs {
                let whole = match pair.parts {
                    Parts::OneHead => of_one,
                    Parts::BothHeads => rates.over(ends[0], ends[1], Parts::BothHeads),
                };
                if !self.follow(pair, &stretch, whole, result) && result.open.last() != Some(&index) {
                    result.open.push(index);
                }
            }
        }
        self.pairs = pairs;
    }

    /// Whether it is known how near one pair comes, or else that it touches.
    fn follow(&self, pair: &mut Pair, s: &Stretch<'_>, whole: Option<Rates>, result: &mut ChunkResult) -> bool {
        let [start, end] = s.ends.each_ref().map(|posed| self.end(pair, posed));
        let whole = whole.map(|rates| rates.acceleration(self.reach(pair, &start)));
        let mut open = vec![Interval { ends: [start, end], halvings: 0, blind: 0 }];
        let mut is_known = true;
        while let Some(Interval { ends: [a, b], halvings, blind }) = open.pop() {
            let way = self.shape(pair).displacement(&a.at, &b.at);
            let share = (b.t - a.t) / (end.t - start.t);
            let acceleration = whole.map(|whole| whole * share * share).or_else(|| {
                let rates = s.rates.over(a.t, b.t, pair.parts)?;
                Some(rates.acceleration(self.reach(pair, &a)))
            });
            if let Some(bulge) = acceleration.map(|a| a / 8.0) {
                let margin = way + bulge;
                let late = self.slack(pair, s, &b, margin, result);
                if late >= margin {
                    continue;
                }
                let early = self.slack(pair, s, &a, margin, result);
                let is_near_enough = 0.5 * way + bulge <= self.scene.settings.between;
                if early < 0.0 || late < 0.0 || 0.5 * (early + late - way) >= bulge || is_near_enough {
                    continue;
                }
            }
            // Where no bound is known although the axes hardly turn, there is none on much shorter
            // intervals either.
            let is_blind = acceleration.is_none() && ways(self.scene.setup.machine, &a.axes, &b.axes)[1] <= MAX_TURN;
            let blind = if is_blind { blind + 1 } else { 0 };
            let may_halve = halvings < MAX_HALVINGS && blind <= MAX_BLIND;
            let Some(middle) = may_halve.then(|| self.posed(s.motion, 0.5 * (a.t + b.t))).flatten() else {
                is_known = false;
                continue;
            };
            let middle = self.end(pair, &middle);
            let halvings = halvings + 1;
            open.push(Interval { ends: [middle, b], halvings, blind });
            open.push(Interval { ends: [a, middle], halvings, blind });
        }
        is_known
    }

    fn shape(&self, pair: &Pair) -> &Shape {
        match pair.what {
            What::Body(k) => &self.scene.bodies[k].shape,
            What::Cutter => &self.cutter,
        }
    }

    /// Largest distance of a point of the body from the tip, mm.
    fn reach(&self, pair: &Pair, at: &End) -> f64 {
        let rounding = if let What::Body(k) = pair.what { self.scene.bodies[k].rounding } else { 0.0 };
        self.shape(pair).reach_from(&at.at, &(at.tool * Point3::origin())) + rounding
    }

    /// `None` where the axes cannot follow.
    fn posed(&self, motion: &Motion<'_>, t: f64) -> Option<Posed> {
        let RunScene { setup, work_from_table, tool_length, .. } = *self.scene;
        let axes = motion.at(t).ok()?;
        let work_from_tool = work_from_table * setup.machine.forward(&axes, tool_length);
        let of_bodies = setup.machine.body_poses(&axes).map(|p| work_from_table * p.table_from_solid);
        Some(Posed { t, axes, work_from_tool, work_from_bodies: of_bodies.collect() })
    }

    fn end(&self, pair: &Pair, posed: &Posed) -> End {
        let &Posed { t, axes, work_from_tool, .. } = posed;
        let work_from_solid = match pair.what {
            What::Cutter => work_from_tool,
            What::Body(k) => match self.scene.bodies[k].mount {
                Mount::Tool(tool_from_solid) => work_from_tool * tool_from_solid,
                Mount::Machine(k) => posed.work_from_bodies[k],
            },
        };
        let mesh_from_work = match self.scene.obstacles[pair.obstacle].frame {
            Frame::Work => Isometry3::identity(),
            Frame::Machine(k) => posed.work_from_bodies[k].inverse(),
        };
        let at = self.shape(pair).placed(mesh_from_work * work_from_solid);
        End { t, axes, work_from_tool, at, tool: mesh_from_work * work_from_tool }
    }

    /// By how much more than what is a finding the pair is apart, mm, at most `margin`; below 0 it
    /// is one, which is recorded.
    fn slack(&self, pair: &mut Pair, s: &Stretch<'_>, at: &End, margin: f64, result: &mut ChunkResult) -> f64 {
        match pair.what {
            What::Body(k) => self.body_slack(k, pair, s, at, margin, result),
            What::Cutter => self.cutter_slack(pair, s, at, margin, result),
        }
    }

    fn body_slack(
        &self,
        index: usize,
        pair: &mut Pair,
        s: &Stretch<'_>,
        at: &End,
        margin: f64,
        result: &mut ChunkResult,
    ) -> f64 {
        let (body, o) = (&self.scene.bodies[index], &self.scene.obstacles[pair.obstacle]);
        let hit = self.scene.hit_distance(body, o);
        let need = body.rounding + hit + margin;
        let Some(nearest) = pair.track.nearest_within(need, &body.shape, &at.at, o.mesh()) else { return margin };
        let distance = (nearest.distance - body.rounding).max(0.0);
        let place = self.in_work(pair, at, &nearest.point);
        if o.counts && result.clearance.is_none_or(|c| distance < c.distance) {
            let (obstacle, move_index) = (pair.obstacle, s.index);
            result.clearance = Some(Clearance { distance, place, body: index, obstacle, move_index });
        }
        if distance < hit || distance == 0.0 {
            let key = Key::of_body(body.kind, index, pair.obstacle);
            record(result, s.index, at, key, Measure::DistanceMm(distance), place);
            return (distance - hit).min(-f64::MIN_POSITIVE);
        }
        distance - hit
    }

    fn cutter_slack(&self, pair: &mut Pair, s: &Stretch<'_>, at: &End, margin: f64, result: &mut ChunkResult) -> f64 {
        let (cutter, o) = (&self.scene.cutter, &self.scene.obstacles[pair.obstacle]);
        let Some(limit) = self.scene.cutter_limit(o, s.m) else { return margin };
        let placed = cutter.placed(&at.tool);
        let (floor, thickness) = (limit.depth, limit.thickness);
        let track = &mut pair.cutter_track;
        let Some(within) = cutter.beyond(floor, thickness + margin, &placed, track, o.mesh()) else { return margin };
        if let Some(depth) = cutter.beyond(floor, thickness, &placed, track, o.mesh()) {
            let key = Key::of_cutter(limit.kind, pair.obstacle);
            let place = self.in_work(pair, at, &depth.place);
            record(result, s.index, at, key, Measure::DepthMm(depth.depth), place);
            return -f64::MIN_POSITIVE;
        }
        (floor + margin - within.depth).max(0.0)
    }

    /// A point of the obstacle's mesh in the workpiece frame.
    fn in_work(&self, pair: &Pair, at: &End, p: &Point3<f64>) -> Point3<f64> {
        match self.scene.obstacles[pair.obstacle].frame {
            Frame::Work => *p,
            Frame::Machine(_) => at.work_from_tool * (at.tool.inverse() * p),
        }
    }
}

fn record(result: &mut ChunkResult, index: usize, at: &End, key: Key, measure: Measure, place: Point3<f64>) {
    let (measure, place) = (Some(measure), Some(place));
    let cl = cl_of(&at.work_from_tool);
    result.episodes.record(index, Contact { key, measure, place, axes: at.axes, cl, at: at.t });
}
