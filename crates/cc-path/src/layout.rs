//! Passes laid on a surface: level curves, their step by strip widths, their order.

pub(crate) mod generate_passes;
pub(crate) mod levels;
pub(crate) mod order;
pub(crate) mod resample;
pub(crate) mod strip_width;
pub(crate) mod trace;
