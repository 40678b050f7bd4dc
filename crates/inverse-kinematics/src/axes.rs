//! Axes of a machine and their values.

pub(crate) mod axis;
pub(crate) mod axis_values;
