//! Motion that a program asks of a machine: modal state, axis positions, steps and rates between
//! them.

pub(crate) mod assumptions;
pub mod axis_motion;
pub(crate) mod control;
pub(crate) mod counted_axes;
pub(crate) mod feeds;
pub(crate) mod motion_modes;
pub(crate) mod moves;
pub(crate) mod positions;
pub(crate) mod rates;
pub(crate) mod setup;
pub(crate) mod smoothing;
pub(crate) mod spans;
pub(crate) mod stepping;
pub(crate) mod turned_rotaries;
