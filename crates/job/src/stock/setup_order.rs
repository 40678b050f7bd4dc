//! Check that operations on what others leave have some before them.

use crate::failure::Failure;
use crate::load::job::Job;
use crate::validate::setup_chain::{is_after_others, programs_before};
use crate::validate::setup_names::belongs;

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
    if !before.is_empty() || !setup.programs_before.is_empty() {
        return Ok(());
    }
    Err(job.wrong(format!(
        "operations[{k}] (\"{}\"): region.left_above.of: operations_before: no program is before that of setup \"{}\": {why}; \
         operations of one tool in one setup are one program",
        operation.name, setup.name
    )))
}
