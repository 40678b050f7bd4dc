//! Passes on a level, where the tool has room past the part.

use std::f64::consts::TAU;

use facemill_cc_path::LeftRegion;
use facemill_cl_data::{CcPoint, Pass};
use facemill_level_region::{ContourSettings, PieceSettings, contour_passes, fitting_pieces};
use nalgebra::{Point3, Unit};

use crate::format::job_file::{DirectionFile, OperationFile, PathFile};
use crate::load::job::{Job, Setup};
use crate::setup::cell::wanted_uncut_left;

/// Directions from the tip in which material is sought for a contour.
const AROUND: u32 = 16;

/// A pass, and whether the uncut stock lies to the left of its feed.
pub(crate) type SidedPass = (Pass<CcPoint>, bool);

/// Returns the pieces of a level's passes where an upright tool has room, then passes around what
/// stands there, and the number of pieces that are too short; passes as they are of a setup without
/// a level.
///
/// With the direction `either` each begins outside of the stock, if it can.
pub(crate) fn level_passes(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    (passes, left): (Vec<SidedPass>, Option<&LeftRegion>),
) -> (Vec<SidedPass>, usize) {
    let (Some([room, stock]), Some(level), Some(left)) = (setup.level_rooms(), &setup.level, left) else {
        return (passes, 0);
    };
    let least = if let PathFile::Strategy(path) = &operation.path { path.min_pass_length_mm } else { 0.0 };
    let reach = level.level.reach();
    let is_open = |tip: &Point3<f64>| stock.fits(tip);
    let is_reversible = operation.direction == DirectionFile::Either;
    let pieces = PieceSettings { step: reach.cell(), least: least.max(reach.cell()), is_reversible, is_open: &is_open };
    let (mut laid, mut n_short) = (Vec::new(), 0);
    for (pass, uncut_left) in &passes {
        let (found, short) = fitting_pieces(&room, &pass.points, &pieces);
        n_short += short;
        laid.extend(found.into_iter().map(|points| {
            let is_turned = pass.points[0].feed.dot(&points[0].feed) < 0.0;
            (Pass::new(points), *uncut_left != is_turned)
        }));
    }
    let normal = level.level.plane().axis();
    let across = Unit::new_normalize(level.level.plane().at(1.0, 0.0) - level.level.plane().at(0.0, 0.0));
    let turned = |k: u32| nalgebra::Rotation3::from_axis_angle(&normal, TAU * f64::from(k) / f64::from(AROUND)) * across;
    let rim: Vec<_> = (0..AROUND).map(|k| turned(k).into_inner() * room.rim_radius()).collect();
    let is_needed =
        |tip: &Point3<f64>| left.is_cut(tip, &normal) || rim.iter().any(|to| left.is_cut(&(tip + to), &normal));
    let climb = || wanted_uncut_left(job, DirectionFile::Climb).unwrap_or(false);
    let contours = ContourSettings {
        tolerance: operation.tolerances.path_chord_mm,
        max_step: operation.tolerances.max_step_mm,
        max_run_in: level.level.diagonal() + 2.0 * job.tool.cutter().radius(),
        is_left: wanted_uncut_left(job, operation.direction).unwrap_or_else(climb),
        is_reversible,
        is_needed: &is_needed,
        is_open: &is_open,
    };
    let around = contour_passes(&room, reach, &contours);
    laid.extend(around.into_iter().map(|contour| (Pass::new(contour.points), contour.is_left)));
    (laid, n_short)
}
