//! The whole way through one setup: path, postures, moves, text, verification, report.

use std::collections::BTreeMap;
use std::time::Instant;

use facemill_cl_data::{ClPoint, Silent};
use facemill_cutter_location::cusp::{CutPoint, Ridge, ridges};
use facemill_cutter_location::link::{ClearanceSurface, LinkSettings};
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PoseTest, SearchCurve, plan_passes, search, solution_space,
};
use facemill_nc_program::{AptCutter, AptMove, AptSpec, read_program, write_apt, write_program};
use facemill_tool_model::Cusp;
use facemill_virtual_machine::{
    ObstacleKind, Verification, VerifyError, VerifySettings, VirtualObstacle, VirtualSetup, verify,
};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::cell::{budget, diagonal, search_settings, workcell, z_map};
use crate::chips::chip_area_at;
use crate::job_file::{ClearanceFile, InfeasibleFile, OperationFile};
use crate::load::{Job, ObstacleRole, Setup, direction};
use crate::moves::{MoveKind, MoveSettings, OperationMoves, approach_settings, operation_moves};
use crate::path::lay;
use crate::pieces::{Cut, LaidTask, LeftOut, Piece, copy_outcomes, places, split};
use crate::program::{BlockWriter, Timed, program_spec, word_map};
use crate::report::{BudgetReport, InfeasibleReport, PassReport, REPORT_FORMAT, Report, Totals, Worst};
use crate::solution_svg::solution_svg;
use crate::{Failure, Stages};

/// What is wanted of a plan.
#[derive(Clone, Copy, Debug)]
pub struct PlanSettings {
    /// Run the written program on the virtual machine.
    pub verify: bool,
}

/// A planned setup: files to be written and the report on them.
pub struct Planned {
    /// Names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// The report; it is one of the files, too.
    pub report: Report,
    /// Wall time of each stage, s; not deterministic.
    pub timings: Vec<(&'static str, f64)>,
}

impl Planned {
    /// Whether the program can be run as it is: no finding but near misses, and no more left out than the job allows.
    pub fn is_clean(&self) -> bool {
        let faults = self.report.findings.iter().any(|f| f.kind.is_fault());
        !faults && !self.report.totals.trims_too_much()
    }
}

/// An operation on its way to the program.
struct PlannedOperation<'a> {
    operation: &'a OperationFile,
    moves: OperationMoves,
    /// Ridge and chip at every cut of every piece of the first place.
    chips: Vec<Vec<Along>>,
}

/// What is known along a pass besides poses.
#[derive(Clone, Copy)]
struct Along {
    ridge: Option<Ridge>,
    chip_area: Option<f64>,
}

/// Plans one setup of a job.
///
/// # Errors
/// When the input is wrong, the job cannot be planned under its own terms, or the stages are cancelled.
pub fn plan_setup(job: &Job, index: usize, settings: PlanSettings, stages: &dyn Stages) -> Result<Planned, Failure> {
    let mut clock = Clock::new();
    let setup = Setup::read(job, index)?;
    let map = z_map(&setup)?;
    let words = word_map(job, &setup, index)?;
    clock.lap("read");
    let mut left_out = Vec::new();
    let mut totals = Totals::default();
    let mut operations = Vec::new();
    let mut picture = None;
    for (operation_index, operation) in job.operations_of(setup.file) {
        let cell = workcell(job, &setup, operation, &map);
        let test = PoseTest::new(&cell);
        let laid = lay(job, &setup, operation_index, operation)?;
        totals.dropped_pieces += laid.dropped_pieces;
        clock.lap("path");
        let pieces = place_pieces(&test, operation, &laid.tasks, &mut left_out, &mut totals, stages)?;
        clock.lap("search");
        if picture.is_none() {
            picture = picture_of(&test, operation, &laid.tasks, &pieces)?;
        }
        let move_settings = move_settings(job, &setup, operation);
        let monitor = stages.start("entries and links", 2 * pieces.len());
        let moves = operation_moves(&test, &move_settings, pieces, &mut left_out, &*monitor)?;
        drop(monitor);
        clock.lap("moves");
        let chips = along_passes(job, &setup, operation, &moves, stages)?;
        clock.lap("cusps and chips");
        operations.push(PlannedOperation { operation, moves, chips });
    }
    check_left_out(&operations, &left_out)?;
    let (timed, text, apt) = write_texts(job, &setup, &operations, &words)?;
    clock.lap("program");
    let verification =
        if settings.verify { Some(verify_text(job, &setup, &operations, &words, &text, stages)?) } else { None };
    clock.lap("verify");
    let report = report(job, &setup, &operations, &timed, totals, &left_out, verification);
    let suffix = if job.file.setups.len() > 1 { format!("-{}", file_name(&setup.file.name)) } else { String::new() };
    let mut files = vec![
        (format!("program{suffix}.nc"), text.into_bytes()),
        (format!("program{suffix}.apt"), apt.into_bytes()),
        (format!("report{suffix}.json"), facemill_file_format::to_json(&report).into_bytes()),
    ];
    files.extend(picture.map(|svg| (format!("solution-space{suffix}.svg"), svg.into_bytes())));
    Ok(Planned { files, report, timings: clock.laps })
}

/// A setup's name as part of a file name.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

/// Wall times of stages.
struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Clock {
    fn new() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }

    fn lap(&mut self, what: &'static str) {
        let seconds = self.last.elapsed().as_secs_f64();
        match self.laps.iter_mut().find(|(name, _)| *name == what) {
            Some((_, sum)) => *sum += seconds,
            None => self.laps.push((what, seconds)),
        }
        self.last = Instant::now();
    }
}

/// Poses in every place of the pattern, as pieces in cutting order.
fn place_pieces(
    test: &PoseTest<'_>,
    operation: &OperationFile,
    tasks: &[LaidTask],
    left_out: &mut Vec<LeftOut>,
    totals: &mut Totals,
    stages: &dyn Stages,
) -> Result<Vec<Piece>, Failure> {
    let places = places(operation.pattern.as_ref());
    let n_points: usize = tasks.iter().map(|t| t.pass.points.len()).sum();
    totals.cc_points += n_points * places.len();
    let monitor = stages.start("tilt and rotate", n_points * places.len());
    let settings = PassSettings {
        search: search_settings(operation),
        max_turn_per_mm: operation.search.max_turn_deg_per_mm.to_radians(),
    };
    let pass_tasks: Vec<PassTask> = tasks.iter().map(|t| PassTask { pass: t.pass.clone(), curve: t.curve }).collect();
    let outcomes = plan_passes(test, &pass_tasks, &settings, &*monitor)?;
    let mut pieces = split(test, tasks, &outcomes, 0, left_out);
    for (copy, place) in places.iter().enumerate().skip(1) {
        let (copied, results) = copy_outcomes(test, tasks, &outcomes, place, &settings.search, &*monitor)?;
        pieces.extend(split(test, &copied, &results, copy as u32, left_out));
    }
    Ok(pieces)
}

/// The solution space at the point of the first place that needs the largest tilt, the first of equals: where it is
/// narrowest.
fn picture_of(
    test: &PoseTest<'_>,
    operation: &OperationFile,
    tasks: &[LaidTask],
    pieces: &[Piece],
) -> Result<Option<String>, Failure> {
    let cuts =
        pieces.iter().filter(|p| p.copy == 0).flat_map(|p| p.cuts.iter().enumerate().map(move |(k, c)| (p, k, c)));
    let steeper = |a: &Cut, b: &Cut| a.pose.posture.tilt > b.pose.posture.tilt;
    let narrowest = cuts.fold(None, |best: Option<(&Piece, usize, &Cut)>, next| match best {
        Some(b) if !steeper(next.2, b.2) => Some(b),
        _ => Some(next),
    });
    let Some((piece, point, cut)) = narrowest else { return Ok(None) };
    let curve = &tasks[piece.pass].curve;
    let title = format!("{}, pass {}, point {} of the piece", operation.name, piece.pass + 1, point + 1);
    Ok(Some(solution_picture(test, &cut.cc, curve, &search_settings(operation), &title)?))
}

/// Columns and rows of the picture's grid.
const PICTURE_COLUMNS: usize = 61;
const PICTURE_ROWS: usize = 69;

/// The solution space at a CC point as a picture, from tilt 0 and rotate 0 to the ends of the curve.
fn solution_picture(
    test: &PoseTest<'_>,
    cc: &facemill_cl_data::CcPoint,
    curve: &SearchCurve,
    settings: &facemill_cutter_location::SearchSettings,
    title: &str,
) -> Result<String, Failure> {
    let steps = |to: f64, n: usize| (0..n).map(|k| to * k as f64 / (n - 1) as f64).collect::<Vec<f64>>();
    let end = curve.end();
    let rotate_end = if end.rotate == 0.0 { -85f64.to_radians() } else { end.rotate };
    let space = solution_space(test, cc, steps(end.tilt, PICTURE_COLUMNS), steps(rotate_end, PICTURE_ROWS), &Silent)?;
    let found = search(test, cc, curve, settings, 0.0, None, &mut Hints::default()).ok();
    Ok(solution_svg(&space, curve, found.map(|f| f.pose.posture), title))
}

fn move_settings(job: &Job, setup: &Setup<'_>, operation: &OperationFile) -> MoveSettings {
    let clearance = setup.file.rapid_clearance_mm;
    // Along the tool axis, out of any stock that the tool can be in.
    let max_retract = diagonal(&setup.aabb()).max(100.0);
    MoveSettings {
        entry: approach_settings(&operation.entry, clearance, max_retract),
        exit: approach_settings(&operation.exit, clearance, max_retract),
        link: LinkSettings { clearance: clearance_surface(&setup.file.clearance), rapid_clearance: clearance },
        linearisation: operation.tolerances.linearisation_mm,
        // Half of the distance that rapids keep anyway.
        rapid_linearisation: 0.5 * clearance,
        rounding: job.post.rounding_bound(),
    }
}

fn clearance_surface(file: &ClearanceFile) -> ClearanceSurface {
    match file {
        ClearanceFile::Plane(p) => {
            ClearanceSurface::Plane { origin: Point3::from(p.origin_mm), normal: direction(&p.normal) }
        }
        ClearanceFile::Cylinder(c) => ClearanceSurface::Cylinder {
            origin: Point3::from(c.origin_mm),
            axis: direction(&c.axis),
            radius: c.radius_mm,
        },
        ClearanceFile::Sphere(s) => ClearanceSurface::Sphere { center: Point3::from(s.center_mm), radius: s.radius_mm },
    }
}

/// Points of a piece at which the chip section is computed; it changes as slowly as the surface does.
const CHIPS_PER_PIECE: usize = 32;

/// Ridges and chips along the pieces of the first place; the other places are alike.
fn along_passes(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    moves: &OperationMoves,
    stages: &dyn Stages,
) -> Result<Vec<Vec<Along>>, Failure> {
    let cutter = job.tool.cutter();
    let reach = 3.0 * operation.tolerances.max_step_over_mm;
    let first: Vec<&Piece> = moves.pieces.iter().map(|p| &p.piece).filter(|p| p.copy == 0).collect();
    let points = |piece: &Piece| -> Vec<CutPoint> {
        piece.cuts.iter().map(|c| CutPoint { cc: c.cc, posture: c.pose.posture }).collect()
    };
    let monitor = stages.start("cusps and chips", first.len());
    first
        .par_iter()
        .map(|piece| {
            monitor.checkpoint()?;
            let own = points(piece);
            // All pieces of the pass before, nearest ridge wins: a trimmed pass is several pieces.
            let mut best: Vec<Option<Ridge>> = vec![None; own.len()];
            for before in first.iter().filter(|p| p.pass + 1 == piece.pass) {
                for (best, found) in best.iter_mut().zip(ridges(cutter, &own, &points(before), reach)) {
                    let nearer = match (&best, &found) {
                        (Some(b), Some(f)) => f.step_over < b.step_over,
                        (None, Some(_)) => true,
                        _ => false,
                    };
                    if nearer {
                        *best = found;
                    }
                }
            }
            let stride = own.len().div_ceil(CHIPS_PER_PIECE).max(1);
            let along = own
                .iter()
                .zip(best)
                .enumerate()
                .map(|(k, (p, ridge))| {
                    let chip_area = (k % stride == 0)
                        .then(|| chip_area_at(cutter, p, ridge.as_ref(), setup.stock_thickness))
                        .flatten();
                    Along { ridge, chip_area }
                })
                .collect();
            monitor.advance(1);
            Ok(along)
        })
        .collect()
}

/// Applies each operation's policy for infeasible points.
fn check_left_out(operations: &[PlannedOperation<'_>], left_out: &[LeftOut]) -> Result<(), Failure> {
    let Some(first) = left_out.first() else { return Ok(()) };
    let p = first.place;
    let example = format!("first at ({:.2}, {:.2}, {:.2}): {}", p.x, p.y, p.z, first.reason);
    if operations.iter().any(|o| matches!(o.operation.infeasible, InfeasibleFile::Stop)) {
        return Err(Failure::Infeasible(format!("{} CC points have no feasible posture; {example}", left_out.len())));
    }
    let kept: usize = operations.iter().flat_map(|o| &o.moves.pieces).map(|p| p.piece.cuts.len()).sum();
    if kept == 0 {
        return Err(Failure::Infeasible(format!("no CC point can be planned; {example}")));
    }
    Ok(())
}

/// Timed blocks, NC text and APT text.
fn write_texts(
    job: &Job,
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
    words: &facemill_nc_program::WordMap,
) -> Result<(Timed, String, String), Failure> {
    let mut writer = BlockWriter::new(job, words);
    for o in operations {
        writer.operation(o.operation, &o.moves)?;
    }
    let mut timed = writer.finish();
    let first = operations.first().map(|o| o.operation).ok_or_else(|| Failure::Internal("no operation".to_owned()))?;
    let spec = program_spec(job, setup, first, words, &mut timed)?;
    let text = write_program(&spec, &job.post).map_err(|e| job.wrong(format!("post: {e}")))?;
    let cutter = job.tool.cutter();
    let apt = AptSpec {
        part_name: spec.job_name.clone(),
        tool_number: spec.tool.number,
        cutter: AptCutter {
            radius: cutter.radius(),
            corner_radius: cutter.corner_radius(),
            height: cutter.flute_length(),
        },
        spindle: spec.spindle,
        coolant: spec.coolant,
        moves: apt_moves(operations),
    };
    let apt = write_apt(&apt).map_err(|e| Failure::Internal(e.to_string()))?;
    Ok((timed, text, apt))
}

fn apt_moves(operations: &[PlannedOperation<'_>]) -> Vec<AptMove> {
    let mut moves = Vec::new();
    for o in operations {
        moves.push(AptMove::Comment(o.operation.name.clone()));
        let linear = |cl: ClPoint, feed: f64| AptMove::Linear { cl, feed };
        let all = o.moves.pieces.iter().flat_map(|p| &p.moves).chain(&o.moves.retract);
        moves.extend(all.map(|m| match m.kind {
            MoveKind::Rapid => AptMove::Rapid(m.cl),
            MoveKind::Approach => linear(m.cl, o.operation.feeds.approach_mm_min),
            MoveKind::Cut => linear(m.cl, o.operation.feeds.cutting_mm_min),
        }));
    }
    moves
}

/// Runs the text on the virtual machine.
fn verify_text(
    job: &Job,
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
    words: &facemill_nc_program::WordMap,
    text: &str,
    stages: &dyn Stages,
) -> Result<Verification, Failure> {
    let program = read_program(text, job.post.dialect()).map_err(|e| Failure::Internal(format!("own program: {e}")))?;
    let obstacles = setup
        .obstacles
        .iter()
        .map(|o| VirtualObstacle {
            name: o.name.clone(),
            mesh: &o.tree,
            kind: match o.role {
                ObstacleRole::Part => ObstacleKind::Part,
                ObstacleRole::Check => ObstacleKind::Check,
                ObstacleRole::Fixture => ObstacleKind::Fixture,
                ObstacleRole::Stock => ObstacleKind::Stock,
            },
            allowance: o.allowance,
            stock: match o.role {
                ObstacleRole::Part | ObstacleRole::Check => setup.stock_thickness,
                ObstacleRole::Fixture | ObstacleRole::Stock => 0.0,
            },
        })
        .collect();
    let virtual_setup = VirtualSetup {
        machine: &job.machine,
        table_from_work: setup.table_from_work,
        words,
        table_from_rtcp_words: Isometry3::identity(),
        tool: &job.tool,
        obstacles,
    };
    let limit = operations.iter().map(|o| budget(job, o.operation).above_mesh()).fold(f64::INFINITY, f64::min);
    let settings = VerifySettings { gouge_limit: limit, ..VerifySettings::default() };
    let monitor = stages.start("verify program", program.blocks.len());
    verify(&program, &virtual_setup, &settings, &*monitor).map_err(|e| match e {
        VerifyError::Cancelled(_) => Failure::Interrupted,
        other => Failure::Internal(other.to_string()),
    })
}

fn report(
    job: &Job,
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
    timed: &Timed,
    mut totals: Totals,
    left_out: &[LeftOut],
    verification: Option<Verification>,
) -> Report {
    let mut worst = Worst::default();
    let mut passes = Vec::new();
    for o in operations {
        worst.linearisation_mm = worst.linearisation_mm.max(o.moves.linearisation);
        let removal = o.operation.feeds.cutting_mm_min;
        for (k, piece) in o.moves.pieces.iter().enumerate() {
            let pass = pass_report(&o.operation.name, &piece.piece, o.chips.get(k));
            worst.lift_mm = worst.lift_mm.max(pass.lift_mm);
            worst.cusp_mm = larger(worst.cusp_mm, pass.cusp_mm);
            worst.step_over_mm = larger(worst.step_over_mm, pass.step_over_mm);
            let area = pass.chip_area_mm2.map(|[_, max]| max);
            worst.chip_area_mm2 = larger(worst.chip_area_mm2, area);
            worst.removal_rate_mm3_min = larger(worst.removal_rate_mm3_min, area.map(|a| a * removal));
            totals.passes += 1;
            totals.uncut_points += pass.uncut_points;
            totals.planned_points += pass.points;
            passes.push(pass);
        }
    }
    totals.trimmed_points = totals.cc_points - totals.planned_points;
    totals.max_trimmed_fraction = operations.iter().map(|o| max_trimmed(o.operation)).fold(1.0, f64::min);
    totals.planned_fraction =
        if totals.cc_points > 0 { totals.planned_points as f64 / totals.cc_points as f64 } else { 0.0 };
    totals.blocks = timed.n_blocks;
    totals.cutting_length_mm = timed.cutting_length;
    totals.cutting_time_s = timed.cutting_time;
    totals.approach_time_s = timed.approach_time;
    totals.rapid_time_s = timed.rapid_time;
    if let Some(v) = &verification {
        worst.gouge_mm = v.largest_gouge.as_ref().map(|g| g.depth_mm);
        worst.gouge_line = v.largest_gouge.as_ref().map(|g| g.line);
        if let Some(c) = &v.smallest_clearance {
            worst.clearance_mm = Some(c.distance_mm);
            worst.clearance_between = Some(format!("{} to {}", c.body, c.obstacle));
            worst.clearance_line = Some(c.line);
        }
    }
    Report {
        format: REPORT_FORMAT,
        job: job.file.name.clone(),
        setup: setup.file.name.clone(),
        verified: verification.is_some(),
        totals,
        worst,
        budgets: operations.iter().map(|o| BudgetReport::new(&o.operation.name, &budget(job, o.operation))).collect(),
        findings: verification.map(|v| v.findings).unwrap_or_default(),
        infeasible: infeasible_report(left_out),
        meshes: setup.reports.clone(),
        passes,
    }
}

/// Part of an operation's CC points that may be left out.
fn max_trimmed(operation: &OperationFile) -> f64 {
    match &operation.infeasible {
        InfeasibleFile::Stop => 0.0,
        InfeasibleFile::Trim(trim) => trim.max_trimmed_fraction,
    }
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

fn pass_report(operation: &str, piece: &Piece, along: Option<&Vec<Along>>) -> PassReport {
    let range = |f: &dyn Fn(&Cut) -> f64| {
        piece.cuts.iter().map(f).fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
    };
    let all: &[Along] = along.map_or(&[], Vec::as_slice);
    let ridge_max = |f: &dyn Fn(&Ridge) -> Option<f64>| {
        all.iter().filter_map(|a| a.ridge.as_ref()).filter_map(f).fold(None, |m, v| larger(m, Some(v)))
    };
    let height = |ridge: &Ridge| match ridge.cusp {
        Cusp::Height(h) => Some(h),
        Cusp::Uncut => None,
    };
    let areas: Vec<f64> = all.iter().filter_map(|a| a.chip_area).collect();
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    PassReport {
        operation: operation.to_owned(),
        copy: piece.copy,
        pass: piece.pass,
        points: piece.cuts.len(),
        length_mm: piece.cuts.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum(),
        tilt_deg: range(&|c| c.pose.posture.tilt.to_degrees()),
        rotate_deg: range(&|c| c.pose.posture.rotate.to_degrees()),
        lift_mm: range(&|c| c.pose.lift)[1],
        cusp_mm: ridge_max(&height),
        uncut_points: all.iter().filter(|a| a.ridge.is_some_and(|r| r.cusp == Cusp::Uncut)).count(),
        step_over_mm: ridge_max(&|r| Some(r.step_over)),
        chip_area_mm2: (!areas.is_empty()).then(|| [mean, areas.iter().copied().fold(0.0, f64::max)]),
    }
}

/// Reasons by number of points, the most frequent first; equal ones in alphabetical order.
fn infeasible_report(left_out: &[LeftOut]) -> Vec<InfeasibleReport> {
    let mut reasons: BTreeMap<&str, (usize, Point3<f64>)> = BTreeMap::new();
    for l in left_out {
        reasons.entry(&l.reason).or_insert((0, l.place)).0 += 1;
    }
    let mut all: Vec<InfeasibleReport> = reasons
        .into_iter()
        .map(|(reason, (points, p))| InfeasibleReport {
            reason: reason.to_owned(),
            points,
            first_place_mm: [p.x, p.y, p.z],
        })
        .collect();
    all.sort_by_key(|r| std::cmp::Reverse(r.points));
    all
}
