//! Sample jobs with files read from disk.

pub use facemill_sample_jobs::{NewJob, ROTOR_SCALES, Series, SetBlade, lofted_blades, propeller_glb};

use crate::files;

/// Returns the files of a sample job, names relative to its folder. The same job always gives the
/// same bytes.
///
/// # Errors
/// If numbers or files describe no part, or a file cannot be read.
pub fn new_job(job: &NewJob) -> Result<Vec<(String, Vec<u8>)>, String> {
    facemill_sample_jobs::new_job(job, &|file| files::read_text(file).map_err(|e| e.to_string()))
}

/// Returns how the table of a propeller or a blade description is understood, in words; `None` for
/// other jobs.
///
/// # Errors
/// As [`new_job`].
pub fn as_read(job: &NewJob) -> Result<Option<String>, String> {
    facemill_sample_jobs::as_read(job, &|file| files::read_text(file).map_err(|e| e.to_string()))
}

#[cfg(test)]
#[path = "../../tests/unit/examples/new_cast.rs"]
mod cast_tests;
