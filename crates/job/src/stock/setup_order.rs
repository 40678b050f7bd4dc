//! Check that a setup continues with the stock of the one before it.

use facemill_cc_path::files::LeftOfFile;

use crate::failure::Failure;
use crate::format::job_file::{JobFile, OperationFile, SetupFile};
use crate::frames::pose;
use crate::load::job::Job;
use crate::validate::setup_names::belongs;

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

/// Returns the setups before one that cut the same stock in one workpiece frame, in their order,
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

/// Checks that operations of a setup that are laid where the programs before it leave material have
/// such programs.
///
/// # Errors
/// If none is before it; with the reason.
pub fn check_before(job: &Job, index: usize) -> Result<(), Failure> {
    let setup = &job.file.setups[index];
    let mut waiting = job.file.operations.iter().enumerate().filter(|(_, o)| belongs(o, setup, &job.file));
    let Some((k, operation)) = waiting.find(|(_, o)| is_after_others(o)) else { return Ok(()) };
    let (before, why) = programs_before(&job.file.setups, index);
    if !before.is_empty() {
        return Ok(());
    }
    Err(job.wrong(format!(
        "operations[{k}] (\"{}\"): region.left_above.of: operations_before: no program is before that of setup \"{}\": {why}; \
         operations of one tool in one setup are one program",
        operation.name, setup.name
    )))
}

/// Returns whether an operation of a setup is laid where the programs before it leave material.
pub fn needs_programs_before(job: &JobFile, setup: &SetupFile) -> bool {
    job.operations.iter().filter(|o| belongs(o, setup, job)).any(is_after_others)
}

/// Returns whether an operation is laid where the programs before it leave material.
pub fn is_after_others(operation: &OperationFile) -> bool {
    operation.region().left_above.as_ref().is_some_and(|left| left.of == LeftOfFile::OperationsBefore)
}

/// Tolerance for one frame that is written in two ways: mm, and rad.
pub const SAME_FRAME: [f64; 2] = [1e-6, 1e-9];
