//! What is proven of every block: how deep the cutter is at most at any time, and how near a body comes.

use facemill_cl_data::{Cancelled, CuttingLaw, Monitor, RapidLaw, Solid};
use facemill_interference::{MotionInterval, SweepVerdict};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Motion};
use facemill_nc_program::ReadProgram;
use nalgebra::Isometry3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::cutter_depth::CutterTrack;
use crate::moves::{Move, resolve};
use crate::scene::{Frame, Mount, Scene, SceneObstacle};
use crate::stepping::motion_bound;
use crate::{VerifyError, VerifySettings, VirtualSetup, setup};

/// What is proven of one block's motion, from its start to its end under the machine's motion law.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificate {
    /// Line of the program, from 1.
    pub line: u32,
    /// Number (N) of the block.
    pub block_number: Option<u32>,
    /// No point of the cutter is ever deeper than this below an obstacle's allowance, mm; in rapid below the stock. `null`
    /// where nothing up to the gouge limit could be proven.
    pub depth_mm: Option<f64>,
    /// The same with what the control may leave the programmed motion by (its path tolerance, and its orientation tolerance
    /// at the rim).
    pub depth_with_control_mm: Option<f64>,
    /// No non-cutting body ever comes nearer than this to anything it is tested against, mm; of the body as it is, without
    /// its clearance. `null` where not even its required clearance could be proven, or there is nothing to meet.
    pub clearance_mm: Option<f64>,
    /// The bodies of that pair.
    pub clearance_between: Option<[String; 2]>,
    /// Whether all of it is proven: the depth within the limit, and every body's required clearance.
    pub certified: bool,
    /// Intervals of time that the proof took.
    pub intervals: u32,
}

/// Certificates of a program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificates {
    /// Blocks with a motion.
    pub blocks: usize,
    /// Those that are certified.
    pub certified: usize,
    /// Largest proven depth, mm; `null` where a block has none.
    pub largest_depth_mm: Option<f64>,
    /// One for each block with a motion, in program order.
    pub certificates: Vec<Certificate>,
}

/// Proves for every block of a program what the cutter and the bodies do between its ends: not at positions, but at every
/// time.
///
/// Each block is taken in intervals of time. Over an interval the motion relative to an obstacle is a velocity, told to a
/// proven deviation, and the mesh's tree proves that the moving body stays away by a distance
/// ([`Interference::sweep`](facemill_interference::Interference::sweep)); where it does not, the interval is halved. For
/// the cutter the distance is that of its test body for a depth: a little more than the depth at sampled times first, then
/// more, up to the gouge limit. What is not proven is told as such, and says nothing about the motion.
///
/// Proven are motions of all axes together, cutting or rapid. Under RTCP and with axes that go each at their own speed no
/// block is certified. The result does not depend on the number of threads; `monitor` is told of every block once.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels.
pub fn certify(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    monitor: &dyn Monitor,
) -> Result<Certificates, VerifyError> {
    setup::check(setup, settings)?;
    let resolved = resolve(program, setup, settings);
    let scene = Scene::new(setup, settings)?;
    let control = setup.machine.motion_law().control_tolerance.charge(setup.tool.cutter().radius());
    let of_moves: Result<Vec<Proof>, Cancelled> = resolved
        .moves
        .par_iter()
        .map(|m| {
            monitor.checkpoint()?;
            let proof = Prover::new(&scene, m).map_or_else(Proof::unknown, |mut p| p.prove());
            monitor.advance(1);
            Ok(proof)
        })
        .collect();
    let of_moves = of_moves?;
    let mut certificates = Vec::new();
    let mut first = 0;
    for run in resolved.moves.chunk_by(|a, b| a.block == b.block) {
        let proofs = &of_moves[first..first + run.len()];
        first += run.len();
        let block = &program.blocks[run[0].block];
        let whole = proofs.iter().cloned().reduce(Proof::and).unwrap_or_else(Proof::unknown);
        let names = |(body, obstacle): (usize, usize)| {
            [scene.bodies[body].name.clone(), scene.obstacles[obstacle].name.clone()]
        };
        certificates.push(Certificate {
            line: block.line,
            block_number: block.number,
            depth_mm: whole.depth,
            depth_with_control_mm: whole.depth.map(|d| d + control),
            clearance_mm: whole.clearance.map(|c| c.0),
            clearance_between: whole.clearance.map(|c| names(c.1)),
            certified: whole.depth.is_some() && whole.bodies_clear,
            intervals: whole.intervals,
        });
    }
    let mut depths = certificates.iter().map(|c| c.depth_mm);
    Ok(Certificates {
        blocks: certificates.len(),
        certified: certificates.iter().filter(|c| c.certified).count(),
        largest_depth_mm: depths.try_fold(0.0, |worst, d| Some(f64::max(worst, d?))),
        certificates,
    })
}

/// What is proven of a move.
#[derive(Clone, Debug)]
struct Proof {
    depth: Option<f64>,
    bodies_clear: bool,
    clearance: Option<Nearest>,
    intervals: u32,
}

/// A proven distance, mm, with the indices of its body and obstacle.
type Nearest = (f64, (usize, usize));

impl Proof {
    fn unknown() -> Self {
        Self { depth: None, bodies_clear: false, clearance: None, intervals: 0 }
    }

    /// Of two moves one after the other.
    fn and(self, other: Self) -> Self {
        let clearance = match (self.clearance, other.clearance) {
            (Some(a), Some(b)) => Some(if b.0 < a.0 { b } else { a }),
            (a, b) => a.or(b),
        };
        Self {
            depth: self.depth.zip(other.depth).map(|(a, b)| a.max(b)),
            bodies_clear: self.bodies_clear && other.bodies_clear,
            clearance,
            intervals: self.intervals + other.intervals,
        }
    }
}

/// How much deeper than sampled a depth is tried to be proven first, mm. Larger: certificates say more than is there;
/// smaller: more intervals.
const FIRST_LACK: f64 = 2e-3;

/// By what a depth grows that could not be proven on the shortest interval.
const GROWTH: f64 = 1.5;

/// Halvings of a move: shorter intervals only fight rounding.
const MAX_HALVINGS: u32 = 10;

/// Part of the distance in the middle of a move that is tried to be proven for all of it, before the required one.
const CLEARANCE_SHARE: f64 = 0.8;

/// Distances of bodies are not told beyond this, mm.
const FARTHEST_CLEARANCE: f64 = 50.0;

/// Part of an interval over which its velocity is measured, on either side of the middle.
const MEASURED: f64 = 1e-3;

/// Rounding of a velocity so measured, mm per interval: coordinates of metres to 1e-12, over the time.
const VELOCITY_ROUNDING: f64 = 1e-8;

/// Proves one move.
struct Prover<'s, 'a> {
    scene: &'s Scene<'a>,
    m: &'s Move,
    motion: Motion<'s>,
    tracks: Vec<CutterTrack>,
    intervals: u32,
}

/// Something that moves, and what it is held against.
#[derive(Clone, Copy)]
struct Pair<'p> {
    mount: Mount,
    frame: Frame,
    solid: &'p Solid,
    obstacle: usize,
}

impl<'s, 'a> Prover<'s, 'a> {
    /// `None` for motions that are not all axes together.
    fn new(scene: &'s Scene<'a>, m: &'s Move) -> Option<Self> {
        let together = matches!(m.law, BlockLaw::Cutting(CuttingLaw::AxesLinear) | BlockLaw::Rapid(RapidLaw::Linear));
        if !together {
            return None;
        }
        let motion = Motion::new(scene.setup.machine, m.law, &m.start, &m.end, scene.tool_length).ok()?;
        Some(Self { scene, m, motion, tracks: vec![CutterTrack::default(); scene.obstacles.len()], intervals: 0 })
    }

    fn prove(&mut self) -> Proof {
        let depth = self.depth();
        let (bodies_clear, clearance) = self.clearance();
        Proof { depth, bodies_clear, clearance, intervals: self.intervals }
    }

    /// The smallest depth that is proven for the whole move against all obstacles.
    fn depth(&mut self) -> Option<f64> {
        let scene = self.scene;
        let mut deepest = 0.0_f64;
        for (k, obstacle) in scene.obstacles.iter().enumerate().filter(|(_, o)| o.meets_cutter) {
            let Some(limit) = scene.cutter_limit(obstacle, self.m) else { continue };
            let sampled = [0.0, 0.5, 1.0].map(|t| self.sampled_depth(t, k, limit.thickness));
            let mut depth = sampled.into_iter().fold(0.0, f64::max);
            // What is nowhere near is proven not to be touched at all.
            depth += if depth > 0.0 { FIRST_LACK } else { 0.0 };
            deepest = deepest.max(self.depth_against(k, limit.thickness, depth, limit.depth.max(FIRST_LACK))?);
        }
        Some(deepest)
    }

    /// The same against one obstacle, from `depth` on, up to `limit`.
    fn depth_against(&mut self, obstacle: usize, thickness: f64, mut depth: f64, limit: f64) -> Option<f64> {
        let mut open = vec![(0.0, 1.0, 0u32)];
        while let Some((from, to, halvings)) = open.pop() {
            if depth > limit {
                return None;
            }
            if self.cutter_stays_above(obstacle, thickness, depth, [from, to]) {
                continue;
            }
            let middle = 0.5 * (from + to);
            let here = self.sampled_depth(middle, obstacle, thickness);
            let wanted = (here + FIRST_LACK).max(depth);
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

    /// Whether no cutter point is deeper than `depth` at any time of an interval: its test bodies for it touch nothing.
    fn cutter_stays_above(&mut self, obstacle: usize, thickness: f64, depth: f64, interval: [f64; 2]) -> bool {
        let cutter = self.scene.setup.tool.cutter();
        let lower = Solid::Frustum(cutter.test_body(depth)).dilated(thickness);
        let upper = cutter.upper_test_body(depth).map(|f| Solid::Frustum(f).dilated(thickness));
        let frame = self.scene.obstacles[obstacle].frame;
        let tool = Mount::Tool(Isometry3::identity());
        std::iter::once(lower)
            .chain(upper)
            .all(|solid| self.clears(&Pair { mount: tool, frame, solid: &solid, obstacle }, interval))
    }

    /// Whether every body keeps its required clearance, and the smallest distance that is proven.
    fn clearance(&mut self) -> (bool, Option<Nearest>) {
        let scene = self.scene;
        let (mut all_clear, mut smallest) = (true, None::<Nearest>);
        let Ok(axes) = self.motion.at(0.5) else { return (false, None) };
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
                    None => all_clear = false,
                    Some(distance) if smallest.is_none_or(|(d, _)| distance < d) => {
                        smallest = Some((distance, (index, k)));
                    }
                    Some(_) => {}
                }
            }
        }
        (all_clear, smallest.filter(|_| all_clear))
    }

    /// Whether a core stays farther than `distance` from an obstacle for the whole move.
    fn keeps(&mut self, mount: Mount, core: &Solid, distance: f64, obstacle: usize) -> bool {
        let solid = core.dilated(distance);
        let frame = self.scene.obstacles[obstacle].frame;
        let mut open = vec![(0.0, 1.0, 0u32)];
        while let Some((from, to, halvings)) = open.pop() {
            if self.clears(&Pair { mount, frame, solid: &solid, obstacle }, [from, to]) {
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
    /// A point whose acceleration is at most A is by at most A/8 farther than its velocity in the middle tells, half an
    /// interval from it; the mean velocity over a short piece around the middle is by at most A times its half length
    /// another.
    fn interval(&self, pair: &Pair<'_>, from: f64, to: f64) -> Option<MotionInterval> {
        let (middle, piece) = (0.5 * (from + to), MEASURED * (to - from));
        let [start, end] = [self.motion.at(from).ok()?, self.motion.at(to).ok()?];
        let [earlier, here, later] =
            [self.motion.at(middle - piece).ok()?, self.motion.at(middle).ok()?, self.motion.at(middle + piece).ok()?];
        let pose = |axes: &AxisValues| self.pose(pair.mount, pair.frame, axes);
        let (earlier, mesh_from_solid, later) = (pose(&earlier), pose(&here), pose(&later));
        let tip = self.pose(pair.mount, pair.frame, &start).inverse()
            * self.pose(Mount::Tool(Isometry3::identity()), pair.frame, &start)
            * nalgebra::Point3::origin();
        let bounds = pair.solid.aabb();
        let reach = (bounds.min - tip).abs().sup(&(bounds.max - tip).abs()).norm();
        let acceleration = motion_bound(self.scene.setup.machine, &start, &end, self.scene.tool_length, reach)?;
        let time = 2.0 * MEASURED;
        Some(MotionInterval {
            mesh_from_solid,
            velocity: (later.translation.vector - earlier.translation.vector) / time,
            spin: later.rotation.rotation_to(&earlier.rotation).inverse().scaled_axis() / time,
            half: 0.5,
            deviation: acceleration * (0.125 + MEASURED) + VELOCITY_ROUNDING,
        })
    }

    /// Pose of something that moves in the frame of an obstacle's mesh.
    fn pose(&self, mount: Mount, frame: Frame, axes: &AxisValues) -> Isometry3<f64> {
        let Scene { setup, work_from_table, tool_length, .. } = *self.scene;
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
