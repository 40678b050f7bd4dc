//! Needs of the lengths against meshes and bodies of the machine, position by position.

use facemill_cl_data::{Cancelled, ClPoint, Monitor};
use facemill_interference::lift_to_free;
use facemill_inverse_kinematics::{AxisValues, Motion};
use facemill_tool_model::{AssemblyLength, Lengths, OpenAssembly};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use rayon::prelude::*;

use super::needs::{Needs, Raise};
use crate::motion::moves::Move;
use crate::motion::stepping::{Spacing, positions};
use crate::run::between::{CUTTER_BULGE, cutter_step};
use crate::run::scene::{Frame, Mount, RunScene, SceneBody, SceneObstacle, cl_of};
use crate::run::track::{Shape, Track};

/// Moves that begin with the lengths of the run, and take up their own from there.
const MOVES_PER_CHUNK: usize = 128;

/// How much longer than needed a length may be, mm.
const RESOLUTION: f64 = 1e-3;

/// Times that the lengths are taken up at one position: more than bodies and obstacles ever ask for
/// one after the other.
const MAX_RAISES: usize = 1000;

/// Returns the needs of the lengths against the meshes of a scene, which is built for an assembly
/// with these lengths: the same positions and distances as those by which
/// [`verify`](crate::run::verify::verify) finds collisions. No length exceeds `longest`.
pub(crate) fn mesh_needs(
    scene: &RunScene<'_>,
    moves: &[Move],
    assembly: &OpenAssembly,
    lengths: &Lengths,
    longest: f64,
    monitor: &dyn Monitor,
) -> Result<Needs, Cancelled> {
    let of_chunk = |moves: &[Move]| -> Result<Needs, Cancelled> {
        let mut walker = LengthWalker::new(scene, assembly, *lengths, longest);
        for m in moves {
            monitor.checkpoint()?;
            walker.run(m);
        }
        Ok(walker.needs)
    };
    let all: Result<Vec<Needs>, Cancelled> = moves.par_chunks(MOVES_PER_CHUNK).with_max_len(1).map(of_chunk).collect();
    let mut needs = Needs::default();
    all?.into_iter().for_each(|chunk| needs.add_all(chunk));
    Ok(needs)
}

/// A body with the length that it rides on.
struct Rider {
    name: String,
    shape: Shape,
    /// Rounding of the body as it is.
    rounding: f64,
    /// Distance to be free of each obstacle, mm; `None` where the two are not tested.
    keeps: Vec<Option<f64>>,
    mount: Mount,
    rides: AssemblyLength,
    tracks: Vec<Track>,
}

struct LengthWalker<'a> {
    scene: &'a RunScene<'a>,
    assembly: &'a OpenAssembly,
    longest: f64,
    lengths: Lengths,
    /// Whether no length up to the longest is free somewhere.
    is_hopeless: [bool; 4],
    /// Bodies of the tool with `lengths`, then those of the machine.
    riders: Vec<Rider>,
    n_of_tool: usize,
    needs: Needs,
    machine_poses: Vec<Isometry3<f64>>,
}

/// Position of the machine.
struct Here {
    block: usize,
    axes: AxisValues,
    work_from_tool: Isometry3<f64>,
    cl: ClPoint,
}

/// Contact: index of the rider and of the obstacle, and its place.
type Met = (usize, usize, Point3<f64>);

impl<'a> LengthWalker<'a> {
    fn new(scene: &'a RunScene<'a>, assembly: &'a OpenAssembly, lengths: Lengths, longest: f64) -> Self {
        let mut walker = Self {
            scene,
            assembly,
            longest,
            lengths,
            is_hopeless: [false; 4],
            riders: Vec::new(),
            n_of_tool: 0,
            needs: Needs::default(),
            machine_poses: Vec::new(),
        };
        let of_machine = scene.bodies.iter().filter(|b| matches!(b.mount, Mount::Machine(_)));
        walker.riders = of_machine.map(|b| walker.rider(b, &b.meets, assembly.machine_rides())).collect();
        walker.build_tool();
        walker
    }

    fn rider(&self, body: &SceneBody, meets: &[bool], rides: AssemblyLength) -> Rider {
        let scene = self.scene;
        let keep = |(o, meets): (&SceneObstacle<'_>, &bool)| meets.then(|| scene.hit_distance(body, o));
        Rider {
            name: body.name.clone(),
            shape: body.shape.clone(),
            rounding: body.rounding,
            keeps: scene.obstacles.iter().zip(meets).map(keep).collect(),
            mount: body.mount,
            rides,
            tracks: vec![Track::default(); scene.obstacles.len()],
        }
    }

    /// The bodies of the tool as they are with the lengths. Lengths that make no tool leave none:
    /// the search tells them.
    fn build_tool(&mut self) {
        let of_machine = self.riders.split_off(self.n_of_tool);
        self.riders.clear();
        if let Ok(built) = self.assembly.built(&self.lengths) {
            let solids = built.tool.collision_bodies().into_iter().zip(built.rides);
            for (solid, rides) in solids.filter_map(|(solid, rides)| Some((solid, rides?))) {
                let body = SceneBody::of_tool(solid);
                let rider = self.rider(&body, &self.scene.tool_meets, rides);
                self.riders.push(rider);
            }
        }
        self.n_of_tool = self.riders.len();
        self.riders.extend(of_machine);
    }

    fn run(&mut self, m: &Move) {
        let RunScene { setup, settings, tool_length, .. } = *self.scene;
        // `verify` reports motions that the axes cannot follow.
        let Ok(motion) = Motion::new(setup.machine, m.law, &m.start, &m.end, tool_length) else { return };
        let reach = setup.tool.cutter().radius().hypot(setup.tool.cutter().flute_length());
        let max_step = cutter_step(setup.tool.cutter(), settings);
        let spacing = Spacing { max_step, max_turn: settings.max_turn, max_bulge: CUTTER_BULGE, reach };
        for t in positions(setup.machine, &motion, m.law, [&m.start, &m.end], tool_length, &spacing) {
            let Ok(axes) = motion.at(t) else { return };
            let work_from_tool = self.scene.work_from_table * setup.machine.forward(&axes, tool_length);
            let here = Here { block: m.block, axes, work_from_tool, cl: cl_of(&work_from_tool) };
            self.free(&here);
        }
    }

    /// Takes the lengths up until all bodies are free here.
    fn free(&mut self, here: &Here) {
        for _ in 0..MAX_RAISES {
            self.place_machine(here);
            let Some(met) = self.first_met(here) else { return };
            self.raise(here, met);
        }
    }

    /// Where the machine's bodies are with the length that they ride on now.
    fn place_machine(&mut self, here: &Here) {
        let axes = self.axes_with(here, 0.0).unwrap_or(here.axes);
        let (setup, work_from_table) = (self.scene.setup, self.scene.work_from_table);
        self.machine_poses.clear();
        self.machine_poses.extend(setup.machine.body_poses(&axes).map(|p| work_from_table * p.table_from_solid));
    }

    /// The axes with the same tip and a tool so much longer than it is now.
    fn axes_with(&self, here: &Here, more: f64) -> Option<AxisValues> {
        let RunScene { setup, tool_length, .. } = *self.scene;
        let length = self.lengths[AssemblyLength::Gauge.index()] + more;
        if length == tool_length {
            return Some(here.axes);
        }
        let tip = setup.machine.cl_point(&here.axes, tool_length).tip;
        setup.machine.with_tip_at(&here.axes, &tip, length)
    }

    /// The first body that is too near to an obstacle, of those whose length may yet be taken up.
    fn first_met(&mut self, here: &Here) -> Option<Met> {
        let scene = self.scene;
        for r in 0..self.riders.len() {
            let work_from_solid = self.pose(&self.riders[r], here);
            if self.is_hopeless[self.riders[r].rides.index()] {
                continue;
            }
            for (k, obstacle) in scene.obstacles.iter().enumerate() {
                let Some(keep) = self.riders[r].keeps[k] else { continue };
                let frame = self.frame(obstacle);
                let rider = &mut self.riders[r];
                let at = rider.shape.placed(frame.inv_mul(&work_from_solid));
                let need = rider.rounding + keep;
                let nearest = rider.tracks[k].nearest_within(need, &rider.shape, &at, obstacle.mesh());
                let Some(nearest) = nearest else { continue };
                let distance = (nearest.distance - rider.rounding).max(0.0);
                if distance < keep || distance == 0.0 {
                    return Some((r, k, nearest.point));
                }
            }
        }
        None
    }

    fn pose(&self, rider: &Rider, here: &Here) -> Isometry3<f64> {
        match rider.mount {
            Mount::Tool(tool_from_solid) => here.work_from_tool * tool_from_solid,
            Mount::Machine(k) => self.machine_poses[k],
        }
    }

    fn frame(&self, obstacle: &SceneObstacle<'_>) -> Isometry3<f64> {
        match obstacle.frame {
            Frame::Work => Isometry3::identity(),
            Frame::Machine(body) => self.machine_poses[body],
        }
    }

    fn raise(&mut self, here: &Here, (r, k, point): Met) {
        let obstacle = &self.scene.obstacles[k];
        let rider = &self.riders[r];
        let (frame, length, pose) = (self.frame(obstacle), rider.rides, self.pose(rider, here));
        let keep = rider.keeps[k].unwrap_or(0.0);
        let solid = rider.shape.core.dilated(rider.rounding + keep);
        let now = self.lengths[length.index()];
        let per_mm = self.way_per_mm(rider, obstacle, here);
        let speed = per_mm.norm();
        // No length frees a point that does not move with the length.
        let direction = (speed > 1e-6).then(|| Unit::new_normalize(per_mm));
        let lift = direction.and_then(|direction| {
            let most = (self.longest - now) * speed;
            lift_to_free(obstacle.mesh(), &solid, &frame.inv_mul(&pose), direction, most, RESOLUTION)
        });
        // Where rounding has it free already the length still goes up, so that the search goes on.
        let to = lift.map_or(f64::INFINITY, |lift| now + (lift / speed).max(RESOLUTION));
        let raise = Raise {
            to,
            block: here.block,
            body: rider.name.clone(),
            obstacle: obstacle.name.clone(),
            place: frame * point,
            cl: here.cl,
        };
        self.needs.add(length, raise);
        if to.is_infinite() {
            self.is_hopeless[length.index()] = true;
            return;
        }
        self.lengths[length.index()] = to;
        self.assembly.rest(&mut self.lengths);
        self.build_tool();
    }

    /// How a body goes against an obstacle for every mm of its length, in the obstacle's frame.
    fn way_per_mm(&self, rider: &Rider, obstacle: &SceneObstacle<'_>, here: &Here) -> Vector3<f64> {
        let Mount::Machine(body) = rider.mount else {
            return self.frame(obstacle).inverse_transform_vector(&here.cl.axis);
        };
        let (Some(now), Some(longer)) = (self.axes_with(here, 0.0), self.axes_with(here, 1.0)) else {
            return Vector3::zeros();
        };
        let work_from_table = self.scene.work_from_table;
        let place = |axes: &AxisValues| {
            let poses: Vec<Isometry3<f64>> =
                self.scene.setup.machine.body_poses(axes).map(|p| work_from_table * p.table_from_solid).collect();
            let frame = if let Frame::Machine(k) = obstacle.frame { poses[k] } else { Isometry3::identity() };
            frame.inv_mul(&poses[body]).translation.vector
        };
        place(&longer) - place(&now)
    }
}
