//! Limits of a job file's numbers: beyond them a value is a slip of unit or key, or needs unbounded
//! work.

use std::ops::RangeInclusive;

use facemill_inverse_kinematics::{Carrier, Machine};
use facemill_tool_model::ToolAssembly;

use crate::format::job_file::{
    ApproachFile, ArcFile, JobFile, OperationFile, PathFile, PathFromCl, PathFromFile, PathFromStrategy, SetupFile,
};
use crate::frames::diagonal;
use crate::validate::{FARTHEST, Field};

/// Range of a key's value, in the key's own unit.
pub struct JobLimit<T> {
    /// Path of the key below its owner.
    key: &'static str,
    /// Its value, if present.
    of: fn(&T) -> Option<f64>,
    least: f64,
    most: f64,
}

const fn limit<T>(key: &'static str, of: fn(&T) -> Option<f64>, least: f64, most: f64) -> JobLimit<T> {
    JobLimit { key, of, least, most }
}

/// Reports the first value beyond its limits, as `field: what it must be`.
///
/// # Errors
/// If there is one.
pub fn check_limits<T>(at: &Field, limits: &[JobLimit<T>], of: &T) -> Result<(), String> {
    limits.iter().try_for_each(|l| (l.of)(of).map_or(Ok(()), |value| at.within(l.key, value, l.least, l.most)))
}

/// Largest spindle speed, 1/min: the fastest spindles turn at a tenth of it.
const FASTEST_SPINDLE: f64 = 1e6;

/// Smallest distance between points and between passes, mm.
const SMALLEST_STEP: f64 = 1e-3;

/// Largest distance between points and between passes: the length of the largest parts.
const LARGEST_STEP: f64 = 1e4;

/// Smallest tolerance, mm: a thousandth of written or measured lengths.
pub const SMALLEST_TOLERANCE: f64 = 1e-6;

/// Largest tolerance of the cutter into the part or off it, mm: above, it would be a depth of cut.
const LARGEST_TOLERANCE: f64 = 2.0;

/// Largest cusp and chord of a mesh, mm: beyond, no shape is cut.
const LARGEST_HEIGHT: f64 = 100.0;

/// Largest radius of entries and exits, mm: beyond, an arc is as good as straight, and longer than
/// any machine.
const LARGEST_ARC: f64 = 1e4;

/// Longest straight line between a pass and the arc at its end, mm.
const LARGEST_STRAIGHT: f64 = 1000.0;

/// Largest height of a level, mm: the size of the largest parts, far from their origin.
const LARGEST_LEVEL: f64 = 1e5;

/// Limits of the numbers of an operation.
///
/// Fineness: below the smallest steps and tolerances a program has more blocks than a control can
/// read; the generation of passes counts the resulting points.
pub const OPERATION_LIMITS: [JobLimit<OperationFile>; 48] = [
    limit("path.file.max_distance_mm", |o| path_file(o).map(|f| f.max_distance_mm), 0.0, FARTHEST),
    limit("path.cl.max_distance_mm", |o| path_cl(o).map(|f| f.max_distance_mm), 1e-4, 100.0),
    limit("path.strategy.edge_margin_mm", |o| strategy(o).map(|s| s.edge_margin_mm), 0.0, FARTHEST),
    limit("path.strategy.min_pass_length_mm", |o| strategy(o).map(|s| s.min_pass_length_mm), 0.0, FARTHEST),
    limit("path.strategy.width_rounds", |o| strategy(o).map(|s| f64::from(s.largest_width_rounds())), 0.0, 3.0),
    limit("entry.tangential_arc.radius_mm", |o| tangential(&o.entry).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("entry.tangential_arc.angle_deg", |o| tangential(&o.entry).map(|a| a.angle_deg), 1.0, 90.0),
    limit("entry.tangential_arc.straight_mm", |o| tangential(&o.entry).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("exit.roll_in.radius_mm", |o| rolled(&o.exit).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("exit.roll_in.angle_deg", |o| rolled(&o.exit).map(|a| a.angle_deg), 1.0, 90.0),
    limit("exit.roll_in.straight_mm", |o| rolled(&o.exit).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("exit.tangential_arc.radius_mm", |o| tangential(&o.exit).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("exit.tangential_arc.angle_deg", |o| tangential(&o.exit).map(|a| a.angle_deg), 1.0, 90.0),
    limit("exit.tangential_arc.straight_mm", |o| tangential(&o.exit).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("entry.roll_in.radius_mm", |o| rolled(&o.entry).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("entry.roll_in.angle_deg", |o| rolled(&o.entry).map(|a| a.angle_deg), 1.0, 90.0),
    limit("entry.roll_in.straight_mm", |o| rolled(&o.entry).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("entry.shortest.radius_mm", |o| shortest(&o.entry).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("entry.shortest.angle_deg", |o| shortest(&o.entry).map(|a| a.angle_deg), 1.0, 90.0),
    limit("entry.shortest.straight_mm", |o| shortest(&o.entry).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("exit.shortest.radius_mm", |o| shortest(&o.exit).map(|a| a.radius_mm), SMALLEST_STEP, LARGEST_ARC),
    limit("exit.shortest.angle_deg", |o| shortest(&o.exit).map(|a| a.angle_deg), 1.0, 90.0),
    limit("exit.shortest.straight_mm", |o| shortest(&o.exit).map(|a| a.straight_mm), 0.0, LARGEST_STRAIGHT),
    limit("pattern.copies", |o| o.pattern.as_ref().map(|p| f64::from(p.copies)), 1.0, 1000.0),
    limit("pattern.index_angle_deg", |o| o.pattern.as_ref().map(|p| p.index_angle_deg), -360.0, 360.0),
    limit("search.weight", |o| Some(o.search.weight), 1e-6, 1e6),
    limit("search.u_step", |o| Some(o.search.u_step), 0.001, 1.0),
    limit("search.u_tolerance", |o| Some(o.search.u_tolerance), 1e-6, 1.0),
    limit("search.certified_u_width", |o| o.search.certified_u_width, 1e-6, 0.1),
    limit("search.max_turn_deg_per_mm", |o| Some(o.search.max_turn_deg_per_mm), 1e-9, 1e6),
    limit("search.singular_cone_deg", |o| Some(o.search.singular_cone_deg), 0.0, 10.0),
    limit("feeds.spindle_rpm", |o| Some(o.feeds.spindle_rpm), 1.0, FASTEST_SPINDLE),
    limit("tolerances.mesh_chord_mm", |o| Some(o.tolerances.mesh_chord_mm), 0.0, LARGEST_HEIGHT),
    limit("tolerances.path_chord_mm", |o| Some(o.tolerances.path_chord_mm), SMALLEST_TOLERANCE, LARGEST_TOLERANCE),
    limit("tolerances.max_step_mm", |o| Some(o.tolerances.max_step_mm), SMALLEST_STEP, LARGEST_STEP),
    limit("tolerances.max_step_over_mm", |o| Some(o.tolerances.max_step_over_mm), SMALLEST_STEP, LARGEST_STEP),
    limit(
        "tolerances.linearisation_mm",
        |o| Some(o.tolerances.linearisation_mm),
        SMALLEST_TOLERANCE,
        LARGEST_TOLERANCE,
    ),
    limit("tolerances.gouge_mm", |o| Some(o.tolerances.gouge_mm), SMALLEST_TOLERANCE, LARGEST_TOLERANCE),
    limit("tolerances.max_lift_mm", |o| Some(o.tolerances.max_lift_mm), 0.0, LARGEST_TOLERANCE),
    limit("tolerances.cusp_mm", |o| Some(o.tolerances.cusp_mm), SMALLEST_TOLERANCE, LARGEST_HEIGHT),
    limit("allowance_mm", |o| Some(o.allowance_mm), 0.0, 1000.0),
    limit("layers.from_mm", |o| o.layers.map(|l| l.from_mm), 0.01, 1000.0),
    limit("layers.depth_mm", |o| o.layers.map(|l| l.depth_mm), 0.01, 1000.0),
    limit("levels.from_mm", |o| o.levels.and_then(|l| l.from_mm), -LARGEST_LEVEL, LARGEST_LEVEL),
    limit("levels.to_mm", |o| o.levels.map(|l| l.to_mm), -LARGEST_LEVEL, LARGEST_LEVEL),
    limit("levels.depth_mm", |o| o.levels.map(|l| l.depth_mm), 0.01, 1000.0),
    limit("finish.max_above_fraction", |o| Some(o.finish.max_above_fraction), 0.0, 1.0),
    limit("finish.max_never_cut_fraction", |o| Some(o.finish.max_never_cut_fraction), 0.0, 1.0),
];

/// Limits of the numbers of a setup.
pub const SETUP_LIMITS: [JobLimit<SetupFile>; 2] = [
    limit("rapid_clearance_mm", |s| Some(s.rapid_clearance_mm), SMALLEST_STEP, 1000.0),
    limit("rest_cell_mm", |s| s.rest_cell_mm, 0.05, 100.0),
];

/// Limits of the numbers of a whole job.
pub const JOB_LIMITS: [JobLimit<JobFile>; 2] = [
    limit(
        "stock_tolerance_mm",
        |j| Some(j.verification.stock_tolerance_mm),
        *STOCK_TOLERANCES.start(),
        *STOCK_TOLERANCES.end(),
    ),
    limit("stock_cell_mm", |j| j.verification.stock_cell_mm, SMALLEST_STEP, 1000.0),
];

fn path_file(o: &OperationFile) -> Option<&PathFromFile> {
    match &o.path {
        PathFile::File(f) => Some(f),
        PathFile::Cl(_) | PathFile::Strategy(_) => None,
    }
}

fn path_cl(o: &OperationFile) -> Option<&PathFromCl> {
    if let PathFile::Cl(f) = &o.path { Some(f) } else { None }
}

fn strategy(o: &OperationFile) -> Option<&PathFromStrategy> {
    match &o.path {
        PathFile::Strategy(s) => Some(s),
        PathFile::Cl(_) | PathFile::File(_) => None,
    }
}

fn tangential(approach: &ApproachFile) -> Option<&ArcFile> {
    match approach {
        ApproachFile::TangentialArc(arc) => Some(arc),
        ApproachFile::RollIn(_) | ApproachFile::Shortest(_) => None,
    }
}

fn rolled(approach: &ApproachFile) -> Option<&ArcFile> {
    match approach {
        ApproachFile::RollIn(arc) => Some(arc),
        ApproachFile::TangentialArc(_) | ApproachFile::Shortest(_) => None,
    }
}

fn shortest(approach: &ApproachFile) -> Option<&ArcFile> {
    match approach {
        ApproachFile::Shortest(arc) => Some(arc),
        ApproachFile::TangentialArc(_) | ApproachFile::RollIn(_) => None,
    }
}

/// Checks that a cutter is no wider than the machine's table: no table is wider than the sum of the
/// diagonals of its bodies. Accepts every cutter if the machine file gives the table no body.
///
/// # Errors
/// If it is wider.
pub fn check_cutter_width(machine: &Machine, tool: &ToolAssembly) -> Result<(), String> {
    let on_table = machine.bodies().iter().filter(|b| b.carrier() == Some(Carrier::Table));
    let width: f64 = on_table.map(|b| diagonal(&b.body.solid.aabb())).sum();
    let diameter = 2.0 * tool.cutter().radius();
    if width == 0.0 || diameter <= width {
        return Ok(());
    }
    Err(format!(
        "radius_mm: a cutter of {diameter} mm is wider than the machine's table, {width:.0} mm from corner to corner: is the unit right?"
    ))
}

/// Range of tolerances for cutting stock, mm. Smaller: motions split into more parts than memory
/// holds. Larger: a body less deep in the stock than twice the tolerance is no finding.
pub const STOCK_TOLERANCES: RangeInclusive<f64> = 0.0001..=0.5;

#[cfg(test)]
#[path = "../../tests/unit/validate/limits.rs"]
mod tests;
