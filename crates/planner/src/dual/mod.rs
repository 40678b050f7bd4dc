//! Setups on a machine with two heads: operations in pairs, cut by both heads at once.
//!
//! Each operation is first planned for its head alone. The pieces of two operations of a pair are then brought together
//! (`pair`, `pairing`), the shared axis and both heads' postures chosen along them (`runs`), entered and left by both heads at once
//! (`moves`), and written as one block for one time (`program`). What has no common value of the shared axis is left to each
//! head alone, with the other one at home.

mod channels;
mod mending;
mod moves;
mod output;
mod pair;
mod pairing;
mod plan;
mod program;
mod remains;
mod report;
mod runs;
mod stock;
mod telling;

pub(crate) use output::{merged_runs, proven_for_both};
pub(crate) use plan::{HEADS_APART, plan_dual_setup};
pub(crate) use program::dual_word_map;
pub use report::{PairReport, PairSplit};
