//! Limits of a machine file's numbers: beyond them a value is a slip of unit or key, and plans with it would mean nothing.

use crate::FieldProblem;

/// Range of a key's value, in the key's own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineLimit {
    /// Key of the file, as written; in whichever part of the file it is.
    pub key: &'static str,
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
}

const fn limit(key: &'static str, least: f64, most: f64) -> MachineLimit {
    MachineLimit { key, least, most }
}

/// Limits of the keys that have one of their own; lengths have ±1e6 mm.
///
/// Velocities: a thousandth of the slowest axis, and ten times what linear motors and lathe spindles reach. Accelerations: from what
/// takes minutes to start to a hundred times g. Jerks: from what takes minutes to accelerate to what no drive follows. Control
/// tolerances: beyond 2 mm and 5 degrees nothing is finished.
pub const MACHINE_LIMITS: [MachineLimit; 18] = [
    limit("max_velocity_mm_min", 1.0, 1e6),
    limit("max_acceleration_mm_s2", 0.1, 1e6),
    limit("max_jerk_mm_s3", 0.1, 1e9),
    limit("max_velocity_deg_min", 1.0, 1e7),
    limit("max_acceleration_deg_s2", 0.01, 1e6),
    limit("max_jerk_deg_s3", 0.01, 1e9),
    limit("min_deg", -360_000.0, 360_000.0),
    limit("max_deg", -360_000.0, 360_000.0),
    limit("home_deg", -360_000.0, 360_000.0),
    limit("alpha_deg", -360.0, 360.0),
    limit("theta_deg", -360.0, 360.0),
    limit("rotation_xyz_deg", -360.0, 360.0),
    limit("path_mm", 0.0, 10.0),
    limit("orientation_deg", 0.0, 5.0),
    limit("min_mm_min", 1e-3, 1e6),
    limit("max_mm_min", 1e-3, 1e6),
    limit("rapid_mm_min", 1.0, 1e6),
    limit("max_wind_up_turns", 1.0, 1000.0),
];

/// What is wrong with a value by the limits of its key; `None` where nothing is, or the key has none.
///
/// `field` is a path such as `tool_chains[0].rows[1].joint.prismatic.max_velocity_mm_min`; an index at its end does not count.
pub(crate) fn beyond_limits(field: &str, value: f64) -> Option<FieldProblem> {
    let key = field.rsplit('.').next().unwrap_or(field);
    let key = key.split('[').next().unwrap_or(key);
    let limit = MACHINE_LIMITS.iter().find(|l| l.key == key)?;
    let (least, most) = (limit.least, limit.most);
    (!(least..=most).contains(&value)).then_some(FieldProblem::OutOfRange { value, least, most })
}
