//! Passes on a level, where the tool has room past the part.

use facemill_cc_path::LeftRegion;
use facemill_cl_data::CcPoint;
use facemill_level_region::{KeptOff, LevelPassSettings, SidedPass, level_passes};
use nalgebra::Point3;

use crate::format::job_file::{DirectionFile, OperationFile, PathFromStrategy};
use crate::load::job::{Job, Setup};
use crate::planning_stock::PlanningStock;
use crate::setup::cell::wanted_uncut_left;
use crate::setup::left_stock::LAYER_ROUNDING;

/// Returns the places of the tip from which the tool would cut more than the thickness of a level,
/// because the level above is not cut there; `None` of a first level, and before programs are
/// known.
fn kept_off(job: &Job, setup: &Setup<'_>) -> Option<KeptOff> {
    let is_as_read = setup.planning_stock == PlanningStock::Own { why: None };
    let level = setup.level.as_ref().filter(|level| level.is_later && !is_as_read)?;
    let (plane, reach, error) = (level.level.plane(), level.level.reach(), setup.planning_stock.error());
    let (normal, feed) = (plane.axis(), plane.at(1.0, 0.0) - plane.at(0.0, 0.0));
    let thickness = level.depth + error + LAYER_ROUNDING;
    let is_tall = |(place, _): (Point3<f64>, bool)| {
        CcPoint::new(place, normal.into_inner(), feed).is_ok_and(|cc| setup.stock_above(&cc) > thickness)
    };
    let is_tall: Vec<bool> = reach.middles().map(is_tall).collect();
    Some(reach.kept_off(&is_tall, error, job.tool.cutter().radius()))
}

/// Returns the pieces of a level's passes where an upright tool has room, then passes around what
/// is there, and the number of pieces that are too short; passes as they are of a setup without
/// a level. A later level is not cut where it is thicker than its depth. With the direction
/// `either` each begins outside of the stock, if it can.
pub(crate) fn passes_on_level(
    job: &Job,
    setup: &Setup<'_>,
    (operation, path): (&OperationFile, &PathFromStrategy),
    (passes, left): (Vec<SidedPass>, Option<&LeftRegion>),
) -> (Vec<SidedPass>, usize) {
    let (Some([room, stock]), Some(level), Some(left)) = (setup.level_rooms(), &setup.level, left) else {
        return (passes, 0);
    };
    let room = match kept_off(job, setup) {
        Some(places) => room.keeping_off(places),
        None => room,
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
