//! Triangle meshes: edges, pieces, welding, refinement, winding.

pub(crate) mod caps;
pub(crate) mod edges;
pub(crate) mod orientation;
pub(crate) mod refine;
pub(crate) mod topology;
pub(crate) mod tri_mesh;
pub(crate) mod triangle;
pub(crate) mod weld;
