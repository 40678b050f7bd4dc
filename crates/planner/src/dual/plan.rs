//! The whole way through one setup of a machine with two heads.

use std::collections::BTreeSet;

use facemill_cl_data::CcPoint;
use facemill_cutter_location::cusp::Strip;
use facemill_cutter_location::{PairSettings, PairTest, PoseTest, PostureRange, Workcell};
use facemill_inverse_kinematics::{AxisValues, Branch, Machine};
use facemill_z_map::ZMap;
use nalgebra::Point3;

use super::mending::{lines, mend};
use super::moves::{DualMove, DualMover, ReachedRun};
use super::output::{DualProgram, DualTexts, merged, proven_for_both, write_dual_texts};
use super::pairing::{PiecePair, pairs, stations};
use super::program::{DualTimes, dual_word_map};
use super::report::{PairReport, PairSplit};
use super::runs::{Cause, Causes, RunPlanner, Stop, left_over};
use crate::cell::{workcell, z_map};
use crate::job_file::{OperationFile, PairFile};
use crate::load::{Job, Setup};
use crate::mending::ROUNDS;
use crate::moves::{Move, MoveKind, MoveSettings, OperationMoves, PieceMoves, operation_moves};
use crate::operation::{Ground, PlannedOperation, along_passes, move_settings};
use crate::pieces::{Cut, LeftOut, Piece};
use crate::plan::{Clock, PlanSettings, Planned, name_parts, planned_files};
use crate::program::BlockWriter;
use crate::reporting::report;
use crate::turning::{Driven, Turning, rewinds_report, singular_blocks};
use crate::{Failure, Stages};

/// What both heads stand on.
pub(crate) struct DualGround<'a> {
    /// The job as each head sees it while it is planned: tool and cutter of the other one are larger than they are.
    pub jobs: [&'a Job; 2],
    /// The machine as each head sees it, with the other one's tool as it is.
    pub machines: [&'a Machine; 2],
    pub setups: [&'a Setup<'a>; 2],
    pub maps: [&'a ZMap; 2],
    /// Index of the axis that both share.
    pub shared: usize,
}

impl<'a> DualGround<'a> {
    fn ground(&self, head: usize) -> Ground<'a> {
        Ground { job: self.jobs[head], setup: self.setups[head], map: self.maps[head] }
    }

    pub(crate) fn cell(&self, head: usize, operation: &OperationFile) -> Workcell<'a> {
        workcell(self.jobs[head], self.setups[head], operation, self.maps[head])
    }
}

/// A part of the program: one operation, or two at once.
pub(crate) struct Part<'a> {
    /// Operation of each head, where it has one.
    pub files: [Option<&'a OperationFile>; 2],
    /// Moves with what a comment says of them.
    pub sections: Vec<Section>,
    /// What the report says of a pair, but for its times.
    pub pair: Option<PairOutline>,
}

/// Moves under one comment.
pub(crate) struct Section {
    pub comment: String,
    pub moves: Vec<DualMove>,
    /// The stops that its moves go to, where both heads cut.
    pub stops: Option<Vec<Stop>>,
}

/// What is known of a pair before it is timed.
pub(crate) struct PairOutline {
    pub file: PairFile,
    /// Whether the uncut stock lies to the left of the feed, for each head.
    pub uncut_left: [bool; 2],
    pub runs: usize,
    pub separate_time: f64,
    pub splits: Vec<PairSplit>,
}

/// Plans one setup of a job on a machine with two heads.
///
/// # Errors
/// As [`crate::plan_setup`].
pub(crate) fn plan_dual_setup(
    job: &Job,
    index: usize,
    settings: PlanSettings,
    stages: &dyn Stages,
) -> Result<Planned, Failure> {
    let mut clock = Clock::new();
    let planned_by = [job.seen_by(0, HEADS_APART), job.seen_by(1, HEADS_APART)];
    let run_by = [job.seen_by(0, 0.0), job.seen_by(1, 0.0)];
    let jobs = [&planned_by[0], &planned_by[1]];
    let setups = [Setup::read(jobs[0], index)?, Setup::read(jobs[1], index)?];
    let setups = [&setups[0], &setups[1]];
    let maps = [z_map(setups[0])?, z_map(setups[1])?];
    let machine = &job.machine;
    let shared: Vec<usize> = (0..machine.axes().len()).filter(|k| machine.is_shared(*k)).collect();
    let [shared] = shared[..] else {
        return Err(job.wrong(format!("machine: its two heads share {} axes; pairs are planned for one", shared.len())));
    };
    let words = dual_word_map(jobs, setups[0], index)?;
    clock.lap("read");
    let machines = [&run_by[0].machine, &run_by[1].machine];
    let ground = DualGround { jobs, machines, setups, maps: [&maps[0], &maps[1]], shared };
    let mut operations: Vec<(usize, usize, PlannedOperation<'_>)> = Vec::new();
    let mut parts: Vec<Part<'_>> = Vec::new();
    let mut picture = None;
    let mut at: Option<AxisValues> = None;
    for (k, operation) in jobs[0].operations_of(setups[0].file) {
        let pair = job.file.pairs.iter().find(|p| p.first == operation.name || p.second == operation.name);
        match pair {
            Some(pair) if operations.iter().any(|(_, _, o)| o.operation.name == pair.first) => {}
            Some(pair) => {
                let (planned, part) =
                    PairPlanner { ground: &ground, pair, stages }.plan(&mut at, &mut picture, &mut clock)?;
                operations.extend(planned);
                parts.push(part);
            }
            None => {
                let head = operation.head as usize - 1;
                let (planned, part) = alone(&ground, head, k, &mut at, &mut picture, stages, &mut clock)?;
                operations.push((head, k, planned));
                parts.push(part);
            }
        }
    }
    let mut mended = 0;
    let mut rounds = 0;
    let (texts, verifications, certificates) = loop {
        let texts = write_dual_texts(&ground, &parts, &words, settings.verify)?;
        clock.lap("program");
        let program = DualProgram { ground: &ground, parts: &parts, words: &words, texts: &texts };
        let verifications = if settings.verify { Some(program.verify(stages)?) } else { None };
        clock.lap("verify");
        let certificates = if settings.certificates { Some(program.certify(stages)?) } else { None };
        clock.lap("certify");
        rounds += 1;
        let lines = lines(verifications.as_ref(), certificates.as_ref());
        let put_in = if rounds == ROUNDS { 0 } else { mend(&ground, &mut parts, &texts, &lines) };
        clock.lap("mend");
        if put_in == 0 {
            break (texts, verifications, certificates);
        }
        mended += put_in;
    };
    let (planned, heads): (Vec<PlannedOperation<'_>>, Vec<usize>) =
        operations.into_iter().map(|(head, _, o)| (o, head)).unzip();
    let verification = verifications.map(|v| merged(v, &heads, &parts, &planned));
    let certificates = certificates.as_ref().map(proven_for_both);
    let turning = texts.turning(&parts, &ground);
    let mut report = report(jobs[0], setups[0], &planned, &texts.timed, turning, verification, certificates.as_ref());
    report.pairs = texts.pair_reports(&parts, &ground);
    report.totals.mended_blocks = mended;
    let (suffix, state) = name_parts(job, setups[0], &report);
    let files = texts.files(&suffix, state, certificates)?;
    Ok(planned_files(&suffix, report, files, picture, clock))
}

/// An operation that one head machines with the other at home.
fn alone<'a>(
    ground: &DualGround<'a>,
    head: usize,
    index: usize,
    at: &mut Option<AxisValues>,
    picture: &mut Option<String>,
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<(PlannedOperation<'a>, Part<'a>), Failure> {
    let (job, setup) = (ground.jobs[head], ground.setups[head]);
    let operation = &job.file.operations[index];
    let cells = cells(ground, operation, operation);
    let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
    let settings = [
        move_settings(ground.jobs[0], ground.setups[0], operation),
        move_settings(ground.jobs[1], ground.setups[1], operation),
    ];
    let mover = mover(ground, &tests, [&settings[0], &settings[1]]);
    let parked = at.map(|at| mover.parked(&at, 1 - head));
    let mut sections = Vec::new();
    if let (Some(from), Some(to)) = (*at, parked) {
        sections.push(section(format!("HEAD {} ALONE", head + 1), mover.cross(&from, &to)?));
    }
    let from = parked.map(|axes| Move { kind: MoveKind::Rapid, cl: mover.cl(head, &axes), axes });
    let ground = Ground { job, setup, map: ground.maps[head] };
    let (planned, svg) = PlannedOperation::plan(&ground, (index, operation), from, picture.is_none(), stages, clock)?;
    *picture = picture.take().or(svg);
    sections.extend(alone_sections(head, &planned.moves));
    *at = planned.moves.last().map(|m| m.axes).or(*at);
    let mut files = [None; 2];
    files[head] = Some(operation);
    Ok((planned, Part { files, sections, pair: None }))
}

/// The moves of one head's pieces, piece by piece.
fn alone_sections(head: usize, moves: &OperationMoves) -> Vec<Section> {
    let mut working = [false; 2];
    working[head] = true;
    let dual = |m: &Move| DualMove { kind: m.kind, axes: m.axes, working };
    let of_pieces = moves.pieces.iter().map(|p| {
        let comment = format!("HEAD {} PASS {} PLACE {}", head + 1, p.piece.pass + 1, p.piece.copy + 1);
        section(comment, p.moves.iter().map(dual).collect())
    });
    let retract = section(String::new(), moves.retract.iter().map(dual).collect());
    of_pieces.chain([retract]).collect()
}

fn section(comment: String, moves: Vec<DualMove>) -> Section {
    Section { comment, moves, stops: None }
}

fn cells<'a>(ground: &DualGround<'a>, first: &OperationFile, second: &OperationFile) -> [Workcell<'a>; 2] {
    [ground.cell(0, first), ground.cell(1, second)]
}

fn mover<'r, 'c>(
    ground: &DualGround<'_>,
    tests: &'r [PoseTest<'c>; 2],
    settings: [&'r MoveSettings; 2],
) -> DualMover<'r, 'c> {
    DualMover { test: PairTest { tests: [&tests[0], &tests[1]], shared: ground.shared }, settings }
}

/// Plans two operations at once.
struct PairPlanner<'p, 'a> {
    ground: &'p DualGround<'a>,
    pair: &'p PairFile,
    stages: &'p dyn Stages,
}

/// Planned operations with their heads and numbers in the job.
type HeadOperations<'a> = [(usize, usize, PlannedOperation<'a>); 2];

impl<'a> PairPlanner<'_, 'a> {
    fn plan(
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
        let planner = run_planner(&mover, files, &settings, self.pair, uncut_left(slices), slices);
        for run in &runs {
            linearisation = linearisation.max(planner.linearisation(&run.stops));
        }
        for h in 0..2 {
            let left = left_over(slices[h], h, &runs);
            let mut alone = OperationMoves::default();
            if !left.is_empty() {
                let parked = at.map(|at| mover.parked(&at, 1 - h));
                if let (Some(from), Some(to)) = (*at, parked) {
                    sections.push(section(format!("HEAD {} ALONE", h + 1), mover.cross(&from, &to)?));
                }
                let from = parked.map(|axes| Move { kind: MoveKind::Rapid, cl: mover.cl(h, &axes), axes });
                let monitor = self.stages.start("left for one head", 2 * left.len());
                let left_out = &mut planned[h].2.left_out;
                alone = operation_moves(&tests[h], &settings[h], left, from, left_out, &*monitor)?;
                count_once(&mut alone, left_out, &reached, h);
                sections.extend(alone_sections(h, &alone));
                *at = alone.last().map(|m| m.axes).or(*at);
            }
            let cut = reached.iter().map(|r| as_piece(h, r, &pieces[h]));
            let all: Vec<PieceMoves> = cut.chain(alone.pieces).collect();
            let moves = OperationMoves {
                pieces: all,
                retract: alone.retract,
                linearisation: alone.linearisation.max(linearisation),
            };
            let own = &mut planned[h].2;
            own.along = along_passes(ground.jobs[h], ground.setups[h], files[h], &moves, self.stages)?;
            own.moves = moves;
        }
        clock.lap("moves of both");
        let splits = splits(causes);
        let pair = PairOutline {
            file: self.pair.clone(),
            uncut_left: uncut_left(slices),
            runs: runs.len(),
            separate_time,
            splits,
        };
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
        use rayon::prelude::*;
        let feeds = files.map(|f| f.feeds.cutting_mm_min / 60.0);
        let asked = |piece: &Piece| -> Vec<_> { piece.cuts.iter().filter(|c| !c.inserted).map(|c| c.cc).collect() };
        let together: Vec<PiecePair> = pairs(pieces[0], pieces[1])
            .into_iter()
            .map(|[i, j]| {
                let passes = [asked(&pieces[0][i]), asked(&pieces[1][j])];
                PiecePair { pieces: [i, j], stations: stations([&passes[0], &passes[1]], feeds) }
            })
            .collect();
        let planner = run_planner(mover, files, settings, self.pair, uncut_left(pieces), pieces);
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
        let (reached, why) = mover.reach(runs, pieces, &*monitor)?;
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
        sections.push(Section { comment: String::new(), moves: cuts, stops: Some(run.run.stops.clone()) });
        sections.push(section(String::new(), up));
        Ok(sections)
    }
}

/// Whether the uncut stock lies to the left of the feed, for each head.
fn uncut_left(pieces: [&[Piece]; 2]) -> [bool; 2] {
    pieces.map(|p| p.first().is_some_and(|p| p.uncut_left))
}

/// What the pieces of a pair are planned with.
pub(crate) fn run_planner<'r, 'a>(
    mover: &DualMover<'r, 'a>,
    files: [&OperationFile; 2],
    settings: &[MoveSettings; 2],
    pair: &PairFile,
    uncut_left: [bool; 2],
    pieces: [&'r [Piece]; 2],
) -> RunPlanner<'r, 'a> {
    let ranges = [0, 1].map(|h| posture_range(files[h], pair, uncut_left[h]));
    let radius = mover.test.tests[0].cell.tool.cutter().radius().min(mover.test.tests[1].cell.tool.cutter().radius());
    let turn = |f: &OperationFile| f.search.max_turn_deg_per_mm.to_radians();
    RunPlanner {
        test: mover.test,
        settings: PairSettings {
            ranges,
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

/// Distance that the two tools keep from each other at planned stands, mm: what moves between them is run and proven.
const HEADS_APART: f64 = 1.0;

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

/// A head's part of a run as a piece of its operation.
fn as_piece(head: usize, reached: &ReachedRun, pieces: &[Piece]) -> PieceMoves {
    let stops = &reached.run.stops;
    let cuts: Vec<Cut> =
        stops.iter().map(|s| Cut { cc: s.cc[head], pose: s.pose.poses[head], inserted: !s.is_point(head) }).collect();
    let moves = stops.iter().enumerate().map(|(k, s)| Move {
        kind: if k == 0 { MoveKind::Engage } else { MoveKind::Cut },
        cl: s.pose.poses[head].cl,
        axes: s.pose.axes,
    });
    let moves = moves.collect();
    PieceMoves { piece: Piece { cuts, ..pieces[reached.run.pieces[head]].clone() }, moves }
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

impl DualTexts {
    /// Axes that turn back or race at the pole, of either head.
    fn turning(&self, parts: &[Part<'_>], ground: &DualGround<'_>) -> Turning {
        let mut all: Option<Turning> = None;
        for h in 0..2 {
            let job = ground.jobs[h];
            let work_from_table = ground.setups[h].table_from_work.inverse();
            let mut from = None;
            let mut driven = Vec::new();
            for (line, place) in &self.places {
                let part = &parts[place.part];
                let m = part.sections[place.section].moves[place.at];
                let cl = job.machine.cl_point(&m.axes, job.tool.gauge_length()).transformed(&work_from_table);
                let to = Move { kind: m.kind, cl, axes: m.axes };
                let before = from.replace(to);
                if let Some(operation) = part.files[h].filter(|_| m.working[h]) {
                    driven.push(Driven { operation, goes_on: false, from: before, to, line: *line });
                }
            }
            let branches =
                driven.iter().filter(|m| m.to.kind == MoveKind::Cut).map(|m| job.machine.branch_of(&m.to.axes));
            let branches: Vec<Branch> = branches.collect();
            let changes = branches.windows(2).filter(|w| w[0] != w[1]).count();
            let rewinds = rewinds_report(job, &driven, changes);
            let singular_blocks = singular_blocks(job, &driven);
            match &mut all {
                None => all = Some(Turning { rewinds, singular_blocks }),
                Some(all) => all.join(Turning { rewinds, singular_blocks }),
            }
        }
        all.unwrap_or_default()
    }

    /// What the report says of the program's pairs.
    fn pair_reports(&self, parts: &[Part<'_>], ground: &DualGround<'_>) -> Vec<PairReport> {
        parts.iter().zip(&self.times).filter_map(|(part, times)| pair_report(part, times, ground)).collect()
    }
}

fn pair_report(part: &Part<'_>, times: &DualTimes, ground: &DualGround<'_>) -> Option<PairReport> {
    let outline = part.pair.as_ref()?;
    let axis = &ground.jobs[0].machine.axes()[ground.shared];
    let (paired, cut): (f64, f64) = (times.paired.iter().sum(), times.cut.iter().sum());
    let range = |feeds: &Vec<f64>| {
        let smallest = feeds.iter().copied().reduce(f64::min)?;
        Some([smallest, feeds.iter().copied().fold(smallest, f64::max)])
    };
    Some(PairReport {
        first: outline.file.first.clone(),
        second: outline.file.second.clone(),
        shared_axis: axis.letter.to_string(),
        runs: outline.runs,
        paired_length_mm: times.paired,
        cutting_length_mm: times.cut,
        paired_fraction: if cut > 0.0 { paired / cut } else { 0.0 },
        time_s: times.time,
        separate_time_s: outline.separate_time,
        time_ratio: if outline.separate_time > 0.0 { times.time / outline.separate_time } else { 0.0 },
        tip_feed_mm_min: [range(&times.tip_feeds[0]), range(&times.tip_feeds[1])],
        shared_velocity: axis.in_word_unit(times.shared_speed),
        splits: outline.splits.clone(),
    })
}
