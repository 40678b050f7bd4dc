//! Links, entries and exits.

pub(crate) mod approach;
pub(crate) mod branch;
pub(crate) mod link;
pub(crate) mod rapid_blocks;
