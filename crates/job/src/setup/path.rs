//! CC points of an operation, from a path file or laid by a strategy.

use facemill_cc_path::{
    Direction, LaySettings, LevelOrder, MAX_POINTS, PathError, Pattern, ProjectSettings, Remedy, UncutSide, lay_passes,
    project, read_path_file,
};
use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::cusp::expected_strip_width;
use facemill_tool_path::pieces::LaidTask;

use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{
    LevelOrderFile, LinkingFile, OperationFile, PathFile, PathFromFile, PathFromStrategy, UncutSideFile,
};
use crate::load::job::{Job, Setup};
use crate::load::part_size::unit_advice;
use crate::setup::cell::{LEAST_STEP, search_curve, wanted_uncut_left};

/// A pass, and whether the uncut stock lies to the left of its feed.
type SidedPass = (Pass<CcPoint>, bool);

/// The passes of an operation.
pub struct LaidPath {
    /// Passes in cutting order, each with its search curve.
    pub tasks: Vec<LaidTask>,
    /// Pieces left out because they are shorter than asked.
    pub dropped_pieces: usize,
}

/// Lays or projects the path of an operation.
///
/// # Errors
/// When the path file is wrong, or the region holds nothing that passes could be laid on; a part of
/// a size that cannot be meant has the likely unit in the message.
pub fn lay(job: &Job, setup: &Setup<'_>, index: usize, operation: &OperationFile) -> Result<LaidPath, Failure> {
    laid(job, setup, index, operation).map_err(|e| match unit_advice(job, setup) {
        Some(advice) => job.wrong(format!("{advice} As it is, no passes can be laid for \"{}\"", operation.name)),
        None => e,
    })
}

fn laid(job: &Job, setup: &Setup<'_>, index: usize, operation: &OperationFile) -> Result<LaidPath, Failure> {
    let at = format!("operations[{index}].path");
    let (passes, dropped_pieces) = match &operation.path {
        PathFile::File(file) => {
            let passes = from_file(job, setup, operation, file)?;
            check_number(&passes, operation).map_err(|e| Failure::input(&job.beside(&file.file), e))?;
            (passes, 0)
        }
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

/// Passes of a path file. The file's order of points is turned round where the wanted side of the
/// uncut stock asks for it.
fn from_file(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    file: &PathFromFile,
) -> Result<Vec<SidedPass>, Failure> {
    let path = job.beside(&file.file);
    let read = read_path_file(&files::read_named(&path)?).map_err(|e| Failure::input(&path, e))?;
    let settings = ProjectSettings {
        max_distance: file.max_distance_mm,
        work_from_mesh: crate::frames::pose(&setup.file.work_from_part),
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
    let wrong = |e: PathError| {
        job.wrong(format!("{at}.strategy: {e}{}", e.remedy().map_or(String::new(), |r| keys(r, operation))))
    };
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
        min_step_over: LEAST_STEP * tolerances.max_step_over_mm,
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
        max_points: (MAX_POINTS / n_places(operation)).max(1),
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

fn n_places(operation: &OperationFile) -> usize {
    operation.pattern.as_ref().map_or(1, |p| p.copies as usize)
}

/// Keys of the job that a remedy is about, with what they have now.
fn keys(remedy: Remedy, operation: &OperationFile) -> String {
    let t = &operation.tolerances;
    let places = match n_places(operation) {
        1 => String::new(),
        n => format!(", in each of the {n} places of the pattern"),
    };
    let (key, now) = match remedy {
        Remedy::LargestStepOver(_) => ("max_step_over_mm", t.max_step_over_mm),
        Remedy::LargestStep(_) => ("max_step_mm", t.max_step_mm),
        Remedy::ChordTolerance(_) => ("path_chord_mm", t.path_chord_mm),
        Remedy::StripWidth(times) => {
            let cusp = format!("{:.1e}", 1.05 * t.cusp_mm * times * times).parse().unwrap_or(t.cusp_mm);
            return format!(" (tolerances.cusp_mm, which is {}: {cusp} is enough){places}", t.cusp_mm);
        }
    };
    format!(" (tolerances.{key}, which is {now}){places}")
}

/// That points read from a file are no more than a plan may have.
fn check_number(passes: &[SidedPass], operation: &OperationFile) -> Result<(), String> {
    let n: usize = passes.iter().map(|(pass, _)| pass.points.len()).sum();
    let places = n_places(operation);
    if n.saturating_mul(places) <= MAX_POINTS {
        return Ok(());
    }
    Err(format!(
        "{n} points in {places} place(s) are more than the {MAX_POINTS} that a plan may have; give every second one, or share them among \
         several jobs"
    ))
}

#[cfg(test)]
#[path = "../../tests/unit/setup/path.rs"]
mod tests;
