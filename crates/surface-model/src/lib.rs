//! Triangle meshes of parts.
mod tri_mesh;

pub use tri_mesh::{Group, MeshError, TriMesh};
