//! Setups that cut one stock, one after the other.

use facemill_cc_path::files::LeftOfFile;
use nalgebra::Isometry3;

use crate::format::job_file::{OperationFile, SetupFile, StockFile};
use crate::frames::pose;

/// Checks that a setup begins with the stock that another one leaves: with one stock stated for
/// both, in one workpiece frame or, for a mesh in the part's frame, in any two.
///
/// # Errors
/// With the reason why it does not.
pub fn follows(before: &SetupFile, setup: &SetupFile) -> Result<(), String> {
    let stated = |s: &SetupFile| serde_json::to_value(&s.stock).ok();
    if stated(before) != stated(setup) {
        return Err(format!("it is not stated as for setup \"{}\"", before.name));
    }
    if before.programs_before != setup.programs_before {
        return Err(format!("its programs_before are not those of setup \"{}\"", before.name));
    }
    if work_from_work(before, setup).is_some() && !matches!(setup.stock, StockFile::Mesh(_)) {
        return Err(format!(
            "its workpiece frame is not that of setup \"{}\"; only stock that is a mesh is handed on to another frame",
            before.name
        ));
    }
    Ok(())
}

/// Returns the pose of a setup's workpiece frame in that of another setup of the same part; `None`
/// if both are one frame.
pub fn work_from_work(of: &SetupFile, in_setup: &SetupFile) -> Option<Isometry3<f64>> {
    let motion = pose(&in_setup.work_from_part) * pose(&of.work_from_part).inverse();
    let is_one = motion.translation.vector.norm() <= SAME_FRAME[0] && motion.rotation.angle() <= SAME_FRAME[1];
    (!is_one).then_some(motion)
}

/// Returns the setups before one that cut the same stock ([`follows`]), in their order,
/// and the reason why there are no more.
pub fn programs_before(setups: &[SetupFile], index: usize) -> (Vec<usize>, String) {
    let mut before = Vec::new();
    for k in (0..index).rev() {
        if let Err(why) = follows(&setups[k], &setups[k + 1]) {
            before.reverse();
            return (before, why);
        }
        before.push(k);
    }
    before.reverse();
    (before, "its program is the first one".to_owned())
}

/// Returns whether an operation is laid where the programs before it leave material.
pub fn is_after_others(operation: &OperationFile) -> bool {
    operation.region().left_above.as_ref().is_some_and(|left| left.of == LeftOfFile::OperationsBefore)
}

/// Tolerance for one frame that is written in two ways: mm, and rad.
pub const SAME_FRAME: [f64; 2] = [1e-6, 1e-9];
