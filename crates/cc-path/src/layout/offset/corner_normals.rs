use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::strategy::patch::Patch;

/// Smooth normals along the edges of a patch's triangles, without a search for the place of each in
/// its facet of the surface: between the corners of a triangle the sum of weighted normals, which a
/// normal is the direction of, is linear.
pub(crate) struct CornerNormals<'a> {
    patch: &'a Patch<'a>,
    /// Sums at the corners of each triangle.
    sums: Vec<[Vector3<f64>; 3]>,
}

/// A sum shorter than this has lost half of its digits.
const SHORTEST: f64 = 1e-8;

impl<'a> CornerNormals<'a> {
    pub(crate) fn of(patch: &'a Patch<'a>) -> Self {
        let sums = |t: u32| patch.mesh.corners(t as usize).map(|p| patch.normal_sum(t, &p));
        Self { patch, sums: (0..patch.mesh.triangles().len() as u32).into_par_iter().map(sums).collect() }
    }

    pub(crate) fn patch(&self) -> &'a Patch<'a> {
        self.patch
    }

    /// A vector along the smooth normal of a triangle at a position on one of its edges, a share of
    /// the way from one end to the other.
    pub(crate) fn on_edge(&self, triangle: u32, edge: [u32; 2], share: f64, position: &Point3<f64>) -> Vector3<f64> {
        let (corners, sums) = (&self.patch.mesh.triangles()[triangle as usize], &self.sums[triangle as usize]);
        let of = |v: u32| sums[corners.iter().position(|&c| c == v).unwrap_or(0)];
        let sum = of(edge[0]) * (1.0 - share) + of(edge[1]) * share;
        if sum.norm_squared() < SHORTEST * SHORTEST {
            return self.patch.normal(triangle, position).into_inner();
        }
        sum
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/offset/corner_normals.rs"]
mod tests;
