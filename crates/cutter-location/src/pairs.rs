//! Postures of two heads that share an axis.

pub(crate) mod costs;
pub(crate) mod plan;
pub(crate) mod shared_axis;
pub(crate) mod test;
pub(crate) mod values;
