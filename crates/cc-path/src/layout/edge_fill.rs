//! Fronts: passes that lean from the levels as strip widths require, with partial passes at edges.

pub(crate) mod along;
pub(crate) mod columns;
pub(crate) mod front;
pub(crate) mod front_layout;
pub(crate) mod fronts;
