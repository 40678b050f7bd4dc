//! Moves that do not cut: entries, exits, links and rewinding.

pub mod approach;
pub mod link;
pub(crate) mod rapid_block;
pub(crate) mod rewind;
