//! Test kit of the workspace: slow, independent code that defines what is correct, and helpers to
//! write and run jobs.
//!
//! [`oracles`] are independent of the crates under test, from the papers alone. [`tables`] makes
//! the tables and figures of the pages.
//!
//! Helpers: [`batches`] runs and kills batches, [`calls`] puts cuts into subprograms, [`jobs`]
//! writes small jobs and plans them, [`variants`] plans variants of one by the command, [`program`]
//! runs the `facemill` command, [`commands`] runs it on the files of a job, [`shared`] finds the
//! shared data, [`golden`] has jobs whose bytes are fixed, [`hood`] is a part that turns the rotary
//! axes.

pub mod batches;
pub mod calls;
pub mod commands;
pub mod golden;
pub mod hood;
pub mod jobs;
pub mod oracles;
pub mod program;
pub mod shared;
pub mod tables;
pub mod variants;
