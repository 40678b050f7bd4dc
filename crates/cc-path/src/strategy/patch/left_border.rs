//! Patches cut at the border of what is left.

use facemill_surface_model::Surface;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::error::PathError;
use crate::left_region::LeftRegion;
use crate::strategy::patch::{MAX_ROUNDS, Pieces};

/// Edges at the border, as a share of the smallest ball that the region is made of. Larger: the cut
/// is farther from the border, and above 1 a ball could fall between vertices. Smaller: more
/// triangles.
const EDGE: f64 = 0.25;

impl Pieces {
    /// Cuts off what is neither left nor within the overlap, and keeps all that is left. Depths are
    /// linear between vertices: the border is at most 0.8 % of the smallest ball's radius inside
    /// the region's, and at most an eighth of the radius outside, where balls meet in a corner.
    ///
    /// # Errors
    /// When the border is so long that there would be more than about `most` triangles.
    pub(super) fn keep_left(&mut self, surface: &Surface, left: &LeftRegion, most: usize) -> Result<(), PathError> {
        let normal = |parent: u32| surface.facet_normal(parent).unwrap_or_else(Vector3::z_axis);
        let finest = EDGE * left.least_radius();
        for round in 0..=2 * MAX_ROUNDS {
            self.drop_far(left, &normal);
            let is_at_border = |parent: u32, a: &Point3<f64>, b: &Point3<f64>| {
                let length = nalgebra::distance(a, b);
                // The whole of a triangle is within the length of its longest edge of the edge's
                // middle.
                length > finest && {
                    let depth = left.depth(&nalgebra::center(a, b), &normal(parent), -length);
                    depth > -length && depth < length
                }
            };
            if round == 2 * MAX_ROUNDS || !self.halve_edges_of(is_at_border) {
                break;
            }
            if self.triangles.len() > most {
                return Err(PathError::Setting {
                    setting: "region.left_above.overlap_mm",
                    value: left.overlap(),
                    range: "larger, because the border of what is left is too long for so narrow an overlap",
                });
            }
        }
        let depths = self.depths(left, &normal, -finest);
        self.clip_by(depths);
        Ok(())
    }

    /// Leaves out triangles that the region does not reach into.
    fn drop_far(&mut self, left: &LeftRegion, normal: &(impl Fn(u32) -> Unit<Vector3<f64>> + Sync)) {
        let reached = |(t, parent): (&[u32; 3], &u32)| {
            let corners = t.map(|v| self.vertices[v as usize]);
            let middle = Point3::from(corners.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 3.0);
            let radius = corners.iter().map(|p| nalgebra::distance(p, &middle)).fold(0.0, f64::max);
            // Above the bound, if by rounding alone.
            left.depth(&middle, &normal(*parent), -radius - 1e-9) > -radius - 1e-9
        };
        let keep: Vec<bool> = self.triangles.par_iter().zip(&self.parents).map(reached).collect();
        self.keep(&keep);
    }

    /// Depth of every vertex in the region, mm: on the facets around it the largest, not below
    /// `least`.
    fn depths(&self, left: &LeftRegion, normal: &(impl Fn(u32) -> Unit<Vector3<f64>> + Sync), least: f64) -> Vec<f64> {
        let at_corners = |(t, parent): (&[u32; 3], &u32)| {
            let normal = normal(*parent);
            t.map(|v| left.depth(&self.vertices[v as usize], &normal, least))
        };
        let of_triangles: Vec<[f64; 3]> = self.triangles.par_iter().zip(&self.parents).map(at_corners).collect();
        let mut depths = vec![least; self.vertices.len()];
        for (t, of_corners) in self.triangles.iter().zip(of_triangles) {
            for (&v, depth) in t.iter().zip(of_corners) {
                let deepest = &mut depths[v as usize];
                *deepest = deepest.max(depth);
            }
        }
        depths
    }
}
