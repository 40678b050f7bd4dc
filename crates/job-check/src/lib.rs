//! Checks of a job before it is planned, and new jobs that are checked for a machine.
//!
//! [`describe_setup`] reads a setup, lays its passes and says in lines what each operation does
//! with which tool on which stock; it refuses parts of an implausible size, mountings that the
//! machine does not reach and templates that the control cannot read. [`machine_check`] describes
//! machines. [`new_job_for`] mounts a sample job where another machine reaches it.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@machine_check`] | machines in words, and what their heads share |
//! | [`mod@reach`] | whether the machine reaches the passes |
//! | `post_block_words` | words that a template adds to blocks |
//! | [`mod@post_probe`] | templates tried on a short program |
//! | `describe` | a setup in lines, with all checks |
//! | `new_machine` | sample jobs for another machine or control |
//!
//! It must not know how anything is planned or verified.

mod describe;
pub mod machine_check;
#[cfg(test)]
#[path = "../tests/unit/new_blade.rs"]
mod new_blade;
mod new_machine;
#[cfg(test)]
#[path = "../tests/unit/placement_laws.rs"]
mod placement_laws;
mod post_block_words;
pub mod post_probe;
pub mod reach;

pub use crate::describe::{describe_job, describe_setup};
pub use crate::new_machine::new_job_for;
