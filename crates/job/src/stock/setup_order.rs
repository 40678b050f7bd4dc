//! Check that a setup continues with the stock of the one before it.

use crate::format::job_file::SetupFile;
use crate::frames::pose;

/// Checks that a setup begins with the stock that another one leaves: both in one workpiece frame,
/// with one stock stated for both.
///
/// # Errors
/// With the reason why it does not.
pub fn follows(before: &SetupFile, setup: &SetupFile) -> Result<(), String> {
    let apart = pose(&before.work_from_part).inverse() * pose(&setup.work_from_part);
    if apart.translation.vector.norm() > SAME_FRAME[0] || apart.rotation.angle() > SAME_FRAME[1] {
        return Err(format!("its workpiece frame is not that of setup \"{}\"", before.name));
    }
    let stated = |s: &SetupFile| serde_json::to_value(&s.stock).ok();
    if stated(before) != stated(setup) {
        return Err(format!("it is not stated as for setup \"{}\"", before.name));
    }
    Ok(())
}

/// Tolerance for one frame that is written in two ways: mm, and rad.
pub const SAME_FRAME: [f64; 2] = [1e-6, 1e-9];
