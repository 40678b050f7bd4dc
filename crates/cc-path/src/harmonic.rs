//! Harmonic functions on meshes: fields between curves, and the angle around a tube.

pub(crate) mod intrinsic;
pub(crate) mod laplace;
pub(crate) mod multigrid;
pub(crate) mod sparse;
