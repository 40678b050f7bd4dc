//! Distances along the surface from curves on it.

pub(crate) mod curve_distance;
pub(crate) mod patch_vertices;
pub(crate) mod source_curve;
