//! Material that passes leave beside them.

use crate::distance::curve_distance::CurveDistance;
use crate::distance::patch_vertices::{PatchVertices, on_edge};
use crate::distance::source_curve::SourceCurve;
use crate::strategy::patch::Patch;

/// Distances from the nearest pass, over half the width allowed there.
pub(crate) struct Coverage<'a> {
    distance: CurveDistance<'a>,
    /// Of each vertex; infinite where no pass is near.
    pub(crate) shares: Vec<f64>,
}

/// A place farther from the nearest pass than this share of half a strip is not covered: the cusp
/// is the square of it times as high, so 4 % above the tolerance.
pub(crate) const COVERED: f64 = 1.02;

impl<'a> Coverage<'a> {
    /// Measures the distances from passes, up to the largest width.
    pub(crate) fn of(
        patch: &'a Patch<'a>,
        vertices: &'a PatchVertices,
        passes: &'a [SourceCurve],
        widths: &[f64],
        most: f64,
    ) -> Self {
        let distance = CurveDistance::new(patch, vertices, passes, most, |_| true);
        let mut shares = vec![f64::INFINITY; widths.len()];
        for (v, foot) in distance.reached() {
            shares[*v as usize] = foot.distance / (0.5 * widths[*v as usize]);
        }
        Self { distance, shares }
    }

    /// The same share at a share of the way along an edge.
    pub(crate) fn share_on_edge(
        &self,
        patch: &Patch,
        vertices: &PatchVertices,
        widths: &[f64],
        edge: [u32; 2],
        t: f64,
    ) -> f64 {
        let p = on_edge(patch, edge, t);
        let width = widths[edge[0] as usize] * (1.0 - t) + widths[edge[1] as usize] * t;
        let foot = self.distance.foot(&edge, &p, &vertices.normal_between(edge, t));
        foot.map_or(f64::INFINITY, |f| f.distance / (0.5 * width))
    }

    /// Area that is not covered, mm²: a third of each triangle for each of its corners.
    pub(crate) fn uncovered_area(&self, patch: &Patch) -> f64 {
        let area = |t: usize| 0.5 * patch.mesh.scaled_normal(t).norm();
        let corners = patch.mesh.triangles().iter().enumerate();
        let open = |v: &&u32| self.shares[**v as usize] > COVERED;
        corners.map(|(t, v)| area(t) / 3.0 * v.iter().filter(open).count() as f64).sum()
    }
}
