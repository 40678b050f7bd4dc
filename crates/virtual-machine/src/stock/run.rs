//! The stock as the program cuts it, and what meets it.

use facemill_cl_data::{Cancelled, Monitor};
use facemill_nc_program::ReadProgram;
use facemill_z_map::{DexelMap, StepResult};
use rayon::prelude::*;

use super::heads;
use crate::finding::episodes::{Contact, Episodes, Key, worth_telling};
use crate::finding::{Finding, FindingKind, Measure};
use crate::motion::moves::{Move, ResolvedMoves, resolve};
use crate::motion::setup;
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::program_time::timing::duration;
use crate::run::edges::rapid_step;
use crate::run::ramp::{Descent, RAMP_ROUNDING};
use crate::run::report::Report;
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, MoveOfHead, Segment, segments_of_heads};
use crate::stock::bodies::{Bodies, Phase};
use crate::stock::engagement::{CutShare, Engagement};
use crate::stock::probe::Probe;
use crate::stock::retract::CutEnd;

/// Effect of a program on the stock.
#[derive(Clone, Debug, PartialEq)]
pub struct StockRun {
    /// Contacts with the current stock, in program order.
    pub findings: Vec<Finding>,
    /// Volume that was cut, mm³.
    pub removed_mm3: f64,
    /// Material that each block with a cutting move removed, in program order.
    pub blocks: Vec<BlockCut>,
}

/// Material that a block removed from the stock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockCut {
    /// Line of the program, from 1.
    pub line: u32,
    /// Volume, mm³.
    pub removed_mm3: f64,
    /// Way of the tip on the work, mm.
    pub way_mm: f64,
    /// Whether it cuts, whatever the tolerance does: a cutter smaller by twice the tolerance on all
    /// sides meets more than twice the tolerance of a line's material. Tested on
    /// [`VerifySettings::probed_lines`] alone, `false` elsewhere. A block that goes on by less than
    /// that, or between two lines, may cut without this flag.
    pub is_certain: bool,
    /// Whether it may come near stock, so that cuts between the lines are not seen: a cutter with
    /// the diagonal of a cell around it, and four times the tolerance, meets material of a line, or
    /// the way is not known. Tested on the same lines, `false` elsewhere. Stock that has no line at
    /// all, thinner than a cell, is not seen by this either.
    pub may_be_near: bool,
}

/// Cuts the stock as a program that was read from NC text does, and reports what met it that may
/// not: bodies of the tool assembly, the cutter in rapid, the core of the cutter that does not cut,
/// and the cutter going down more steeply than it may.
///
/// The tool's motion is that of the machine's law, taken as straight ways with an evenly turning
/// axis; at no time is a point of the tool farther than `tolerance` (mm) from where it is then, and
/// the solids that are swept are within the same tolerance of those that these ways sweep. So what
/// is cut is within twice the tolerance of the truth, on every line of the map.
///
/// - A body is tested as it is before its segment is cut: what it meets then is a collision. With
///   its clearance, less [`VerifySettings::clearance_slack`], it is tested after the flute has
///   passed; what it meets then alone is nearer than its clearance, and has no depth.
/// - In rapids the cutter is tested, with half the diagonal of a cell around it: no rapid through a
///   cell's material is missed. Where the cutter itself, smaller by twice the tolerance, does not
///   meet the line, that has no depth: it may be along its own wall. Back along the axis from where
///   a cut has ended, beside lines that the flute has been as near to, it is a near miss.
/// - What is no deeper than twice the tolerance is no finding: so far the ways may be off.
/// - Bodies are found wherever they meet the material of a line.
/// - Faults of the text, and motions that are not simulated, are `verify`'s to tell: nothing is cut
///   on them.
/// - Bodies of the machine are not tested:
///   [`remaining_collisions`](crate::stock::unresolved_findings::remaining_collisions) tells what
///   of their findings against the stock as it was before cutting may hold against what is left.
///
/// With [`VerifySettings::estimate`] the cuts stay the same, but bodies and the cutter in rapid are
/// tested at positions alone: where the segments of cuts end, and on rapids a radius of the cutter
/// apart.
///
/// The stock is changed in place, and is the rest when this returns without an error; with an error
/// it is of no use. The result does not depend on the number of threads; `monitor` advances by
/// every block with a motion.
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
    let [run] = run_stock_of_heads(program, [(setup, settings)], stock, tolerance, monitor)?;
    Ok(run)
}

/// The same for several heads of one machine that cut one stock at the same time, each with a setup
/// and settings of its own; a run for each, in their order.
///
/// The heads' ways are divided at the same times. In each part the bodies and cores of all heads
/// are tested first, as they are, then all flutes cut, then bodies are tested with their clearance.
/// So a contact of a body or a core is a collision unless a flute, its own or another head's, has
/// removed the material in an earlier part: material that another one removes in the same part, or
/// later, still counts.
///
/// - Where flutes overlap in one part, the volume is that of the first head in the order that cuts
///   there.
/// - A block certainly cuts ([`BlockCut::is_certain`]) by what is there before any of the heads has
///   cut in that part.
/// - A head at rest, with its table at rest, is not tested: it is where it was tested last.
/// - Where the way of one head is not known, which is a finding, the others are run as if it were
///   at rest.
///
/// # Errors
/// As [`run_stock`]; and when the setups are not those of different heads of one machine with one
/// mounting, or when the text is not the same motions for all of them.
pub fn run_stock_of_heads<const N: usize>(
    program: &ReadProgram,
    heads: [(&VirtualSetup<'_>, &VerifySettings); N],
    stock: &mut DexelMap,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<[StockRun; N], VerifyError> {
    for (setup, settings) in heads {
        setup::check(setup, settings)?;
    }
    heads::check_setups(&heads.map(|(setup, _)| setup))?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(VerifyError::Setting { field: "tolerance", value: tolerance, needed: "above 0" });
    }
    let resolved = heads.map(|(setup, settings)| resolve(program, setup, settings));
    heads::check_moves(program, &resolved)?;
    let accuracy = [tolerance, stock.grid().cell()];
    let views: Result<Vec<View<'_>>, VerifyError> =
        heads.iter().map(|(setup, settings)| View::new(program, setup, settings, accuracy)).collect();
    let views = views?;
    let mut run = CutRun { heads: views.iter().map(Head::new).collect(), stock, tolerance };
    let n_moves = resolved.iter().map(|r| r.moves.len()).max().unwrap_or(0);
    for first in (0..n_moves).step_by(MOVES_PER_BATCH) {
        let batch = first..n_moves.min(first + MOVES_PER_BATCH);
        let moves = resolved.each_ref().map(|r| &r.moves[batch.clone()]);
        run.batch(first, &moves, monitor)?;
        monitor.advance(moves[0].chunk_by(|a, b| a.block == b.block).count());
    }
    Ok(std::array::from_fn(|h| run.heads[h].report(program, &resolved[h])))
}

/// Moves whose segments are made before the stock is cut by them: bounds the memory.
const MOVES_PER_BATCH: usize = 512;

/// Why a step is taken.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Cut,
    Probe,
    Around,
    Core,
    Rapid,
    NearRapid,
    Body(usize),
    Kept(usize),
}

/// Results of the run so far.
#[derive(Default)]
struct Out {
    episodes: Episodes,
    /// Material that each move removed; without lines yet.
    taken: Vec<BlockCut>,
}

/// Queries of one head.
struct View<'a> {
    scene: RunScene<'a>,
    bodies: Bodies,
    probe: Probe,
    coarse: Coarseness,
    /// Of rapids: coarser in an estimate.
    coarse_in_rapid: Coarseness,
    /// Distance of the stock's lines, mm.
    cell: f64,
}

impl<'a> View<'a> {
    fn new(
        program: &ReadProgram,
        setup: &'a VirtualSetup<'a>,
        settings: &'a VerifySettings,
        [tolerance, cell]: [f64; 2],
    ) -> Result<Self, VerifyError> {
        let bodies = Bodies::new(setup.tool, settings.clearance_slack, [tolerance, cell]);
        let coarse = Coarseness { tolerance, reach: setup.tool.gauge_length(), max_way: bodies.max_way };
        let probe = Probe::new(program, settings, setup.tool.cutter(), [tolerance, cell]);
        let scene = RunScene::new(setup, settings)?;
        if settings.estimate.is_none() {
            return Ok(Self { scene, bodies, probe, coarse, coarse_in_rapid: coarse, cell });
        }
        let step = rapid_step(&scene);
        // Queries at positions alone are exact there: the path between them may be any.
        let coarse_in_rapid = Coarseness { tolerance: step, max_way: step, ..coarse };
        Ok(Self { scene, bodies: bodies.at_ends(), probe, coarse, coarse_in_rapid, cell })
    }

    fn of_move<'r>(&'r self, m: &'r Move) -> MoveOfHead<'r, 'a> {
        let coarse = if m.is_rapid { &self.coarse_in_rapid } else { &self.coarse };
        MoveOfHead { scene: &self.scene, m, coarse }
    }
}

/// One head, and what is known of it so far.
struct Head<'r, 'a> {
    view: &'r View<'a>,
    engagement: Option<Engagement>,
    /// Where the last cut ended; `None` before the first.
    cut_end: Option<CutEnd>,
    out: Out,
}

struct CutRun<'r, 'a> {
    heads: Vec<Head<'r, 'a>>,
    stock: &'r mut DexelMap,
    tolerance: f64,
}

impl CutRun<'_, '_> {
    /// Cuts by the same moves of each head.
    fn batch(&mut self, first: usize, moves: &[&[Move]], monitor: &dyn Monitor) -> Result<(), VerifyError> {
        let ways = self.ways(moves, monitor)?;
        let views: Vec<&View<'_>> = self.heads.iter().map(|head| head.view).collect();
        let mut steps = Vec::new();
        let mut about = Vec::new();
        for (k, of_heads) in ways.iter().enumerate() {
            for (h, segments) in of_heads.iter().enumerate() {
                self.heads[h].begin(first + k, &moves[h][k], segments.as_deref());
            }
            let parts = of_heads.iter().flatten().map(Vec::len).max().unwrap_or(0);
            for (part, phase) in (0..parts).flat_map(|part| Phase::ALL.map(|phase| (part, phase))) {
                for (h, view) in views.iter().enumerate() {
                    let Some(segment) = of_heads[h].as_ref().and_then(|segments| segments.get(part)) else { continue };
                    let m = &moves[h][k];
                    let probes = (phase == Phase::Before).then(|| view.probe.steps(m, segment));
                    for (purpose, step) in probes.into_iter().flatten().chain(view.bodies.steps_in(phase, m, segment)) {
                        steps.push(step);
                        about.push((h, k, purpose, segment));
                    }
                }
            }
        }
        let results = self.stock.run(&steps, self.tolerance);
        let results = results.map_err(|e| VerifyError::Sweep { problem: e.to_string() })?;
        for ((h, k, purpose, segment), result) in about.into_iter().zip(results) {
            self.heads[h].take(first + k, &moves[h][k], purpose, segment, &result);
        }
        Ok(())
    }

    /// The segments of each head on each move.
    fn ways(&self, moves: &[&[Move]], monitor: &dyn Monitor) -> Result<Vec<Vec<Option<Vec<Segment>>>>, Cancelled> {
        let views: Vec<&View<'_>> = self.heads.iter().map(|head| head.view).collect();
        let of_move = |k: usize| {
            monitor.checkpoint()?;
            let of_heads: Vec<_> = views.iter().zip(moves).map(|(view, moves)| view.of_move(&moves[k])).collect();
            Ok(segments_of_heads(&of_heads))
        };
        (0..moves[0].len()).into_par_iter().map(of_move).collect()
    }
}

impl<'r, 'a> Head<'r, 'a> {
    fn new(view: &'r View<'a>) -> Self {
        let RunScene { setup, settings, .. } = view.scene;
        let (limit, radius) = (settings.removal, setup.tool.cutter().radius());
        let engagement = limit.map(|limit| Engagement::new(limit, settings.removal_slack, radius, view.cell));
        Self { view, engagement, cut_end: None, out: Out::default() }
    }

    /// Begins a move; without segments its way is not known.
    fn begin(&mut self, index: usize, m: &Move, segments: Option<&[Segment]>) {
        let way_mm = segments.into_iter().flatten().fold(0.0, |way, s| way + (s.to.tip - s.from.tip).norm());
        let may_be_near = segments.is_none() && self.view.probe.is_probed(m);
        self.out.taken.push(BlockCut { line: 0, removed_mm3: 0.0, way_mm, is_certain: false, may_be_near });
        if segments.is_none() {
            self.lost(index, m);
        }
    }

    /// Returns the material that this head removed, and its contacts.
    fn report(&self, program: &ReadProgram, resolved: &ResolvedMoves) -> StockRun {
        let report = Report::new(program, &self.view.scene, resolved);
        let cuts = resolved.moves.iter().zip(&self.out.taken).filter(|(m, _)| !m.is_rapid);
        let blocks: Vec<BlockCut> =
            cuts.map(|(m, taken)| BlockCut { line: program.blocks[m.block].line, ..*taken }).collect();
        let reported = worth_telling(&self.out.episodes.all);
        let mut findings: Vec<Finding> = reported.map(|e| report.finding(e)).collect();
        findings.sort_by_key(|f| (f.first_line, f.kind));
        StockRun { findings, removed_mm3: blocks.iter().fold(0.0, |all, b| all + b.removed_mm3), blocks }
    }

    fn take(&mut self, index: usize, m: &Move, purpose: Purpose, segment: &Segment, result: &StepResult) {
        let stock = self.view.scene.obstacles.len();
        let key = match purpose {
            Purpose::Cut => {
                self.out.taken[index].removed_mm3 += result.volume;
                let cutter = self.view.scene.setup.tool.cutter();
                self.cut_end = Some(CutEnd::new(segment.to, cutter.flute_length(), self.view.coarse.tolerance));
                self.engage(index, m, segment, result.volume);
                return self.ramp(index, m, segment, result.volume);
            }
            Purpose::Probe => {
                let is_met = result.deepest.is_some_and(|d| d.depth > self.view.probe.depth);
                return self.out.taken[index].is_certain |= is_met;
            }
            Purpose::Around => return self.out.taken[index].may_be_near |= result.deepest.is_some(),
            Purpose::Core => Key::of_cutter(FindingKind::DeadCore, stock),
            Purpose::Rapid => Key::of_cutter(FindingKind::RapidCollision, stock),
            Purpose::NearRapid => {
                self.engagement.iter_mut().for_each(Engagement::lift);
                let place = result.deepest.map(|d| d.place);
                let is_own = self.cut_end.zip(place).is_some_and(|(end, place)| end.has_been_beside(segment, &place));
                let kind = if is_own { FindingKind::NearMiss } else { FindingKind::RapidCollision };
                Key::of_cutter(kind, stock).without_contact()
            }
            Purpose::Body(k) => Key::of_body(FindingKind::HolderCollision, k, stock),
            Purpose::Kept(k) => Key::of_body(FindingKind::HolderCollision, k, stock).without_contact(),
        };
        // Sweeps are within the tolerance: what is less deep may be rounding of the ways. The
        // cutter in rapid is smaller by it.
        let least = if matches!(purpose, Purpose::Rapid) { 0.0 } else { 2.0 * self.view.coarse.tolerance };
        let Some(deepest) = result.deepest.filter(|d| d.depth > least) else { return };
        // The way through what is around a body is not how near it is.
        let measure = key.is_contact.then_some(Measure::DepthMm(deepest.depth));
        let contact = Contact { key, measure, place: Some(deepest.place), ..contact(key, measure, segment) };
        self.out.episodes.record(index, contact);
    }

    /// A segment on which the cutter took more at a time than it may.
    fn engage(&mut self, index: usize, m: &Move, segment: &Segment, volume: f64) {
        let (Some(engagement), setup) = (&mut self.engagement, self.view.scene.setup) else { return };
        let time =
            duration(setup.machine, m, self.view.scene.tool_length).unwrap_or(0.0) * (segment.end - segment.start);
        let Segment { from, to, .. } = segment;
        let tip_way = (to.tip - from.tip).norm();
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        let way = tip_way + setup.tool.cutter().radius() * turn;
        if let Some(ratio) = engagement.cut(CutShare { way, tip_way, volume, time }) {
            let key = Key::of_cutter(FindingKind::OverEngagement, self.view.scene.obstacles.len());
            self.out.episodes.record(index, contact(key, Some(Measure::RemovalRatio(ratio)), segment));
        }
    }

    /// A segment on which the cutter took material going down too steeply.
    fn ramp(&mut self, index: usize, m: &Move, segment: &Segment, volume: f64) {
        let tool = self.view.scene.setup.tool;
        let descent = Descent::between(&segment.from, &segment.to, tool.cutter().radius());
        let limit = tool.max_ramp_angle() + self.view.scene.settings.ramp_slack;
        // The ends of a segment are on the motion itself.
        let rounding = RAMP_ROUNDING * (segment.end - segment.start);
        if volume <= 0.0 || m.is_rapid || !descent.is_steeper_than(limit, rounding) {
            return;
        }
        let key = Key::of_cutter(FindingKind::RampTooSteep, self.view.scene.obstacles.len());
        let measure = Some(Measure::AngleDeg(descent.angle().to_degrees()));
        self.out.episodes.record(index, contact(key, measure, segment));
    }

    /// A move whose way is not known: nothing is cut on it.
    fn lost(&mut self, index: usize, m: &Move) {
        let work_from_tool = self.view.scene.work_from_table
            * self.view.scene.setup.machine.forward(&m.end, self.view.scene.tool_length);
        let cl = crate::run::scene::cl_of(&work_from_tool);
        let key = Key::of_axis(FindingKind::ReachFailure, None);
        self.out.episodes.record(index, Contact { key, measure: None, place: None, axes: m.end, cl, at: 1.0 });
    }
}

/// Returns the contact at the end of a segment.
fn contact(key: Key, measure: Option<Measure>, segment: &Segment) -> Contact {
    Contact { key, measure, place: None, axes: segment.axes, cl: segment.to, at: segment.end }
}
