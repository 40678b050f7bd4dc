//! Two operations cut at once: from the plan of each alone to one part of the program.

use std::collections::{BTreeMap, BTreeSet};

use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{PairSettings, PoseTest, PostureRange};
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PairFile};
use facemill_job::format::report::pairs::PairSplit;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_tool_path::chips::Chip;
use facemill_tool_path::moves::order::PassOrderReport;
use facemill_tool_path::moves::{Move, MoveKind, MoveSettings, OperationMoves, PieceMoves, TurnState, operation_moves};
use facemill_tool_path::segments::{Cut, LeftOut, PassSegment};
use nalgebra::Point3;
use rayon::prelude::*;

use super::moves::{DualMove, DualMover, ReachedRun};
use super::pairing::{PiecePair, pairs, stations};
use super::passes_between::PassesBetween;
use super::runs::{Cause, Causes, PairRun, RunPlanner, SyncPoint, left_over};
use crate::dual::links::run_order::run_order;
use crate::dual::parts::{
    PairOutline, ProgramPart, Section, SectionTurn, TwoHeadContext, alone_sections, cells, mover, section,
};
use crate::dual::run_trimming::{Remains, paired_left};
use crate::dual::turns::pair_turns::{PairTurns, add_turns};
use crate::passes::engagement::{PointEngagement, engagement_of_passes};
use crate::passes::move_settings::{move_settings, turn_settings};
use crate::passes::operation::PlannedOperation;
use crate::passes::turn_chips::give_turn_chips;
use crate::program::BlockWriter;
use crate::program::heads::RoundTasks;
use crate::stage_clock::Clock;

/// Plans two operations at once.
pub(crate) struct PairPlanner<'p, 'a> {
    pub context: &'p TwoHeadContext<'a>,
    pub pair: &'p PairFile,
    /// Corrections by what the round before has left.
    pub round: &'p RoundTasks<'p, 'a>,
    pub stages: &'p dyn Stages,
}

/// Planned operations of both heads.
pub(crate) type HeadOperations<'a> = [PlannedOperation<'a>; 2];

impl<'a> PairPlanner<'_, 'a> {
    /// Plans the two operations and their part of the program; `at` is the position before and
    /// after it.
    ///
    /// # Errors
    /// As [`crate::plan::plan_setup`].
    pub(crate) fn plan(
        &self,
        at: &mut Option<AxisValues>,
        picture: &mut Option<String>,
        clock: &mut Clock,
    ) -> Result<(HeadOperations<'a>, ProgramPart<'a>), Failure> {
        let context = self.context;
        let mut single = |head: usize, name: &str| {
            let named =
                context.scenes[head].job.operations_of(context.scenes[head].setup.file).find(|(_, o)| o.name == name);
            let named = named.ok_or_else(|| Failure::Internal(format!("operation \"{name}\" is not of this setup")))?;
            let task = self.round.task(named, None, head == 0 && picture.is_none());
            let planned = PlannedOperation::plan(&context.setup_context(head), task, self.stages, clock);
            let (planned, svg) = planned.map_err(|why| of_head(head, why))?;
            *picture = picture.take().or(svg);
            Ok::<_, Failure>(planned)
        };
        let mut planned = [single(0, &self.pair.first)?, single(1, &self.pair.second)?];
        let separate_time = self.separate_time(&planned)?;
        let pieces: [Vec<PassSegment>; 2] =
            std::array::from_fn(|h| planned[h].moves.pieces.iter().map(|p| p.piece.clone()).collect());
        let files = [planned[0].operation, planned[1].operation];
        let cells = cells(context, files[0], files[1]);
        let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
        let settings = [0, 1].map(|h| move_settings(context.scenes[h].job, context.scenes[h].setup, files[h]));
        let mover = mover(context, &tests, [&settings[0], &settings[1]]);
        let slices = [pieces[0].as_slice(), pieces[1].as_slice()];
        let (reached, mut causes) = self.reached(&mover, slices, files, &settings)?;
        clock.lap("pair");
        let planner = run_planner(&mover, files, &settings, self.pair, slices);
        let mut both = self.both(&mover, &planner, (reached, files), &mut causes, *at)?;
        clock.lap("moves of both");
        let mut points = [0, 1].map(|h| points_of(&pieces[h]));
        let between = self.between(&both, files)?;
        for (h, between) in between.iter().enumerate() {
            add_points(&mut points[h], &between.pieces);
        }
        self.with_passes_between(&mover, &planner, &mut both, between.each_ref().map(|b| b.pieces.as_slice()))?;
        for (h, between) in between.into_iter().enumerate() {
            between.count(&mut planned[h]);
        }
        clock.lap("passes between");
        let mut sections = std::mem::take(&mut both.sections);
        *at = both.at;
        let linearisation = both.runs.iter().map(|r| planner.linearisation(&r.stops));
        let linearisation = linearisation.fold(both.turns_linearisation, f64::max);
        for (h, requested) in points.into_iter().enumerate() {
            let left = both.left[h].clone();
            let (mut alone, mut lost_alone) = (OperationMoves::default(), Vec::new());
            let is_alone = !left.is_empty();
            if is_alone {
                let (parking, moves, lost) = self.left_alone(&mover, (h, files[h]), left, *at)?;
                sections.push(section(format!("HEAD {} ALONE", h + 1), parking));
                lost_alone = lost;
                alone = moves;
                *at = alone.last().map(|m| m.axes).or(*at);
            }
            let mut all: Vec<PieceMoves> = both.cut_by(h).chain(alone.pieces).collect();
            add_turns(&mover, h, &mut all, &sections[..3 * both.runs.len()]);
            let lost = count_once(all.iter_mut(), requested, lost_alone);
            planned[h].left_out.extend(lost);
            let mut moves = OperationMoves {
                pieces: all,
                retract: alone.retract,
                linearisation: alone.linearisation.max(linearisation),
                order: alone.order,
            };
            let own = &mut planned[h];
            // That was of the plan for one head.
            own.optimum = None;
            own.along = engagement_of_passes(
                context.scenes[h].job,
                context.scenes[h].setup,
                files[h],
                &mut moves.pieces,
                self.stages,
            )?;
            let Scene { job, setup, .. } = context.scenes[h];
            give_turn_chips(job, setup, &files[h].feeds, &mut moves.pieces, &own.along)?;
            let (of_runs, of_alone) = moves.pieces.split_at(both.runs.len());
            give_run_chips(&mut sections, h, of_runs, &own.along);
            if is_alone {
                sections.extend(alone_sections(h, of_alone, &moves.retract));
            }
            own.moves = moves;
        }
        clock.lap("moves of each");
        let splits = splits(causes);
        let pair =
            PairOutline { file: self.pair.clone(), runs: both.runs.len(), separate_time, splits, order: both.order };
        let part = ProgramPart { files: files.map(Some), sections, pair: Some(pair) };
        Ok((planned, part))
    }

    /// Returns the cuts of one head alone: the path of both heads to its first move with the other
    /// one at home, its moves, and points without an entry or exit. If no link leads there, both
    /// heads go home first.
    fn left_alone(
        &self,
        mover: &DualMover<'_, '_>,
        (head, file): (usize, &OperationFile),
        left: Vec<PassSegment>,
        at: Option<AxisValues>,
    ) -> Result<(Vec<DualMove>, OperationMoves, Vec<LeftOut>), Failure> {
        let (test, Scene { job, setup, .. }) = (mover.test.tests[head], &self.context.scenes[head]);
        let settings = MoveSettings { turns: turn_settings(job, setup, file), ..move_settings(job, setup, file) };
        let settings = &settings;
        let monitor = self.stages.start("left for one head", 2 * left.len());
        let mut lost = Vec::new();
        let linked = mover.park_other(head, at).and_then(|(parking, from)| {
            Ok((parking, operation_moves(test, settings, left.clone(), from, &mut lost, &*monitor)?))
        });
        match (linked, at) {
            (Err(Failure::Infeasible(_)), Some(from)) => {
                let mut lost = Vec::new();
                let moves = operation_moves(test, settings, left, None, &mut lost, &*monitor)?;
                let home = test.cell.machine.home();
                let mut way = mover.cross(&from, &home)?;
                if let Some(first) = moves.pieces.first().and_then(|p| p.moves.first()) {
                    way.extend(mover.cross(&home, &first.axes)?);
                }
                Ok((way, moves, lost))
            }
            (linked, _) => linked.map(|(parking, moves)| (parking, moves, lost)),
        }
    }

    /// Returns the runs with the moves between them. A run without a link to it goes back to each
    /// head alone.
    fn both(
        &self,
        mover: &DualMover<'_, '_>,
        planner: &RunPlanner<'_, '_>,
        (mut reached, files): (Vec<ReachedRun>, [&OperationFile; 2]),
        causes: &mut Causes,
        from: Option<AxisValues>,
    ) -> Result<Both, Failure> {
        let slices = planner.pieces;
        let feeds = planner.settings.feeds;
        let remains = Remains { mover, pieces: slices, shortest: planner.shortest };
        // Pairs of remaining pieces that cannot be linked.
        let mut apart: BTreeSet<[usize; 2]> = BTreeSet::new();
        loop {
            let monitor = self.stages.start("left beside both heads", reached.len());
            reached = remains.trimmed(reached, causes, &*monitor)?;
            drop(monitor);
            let runs: Vec<&PairRun> = reached.iter().map(|r| &r.run).collect();
            let left = [left_over(slices[0], 0, &runs), left_over(slices[1], 1, &runs)];
            let left_slices = [left[0].as_slice(), left[1].as_slice()];
            let monitor = self.stages.start("left for both heads", left[0].len());
            let of_left = RunPlanner { pieces: left_slices, shortest: 0.0, ..*planner };
            let mut more = paired_left(mover, &of_left, feeds, &*monitor)?;
            drop(monitor);
            more.retain(|r| !apart.contains(&r.run.pieces));
            let passes = |of: &[ReachedRun], pieces: [&[PassSegment]; 2]| -> Vec<[PassSegment; 2]> {
                of.iter().map(|r| std::array::from_fn(|h| pieces[h][r.run.pieces[h]].clone())).collect()
            };
            let passes = [passes(&reached, slices), passes(&more, left_slices)].concat();
            let all: Vec<(&ReachedRun, &[PassSegment; 2])> = reached.iter().chain(&more).zip(&passes).collect();
            let monitor = self.stages.start("order of both heads", 0);
            let runs_alone: Vec<&ReachedRun> = all.iter().map(|(run, _)| *run).collect();
            let order = run_order(self.context, mover, &runs_alone, from, &*monitor)?;
            drop(monitor);
            let (order, report) = order.unzip();
            let operation = format!("{} + {}", self.pair.first, self.pair.second);
            let report = report.map(|report| PassOrderReport { operation, ..report });
            match linked_in_order(mover, &all, order, from) {
                Ok(Linked { mut sections, at, order }) => {
                    let in_order = order.clone().unwrap_or_else(|| (0..all.len()).collect());
                    let mut turns_linearisation = 0.0;
                    if let Some(turns) = PairTurns::new(self.context, mover, files) {
                        let monitor = self.stages.start("turns of both heads", in_order.len());
                        let run = |&k: &usize| (&all[k].0.run, all[k].1[0].copy);
                        let runs: Vec<(&PairRun, u32)> = in_order.iter().map(run).collect();
                        turns_linearisation = turns.join(&runs, &mut sections, &*monitor)?;
                    }
                    let more: Vec<&PairRun> = more.iter().map(|r| &r.run).collect();
                    let left = [0, 1].map(|h| left_over(left_slices[h], h, &more));
                    let report = report.filter(|_| order.is_some());
                    let runs = in_order.iter().map(|&k| all[k].0.run.clone()).collect();
                    let passes = in_order.iter().map(|&k| all[k].1.clone()).collect();
                    return Ok(Both { runs, passes, left, sections, at, order: report, turns_linearisation });
                }
                Err((k, _)) if k >= reached.len() => {
                    apart.insert(more[k - reached.len()].run.pieces);
                }
                Err((k, why)) => {
                    let run = reached.remove(k).run;
                    run.stops.iter().for_each(|stop| causes.add(why.clone(), why.clone(), &stop.cc[0]));
                    apart.clear();
                }
            }
        }
    }

    /// Returns the passes that each head needs between those that it cuts, in runs and alone.
    fn between(&self, both: &Both, files: [&OperationFile; 2]) -> Result<[PassesBetween; 2], Failure> {
        let of = |h: usize| {
            let cut: Vec<PassSegment> = both.cut_by(h).map(|p| p.piece).chain(both.left[h].iter().cloned()).collect();
            let high = self.round.high(files[h]);
            PassesBetween::find(&self.context.setup_context(h), files[h], (&cut, high), self.stages)
        };
        Ok([of(0)?, of(1)?])
    }

    /// Adds passes between passes: both heads cut them at once if that is possible from end to end
    /// and a link leads there; otherwise each head cuts its own alone.
    fn with_passes_between(
        &self,
        mover: &DualMover<'_, '_>,
        planner: &RunPlanner<'_, '_>,
        both: &mut Both,
        pieces: [&[PassSegment]; 2],
    ) -> Result<(), Failure> {
        let monitor = self.stages.start("left for both heads", pieces[0].len());
        let of_them = RunPlanner { pieces, shortest: 0.0, ..*planner };
        let found = paired_left(mover, &of_them, planner.settings.feeds, &*monitor)?;
        let mut runs = Vec::new();
        for run in found {
            let passes = std::array::from_fn(|h| pieces[h][run.run.pieces[h]].clone());
            // Without a link each head cuts them alone.
            let Ok((sections, at)) = run_sections(mover, &run, &passes, both.at) else { continue };
            both.sections.extend(sections);
            both.at = at;
            both.passes.push(passes);
            runs.push(run.run);
        }
        let of_runs: Vec<&PairRun> = runs.iter().collect();
        for (h, pieces) in pieces.into_iter().enumerate() {
            both.left[h].extend(left_over(pieces, h, &of_runs));
        }
        both.runs.extend(runs);
        Ok(())
    }

    /// Returns the time of both operations one after the other, each by its head alone and with
    /// links as laid, s.
    fn separate_time(&self, planned: &HeadOperations<'a>) -> Result<f64, Failure> {
        let mut sum = 0.0;
        for (head, operation) in planned.iter().enumerate() {
            let Scene { job, setup, .. } = self.context.scenes[head];
            let alone = Scene::new(job, setup, 0)?;
            let mut writer = BlockWriter::new(&alone)?;
            writer.operation(operation.operation, &operation.moves)?;
            let timed = writer.finish();
            sum += timed.passes_time + timed.approach_time + timed.rapid_time;
        }
        Ok(sum)
    }

    /// Returns runs of both heads with their entries and exits, in cutting order, and the causes
    /// why other stations have none.
    fn reached(
        &self,
        mover: &DualMover<'_, '_>,
        pieces: [&[PassSegment]; 2],
        files: [&OperationFile; 2],
        settings: &[MoveSettings; 2],
    ) -> Result<(Vec<ReachedRun>, Causes), Failure> {
        let feeds = files.map(|f| f.feeds.cutting_mm_min / 60.0);
        let places_of = |piece: &PassSegment| -> Vec<_> { piece.places().map(|c| c.cc).collect() };
        let together: Vec<PiecePair> = pairs(pieces[0], pieces[1])
            .into_iter()
            .map(|[i, j]| {
                let passes = [places_of(&pieces[0][i]), places_of(&pieces[1][j])];
                PiecePair { pieces: [i, j], stations: stations([&passes[0], &passes[1]], feeds) }
            })
            .collect();
        let mut causes = Causes::default();
        for (h, of_head) in pieces.iter().enumerate() {
            for (k, piece) in of_head.iter().enumerate() {
                let why = match together.iter().find(|p| p.pieces[h] == k) {
                    None => "no pass of the other side goes with it",
                    Some(pair) if pair.stations.is_empty() => "the passes of both sides differ too much in length",
                    Some(_) => continue,
                };
                piece.places().for_each(|cut| causes.add(why.to_owned(), why.to_owned(), &cut.cc));
            }
        }
        let planner = run_planner(mover, files, settings, self.pair, pieces);
        let n = together.iter().map(|p| p.stations.len()).sum();
        let monitor = self.stages.start("both heads", n);
        let found: Vec<_> = together
            .par_iter()
            .map(|pair| {
                let found = planner.runs(pair, &*monitor);
                monitor.advance(pair.stations.len());
                found
            })
            .collect::<Result<_, _>>()?;
        drop(monitor);
        let mut runs = Vec::new();
        for (found, why) in found {
            runs.extend(found);
            causes.join(why);
        }
        let monitor = self.stages.start("entries of both heads", runs.len());
        let (reached, why) = mover.reach(runs, &*monitor)?;
        causes.join(why);
        Ok((reached, causes))
    }
}

/// Runs of both heads in cutting order, and the remaining pieces.
struct Both {
    runs: Vec<PairRun>,
    /// Piece of each head that a run is or was a part of.
    passes: Vec<[PassSegment; 2]>,
    /// Pieces that each head cuts alone.
    left: [Vec<PassSegment>; 2],
    sections: Vec<Section>,
    /// Position of both heads after them.
    at: Option<AxisValues>,
    /// Report on the order, if it is not as laid.
    order: Option<PassOrderReport>,
    /// Largest deviation of the cutters between blocks of turns, mm.
    turns_linearisation: f64,
}

impl Both {
    /// Returns a head's parts of the runs as pieces of its operation.
    fn cut_by(&self, head: usize) -> impl Iterator<Item = PieceMoves> + '_ {
        self.runs.iter().zip(&self.passes).map(move |(run, passes)| as_piece(head, run, &passes[head]))
    }
}

/// Moves of runs one after the other.
struct Linked {
    sections: Vec<Section>,
    /// Position after them.
    at: Option<AxisValues>,
    /// Their order, if it is not as laid.
    order: Option<Vec<usize>>,
}

/// Returns the moves of runs in this order, or as laid if there is none or a run has no link to it
/// in this order; or the run without a link to it and the reason.
fn linked_in_order(
    mover: &DualMover<'_, '_>,
    runs: &[(&ReachedRun, &[PassSegment; 2])],
    order: Option<Vec<usize>>,
    at: Option<AxisValues>,
) -> Result<Linked, (usize, String)> {
    if let Some(order) = order
        && let Ok((sections, at)) = linked(mover, runs, order.iter().copied(), at)
    {
        return Ok(Linked { sections, at, order: Some(order) });
    }
    let (sections, at) = linked(mover, runs, 0..runs.len(), at)?;
    Ok(Linked { sections, at, order: None })
}

/// Returns the moves of runs one after the other and the position after them, or the run without a
/// link to it and the reason.
fn linked(
    mover: &DualMover<'_, '_>,
    runs: &[(&ReachedRun, &[PassSegment; 2])],
    order: impl Iterator<Item = usize>,
    mut at: Option<AxisValues>,
) -> Result<(Vec<Section>, Option<AxisValues>), (usize, String)> {
    let mut sections = Vec::new();
    for k in order {
        let (run, passes) = runs[k];
        let (of_run, behind) = run_sections(mover, run, passes, at).map_err(|why| (k, why.to_string()))?;
        sections.extend(of_run);
        at = behind;
    }
    Ok((sections, at))
}

/// Returns the link to a run from the position of both heads, its entry, cuts and exit, and the
/// position after it.
fn run_sections(
    mover: &DualMover<'_, '_>,
    run: &ReachedRun,
    passes: &[PassSegment; 2],
    at: Option<AxisValues>,
) -> Result<(Vec<Section>, Option<AxisValues>), Failure> {
    let comment = format!("PASSES {} AND {} PLACE {}", passes[0].pass + 1, passes[1].pass + 1, passes[0].copy + 1);
    let mut sections = Vec::new();
    let mut moves = Vec::new();
    let mut last = at;
    for m in &run.down {
        let axes = last.map_or(m.axes, |near| mover.turned(&m.axes, &near));
        match last {
            Some(from) if moves.is_empty() => moves.extend(mover.cross(&from, &axes)?),
            _ => moves.push(DualMove { axes, ..*m }),
        }
        last = Some(axes);
    }
    let mut cuts = Vec::new();
    for (k, stop) in run.run.stops.iter().enumerate() {
        let axes = last.map_or(stop.pose.axes, |near| mover.turned(&stop.pose.axes, &near));
        let kind = if k == 0 { MoveKind::Engage } else { MoveKind::Cut };
        cuts.push(DualMove { kind, axes, working: [true; 2], chips: [None; 2] });
        last = Some(axes);
    }
    let mut up = Vec::new();
    for m in &run.up {
        let axes = last.map_or(m.axes, |near| mover.turned(&m.axes, &near));
        up.push(DualMove { axes, ..*m });
        last = Some(axes);
    }
    let goes_on = passes.iter().any(|p| p.part.is_some_and(|part| part > 0));
    sections.push(Section { goes_on, ..section(comment, moves) });
    sections.push(Section { run: Some(run.run.clone()), goes_on, ..section(String::new(), cuts) });
    sections.push(section(String::new(), up));
    Ok((sections, last))
}

/// Data for planning the pieces of a pair.
pub(crate) fn run_planner<'r, 'a>(
    mover: &DualMover<'r, 'a>,
    files: [&OperationFile; 2],
    settings: &[MoveSettings; 2],
    pair: &PairFile,
    pieces: [&'r [PassSegment]; 2],
) -> RunPlanner<'r, 'a> {
    let ranges = files.map(|f| [false, true].map(|left| posture_range(f, pair, left)));
    let radius = mover.test.tests[0].cell.tool.cutter().radius().min(mover.test.tests[1].cell.tool.cutter().radius());
    let turn = |f: &OperationFile| f.search.max_turn_deg_per_mm.to_radians();
    RunPlanner {
        test: mover.test,
        ranges,
        settings: PairSettings {
            ranges: ranges.map(|of_head| of_head[0]),
            feeds: files.map(|f| f.feeds.cutting_mm_min / 60.0),
            cusps: files.map(|f| f.tolerances.cusp_mm),
            strips: files.map(|f| Strip::on_plane(f.tolerances.max_step_over_mm)),
            max_turn_per_mm: turn(files[0]).min(turn(files[1])),
            spacing: SPACING * radius,
        },
        linearity: [settings[0].linearity, settings[1].linearity],
        pieces,
        shortest: 2.0 * radius,
    }
}

/// Distance between stations at which values of the shared axis are compared, as a fraction of the
/// smaller cutter's radius.
const SPACING: f64 = 0.3;

/// Returns the postures of an operation in a pair: those of its search, and as far to the other
/// side as the pair allows.
fn posture_range(operation: &OperationFile, pair: &PairFile, uncut_left: bool) -> PostureRange {
    let s = &operation.search;
    let most = s.rotate_deg[1];
    let back = if pair.lean_back_deg > 0.0 { -pair.lean_back_deg.min(most) } else { s.rotate_deg[0] };
    // Right-handed about the outward normal: turning left, to the uncut stock there, is positive.
    let rotate = if uncut_left { [back, most] } else { [-most, -back] };
    PostureRange { tilt: s.tilt_deg.map(f64::to_radians), rotate: rotate.map(f64::to_radians) }
}

/// Returns a head's part of a run as a piece of its operation, which `piece` is or was a part of.
pub(crate) fn as_piece(head: usize, run: &PairRun, piece: &PassSegment) -> PieceMoves {
    let cut = |s: &SyncPoint| Cut { cc: s.cc[head], pose: s.pose.poses[head], inserted: !s.is_point(head) };
    let moves = run.stops.iter().enumerate().map(|(k, s)| Move {
        kind: if k == 0 { MoveKind::Engage } else { MoveKind::Cut },
        cl: s.pose.poses[head].cl,
        axes: s.pose.axes,
        chip: None,
    });
    PieceMoves {
        piece: PassSegment { cuts: run.stops.iter().map(cut).collect(), ..piece.clone() },
        moves: moves.collect(),
        turn: TurnState::NotSought,
    }
}

/// Sets the chips of a head's cutter in the moves of runs; `pieces` are the head's parts of the
/// runs.
/// `along` has their chips at every point.
fn give_run_chips(sections: &mut [Section], head: usize, pieces: &[PieceMoves], along: &[Vec<PointEngagement>]) {
    let mut pieces = pieces.iter().zip(along);
    // Chip at the end of the run before.
    let mut before = None;
    for k in 0..sections.len() {
        if sections[k].run.is_none() {
            continue;
        }
        let Some((piece, along)) = pieces.next() else { return };
        // Each run is between its entry, or the turn to it, and its exit.
        let [Some(lead), up] = [k.checked_sub(1), Some(k + 1)] else { continue };
        let n_turn = sections[lead].turn_moves();
        let of_turn = |sections: &mut [Section], section: usize, moves: &[Move]| {
            let own = sections[section].moves.iter_mut().zip(moves);
            own.for_each(|(m, of_piece)| m.chips[head] = of_piece.chip);
        };
        of_turn(sections, lead, &piece.moves[..n_turn]);
        of_turn(sections, k, &piece.moves[n_turn..]);
        // Behind a turn the first stop has the turn's chip.
        let ends = [(Some(lead), along.first()), (up, along.last())].map(|(s, end)| (s, end.map(|end| end.chip)));
        for (beside, chip) in ends {
            let Some(section) = beside.and_then(|beside| sections.get_mut(beside)) else { continue };
            give_engaged_chips(&mut section.moves, head, chip);
        }
        if let SectionTurn::Made { exit, lead } = &mut sections[lead].turn {
            give_engaged_chips(exit, head, before);
            give_engaged_chips(lead, head, ends[0].1);
        }
        before = ends[1].1;
    }
}

/// Sets the chips of a head's cutter in those moves of an entry or exit that are in the stock.
fn give_engaged_chips(moves: &mut [DualMove], head: usize, chip: Option<Chip>) {
    moves.iter_mut().filter(|m| m.kind == MoveKind::Engage).for_each(|m| m.chips[head] = chip);
}

/// Adds the head to a failure.
fn of_head(head: usize, why: Failure) -> Failure {
    match why {
        Failure::Infeasible(why) => Failure::Infeasible(format!("head {} alone: {why}", head + 1)),
        why => why,
    }
}

/// Counts how often each place of the path occurs in pieces.
type Places = BTreeMap<[u64; 3], usize>;

fn place(p: &Point3<f64>) -> [u64; 3] {
    p.coords.map(f64::to_bits).into()
}

/// Points of pieces, to be planned once each.
fn points_of(pieces: &[PassSegment]) -> Places {
    let mut points = Places::new();
    add_points(&mut points, pieces);
    points
}

fn add_points(points: &mut Places, pieces: &[PassSegment]) {
    for cut in pieces.iter().flat_map(|p| &p.cuts).filter(|c| !c.inserted) {
        *points.entry(place(&cut.cc.position)).or_default() += 1;
    }
}

/// Counts every point as often as it is to be planned: where two pieces of one head end at the
/// same, it belongs to the first of them. Of what is said to be lost the rest remains.
fn count_once<'p>(
    pieces: impl Iterator<Item = &'p mut PieceMoves>,
    mut requested: Places,
    lost: Vec<LeftOut>,
) -> Vec<LeftOut> {
    let mut take = |at: &Point3<f64>| match requested.get_mut(&place(at)) {
        Some(n) if *n > 0 => {
            *n -= 1;
            true
        }
        _ => false,
    };
    for cut in pieces.flat_map(|p| &mut p.piece.cuts).filter(|c| !c.inserted) {
        cut.inserted = !take(&cut.cc.position);
    }
    lost.into_iter().filter(|lost| take(&lost.place)).collect()
}

/// Returns the causes for the report, the most frequent first.
fn splits(causes: Causes) -> Vec<PairSplit> {
    let split = |(cause, of): (String, Cause)| PairSplit {
        cause,
        stations: of.stations,
        first_place_mm: of.place,
        first: of.first,
    };
    causes.sorted().into_iter().map(split).collect()
}
