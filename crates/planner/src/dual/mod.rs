//! Setups on a machine with two heads: operations in pairs, cut by both heads at once.
//!
//! Each operation is first planned for its head alone. `pair` and `pairing` then bring the pieces
//! of two operations together, `runs` chooses the shared axis and the postures of both heads along
//! them, `moves` enters and leaves with both heads at once, and `program` writes one block for each
//! time. Points without a common value of the shared axis are left to each head alone, with the
//! other one at home.

pub(crate) mod channels;
pub(crate) mod links;
pub(crate) mod moves;
pub(crate) mod output;
pub(crate) mod pair;
pub(crate) mod pair_report;
pub(crate) mod pairing;
pub(crate) mod parts;
pub(crate) mod passes_between;
pub(crate) mod program;
pub(crate) mod refinement;
pub(crate) mod run_trimming;
pub(crate) mod runs;
pub(crate) mod turns;
pub(crate) mod two_heads;
