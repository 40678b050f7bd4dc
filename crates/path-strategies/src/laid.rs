//! Passes as a job's strategies lay them, before any posture is planned.

use facemill_cl_data::{CcPoint, Pass};
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::expected_posture;
use facemill_cutter_location::cusp::neighbours::{CutPass, Neighbours, OwnPlace};
use facemill_cutter_location::cusp::strips::strip_width;
use facemill_drawing::passes_svg::{DrawnPoint, passes_svg};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::pass_surface::{extended_region, surface_of};
use facemill_job::setup::path::lay_operation;
use facemill_job::stages::{LAY, READ, Stages};
use facemill_job::validate::setup_names::file_stem;
use facemill_planner::{neighbour_reach, path_text};
use facemill_tool_model::FeedCurvature;
use facemill_tool_path::segments::LaidTask;
use facemill_verification::efficiency::{OperationCuts, efficiency};
use rayon::prelude::*;

use crate::paths_file::LaidPasses;

/// Passes of all operations of a job.
#[non_exhaustive]
pub struct LaidPaths {
    /// Figures of each operation.
    pub passes: Vec<LaidPasses>,
    /// Path files and pictures, by name.
    pub files: Vec<(String, Vec<u8>)>,
}

/// Lays the passes of all operations of a job in the first places of their patterns, with the
/// postures that the curvature of the surface lets expect; nothing is tested on the machine.
///
/// # Errors
/// If the input is wrong, or a strategy lays no pass.
pub fn lay_paths(job: &Job, stages: &dyn Stages) -> Result<LaidPaths, Failure> {
    let n_heads = if job.second.is_some() { 2 } else { 1 };
    let mut laid = LaidPaths { passes: Vec::new(), files: Vec::new() };
    for index in 0..job.file.setups.len() {
        let job = job.for_setup(index);
        let heads: Vec<Job> = (0..n_heads).map(|h| job.seen_by(h, 0.0)).collect();
        let reading = stages.start(READ, 0);
        let setup = Setup::read(&heads[0], index)?;
        drop(reading);
        let n_operations = job.operations_of(setup.file).count();
        for (number, (k, _)) in job.operations_of(setup.file).enumerate() {
            let number = if n_operations > 1 { format!("-{}", number + 1) } else { String::new() };
            let of_setup =
                if job.file.setups.len() > 1 { format!("-{}", file_stem(&setup.file.name)) } else { String::new() };
            laid.add_operation(&heads, (&setup, k), &format!("{of_setup}{number}"), stages)?;
        }
    }
    Ok(laid)
}

impl LaidPaths {
    /// Lays an operation, and adds its figures and files.
    fn add_operation(
        &mut self,
        heads: &[Job],
        (setup, index): (&Setup<'_>, usize),
        suffix: &str,
        stages: &dyn Stages,
    ) -> Result<(), Failure> {
        let _laying = stages.start(LAY, 0);
        let head = heads[0].file.operations[index].head as usize;
        let job = heads.get(head.saturating_sub(1)).unwrap_or(&heads[0]);
        let operation = &job.file.operations[index];
        let path = lay_operation(job, setup, index, operation)?;
        let passes = with_postures((job, setup, operation), &path.tasks);
        let cuts =
            OperationCuts { places: vec![passes.iter().map(|p| p.points.clone()).collect()], ..Default::default() };
        let measured = efficiency(job, setup, operation, cuts)?;
        let length = |pass: &CutPass| -> f64 {
            pass.points.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum()
        };
        let row = LaidPasses {
            setup: setup.file.name.clone(),
            operation: operation.name.clone(),
            passes: passes.len(),
            points: passes.iter().map(|p| p.points.len()).sum(),
            short_stretches: path.dropped_pieces,
            uncovered_mm2: path.uncovered_area,
            length_mm: passes.iter().map(length).sum(),
            floor_mm: measured.as_ref().map(|e| e.floor_mm),
            least_floor_mm: measured.as_ref().map(|e| e.least_floor_mm),
            efficiency: measured.as_ref().map(|e| e.efficiency),
        };
        let title = format!("{}, {}: {}, as laid", job.file.name, row.setup, row.operation);
        let picture = passes_svg(&title, &figures(&row), &drawn(job, operation, passes));
        let laid = path.tasks.iter().map(|task| Pass::new(task.pass.points.clone()));
        let text = path_text(&laid.collect::<Vec<Pass<CcPoint>>>(), setup.drive_allowance);
        self.files.push((format!("passes{suffix}.json"), text.into_bytes()));
        self.files.push((format!("passes{suffix}.svg"), picture.into_bytes()));
        self.passes.push(row);
        Ok(())
    }
}

fn figures(row: &LaidPasses) -> String {
    let mut text = format!("{} passes of {:.2} m", row.passes, row.length_mm / 1000.0);
    if let (Some(efficiency), Some(floor)) = (row.efficiency, row.floor_mm) {
        text += &format!(", {efficiency:.3} times their floor of {:.2} m with the expected postures", floor / 1000.0);
    }
    text
}

/// Returns the passes with the postures that are expected by curvature.
fn with_postures((job, setup, operation): (&Job, &Setup<'_>, &OperationFile), tasks: &[LaidTask]) -> Vec<CutPass> {
    let extended = extended_region(job, setup, operation).ok().flatten();
    let surface = surface_of(setup, extended.as_deref());
    let within = setup.drive_allowance.abs() + ON_SURFACE;
    let cut = |task: &LaidTask, cc: &CcPoint| {
        let foot = surface.closest_point(&cc.position, within);
        let curvature = foot.and_then(|foot| surface.curvature_at(&foot));
        CutPoint { cc: *cc, posture: expected_posture(job.tool.cutter(), cc, curvature.as_ref(), &task.curve) }
    };
    let pass = |task: &LaidTask| {
        let points = task.pass.points.iter().map(|cc| cut(task, cc)).collect();
        CutPass { points, uncut_left: task.uncut_left }
    };
    tasks.par_iter().map(pass).collect()
}

/// Largest distance of a laid point from its foot on the surface, mm.
const ON_SURFACE: f64 = 0.1;

/// Returns the passes with their use of the strips toward passes laid before.
fn drawn(job: &Job, operation: &OperationFile, passes: Vec<CutPass>) -> Vec<Vec<DrawnPoint>> {
    let (cutter, tolerances) = (job.tool.cutter(), &operation.tolerances);
    let neighbours = Neighbours::new(passes, neighbour_reach(cutter, operation));
    let point = |at: OwnPlace| {
        let own = &neighbours.passes()[at.pass].points[at.point];
        let beside = neighbours.of(at);
        let share = |curvature: &FeedCurvature, step: f64| {
            let allowed = strip_width(cutter, own.posture, curvature, tolerances.cusp_mm, tolerances.max_step_over_mm);
            step / allowed.max(f64::MIN_POSITIVE)
        };
        let strip_use = beside.before().map(|n| share(&n.strip.curvature, n.strip.step_over)).reduce(f64::max);
        DrawnPoint { position: own.cc.position, normal: own.cc.normal, strip_use }
    };
    let of_pass = |pass: usize| {
        let n_points = neighbours.passes()[pass].points.len();
        (0..n_points).map(|k| point(OwnPlace { pass, point: k })).collect()
    };
    (0..neighbours.passes().len()).into_par_iter().map(of_pass).collect()
}
