use facemill_cl_data::{Cancelled, ClPoint, CuttingLaw, Monitor};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Machine, Motion};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::finding::episodes::{Contact, Key};
use crate::finding::{FindingKind, Measure};
use crate::motion::moves::{Move, excesses};
use crate::motion::setup::ObstacleKind;
use crate::motion::stepping::{Positions, positions, ways};
use crate::program_time::timing::{duration, spike};
use crate::run::chunk_result::{ChunkResult, Clearance, Gouge};
use crate::run::cutter_depth::{CutterDepth, CutterPlacement, CutterTrack};
use crate::run::dead_core::DeadCore;
use crate::run::edges::{RunQueries, spacing};
use crate::run::ramp::{Descent, RAMP_ROUNDING};
use crate::run::scene::{Frame, Mount, Role, RunScene};
use crate::run::track::{Placement, Track};

/// Runs moves, keeping from position to position what is known of every distance.
pub(crate) struct Walker<'a> {
    scene: &'a RunScene<'a>,
    queries: &'a RunQueries,
    /// Per obstacle: in cuts, then in rapids.
    cutter: Vec<[CutterTrack; 2]>,
    /// Per body, then obstacle: one for each tested shape.
    bodies: Vec<Vec<Track>>,
    core: Option<&'a DeadCore>,
    /// Of the core, per obstacle.
    core_tracks: Vec<Track>,
    /// Way of the tip since the core was looked at, mm.
    core_way: f64,
    /// Where the machine's bodies are, workpiece frame; kept for its memory.
    machine_poses: Vec<Isometry3<f64>>,
    pub(crate) result: ChunkResult,
}

/// The machine at one position.
struct Position<'a> {
    /// Index of the move in the program, and the move.
    index: usize,
    m: &'a Move,
    axes: AxisValues,
    /// Fraction of the move's time.
    at: f64,
    /// Workpiece frame.
    cl: ClPoint,
    work_from_tool: Isometry3<f64>,
}

/// Positions between two looks at the monitor: fewer than a millisecond's work.
const POSITIONS_PER_CHECK: usize = 64;

const TURNED: BlockLaw = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);

/// Way of the rotary axes together that no motion makes at once, rad. Larger: a change of branch
/// next to the pole is taken for a fast turn; smaller: more looks at fast turns.
const JUMP: f64 = 0.2;

/// Halvings after which a step that is as large as a jump is one: beyond the digits of a time.
const JUMP_HALVINGS: u32 = 40;

/// Whether rotary axes that follow a turned vector have to jump between two times: the block's ends
/// are on different branches or windings, and the vector's own turn leads from neither to the
/// other.
fn jumps(machine: &Machine, motion: &Motion<'_>, from: (f64, AxisValues), to: (f64, AxisValues)) -> bool {
    let (mut from, mut to) = (from, to);
    for _ in 0..JUMP_HALVINGS {
        let way = |a: &AxisValues, b: &AxisValues| ways(machine, a, b)[1];
        if way(&from.1, &to.1) <= JUMP {
            return false;
        }
        let middle = 0.5 * (from.0 + to.0);
        let Ok(axes) = motion.at(middle) else { return true };
        let is_first = way(&from.1, &axes) >= way(&axes, &to.1);
        *(if is_first { &mut to } else { &mut from }) = (middle, axes);
    }
    true
}

impl<'a> Walker<'a> {
    /// `nearest` is a place of the program where a body is near: only nearer ones are looked for.
    pub(crate) fn new(
        scene: &'a RunScene<'a>,
        queries: &'a RunQueries,
        core: Option<&'a DeadCore>,
        nearest: Option<Clearance>,
    ) -> Self {
        let n_obstacles = scene.obstacles.len();
        let tracks = queries.bodies.iter().flat_map(|shapes| vec![vec![Track::default(); shapes.len()]; n_obstacles]);
        Self {
            scene,
            queries,
            cutter: vec![<[CutterTrack; 2]>::default(); n_obstacles],
            bodies: tracks.collect(),
            core,
            core_tracks: vec![Track::default(); n_obstacles],
            core_way: f64::INFINITY,
            machine_poses: Vec::with_capacity(scene.setup.machine.bodies().len()),
            result: ChunkResult { clearance: nearest, ..ChunkResult::default() },
        }
    }

    /// Tests one move: all positions behind its start, whose position ends the move before.
    pub(crate) fn run(&mut self, index: usize, m: &Move, monitor: &dyn Monitor) -> Result<(), Cancelled> {
        let setup = self.scene.setup;
        self.time(index, m);
        let Some((motion, steps)) = self.positions(m) else {
            self.fail_to_reach(index, m, (0.0, m.start));
            return Ok(());
        };
        if !steps.is_bounded {
            self.result.open.push(index);
        }
        let ramp_rounding = RAMP_ROUNDING / steps.n() as f64;
        let mut before = self.position(index, m, (0.0, m.start)).cl;
        let mut last = (0.0, m.start);
        let repeated = steps.repeated;
        let mut length_skipped_at = None;
        for t in steps {
            if let Some(turns) = repeated.filter(|r| last.0 <= r.from && r.to < t) {
                // The turns between are the last one's over again.
                let Ok(axes) = motion.at(turns.to) else { continue };
                before = self.position(index, m, (turns.to, axes)).cl;
                length_skipped_at = Some(self.result.cutting_length);
            }
            if self.result.n_positions.is_multiple_of(POSITIONS_PER_CHECK) {
                monitor.checkpoint()?;
            }
            let Ok(axes) = motion.at(t) else {
                self.fail_to_reach(index, m, last);
                return Ok(());
            };
            if m.law == TURNED && jumps(setup.machine, &motion, last, (t, axes)) {
                self.fail_to_reach(index, m, (t, axes));
                return Ok(());
            }
            last = (t, axes);
            let here = self.position(index, m, (t, axes));
            self.test(&here);
            if !m.is_rapid {
                self.result.cutting_length += (here.cl.tip - before.tip).norm();
                self.test_ramp(&here, &before, ramp_rounding);
                let radius = setup.tool.cutter().radius();
                let turn = (here.cl.axis.into_inner() - before.axis.into_inner()).norm();
                self.core_way += (here.cl.tip - before.tip).norm() + radius * turn;
                self.test_core(&here, t);
            }
            before = here.cl;
        }
        if let Some((turns, at)) = repeated.zip(length_skipped_at) {
            self.result.cutting_length += turns.turns * (self.result.cutting_length - at);
        }
        Ok(())
    }

    /// Tests the bodies alone, at all positions behind a move's start that the axes can follow to.
    pub(crate) fn run_bodies(&mut self, index: usize, m: &Move, monitor: &dyn Monitor) -> Result<(), Cancelled> {
        let Some((motion, steps)) = self.positions(m) else { return Ok(()) };
        for (n, t) in steps.enumerate() {
            if n.is_multiple_of(POSITIONS_PER_CHECK) {
                monitor.checkpoint()?;
            }
            let Ok(axes) = motion.at(t) else { return Ok(()) };
            let here = self.position(index, m, (t, axes));
            self.place_machine(&here);
            self.test_bodies(&here);
        }
        Ok(())
    }

    /// The motion of a move, and the positions that are tested; `None` where the axes have no such
    /// motion.
    fn positions(&self, m: &Move) -> Option<(Motion<'a>, Positions)> {
        let RunScene { setup, tool_length, .. } = *self.scene;
        let motion = Motion::new(setup.machine, m.law, &m.start, &m.end, tool_length).ok()?;
        let steps = positions(setup.machine, &motion, m.law, [&m.start, &m.end], tool_length, &spacing(self.scene, m));
        Some((motion, steps))
    }

    /// Tests the bodies alone, at the end of a move alone.
    pub(crate) fn look(&mut self, index: usize, m: &Move) {
        let end = self.position(index, m, (1.0, m.end));
        self.place_machine(&end);
        self.test_bodies(&end);
    }

    fn time(&mut self, index: usize, m: &Move) {
        let machine = self.scene.setup.machine;
        let time = duration(machine, m, self.scene.tool_length);
        let sum = if m.is_rapid { &mut self.result.rapid_time } else { &mut self.result.cutting_time };
        *sum += time.unwrap_or(0.0);
        let fault = match time {
            _ if m.is_rapid => None,
            None => Some((Key::of_axis(FindingKind::NoFeed, None), None)),
            Some(time) => spike(machine, m, time, self.scene.settings.velocity_slack).map(|(axis, ratio)| {
                (Key::of_axis(FindingKind::AxisSpike, Some(axis)), Some(Measure::VelocityRatio(ratio)))
            }),
        };
        if let Some((key, measure)) = fault {
            let end = self.position(index, m, (1.0, m.end));
            self.record(&end, key, measure, None);
        }
    }

    fn fail_to_reach(&mut self, index: usize, m: &Move, last: (f64, AxisValues)) {
        let here = self.position(index, m, last);
        self.record(&here, Key::of_axis(FindingKind::ReachFailure, None), None, None);
    }

    /// `at` is the fraction of the move's time.
    fn position<'m>(&self, index: usize, m: &'m Move, (at, axes): (f64, AxisValues)) -> Position<'m> {
        let RunScene { setup, work_from_table, tool_length, .. } = *self.scene;
        let work_from_tool = work_from_table * setup.machine.forward(&axes, tool_length);
        let cl = ClPoint {
            tip: work_from_tool.translation.vector.into(),
            axis: Unit::new_unchecked(work_from_tool.rotation * Vector3::z()),
        };
        Position { index, m, axes, at, cl, work_from_tool }
    }

    fn record(&mut self, here: &Position<'_>, key: Key, measure: Option<Measure>, place: Option<Point3<f64>>) {
        let contact = Contact { key, measure, place, axes: here.axes, cl: here.cl, at: here.at };
        self.result.episodes.record(here.index, contact);
    }

    fn test(&mut self, here: &Position<'_>) {
        self.result.n_positions += 1;
        self.test_limits(here);
        self.place_machine(here);
        let cutter = self.cutter_in(here.m);
        let in_work = cutter.placed(&here.work_from_tool);
        for (k, obstacle) in self.scene.obstacles.iter().enumerate().filter(|(_, o)| o.meets_cutter) {
            match obstacle.frame {
                Frame::Work => self.test_cutter(here, &in_work, k),
                Frame::Machine(body) => {
                    let solid_from_tool = self.machine_poses[body].inv_mul(&here.work_from_tool);
                    self.test_cutter(here, &cutter.placed(&solid_from_tool), k);
                }
            }
        }
        self.test_bodies(here);
    }

    /// Returns the queries of the cutter on a move.
    fn cutter_in(&self, m: &Move) -> &'a CutterDepth {
        let queries = self.queries;
        if m.is_rapid { &queries.cutter_in_rapid } else { &queries.cutter }
    }

    fn place_machine(&mut self, here: &Position<'_>) {
        let RunScene { setup, work_from_table, .. } = *self.scene;
        self.machine_poses.clear();
        let poses = setup.machine.body_poses(&here.axes);
        self.machine_poses.extend(poses.map(|p| work_from_table * p.table_from_solid));
    }

    /// A point of an obstacle's mesh in the workpiece frame.
    fn in_work(&self, obstacle: usize, p: &Point3<f64>) -> Point3<f64> {
        match self.scene.obstacles[obstacle].frame {
            Frame::Work => *p,
            Frame::Machine(body) => self.machine_poses[body] * p,
        }
    }

    fn test_limits(&mut self, here: &Position<'_>) {
        for (k, measure) in excesses(self.scene.setup.machine, &here.axes) {
            self.record(here, Key::of_axis(FindingKind::AxisLimit, Some(k)), Some(measure), None);
        }
    }

    /// `cutter` is placed in the frame of the obstacle's mesh.
    fn test_cutter(&mut self, here: &Position<'_>, cutter: &CutterPlacement, obstacle: usize) {
        let scene = self.scene;
        let o = &scene.obstacles[obstacle];
        let Some(limit) = scene.cutter_limit(o, here.m) else { return };
        // Only what is deeper than anything before is of interest, until it is a finding: then all
        // of it is.
        let section = here.m.section;
        let deepest = self.result.gouges.deepest(section).map_or(0.0, |g| g.depth.depth);
        let floor = if limit.kind == FindingKind::Gouge { deepest.min(limit.depth) } else { limit.depth };
        let (queries, track) = (self.cutter_in(here.m), &mut self.cutter[obstacle][usize::from(here.m.is_rapid)]);
        let Some(mut depth) = queries.beyond(floor, limit.thickness, cutter, track, o.mesh()) else { return };
        depth.place = self.in_work(obstacle, &depth.place);
        if limit.kind == FindingKind::Gouge && depth.depth > deepest {
            self.result.gouges.add(section, Gouge { depth, obstacle, move_index: here.index });
        }
        if depth.depth > limit.depth {
            let measure = Measure::DepthMm(depth.depth);
            self.record(here, Key::of_cutter(limit.kind, obstacle), Some(measure), Some(depth.place));
        }
    }

    fn test_bodies(&mut self, here: &Position<'_>) {
        let scene = self.scene;
        for (index, body) in scene.bodies.iter().enumerate() {
            let work_from_solid = match body.mount {
                Mount::Tool(tool_from_solid) => here.work_from_tool * tool_from_solid,
                Mount::Machine(k) => self.machine_poses[k],
            };
            for (part, shape) in self.queries.bodies[index].iter().enumerate() {
                let in_work = shape.placed(work_from_solid);
                for (k, obstacle) in scene.obstacles.iter().enumerate().filter(|(k, _)| body.meets[*k]) {
                    match obstacle.frame {
                        Frame::Work => self.test_body(here, (index, part), &in_work, k),
                        Frame::Machine(other) => {
                            let placed = shape.placed(self.machine_poses[other].inv_mul(&work_from_solid));
                            self.test_body(here, (index, part), &placed, k);
                        }
                    }
                }
            }
        }
    }

    /// Of one shape of a body; `at` is its place in the frame of the obstacle's mesh.
    fn test_body(&mut self, here: &Position<'_>, (index, part): (usize, usize), at: &Placement, obstacle: usize) {
        let scene = self.scene;
        let (body, o) = (&scene.bodies[index], &scene.obstacles[obstacle]);
        let smallest = self.result.clearance.map_or(f64::INFINITY, |c| c.distance);
        let near = o.stock_for(body) + body.clearance + scene.settings.near_miss;
        let need = body.rounding + if o.counts { near.max(smallest) } else { near };
        let track = &mut self.bodies[index * scene.obstacles.len() + obstacle][part];
        let Some(nearest) = track.nearest_within(need, &self.queries.bodies[index][part], at, o.mesh()) else { return };
        let distance = (nearest.distance - body.rounding).max(0.0);
        let place = self.in_work(obstacle, &nearest.point);
        if o.counts && distance < smallest {
            let move_index = here.index;
            self.result.clearance = Some(Clearance { distance, place, body: index, obstacle, move_index });
        }
        let kind = match distance {
            d if d < scene.hit_distance(body, o) || d == 0.0 => body.kind,
            d if d < near => FindingKind::NearMiss,
            _ => return,
        };
        let key = Key::of_body(kind, index, obstacle);
        self.record(here, key, Some(Measure::DistanceMm(distance)), Some(place));
    }

    /// `t` is the fraction of the move's time.
    fn test_core(&mut self, here: &Position<'_>, t: f64) {
        let Some(core) = self.core.filter(|c| self.core_way >= c.spacing() || t >= 1.0) else { return };
        self.core_way = 0.0;
        let found = core.in_stock(self.scene, &mut self.core_tracks, &here.work_from_tool, (here.index, t));
        if let Some(found) = found {
            let key = Key::of_cutter(FindingKind::DeadCore, found.obstacle);
            self.record(here, key, Some(Measure::DepthMm(found.depth)), Some(found.place));
        }
    }

    fn test_ramp(&mut self, here: &Position<'_>, before: &ClPoint, rounding: f64) {
        let scene = self.scene;
        let tool = scene.setup.tool;
        if scene.settings.as_cut.tool {
            return;
        }
        let descent = Descent::between(before, &here.cl, tool.cutter().radius());
        if !descent.is_steeper_than(tool.max_ramp_angle() + scene.settings.ramp_slack, rounding) {
            return;
        }
        let cutter = self.queries.cutter.placed(&here.work_from_tool);
        let floor = scene.settings.gouge_limit_in(here.m.section);
        for (k, o) in scene.obstacles.iter().enumerate() {
            let Role::Work(kind) = o.role else { continue };
            if o.stock <= 0.0 && kind != ObstacleKind::Stock {
                continue;
            }
            if let Some(depth) = self.queries.cutter.beyond(floor, o.stock, &cutter, &mut self.cutter[k][0], o.mesh()) {
                let measure = Measure::AngleDeg(descent.angle().to_degrees());
                let key = Key::of_cutter(FindingKind::RampTooSteep, k);
                self.record(here, key, Some(measure), Some(depth.place));
            }
        }
    }
}
