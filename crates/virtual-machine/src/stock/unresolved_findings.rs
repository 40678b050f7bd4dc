//! Stock that may be left where no line of it shows: thin walls, fins and edges between the lines.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use facemill_cl_data::{Cancelled, Monitor, RoundFrustum};
use facemill_nc_program::ReadProgram;
use facemill_tool_model::{Cutter, ToolAssembly};
use facemill_z_map::{DexelGrid, DexelMap, Step, StepResult, Sweep, TurnedBody};
use rayon::prelude::*;

use crate::finding::episodes::{Contact, Episode, Episodes, Key};
use crate::finding::{Finding, FindingKind};
use crate::motion::moves::{Move, ResolvedMoves, resolve};
use crate::motion::setup;
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::run::report::Report;
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, MoveOfHead, Segment, segments_of_heads};
use crate::stock::bodies::Bodies;
use crate::stock::heads;
use crate::stock::machine_bodies::{InQuestion, MachineBodies, Waiting};
use crate::stock::probe::Smaller;

/// Thickness of the layer around the stock with which its lines, `cell` (mm) apart, show all of it,
/// mm: half the diagonal of a cell. Every place of the stock is then in the material of the line in
/// the middle of its cell, at the same height.
#[must_use]
pub fn outside_layer(cell: f64) -> f64 {
    cell * FRAC_1_SQRT_2
}

/// Depth, mm, to which the cutter, or a section of the tool's body or holder, has to go into the
/// remaining stock for [`remaining_collisions`] to find it, on lines `cell` (mm) apart and with a
/// tolerance (mm): below its surface, its ends included. Sections that are nowhere that deep are
/// not tested.
#[must_use]
pub fn certain_depth(cell: f64, tolerance: f64) -> f64 {
    SQRT_2 * cell + 8.0 * tolerance
}

/// Whether a cutter is large enough for [`remaining_collisions`] to know what it takes, on lines
/// `cell` (mm) apart and with a tolerance (mm).
#[must_use]
pub fn is_known_to_cut(cutter: &Cutter, cell: f64, tolerance: f64) -> bool {
    Smaller::within(cutter, outside_layer(cell) + 2.0 * tolerance).is_some()
}

/// One head, and its findings against the stock as it was at first.
pub type HeadFindings<'a> = (&'a VirtualSetup<'a>, &'a VerifySettings, Vec<Finding>);

/// Returns the findings against the initial stock that cannot be ruled out against the remaining
/// stock: bodies of tool and machine, and the cutter in rapid, that are not proven to be free of
/// it. They are reported anew, for the blocks to which that applies, with the obstacle `stock`.
///
/// `outside` is the stock before the program with [`outside_layer`] around it, as lines. The cutter
/// removes from it as much as a cutter smaller by half the diagonal of a cell and twice the
/// tolerance: so long as there is material in a cell, its line has material at that height. Bodies
/// are tested smaller by half the diagonal of a cell and six times the tolerance, so that walls
/// that the cutter itself has left smooth are not found when it goes along them, though ways are
/// off by twice the tolerance. So a body that goes into remaining stock deeper than
/// [`certain_depth`] is found, however thin the stock is; and every found body goes through initial
/// stock, and comes nearer than half the diagonal of a cell to possible remains, deep within the
/// body.
///
/// Bodies of the machine are tested as they are, with their clearances, as
/// [`verify`](crate::run::verify::verify) does: at its positions, and followed from one to the
/// next, on each move against the stock before it. The remaining stock is where there was stock at
/// first, and within half the diagonal of a cell of a line's material, or beside all lines. So the
/// reported distance is never larger than the true one; near misses are reported, too; and where no
/// bound on the motion is known, there is no distance.
///
/// Where a cutter is too small to know its cuts ([`is_known_to_cut`]), nothing is tested, and the
/// findings of bodies of the machine stay as they were.
///
/// Ways, and what is cut, are those of [`run_stock`](crate::stock::run::run_stock), which tells all
/// else.
///
/// # Errors
/// As [`run_stock_of_heads`](crate::stock::run::run_stock_of_heads).
pub fn remaining_collisions<const N: usize>(
    program: &ReadProgram,
    heads: [HeadFindings<'_>; N],
    outside: &mut DexelMap,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<[Vec<Finding>; N], VerifyError> {
    for (setup, settings, _) in &heads {
        setup::check(setup, settings)?;
    }
    heads::check_setups(&heads.each_ref().map(|(setup, ..)| *setup))?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(VerifyError::Setting { field: "tolerance", value: tolerance, needed: "above 0" });
    }
    let resolved = heads.each_ref().map(|(setup, settings, _)| resolve(program, setup, settings));
    heads::check_moves(program, &resolved)?;
    let views: Result<Vec<View<'_>>, VerifyError> = heads
        .iter()
        .map(|(setup, settings, findings)| View::new(setup, settings, findings, (tolerance, outside.grid())))
        .collect();
    let views = views?;
    if views.iter().any(|view| view.takes.is_none()) {
        return Ok(heads.map(|(setup, _, found)| found.into_iter().filter(|f| is_of_machine(setup, f)).collect()));
    }
    let mut look = Look { program, views: &views, outside, tolerance, episodes: vec![Episodes::default(); N] };
    let n_moves = resolved.iter().map(|r| r.moves.len()).max().unwrap_or(0);
    for first in (0..n_moves).step_by(MOVES_PER_BATCH) {
        let batch = first..n_moves.min(first + MOVES_PER_BATCH);
        let moves = resolved.each_ref().map(|r| &r.moves[batch.clone()]);
        look.batch(first, &moves, monitor)?;
        monitor.advance(moves.first().map_or(0, |m| m.chunk_by(|a, b| a.block == b.block).count()));
    }
    Ok(std::array::from_fn(|h| views[h].findings(program, &resolved[h], &look.episodes[h])))
}

/// Notes of findings that no line shows: of the tool; and of bodies of the machine.
const MAY_BE_LEFT: [&str; 2] = [
    "in stock that the lines do not show to be cut",
    "not proven to be free of stock that the lines do not show to be cut",
];

/// Moves whose segments are made before the stock is cut by them: bounds the memory.
const MOVES_PER_BATCH: usize = 512;

/// A run on the way.
struct Look<'r, 'a> {
    program: &'r ReadProgram,
    views: &'r [View<'a>],
    outside: &'r mut DexelMap,
    tolerance: f64,
    /// Of each head.
    episodes: Vec<Episodes>,
}

impl Look<'_, '_> {
    /// Asks and cuts on the same moves of each head.
    fn batch(&mut self, first: usize, moves: &[&[Move]], monitor: &dyn Monitor) -> Result<(), VerifyError> {
        let ways = ways(self.views, moves, monitor)?;
        let steps = steps(self.program, self.views, moves, &ways);
        let bodies: Vec<&MachineBodies<'_>> = self.views.iter().map(|view| &view.machine).collect();
        let mut waiting = Waiting::new(in_question_on(self.program, self.views, moves));
        let mut rest = &steps[..];
        loop {
            // Bodies of the machine are tested before anything is cut on their move.
            let end = waiting.next().map_or(rest.len(), |index| rest.partition_point(|step| step.index < index));
            let (before, behind) = rest.split_at(end);
            self.take(first, before)?;
            rest = behind;
            let tested = waiting.ask_first(&bodies, (first, moves), self.outside, monitor)?;
            let Some((head, episodes)) = tested else { return Ok(()) };
            episodes.into_iter().for_each(|episode| self.episodes[head].add(episode));
        }
    }

    fn take(&mut self, first: usize, steps: &[StepQuery<'_>]) -> Result<(), VerifyError> {
        let taken: Vec<Step<'_>> = steps.iter().map(|step| step.step).collect();
        let results = self.outside.run(&taken, self.tolerance);
        let results = results.map_err(|e| VerifyError::Sweep { problem: e.to_string() })?;
        for (step, StepResult { deepest, .. }) in steps.iter().zip(results) {
            let (Some(key), Some(deepest)) = (step.key, deepest) else { continue };
            let Segment { axes, to: cl, end: at, .. } = *step.segment;
            let contact = Contact { key, measure: None, place: Some(deepest.place), axes, cl, at };
            self.episodes[step.head].record(first + step.index, contact);
        }
        Ok(())
    }
}

/// Queries of one head.
struct View<'a> {
    scene: RunScene<'a>,
    coarse: Coarseness,
    /// Region that the cutter certainly removes; `None` if nothing is left of it.
    takes: Option<Smaller>,
    /// The cutter in rapid, smaller; `None` where nothing is left.
    in_rapid: Option<Smaller>,
    /// The tool's bodies, smaller, by their indices among the scene's.
    sections: Vec<(usize, TurnedBody)>,
    machine: MachineBodies<'a>,
    /// Kind, body and lines that are in question.
    findings: Vec<(FindingKind, Option<String>, [u32; 2])>,
}

impl<'a> View<'a> {
    fn new(
        setup: &'a VirtualSetup<'a>,
        settings: &'a VerifySettings,
        findings: &[Finding],
        (tolerance, grid): (f64, &DexelGrid),
    ) -> Result<Self, VerifyError> {
        let cell = grid.cell();
        let max_way = Bodies::new(setup.tool, settings.clearance_slack, [tolerance, cell]).max_way;
        let cutter = setup.tool.cutter();
        let taken = outside_layer(cell) + 2.0 * tolerance;
        let margin = outside_layer(cell) + 6.0 * tolerance;
        let scene = RunScene::new(setup, settings)?;
        Ok(Self {
            machine: MachineBodies::new(&scene, grid),
            scene,
            coarse: Coarseness { tolerance, reach: setup.tool.gauge_length(), max_way },
            takes: Smaller::within(cutter, taken),
            in_rapid: Smaller::within(cutter, margin),
            sections: sections(setup.tool, margin),
            findings: findings.iter().map(|f| (f.kind, f.body.clone(), [f.first_line, f.last_line])).collect(),
        })
    }

    fn of_move<'r>(&'r self, m: &'r Move) -> MoveOfHead<'r, 'a> {
        MoveOfHead { scene: &self.scene, m, coarse: &self.coarse }
    }

    /// Whether it is in question what a body, or the cutter, does on a line.
    fn is_tested(&self, kind: FindingKind, body: Option<usize>, line: u32) -> bool {
        let body = body.map_or("cutter", |k| &self.scene.bodies[k].name);
        self.findings
            .iter()
            .any(|(k, b, [first, last])| *k == kind && b.as_deref() == Some(body) && (*first..=*last).contains(&line))
    }

    /// The bodies of the machine of which it is in question what they do on a line.
    fn tested_machine_bodies(&self, line: u32) -> Vec<usize> {
        let is_tested = |k: usize| MACHINE_KINDS.iter().any(|kind| self.is_tested(*kind, Some(k), line));
        self.machine.names().map(|(k, _)| k).filter(|k| is_tested(*k)).collect()
    }

    /// Returns the findings of one head's episodes.
    fn findings(&self, program: &ReadProgram, resolved: &ResolvedMoves, episodes: &Episodes) -> Vec<Finding> {
        let report = Report::new(program, &self.scene, resolved);
        let finding = |e: &Episode| {
            let mut finding = report.finding(e);
            let of_machine = MACHINE_KINDS.contains(&e.worst.key.kind);
            let head = std::mem::take(&mut finding.note);
            let own = Some(MAY_BE_LEFT[usize::from(of_machine)].to_owned());
            finding.note = own.into_iter().chain((!head.is_empty()).then_some(head)).collect::<Vec<_>>().join(", ");
            finding
        };
        let mut findings: Vec<Finding> = episodes.all.iter().map(finding).collect();
        findings.sort_by_key(|f| (f.first_line, f.kind));
        findings
    }
}

/// Kinds of findings of bodies of the machine that meet stock.
const MACHINE_KINDS: [FindingKind; 2] = [FindingKind::Collision, FindingKind::NearMiss];

/// Whether a finding is of a body of the machine that is near something.
fn is_of_machine(setup: &VirtualSetup<'_>, finding: &Finding) -> bool {
    let mut bodies = setup.machine.bodies().iter();
    MACHINE_KINDS.contains(&finding.kind) && bodies.any(|body| Some(body.name()) == finding.body.as_deref())
}

/// The moves of a batch on which bodies of the machine are in question, in order.
fn in_question_on(program: &ReadProgram, views: &[View<'_>], moves: &[&[Move]]) -> Vec<InQuestion> {
    let n_moves = moves.first().map_or(0, |m| m.len());
    let of_move = |index: usize| {
        views.iter().enumerate().filter_map(move |(head, view)| {
            let bodies = view.tested_machine_bodies(program.blocks[moves[head][index].block].line);
            (!bodies.is_empty()).then_some(InQuestion { head, index, bodies })
        })
    };
    (0..n_moves).flat_map(of_move).collect()
}

/// The bodies of a tool, each so much smaller on all sides, of which something is left.
fn sections(tool: &ToolAssembly, by: f64) -> Vec<(usize, TurnedBody)> {
    let smaller = |RoundFrustum { z_low, z_high, radius_low, radius_high, .. }: RoundFrustum| {
        let [low, high] = [z_low + by, z_high - by];
        // Measured across the side of a cone.
        let slope = (radius_high - radius_low) / (z_high - z_low);
        let radius = |z: f64| radius_low + slope * (z - z_low) - by * (1.0 + slope * slope).sqrt();
        let radii = [radius(low), radius(high)];
        if low >= high || radii.iter().any(|r| *r <= 0.0) {
            return None;
        }
        TurnedBody::frustum([low, high], radii, 0.0).ok()
    };
    let all = tool.sections().into_iter().enumerate();
    all.filter_map(|(k, section)| Some((k, smaller(section.frustum)?))).collect()
}

/// The segments of each head on each move.
type SegmentsOfMoves = Vec<Vec<Option<Vec<Segment>>>>;

fn ways(views: &[View<'_>], moves: &[&[Move]], monitor: &dyn Monitor) -> Result<SegmentsOfMoves, Cancelled> {
    let of_move = |k: usize| {
        monitor.checkpoint()?;
        let of_heads: Vec<_> = views.iter().zip(moves).map(|(view, moves)| view.of_move(&moves[k])).collect();
        Ok(segments_of_heads(&of_heads))
    };
    (0..moves.first().map_or(0, |m| m.len())).into_par_iter().map(of_move).collect()
}

/// A step, and what it is a finding of; `None` where it cuts.
struct StepQuery<'s> {
    step: Step<'s>,
    key: Option<Key>,
    segment: &'s Segment,
    head: usize,
    /// Index of the move in its batch.
    index: usize,
}

/// Returns the queries and cuts on a batch of moves: in each part of a move all heads are queried
/// before any of them cuts.
fn steps<'s>(
    program: &ReadProgram,
    views: &'s [View<'_>],
    moves: &[&[Move]],
    ways: &'s SegmentsOfMoves,
) -> Vec<StepQuery<'s>> {
    let mut steps = Vec::new();
    for (index, of_heads) in ways.iter().enumerate() {
        let parts = of_heads.iter().flatten().map(Vec::len).max().unwrap_or(0);
        for (part, cuts) in (0..parts).flat_map(|part| [(part, false), (part, true)]) {
            for (head, view) in views.iter().enumerate() {
                let Some(segment) = of_heads[head].as_ref().and_then(|segments| segments.get(part)) else { continue };
                let m = &moves[head][index];
                let step = |step, key| StepQuery { step, key, segment, head, index };
                if cuts {
                    let takes = view.takes.iter().filter(|_| !m.is_rapid_of_tool());
                    steps.extend(takes.map(|takes| step(Step::Remove(takes.along(segment)), None)));
                    continue;
                }
                let line = program.blocks[m.block].line;
                let stock = view.scene.obstacles.len();
                let rapid = FindingKind::RapidCollision;
                let is_rapid = m.is_rapid_of_tool() && view.is_tested(rapid, None, line);
                let in_rapid = view.in_rapid.iter().filter(|_| is_rapid);
                let key = Key::of_cutter(rapid, stock);
                steps.extend(in_rapid.map(|cutter| step(Step::Ask(cutter.along(segment)), Some(key))));
                let holder = FindingKind::HolderCollision;
                let sections = view.sections.iter().filter(|(k, _)| view.is_tested(holder, Some(*k), line));
                steps.extend(sections.map(|(k, body)| {
                    let sweep = Sweep { body, from: segment.from, to: segment.to };
                    step(Step::Ask(sweep), Some(Key::of_body(holder, *k, stock)))
                }));
            }
        }
    }
    steps
}

/// Of findings of a setup against the stock as it was at first those that a run against it as it is
/// then does not tell: what is in question, of bodies of tool and machine, and of the cutter in
/// rapid.
#[must_use]
pub fn unresolved_findings(setup: &VirtualSetup<'_>, at_first: &[Finding], then: &[Finding]) -> Vec<Finding> {
    let of_tool = |f: &Finding| matches!(f.kind, FindingKind::HolderCollision | FindingKind::RapidCollision);
    let is_same = |a: &Finding, b: &Finding| {
        (a.kind, &a.body, &a.obstacle) == (b.kind, &b.body, &b.obstacle)
            && [a.first_line, a.last_line] == [b.first_line, b.last_line]
    };
    let known = |f: &Finding| then.iter().any(|k| is_same(k, f));
    at_first.iter().filter(|f| (of_tool(f) || is_of_machine(setup, f)) && !known(f)).cloned().collect()
}
