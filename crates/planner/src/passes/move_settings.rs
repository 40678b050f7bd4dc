//! Settings of the moves of an operation.

use facemill_cl_data::CuttingLaw;
use facemill_cutter_location::links::approach::{ApproachSettings, ApproachShape};
use facemill_cutter_location::links::link::LinkSettings;
use facemill_inverse_kinematics::BlockLaw;
use facemill_job::format::job_file::{ApproachFile, ArcFile, LinkingFile, OperationFile, PassOrderFile, PathFile};
use facemill_job::frames::diagonal;
use facemill_job::load::clearance_surface::clearance_surface;
use facemill_job::load::job::{Job, Setup};
use facemill_tool_model::Cutter;
use facemill_tool_path::linearity::Linearity;
use facemill_tool_path::moves::MoveSettings;
use facemill_tool_path::moves::turn::TurnSettings;

/// Returns the largest deviation of the control in cuts, entries and exits of an operation.
pub(crate) fn cut_linearity(job: &Job, operation: &OperationFile) -> Linearity {
    linearity(job, operation.tolerances.linearisation_mm, job.post.cutting_law())
}

pub(crate) fn linearity(job: &Job, tolerance: f64, law: CuttingLaw) -> Linearity {
    Linearity { tolerance, rounding: job.post.rounding_bound(), law }
}

/// Returns the settings for the moves of an operation.
pub(crate) fn move_settings(job: &Job, setup: &Setup<'_>, operation: &OperationFile) -> MoveSettings {
    let clearance = setup.file.rapid_clearance_mm;
    // Along the tool axis, out of any stock that the tool can be in.
    let max_retract = diagonal(&setup.aabb()).max(100.0);
    let rapid_law = job.rapid_law();
    let law = if let BlockLaw::Cutting(law) = rapid_law { law } else { CuttingLaw::AxesLinear };
    MoveSettings {
        entry: approach_settings(&operation.entry, job.tool.cutter(), clearance, max_retract),
        exit: approach_settings(&operation.exit, job.tool.cutter(), clearance, max_retract),
        link: LinkSettings {
            clearance: clearance_surface(&setup.file.clearance),
            rapid_clearance: clearance,
            rapid_law,
        },
        turns: None,
        shortest_order: setup.file.links.order == PassOrderFile::Shortest,
        linearity: cut_linearity(job, operation),
        // Half of the distance that rapids keep anyway; independent axis motions are tested block
        // by block.
        rapid_linearity: linearity(job, 0.5 * clearance, law),
    }
}

/// Returns the settings of turns with the tool down; `None` where passes do not go back and forth,
/// or the job wants links.
pub(crate) fn turn_settings(job: &Job, setup: &Setup<'_>, operation: &OperationFile) -> Option<TurnSettings> {
    let PathFile::Strategy(path) = &operation.path else { return None };
    let feeds = &operation.feeds;
    let feed = feeds.turn_mm_min.unwrap_or(feeds.approach_mm_min).min(feeds.cutting_mm_min) / 60.0;
    let settings =
        TurnSettings { feed, approach_feed: feeds.approach_mm_min / 60.0, test_step: test_step(job.tool.cutter()) };
    (path.linking == LinkingFile::Zigzag && setup.file.links.turns).then_some(settings)
}

/// Number of poses of an entry's or exit's arc per radius of path: chords deviate from the arc by
/// 2e-5 of its radius, and are at most 0.4° steeper than it.
pub(crate) const ARC_STEPS: f64 = 80.0;

/// Largest and smallest distance between tested poses on entries and exits, mm. Within, it is a
/// quarter of the corner radius: a rounded rim then dips by at most 1/128 of it past a point that
/// it touches between two.
pub(crate) const TEST_STEPS: [f64; 2] = [1.0, 0.25];

/// Returns the settings of an entry or exit.
pub(crate) fn approach_settings(
    file: &ApproachFile,
    cutter: &Cutter,
    rapid_clearance: f64,
    max_retract: f64,
) -> ApproachSettings {
    let (ApproachFile::TangentialArc(arc) | ApproachFile::RollIn(arc) | ApproachFile::Shortest(arc)) = file;
    let &ArcFile { radius_mm: radius, straight_mm: straight, .. } = arc;
    let angle = arc.angle_deg.to_radians();
    let shape = match file {
        ApproachFile::TangentialArc(_) => ApproachShape::TangentialArc { radius, angle },
        ApproachFile::RollIn(_) => ApproachShape::RollIn { radius, angle },
        ApproachFile::Shortest(_) => ApproachShape::Shortest { radius, angle },
    };
    ApproachSettings {
        shape,
        straight,
        bend: 0.0,
        step: radius / ARC_STEPS,
        line_step: radius / ARC_STEPS,
        test_step: test_step(cutter),
        rapid_clearance,
        max_retract,
        still_across: None,
    }
}

/// Returns the distance between tested poses on entries, exits and turns, mm.
fn test_step(cutter: &Cutter) -> f64 {
    (0.25 * cutter.corner_radius()).clamp(TEST_STEPS[1], TEST_STEPS[0])
}
