//! APT CL files posted to NC programs: for any five-axis machine, in any dialect.
//!
//! [`post_cl`] takes a CL file that was read ([`facemill_cl_file::read_apt`]), a [`PostScene`]
//! (machine, mounting, tools, control) and [`PostOptions`], and returns a [`Posted`]: the text of
//! the program and its [`PostReport`].
//!
//! Branch and winding of the rotary axes are the best for the whole path of a tool
//! ([`facemill_inverse_kinematics::path::choose_along`]). Positions are inserted until the control
//! keeps the tolerance between two points. The written text is read back and compared with the
//! points of the file.
//!
//! Guarantees: every point of the file that is not of a cycle is reached, within the rounding of
//! words; between two points of a cut, tip and rim of the cutter stay within the tolerance of the
//! file's motion; no position is beyond a limit of an axis; each statement is written, or its word
//! is listed as not written. Not guaranteed: that anything is clear of the tool. No part is known
//! here.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | reasons why a file cannot be posted |
//! | `scene` | machine, tools and control of a program, options |
//! | `report` | report of a posted file |
//! | `statements` | words of statements: their treatment, cycles |
//! | `steps` | statements of a file as steps of each tool |
//! | `positions` | axis positions along the moves of a tool |
//! | `blocks` | positions as blocks with feeds |
//! | `feeds` | feeds that the axes reach within acceleration and jerk |
//! | `read_back` | the written text compared with the file |
//! | `post` | a CL file to its program |
//!
//! It must not know the planner.

mod blocks;
mod fault;
mod feeds;
mod positions;
mod post;
mod read_back;
mod report;
mod scene;
mod statements;
mod steps;

pub use crate::fault::PostFault;
pub use crate::post::{Posted, post_cl};
pub use crate::report::{POST_FORMAT, PostDeviation, PostNote, PostReport, PostedTool, PostedWord, Treatment};
pub use crate::scene::{MAX_RETRACT, PostOptions, PostScene, PostTool, TOLERANCES, machine_words, post_on};
