//! Example jobs.

pub mod new_job;
