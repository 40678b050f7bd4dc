//! CC points of an operation, from a path file or laid by a strategy.

use facemill_cc_path::{
    Direction, LaySettings, LevelOrder, Pattern, ProjectSettings, UncutSide, lay_passes, project, read_path_file,
};
use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::cusp::expected_strip_width;

use crate::cell::{search_curve, wanted_uncut_left};
use crate::job_file::{
    LevelOrderFile, LinkingFile, OperationFile, PathFile, PathFromFile, PathFromStrategy, UncutSideFile,
};
use crate::load::{Job, Setup};
use crate::pieces::LaidTask;
use crate::{Failure, files};

/// A pass, and whether the uncut stock lies to the left of its feed.
type SidedPass = (Pass<CcPoint>, bool);

/// The passes of an operation.
pub(crate) struct LaidPath {
    /// Passes in cutting order, each with its search curve.
    pub tasks: Vec<LaidTask>,
    /// Pieces left out because they are shorter than asked.
    pub dropped_pieces: usize,
}

/// Lays or projects the path of an operation.
///
/// # Errors
/// When the path file is wrong, or the region holds nothing that passes could be laid on.
pub(crate) fn lay(job: &Job, setup: &Setup<'_>, index: usize, operation: &OperationFile) -> Result<LaidPath, Failure> {
    let at = format!("operations[{index}].path");
    let (passes, dropped_pieces) = match &operation.path {
        PathFile::File(file) => (from_file(job, setup, operation, file)?, 0),
        PathFile::Strategy(strategy) => from_strategy(job, setup, operation, strategy, &at)?,
    };
    let tasks = passes
        .into_iter()
        .map(|(pass, uncut_left)| {
            // A pass whose direction is free is cut with the side that the path gives it.
            let uncut_left = wanted_uncut_left(job, operation.direction).unwrap_or(uncut_left);
            let pass = pass.map(|cc| raised(cc, setup.drive_allowance));
            Ok(LaidTask { pass, uncut_left, curve: search_curve(job, operation, uncut_left)? })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    if tasks.is_empty() {
        return Err(
            job.wrong(format!("{at}: no pass lies on the drive surface; widen the region or the strategy's range"))
        );
    }
    Ok(LaidPath { tasks, dropped_pieces })
}

/// A CC point on the material that is left on the drive surface.
fn raised(cc: &CcPoint, allowance: f64) -> CcPoint {
    CcPoint { position: cc.position + cc.normal.into_inner() * allowance, ..*cc }
}

/// Passes of a path file. The file's order of points is turned round where the wanted side of the uncut stock asks for it.
fn from_file(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    file: &PathFromFile,
) -> Result<Vec<SidedPass>, Failure> {
    let path = job.beside(&file.file);
    let read = read_path_file(&files::read(&path)?).map_err(|e| Failure::input(&path, e))?;
    let settings = ProjectSettings {
        max_distance: file.max_distance_mm,
        work_from_mesh: crate::load::pose(&setup.file.work_from_part),
    };
    let passes = project(&read, &setup.drive, &settings).map_err(|e| Failure::input(&path, e))?;
    let uncut_left = file.uncut_side == UncutSideFile::Left;
    let turn = wanted_uncut_left(job, operation.direction).is_some_and(|wanted| wanted != uncut_left);
    Ok(passes.into_iter().map(|pass| (if turn { reversed(pass) } else { pass }, uncut_left)).collect())
}

/// A pass cut the other way.
fn reversed(pass: Pass<CcPoint>) -> Pass<CcPoint> {
    Pass::new(pass.points.into_iter().rev().map(|cc| CcPoint { feed: -cc.feed, ..cc }).collect())
}

fn from_strategy(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    file: &PathFromStrategy,
    at: &str,
) -> Result<(Vec<SidedPass>, usize), Failure> {
    let tolerances = &operation.tolerances;
    let wrong = |e: facemill_cc_path::PathError| job.wrong(format!("{at}.strategy: {e}"));
    let strategy = file.strategy.to_strategy().map_err(wrong)?;
    let mut region = file.region.to_region().map_err(wrong)?;
    region.groups = Some(match region.groups {
        None => setup.drive_groups.clone(),
        Some(named) => match named.iter().find(|name| !setup.drive_groups.contains(name)) {
            None => named,
            Some(other) => {
                return Err(job.wrong(format!(
                    "{at}.strategy.region.groups: \"{other}\" is no group of the drive surface; its groups are {}",
                    setup.drive_groups.join(", ")
                )));
            }
        },
    });
    let surface = &setup.around_drive;
    let wanted = wanted_uncut_left(job, operation.direction);
    let settings = LaySettings {
        chord_tolerance: tolerances.path_chord_mm,
        max_step: tolerances.max_step_mm,
        max_step_over: tolerances.max_step_over_mm,
        // A hundredth of what the user allows: a surface that asks for less asks for another tool.
        min_step_over: 0.01 * tolerances.max_step_over_mm,
        order: match file.order {
            LevelOrderFile::Increasing => LevelOrder::Increasing,
            LevelOrderFile::Decreasing => LevelOrder::Decreasing,
        },
        pattern: match file.linking {
            LinkingFile::OneWay => Pattern::OneWay,
            LinkingFile::Zigzag => Pattern::Zigzag,
        },
        direction: Direction::Forward,
        uncut: wanted.map(|left| if left { UncutSide::Left } else { UncutSide::Right }),
        edge_margin: file.edge_margin_mm,
        min_pass_length: file.min_pass_length_mm,
        ..LaySettings::default()
    };
    let curve = search_curve(job, operation, wanted.unwrap_or(false))?;
    let cutter = job.tool.cutter();
    let strip_width = |cc: &CcPoint| {
        let curvature =
            surface.closest_point(&cc.position, tolerances.max_step_over_mm).and_then(|p| surface.curvature_at(&p));
        expected_strip_width(cutter, cc, curvature.as_ref(), &curve, tolerances.cusp_mm, tolerances.max_step_over_mm)
    };
    let laid = lay_passes(surface, &region, &strategy, &settings, &strip_width, &Silent).map_err(wrong)?;
    let passes = laid.passes.into_iter().map(|p| (p.pass, p.uncut == UncutSide::Left)).collect();
    Ok((passes, laid.n_dropped_pieces))
}
