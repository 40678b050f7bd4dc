//! Triangle meshes of parts: read, mended, measured, cut and written.
//!
//! - [`import_mesh`] turns the bytes of an OBJ, glTF, GLB, STL or 3MF file into a [`TriMesh`] in mm
//!   with +Z up and says in a [`RepairReport`] what it mended and what it left: dirty meshes are
//!   reported, not refused.
//! - [`Surface`] takes a mesh as the smooth surface it represents: normals with creases,
//!   curvature, closest point, rays, inside and outside, on a box [`Tree`] that others may walk
//!   too.
//! - [`plane_section`], [`implicit_section`] and [`level_curves`] cut it into
//!   curves.
//! - [`write_obj`], [`write_stl_binary`] and [`write_glb`] write scenes of meshes, the same bytes
//!   for the same scene; [`write_painted_glb`] one mesh with colours, which [`TriMesh::refined`]
//!   makes fine enough for them.
//!
//! ```
//! use facemill_surface_model::*;
//! use nalgebra::{Point3, Vector3};
//!
//! // A pyramid on the xy plane, base open.
//! let obj = b"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 2 2 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
//! let settings = ImportSettings::default_for(MeshFormat::Obj);
//! let Imported { mesh, report } =
//!     import_mesh("pyramid.obj", obj, MeshFormat::Obj, &settings, &no_external_files)?;
//! assert_eq!((report.n_open_edges, report.n_components), (4, 1));
//!
//! let surface = Surface::new(mesh, SurfaceSettings { crease_angle: 20f64.to_radians() });
//! let point = surface.closest_point(&Point3::new(2.0, -1.0, 2.0), 10.0).unwrap();
//! assert!((surface.normal_at(&point).into_inner() - Vector3::new(0.0, -1.0, 1.0).normalize()).norm() < 1e-12);
//! assert!((point.position - Point3::new(2.0, 0.5, 0.5)).norm() < 1e-12);
//!
//! let sections = plane_section(&surface, &Point3::new(0.0, 0.0, 1.0), &Vector3::z_axis(), |_| true);
//! assert!(sections.len() == 1 && sections[0].closed);
//! # Ok::<(), ImportError>(())
//! ```
//!
//! Guaranteed: no input makes it panic; results do not depend on hash order or threads; a
//! [`TriMesh`] has indices in range and finite coordinates; no query returns triangles without
//! area. Not guaranteed: that a mesh is closed, manifold or wound outward ([`Topology`] and
//! [`Orientation`] report what can be known of it), and the accuracy of [`CurvatureTensor`], which
//! is an estimate.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `mesh` | triangle meshes: edges, pieces, welding, refinement, winding |
//! | `export` | meshes and scenes written to files |
//! | `import` | meshes read from files and repaired |
//! | `surface` | smooth surface over a mesh: normals, curvature, closest points, rays, sections |
//!
//! It must not know tools and machines, and opens no files.

mod export;
mod import;
mod mesh;
mod surface;
#[cfg(test)]
#[path = "../tests/unit/test_kit.rs"]
mod test_kit;

pub use crate::import::repair::RepairReport;
pub use crate::import::settings::{ImportFault, ImportSettings, LengthUnit, MeshFormat, UpAxis};
pub use crate::mesh::edges::Edges;
pub use crate::mesh::orientation::{Orientation, Winding, WoundPiece};
pub use crate::mesh::refine::Refined;
pub use crate::mesh::topology::{Component, Topology};
pub use crate::mesh::tri_mesh::{Group, MeshError, TriMesh};
pub use crate::surface::curvature::{CurvatureTensor, PrincipalCurvatures};
pub use crate::surface::level_curves::{LevelCurve, LevelPoint, level_curves, level_curves_among};
pub use crate::surface::place_islands::place_islands;
pub use crate::surface::ray::RayHit;
pub use crate::surface::sections::{Polyline, implicit_section, plane_section};
pub use crate::surface::tree::{Below, NodeId, Tree};
pub use export::{ExportError, NamedNode, write_glb, write_obj, write_painted_glb, write_stl_binary};
pub use import::{ImportError, Imported, external_files, import_mesh, no_external_files};
pub use surface::{Surface, SurfacePoint, SurfaceSettings};
