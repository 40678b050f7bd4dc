//! Rounds of laying: strip widths from the postures that are taken instead of those expected.

use facemill_cl_data::CcPoint;
use facemill_cutter_location::cusp::neighbours::{Neighbour, Neighbours, OwnPlace};
use facemill_cutter_location::cusp::{Ridge, permitted_step_over};
use facemill_job::failure::Failure;
use facemill_job::format::report::WidthRoundReport;
use facemill_job::setup::path::{ExpectedWidths, LaidPath, lay_by_widths};
use facemill_job::stages::LAY;
use facemill_tool_model::Cusp;
use rayon::prelude::*;

use crate::passes::engagement::neighbour_reach;
use crate::passes::extra_passes::{AddedPasses, ExtraPasses, PlannedPath};
use crate::passes::path_planner::{PathPlanner, strategy_of};
use crate::passes::width_field::{WidthField, WidthSample};

/// Poses of the best round, and all rounds.
pub(crate) struct BestRound {
    pub(crate) path: LaidPath,
    pub(crate) poses: PlannedPath,
    pub(crate) extra: ExtraPasses,
    /// Empty if passes were laid once.
    pub(crate) rounds: Vec<WidthRoundReport>,
}

/// A round: passes as laid, with their poses, and as improved.
struct LaidRound {
    path: LaidPath,
    poses: PlannedPath,
    extra: ExtraPasses,
    ridges: PathRidges,
    report: WidthRoundReport,
}

/// PathRidges of a path, and the widths that its postures permit.
struct PathRidges {
    /// Largest height, lifts included; `None` where a strip stays uncut.
    largest: Option<f64>,
    samples: Vec<WidthSample>,
}

/// Least and largest factor on an expected width: beyond, the estimate is none.
const FACTORS: [f64; 2] = [0.4, 2.5];

/// Distance over which factors are spread, in largest step-overs. Smaller: gaps between passes;
/// larger: postures that change along a pass are taken for the same.
const REACH: f64 = 0.75;

/// Share of the cusp that lifts may take at most.
const LIFT_SHARE: f64 = 0.5;

/// Share of the time that a further round has to win for another one.
const WORTH: f64 = 0.002;

/// Share of the points that may lose their posture from the first round to a better one.
const MORE_WITHOUT: f64 = 1e-3;

impl PathPlanner<'_, '_> {
    /// Plans passes as laid, and as often as the job says lays them again with the widths that the
    /// postures permit; returns the best round.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn best_round(&self, index: usize, path: LaidPath) -> Result<BestRound, Failure> {
        let strategy = strategy_of(self.operation).filter(|_| self.ground.added == AddedPasses::All);
        let n_rounds = strategy.map_or(0, |s| s.width_rounds);
        if n_rounds == 0 {
            let mut poses = self.posed(&path.tasks)?;
            let extra = self.add_passes(&mut poses)?;
            return Ok(BestRound { path, poses, extra, rounds: Vec::new() });
        }
        let scene = self.ground.scene;
        let widths = ExpectedWidths::of(scene.job, scene.setup, self.operation)?;
        let mut best = self.round(path, &widths, None)?;
        let (mut rounds, mut best_index) = (vec![best.report.clone()], 0);
        let mut samples = best.ridges.samples.clone();
        for k in 1..=n_rounds as usize {
            let field = WidthField::new(samples, REACH * self.operation.tolerances.max_step_over_mm);
            let laying = self.stages.start(LAY, 0);
            let factor = |cc: &CcPoint| field.at(&cc.position, &cc.normal);
            let again = lay_by_widths(scene.job, scene.setup, (index, self.operation), &factor);
            drop(laying);
            // Narrower strips may be more passes than a plan may have.
            let Ok(path) = again else { break };
            let round = self.round(path, &widths, Some(&field))?;
            samples = round.ridges.samples.clone();
            rounds.push(round.report.clone());
            let worth = round.report.time_s < (1.0 - WORTH) * best.report.time_s;
            if self.is_better(&round.report, &best.report, rounds[0].points_without_posture) {
                (best, best_index) = (round, k);
                if !worth && self.is_within(&best.report) {
                    break;
                }
            }
        }
        rounds[best_index].is_cut = true;
        let LaidRound { path, poses, extra, .. } = best;
        Ok(BestRound { path, poses, extra, rounds })
    }

    /// Plans a round; `field` has the factors that it was laid by.
    fn round(
        &self,
        path: LaidPath,
        widths: &ExpectedWidths<'_>,
        field: Option<&WidthField>,
    ) -> Result<LaidRound, Failure> {
        let mut poses = self.posed(&path.tasks)?;
        let ridges = self.ridges(&poses, widths, field);
        let extra = self.add_passes(&mut poses)?;
        let report = WidthRoundReport {
            passes: path.tasks.len(),
            passes_added: extra.moved + extra.between,
            length_mm: poses.tasks.iter().map(|t| length(&t.pass.points)).sum(),
            time_s: self.time_of(&poses),
            largest_as_laid_mm: ridges.largest,
            largest_mm: self.ridges(&poses, widths, field).largest,
            points_without_posture: poses.outcomes.iter().flat_map(|o| &o.points).filter(|o| o.is_err()).count(),
            is_cut: false,
        };
        Ok(LaidRound { path, poses, extra, ridges, report })
    }

    fn is_within(&self, round: &WidthRoundReport) -> bool {
        // Lifts count in the ridge, and not in the passes that are added for it.
        let limit = self.operation.tolerances.cusp_mm + self.operation.tolerances.max_lift_mm;
        round.largest_mm.is_some_and(|h| h <= limit)
    }

    /// Returns whether a round is better than another: it keeps the cusp, loses no points, or takes
    /// less time.
    fn is_better(&self, round: &WidthRoundReport, other: &WidthRoundReport, without_at_first: usize) -> bool {
        let most = without_at_first + (MORE_WITHOUT * self.n_points(round)) as usize;
        let keeps = |r: &WidthRoundReport| (r.points_without_posture <= most, self.is_within(r));
        match (keeps(round), keeps(other)) {
            (own, other) if own != other => own > other,
            _ => round.time_s < other.time_s,
        }
    }

    fn n_points(&self, round: &WidthRoundReport) -> f64 {
        round.length_mm / self.operation.tolerances.max_step_mm
    }

    /// Returns the ridges between the passes of a path, with the factors on the expected widths
    /// that the postures taken permit.
    fn ridges(&self, path: &PlannedPath, widths: &ExpectedWidths<'_>, field: Option<&WidthField>) -> PathRidges {
        let planned = path.planned();
        let cutter = self.tests.plain.cell.tool.cutter();
        let neighbours = Neighbours::new(planned.passes(), neighbour_reach(cutter, self.operation));
        let of_run = |run: usize| -> Vec<(Option<f64>, Vec<WidthSample>)> {
            let of_point = |point: usize| {
                let (own, lift) = (&neighbours.passes()[run].points[point], planned.lifts[run][point]);
                let beside = neighbours.of(OwnPlace { pass: run, point });
                let toward = |n: &Neighbour| {
                    let height = match Ridge::toward(cutter, own, n).cusp {
                        Cusp::Height(height) => Some(height + lift),
                        Cusp::Uncut => None,
                    };
                    let tolerances = &self.operation.tolerances;
                    let cusp = tolerances.cusp_mm - lift.min(LIFT_SHARE * tolerances.cusp_mm);
                    let permitted = permitted_step_over(cutter, own, n, cusp, tolerances.max_step_over_mm);
                    (height, samples(&own.cc, n, permitted, widths, field))
                };
                beside.before().map(toward).collect::<Vec<_>>()
            };
            (0..neighbours.passes()[run].points.len()).flat_map(of_point).collect()
        };
        let of_runs: Vec<_> = (0..neighbours.passes().len()).into_par_iter().map(of_run).collect();
        let mut ridges = PathRidges { largest: Some(0.0), samples: Vec::new() };
        for (height, samples) in of_runs.into_iter().flatten() {
            ridges.largest = ridges.largest.zip(height).map(|(a, b)| a.max(b));
            ridges.samples.extend(samples);
        }
        ridges
    }
}

/// Returns the factors that a strip between a point and the pass beside it needs, at both and in
/// the middle.
fn samples(
    own: &CcPoint,
    beside: &Neighbour,
    permitted: f64,
    widths: &ExpectedWidths<'_>,
    field: Option<&WidthField>,
) -> Vec<WidthSample> {
    let other = CcPoint {
        feed: if own.feed.dot(&beside.point.cc.feed) < 0.0 { -beside.point.cc.feed } else { beside.point.cc.feed },
        ..beside.point.cc
    };
    let middle = CcPoint::new(
        nalgebra::center(&own.position, &other.position),
        own.normal.into_inner() + other.normal.into_inner(),
        own.feed.into_inner() + other.feed.into_inner(),
    );
    let sample = |cc: &CcPoint| {
        let laid_by = field.map_or(1.0, |f| f.at(&cc.position, &cc.normal));
        let step = beside.strip.step_over;
        let factor = if step > permitted {
            laid_by * permitted / step
        } else {
            // A posture may be as steep as its strip allows: it does not show that a wider strip
            // would leave too much, only that this one could be wider.
            laid_by.max(permitted / widths.at(cc).max(f64::MIN_POSITIVE))
        };
        WidthSample { position: cc.position, normal: cc.normal, factor: factor.clamp(FACTORS[0], FACTORS[1]) }
    };
    [Some(*own), middle.ok(), Some(other)].iter().flatten().map(sample).collect()
}

/// Returns the length of a pass, mm.
fn length(points: &[CcPoint]) -> f64 {
    points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum()
}
