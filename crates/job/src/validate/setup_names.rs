//! Names of setups: in files, and in the operations that are machined in them.

use crate::format::job_file::{JobFile, OperationFile, SetupFile};

/// Returns a setup's name as part of a file name.
pub fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

/// Returns whether an operation is machined in a setup.
pub fn belongs(operation: &OperationFile, setup: &SetupFile, job: &JobFile) -> bool {
    operation.setup.as_ref().map_or(job.setups.len() == 1, |name| *name == setup.name)
}
