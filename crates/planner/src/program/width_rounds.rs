//! Rounds of laying: narrower strips where the text leaves more than the permitted cusp.

use facemill_cl_data::Aabb;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::WidthRoundReport;
use facemill_job::stages::Stages;
use facemill_surface_model::Tree;
use facemill_verification::remaining::LeftPlace;
use facemill_virtual_machine::HeldAsCut;
use nalgebra::Point3;

use crate::passes::high_places::{HighPlace, HighPlaces};
use crate::passes::operation::{Corrections, PlannedOperation};
use crate::passes::path_planner::strategy_of;
use crate::passes::width_field::{WidthField, WidthSample};
use crate::program::heads::{Heads, RoundTasks};
use crate::stage_clock::Clock;

/// Share of the area above which strips are laid narrower; on less, passes are put in.
const WIDESPREAD: f64 = 0.002;

/// Share of the permitted cusp that narrower strips aim at: what is laid anew leaves a little more
/// or less than expected.
const AIM: f64 = 0.95;

/// Least factor on an expected width: a place that is so much too high has another reason.
const LEAST_FACTOR: f64 = 0.5;

/// Distance over which factors are spread, in largest step-overs. Smaller: a pass beside a high
/// place does not notice it; larger: strips become narrower where none is too wide.
const REACH: f64 = 0.75;

/// Distance from a point without a posture within which no round can mend what is left, in largest
/// step-overs: half of the strip that its pass would have cut.
const BESIDE_WITHOUT: f64 = 0.5;

/// Share of the area that a better round may leave above the cusp, in addition to the first one,
/// where no pass reaches.
const MORE_OUT_OF_REACH: f64 = 1e-3;

/// A round: moves, what their text leaves, and the figures of each operation.
struct Round<M> {
    moves: M,
    /// Places of each operation's region.
    left: Vec<Vec<LeftPlace>>,
    figures: Vec<RoundFigures>,
}

/// Figures of an operation in a round.
#[derive(Clone, Debug)]
struct RoundFigures {
    report: WidthRoundReport,
    /// Share of the area of the region that is left above the permitted cusp where no pass reaches.
    out_of_reach: f64,
}

/// Corrections of an operation, collected over rounds.
#[derive(Clone, Default)]
struct Corrected {
    samples: Vec<WidthSample>,
    high: Vec<HighPlace>,
    /// Whether the last correction changes the widths.
    is_laid_anew: bool,
}

/// Plans the operations of a setup. Where the text leaves more than the cusp of an operation that
/// asks for rounds, puts passes in, or lays all again with narrower strips if it is on much of the
/// region; returns the best round.
///
/// # Errors
/// As [`PlannedOperation::plan`], of the first round.
pub(crate) fn best_round<'a, H: Heads<'a, N>, const N: usize>(
    heads: &H,
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<(H::Moves, Option<String>), Failure> {
    let (moves, picture) = heads.plan(&RoundTasks::default(), stages, clock)?;
    // In the order of the report, which is the same in all rounds.
    let files: Vec<&OperationFile> = H::operations(&moves).iter().map(|o| o.operation).collect();
    let n_rounds = files.iter().map(|o| rounds_of(o)).max().unwrap_or(0);
    if n_rounds == 0 {
        return Ok((moves, picture));
    }
    let allowance = heads.scenes()[0].setup.drive_allowance;
    let mut corrected = vec![Corrected::default(); files.len()];
    let mut last = measured(heads, moves, stages, clock)?;
    let mut rounds = vec![last.figures.clone()];
    let (mut best, mut best_index) = (None, 0);
    for number in 1..=n_rounds {
        let mut is_again = false;
        corrected.iter_mut().for_each(|c| c.is_laid_anew = false);
        for (k, operation) in files.iter().enumerate() {
            if rounds_of(operation) >= number && !is_within(&last.figures[k].report, operation) {
                corrected[k].add(operation, (&last.left[k], &last.figures[k].report), (allowance, number));
                is_again = true;
            }
        }
        if !is_again {
            break;
        }
        let tasks = round_tasks(H::operations(&last.moves), &corrected);
        let moves = match heads.plan(&tasks, stages, clock) {
            Ok((moves, _)) => moves,
            // Narrower strips may be more passes than a plan may have.
            Err(Failure::Input { .. } | Failure::Infeasible(_)) => break,
            Err(why) => return Err(why),
        };
        let round = measured(heads, moves, stages, clock)?;
        rounds.push(round.figures.clone());
        let before = best.as_ref().unwrap_or(&last);
        if is_better(&files, &rounds[0], &round.figures, &before.figures) {
            (best, best_index) = (None, number as usize);
        } else if best.is_none() {
            best = Some(last);
        }
        last = round;
    }
    let mut moves = best.unwrap_or(last).moves;
    let operations = H::operations_mut(&mut moves);
    for (k, operation) in operations.iter_mut().enumerate().filter(|(_, o)| rounds_of(o.operation) > 0) {
        operation.width_rounds = rounds.iter().map(|round| round[k].report.clone()).collect();
        operation.width_rounds[best_index].is_cut = true;
    }
    Ok((moves, picture))
}

/// Returns the number of times that an operation's passes may be laid again.
fn rounds_of(operation: &OperationFile) -> u32 {
    strategy_of(operation).map_or(0, |s| s.largest_width_rounds())
}

/// Returns the tasks of a round: the operations of the last one with their corrections.
fn round_tasks<'w, 'a>(last: &'w [PlannedOperation<'a>], corrected: &[Corrected]) -> RoundTasks<'w, 'a> {
    let mut tasks = RoundTasks::default();
    for (planned, corrected) in last.iter().zip(corrected) {
        let before = (!corrected.is_laid_anew).then_some(planned);
        tasks.add(planned.operation, corrected.corrections(planned.operation), before);
    }
    tasks
}

impl Corrected {
    fn corrections(&self, operation: &OperationFile) -> Option<Corrections> {
        let is_any = !self.samples.is_empty() || !self.high.is_empty();
        is_any.then(|| Corrections { widths: self.field(operation), high: HighPlaces::new(self.high.clone()) })
    }

    fn field(&self, operation: &OperationFile) -> Option<WidthField> {
        let reach = REACH * operation.tolerances.max_step_over_mm;
        (!self.samples.is_empty()).then(|| WidthField::new(self.samples.clone(), reach))
    }

    /// Adds the places of an operation's region where a round leaves more than the permitted cusp.
    /// `allowance` is the height of the passes above the drive surface, mm; `round` counts from 1.
    fn add(
        &mut self,
        operation: &OperationFile,
        (left, report): (&[LeftPlace], &WidthRoundReport),
        (allowance, round): (f64, u32),
    ) {
        let cusp = operation.tolerances.cusp_mm;
        let high = || left.iter().filter(|place| place.height > cusp);
        self.is_laid_anew = report.above_fraction > WIDESPREAD;
        if !self.is_laid_anew {
            let raised = |place: &LeftPlace| HighPlace {
                position: place.position + place.normal.into_inner() * allowance,
                normal: place.normal,
                height: place.height,
                round,
            };
            self.high.extend(high().map(raised));
            return;
        }
        // Heights grow with the square of the width.
        let field = self.field(operation);
        let laid_by = |place: &LeftPlace| field.as_ref().map_or(1.0, |f| f.at(&place.position, &place.normal));
        let sample = |place: &LeftPlace| WidthSample {
            position: place.position,
            normal: place.normal,
            factor: laid_by(place) * (AIM * cusp / place.height).sqrt().max(LEAST_FACTOR),
        };
        let narrower: Vec<WidthSample> = high().map(sample).collect();
        self.samples.extend(narrower);
        // Passes lie elsewhere now.
        self.high.clear();
    }
}

/// Returns whether a round leaves no more than the permitted cusp on all that is cut.
fn is_within(round: &WidthRoundReport, operation: &OperationFile) -> bool {
    round.largest_mm <= operation.tolerances.cusp_mm
}

/// Returns whether a round is better than another one: it reaches as much, leaves no more than the
/// cusps, leaves it on a smaller part, or takes less time.
fn is_better(files: &[&OperationFile], first: &[RoundFigures], round: &[RoundFigures], other: &[RoundFigures]) -> bool {
    let keeps = |round: &[RoundFigures]| {
        let reaches =
            first.iter().zip(round).all(|(first, r)| r.out_of_reach <= first.out_of_reach + MORE_OUT_OF_REACH);
        let is_within = files.iter().zip(round).all(|(o, r)| rounds_of(o) == 0 || is_within(&r.report, o));
        (reaches, is_within)
    };
    let above = |round: &[RoundFigures]| {
        let sum = |of: fn(&WidthRoundReport) -> f64| round.iter().fold(0.0, |sum, r| sum + of(&r.report));
        (sum(|r| r.above_fraction), sum(|r| r.largest_mm))
    };
    let time = |round: &[RoundFigures]| round.iter().map(|r| r.report.time_s).sum::<f64>();
    match (keeps(round), keeps(other)) {
        (own, other) if own != other => own > other,
        ((_, true), _) => time(round) < time(other),
        _ => above(round) < above(other),
    }
}

/// Measures what planned moves leave.
fn measured<'a, H: Heads<'a, N>, const N: usize>(
    heads: &H,
    moves: H::Moves,
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<Round<H::Moves>, Failure> {
    let texts = heads.write_draft(&moves)?;
    let by_setup = heads.program(&moves, &texts, HeldAsCut::NOTHING).left_places(stages)?;
    let scene = heads.scenes()[0];
    let names: Vec<&str> = scene.job.operations_of(scene.setup.file).map(|(_, o)| o.name.as_str()).collect();
    let operations = H::operations(&moves);
    let of = |o: &PlannedOperation<'_>| names.iter().position(|name| *name == o.operation.name);
    let of = |o: &PlannedOperation<'_>| {
        let reach = BESIDE_WITHOUT * o.operation.tolerances.max_step_over_mm;
        let all = of(o).map_or(&[] as &[LeftPlace], |k| &by_setup[k]);
        let left = within_reach(all, &o.laid.without_posture, reach);
        let figures = RoundFigures {
            report: round_report(o, &left),
            out_of_reach: (area_above(all, o) - area_above(&left, o)) / area_of(all),
        };
        (left, figures)
    };
    let (left, figures) = operations.iter().map(of).unzip();
    clock.lap("rounds of widths");
    Ok(Round { moves, left, figures })
}

/// Returns the places of an operation's region that further passes may lower: not those that no cut
/// reaches, nor those nearer than `reach` (mm) to points without a posture.
fn within_reach(left: &[LeftPlace], without_posture: &[Point3<f64>], reach: f64) -> Vec<LeftPlace> {
    let boxes: Vec<Aabb> = without_posture.iter().map(|p| Aabb::of_points([p])).collect();
    let tree = Tree::build(&boxes);
    let is_beside =
        |place: &LeftPlace| tree.find_in_boxes(|b| b.distance_sq(&place.position) <= reach * reach, Some).is_some();
    left.iter().filter(|place| place.is_cut && !is_beside(place)).copied().collect()
}

/// Returns the area of places that are left above an operation's permitted cusp, mm².
fn area_above(left: &[LeftPlace], operation: &PlannedOperation<'_>) -> f64 {
    let cusp = operation.operation.tolerances.cusp_mm;
    left.iter().filter(|place| place.height > cusp).fold(0.0, |sum, place| sum + place.weight)
}

/// Returns the area of places, mm², above 0.
fn area_of(left: &[LeftPlace]) -> f64 {
    left.iter().fold(0.0, |sum, place| sum + place.weight).max(f64::MIN_POSITIVE)
}

fn round_report(operation: &PlannedOperation<'_>, left: &[LeftPlace]) -> WidthRoundReport {
    WidthRoundReport {
        passes: operation.laid.passes,
        passes_added: operation.extra.moved + operation.extra.between + operation.extra.over,
        length_mm: operation.laid.length,
        time_s: operation.laid.time,
        largest_mm: left.iter().map(|place| place.height).fold(0.0, f64::max),
        above_fraction: area_above(left, operation) / area_of(left),
        points_without_posture: operation.laid.without_posture.len(),
        is_cut: false,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/program/width_rounds.rs"]
mod tests;
