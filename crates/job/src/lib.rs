//! Jobs: a setup of a part on a machine, and the operations that are planned, verified or rewritten
//! for it.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@duration_text`] | durations as hours, minutes and seconds |
//! | [`mod@failure`] | failures of commands, with their exit codes |
//! | [`mod@files`] | input read, output written whole or not at all |
//! | [`mod@format`] | files as they are written: jobs, reports, verifications, links, lengths, summaries |
//! | [`mod@frames`] | poses and directions of files, places of a pattern |
//! | [`mod@stages`] | stages of a long computation, and their monitors |
//! | [`mod@planning_stock`] | the stock on which a setup is planned: its own, or what programs before may leave |
//! | [`mod@validate`] | limits of numbers ([`validate::limits`]), feeds and names of a job file |
//! | [`mod@load`] | a job with all files that it names: tool, machine, meshes, post; [`load::job::Setup`] with drive surface, obstacles and stock; setups without a job file ([`load::ad_hoc_setup`]) |
//! | [`mod@stock`] | solid stock, its map of lines, rests of setups before |
//! | [`mod@setup`] | an operation as the stages need it: workcell ([`setup::cell`]), machine with tool, words and frames ([`setup::scene`]), words, passes ([`setup::path`]), feeds, places where stock is left ([`setup::left_stock`]) |
//! | [`mod@examples`] | new jobs |
//!
//! It must not know how anything is planned or verified.

pub mod duration_text;
pub mod examples;
pub mod failure;
pub mod files;
pub mod format;
pub mod frames;
pub mod load;
pub mod planning_stock;
pub mod setup;
pub mod stages;
pub mod stock;
pub mod validate;
