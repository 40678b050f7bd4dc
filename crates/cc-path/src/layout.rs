//! Passes laid on a surface: level curves, their step by strip widths, their order.

pub(crate) mod edge_fill;
pub(crate) mod field;
pub(crate) mod generate_passes;
pub(crate) mod level_set;
pub(crate) mod levels;
pub(crate) mod offset;
pub(crate) mod order;
pub(crate) mod pass_level;
pub(crate) mod resample;
pub(crate) mod scallop;
pub(crate) mod section_layout;
pub(crate) mod section_walk;
pub(crate) mod strip_width;
pub(crate) mod trace;
