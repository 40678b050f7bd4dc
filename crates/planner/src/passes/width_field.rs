//! Factors on strip widths, spread over the surface from places where they are known.

use facemill_cl_data::Aabb;
use facemill_surface_model::Tree;
use nalgebra::{Point3, Unit, Vector3};

/// A place of the surface with its factor on the expected strip width.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WidthSample {
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
    /// Above 0.
    pub(crate) factor: f64,
}

/// Factors on strip widths over a surface; 1 far from all samples.
///
/// Continuous along the surface: the mean of the samples around a place, near ones counting more.
pub(crate) struct WidthField {
    samples: Vec<WidthSample>,
    tree: Tree,
    reach: f64,
}

/// Exponent of the mean: narrow strips count far more than wide ones, because a pass is as near to
/// the next as its narrowest strip requires.
const EXPONENT: i32 = 16;

/// Weight of the factor 1, of 1 at a sample itself: it takes over where samples are at the end of
/// the reach.
const FAR_WEIGHT: f64 = 0.02;

impl WidthField {
    /// Spreads samples over a distance, mm.
    pub(crate) fn new(samples: Vec<WidthSample>, reach: f64) -> Self {
        let boxes: Vec<Aabb> = samples.iter().map(|s| Aabb::of_points([&s.position])).collect();
        Self { tree: Tree::build(&boxes), samples, reach }
    }

    /// Returns the factor at a place of the surface with this normal.
    pub(crate) fn at(&self, position: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        let reach_sq = self.reach * self.reach;
        let mut near: Vec<u32> = Vec::new();
        self.tree.visit_boxes(|b| b.distance_sq(position) < reach_sq, |k| near.push(k));
        // In the order of the samples: sums do not depend on the tree.
        near.sort_unstable();
        let (mut weights, mut sum) = (FAR_WEIGHT, FAR_WEIGHT);
        for sample in near.iter().map(|&k| &self.samples[k as usize]) {
            let away = 1.0 - (sample.position - position).norm_squared() / reach_sq;
            // The other side of a thin wall has strips of its own.
            if away > 0.0 && sample.normal.dot(normal) > 0.0 {
                weights += away * away;
                sum += away * away * sample.factor.powi(-EXPONENT);
            }
        }
        (weights / sum).powf(1.0 / f64::from(EXPONENT))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/width_field.rs"]
mod tests;
