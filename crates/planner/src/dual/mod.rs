//! Setups on a machine with two heads: operations in pairs, cut by both heads at once.
//!
//! Each operation is first planned for its head alone. The pieces of two operations of a pair are
//! then brought together (`pair`, `pairing`), the shared axis and both heads' postures chosen along
//! them (`runs`), entered and left by both heads at once (`moves`), and written as one block for
//! one time (`program`). What has no common value of the shared axis is left to each head alone,
//! with the other one at home.

pub(crate) mod channels;
pub(crate) mod links;
pub(crate) mod moves;
pub(crate) mod output;
pub(crate) mod pair;
pub(crate) mod pair_report;
pub(crate) mod pairing;
pub(crate) mod parts;
pub(crate) mod passes_between;
pub(crate) mod plan;
pub(crate) mod program;
pub(crate) mod refinement;
pub(crate) mod run_trimming;
pub(crate) mod runs;
pub(crate) mod stock;
