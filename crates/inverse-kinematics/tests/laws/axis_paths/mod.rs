//! Paths of the axes through poses: branches, windings, poles.

pub(crate) mod linearise;
pub(crate) mod linearise_poles;
pub(crate) mod path;
pub(crate) mod windings;
