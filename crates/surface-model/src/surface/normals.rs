use nalgebra::{Unit, Vector3};

use crate::mesh::edges::{DisjointSets, Edges};
use crate::mesh::tri_mesh::TriMesh;

/// Returns the unit normal of each facet; `None` where the triangle has no area.
///
/// A triangle counts as such when its height is less than 1e-12 of its longest side: rounding of
/// the coordinates then decides the direction of its normal.
pub(crate) fn facet_normals(mesh: &TriMesh) -> Vec<Option<Unit<Vector3<f64>>>> {
    (0..mesh.triangles().len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            // Divided first, so neither tiny nor huge triangles leave the range of the numbers.
            Unit::try_new(((b - a) / longest).cross(&((c - a) / longest)), 1e-12)
        })
        .collect()
}

/// Smooth vertices, each shared by corners of the triangles around a vertex without a crease
/// between them.
#[derive(Clone, Debug)]
pub(crate) struct SmoothVertices {
    /// Smooth vertex of each corner, `3 * triangle + k`.
    pub(crate) of_corner: Vec<u32>,
    /// Mean of the facet normals weighted by the angle at the corner; `None` where it has no
    /// direction.
    pub(crate) normals: Vec<Option<Unit<Vector3<f64>>>>,
}

impl SmoothVertices {
    /// Joins two facets across an edge when exactly these two meet there, are wound alike, and
    /// their normals differ by no more than `crease_angle` (rad).
    pub(crate) fn of(mesh: &TriMesh, edges: &Edges, facets: &[Option<Unit<Vector3<f64>>>], crease_angle: f64) -> Self {
        let mut sets = DisjointSets::new(3 * mesh.triangles().len());
        for (t, facet) in facets.iter().enumerate() {
            for k in 0..3 {
                let behind = edges.across(mesh, t as u32, k).filter(|(u, _)| *u as usize > t);
                let Some((u, j)) = behind else { continue };
                let smooth = match (facet, &facets[u as usize]) {
                    (Some(a), Some(b)) => a.cross(b).norm().atan2(a.dot(b)) <= crease_angle,
                    // A triangle without area has no normal to compare; it must not separate its
                    // neighbours.
                    _ => true,
                };
                if smooth {
                    sets.join((3 * t + k) as u32, 3 * u + (j as u32 + 1) % 3);
                    sets.join((3 * t + (k + 1) % 3) as u32, 3 * u + j as u32);
                }
            }
        }
        Self::from_sets(mesh, facets, &mut sets)
    }

    fn from_sets(mesh: &TriMesh, facets: &[Option<Unit<Vector3<f64>>>], sets: &mut DisjointSets) -> Self {
        let mut of_corner = vec![0; 3 * facets.len()];
        let mut sums: Vec<Vector3<f64>> = Vec::new();
        for corner in 0..of_corner.len() {
            let first = sets.find(corner as u32) as usize;
            of_corner[corner] = if first == corner {
                sums.push(Vector3::zeros());
                sums.len() as u32 - 1
            } else {
                of_corner[first]
            };
            if let Some(n) = facets[corner / 3] {
                sums[of_corner[corner] as usize] += corner_angle(mesh, corner) * n.into_inner();
            }
        }
        // Facets that cancel to less than 1e-9 of a radian leave no meaningful direction.
        Self { of_corner, normals: sums.into_iter().map(|s| Unit::try_new(s, 1e-9)).collect() }
    }
}

/// Returns the angle of the triangle at a corner, rad.
fn corner_angle(mesh: &TriMesh, corner: usize) -> f64 {
    let p = mesh.corners(corner / 3);
    let k = corner % 3;
    let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
    u.cross(&v).norm().atan2(u.dot(&v))
}

#[cfg(test)]
#[path = "../../tests/unit/surface/normals.rs"]
mod tests;
