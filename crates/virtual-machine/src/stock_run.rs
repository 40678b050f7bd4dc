//! The stock as the program cuts it, and what meets it.

use facemill_cl_data::{Cancelled, Monitor, Solid};
use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolAssembly;
use facemill_z_map::{DexelMap, Step, StepResult, Sweep, TurnedBody};
use rayon::prelude::*;

use crate::{
    Finding, FindingKind, Measure, VerifyError, VerifySettings, VirtualSetup,
    engagement::{Engagement, Part},
    episodes::{Contact, Episodes, Key},
    moves::{Move, resolve},
    probe::{Probe, dilated},
    ramp::{Descent, RAMP_ROUNDING},
    report::Report,
    scene::Scene,
    segments::{Coarseness, Segment, segments},
    setup,
    timing::duration,
};

/// What a program does to the stock.
#[derive(Clone, Debug, PartialEq)]
pub struct StockRun {
    /// What met the stock as it was at that moment, in program order.
    pub findings: Vec<Finding>,
    /// Volume that was cut, mm³.
    pub removed_mm3: f64,
    /// What each block with a cutting move took, in program order.
    pub blocks: Vec<BlockCut>,
}

/// What a block took out of the stock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockCut {
    /// Line of the program, from 1.
    pub line: u32,
    /// Volume, mm³.
    pub removed_mm3: f64,
    /// Way of the tip on the work, mm.
    pub way_mm: f64,
    /// Whether it cuts whatever the tolerance does: a cutter smaller by twice the tolerance on all sides meets more than twice
    /// the tolerance of a line's material. Asked on [`VerifySettings::probed_lines`] alone, `false` elsewhere. A block
    /// that goes on by less than that, or between two lines, may cut without being told.
    pub is_certain: bool,
    /// Whether it may come near stock, so that what it takes between the lines is not seen: a cutter with the diagonal of a
    /// cell around it, and four times the tolerance, meets material of a line, or the way is not known. Asked on the same
    /// lines, `false` elsewhere. Stock that has no line at all, thinner than a cell, is not seen by this either.
    pub may_be_near: bool,
}

/// Cuts the stock as a program that was read from NC text does, and reports what met it that may not: bodies of the tool
/// assembly, the cutter in rapid, the core of the cutter that does not cut, and the cutter going down more steeply than it may.
///
/// The tool's motion is that of the machine's law, taken as straight ways with an evenly turning axis; at no time is a point
/// of the tool farther than `tolerance` (mm) from where it is then, and the solids that are swept are within the same
/// tolerance of those that these ways sweep. So what is cut is within twice the tolerance of the truth, on every line of the map.
///
/// - A body is asked as it is before its segment is cut: what it meets then is a collision. With its clearance, less
///   [`VerifySettings::clearance_slack`], it is asked after the flute has passed.
/// - In rapids the cutter is asked, with half the diagonal of a cell around it: no rapid through a cell's material is missed.
/// - What is no deeper than twice the tolerance is no finding: so far the ways may be off.
/// - Bodies are found wherever else they meet the material of a line. A clearance of half a cell's diagonal or more, less the
///   slack, makes up for what lies between lines.
/// - Faults of the text, and motions that are not simulated, are `verify`'s to tell: nothing is cut on them.
/// - Bodies of the machine are not asked: `verify` holds them against the stock as it was before cutting.
///
/// The stock is changed in place, and is the rest when this returns without an error; with an error it is of no use. The
/// result does not depend on the number of threads; `monitor` is told of every block with a motion.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels.
pub fn run_stock(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    stock: &mut DexelMap,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<StockRun, VerifyError> {
    setup::check(setup, settings)?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(VerifyError::Setting { field: "tolerance", value: tolerance, needed: "above 0" });
    }
    let resolved = resolve(program, setup, settings);
    let scene = Scene::new(setup, settings)?;
    let bodies = Bodies::new(setup.tool, settings.clearance_slack, stock.grid().cell());
    let coarse = Coarseness { tolerance, reach: setup.tool.gauge_length(), max_way: bodies.max_way };
    let (radius, cell) = (setup.tool.cutter().radius(), stock.grid().cell());
    let probe = Probe::new(program, settings, setup.tool.cutter(), [tolerance, cell]);
    let engagement = settings.removal.map(|limit| Engagement::new(limit, settings.removal_slack, radius, cell));
    let mut run = Run { scene: &scene, bodies: &bodies, probe: &probe, coarse, stock, engagement, out: Out::default() };
    for (k, batch) in resolved.moves.chunks(MOVES_PER_BATCH).enumerate() {
        run.batch(k * MOVES_PER_BATCH, batch, monitor)?;
        monitor.advance(batch.chunk_by(|a, b| a.block == b.block).count());
    }
    let Out { episodes, taken } = run.out;
    let report = Report::new(program, &scene, &resolved);
    let blocks = resolved
        .moves
        .iter()
        .zip(taken)
        .filter(|(m, _)| !m.is_rapid)
        .map(|(m, taken)| BlockCut { line: program.blocks[m.block].line, ..taken });
    let blocks: Vec<BlockCut> = blocks.collect();
    let mut findings: Vec<Finding> = episodes.all.iter().map(|e| report.finding(e)).collect();
    findings.sort_by_key(|f| (f.first_line, f.kind));
    Ok(StockRun { findings, removed_mm3: blocks.iter().fold(0.0, |all, b| all + b.removed_mm3), blocks })
}

/// Moves whose segments are made before the stock is cut by them: bounds the memory.
const MOVES_PER_BATCH: usize = 512;

/// Smallest and largest way of a segment, mm. Within, it is what the flute is wider than the bodies behind it.
const WAYS: [f64; 2] = [0.5, 8.0];

/// Height of the core that is asked, mm: what it meets higher the cutter's body meets, too.
const CORE_HEIGHT: f64 = 1.0;

/// The solids of the tool assembly that are swept.
pub(crate) struct Bodies {
    pub(crate) cutter: TurnedBody,
    /// With half the diagonal of a cell around it.
    cutter_in_rapid: TurnedBody,
    core: Option<TurnedBody>,
    /// Each body as it is and with its clearance, by its index among the scene's.
    sections: Vec<(usize, TurnedBody, TurnedBody)>,
    pub(crate) max_way: f64,
}

impl Bodies {
    pub(crate) fn new(tool: &ToolAssembly, slack: f64, cell: f64) -> Self {
        let cutter = tool.cutter();
        let mut widest = 0.0_f64;
        let mut sections = Vec::new();
        for (k, body) in tool.collision_bodies().into_iter().enumerate() {
            let Solid::Frustum(f) = body.solid else { continue };
            let frustum =
                |clearance: f64| TurnedBody::frustum([f.z_low, f.z_high], [f.radius_low, f.radius_high], clearance);
            // A section without length is none.
            let (Ok(plain), Ok(kept)) = (frustum(0.0), frustum((f.rounding - slack).max(0.0))) else { continue };
            widest = widest.max(if f.z_low <= cutter.flute_length() { f.radius_low.max(f.radius_high) } else { 0.0 });
            sections.push((k, plain, kept));
        }
        Self {
            cutter: TurnedBody::of_cutter(cutter),
            cutter_in_rapid: dilated(cutter, cell * std::f64::consts::FRAC_1_SQRT_2),
            core: core(tool),
            sections,
            max_way: (cutter.radius() - widest.max(tool.dead_core_radius())).clamp(WAYS[0], WAYS[1]),
        }
    }

    /// What is asked and cut on a segment, in order.
    pub(crate) fn steps(&self, m: &Move, segment: &Segment) -> Vec<(Purpose, Step<'_>)> {
        let sweep = |body| Sweep { body, from: segment.from, to: segment.to };
        let kept = self.sections.iter().map(|(k, _, kept)| (Purpose::Body(*k), Step::Ask(sweep(kept))));
        if m.is_rapid_of_tool() {
            return std::iter::once((Purpose::Rapid, Step::Ask(sweep(&self.cutter_in_rapid)))).chain(kept).collect();
        }
        let core = self.core.iter().map(|core| (Purpose::Core, Step::Ask(sweep(core))));
        let plain = self.sections.iter().map(|(k, plain, _)| (Purpose::Body(*k), Step::Ask(sweep(plain))));
        let cut = std::iter::once((Purpose::Cut, Step::Remove(sweep(&self.cutter))));
        core.chain(plain).chain(cut).chain(kept).collect()
    }
}

/// The part of the cutter's bottom that does not cut, from where its recess ends; `None` where the tool may plunge.
fn core(tool: &ToolAssembly) -> Option<TurnedBody> {
    let radius = tool.dead_core_radius();
    let recess = crate::dead_core::recess(tool);
    if radius <= 0.0 || !recess.is_finite() {
        return None;
    }
    TurnedBody::frustum([recess, recess + CORE_HEIGHT], [radius, radius], 0.0).ok()
}

/// Why a step is taken.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Cut,
    Probe,
    Around,
    Core,
    Rapid,
    Body(usize),
}

/// What is known of the run so far.
#[derive(Default)]
struct Out {
    episodes: Episodes,
    /// What each move took; lines are not told yet.
    taken: Vec<BlockCut>,
}

struct Run<'r, 'a> {
    scene: &'r Scene<'a>,
    bodies: &'r Bodies,
    probe: &'r Probe,
    coarse: Coarseness,
    stock: &'r mut DexelMap,
    engagement: Option<Engagement>,
    out: Out,
}

impl Run<'_, '_> {
    fn batch(&mut self, first: usize, moves: &[Move], monitor: &dyn Monitor) -> Result<(), VerifyError> {
        let of_moves: Result<Vec<Option<Vec<Segment>>>, Cancelled> = moves
            .par_iter()
            .map(|m| {
                monitor.checkpoint()?;
                Ok(if m.moves_tool { segments(self.scene, m, &self.coarse) } else { Some(Vec::new()) })
            })
            .collect();
        let of_moves = of_moves?;
        let bodies = self.bodies;
        let mut steps = Vec::new();
        let mut about = Vec::new();
        for (k, (m, segments)) in moves.iter().zip(&of_moves).enumerate() {
            self.out.taken.push(BlockCut {
                line: 0,
                removed_mm3: 0.0,
                way_mm: 0.0,
                is_certain: false,
                may_be_near: false,
            });
            let Some(segments) = segments else {
                self.out.taken[first + k].may_be_near = self.probe.is_asked(m);
                self.lost(first + k, m);
                continue;
            };
            for segment in segments {
                self.out.taken[first + k].way_mm += (segment.to.tip - segment.from.tip).norm();
                for (purpose, step) in self.probe.steps(m, segment) {
                    steps.push(step);
                    about.push((k, purpose, segment));
                }
                for (purpose, step) in bodies.steps(m, segment) {
                    steps.push(step);
                    about.push((k, purpose, segment));
                }
            }
        }
        let results = self.stock.run(&steps, self.coarse.tolerance);
        let results = results.map_err(|e| VerifyError::Sweep { problem: e.to_string() })?;
        for ((k, purpose, segment), result) in about.into_iter().zip(results) {
            self.take(first + k, &moves[k], purpose, segment, &result);
        }
        Ok(())
    }

    fn take(&mut self, index: usize, m: &Move, purpose: Purpose, segment: &Segment, result: &StepResult) {
        let stock = self.scene.obstacles.len();
        let key = match purpose {
            Purpose::Cut => {
                self.out.taken[index].removed_mm3 += result.volume;
                self.engage(index, m, segment, result.volume);
                return self.ramp(index, m, segment, result.volume);
            }
            Purpose::Probe => {
                let is_met = result.deepest.is_some_and(|d| d.depth > self.probe.depth);
                return self.out.taken[index].is_certain |= is_met;
            }
            Purpose::Around => return self.out.taken[index].may_be_near |= result.deepest.is_some(),
            Purpose::Core => Key::of_cutter(FindingKind::DeadCore, stock),
            Purpose::Rapid => {
                self.engagement.iter_mut().for_each(Engagement::lift);
                Key::of_cutter(FindingKind::RapidCollision, stock)
            }
            Purpose::Body(k) => Key::of_body(FindingKind::HolderCollision, k, stock),
        };
        // Sweeps are within the tolerance: what is less deep may be rounding of the ways.
        let Some(deepest) = result.deepest.filter(|d| d.depth > 2.0 * self.coarse.tolerance) else { return };
        let measure = Some(Measure::DepthMm(deepest.depth));
        let contact = Contact { key, measure, place: Some(deepest.place), ..contact(key, measure, segment) };
        self.out.episodes.record(index, contact);
    }

    /// A segment on which the cutter took more at a time than it may.
    fn engage(&mut self, index: usize, m: &Move, segment: &Segment, volume: f64) {
        let (Some(engagement), setup) = (&mut self.engagement, self.scene.setup) else { return };
        let time = duration(setup.machine, m, self.scene.tool_length).unwrap_or(0.0) * (segment.end - segment.start);
        let Segment { from, to, .. } = segment;
        let tip_way = (to.tip - from.tip).norm();
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        let way = tip_way + setup.tool.cutter().radius() * turn;
        if let Some(ratio) = engagement.cut(Part { way, tip_way, volume, time }) {
            let key = Key::of_cutter(FindingKind::OverEngagement, self.scene.obstacles.len());
            self.out.episodes.record(index, contact(key, Some(Measure::RemovalRatio(ratio)), segment));
        }
    }

    /// A segment on which the cutter took material going down too steeply.
    fn ramp(&mut self, index: usize, m: &Move, segment: &Segment, volume: f64) {
        let tool = self.scene.setup.tool;
        let descent = Descent::between(&segment.from, &segment.to, tool.cutter().radius());
        let limit = tool.max_ramp_angle() + self.scene.settings.ramp_slack;
        // The ends of a segment are on the motion itself.
        let rounding = RAMP_ROUNDING * (segment.end - segment.start);
        if volume <= 0.0 || m.is_rapid || !descent.is_steeper_than(limit, rounding) {
            return;
        }
        let key = Key::of_cutter(FindingKind::RampTooSteep, self.scene.obstacles.len());
        let measure = Some(Measure::AngleDeg(descent.angle().to_degrees()));
        self.out.episodes.record(index, contact(key, measure, segment));
    }

    /// A move whose way is not known: nothing is cut on it.
    fn lost(&mut self, index: usize, m: &Move) {
        let work_from_tool =
            self.scene.work_from_table * self.scene.setup.machine.forward(&m.end, self.scene.tool_length);
        let cl = crate::dead_core::cl_of(&work_from_tool);
        let key = Key::of_axis(FindingKind::ReachFailure, None);
        self.out.episodes.record(index, Contact { key, measure: None, place: None, axes: m.end, cl, at: 1.0 });
    }
}

/// What happens at the end of a segment.
fn contact(key: Key, measure: Option<Measure>, segment: &Segment) -> Contact {
    Contact { key, measure, place: None, axes: segment.axes, cl: segment.to, at: segment.end }
}
