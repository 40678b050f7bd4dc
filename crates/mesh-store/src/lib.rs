//! Meshes with surface and tree, prepared once for all that need them.
//!
//! A job has a setup for each tool and layer, most of them with one part and one stock. Reading a
//! file, making the smooth surface of its mesh and the tree for tests of interference takes seconds
//! for half a million triangles; [`SharedMeshes`] does it once, and lets go of what nothing needs.
//!
//! ```
//! use facemill_mesh_store::SharedMeshes;
//! use facemill_surface_model::TriMesh;
//! use nalgebra::Point3;
//!
//! let meshes = SharedMeshes::default();
//! let _sharing = meshes.share();
//! let corners = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]].map(Point3::from);
//! let mesh = || TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap_or_default();
//! let first = meshes.surface(&"part.stl", mesh);
//! let again = meshes.surface(&"part.stl", || unreachable!("it is known"));
//! assert!(std::sync::Arc::ptr_eq(&first, &again));
//! ```
//!
//! Modules:
//!
//! | module | holds |
//! |---|---|
//! | `shared_meshes` | files, surfaces and trees by what they are made of |
//!
//! It must not know jobs, machines and the formats of files.

mod shared_meshes;

pub use shared_meshes::{MeshSharing, SharedMeshes, TreeMesh};
