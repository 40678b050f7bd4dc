//! Exact verdicts and distances: the bodies of a tool assembly against a triangle mesh.
//!
//! A body is a [`Solid`](facemill_cl_data::Solid), a frustum, box or convex polyhedron dilated by a
//! ball, at a pose `mesh_from_solid`. An [`Interference`] answers whether it touches the mesh
//! ([`Verdict`], with a witness on the mesh), and how far the mesh is from the undilated body
//! ([`Separation`]). Nothing is sampled: a spike smaller than any sample spacing is found, whatever
//! the tool axis. Of a mesh with closed components a body wholly inside one is a hit too; an open
//! mesh is a surface only.
//!
//! - [`MeshTree`] is the one to use: a tree of flat pieces of the surface, each bounded by the
//!   distance of the body at its centre, and an exact test of the body against a triangle.
//! - [`ParryMesh`] is the plain reference: parry3d's tree and its GJK.
//! - [`Interference::sweep`] proves for a body in motion that it touches nothing at any time of an
//!   interval.
//! - [`Interference::turn`] proves it for every pose of a range of turns about a fixed point.
//! - [`solid_mesh`] makes a body itself a mesh for others to be tested against.
//! - [`lift_to_free`] seats a body: the least lift along a direction that frees it.
//! - [`penetration`]: how deep the surface is in a body, measured across the surface.
//!
//! ```
//! use facemill_interference::{Interference, MeshTree, Verdict};
//! use facemill_surface_model::TriMesh;
//! use facemill_tool_model::Cutter;
//! use nalgebra::{Isometry3, Point3, Vector3};
//!
//! let corner = |x, y| Point3::new(x, y, 0.0);
//! let square = vec![corner(-50.0, -50.0), corner(50.0, -50.0), corner(50.0, 50.0), corner(-50.0, 50.0)];
//! let tree = MeshTree::new(&TriMesh::new(square, vec![[0, 1, 2], [0, 2, 3]])?);
//! // All of a face mill: R 25, r 2, flutes of 50 mm, as it is.
//! let mill = Cutter::new(25.0, 2.0, 50.0)?.test_bodies(0.0);
//! let tip_at = |z| Isometry3::from(nalgebra::Translation3::new(0.0, 0.0, z));
//! assert_eq!(tree.verdict_of_all(&mill, 0.0, &tip_at(0.001), None), Verdict::Free);
//! assert!(matches!(tree.verdict_of_all(&mill, 0.0, &tip_at(-0.001), None), Verdict::Hit(_)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Verdicts are exact but for a band of 1e-9 mm in the rounding (for coordinates up to some
//! metres); within it, as where a number is not finite, the answer is a hit, so that free always
//! means proven. The crate must not know machines, search or stock.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `body` | undilated convex bodies placed in the mesh frame: distance with its gradient, and support points |
//! | `closed` | closed components of a mesh, and whether a point is inside one |
//! | `outside` | places that are certainly outside of all closed components |
//! | `query` | queries of interference and distance, and their answers |
//! | `mesh_tree` | tree of a mesh: exact verdicts and distances of convex bodies |
//! | `parry_mesh` | the same queries by the collision library parry3d, as a reference |
//! | `solid_mesh` | bodies as meshes, so that other bodies' distances from them can be measured |

mod body;
mod closed;
mod mesh_tree;
mod outside;
mod parry_mesh;
mod query;
mod solid_mesh;
#[cfg(test)]
#[path = "../tests/laws/kit.rs"]
mod test_kit;

pub use crate::query::depth::{Penetration, penetration};
pub use crate::query::lift::lift_to_free;
pub use crate::query::sweep_verdict::TurnRange;
pub use crate::query::sweep_verdict::{MotionInterval, SweepVerdict};
pub use crate::query::verdict::{Separation, Verdict, Witness};
pub use mesh_tree::MeshTree;
pub use parry_mesh::ParryMesh;
pub use query::Interference;
pub use solid_mesh::solid_mesh;
