//! Triangles for the screen: surfaces with fewer triangles, and shapes of bodies.

use std::collections::HashSet;

use facemill_cl_data::Solid;
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// A mesh with fewer triangles, and unit normals at its vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScreenMesh {
    pub(crate) vertices: Vec<Point3<f64>>,
    pub(crate) normals: Vec<Vector3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Most steps in which cells are enlarged until the triangles are few enough.
const MAX_STEPS: usize = 12;

/// Returns a mesh with at most about `most` triangles: vertices within a cell whose normals are on
/// the same side become one, in their middle. Sides of a thin wall stay apart. The mesh stays as it
/// is if it has no more.
pub(crate) fn thinned(mesh: &TriMesh, most: usize) -> ScreenMesh {
    let normals = vertex_normals(mesh);
    if mesh.triangles().len() <= most {
        return ScreenMesh { vertices: mesh.vertices().to_vec(), normals, triangles: mesh.triangles().to_vec() };
    }
    let area: f64 = (0..mesh.triangles().len()).map(|k| 0.5 * mesh.scaled_normal(k).norm()).sum();
    let mut cell = (2.0 * area / most as f64).sqrt().max(f64::MIN_POSITIVE);
    let mut thin = clustered(mesh, &normals, cell);
    for _ in 0..MAX_STEPS {
        let excess = thin.triangles.len() as f64 / most as f64;
        if excess <= 1.0 {
            break;
        }
        cell *= excess.sqrt().max(1.05);
        thin = clustered(mesh, &normals, cell);
    }
    thin
}

/// Returns unit normals at vertices, means of the faces around by their area; zero where none is.
fn vertex_normals(mesh: &TriMesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices().len()];
    for (k, corners) in mesh.triangles().iter().enumerate() {
        let normal = mesh.scaled_normal(k);
        corners.iter().for_each(|&v| normals[v as usize] += normal);
    }
    normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or_default());
    normals
}

fn clustered(mesh: &TriMesh, normals: &[Vector3<f64>], cell: f64) -> ScreenMesh {
    let low = mesh.aabb().min;
    let key = |k: usize| {
        let at = (mesh.vertices()[k] - low) / cell;
        let normal = normals[k];
        // The side that the normal is most on: 0 to 5.
        let axis = normal.iamax();
        let side = 2 * axis + usize::from(normal[axis] < 0.0);
        ([at.z, at.y, at.x].map(|x| x.floor() as i32), side as u8)
    };
    let mut order: Vec<(([i32; 3], u8), u32)> =
        (0..mesh.vertices().len()).into_par_iter().map(|k| (key(k), k as u32)).collect();
    order.par_sort_unstable();
    let mut of_vertex = vec![0_u32; mesh.vertices().len()];
    let mut thin = ScreenMesh::default();
    for cluster in order.chunk_by(|a, b| a.0 == b.0) {
        let mut sums = [Vector3::zeros(); 2];
        for &(_, k) in cluster {
            of_vertex[k as usize] = thin.vertices.len() as u32;
            sums[0] += mesh.vertices()[k as usize] - low;
            sums[1] += normals[k as usize];
        }
        thin.vertices.push(low + sums[0] / cluster.len() as f64);
        thin.normals.push(sums[1].try_normalize(0.0).unwrap_or_default());
    }
    let mut known = HashSet::new();
    for corners in mesh.triangles() {
        let mut corners = corners.map(|v| of_vertex[v as usize]);
        let lowest = (0..3).min_by_key(|&c| corners[c]).unwrap_or(0);
        corners.rotate_left(lowest);
        let [a, b, c] = corners;
        if a != b && b != c && a != c && known.insert(corners) {
            thin.triangles.push(corners);
        }
    }
    thin.without_unused()
}

impl ScreenMesh {
    /// Returns the mesh without vertices of no triangle, the others in the order of their first
    /// use.
    fn without_unused(self) -> Self {
        let mut new = vec![u32::MAX; self.vertices.len()];
        let mut kept = Self::default();
        for corners in &self.triangles {
            let triangle = corners.map(|v| {
                if new[v as usize] == u32::MAX {
                    new[v as usize] = kept.vertices.len() as u32;
                    kept.vertices.push(self.vertices[v as usize]);
                    kept.normals.push(self.normals[v as usize]);
                }
                new[v as usize]
            });
            kept.triangles.push(triangle);
        }
        kept
    }
}

/// Triangles that are in several meshes are kept once; the order is that of the meshes.
pub(crate) fn joined_once<'a>(meshes: impl Iterator<Item = &'a TriMesh>) -> TriMesh {
    let all = meshes.fold(TriMesh::default(), |all, mesh| all.joined(mesh));
    let keys = sorted_keys(&all);
    let mut is_again = vec![false; keys.len()];
    for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        is_again[pair[1].1 as usize] = true;
    }
    let kept = all.triangles().iter().zip(is_again).filter(|(_, is_again)| !is_again);
    let triangles = kept.map(|(corners, _)| *corners).collect();
    TriMesh::new(all.vertices().to_vec(), triangles).unwrap_or_default()
}

/// Returns whether two meshes have the same triangles, in any order.
pub(crate) fn has_same_triangles(a: &TriMesh, b: &TriMesh) -> bool {
    let has_as_many = a.triangles().len() == b.triangles().len();
    has_as_many && sorted_keys(a).iter().map(|k| k.0).eq(sorted_keys(b).iter().map(|k| k.0))
}

/// Returns the corners of all triangles, from the lowest one on, with their places in the mesh.
fn sorted_keys(mesh: &TriMesh) -> Vec<([[u64; 3]; 3], u32)> {
    let key = |k: usize| {
        let mut corners = mesh.corners(k).map(|p| [p.x, p.y, p.z].map(f64::to_bits));
        let lowest = (0..3).min_by_key(|&c| corners[c]).unwrap_or(0);
        corners.rotate_left(lowest);
        (corners, k as u32)
    };
    let mut keys: Vec<_> = (0..mesh.triangles().len()).into_par_iter().map(key).collect();
    keys.par_sort_unstable();
    keys
}

/// Corners of a circle in meshes of turned bodies.
const CORNERS: usize = 48;

/// Returns points around the undilated core of a solid, in the frame of `frame_from_solid`: their
/// hull is the body.
pub(crate) fn points_around(solid: &Solid, frame_from_solid: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let points: Vec<Point3<f64>> = match solid {
        Solid::Frustum(f) => [(f.z_low, f.radius_low), (f.z_high, f.radius_high)]
            .into_iter()
            .flat_map(|(z, radius)| {
                (0..CORNERS).map(move |k| {
                    let turn = std::f64::consts::TAU * k as f64 / CORNERS as f64;
                    Point3::new(radius * turn.cos(), radius * turn.sin(), z)
                })
            })
            .collect(),
        Solid::Box(b) => (0..8)
            .map(|k| {
                let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
                Point3::from(Vector3::new(sign(0), sign(1), sign(2)).component_mul(&b.half_extents))
            })
            .collect(),
        Solid::Hull(hull) => hull.core.vertices().to_vec(),
    };
    points.into_iter().map(|p| frame_from_solid * p).collect()
}

/// Returns the hull of points in a plane, counterclockwise, without its first corner repeated.
pub(crate) fn outline(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.retain(|p| p.iter().all(|x| x.is_finite()));
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..]
                && (b[0] - a[0]) * (p[1] - a[1]) <= (b[1] - a[1]) * (p[0] - a[0])
            {
                hull.pop();
            }
            hull.push(*p);
        }
        hull.pop();
        hull
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

#[cfg(test)]
#[path = "../tests/unit/meshes.rs"]
mod tests;
