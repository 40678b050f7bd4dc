//! One operation on its way to the program: poses, moves, ridges and chips.

use std::collections::BTreeMap;
use std::sync::Arc;

use facemill_cl_data::{CcPoint, Posture, Silent};
use facemill_cutter_location::search::map::{MapRange, map};
use facemill_cutter_location::{
    Hints, Optimum, PoseTest, Remedy, SearchCurve, SearchSettings, Widened, Workcell, reliefs, search,
};
use facemill_drawing::solution_svg::map_svg;
use facemill_inverse_kinematics::{Branch, BranchPreference};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{InfeasibleFile, LinkStockFile, OperationFile};
use facemill_job::format::report::WidthRoundReport;
use facemill_job::frames::places;
use facemill_job::planning_stock::PlanningStock;
use facemill_job::setup::cell::{pass_settings, search_settings};
use facemill_job::setup::cl_path::ClLaid;
use facemill_job::setup::link_times::with_link_times;
use facemill_job::setup::path::{LaidPath, lay_by_widths};
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{BETWEEN, HELP, LAY, LINKS, PICTURE, PLACES, Stages};
use facemill_job_check::reach::check_reach;
use facemill_tool_model::cl_from_cc;
use facemill_tool_path::links::LinkTime;
use facemill_tool_path::moves::lead::CutRegion;
use facemill_tool_path::moves::{Move, MoveContext, OperationMoves, region_moves};
use facemill_tool_path::segments::pole::Tests;
use facemill_tool_path::segments::steep_cuts::{CutMotion, without_steep_cuts};
use facemill_tool_path::segments::{LaidTask, LeftOut, PassSegment, copy_outcomes, filled, split};
use facemill_tool_path::winding::wound;
use facemill_verification::named_results::not_verified;
use facemill_verification::operation_region::OperationRegion;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::passes::engagement::{PointEngagement, engagement_of_passes};
use crate::passes::extra_passes::{AddedPasses, ExtraPasses, PlannedPath};
use crate::passes::high_places::HighPlaces;
use crate::passes::move_settings::{move_settings, turn_settings};
use crate::passes::path_planner::{PathPlanner, strategy_of};
use crate::passes::planned_region::PlannedRegion;
use crate::passes::setup_context::SetupContext;
use crate::passes::turn_chips::give_turn_chips;
use crate::passes::width_field::WidthField;
use crate::stage_clock::Clock;

/// Corrections of an operation's passes by what a text has left.
pub(crate) struct Corrections {
    /// Factors on the strip widths that passes are laid by.
    pub(crate) widths: Option<WidthField>,
    /// Places where passes are put in.
    pub(crate) high: HighPlaces,
}

/// An operation that is to be planned.
pub(crate) struct OperationTask<'a, 'w> {
    /// Number of the operation in the job.
    pub(crate) index: usize,
    pub(crate) operation: &'a OperationFile,
    /// End of the operation before, which the program continues.
    pub(crate) from: Option<Move>,
    /// Whether the solution space at one point is drawn.
    pub(crate) picture: bool,
    /// Corrections by what a text of the same operation has left.
    pub(crate) corrections: Option<&'w Corrections>,
    /// The same operation planned by the same widths: its passes stay, and others are put in.
    pub(crate) before: Option<&'w PlannedOperation<'a>>,
}

impl<'a> OperationTask<'a, '_> {
    /// Returns the task of an operation by itself, without a picture.
    pub(crate) fn alone((index, operation): (usize, &'a OperationFile)) -> Self {
        Self { index, operation, from: None, picture: false, corrections: None, before: None }
    }
}

/// Operation on its way to the program.
pub(crate) struct PlannedOperation<'a> {
    pub(crate) operation: &'a OperationFile,
    pub(crate) moves: OperationMoves,
    /// CC points of the path, in all places of the pattern.
    pub(crate) cc_points: usize,
    /// Passes of a CL file with its poses; `None` of other paths.
    pub(crate) cl: Option<Arc<ClLaid>>,
    /// Number of pieces of passes that were too short to keep.
    pub(crate) dropped_pieces: usize,
    /// Height of the material that the first pass of a root leaves in a corner without a fillet,
    /// mm.
    pub(crate) corner_rest: Option<f64>,
    /// CC points without a pose in the program.
    pub(crate) left_out: Vec<LeftOut>,
    /// Remedies at the first point of each reason.
    pub(crate) reliefs: BTreeMap<String, Vec<Remedy>>,
    /// Distance of the postures of the first place from the optimum, if one was sought.
    pub(crate) optimum: Option<Optimum>,
    /// CC points at which the search could not prove as finely as requested.
    pub(crate) widened: Option<Widened>,
    /// Ridges and chips of every piece, at points of the path and at both ends.
    pub(crate) along: Vec<Vec<PointEngagement>>,
    /// Passes inserted between the generated ones.
    pub(crate) extra: ExtraPasses,
    /// Figures of the passes in the first place of the pattern.
    pub(crate) laid: LaidFigures,
    /// These passes themselves, if further rounds may put others in.
    kept: Option<KeptPath>,
    /// Rounds of laying; empty if passes were laid once.
    pub(crate) width_rounds: Vec<WidthRoundReport>,
}

/// Passes of an operation in the first place of the pattern.
#[derive(Clone)]
struct KeptPath {
    path: LaidPath,
    poses: PlannedPath,
    extra: ExtraPasses,
}

/// Figures of an operation's passes in the first place of the pattern.
#[derive(Clone)]
pub(crate) struct LaidFigures {
    /// Passes as laid.
    pub(crate) passes: usize,
    /// Length of all passes, with those added, mm.
    pub(crate) length: f64,
    /// Estimate of their time, for comparing rounds of laying, s; 0 if there are none.
    pub(crate) time: f64,
    /// Points without a posture.
    pub(crate) without_posture: Vec<Point3<f64>>,
}

impl<'a> PlannedOperation<'a> {
    /// Plans an operation; returns the picture of the solution space, if it is wanted, too.
    ///
    /// # Errors
    /// If no pass can be generated, the operation's policy forbids infeasible points, or the stages
    /// are cancelled.
    pub(crate) fn plan(
        context: &SetupContext<'_>,
        task: OperationTask<'a, '_>,
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<(Self, Option<String>), Failure> {
        let Scene { job, setup, .. } = context.scene;
        let OperationTask { index, operation, from, .. } = task;
        let mut cell = context.scene.workcell(operation, context.map);
        let laying = stages.start(LAY, 0);
        let widths = task.corrections.and_then(|c| c.widths.as_ref());
        let factor = |cc: &CcPoint| widths.map_or(1.0, |field| field.at(&cc.position, &cc.normal));
        let (path, posed) = match task.before.and_then(|before| before.kept.clone()) {
            Some(kept) => (kept.path, Some((kept.poses, kept.extra))),
            None => (lay_by_widths(job, setup, (index, operation), &factor)?, None),
        };
        check_reach(job, setup, operation, &path.tasks).map_err(|e| job.wrong(e))?;
        drop(laying);
        settle_branch(&mut cell, &path.tasks);
        let test = PoseTest::new(&cell);
        clock.lap("path");
        let mut left_out = Vec::new();
        let mut settings = move_settings(job, setup, operation);
        // With two heads the moves of one head alone are only a step on the way.
        let is_alone = context.added == AddedPasses::All;
        settings.shortest_order &= is_alone;
        settings.turns = turn_settings(job, setup, operation);
        // The search for postures avoids the pole; tests of given postures do not.
        let choosing = PoseTest::new(&cell).avoiding_pole(operation.search.singular_cone_deg.to_radians());
        let tests = Tests { choosing: &choosing, plain: &test };
        let requested = OperationRegion::of(job, setup, operation)?;
        let region = if requested.has_nothing_left() { None } else { Some(requested.region_of_passes(job, setup)?) };
        let region = region.as_ref().map(|region| PlannedRegion::new(region, setup, operation));
        let region = region.as_ref().map(|region| region as &dyn CutRegion);
        let high = task.corrections.map(|c| &c.high);
        let planner = PathPlanner {
            tests: &tests,
            context,
            operation,
            stages,
            surface: requested.surface_of_passes(setup),
            high,
        };
        let (mut poses, mut extra) = match posed {
            Some((mut poses, mut extra)) => {
                if is_alone {
                    planner.keep_cusp(&mut poses, &mut extra)?;
                }
                (poses, extra)
            }
            None => {
                let mut poses = planner.posed(&path.tasks)?;
                let extra = planner.add_passes(&mut poses)?;
                (poses, extra)
            }
        };
        let kept = may_be_corrected(operation).then(|| KeptPath {
            path: path.clone(),
            poses: poses.clone(),
            extra: extra.clone(),
        });
        let n_in_strips = poses.tasks.len();
        if let Some(region) = region.filter(|_| is_alone) {
            planner.add_over_islands(region, &mut poses, &mut extra)?;
        }
        let laid = planner.figures(&path, &poses);
        let Placed { pieces, cc_points, optimum } = place_pieces(&tests, operation, poses, &mut left_out, stages)?;
        let widened = tests.widened();
        let passes = pass_settings(operation);
        let monitor = stages.start(BETWEEN, cc_points);
        let pieces = filled(&tests, &settings.linearity, passes.fallback(), pieces, &mut left_out, &*monitor)?;
        // Where links avoid the stock as cut, ramps are judged in it as well, when it is known.
        let judges_ramps = is_alone && setup.file.links.stock == LinkStockFile::AtFirst;
        let motion = CutMotion { test: &test, linearity: &settings.linearity, fallback: passes.fallback() };
        let pieces = if judges_ramps { without_steep_cuts(&motion, pieces, &mut left_out, &*monitor)? } else { pieces };
        drop(monitor);
        let pieces = wound(&test, passes.fallback(), pieces, from.map(|m| m.axes));
        clock.lap("search");
        let picture = if task.picture { picture_of(&test, operation, &path.tasks, stages)? } else { None };
        let monitor = stages.start(LINKS, 2 * pieces.len());
        let make = |link_time: Option<&LinkTime<'_>>| {
            let context = MoveContext { region, link_time };
            region_moves(&test, &settings, &context, pieces, from, &mut left_out, &*monitor)
        };
        let mut moves = match settings.shortest_order {
            true => with_link_times(context.scene, make).map_err(not_verified)??,
            false => make(None)?,
        };
        drop(monitor);
        clock.lap("moves");
        let mut along = engagement_of_passes(job, setup, operation, &mut moves.pieces, stages)?;
        // Passes over islands, behind all others, lie in strips between others, not beside them.
        let over_islands = moves.pieces.iter().zip(&mut along).filter(|(piece, _)| piece.piece.pass >= n_in_strips);
        over_islands.flat_map(|(_, along)| along).for_each(|at| at.ridge = None);
        give_turn_chips(job, setup, &operation.feeds, &mut moves.pieces, &along)?;
        clock.lap("cusps and chips");
        let is_own = matches!(setup.planning_stock, PlanningStock::Own { .. });
        if setup.stock_solid.is_some() && is_own {
            left_out.iter_mut().for_each(LeftOut::explain_stock);
        }
        let reliefs = match operation.keeps_axes() {
            // No range of the search would help.
            true => BTreeMap::new(),
            false => reliefs_by_reason(&cell, &left_out, &search_settings(operation), stages)?,
        };
        clock.lap("what would help");
        let (dropped_pieces, corner_rest) = (path.dropped_pieces, path.corner_rest);
        let planned = Self {
            reliefs,
            operation,
            moves,
            cc_points,
            cl: path.cl,
            dropped_pieces,
            corner_rest,
            left_out,
            optimum,
            widened,
            along,
            extra,
            laid,
            kept,
            width_rounds: Vec::new(),
        };
        planned.check_left_out()?;
        Ok((planned, picture))
    }

    /// Returns the number of CC points with a pose in the program.
    pub(crate) fn planned_points(&self) -> usize {
        self.moves.pieces.iter().map(|p| p.piece.points()).sum()
    }

    /// Returns the fraction of the CC points that may be left out.
    pub(crate) fn max_trimmed_fraction(&self) -> f64 {
        match &self.operation.infeasible {
            InfeasibleFile::Stop => 0.0,
            InfeasibleFile::Trim(trim) => trim.max_trimmed_fraction,
        }
    }

    /// Returns whether more is left out than the operation permits.
    pub(crate) fn trims_too_much(&self) -> bool {
        self.left_out.len() as f64 > self.max_trimmed_fraction() * self.cc_points as f64
    }

    /// Applies the operation's policy for infeasible points.
    fn check_left_out(&self) -> Result<(), Failure> {
        // A searched point says more than one left out because of its neighbours.
        let searched = self.left_out.iter().find(|l| l.searched.is_some());
        let Some(first) = searched.or(self.left_out.first()) else { return Ok(()) };
        let (p, name) = (first.place, &self.operation.name);
        let example = format!("such as at ({:.2}, {:.2}, {:.2}): {}", p.x, p.y, p.z, first.reason);
        if matches!(self.operation.infeasible, InfeasibleFile::Stop) {
            let n = self.left_out.len();
            return Err(Failure::Infeasible(format!(
                "operation \"{name}\": {n} CC points have no feasible posture; {example}"
            )));
        }
        if self.planned_points() == 0 {
            return Err(Failure::Infeasible(format!("operation \"{name}\": no CC point can be planned; {example}")));
        }
        Ok(())
    }
}

/// Returns whether an operation's passes may be corrected by what the text leaves.
pub(crate) fn may_be_corrected(operation: &OperationFile) -> bool {
    strategy_of(operation).is_some_and(|s| s.largest_width_rounds() > 0)
}

/// Largest number of reasons with remedies; the rest are few points each.
const REASONS: usize = 16;

/// Returns remedies at the first point of each of the first reasons.
fn reliefs_by_reason(
    cell: &Workcell<'_>,
    left_out: &[LeftOut],
    settings: &SearchSettings,
    stages: &dyn Stages,
) -> Result<BTreeMap<String, Vec<Remedy>>, Failure> {
    let mut firsts: Vec<(&str, &CcPoint, &SearchCurve)> = Vec::new();
    for l in left_out {
        let Some((cc, curve)) = &l.searched else { continue };
        if firsts.len() < REASONS && !firsts.iter().any(|(reason, ..)| *reason == l.reason) {
            firsts.push((&l.reason, cc, curve));
        }
    }
    let monitor = stages.start(HELP, firsts.len());
    let of = |(reason, cc, curve): (&str, &CcPoint, &SearchCurve)| {
        monitor.checkpoint()?;
        let found = reliefs(cell, cc, curve, settings);
        monitor.advance(1);
        Ok((reason.to_owned(), found))
    };
    firsts.into_par_iter().map(of).collect()
}

/// Chooses the branch nearest to home at the first CC point for all passes, if the job leaves the
/// branch open: passes on different branches would need links through the pole.
pub(crate) fn settle_branch(cell: &mut Workcell<'_>, tasks: &[LaidTask]) {
    let start = |t: &LaidTask| t.given.first().copied().unwrap_or_else(|| t.curve.start());
    let first = tasks.first().and_then(|t| Some((t.pass.points.first()?, start(t))));
    let (BranchPreference::Nearest, Some((cc, posture))) = (cell.preferred_branch, first) else { return };
    let cl = cl_from_cc(cell.tool.cutter(), cc, posture).transformed(&cell.table_from_work);
    if let Ok(q) = cell.machine.nearest_inverse(&cl, cell.tool.gauge_length(), None, BranchPreference::Nearest) {
        cell.preferred_branch = match cell.machine.branch_of(&q) {
            Branch::Positive => BranchPreference::Positive,
            Branch::Negative => BranchPreference::Negative,
        };
    }
}

/// Poses in every place of the pattern.
struct Placed {
    /// Pieces in cutting order.
    pieces: Vec<PassSegment>,
    /// CC points of all places.
    cc_points: usize,
    /// Distance of the postures of the first place from the optimum, if one was sought.
    optimum: Option<Optimum>,
}

/// Returns poses in every place of the pattern, as pieces in cutting order.
fn place_pieces(
    tests: &Tests<'_>,
    operation: &OperationFile,
    path: PlannedPath,
    left_out: &mut Vec<LeftOut>,
    stages: &dyn Stages,
) -> Result<Placed, Failure> {
    let places = places(operation.pattern.as_ref());
    let settings = pass_settings(operation);
    let test = tests.of(&settings);
    let PlannedPath { tasks, outcomes, optimum } = path;
    let mut pieces = split(tests.plain, &tasks, &outcomes, 0, left_out);
    let n_points: usize = tasks.iter().map(|t| t.pass.points.len()).sum();
    for (copy, place) in places.iter().enumerate().skip(1) {
        let monitor = stages.start(PLACES, n_points);
        let (copied, mut results) = copy_outcomes(test, &tasks, &outcomes, place, &settings, &*monitor)?;
        tests.at_pole(&copied, &settings, &mut results);
        pieces.extend(split(tests.plain, &copied, &results, copy as u32, left_out));
    }
    Ok(Placed { pieces, cc_points: n_points * places.len(), optimum })
}

/// Number of CC points among which the picture's is sought.
const PICTURE_CANDIDATES: usize = 300;

/// Resolution of the picture, rad.
const PICTURE_RESOLUTION: f64 = 0.25 * std::f64::consts::PI / 180.0;

/// Returns the solution space at one of some hundred points spread over the path: the first whose
/// smallest feasible posture has the largest tilt, where the space is narrowest.
fn picture_of(
    test: &PoseTest<'_>,
    operation: &OperationFile,
    tasks: &[LaidTask],
    stages: &dyn Stages,
) -> Result<Option<String>, Failure> {
    let _drawing = stages.start(PICTURE, 0);
    let settings = search_settings(operation);
    let smallest = |task: &LaidTask, cc: &CcPoint| {
        search(test, cc, &task.curve, &settings, 0.0, None, &mut Hints::default()).ok().map(|f| f.pose.posture)
    };
    let all: Vec<(usize, usize)> = tasks
        .iter()
        .enumerate()
        .flat_map(|(pass, task)| (0..task.pass.points.len()).map(move |point| (pass, point)))
        .collect();
    let some: Vec<(usize, usize)> =
        all.iter().step_by(all.len().div_ceil(PICTURE_CANDIDATES).max(1)).copied().collect();
    let found: Vec<Option<Posture>> =
        some.par_iter().map(|&(pass, point)| smallest(&tasks[pass], &tasks[pass].pass.points[point])).collect();
    let feasible = some.iter().zip(&found).filter_map(|(at, found)| Some((*at, (*found)?)));
    let Some(((pass, point), taken)) = feasible.reduce(|a, b| if b.1.tilt > a.1.tilt { b } else { a }) else {
        return Ok(None);
    };
    let (task, title) = (&tasks[pass], format!("{}, pass {}, point {}", operation.name, pass + 1, point + 1));
    let range = mapped_range(&task.curve);
    match map(test, &task.pass.points[point], range, PICTURE_RESOLUTION, &Silent) {
        Ok(found) => Ok(Some(map_svg(&found, &task.curve, Some(taken), &title))),
        Err(e) => Err(Failure::Internal(format!("solution space: {e}"))),
    }
}

/// Returns the range from tilt 0 and rotate 0 to the ends of the curve.
pub(crate) fn mapped_range(curve: &SearchCurve) -> MapRange {
    let end = curve.end();
    let rotate = if end.rotate == 0.0 { -SHOWN_ROTATE } else { end.rotate };
    let rotate = rotate.abs().max(NARROWEST).copysign(rotate);
    MapRange { tilt: [0.0, end.tilt.max(NARROWEST)], rotate: [rotate.min(0.0), rotate.max(0.0)] }
}

/// Smallest upper limit of tilt and rotate of a map, rad: a range of no width cannot be drawn.
pub(crate) const NARROWEST: f64 = std::f64::consts::PI / 180.0;

/// Rotate shown if the operation's search does not rotate, rad.
pub(crate) const SHOWN_ROTATE: f64 = 85.0 * std::f64::consts::PI / 180.0;
