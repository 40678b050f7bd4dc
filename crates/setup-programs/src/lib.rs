//! Programs of whole clampings, made of planned setups.
//!
//! A plan has a program for each tool of a clamping. [`joined_programs`] writes them as one program
//! that changes tools, [`calling_programs`] as main programs that call subprograms, and
//! [`control_tables`] writes the tool tables and work offsets that the control loads with them.
//! [`job_report`] reports on all of them in one file.
//!
//! Guarantee: a text made here is read back, and is left out, with the reason, unless it has the
//! blocks of the programs that were verified.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `control_tables` | tool tables and work offsets as a control loads them |
//! | `whole_apt` | APT file of a clamping with several tools |
//! | `tool_changes` | programs of all tools in one text |
//! | `subprograms` | programs as main programs that call subprograms |
//! | `job_report` | report on all programs of a job |
//!
//! It must not know how a setup is planned, nor the command line.

mod control_tables;
mod job_report;
mod subprograms;
mod tool_changes;
mod whole_apt;

pub use crate::control_tables::{ControlTables, control_tables};
pub use crate::job_report::job_report;
pub use crate::subprograms::{CallingProgram, calling_programs};
pub use crate::tool_changes::{JoinedProgram, JoinedSection, JoinedText, joined_programs};
