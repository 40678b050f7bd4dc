//! Limits of the numbers in a machine file: a value beyond them is a slip of unit or key, and plans
//! with it would be meaningless.

use facemill_file_format::KeyLimit;

use crate::machine_file::error::FieldProblem;

/// Limits of the keys that have one of their own; lengths have ±1e6 mm.
///
/// Velocities: a thousandth of the slowest axis, and ten times the speed of linear motors and lathe
/// spindles. Accelerations: from a start that takes minutes to a hundred times g. Jerks: from an
/// acceleration that builds up over minutes to one that no drive follows. Control tolerances:
/// beyond 10 mm and 5 degrees nothing is cut to shape.
pub const MACHINE_LIMITS: [KeyLimit; 19] = [
    KeyLimit::new("max_velocity_mm_min", 1.0, 1e6),
    KeyLimit::new("max_acceleration_mm_s2", 0.1, 1e6),
    KeyLimit::new("max_jerk_mm_s3", 0.1, 1e9),
    KeyLimit::new("max_velocity_deg_min", 1.0, 1e7),
    KeyLimit::new("max_acceleration_deg_s2", 0.01, 1e6),
    KeyLimit::new("max_jerk_deg_s3", 0.01, 1e9),
    KeyLimit::new("min_deg", -360_000.0, 360_000.0),
    KeyLimit::new("max_deg", -360_000.0, 360_000.0),
    KeyLimit::new("home_deg", -360_000.0, 360_000.0),
    KeyLimit::new("alpha_deg", -360.0, 360.0),
    KeyLimit::new("theta_deg", -360.0, 360.0),
    KeyLimit::new("rotation_xyz_deg", -360.0, 360.0),
    KeyLimit::new("path_mm", 0.0, 10.0),
    KeyLimit::new("orientation_deg", 0.0, 5.0),
    KeyLimit::new("min_mm_min", 1e-3, 1e6),
    KeyLimit::new("max_mm_min", 1e-3, 1e6),
    KeyLimit::new("rapid_mm_min", 1.0, 1e6),
    KeyLimit::new("tool_change_s", 0.0, 3600.0),
    KeyLimit::new("max_wind_up_turns", 1.0, 1000.0),
];

/// Returns the fault of a value by the limits of its key; `None` if it has none, or the key has no
/// limits.
///
/// `field` is a path such as `tool_chains[0].rows[1].joint.prismatic.max_velocity_mm_min`.
pub(crate) fn beyond_limits(field: &str, value: f64) -> Option<FieldProblem> {
    let limit = KeyLimit::of(&MACHINE_LIMITS, field)?;
    let (least, most) = (limit.least, limit.most);
    (!limit.contains(value)).then_some(FieldProblem::OutOfRange { value, least, most })
}
