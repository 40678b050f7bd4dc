use facemill_cl_data::{Cancelled, ClPoint, Monitor};
use facemill_interference::Interference;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Motion};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::{
    FindingKind, Measure, ObstacleKind,
    chunk_result::{ChunkResult, Clearance, Gouge},
    cutter_depth::{CutterPlacement, CutterTrack},
    episodes::{Contact, Key},
    moves::Move,
    ramp::Descent,
    scene::{Mount, Scene},
    stepping::{Spacing, positions},
    timing::{duration, spike},
    track::{Placement, Track},
};

/// Runs moves, keeping from position to position what is known of every distance.
pub(crate) struct Walker<'a> {
    scene: &'a Scene<'a>,
    cutter: Vec<CutterTrack>,
    /// Per body, then obstacle.
    bodies: Vec<Track>,
    pub(crate) result: ChunkResult,
}

/// The machine at one position.
struct Position<'a> {
    /// Index of the move in the program, and the move.
    index: usize,
    m: &'a Move,
    axes: AxisValues,
    /// Workpiece frame.
    cl: ClPoint,
    work_from_tool: Isometry3<f64>,
}

/// Positions between two looks at the monitor: fewer than a millisecond's work.
const POSITIONS_PER_CHECK: usize = 64;

/// What rounded words may tilt a motion by over a whole block, mm: two last decimals at each end. Larger hides short steep
/// ramps, smaller reports rounding.
const RAMP_ROUNDING: f64 = 2e-3;

/// How far beyond a limit an axis may be told to go by the rounding of words, mm or deg.
const LIMIT_ROUNDING: f64 = 1e-3;

impl<'a> Walker<'a> {
    /// `nearest` is a place of the program where a body is near: only nearer ones are looked for.
    pub(crate) fn new(scene: &'a Scene<'a>, nearest: Option<Clearance>) -> Self {
        let n_obstacles = scene.setup.obstacles.len();
        Self {
            scene,
            cutter: vec![CutterTrack::default(); n_obstacles],
            bodies: vec![Track::default(); n_obstacles * scene.bodies.len()],
            result: ChunkResult { clearance: nearest, ..ChunkResult::default() },
        }
    }

    /// Tests one move: all positions behind its start, whose position ends the move before.
    pub(crate) fn run(&mut self, index: usize, m: &Move, monitor: &dyn Monitor) -> Result<(), Cancelled> {
        let Scene { setup, settings, tool_length, .. } = *self.scene;
        self.time(index, m);
        let Ok(motion) = Motion::new(setup.machine, m.law, &m.start, &m.end, tool_length) else {
            self.fail_to_reach(index, m, &m.start);
            return Ok(());
        };
        let reach = setup.tool.cutter().radius().hypot(setup.tool.cutter().flute_length());
        let spacing = Spacing { max_step: settings.max_step, max_turn: settings.max_turn, reach };
        let steps = positions(setup.machine, &motion, m.law, [&m.start, &m.end], tool_length, &spacing);
        let ramp_rounding = RAMP_ROUNDING / steps.n() as f64;
        let mut before = self.position(index, m, m.start).cl;
        for t in steps {
            if self.result.n_positions.is_multiple_of(POSITIONS_PER_CHECK) {
                monitor.checkpoint()?;
            }
            let Ok(axes) = motion.at(t) else {
                self.fail_to_reach(index, m, &m.start);
                return Ok(());
            };
            let here = self.position(index, m, axes);
            self.test(&here);
            if !m.is_rapid() {
                self.result.cutting_length += (here.cl.tip - before.tip).norm();
                self.test_ramp(&here, &before, ramp_rounding);
            }
            before = here.cl;
        }
        Ok(())
    }

    /// Tests the bodies alone, at the end of a move alone.
    pub(crate) fn look(&mut self, index: usize, m: &Move) {
        let end = self.position(index, m, m.end);
        self.test_bodies(&end);
    }

    fn time(&mut self, index: usize, m: &Move) {
        let machine = self.scene.setup.machine;
        let time = duration(machine, m, self.scene.tool_length);
        let sum = if m.is_rapid() { &mut self.result.rapid_time } else { &mut self.result.cutting_time };
        *sum += time.unwrap_or(0.0);
        let fault = match time {
            _ if m.is_rapid() => None,
            None => Some((Key::of_axis(FindingKind::NoFeed, None), None)),
            Some(time) => spike(machine, m, time, self.scene.settings.velocity_slack).map(|(axis, ratio)| {
                (Key::of_axis(FindingKind::AxisSpike, Some(axis)), Some(Measure::VelocityRatio(ratio)))
            }),
        };
        if let Some((key, measure)) = fault {
            let end = self.position(index, m, m.end);
            self.record(&end, key, measure, None);
        }
    }

    fn fail_to_reach(&mut self, index: usize, m: &Move, axes: &AxisValues) {
        let here = self.position(index, m, *axes);
        self.record(&here, Key::of_axis(FindingKind::ReachFailure, None), None, None);
    }

    fn position<'m>(&self, index: usize, m: &'m Move, axes: AxisValues) -> Position<'m> {
        let Scene { setup, work_from_table, tool_length, .. } = *self.scene;
        let work_from_tool = work_from_table * setup.machine.forward(&axes, tool_length);
        let cl = ClPoint {
            tip: work_from_tool.translation.vector.into(),
            axis: Unit::new_unchecked(work_from_tool.rotation * Vector3::z()),
        };
        Position { index, m, axes, cl, work_from_tool }
    }

    fn record(&mut self, here: &Position<'_>, key: Key, measure: Option<Measure>, place: Option<Point3<f64>>) {
        let contact = Contact { key, measure, place, axes: here.axes, cl: here.cl };
        self.result.episodes.record(here.index, contact);
    }

    fn test(&mut self, here: &Position<'_>) {
        self.result.n_positions += 1;
        self.test_limits(here);
        let cutter = self.scene.cutter.placed(&here.work_from_tool);
        for obstacle in 0..self.cutter.len() {
            self.test_cutter(here, &cutter, obstacle);
        }
        self.test_bodies(here);
    }

    fn test_limits(&mut self, here: &Position<'_>) {
        for (k, axis) in self.scene.setup.machine.axes().iter().enumerate() {
            let value = here.axes[k];
            let excess = axis.in_word_unit((value - axis.max).max(axis.min - value));
            if excess > LIMIT_ROUNDING {
                let measure = match axis.kind {
                    AxisKind::Linear => Measure::ExcessMm(excess),
                    AxisKind::Rotary => Measure::ExcessDeg(excess),
                };
                self.record(here, Key::of_axis(FindingKind::AxisLimit, Some(k)), Some(measure), None);
            }
        }
    }

    fn test_cutter(&mut self, here: &Position<'_>, cutter: &CutterPlacement, obstacle: usize) {
        let scene = self.scene;
        let o = &scene.setup.obstacles[obstacle];
        let Some((allowance, kind)) = scene.cutter_limit(o, here.m.is_rapid()) else { return };
        let limit = scene.settings.gouge_limit;
        // Only what is deeper than anything before is of interest, until it is a finding: then all of it is.
        let deepest = self.result.gouge.map_or(0.0, |g| g.depth.depth);
        let floor = if kind == FindingKind::Gouge { deepest.min(limit) } else { limit };
        let Some(depth) = scene.cutter.beyond(floor, allowance, cutter, &mut self.cutter[obstacle], o.mesh) else {
            return;
        };
        if kind == FindingKind::Gouge && depth.depth > deepest {
            self.result.gouge = Some(Gouge { depth, obstacle, move_index: here.index });
        }
        if depth.depth > limit {
            let measure = Measure::DepthMm(depth.depth);
            self.record(here, Key::of_cutter(kind, obstacle), Some(measure), Some(depth.place));
        }
    }

    fn test_bodies(&mut self, here: &Position<'_>) {
        let scene = self.scene;
        let mut machine_bodies = scene.setup.machine.body_poses(&here.axes).enumerate();
        for (index, body) in scene.bodies.iter().enumerate() {
            let work_from_solid = match body.mount {
                Mount::Tool(tool_from_solid) => here.work_from_tool * tool_from_solid,
                // Bodies of the scene stand in the order of the machine's.
                Mount::Machine(wanted) => match machine_bodies.find(|(k, _)| *k == wanted) {
                    Some((_, pose)) => scene.work_from_table * pose.table_from_solid,
                    None => continue,
                },
            };
            let at = body.shape.placed(work_from_solid);
            for obstacle in 0..scene.setup.obstacles.len() {
                self.test_body(here, index, &at, obstacle);
            }
        }
    }

    fn test_body(&mut self, here: &Position<'_>, index: usize, at: &Placement, obstacle: usize) {
        let scene = self.scene;
        let (body, o) = (&scene.bodies[index], &scene.setup.obstacles[obstacle]);
        let smallest = self.result.clearance.map_or(f64::INFINITY, |c| c.distance);
        // The raw stock is gone where the cutter has been: only of the others is the distance worth telling.
        let counts = o.kind != ObstacleKind::Stock;
        let near = o.stock + body.clearance + scene.settings.near_miss;
        let need = body.rounding + if counts { near.max(smallest) } else { near };
        let track = &mut self.bodies[index * scene.setup.obstacles.len() + obstacle];
        let Some(nearest) = track.nearest_within(need, &body.shape, at, o.mesh) else { return };
        let distance = (nearest.distance - body.rounding).max(0.0);
        if counts && distance < smallest {
            let (place, move_index) = (nearest.point, here.index);
            self.result.clearance = Some(Clearance { distance, place, body: index, obstacle, move_index });
        }
        let hit = o.stock + (body.clearance - scene.settings.clearance_slack).max(0.0);
        let kind = match distance {
            d if d < hit || d == 0.0 => body.kind,
            d if d < near => FindingKind::NearMiss,
            _ => return,
        };
        let key = Key::of_body(kind, index, obstacle);
        self.record(here, key, Some(Measure::DistanceMm(distance)), Some(nearest.point));
    }

    fn test_ramp(&mut self, here: &Position<'_>, before: &ClPoint, rounding: f64) {
        let scene = self.scene;
        let tool = scene.setup.tool;
        let descent = Descent::between(before, &here.cl, tool.cutter().radius());
        if !descent.is_steeper_than(tool.max_ramp_angle() + scene.settings.ramp_slack, rounding) {
            return;
        }
        let cutter = scene.cutter.placed(&here.work_from_tool);
        let floor = scene.settings.gouge_limit;
        for (k, o) in scene.setup.obstacles.iter().enumerate() {
            if o.stock <= 0.0 && o.kind != ObstacleKind::Stock {
                continue;
            }
            let mesh: &dyn Interference = o.mesh;
            if let Some(depth) = scene.cutter.beyond(floor, o.stock, &cutter, &mut self.cutter[k], mesh) {
                let measure = Measure::AngleDeg(descent.angle().to_degrees());
                let key = Key::of_cutter(FindingKind::RampTooSteep, k);
                self.record(here, key, Some(measure), Some(depth.place));
            }
        }
    }
}
