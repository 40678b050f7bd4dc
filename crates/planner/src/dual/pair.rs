//! Two operations at once: from the plans of each alone to one part of the program.

use std::collections::BTreeSet;

use facemill_cl_data::CcPoint;
use facemill_cutter_location::cusp::Strip;
use facemill_cutter_location::{PairSettings, PoseTest, PostureRange};
use facemill_inverse_kinematics::AxisValues;
use nalgebra::Point3;
use rayon::prelude::*;

use super::moves::{DualMove, DualMover, ReachedRun};
use super::pairing::{PiecePair, pairs, stations};
use super::plan::{DualGround, PairOutline, Part, Section, alone_sections, cells, mover, section};
use super::report::PairSplit;
use super::runs::{Cause, Causes, Run, RunPlanner, Stop, left_over};
use crate::job_file::{OperationFile, PairFile};
use crate::moves::{Move, MoveKind, MoveSettings, OperationMoves, PieceMoves, operation_moves};
use crate::operation::{PlannedOperation, along_passes, move_settings};
use crate::pieces::{Cut, LeftOut, Piece};
use crate::plan::Clock;
use crate::program::BlockWriter;
use crate::{Failure, Stages};

/// Plans two operations at once.
pub(crate) struct PairPlanner<'p, 'a> {
    pub ground: &'p DualGround<'a>,
    pub pair: &'p PairFile,
    pub stages: &'p dyn Stages,
}

/// Planned operations with their heads and numbers in the job.
pub(crate) type HeadOperations<'a> = [(usize, usize, PlannedOperation<'a>); 2];

impl<'a> PairPlanner<'_, 'a> {
    /// The two operations and their part of the program; `at` is where the machine is before and after it.
    ///
    /// # Errors
    /// As [`crate::plan_setup`].
    pub(crate) fn plan(
        &self,
        at: &mut Option<AxisValues>,
        picture: &mut Option<String>,
        clock: &mut Clock,
    ) -> Result<(HeadOperations<'a>, Part<'a>), Failure> {
        let ground = self.ground;
        let mut single = |head: usize, name: &str| {
            let named = ground.jobs[head].operations_of(ground.setups[head].file).find(|(_, o)| o.name == name);
            let named = named.ok_or_else(|| Failure::Internal(format!("operation \"{name}\" is not of this setup")))?;
            let wants_picture = head == 0 && picture.is_none();
            let (planned, svg) =
                PlannedOperation::plan(&ground.ground(head), named, None, wants_picture, self.stages, clock)?;
            *picture = picture.take().or(svg);
            Ok::<_, Failure>((head, named.0, planned))
        };
        let mut planned = [single(0, &self.pair.first)?, single(1, &self.pair.second)?];
        let separate_time = self.separate_time(&planned)?;
        let pieces: [Vec<Piece>; 2] =
            std::array::from_fn(|h| planned[h].2.moves.pieces.iter().map(|p| p.piece.clone()).collect());
        let files = [planned[0].2.operation, planned[1].2.operation];
        let cells = cells(ground, files[0], files[1]);
        let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
        let settings = [0, 1].map(|h| move_settings(ground.jobs[h], ground.setups[h], files[h]));
        let mover = mover(ground, &tests, [&settings[0], &settings[1]]);
        let slices = [pieces[0].as_slice(), pieces[1].as_slice()];
        let (reached, causes) = self.reached(&mover, slices, files, &settings)?;
        clock.lap("pair");
        let mut sections = Vec::new();
        for run in &reached {
            sections.extend(Self::run_sections(&mover, run, slices, at)?);
        }
        let runs: Vec<_> = reached.iter().map(|r| r.run.clone()).collect();
        let mut linearisation = 0.0_f64;
        let planner = run_planner(&mover, files, &settings, self.pair, slices);
        for run in &runs {
            linearisation = linearisation.max(planner.linearisation(&run.stops));
        }
        for h in 0..2 {
            let left = left_over(slices[h], h, &runs);
            let mut alone = OperationMoves::default();
            if !left.is_empty() {
                let (parking, from) = mover.park_other(h, *at)?;
                sections.push(section(format!("HEAD {} ALONE", h + 1), parking));
                let monitor = self.stages.start("left for one head", 2 * left.len());
                let left_out = &mut planned[h].2.left_out;
                alone = operation_moves(&tests[h], &settings[h], left, from, left_out, &*monitor)?;
                count_once(&mut alone, left_out, &reached, h);
                sections.extend(alone_sections(h, &alone));
                *at = alone.last().map(|m| m.axes).or(*at);
            }
            let cut = reached.iter().map(|r| as_piece(h, &r.run, &pieces[h][r.run.pieces[h]]));
            let all: Vec<PieceMoves> = cut.chain(alone.pieces).collect();
            let moves = OperationMoves {
                pieces: all,
                retract: alone.retract,
                linearisation: alone.linearisation.max(linearisation),
            };
            let own = &mut planned[h].2;
            // That was of the plan for one head.
            own.optimum = None;
            own.along = along_passes(ground.jobs[h], ground.setups[h], files[h], &moves, self.stages)?;
            own.moves = moves;
        }
        clock.lap("moves of both");
        let splits = splits(causes);
        let pair = PairOutline { file: self.pair.clone(), runs: runs.len(), separate_time, splits };
        let part = Part { files: files.map(Some), sections, pair: Some(pair) };
        Ok((planned, part))
    }

    /// Time of both operations one after the other, each by its head alone, s.
    fn separate_time(&self, planned: &HeadOperations<'a>) -> Result<f64, Failure> {
        let mut sum = 0.0;
        for (head, _, operation) in planned {
            let job = self.ground.jobs[*head];
            let words = crate::program::word_map(job, self.ground.setups[*head], 0)?;
            let mut writer = BlockWriter::new(job, &words)?;
            writer.operation(operation.operation, &operation.moves)?;
            let timed = writer.finish();
            sum += timed.cutting_time + timed.approach_time + timed.rapid_time;
        }
        Ok(sum)
    }

    /// Runs of both heads with their entries and exits, in cutting order, and why other stations have none.
    fn reached(
        &self,
        mover: &DualMover<'_, '_>,
        pieces: [&[Piece]; 2],
        files: [&OperationFile; 2],
        settings: &[MoveSettings; 2],
    ) -> Result<(Vec<ReachedRun>, Causes), Failure> {
        let feeds = files.map(|f| f.feeds.cutting_mm_min / 60.0);
        let asked = |piece: &Piece| -> Vec<_> { piece.cuts.iter().filter(|c| !c.inserted).map(|c| c.cc).collect() };
        let together: Vec<PiecePair> = pairs(pieces[0], pieces[1])
            .into_iter()
            .map(|[i, j]| {
                let passes = [asked(&pieces[0][i]), asked(&pieces[1][j])];
                PiecePair { pieces: [i, j], stations: stations([&passes[0], &passes[1]], feeds) }
            })
            .collect();
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
        let mut causes = Causes::default();
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

    /// The link to a run, its entry, cuts and exit; `at` is where both heads are before and after it.
    fn run_sections(
        mover: &DualMover<'_, '_>,
        run: &ReachedRun,
        pieces: [&[Piece]; 2],
        at: &mut Option<AxisValues>,
    ) -> Result<Vec<Section>, Failure> {
        let piece = |h: usize| &pieces[h][run.run.pieces[h]];
        let comment = format!("PASSES {} AND {} PLACE {}", piece(0).pass + 1, piece(1).pass + 1, piece(0).copy + 1);
        let mut sections = Vec::new();
        let mut moves = Vec::new();
        let mut last = *at;
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
            cuts.push(DualMove { kind, axes, working: [true; 2] });
            last = Some(axes);
        }
        let mut up = Vec::new();
        for m in &run.up {
            let axes = last.map_or(m.axes, |near| mover.turned(&m.axes, &near));
            up.push(DualMove { axes, ..*m });
            last = Some(axes);
        }
        *at = last;
        sections.push(section(comment, moves));
        sections.push(Section { comment: String::new(), moves: cuts, run: Some(run.run.clone()) });
        sections.push(section(String::new(), up));
        Ok(sections)
    }
}

/// What the pieces of a pair are planned with.
pub(crate) fn run_planner<'r, 'a>(
    mover: &DualMover<'r, 'a>,
    files: [&OperationFile; 2],
    settings: &[MoveSettings; 2],
    pair: &PairFile,
    pieces: [&'r [Piece]; 2],
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
            strips: files.map(|f| Strip { step_over: f.tolerances.max_step_over_mm, curvature: 0.0 }),
            max_turn_per_mm: turn(files[0]).min(turn(files[1])),
            spacing: SPACING * radius,
        },
        linearity: [settings[0].linearity, settings[1].linearity],
        pieces,
        shortest: 2.0 * radius,
    }
}

/// Way between stations at which values of the shared axis are compared, as part of the smaller cutter's radius.
const SPACING: f64 = 0.3;

/// Postures of an operation in a pair: those of its search, and as far to the other side as the pair allows.
fn posture_range(operation: &OperationFile, pair: &PairFile, uncut_left: bool) -> PostureRange {
    let s = &operation.search;
    let (back, most) = (-pair.lean_back_deg.min(s.rotate_deg[1]), s.rotate_deg[1]);
    // Right-handed about the outward normal: turning left, to the uncut stock there, is positive.
    let rotate = if uncut_left { [back, most] } else { [-most, -back] };
    PostureRange { tilt: s.tilt_deg.map(f64::to_radians), rotate: rotate.map(f64::to_radians) }
}

/// A head's part of a run as a piece of its operation, which `piece` is or was a part of.
pub(crate) fn as_piece(head: usize, run: &Run, piece: &Piece) -> PieceMoves {
    let cut = |s: &Stop| Cut { cc: s.cc[head], pose: s.pose.poses[head], inserted: !s.is_point(head) };
    let moves = run.stops.iter().enumerate().map(|(k, s)| Move {
        kind: if k == 0 { MoveKind::Engage } else { MoveKind::Cut },
        cl: s.pose.poses[head].cl,
        axes: s.pose.axes,
    });
    PieceMoves { piece: Piece { cuts: run.stops.iter().map(cut).collect(), ..piece.clone() }, moves: moves.collect() }
}

/// Points at which both a run and a piece of one head end belong to the run.
fn count_once(alone: &mut OperationMoves, left_out: &mut Vec<LeftOut>, reached: &[ReachedRun], head: usize) {
    let place = |p: &Point3<f64>| p.coords.map(f64::to_bits).into();
    let bits = |cc: &CcPoint| place(&cc.position);
    let in_runs: BTreeSet<[u64; 3]> =
        reached.iter().flat_map(|r| &r.run.stops).filter(|s| s.is_point(head)).map(|s| bits(&s.cc[head])).collect();
    for cut in alone.pieces.iter_mut().flat_map(|p| &mut p.piece.cuts) {
        cut.inserted |= in_runs.contains(&bits(&cut.cc));
    }
    left_out.retain(|lost| !in_runs.contains(&place(&lost.place)));
}

/// Causes as the report tells them, the most frequent first.
fn splits(causes: Causes) -> Vec<PairSplit> {
    let told = |(cause, of): (String, Cause)| PairSplit {
        cause,
        stations: of.stations,
        first_place_mm: of.place,
        first: of.first,
    };
    causes.sorted().into_iter().map(told).collect()
}
