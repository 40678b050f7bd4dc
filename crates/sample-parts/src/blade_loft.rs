//! Blades as smooth surfaces through sections of points.

pub(crate) mod endwalls;
pub(crate) mod hub_sector;
pub(crate) mod loft_caps;
pub(crate) mod loft_columns;
pub(crate) mod loft_edges;
pub(crate) mod loft_mesh;
pub(crate) mod loft_surface;
pub(crate) mod section_curve;
