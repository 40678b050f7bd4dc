//! Places where a text leaves more than the permitted cusp, for passes that are put in there.

use facemill_cl_data::Aabb;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::neighbours::Neighbour;
use facemill_surface_model::Tree;
use nalgebra::{Point3, Unit, Vector3};

/// A place on the surface that passes leave, with the measured height, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HighPlace {
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
    pub(crate) height: f64,
    /// Number of the round of widths that has measured it.
    pub(crate) round: u32,
}

/// Places with too much left, to look up by strip.
pub(crate) struct HighPlaces {
    places: Vec<HighPlace>,
    tree: Tree,
}

/// Largest distance of a place from the line across a strip, as a share of its width: beyond the
/// end of a pass its line goes on about so far.
const BESIDE: f64 = 0.6;

impl HighPlaces {
    pub(crate) fn new(places: Vec<HighPlace>) -> Self {
        let boxes: Vec<Aabb> = places.iter().map(|p| Aabb::of_points([&p.position])).collect();
        Self { tree: Tree::build(&boxes), places }
    }

    pub(crate) fn places(&self) -> &[HighPlace] {
        &self.places
    }

    /// Returns the largest height measured in the strip between a point and the pass beside it, mm;
    /// `None` if none of the places is in it.
    pub(crate) fn in_strip(&self, own: &CutPoint, beside: &Neighbour) -> Option<f64> {
        if self.places.is_empty() {
            return None;
        }
        let (from, across) = (own.cc.position, beside.point.cc.position - own.cc.position);
        let width_sq = across.norm_squared();
        let mut highest: Option<f64> = None;
        // The farthest place is beyond one end of the line across.
        let reach_sq = (1.0 + BESIDE * BESIDE) * width_sq;
        self.tree.visit_boxes(
            |b| b.distance_sq(&from) <= reach_sq,
            |k| {
                let place = &self.places[k as usize];
                let way = place.position - from;
                let share = way.dot(&across) / width_sq;
                let aside_sq = (way - across * share).norm_squared();
                if (0.0..=1.0).contains(&share) && aside_sq <= BESIDE * BESIDE * width_sq {
                    highest = Some(highest.map_or(place.height, |h| h.max(place.height)));
                }
            },
        );
        highest
    }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/high_places.rs"]
mod tests;
