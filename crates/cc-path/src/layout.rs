//! Passes laid on a surface: level curves, their step by strip widths, their order.

pub(crate) mod along;
pub(crate) mod columns;
pub(crate) mod front;
pub(crate) mod front_layout;
pub(crate) mod fronts;
pub(crate) mod generate_passes;
pub(crate) mod levels;
pub(crate) mod order;
pub(crate) mod resample;
pub(crate) mod strip_width;
pub(crate) mod trace;
