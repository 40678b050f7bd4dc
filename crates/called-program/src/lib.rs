//! NC programs with the subprograms that they call, from their text and the files beside it.
//!
//! [`CalledProgram`] holds the files of a program whose calls were expanded, and names their lines
//! for lines of the text that runs.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `files_beside` | files in the folder of a program, by the names that calls may mean |
//! | `called_program` | a program with its calls expanded |
//!
//! It must not know how a program is run or changed.

mod called_program;
mod files_beside;

pub use called_program::{CallableFiles, CalledProgram};
