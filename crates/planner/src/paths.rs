//! Passes of a job without its program: laid by its own strategies, or planned by several ones to
//! compare them.

pub(crate) mod compared;
pub(crate) mod directions;
pub(crate) mod fastest;
pub(crate) mod laid;
pub(crate) mod strategies;
