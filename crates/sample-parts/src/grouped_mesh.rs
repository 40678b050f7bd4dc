//! Meshes with named groups.

use facemill_surface_model::{Group, TriMesh};
use nalgebra::Point3;

/// Vertices and the triangles of named groups, collected in any order.
#[derive(Debug)]
pub(crate) struct GroupedMesh {
    vertices: Vec<Point3<f64>>,
    groups: Vec<(&'static str, Vec<[u32; 3]>)>,
}

impl GroupedMesh {
    /// A mesh whose groups come in this order.
    pub(crate) fn new(names: &[&'static str]) -> Self {
        Self { vertices: Vec::new(), groups: names.iter().map(|&name| (name, Vec::new())).collect() }
    }

    /// Index of a new vertex.
    pub(crate) fn vertex(&mut self, point: Point3<f64>) -> u32 {
        self.vertices.push(point);
        u32::try_from(self.vertices.len() - 1).expect("resolutions are limited to far fewer than 2^32 vertices")
    }

    /// Place of a vertex.
    pub(crate) fn point(&self, vertex: u32) -> Point3<f64> {
        self.vertices[vertex as usize]
    }

    /// Triangles of a group.
    pub(crate) fn triangles_mut(&mut self, group: usize) -> &mut Vec<[u32; 3]> {
        &mut self.groups[group].1
    }

    /// Adds the quad `a, b, c, d` to a group (by its place in the list), split along the shorter
    /// diagonal. Corners that coincide make it a triangle, or nothing.
    pub(crate) fn quad(&mut self, group: usize, corners: [u32; 4]) {
        self.quad_without(group, corners, |_| false);
    }

    /// As [`Self::quad`], with the other diagonal where the shorter one joins two vertices of a
    /// kind.
    pub(crate) fn quad_without(&mut self, group: usize, [a, b, c, d]: [u32; 4], is_of_kind: impl Fn(u32) -> bool) {
        let is_first_shorter = self.distance_sq(a, c) <= self.distance_sq(b, d);
        let joins = |p: u32, q: u32| is_of_kind(p) && is_of_kind(q);
        let is_first = if is_first_shorter { !joins(a, c) } else { joins(b, d) };
        let split = if is_first { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        for triangle in split {
            self.triangle(group, triangle);
        }
    }

    /// Square of the distance of two vertices.
    pub(crate) fn distance_sq(&self, a: u32, b: u32) -> f64 {
        (self.vertices[a as usize] - self.vertices[b as usize]).norm_squared()
    }

    /// Adds a triangle to a group unless two of its corners are the same vertex.
    pub(crate) fn triangle(&mut self, group: usize, [a, b, c]: [u32; 3]) {
        if a != b && b != c && c != a {
            self.groups[group].1.push([a, b, c]);
        }
    }

    /// Winds all triangles the other way round, as a mirror image takes it.
    pub(crate) fn reverse(&mut self) {
        for triangle in self.groups.iter_mut().flat_map(|(_, triangles)| triangles) {
            triangle.swap(1, 2);
        }
    }

    /// The mesh; groups without triangles are left out.
    pub(crate) fn build(self) -> TriMesh {
        let (mut triangles, mut groups) = (Vec::new(), Vec::new());
        for (name, members) in self.groups {
            let start = triangles.len();
            triangles.extend(members);
            if triangles.len() > start {
                groups.push(Group { name: name.to_owned(), triangles: start..triangles.len() });
            }
        }
        TriMesh::with_groups(self.vertices, triangles, groups)
            .expect("coordinates of checked specifications are finite, indices come from `vertex`")
    }
}
