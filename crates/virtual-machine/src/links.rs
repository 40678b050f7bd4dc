//! The links of a program, from one run of cuts to the next at rapid rate, and whether another way
//! there is free.

use std::ops::Range;

use facemill_cl_data::{Cancelled, ClPoint, Monitor};
use facemill_inverse_kinematics::{AxisValues, BlockLaw};
use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolSection;
use facemill_z_map::{DexelMap, RoundRing, Step, Sweep, TurnedBody};
use rayon::prelude::*;

use crate::motion::moves::{Move, ResolvedMoves, resolve};
use crate::motion::setup;
use crate::motion::setup::{HeldAsCut, ObstacleKind, VerifyError, VerifySettings, VirtualSetup};
use crate::proof::doubts::Doubts;
use crate::proof::prover::Prover;
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, Segment, segments};
use crate::stock::bodies::Bodies;
use crate::stock::heads::{check_moves, check_setups};

/// All rapids between two cutting moves.
#[derive(Clone, Debug)]
pub struct ProgramLink {
    /// Indices of its blocks with a motion, in order; one may stand there more than once.
    pub blocks: Vec<usize>,
    /// Axis values at its start.
    pub start: AxisValues,
    /// Axis values at the ends of its motions, in order.
    pub ends: Vec<AxisValues>,
    /// Motion law of its first motion.
    pub law: BlockLaw,
    /// Why another way must not take its place.
    pub hold: Option<LinkHold>,
    section: usize,
    /// Index of its first motion among all.
    first: usize,
}

/// Why a link stays as it is.
///
/// Exhaustive, so that a new one is handled everywhere: a link must not be moved for want of a
/// reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkHold {
    /// Nothing is cut before it: it is the way to the part.
    WayIn,
    /// Nothing is cut behind it: it is the way home.
    WayOut,
    /// Its motions have different laws.
    Laws,
    /// A fault of the text leaves open where the axes are.
    Doubt {
        /// Line of the fault.
        line: u32,
        /// The fault.
        what: String,
    },
}

/// How free a way has to be of the stock as it is then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkSettings {
    /// Distance that the tool keeps from stock and fixtures on the way, mm. Cuts end near the
    /// stock: from there a third of it is kept from where the tool has gone twice as far as it, two
    /// thirds from four times and all of it from six times as far; the same toward the end.
    pub clearance: f64,
    /// As in [`run_stock`](crate::stock::run::run_stock), mm.
    pub tolerance: f64,
}

impl ProgramLink {
    /// Returns a link of one law from a position through others, at rapid rate, that is not in a
    /// program yet.
    pub fn outside_programs(start: AxisValues, ends: Vec<AxisValues>, law: BlockLaw) -> Self {
        Self { blocks: Vec::new(), start, ends, law, hold: None, section: 0, first: 0 }
    }
}

/// Distances that the whole tool is proven to keep, at every time of the motion, whatever has been
/// cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkDistances {
    /// From fixtures, mm.
    pub fixtures: f64,
    /// From part, check surfaces and the stock as it was before anything was cut, mm.
    pub first_stock: f64,
}

/// State of a program at the start of a link: all that is in the way.
pub struct LinkStage<'s, 'a> {
    /// One for each head.
    scenes: &'s [RunScene<'a>],
    /// The stock as it is then; `None` where ways keep off the stock as it was at first.
    cut: Option<CutStock<'s>>,
}

/// Stock as it is at the start of a link, and the tools that are tested against it.
struct CutStock<'s> {
    /// One for each head.
    tools: &'s [LinkTool],
    clearance: f64,
    stock: &'s DexelMap,
}

/// Tool of a head on links.
struct LinkTool {
    bodies: Bodies,
    /// The cutter and each body of the tool with a third, two thirds and all of the clearance.
    kept: [Vec<TurnedBody>; 3],
    /// Segments of cuts.
    coarse: Coarseness,
}

impl LinkTool {
    fn new(setup: &VirtualSetup<'_>, slack: f64, link: &LinkSettings, cell: f64) -> Self {
        let bodies = Bodies::new(setup.tool, slack, [link.tolerance, cell]);
        let kept = [1.0, 2.0, 3.0].map(|thirds| kept_bodies(setup, link.clearance * thirds / 3.0, cell));
        let reach = setup.tool.gauge_length();
        let coarse = Coarseness { tolerance: link.tolerance, reach, max_way: bodies.max_way };
        Self { bodies, kept, coarse }
    }

    /// Returns the segments of links. Nothing is cut on them, so that no body has to be tested
    /// before what the cutter takes beside it is gone.
    fn on_links(&self) -> Coarseness {
        Coarseness { max_way: f64::INFINITY, ..self.coarse }
    }
}

/// Runs a program and shows every link with the stock as it is there. The stock is cut as
/// [`run_stock`](crate::stock::run::run_stock) does, by all heads, and is the rest when this
/// returns without an error.
///
/// `heads` has the setup of each head of the machine. On a link the tool of every head is tested
/// against the stock, over the motion of all axes. A link that may not change for one head is held.
///
/// # Errors
/// When a setup or a setting makes no sense, the setups are not those of the heads of one machine,
/// or the monitor, which advances by every block with a motion, cancels.
pub fn run_links(
    program: &ReadProgram,
    heads: &[&VirtualSetup<'_>],
    settings: (&VerifySettings, &LinkSettings),
    stock: &mut DexelMap,
    visit: &mut dyn FnMut(&ProgramLink, &LinkStage<'_, '_>),
    monitor: &dyn Monitor,
) -> Result<(), VerifyError> {
    let (verify, link) = settings;
    for head in heads {
        check(head, verify, &[("clearance", link.clearance)])?;
    }
    check_setups(heads)?;
    if !(link.tolerance > 0.0 && link.tolerance.is_finite()) {
        return Err(VerifyError::Setting { field: "tolerance", value: link.tolerance, needed: "above 0" });
    }
    let verify = &VerifySettings { as_cut: HeldAsCut::TOOL, ..verify.clone() };
    let wide: Vec<VirtualSetup<'_>> = heads.iter().map(|head| wider(head, link.clearance, 0.0)).collect();
    let scenes: Vec<RunScene<'_>> = wide.iter().map(|wide| RunScene::new(wide, verify)).collect::<Result<_, _>>()?;
    let resolved: Vec<ResolvedMoves> = heads.iter().map(|head| resolve(program, head, verify)).collect();
    check_moves(program, &resolved)?;
    let doubts: Vec<Doubts> = resolved.iter().map(|r| Doubts::new(program, &r.faults)).collect();
    let Some(ResolvedMoves { moves, .. }) = resolved.first() else { return Ok(()) };
    let links = links(program, moves, &doubts);
    let cell = stock.grid().cell();
    let tools: Vec<LinkTool> =
        heads.iter().map(|head| LinkTool::new(head, verify.clearance_slack, link, cell)).collect();
    let cutting: Vec<CuttingHead<'_>> = (0..heads.len())
        .map(|h| CuttingHead { scene: &scenes[h], tool: &tools[h], moves: &resolved[h].moves })
        .collect();
    let mut done = 0;
    for found in &links {
        cut(&cutting, done..found.first, stock, monitor)?;
        done = found.first + found.ends.len();
        monitor.advance(count_blocks(&moves[found.first..done]));
        monitor.checkpoint()?;
        let now = CutStock { tools: &tools, clearance: link.clearance, stock: &*stock };
        visit(found, &LinkStage { scenes: &scenes, cut: Some(now) });
    }
    cut(&cutting, done..moves.len(), stock, monitor)
}

/// Looks at every link of a program by itself, in parallel, off the stock as it was before anything
/// was cut: what is proven to keep off that keeps off what is left of it. Returns what is found of
/// each, in program order.
///
/// `heads` has the setup of each head of the machine. Tool and bodies of each head are tested over
/// the motion of all axes, and so against the other head as it moves at that time. A link that may
/// not change for one head is held.
///
/// # Errors
/// When a setup or a setting makes no sense, or the monitor, which advances by every block with a
/// motion, cancels.
pub fn links_off_first_stock<T: Send>(
    program: &ReadProgram,
    heads: &[&VirtualSetup<'_>],
    (verify, keep): (&VerifySettings, LinkDistances),
    look: &(dyn Fn(&ProgramLink, &LinkStage<'_, '_>) -> T + Sync),
    monitor: &dyn Monitor,
) -> Result<Vec<T>, VerifyError> {
    let settings = &VerifySettings { as_cut: HeldAsCut::NOTHING, ..verify.clone() };
    let look_at = |stage: &LinkStage<'_, '_>| look_at_links(program, (settings, stage), look, monitor);
    Ok(with_first_stock(heads, (verify, keep), look_at)??)
}

/// Runs `of` with all that is in the way of links that keep off the stock as it was before anything
/// was cut, without a program.
///
/// # Errors
/// When a setup or a setting makes no sense.
pub fn with_first_stock<T>(
    heads: &[&VirtualSetup<'_>],
    (verify, keep): (&VerifySettings, LinkDistances),
    of: impl FnOnce(&LinkStage<'_, '_>) -> T,
) -> Result<T, VerifyError> {
    for head in heads {
        check(head, verify, &[("fixtures", keep.fixtures), ("first_stock", keep.first_stock)])?;
    }
    let verify = &VerifySettings { as_cut: HeldAsCut::NOTHING, ..verify.clone() };
    let wide: Vec<VirtualSetup<'_>> = heads.iter().map(|head| wider(head, keep.fixtures, keep.first_stock)).collect();
    let scenes: Vec<RunScene<'_>> = wide.iter().map(|wide| RunScene::new(wide, verify)).collect::<Result<_, _>>()?;
    Ok(of(&LinkStage { scenes: &scenes, cut: None }))
}

/// Looks at every link of a program by itself, in parallel.
///
/// # Errors
/// When the monitor cancels.
fn look_at_links<T: Send>(
    program: &ReadProgram,
    (verify, stage): (&VerifySettings, &LinkStage<'_, '_>),
    look: &(dyn Fn(&ProgramLink, &LinkStage<'_, '_>) -> T + Sync),
    monitor: &dyn Monitor,
) -> Result<Vec<T>, Cancelled> {
    // All heads have the same words, so the motions of all axes are the same.
    let resolved: Vec<ResolvedMoves> = stage.scenes.iter().map(|scene| resolve(program, scene.setup, verify)).collect();
    let doubts: Vec<Doubts> = resolved.iter().map(|r| Doubts::new(program, &r.faults)).collect();
    let Some(resolved) = resolved.into_iter().next() else { return Ok(Vec::new()) };
    let links = links(program, &resolved.moves, &doubts);
    let on_links: usize = links.iter().map(|l| count_blocks(&resolved.moves[l.first..l.first + l.ends.len()])).sum();
    monitor.advance(count_blocks(&resolved.moves).saturating_sub(on_links));
    links
        .par_iter()
        .map(|link| {
            monitor.checkpoint()?;
            let found = look(link, stage);
            monitor.advance(count_blocks(&resolved.moves[link.first..link.first + link.ends.len()]));
            Ok(found)
        })
        .collect()
}

fn check(
    setup: &VirtualSetup<'_>,
    verify: &VerifySettings,
    lengths: &[(&'static str, f64)],
) -> Result<(), VerifyError> {
    setup::check(setup, verify)?;
    match lengths.iter().find(|(_, value)| !(*value >= 0.0 && value.is_finite())) {
        Some(&(field, value)) => Err(VerifyError::Setting { field, value, needed: "at least 0" }),
        None => Ok(()),
    }
}

/// The setup with fixtures, and all else, thicker by these distances.
fn wider<'a>(setup: &VirtualSetup<'a>, fixtures: f64, others: f64) -> VirtualSetup<'a> {
    let mut wide = setup.clone();
    for o in &mut wide.obstacles {
        if o.kind == ObstacleKind::Fixture {
            o.allowance += fixtures;
            o.stock += fixtures;
        } else {
            o.stock += others;
        }
    }
    wide
}

/// The cutter and the tool's bodies with the clearance, or their own where that is more, and half
/// the diagonal of a cell.
fn kept_bodies(setup: &VirtualSetup<'_>, clearance: f64, cell: f64) -> Vec<TurnedBody> {
    let around = cell * std::f64::consts::FRAC_1_SQRT_2;
    let cutter = setup.tool.cutter();
    let (r, rim) = (cutter.corner_radius(), cutter.rim_radius());
    let rings = [
        RoundRing { radius: rim, height: r, rounding: r + clearance + around },
        RoundRing { radius: cutter.radius(), height: cutter.flute_length(), rounding: clearance + around },
    ];
    let mut kept: Vec<TurnedBody> = TurnedBody::new(&rings).into_iter().collect();
    for ToolSection { frustum: f, .. } in setup.tool.sections() {
        let rounding = f.rounding.max(clearance) + around;
        // A section without length is none.
        kept.extend(TurnedBody::frustum([f.z_low, f.z_high], [f.radius_low, f.radius_high], rounding));
    }
    kept
}

/// Moves of which the stock is cut in one go.
const MOVES_PER_BATCH: usize = 512;

/// Head that cuts the stock.
struct CuttingHead<'s> {
    scene: &'s RunScene<'s>,
    tool: &'s LinkTool,
    /// All moves of the program, the same of every head.
    moves: &'s [Move],
}

/// Cuts the stock as all heads do in these moves.
fn cut(
    heads: &[CuttingHead<'_>],
    moves: Range<usize>,
    stock: &mut DexelMap,
    monitor: &dyn Monitor,
) -> Result<(), VerifyError> {
    for first in moves.clone().step_by(MOVES_PER_BATCH) {
        monitor.checkpoint()?;
        let batch = first..moves.end.min(first + MOVES_PER_BATCH);
        for CuttingHead { scene, tool, moves } in heads {
            let cutting = moves[batch.clone()].iter().filter(|m| !m.is_rapid && m.moves_tool);
            // A move without a known path takes nothing, as in the run of the stock.
            let ways: Vec<Segment> = cutting.filter_map(|m| segments(scene, m, &tool.coarse)).flatten().collect();
            let sweeps: Vec<Sweep<'_>> =
                ways.iter().map(|s| Sweep { body: &tool.bodies.cutter, from: s.from, to: s.to }).collect();
            let removed = stock.remove_all(&sweeps, tool.coarse.tolerance);
            removed.map_err(|e| VerifyError::Sweep { problem: e.to_string() })?;
        }
        monitor.advance(heads.first().map_or(0, |head| count_blocks(&head.moves[batch])));
    }
    Ok(())
}

fn count_blocks(moves: &[Move]) -> usize {
    moves.chunk_by(|a, b| a.block == b.block).count()
}

/// All runs of rapids, in order.
fn links(program: &ReadProgram, moves: &[Move], doubts: &[Doubts]) -> Vec<ProgramLink> {
    let mut links = Vec::new();
    let mut first = 0;
    for run in moves.chunk_by(|a, b| a.is_rapid == b.is_rapid) {
        if run[0].is_rapid {
            let is_last = first + run.len() == moves.len();
            links.push(link(program, run, first, is_last, doubts));
        }
        first += run.len();
    }
    links
}

/// `doubts` has those of each head. With several heads, one tool may rest while another moves.
fn link(program: &ReadProgram, run: &[Move], first: usize, is_last: bool, doubts: &[Doubts]) -> ProgramLink {
    let doubt_of = |m: &Move| doubts.iter().find_map(|d| d.of_line(program.blocks[m.block].line));
    let doubt = run.iter().find_map(doubt_of);
    let is_one_head = doubts.len() == 1;
    let hold = if first == 0 {
        Some(LinkHold::WayIn)
    } else if is_last {
        Some(LinkHold::WayOut)
    } else if let Some(doubt) = doubt {
        Some(LinkHold::Doubt { line: doubt.line, what: doubt.what.clone() })
    } else {
        run.iter().any(|m| m.law != run[0].law || is_one_head && !m.moves_tool).then_some(LinkHold::Laws)
    };
    ProgramLink {
        blocks: run.iter().map(|m| m.block).collect(),
        start: run[0].start,
        ends: run.iter().map(|m| m.end).collect(),
        law: run[0].law,
        hold,
        section: run[0].section,
        first,
    }
}

impl LinkStage<'_, '_> {
    /// Returns whether the tools of all heads can go from the start of a link through these axis
    /// values, at rapid rate and under the link's law.
    ///
    /// Axes stay within their limits. Distances from part, fixtures, machine and the other head, as
    /// it moves at that time, are proven for every time of the motion and the deviation of the
    /// control, as in certificates of rapids; also those from the initial stock, if paths avoid it.
    /// Otherwise the motion is tested against the current stock as
    /// [`run_stock`](crate::stock::run::run_stock) tests rapids, with the clearance of the
    /// settings.
    pub fn is_free(&self, link: &ProgramLink, through: &[AxisValues]) -> bool {
        let is_beyond = |scene: &RunScene<'_>| {
            let machine = scene.setup.machine;
            through.iter().any(|axes| machine.first_beyond_limit(axes).is_some())
        };
        if self.scenes.iter().any(is_beyond) {
            return false;
        }
        let moves = moves(link, through);
        let is_clear_of = |cut: &CutStock<'_>| {
            self.scenes.iter().zip(cut.tools).all(|(scene, tool)| cut.is_clear(scene, tool, &moves))
        };
        let is_clear_of_cut = self.cut.as_ref().is_none_or(is_clear_of);
        is_clear_of_cut && moves.iter().all(|m| self.scenes.iter().all(|scene| is_proven(scene, m)))
    }
}

fn is_proven(scene: &RunScene<'_>, m: &Move) -> bool {
    Prover::new(scene, m).is_some_and(|mut prover| prover.is_proven())
}

impl CutStock<'_> {
    /// Returns whether the tool of a head keeps its distances from the stock over these moves.
    fn is_clear(&self, scene: &RunScene<'_>, tool: &LinkTool, moves: &[Move]) -> bool {
        let (coarse, mut way) = (tool.on_links(), Vec::new());
        for m in moves {
            let Some(segments) = segments(scene, m, &coarse) else { return false };
            way.extend(segments.into_iter().map(|s| (m, s)));
        }
        let (parts, is_kept) = self.with_clearance(tool, way.iter().map(|(_, s)| s));
        let clears = |sweep: &Sweep<'_>, depth: f64| self.clears(sweep, (depth, coarse.tolerance));
        let is_plainly_clear = |(m, s): &(&Move, Segment)| {
            let steps = tool.bodies.steps(m, s);
            steps.iter().all(|(_, step)| {
                let (Step::Ask(sweep) | Step::Remove(sweep)) = step;
                clears(sweep, 2.0 * coarse.tolerance)
            })
        };
        let is_kept_clear = |(level, [from, to]): &(usize, [ClPoint; 2])| {
            tool.kept[*level].iter().all(|body| clears(&Sweep { body, from: *from, to: *to }, 0.0))
        };
        // A body that keeps its clearance from the stock is clear of it.
        let plain = way.par_iter().zip(&is_kept).filter(|(_, is_kept)| !**is_kept);
        parts.par_iter().all(is_kept_clear) && plain.all(|(s, _)| is_plainly_clear(s))
    }

    /// Whether a sweep meets no material deeper than this, within this tolerance.
    fn clears(&self, sweep: &Sweep<'_>, (depth, tolerance): (f64, f64)) -> bool {
        let found = self.stock.meets(sweep, tolerance);
        found.is_ok_and(|contact| contact.is_none_or(|c| c.depth <= depth))
    }

    /// The parts of a way on which thirds of the clearance are kept, with the index of how much;
    /// and which of its segments consist of nothing else. Way is that of the tip and, with the turn
    /// of the axis, of the tool's farthest point.
    fn with_clearance<'s>(&self, tool: &LinkTool, way: impl Iterator<Item = &'s Segment> + Clone) -> WithClearance {
        let length = |s: &Segment| {
            let turn = s.from.axis.cross(&s.to.axis).norm().atan2(s.from.axis.dot(&s.to.axis));
            (s.to.tip - s.from.tip).norm() + tool.coarse.reach * turn
        };
        let all: f64 = way.clone().map(length).sum();
        let steps = [2.0, 4.0, 6.0].map(|times| times * self.clearance);
        let breaks = steps.into_iter().chain(steps.into_iter().map(|step| all - step));
        let mut gone = 0.0;
        let (mut parts, mut is_kept) = (Vec::new(), Vec::new());
        for s in way {
            let here = length(s);
            let mut is_whole = true;
            let mut shares: Vec<f64> = breaks.clone().map(|at| (at - gone) / here).chain([0.0, 1.0]).collect();
            shares.retain(|share| (0.0..=1.0).contains(share));
            shares.sort_by(f64::total_cmp);
            for part in shares.windows(2).filter(|part| part[0] < part[1]) {
                let middle = gone + here * 0.5 * (part[0] + part[1]);
                let from_end = middle.min(all - middle);
                let Some(level) = steps.iter().rposition(|step| *step <= from_end) else {
                    is_whole = false;
                    continue;
                };
                let sweep = Sweep { body: &tool.bodies.cutter, from: s.from, to: s.to };
                parts.push((level, [sweep.at(part[0]), sweep.at(part[1])]));
            }
            gone += here;
            // A link without motion has no parts.
            is_kept.push(is_whole && here > 0.0);
        }
        (parts, is_kept)
    }
}

/// Parts of a way with the index of the clearance that is kept on them, and for each segment
/// whether it is kept on all of it.
type WithClearance = (Vec<(usize, [ClPoint; 2])>, Vec<bool>);

/// The motions of a link through other places.
fn moves(link: &ProgramLink, through: &[AxisValues]) -> Vec<Move> {
    let starts = std::iter::once(&link.start).chain(through);
    let block = link.blocks.first().copied().unwrap_or(0);
    let between = |(start, end): (&AxisValues, &AxisValues)| Move {
        block,
        section: link.section,
        law: link.law,
        is_rapid: true,
        start: *start,
        end: *end,
        feed: None,
        moves_tool: true,
    };
    starts.zip(through).map(between).collect()
}
