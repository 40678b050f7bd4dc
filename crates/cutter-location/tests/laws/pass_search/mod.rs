//! Postures along passes, and the passes beside them.

pub(crate) mod band;
pub(crate) mod neighbours;
pub(crate) mod pass_costs;
pub(crate) mod pass_ends;
pub(crate) mod passes;
pub(crate) mod postures;
pub(crate) mod windings;
