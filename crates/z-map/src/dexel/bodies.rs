//! Bodies of revolution and their sweeps, against lines along z.

pub(crate) mod body;
pub(crate) mod lanes;
pub(crate) mod placed;
pub(crate) mod side;
pub(crate) mod straight;
pub(crate) mod sweep;
pub(crate) mod turning;
