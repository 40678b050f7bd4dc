use facemill_cl_data::Aabb;
use nalgebra::{Isometry3, Point3, Vector3};

/// Indexed triangle mesh in mm, counter-clockwise seen from outside the material.
///
/// Indices are in range and coordinates finite: [`TriMesh::new`] checks this, and nothing changes
/// it afterwards. The mesh may be open, non-manifold and of several overlapping components.
/// Triangles belong to named groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    groups: Vec<Group>,
}

/// A named run of triangles, as written in the mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Name in the file; empty where the file has none.
    pub name: String,
    /// Its triangles.
    pub triangles: std::ops::Range<usize>,
}

/// Reason why vertices and triangles are not a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// A triangle has the index of a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {vertex}, but there are only {n_vertices}")]
    BadIndex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The index it uses.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
    /// Groups do not cover the triangles in order, one after the other.
    #[error(
        "group {group} does not start where the one before it ends, or the last one does not end at the last triangle"
    )]
    BadGroups {
        /// Index of the group, from 0.
        group: usize,
    },
}

impl TriMesh {
    /// Creates a mesh of one group without a name.
    ///
    /// # Errors
    /// When a coordinate is not finite or an index out of range.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let groups = vec![Group { name: String::new(), triangles: 0..triangles.len() }];
        Self::with_groups(vertices, triangles, groups)
    }

    /// Creates a mesh with named groups, which follow each other without gap.
    ///
    /// # Errors
    /// As [`TriMesh::new`], and when the groups do not cover all triangles in order.
    pub fn with_groups(
        vertices: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        groups: Vec<Group>,
    ) -> Result<Self, MeshError> {
        if let Some(vertex) = vertices.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        let n_vertices = vertices.len();
        for (triangle, t) in triangles.iter().enumerate() {
            if let Some(&vertex) = t.iter().find(|&&v| v as usize >= n_vertices) {
                return Err(MeshError::BadIndex { triangle, vertex, n_vertices });
            }
        }
        let mut end = 0;
        for (group, g) in groups.iter().enumerate() {
            if g.triangles.start != end || g.triangles.end < end {
                return Err(MeshError::BadGroups { group });
            }
            end = g.triangles.end;
        }
        if end != triangles.len() {
            return Err(MeshError::BadGroups { group: groups.len().saturating_sub(1) });
        }
        Ok(Self { vertices, triangles, groups })
    }

    /// Returns the vertices, mm.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Returns the vertex indices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the groups in file order; they cover all triangles.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Returns the index of a triangle's group; `None` when there is no such triangle.
    pub fn group_of(&self, triangle: usize) -> Option<usize> {
        let group = self.groups.partition_point(|g| g.triangles.end <= triangle);
        (group < self.groups.len()).then_some(group)
    }

    /// Returns the corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        // `map` of an array is no less than a call where a caller is compiled for tests.
        let [a, b, c] = self.triangles[triangle];
        let corner = |v: u32| self.vertices[v as usize];
        [corner(a), corner(b), corner(c)]
    }

    /// Returns twice the area times the unit normal, out of the material; zero for a degenerate
    /// triangle.
    pub fn scaled_normal(&self, triangle: usize) -> Vector3<f64> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a))
    }

    /// Returns the smallest box around the vertices that triangles use.
    pub fn aabb(&self) -> Aabb {
        self.triangles.iter().flatten().fold(Aabb::EMPTY, |b, &v| b.with_point(&self.vertices[v as usize]))
    }

    /// Returns the mesh after the motion `to_from`.
    #[must_use]
    pub fn transformed(&self, to_from: &Isometry3<f64>) -> Self {
        Self { vertices: self.vertices.iter().map(|p| to_from * p).collect(), ..self.clone() }
    }

    /// Returns the triangles of the groups for which `keep` holds, with all vertices kept.
    #[must_use]
    pub fn select_groups(&self, mut keep: impl FnMut(&str) -> bool) -> Self {
        let (mut triangles, mut groups) = (Vec::new(), Vec::new());
        for g in self.groups.iter().filter(|g| keep(&g.name)) {
            let start = triangles.len();
            triangles.extend_from_slice(&self.triangles[g.triangles.clone()]);
            groups.push(Group { name: g.name.clone(), triangles: start..triangles.len() });
        }
        Self { vertices: self.vertices.clone(), triangles, groups }
    }

    /// Returns the same triangles wound the other way: inside becomes outside.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Returns this mesh followed by `other`, groups kept, vertices not welded.
    ///
    /// # Panics
    /// When there are more than `u32::MAX` vertices.
    #[must_use]
    pub fn joined(mut self, other: &Self) -> Self {
        let first_vertex = u32::try_from(self.vertices.len()).expect("fewer than 2^32 vertices");
        let first_triangle = self.triangles.len();
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first_vertex)));
        self.groups.extend(other.groups.iter().map(|g| Group {
            name: g.name.clone(),
            triangles: g.triangles.start + first_triangle..g.triangles.end + first_triangle,
        }));
        self
    }
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/tri_mesh.rs"]
mod tests;
