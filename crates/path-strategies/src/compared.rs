//! Plans of a job by several strategies, one after the other.

use facemill_job::failure::Failure;
use facemill_job::format::job_file::{JobFile, PoseFile};
use facemill_job::format::report::Report;
use facemill_job::frames::pose;
use facemill_job::load::job::Job;
use facemill_job::stages::Stages;
use facemill_job::validate::validate;
use facemill_planner::{PlanSettings, Planned, plan_job};
use nalgebra::{UnitQuaternion, Vector3};

use crate::paths_file::{ComparedStrategy, PlannedPasses};
use crate::strategies::NamedStrategy;

/// Options of a comparison.
#[derive(Clone, Debug)]
pub struct CompareRequest {
    /// Strategies, in the order of the comparison.
    pub strategies: Vec<NamedStrategy>,
    /// Turns of the mounting about z of the table, deg, each with every strategy; 0 is the job's.
    pub mounting_angles_deg: Vec<f64>,
    /// Options of each plan.
    pub settings: PlanSettings,
    /// Distance of the stock's lines as [`plan_job`] takes it, mm.
    pub stock_cell: Option<f64>,
}

impl CompareRequest {
    /// Returns the job of the row of this index; `None` if there is none.
    pub fn job_of(&self, row: usize) -> Option<JobFile> {
        let n = self.strategies.len().max(1);
        let (angle, strategy) = (self.mounting_angles_deg.get(row / n)?, self.strategies.get(row % n)?);
        Some(turned(&strategy.file, *angle))
    }
}

/// Receiver of the steps of a comparison.
pub trait ComparisonSteps {
    /// The plan of this number, from 0, of so many begins.
    fn begin(&self, number: usize, n_plans: usize, strategy: &str);
    /// A plan is there, before its files are dropped.
    fn planned(&self, _number: usize, _planned: &[Planned]) {}
}

/// Plans a job by several strategies, one after the other: only one plan is in memory at a time.
///
/// A strategy that cannot be planned is a row with its reason.
///
/// # Errors
/// If the stages are cancelled, or the planner fails internally.
pub fn compare_paths(
    job: &Job,
    request: &CompareRequest,
    stages: &dyn Stages,
    steps: &dyn ComparisonSteps,
) -> Result<Vec<ComparedStrategy>, Failure> {
    let n_plans = request.mounting_angles_deg.len() * request.strategies.len();
    let mut rows = Vec::new();
    for &mounting_angle_deg in &request.mounting_angles_deg {
        for NamedStrategy { name, file } in &request.strategies {
            steps.begin(rows.len(), n_plans, name);
            let file = turned(file, mounting_angle_deg);
            let planned = plan_with(job, file, request, stages);
            let (failed, planned) = match planned {
                Ok(planned) => (None, planned),
                Err(e @ (Failure::Interrupted | Failure::Internal(_))) => return Err(e),
                Err(e) => (Some(e.to_string()), Vec::new()),
            };
            steps.planned(rows.len(), &planned);
            rows.push(ComparedStrategy {
                strategy: name.clone(),
                mounting_angle_deg,
                failed,
                outcome: planned.iter().map(Planned::outcome).max(),
                setups: planned.iter().map(|p| figures(&p.report)).collect(),
            });
        }
    }
    Ok(rows)
}

fn plan_with(job: &Job, file: JobFile, request: &CompareRequest, stages: &dyn Stages) -> Result<Vec<Planned>, Failure> {
    validate(&file).map_err(|e| job.wrong(e))?;
    let job = Job { settings: job.settings.clone(), ..Job::of(&job.path, file)? };
    plan_job(&job, request.settings, request.stock_cell, stages)
}

/// Returns a job whose mountings are turned about z of the table.
fn turned(file: &JobFile, angle_deg: f64) -> JobFile {
    let mut file = file.clone();
    if angle_deg != 0.0 {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_deg.to_radians());
        for setup in &mut file.setups {
            let mounting = turn * pose(&setup.table_from_work);
            let (axis, angle) = mounting.rotation.axis_angle().unwrap_or((Vector3::z_axis(), 0.0));
            setup.table_from_work = PoseFile {
                translation_mm: mounting.translation.vector.into(),
                rotation_axis: axis.into_inner().into(),
                rotation_deg: angle.to_degrees(),
            };
        }
    }
    file
}

/// Returns the figures of a plan.
fn figures(report: &Report) -> PlannedPasses {
    let sum = |of: fn(&facemill_job::format::report::efficiency::EfficiencyReport) -> f64| -> Option<f64> {
        (!report.efficiency.is_empty()).then(|| report.efficiency.iter().map(of).sum())
    };
    let passes_length_mm = report.passes.iter().map(|p| p.length_mm).sum();
    let left = || report.remaining.iter().flat_map(|r| &r.operations);
    // A pass along a line has no floor, and so its plan has none.
    let has_floor = left().all(|r| r.length_mm.is_none());
    let (floor_mm, least_floor_mm) = (sum(|e| e.floor_mm), sum(|e| e.least_floor_mm));
    let (floor_mm, least_floor_mm) = (floor_mm.filter(|_| has_floor), least_floor_mm.filter(|_| has_floor));
    let totals = &report.totals;
    let [passes_time_s, approach_time_s, link_time_s] = match &report.time_law {
        Some(law) => [law.passes_time_s, law.approach_time_s, law.rapid_time_s],
        None => [totals.passes_time_s, totals.approach_time_s, totals.rapid_time_s],
    };
    let of_pairs = report.pairs.iter().flat_map(|p| p.posture_jumps);
    PlannedPasses {
        setup: report.setup.clone(),
        passes: totals.passes,
        planned_fraction: totals.planned_fraction,
        passes_length_mm,
        floor_mm,
        efficiency: floor_mm.map(|floor| passes_length_mm / floor),
        over_least_floor: least_floor_mm.map(|floor| passes_length_mm / floor),
        by_time_law: report.time_law.is_some(),
        passes_time_s,
        time_over_feed: totals.time_over_feed,
        approach_time_s,
        link_time_s,
        total_time_s: passes_time_s + approach_time_s + link_time_s,
        cusp_p99_mm: left().map(|r| r.p99_mm).reduce(f64::max),
        cusp_largest_mm: report.remaining.as_ref().and_then(|r| r.largest()).map(|place| place.height_mm),
        never_cut_fraction: left().map(|r| r.never_cut_fraction).reduce(f64::max),
        region_area_mm2: report.remaining.as_ref().map(|_| left().map(|r| r.area_mm2).sum()),
        region_length_mm: report.remaining.as_ref().map(|_| left().filter_map(|r| r.length_mm).sum()),
        rotary_reversals: report.postures.iter().flat_map(|p| &p.rotary).map(|r| r.reversals).sum(),
        posture_jumps: report.postures.iter().filter_map(|p| p.optimum.as_ref()).map(|o| o.jumps).chain(of_pairs).sum(),
        faults: report.findings.iter().filter(|f| f.kind.is_fault()).count(),
    }
}
