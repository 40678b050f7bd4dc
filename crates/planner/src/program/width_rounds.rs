//! Rounds of laying: narrower strips where the text leaves more than the permitted cusp.

use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::WidthRoundReport;
use facemill_job::stages::Stages;
use facemill_verification::remaining::LeftPlace;
use facemill_virtual_machine::HeldAsCut;

use crate::passes::high_places::{HighPlace, HighPlaces};
use crate::passes::operation::{Corrections, OperationTask, PlannedOperation};
use crate::passes::path_planner::strategy_of;
use crate::passes::setup_context::SetupContext;
use crate::passes::width_field::{WidthField, WidthSample};
use crate::program::output::{OwnProgram, write_draft};
use crate::stage_clock::Clock;

/// Planned operations of a setup, with the picture of the solution space of the first.
pub(crate) type PlannedOperations<'a> = (Vec<PlannedOperation<'a>>, Option<String>);

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

/// Share of the points that may lose their posture from the first round to a better one.
const MORE_WITHOUT: f64 = 1e-3;

/// A round: operations, what their text leaves, and the figures of each.
struct Round<'a> {
    operations: Vec<PlannedOperation<'a>>,
    /// Places of each operation's region.
    left: Vec<Vec<LeftPlace>>,
    reports: Vec<WidthRoundReport>,
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
pub(crate) fn best_round<'a>(
    context: &SetupContext<'a>,
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<PlannedOperations<'a>, Failure> {
    let job = context.scene.job;
    let numbered: Vec<(usize, &OperationFile)> = job.operations_of(context.scene.setup.file).collect();
    let mut corrected = vec![Corrected::default(); numbered.len()];
    let (operations, picture) = planned(context, &numbered, (&corrected, None), stages, clock)?;
    let n_rounds = numbered.iter().map(|(_, o)| rounds_of(o)).max().unwrap_or(0);
    if n_rounds == 0 {
        return Ok((operations, picture));
    }
    let mut last = Round::of(context, operations, stages, clock)?;
    let mut reports = vec![last.reports.clone()];
    let (mut best, mut best_index) = (None, 0);
    for number in 1..=n_rounds {
        let mut is_again = false;
        corrected.iter_mut().for_each(|c| c.is_laid_anew = false);
        for (k, (_, operation)) in numbered.iter().enumerate() {
            if rounds_of(operation) >= number && !is_within(&last.reports[k], operation) {
                corrected[k].add(&last, k, context);
                is_again = true;
            }
        }
        if !is_again {
            break;
        }
        let operations = match planned(context, &numbered, (&corrected, Some(&last)), stages, clock) {
            Ok((operations, _)) => operations,
            // Narrower strips may be more passes than a plan may have.
            Err(Failure::Input { .. } | Failure::Infeasible(_)) => break,
            Err(why) => return Err(why),
        };
        let round = Round::of(context, operations, stages, clock)?;
        reports.push(round.reports.clone());
        let before = best.as_ref().unwrap_or(&last);
        if is_better(&numbered, &reports[0], &round.reports, &before.reports) {
            (best, best_index) = (None, number as usize);
        } else if best.is_none() {
            best = Some(last);
        }
        last = round;
    }
    let mut operations = best.unwrap_or(last).operations;
    for (k, operation) in operations.iter_mut().enumerate().filter(|(_, o)| rounds_of(o.operation) > 0) {
        operation.width_rounds = reports.iter().map(|round| round[k].clone()).collect();
        operation.width_rounds[best_index].is_cut = true;
    }
    Ok((operations, picture))
}

/// Returns the number of times that an operation's passes may be laid again.
fn rounds_of(operation: &OperationFile) -> u32 {
    strategy_of(operation).map_or(0, |s| s.width_rounds)
}

/// Plans the operations, each with its corrections of the last round.
fn planned<'a>(
    context: &SetupContext<'a>,
    numbered: &[(usize, &'a OperationFile)],
    (corrected, last): (&[Corrected], Option<&Round<'a>>),
    stages: &dyn Stages,
    clock: &mut Clock,
) -> Result<PlannedOperations<'a>, Failure> {
    let mut operations: Vec<PlannedOperation<'a>> = Vec::new();
    let mut picture = None;
    for (k, (operation, corrected)) in numbered.iter().zip(corrected).enumerate() {
        let corrections = corrected.corrections(operation.1);
        let before = last.map(|round| &round.operations[k]);
        let task = OperationTask {
            from: operations.last().and_then(|o| o.moves.last()),
            // A later round's is the same.
            picture: picture.is_none() && last.is_none(),
            corrections: corrections.as_ref(),
            before: before.filter(|_| !corrected.is_laid_anew),
            ..OperationTask::alone(*operation)
        };
        let (planned, svg) = PlannedOperation::plan(context, task, stages, clock)?;
        picture = picture.or(svg);
        operations.push(planned);
    }
    Ok((operations, picture))
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
    /// Those that no cut reaches have other reasons.
    fn add(&mut self, round: &Round<'_>, k: usize, context: &SetupContext<'_>) {
        let operation = round.operations[k].operation;
        let cusp = operation.tolerances.cusp_mm;
        let high = || round.left[k].iter().filter(|place| place.is_cut && place.height > cusp);
        self.is_laid_anew = round.reports[k].above_fraction > WIDESPREAD;
        if !self.is_laid_anew {
            let allowance = context.scene.setup.drive_allowance;
            let raised = |place: &LeftPlace| HighPlace {
                position: place.position + place.normal.into_inner() * allowance,
                height: place.height,
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

/// Returns whether a round is better than another one: it loses no points, leaves no more than the
/// cusps, leaves it on a smaller part, or takes less time.
fn is_better(
    numbered: &[(usize, &OperationFile)],
    first: &[WidthRoundReport],
    round: &[WidthRoundReport],
    other: &[WidthRoundReport],
) -> bool {
    let keeps = |round: &[WidthRoundReport]| {
        let has_points = numbered.iter().zip(first.iter().zip(round)).all(|((_, o), (first, r))| {
            let n_points = r.length_mm / o.tolerances.max_step_mm;
            r.points_without_posture <= first.points_without_posture + (MORE_WITHOUT * n_points) as usize
        });
        let is_within = numbered.iter().zip(round).all(|((_, o), r)| rounds_of(o) == 0 || is_within(r, o));
        (has_points, is_within)
    };
    let above = |round: &[WidthRoundReport]| {
        let sum = |of: fn(&WidthRoundReport) -> f64| round.iter().fold(0.0, |sum, r| sum + of(r));
        (sum(|r| r.above_fraction), sum(|r| r.largest_mm))
    };
    let time = |round: &[WidthRoundReport]| round.iter().map(|r| r.time_s).sum::<f64>();
    match (keeps(round), keeps(other)) {
        (own, other) if own != other => own > other,
        ((_, true), _) => time(round) < time(other),
        _ => above(round) < above(other),
    }
}

impl<'a> Round<'a> {
    /// Measures what planned operations leave.
    fn of(
        context: &SetupContext<'a>,
        operations: Vec<PlannedOperation<'a>>,
        stages: &dyn Stages,
        clock: &mut Clock,
    ) -> Result<Self, Failure> {
        let texts = write_draft(context.scene, &operations)?;
        let program =
            OwnProgram { scene: context.scene, operations: &operations, texts: &texts, as_cut: HeldAsCut::NOTHING };
        let left = program.left_places(stages)?;
        let reports = operations.iter().zip(&left).map(|(operation, left)| round_report(operation, left)).collect();
        clock.lap("rounds of widths");
        Ok(Self { operations, left, reports })
    }
}

fn round_report(operation: &PlannedOperation<'_>, left: &[LeftPlace]) -> WidthRoundReport {
    let cusp = operation.operation.tolerances.cusp_mm;
    let cut = || left.iter().filter(|place| place.is_cut);
    let area = |places: &mut dyn Iterator<Item = &LeftPlace>| places.fold(0.0, |sum, place| sum + place.weight);
    WidthRoundReport {
        passes: operation.laid.passes,
        passes_added: operation.extra.moved + operation.extra.between,
        length_mm: operation.laid.length,
        time_s: operation.laid.time,
        largest_mm: cut().map(|place| place.height).fold(0.0, f64::max),
        above_fraction: area(&mut cut().filter(|place| place.height > cusp)) / area(&mut cut()).max(f64::MIN_POSITIVE),
        points_without_posture: operation.laid.without_posture,
        is_cut: false,
    }
}
