//! Tasks of a batch, each in a process of its own.

pub mod cause;
pub mod scheduler;
pub(crate) mod worker;
