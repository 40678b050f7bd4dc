//! Passes on a level, where the tool has room past the part.

use facemill_cc_path::LeftRegion;
use facemill_level_region::{LevelPassSettings, SidedPass, level_passes};
use nalgebra::Point3;

use crate::format::job_file::{DirectionFile, OperationFile, PathFromStrategy};
use crate::load::job::{Job, Setup};
use crate::setup::cell::wanted_uncut_left;

/// Returns the pieces of a level's passes where an upright tool has room, then passes around what
/// is there, and the number of pieces that are too short; passes as they are of a setup without
/// a level. With the direction `either` each begins outside of the stock, if it can.
pub(crate) fn passes_on_level(
    job: &Job,
    setup: &Setup<'_>,
    (operation, path): (&OperationFile, &PathFromStrategy),
    (passes, left): (Vec<SidedPass>, Option<&LeftRegion>),
) -> (Vec<SidedPass>, usize) {
    let (Some([room, stock]), Some(level), Some(left)) = (setup.level_rooms(), &setup.level, left) else {
        return (passes, 0);
    };
    let (level, normal) = (&level.level, level.level.plane().axis());
    let climb = || wanted_uncut_left(job, DirectionFile::Climb).unwrap_or(false);
    let settings = LevelPassSettings {
        least: path.min_pass_length_mm,
        is_reversible: operation.direction == DirectionFile::Either,
        is_left: wanted_uncut_left(job, operation.direction).unwrap_or_else(climb),
        tolerance: operation.tolerances.path_chord_mm,
        max_step: operation.tolerances.max_step_mm,
        max_run_in: level.diagonal() + 2.0 * job.tool.cutter().radius(),
        is_cut: &|point: &Point3<f64>| left.is_cut(point, &normal),
    };
    level_passes(&room, &stock, level.reach(), &passes, &settings)
}
