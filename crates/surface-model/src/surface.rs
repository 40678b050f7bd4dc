//! Smooth surface over a mesh: normals, curvature, closest points, rays, sections.

pub(crate) mod curvature;
pub(crate) mod extension;
pub(crate) mod level_curves;
pub(crate) mod normals;
pub(crate) mod place_islands;
pub(crate) mod ray;
pub(crate) mod sections;
pub(crate) mod tree;

use std::sync::OnceLock;

use facemill_cl_data::Aabb;
use nalgebra::{Point3, Unit, Vector3};

use crate::mesh::edges::Edges;
use crate::mesh::orientation::Orientation;
use crate::mesh::topology::{Component, Topology};
use crate::mesh::tri_mesh::TriMesh;
use crate::mesh::triangle::closest_on_triangle;
use crate::surface::curvature::{CurvatureTensor, VertexCurvature, vertex_curvatures};
use crate::surface::normals::{SmoothVertices, facet_normals};
use crate::surface::tree::Tree;

/// Settings for taking a mesh as a smooth surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSettings {
    /// Facets whose normals differ by more than this across an edge meet in a crease there, rad.
    /// Larger: edges of the part are rounded in its normals. Smaller: coarse meshes fall apart into
    /// facets.
    pub crease_angle: f64,
}

impl Default for SurfaceSettings {
    /// Returns 30°: coarser than any mesh used for milling, finer than the edges of prismatic
    /// parts.
    fn default() -> Self {
        Self { crease_angle: 30f64.to_radians() }
    }
}

/// A mesh with smooth normals, curvature and a box tree, for all queries about a part.
///
/// Triangles without area (height below 1e-12 of the longest side) carry no point of the surface:
/// no query returns them. Triangle indices are those of the mesh; methods that take one panic when
/// it is out of range, as a slice does.
///
/// Edges, components, boxes, normals and curvatures are each computed when they are first needed,
/// some µs per triangle together: of stock that is cut before, hardly anything is.
#[derive(Clone, Debug)]
pub struct Surface {
    pub(crate) mesh: TriMesh,
    settings: SurfaceSettings,
    edges: OnceLock<Edges>,
    topology: OnceLock<Topology>,
    tree: OnceLock<Tree>,
    facets: OnceLock<Vec<Option<Unit<Vector3<f64>>>>>,
    smooth: OnceLock<SmoothVertices>,
    curvatures: OnceLock<Vec<Option<VertexCurvature>>>,
    orientation: OnceLock<Orientation>,
}

/// A point of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, mm.
    pub position: Point3<f64>,
    /// The triangle it lies in.
    pub triangle: u32,
    /// Weights of the triangle's corners, not negative, sum 1.
    pub barycentric: [f64; 3],
    /// Distance from the queried point, mm; 0 without one.
    pub distance: f64,
}

impl Surface {
    /// Takes a mesh as a surface.
    #[must_use]
    pub fn new(mesh: TriMesh, settings: SurfaceSettings) -> Self {
        let (edges, topology, tree, facets) = Default::default();
        let (smooth, curvatures, orientation) = Default::default();
        Self { mesh, settings, edges, topology, tree, facets, smooth, curvatures, orientation }
    }

    fn facets(&self) -> &[Option<Unit<Vector3<f64>>>] {
        self.facets.get_or_init(|| facet_normals(&self.mesh))
    }

    fn smooth(&self) -> &SmoothVertices {
        let crease_angle = self.settings.crease_angle;
        self.smooth.get_or_init(|| SmoothVertices::of(&self.mesh, self.edges(), self.facets(), crease_angle))
    }

    fn curvatures(&self) -> &[Option<VertexCurvature>] {
        self.curvatures.get_or_init(|| vertex_curvatures(&self.mesh, self.facets(), self.smooth()))
    }

    /// Returns the pieces of the mesh and how they are wound, as [`Orientation::of`] finds them.
    pub fn orientation(&self) -> &Orientation {
        self.orientation.get_or_init(|| Orientation::of(&self.mesh))
    }

    /// Returns the triangles, as given.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Returns the settings it was made with.
    pub fn settings(&self) -> SurfaceSettings {
        self.settings
    }

    /// Returns the edges, with the sides that meet in each.
    pub fn edges(&self) -> &Edges {
        self.edges.get_or_init(|| Edges::of(&self.mesh))
    }

    /// Returns components and the state of the edges.
    pub fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| Topology::of(&self.mesh, self.edges()))
    }

    /// Returns the component of a triangle.
    pub fn component(&self, triangle: u32) -> &Component {
        let topology = self.topology();
        &topology.components[topology.component_of[triangle as usize] as usize]
    }

    /// Returns the hierarchy over the triangles' boxes; its items are triangle indices.
    pub fn tree(&self) -> &Tree {
        self.tree.get_or_init(|| {
            let of_facet = |(t, normal): (usize, &Option<_>)| match normal {
                Some(_) => Aabb::of_points(&self.mesh.corners(t)),
                None => Aabb::EMPTY,
            };
            let boxes: Vec<Aabb> = self.facets().iter().enumerate().map(of_facet).collect();
            Tree::build(&boxes)
        })
    }

    /// Returns the smallest box around all triangles that have an area.
    pub fn aabb(&self) -> Aabb {
        self.tree().aabb()
    }

    /// Returns the point of the surface nearest to `p` within `max_distance` (mm, `f64::INFINITY`
    /// for any), exact up to rounding.
    ///
    /// Among triangles equally near, the one with the lowest index. `None` when nothing is that
    /// near.
    pub fn closest_point(&self, p: &Point3<f64>, max_distance: f64) -> Option<SurfacePoint> {
        self.closest_point_where(p, max_distance, |_| true)
    }

    /// Searches as [`Surface::closest_point`], among the triangles for which `keep` holds.
    pub fn closest_point_where(
        &self,
        p: &Point3<f64>,
        max_distance: f64,
        keep: impl Fn(u32) -> bool,
    ) -> Option<SurfacePoint> {
        if max_distance.is_nan() || max_distance < 0.0 {
            return None;
        }
        let distance_sq = |t: u32| {
            let b = closest_on_triangle(p, &self.mesh.corners(t as usize));
            (self.at(t, b) - p).norm_squared()
        };
        let (triangle, _) = self.tree().nearest(
            max_distance * max_distance,
            |b| b.distance_sq(p),
            |t, _| keep(t).then(|| distance_sq(t)),
        )?;
        let barycentric = closest_on_triangle(p, &self.mesh.corners(triangle as usize));
        let position = self.at(triangle, barycentric);
        Some(SurfacePoint { position, triangle, barycentric, distance: (position - p).norm() })
    }

    /// Returns the point of a triangle with given weights; its distance is 0.
    pub fn point(&self, triangle: u32, barycentric: [f64; 3]) -> SurfacePoint {
        SurfacePoint { position: self.at(triangle, barycentric), triangle, barycentric, distance: 0.0 }
    }

    fn at(&self, triangle: u32, [u, v, w]: [f64; 3]) -> Point3<f64> {
        let [a, b, c] = self.mesh.corners(triangle as usize);
        // At a corner exactly the corner, so neighbours give the same point.
        match [u, v, w] {
            [1.0, _, _] => a,
            [_, 1.0, _] => b,
            [_, _, 1.0] => c,
            _ => Point3::from(a.coords * u + b.coords * v + c.coords * w),
        }
    }

    /// Returns the unit normal of a facet, out of the material; `None` for a triangle without area.
    pub fn facet_normal(&self, triangle: u32) -> Option<Unit<Vector3<f64>>> {
        self.facets()[triangle as usize]
    }

    /// Returns the unit normal of the smooth surface, out of the material: the corners' normals,
    /// weighted by position.
    ///
    /// A corner's normal is the mean of the facet normals around it up to the next crease, weighted
    /// by their angles there. Where the corners' normals cancel, or a corner has none, the facet's
    /// own counts; for a triangle without area, which no query returns, the mean of the available
    /// normals, or +Z without any.
    pub fn normal_at(&self, point: &SurfacePoint) -> Unit<Vector3<f64>> {
        let facet = self.facets()[point.triangle as usize];
        let mut sum = Vector3::zeros();
        for (k, &weight) in point.barycentric.iter().enumerate() {
            if let Some(n) = self.corner_normal(point.triangle, k).or(facet) {
                sum += weight * n.into_inner();
            }
        }
        // A sum shorter than this has lost half of its digits.
        Unit::try_new(sum, 1e-8).or(facet).unwrap_or_else(Vector3::z_axis)
    }

    /// Returns the smooth normal at a corner of a triangle (k = 0, 1, 2), on the triangle's side of
    /// any crease; `None` where the facets around it cancel.
    pub fn corner_normal(&self, triangle: u32, k: usize) -> Option<Unit<Vector3<f64>>> {
        let smooth = self.smooth();
        smooth.normals[smooth.of_corner[3 * triangle as usize + k] as usize]
    }

    /// Returns the estimated curvature of the smooth surface; see [`CurvatureTensor`].
    ///
    /// `None` where the facets around a corner do not define it: at a corner whose triangles all
    /// have no area.
    pub fn curvature_at(&self, point: &SurfacePoint) -> Option<CurvatureTensor> {
        let normal = self.normal_at(point);
        let (smooth, curvatures) = (self.smooth(), self.curvatures());
        let mut parts = [(0.0, None); 3];
        for (k, part) in parts.iter_mut().enumerate() {
            let vertex = smooth.of_corner[3 * point.triangle as usize + k] as usize;
            *part = (point.barycentric[k], curvatures[vertex].as_ref());
        }
        CurvatureTensor::blend(normal, &parts)
    }
}

#[cfg(test)]
#[path = "../tests/unit/surface.rs"]
mod tests;
