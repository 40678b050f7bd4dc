//! Example jobs, for a part, a machine and a control.

pub mod new_job;
pub mod new_machine;
