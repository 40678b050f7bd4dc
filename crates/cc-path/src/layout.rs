//! Passes laid on a surface: level curves, their step by strip widths, their order.

pub(crate) mod lay;
pub(crate) mod levels;
pub(crate) mod order;
pub(crate) mod resample;
pub(crate) mod trace;
pub(crate) mod widths;
