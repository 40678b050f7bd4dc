//! Jobs: a setup of a part on a machine, and all that is planned, verified or rewritten for it.
//!
//! | module | holds |
//! |---|---|
//! | [`mod@format`] | files as they are written: jobs, reports, verifications, links, lengths, summaries |
//! | [`load`] | a job with all that it names: tool, machine, meshes, post; [`load::job::Setup`] with drive surface, obstacles and stock; setups without a job file ([`load::stand`]) |
//! | [`validate`] | limits of numbers ([`validate::limits`]), feeds and names of a job file |
//! | [`check`] | refuses what cannot be meant: size, place and winding of parts |
//! | [`setup`] | an operation as the stages need it: workcell ([`setup::cell`]), words, passes ([`setup::path`]), feeds, places of a pattern |
//! | [`stock`] | solid stock, its map of lines, rests of setups before |
//! | [`examples`] | new jobs, for a part, a machine and a control |
//! | [`files`] | input read, output written whole or not at all |
//! | [`failure`], [`stages`], [`duration_text`] | failures with their exit codes; stages of long computations; times as text |
//!
//! It must not know how anything is planned or verified.

pub mod check;
pub mod duration_text;
pub mod examples;
pub mod failure;
pub mod files;
pub mod format;
pub mod frames;
pub mod load;
pub mod setup;
pub mod stages;
pub mod stock;
pub mod validate;
