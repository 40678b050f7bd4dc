//! Commands that write programs from others: CL files, and programs of controls.

pub(crate) mod feedrate_command;
pub(crate) mod lengths_command;
pub(crate) mod post_command;
pub(crate) mod post_job;
pub(crate) mod rapids_command;
