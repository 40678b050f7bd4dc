//! Proves of one move how deep the cutter is at most at any time, and how near bodies come.

#[cfg(test)]
#[path = "../../tests/unit/proof/prover_laws.rs"]
pub(crate) mod laws;

use facemill_cl_data::{ControlTolerance, CuttingLaw, Solid};
use facemill_interference::{MotionInterval, SweepVerdict};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Motion};
use nalgebra::{Isometry3, Point3};

use crate::motion::moves::Move;
use crate::motion::rates::{Parts, RateBounds, Rates};
use crate::motion::spans::Spans;
use crate::motion::stepping::MAX_TURN;
use crate::proof::{Open, Proof, ProvenDepth, ProvenDistance};
use crate::run::cutter_depth::CutterTrack;
use crate::run::scene::{Frame, Mount, Role, RunScene, SceneObstacle};

/// How much deeper than sampled a depth is tried to be proven first, mm. Larger: certificates say
/// more than is there; smaller: more intervals.
const FIRST_LACK: f64 = 2e-3;

/// By what a depth grows that could not be proven on the shortest interval.
const GROWTH: f64 = 1.5;

/// Halvings of a part of a move, on which no axis turns by more than a turn: shorter intervals only
/// fight rounding.
const MAX_HALVINGS: u32 = 10;

/// Part of the distance in the middle of a move that is tried to be proven for all of it, before
/// the required one.
const CLEARANCE_SHARE: f64 = 0.8;

/// Largest reported distance of bodies, mm.
const FARTHEST_CLEARANCE: f64 = 50.0;

/// Part of an interval over which its velocity is measured, on either side of the middle.
const MEASURED: f64 = 1e-3;

/// Rounding of a velocity so measured, mm per interval: coordinates of metres to 1e-12, over the
/// time.
const VELOCITY_ROUNDING: f64 = 1e-8;

/// The same where rotary values are solved from the tool axis and linear ones from them: 1e-7 mm of
/// a point anywhere on the machine, over the time.
const TURNED_ROUNDING: f64 = 1e-4;

/// Proves one move.
pub(crate) struct Prover<'s, 'a> {
    scene: &'s RunScene<'a>,
    m: &'s Move,
    motion: Motion<'s>,
    rates: RateBounds<'s>,
    /// Parts of it that need a look.
    parts: Vec<[f64; 2]>,
    tracks: Vec<CutterTrack>,
    intervals: u32,
}

/// A moving body and its obstacle.
#[derive(Clone, Copy)]
struct Pair<'p> {
    mount: Mount,
    frame: Frame,
    solid: &'p Solid,
    obstacle: usize,
    /// Whether what the control may leave the motion by counts.
    is_charged: bool,
}

/// The cutter against an obstacle.
#[derive(Clone, Copy)]
struct CutterBody {
    obstacle: usize,
    /// Thickness that it may not enter, mm.
    thickness: f64,
    /// As in [`Pair`].
    is_charged: bool,
}

impl Pair<'_> {
    /// Whether the solid is round about the tool axis, with the tool's frame as its own, and the
    /// obstacle the work's.
    fn is_round_on_the_tool(&self) -> bool {
        let in_tool = self.mount == Mount::Tool(Isometry3::identity());
        in_tool && matches!(self.solid, Solid::Frustum(_)) && self.frame == Frame::Work
    }
}

impl<'s, 'a> Prover<'s, 'a> {
    /// `None` where the axes have no such motion.
    pub(crate) fn new(scene: &'s RunScene<'a>, m: &'s Move) -> Option<Self> {
        let machine = scene.setup.machine;
        let motion = Motion::new(machine, m.law, &m.start, &m.end, scene.tool_length).ok()?;
        Some(Self {
            scene,
            m,
            motion,
            rates: RateBounds::new(machine, motion, m.law, [&m.start, &m.end], scene.tool_length)
                .with_other(scene.other.as_ref().map(|(view, length)| (view, *length))),
            parts: Spans::new(machine, m.law, [&m.start, &m.end], scene.tool_length).parts,
            tracks: vec![CutterTrack::default(); scene.obstacles.len()],
            intervals: 0,
        })
    }

    /// Intervals to begin with: in none does an axis stop on its way, or turn by more than a turn.
    fn pieces(&self) -> Vec<(f64, f64, u32)> {
        self.parts.iter().rev().map(|[from, to]| (*from, *to, 0)).collect()
    }

    pub(crate) fn prove(&mut self) -> Proof {
        let depth = self.depth();
        let clearance = self.clearance();
        Proof {
            depth: depth.ok(),
            bodies_clear: clearance.is_ok(),
            clearance: clearance.ok().flatten(),
            open: depth.err().or(clearance.err()),
            intervals: self.intervals,
        }
    }

    /// Whether [`prove`](Self::prove) proves a depth, and that all bodies are clear. Measures
    /// nothing, and stops at the first pair that is not proven: a distance that is proven for a
    /// larger one than required is proven for the required one, because no bound of the proof grows
    /// with less dilation.
    pub(crate) fn is_proven(&mut self) -> bool {
        self.depth().is_ok() && self.keeps_required_distances()
    }

    fn keeps_required_distances(&mut self) -> bool {
        let scene = self.scene;
        if self.motion.at(0.5).is_err() {
            return false;
        }
        for body in &scene.bodies {
            for (k, obstacle) in scene.obstacles.iter().enumerate().filter(|(k, _)| body.meets[*k]) {
                let distance = body.rounding + scene.hit_distance(body, obstacle);
                if !self.keeps(body.mount, &body.shape.core, distance, k) {
                    return false;
                }
            }
        }
        true
    }

    /// The smallest depth that is proven for the whole move against all obstacles, or the obstacle
    /// for which none is.
    ///
    /// Where the cutter may cut, the control's tolerance belongs to the error budget and is only
    /// reported. The cutter must keep off all else by the control's tolerance, too: there that is
    /// part of the proof.
    fn depth(&mut self) -> Result<ProvenDepth, Open> {
        let scene = self.scene;
        let mut deepest = ProvenDepth { programmed: 0.0, with_control: 0.0 };
        for (k, obstacle) in scene.obstacles.iter().enumerate().filter(|(_, o)| o.meets_cutter) {
            let Some(limit) = scene.cutter_limit(obstacle, self.m) else { continue };
            let cuts = !self.m.is_rapid_of_tool() && obstacle.role != Role::Machine;
            let largest = match obstacle.role {
                Role::Machine => limit.depth.max(FIRST_LACK),
                // Nothing is cut in rapid.
                Role::Work(_) if self.m.is_rapid_of_tool() => 0.0,
                Role::Work(_) => limit.depth.max(FIRST_LACK),
            };
            let sampled = [0.0, 0.5, 1.0].map(|t| self.sampled_depth(t, k, limit.thickness));
            let mut depth = sampled.into_iter().fold(0.0, f64::max);
            // A body that is nowhere near is proven not to touch at all.
            depth += if depth > 0.0 { FIRST_LACK } else { 0.0 };
            let body = CutterBody { obstacle: k, thickness: limit.thickness, is_charged: !cuts };
            let open = Open::Cutter { obstacle: k, limit: largest, is_rapid: self.m.is_rapid_of_tool() };
            let proven = self.depth_against(&body, depth, largest).ok_or(open)?;
            let control = if cuts { scene.cutter_control() } else { 0.0 };
            deepest = deepest.max(ProvenDepth { programmed: proven, with_control: proven + control });
        }
        Ok(deepest)
    }

    /// The same against one obstacle, from `depth` on, up to `limit`.
    fn depth_against(&mut self, cutter: &CutterBody, mut depth: f64, limit: f64) -> Option<f64> {
        let mut open = self.pieces();
        while let Some((from, to, halvings)) = open.pop() {
            if depth > limit {
                return None;
            }
            if self.cutter_stays_above(cutter, depth, [from, to]) {
                continue;
            }
            let middle = 0.5 * (from + to);
            let here = self.sampled_depth(middle, cutter.obstacle, cutter.thickness);
            // Where nothing may be touched, no more than that is tried.
            let lack = if here > 0.0 || limit > 0.0 { FIRST_LACK } else { 0.0 };
            let wanted = (here + lack).max(depth);
            // A depth that the middle shows not to be enough is not enough for the halves either.
            if wanted > depth {
                depth = wanted;
                open.push((from, to, halvings));
            } else if halvings < MAX_HALVINGS {
                open.push((middle, to, halvings + 1));
                open.push((from, middle, halvings + 1));
            } else {
                depth = (depth * GROWTH).max(FIRST_LACK);
                open.push((from, to, halvings));
            }
        }
        Some(depth)
    }

    /// Depth of the cutter at a time; infinite where the axes cannot follow.
    fn sampled_depth(&mut self, t: f64, obstacle: usize, thickness: f64) -> f64 {
        let Ok(axes) = self.motion.at(t) else { return f64::INFINITY };
        let scene = self.scene;
        let o = &scene.obstacles[obstacle];
        let pose = self.pose(Mount::Tool(Isometry3::identity()), o.frame, &axes);
        let placed = scene.cutter.placed(&pose);
        let found = scene.cutter.beyond(0.0, thickness, &placed, &mut self.tracks[obstacle], o.mesh());
        found.map_or(0.0, |d| d.depth)
    }

    /// Whether no cutter point is deeper than `depth` at any time of an interval: its test bodies
    /// for it touch nothing.
    fn cutter_stays_above(&mut self, body: &CutterBody, depth: f64, interval: [f64; 2]) -> bool {
        let CutterBody { obstacle, thickness, is_charged } = *body;
        let cutter = self.scene.setup.tool.cutter();
        let frame = self.scene.obstacles[obstacle].frame;
        let mount = Mount::Tool(Isometry3::identity());
        let mut bodies = cutter.test_bodies(depth).into_iter().map(|solid| solid.dilated(thickness));
        bodies.all(|solid| self.clears(&Pair { mount, frame, solid: &solid, obstacle, is_charged }, interval))
    }

    /// The smallest distance that is proven for all bodies, with what the control may leave its
    /// motion by; or the first pair that is not proven to keep its required clearance.
    fn clearance(&mut self) -> Result<Option<ProvenDistance>, Open> {
        let scene = self.scene;
        let (mut first_open, mut smallest) = (None, None::<ProvenDistance>);
        let axes = self.motion.at(0.5).map_err(|_| Open::Motion)?;
        for (index, body) in scene.bodies.iter().enumerate() {
            for (k, obstacle) in scene.obstacles.iter().enumerate().filter(|(k, _)| body.meets[*k]) {
                let required = scene.hit_distance(body, obstacle);
                let pose = self.pose(body.mount, obstacle.frame, &axes);
                let reach = body.rounding + FARTHEST_CLEARANCE.max(required);
                let near = obstacle.mesh().core_distance(&body.shape.core, &pose, reach, None);
                let tried = near.map_or(reach, |s| s.distance) - body.rounding;
                let proven = [CLEARANCE_SHARE * tried, required]
                    .into_iter()
                    .filter(|distance| *distance >= required)
                    .find(|&distance| self.keeps(body.mount, &body.shape.core, body.rounding + distance, k));
                match proven {
                    None => first_open = first_open.or(Some(Open::Body { body: index, obstacle: k, required })),
                    Some(distance) if smallest.is_none_or(|(d, _)| distance < d) => {
                        smallest = Some((distance, (index, k)));
                    }
                    Some(_) => {}
                }
            }
        }
        first_open.map_or(Ok(smallest), Err)
    }

    /// Whether a core stays farther than `distance` from an obstacle for the whole move.
    fn keeps(&mut self, mount: Mount, core: &Solid, distance: f64, obstacle: usize) -> bool {
        let solid = core.dilated(distance);
        let frame = self.scene.obstacles[obstacle].frame;
        let mut open = self.pieces();
        while let Some((from, to, halvings)) = open.pop() {
            if self.clears(&Pair { mount, frame, solid: &solid, obstacle, is_charged: true }, [from, to]) {
                continue;
            }
            if halvings == MAX_HALVINGS {
                return false;
            }
            let middle = 0.5 * (from + to);
            open.push((middle, to, halvings + 1));
            open.push((from, middle, halvings + 1));
        }
        true
    }

    /// Whether a moving solid touches its obstacle at no time of an interval.
    fn clears(&mut self, pair: &Pair<'_>, [from, to]: [f64; 2]) -> bool {
        self.intervals += 1;
        let Some(motion) = self.interval(pair, from, to) else { return false };
        let obstacle: &SceneObstacle<'_> = &self.scene.obstacles[pair.obstacle];
        obstacle.mesh().sweep(pair.solid, &motion, None) == SweepVerdict::Clear
    }

    /// The motion of a solid relative to an obstacle over an interval, in units of its length.
    ///
    /// A point whose acceleration is at most A is by at most A/8 farther than its velocity in the
    /// middle tells, half an interval from it; the mean velocity over a short piece around the
    /// middle is by at most A times its half length another.
    fn interval(&self, pair: &Pair<'_>, from: f64, to: f64) -> Option<MotionInterval> {
        let start = self.motion.at(from).ok()?;
        let tip = self.pose(pair.mount, pair.frame, &start).inverse()
            * self.pose(Mount::Tool(Isometry3::identity()), pair.frame, &start)
            * Point3::origin();
        let bounds = pair.solid.aabb();
        let reach = (bounds.min - tip).abs().sup(&(bounds.max - tip).abs()).norm();
        let is_turned = self.m.law == BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
        if is_turned && pair.is_round_on_the_tool() {
            let control = self.control(pair, &start, None, reach)?;
            return self.turned_interval(pair, from, to, reach, control);
        }
        let parts = self.parts(pair);
        let rates = self.rates.over(from, to, parts)?;
        let control = self.control(pair, &start, Some(&rates), reach)?;
        let follows = self.m.law == BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear);
        let acceleration = if follows && self.is_tool_against_work(pair) {
            // The tip goes straight at even speed, and every point turns about it with the product
            // of two even turns: the second derivative of a product of rotations is at most the
            // square of the sum of their speeds.
            rates.turn * rates.turn * reach
        } else {
            rates.acceleration(reach)
        };
        let (middle, piece) = (0.5 * (from + to), MEASURED * (to - from));
        let pose = |t: f64| Some(self.pose(pair.mount, pair.frame, &self.motion.at(t).ok()?));
        let (earlier, mesh_from_solid, later) = (pose(middle - piece)?, pose(middle)?, pose(middle + piece)?);
        let time = 2.0 * MEASURED;
        let rounding = if is_turned { TURNED_ROUNDING } else { VELOCITY_ROUNDING };
        Some(MotionInterval {
            mesh_from_solid,
            velocity: (later.translation.vector - earlier.translation.vector) / time,
            spin: later.rotation.rotation_to(&earlier.rotation).inverse().scaled_axis() / time,
            half: 0.5,
            deviation: acceleration * (0.125 + MEASURED) + rounding + control,
        })
    }

    /// The same for a solid round about the tool axis against the workpiece, while the tool axis is
    /// turned in the plane of its ends about a tip that goes straight: how the tool turns about its
    /// own axis does not matter. A point at a distance from the tip is accelerated by that times
    /// the square of the turn.
    fn turned_interval(&self, pair: &Pair<'_>, from: f64, to: f64, reach: f64, control: f64) -> Option<MotionInterval> {
        let here = self.motion.at(0.5 * (from + to)).ok()?;
        let [a, b] = [from, to].map(|t| self.motion.ideal(t));
        let normal = a.axis.cross(&b.axis);
        let sine = normal.norm();
        let turn = sine.atan2(a.axis.dot(&b.axis));
        if turn > MAX_TURN || self.motion.at(to).is_err() || !self.rates.turned_is_reached(from, to) {
            return None;
        }
        let work_from_table = self.scene.work_from_table;
        let spin = work_from_table * if sine > 0.0 { normal * (turn / sine) } else { normal };
        // The solid's frame is the tool's, whose origin is the tip.
        Some(MotionInterval {
            mesh_from_solid: self.pose(pair.mount, pair.frame, &here),
            velocity: work_from_table * (b.tip - a.tip),
            spin,
            half: 0.5,
            deviation: turn * turn * reach * 0.125 + VELOCITY_ROUNDING + control,
        })
    }

    /// By how much a point at most `reach` from the tip may be beside the programmed motion, mm:
    /// the control leaves the tip's way by its path tolerance, and the tool axis and every rotary
    /// axis by its orientation tolerance.
    ///
    /// Returns the control's largest deviation at a pair. The tool axis alone turns a body of
    /// revolution about it; all rotary axes turn the other bodies fixed to the tool. Other parts of
    /// the machine go with the axes between them and the obstacle ([`RateBounds::strayed`]). `None`
    /// if that has no bound.
    fn control(&self, pair: &Pair<'_>, start: &AxisValues, rates: Option<&Rates>, reach: f64) -> Option<f64> {
        let tolerance = self.scene.setup.machine.motion_law().control_tolerance;
        if !pair.is_charged || tolerance == ControlTolerance::default() {
            return Some(0.0);
        }
        if pair.is_round_on_the_tool() {
            return Some(tolerance.charge(reach));
        }
        if self.is_tool_against_work(pair) {
            return Some(tolerance.path + self.rates.n_rotaries() * tolerance.orientation * reach);
        }
        self.rates.strayed(tolerance, start, rates?, reach, self.parts(pair))
    }

    /// Which axes lie between the moving part and its obstacle.
    fn parts(&self, pair: &Pair<'_>) -> Parts {
        let obstacle = &self.scene.obstacles[pair.obstacle];
        if self.scene.is_on_other_head(obstacle) { Parts::BothHeads } else { Parts::OneHead }
    }

    /// Whether the moving part is as fixed to the tool as the obstacle to the work.
    fn is_tool_against_work(&self, pair: &Pair<'_>) -> bool {
        let machine = self.scene.setup.machine;
        let is_tool = match pair.mount {
            Mount::Tool(_) => true,
            Mount::Machine(k) => machine.joints_to_tool(k) == 0,
        };
        is_tool && pair.frame == Frame::Work
    }

    /// Pose of something that moves in the frame of an obstacle's mesh.
    fn pose(&self, mount: Mount, frame: Frame, axes: &AxisValues) -> Isometry3<f64> {
        let RunScene { setup, work_from_table, tool_length, .. } = *self.scene;
        let of_body = |k: usize| {
            let pose = setup.machine.body_poses(axes).nth(k).map(|p| p.table_from_solid);
            work_from_table * pose.unwrap_or_else(Isometry3::identity)
        };
        let work_from_solid = match mount {
            Mount::Tool(tool_from_solid) => {
                work_from_table * setup.machine.forward(axes, tool_length) * tool_from_solid
            }
            Mount::Machine(k) => of_body(k),
        };
        match frame {
            Frame::Work => work_from_solid,
            Frame::Machine(k) => of_body(k).inv_mul(&work_from_solid),
        }
    }
}
