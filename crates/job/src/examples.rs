//! Example jobs, for a part, a machine and a control.

pub(crate) mod new_blade;
pub(crate) mod new_dual;
pub mod new_job;
pub mod new_machine;
