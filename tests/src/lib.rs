//! Test kit of the workspace: slow, independent code that defines what is correct, and helpers to
//! write and run jobs.
//!
//! Independent of the crates under test, from the papers alone:
//! - [`brute`]: how deep a cutter is in a mesh and how far a turned body is from it, over all
//!   triangles;
//! - [`touch`]: whether a body touches a mesh, by subdividing triangles; [`sweep`] compares it with
//!   the mesh tree;
//! - [`onset`]: the tilt from which on a cutter is free of a torus or saddle, from the surface's
//!   equation;
//! - [`interpreter`]: what a FANUC program does to its axes;
//! - [`paper_machine`]: FEED (9), from axis values of the head-B, table-C mill to the tool;
//! - [`read_back`]: a written program against the meshes of its job, by these three;
//! - [`craig`]: where the rows of a machine file put its links;
//! - [`two_heads`]: a program of two heads in one channel, both tools' places, and how far these
//!   are apart;
//! - [`slack`]: how much more certificates say than there is, at its places, with the mesh tree's
//!   distance;
//! - [`chip_trial`]: what chips say that passes take, and what their program takes out of the
//!   stock.
//!
//! Helpers: [`batches`] runs and kills batches, [`jobs`] writes small jobs and plans them,
//! [`variants`] plans variants of one by the command, [`program`] runs the `facemill` command,
//! [`commands`] runs it on the files of a job, [`shared`] finds the shared data, [`meshes`] plans
//! every shared mesh, [`strategy_table`] plans parts by all strategies, [`golden`] has jobs whose
//! bytes are fixed, [`hood`] is a part that turns the rotary axes, [`key_tables`] generates the
//! tables of `docs/formats.md`, [`sample_figures`] the figures of the sample in the pages.

pub mod batches;
pub mod brute;
pub mod chip_trial;
pub mod commands;
pub mod craig;
pub mod golden;
pub mod hood;
pub mod interpreter;
pub mod jobs;
pub mod key_tables;
pub mod meshes;
pub mod onset;
pub mod paper_machine;
pub mod program;
pub mod read_back;
pub mod sample_figures;
pub mod shared;
pub mod slack;
pub mod strategy_table;
pub mod sweep;
pub mod touch;
pub mod two_heads;
pub mod variants;
