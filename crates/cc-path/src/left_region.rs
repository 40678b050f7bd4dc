//! Regions by what is left: places where stock is higher above the surface than a limit, and the
//! surface around them.

pub(crate) mod ball_tree;
mod coverage;
mod islands;

use facemill_cl_data::Aabb;
use nalgebra::{Point3, Unit, Vector3};

use crate::left_region::ball_tree::{Ball, BallTree};
pub use crate::left_region::coverage::StripPoint;
pub use crate::left_region::islands::LeftIsland;

/// Height of stock, measured on a place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StockHeight {
    /// The place, workpiece frame, mm.
    pub position: Point3<f64>,
    /// Outward normal of the surface there.
    pub normal: Unit<Vector3<f64>>,
    /// Height of the stock above the surface along the normal, mm; infinite where it is unknown.
    pub height: f64,
    /// Distance of the farthest measured place beside it, mm: stock that is left here may go on up
    /// to there. On a square lattice the diagonal of a cell.
    pub reach: f64,
    /// Area that the place stands for, mm²; 0 on borders.
    pub area: f64,
}

/// Surface on which stock is left, measured on places.
///
/// Between places the stock counts as rising on as steeply as between a place and those beside it,
/// up to half the place's reach: a ridge between the lines of a stock is then not lower than its
/// sides let expect. Where the height so extended is above the limit, stock is *left*. The surface
/// within reach of such a place is the surface left, and that within reach and overlap the surface
/// to be cut. Distances are straight; surface that faces away from a place, as the other side of a
/// blade, is not near it.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftRegion {
    above: f64,
    overlap: f64,
    n_measured: usize,
    places: Vec<StockHeight>,
    tree: BallTree,
}

/// Places beside a place are those within this many reaches: lines of a square lattice up to the
/// second.
const BESIDE: f64 = 1.5;

/// Share of the reach up to the middle between places.
const HALF: f64 = 0.5;

impl LeftRegion {
    /// The surface on which stock is higher than `above` (mm), and how far around it is to be cut
    /// as well.
    pub fn new(measured: &[StockHeight], above: f64, overlap: f64) -> Self {
        let balls = |of: &[StockHeight]| BallTree::new(of.iter().map(ball).collect());
        let beside = balls(measured);
        let is_left = |place: &&StockHeight| outside_height(place, measured, &beside) > above;
        let places: Vec<StockHeight> = measured.iter().filter(is_left).copied().collect();
        let tree = balls(&places);
        Self { above, overlap, n_measured: measured.len(), places, tree }
    }

    /// Height above which stock is left, mm.
    pub fn above(&self) -> f64 {
        self.above
    }

    /// Distance around the surface left that is cut as well, mm.
    pub fn overlap(&self) -> f64 {
        self.overlap
    }

    /// Number of places on which heights were measured.
    pub fn n_measured(&self) -> usize {
        self.n_measured
    }

    /// Places on which stock is left, in the order in which they were measured.
    pub fn places(&self) -> &[StockHeight] {
        &self.places
    }

    /// Whether stock is left nowhere.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Area of the places on which stock is left, mm².
    pub fn area(&self) -> f64 {
        self.places.iter().fold(0.0, |sum, p| sum + p.area)
    }

    /// Whether stock is left at a point of the surface with this normal, the overlap not included.
    pub fn contains(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> bool {
        self.tree.deepest(point, Some(normal), -1.0) >= 0.0
    }

    /// Whether a point of the surface with this normal is to be cut: stock is left there, or within
    /// the overlap.
    pub fn is_cut(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> bool {
        self.depth(point, normal, -1.0) >= 0.0
    }

    /// Distance of a point from the border of the surface to be cut, mm, positive inside; at least
    /// `least`. It changes by no more than the point moves, as long as the normal stays.
    pub(crate) fn depth(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>, least: f64) -> f64 {
        self.tree.deepest(point, Some(normal), least - self.overlap) + self.overlap
    }

    /// Radius of the smallest ball around a place on which stock is left, overlap included, mm;
    /// infinite without any.
    pub(crate) fn least_radius(&self) -> f64 {
        self.places.iter().map(|p| p.reach).fold(f64::INFINITY, f64::min) + self.overlap
    }

    /// Box around the surface left, overlap not included.
    pub(crate) fn bounds(&self) -> Aabb {
        let around = |p: &StockHeight| Aabb::of_points(&[p.position]).dilated(p.reach);
        self.places.iter().map(around).fold(Aabb::EMPTY, |all, one| all.union(&one))
    }

    /// Groups of places whose surface to be cut hangs together, in the order of their first places.
    pub fn islands(&self) -> Vec<LeftIsland> {
        islands::islands(&self.places, &self.tree, self.overlap)
    }

    /// Groups of places that are farther than half a strip from all passes, in the order of their
    /// first places: where passes of this region are left out.
    pub fn not_reached(&self, passes: &[Vec<StripPoint>]) -> Vec<LeftIsland> {
        let indices = coverage::not_reached(&self.places, passes);
        let places: Vec<StockHeight> = indices.iter().map(|&k| self.places[k]).collect();
        let tree = BallTree::new(places.iter().map(ball).collect());
        let mut islands = islands::islands(&places, &tree, self.overlap);
        islands.iter_mut().flat_map(|island| &mut island.places).for_each(|k| *k = indices[*k]);
        islands
    }
}

fn ball(place: &StockHeight) -> Ball {
    Ball { center: place.position, radius: place.reach, normal: place.normal }
}

/// Height of the stock on a place and half-way to those beside it, if the stock goes on as steeply
/// as it rises to the place from there, mm.
fn outside_height(place: &StockHeight, measured: &[StockHeight], tree: &BallTree) -> f64 {
    let mut steepest: f64 = 0.0;
    tree.visit_within(&place.position, BESIDE * place.reach, &mut |k| {
        let other = &measured[k];
        if other.height.is_finite() && other.normal.dot(&place.normal) > 0.0 {
            // Nearer places than that would turn the error of a height into a slope.
            let apart = (other.position - place.position).norm().max(HALF * place.reach);
            steepest = steepest.max((place.height - other.height) / apart);
        }
    });
    if steepest.is_finite() { place.height + steepest * HALF * place.reach } else { place.height }
}

#[cfg(test)]
#[path = "../tests/unit/left_region.rs"]
mod tests;
