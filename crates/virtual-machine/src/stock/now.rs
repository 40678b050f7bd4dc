//! Possible rest of the stock at a moment, as an obstacle of bodies.

use facemill_cl_data::{Aabb, Solid};
use facemill_interference::{Interference, Separation, Verdict, Witness};
use facemill_z_map::{DexelGrid, DexelMap};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::motion::setup::{ObstacleKind, VirtualObstacle};
use crate::stock::unresolved_findings::outside_layer;

/// Stock before it is cut: a mesh with a thickness around it.
pub(crate) struct FirstStock<'a> {
    mesh: &'a dyn Interference,
    /// mm.
    thickness: f64,
    /// Boxes around what of it may have no lines; of their frame.
    beyond: Vec<Aabb>,
}

/// The same at a moment.
///
/// Lines are those that are outside of all stock
/// ([`remaining_collisions`](crate::stock::unresolved_findings::remaining_collisions)): the rest is
/// only where the stock was at first, and in cells whose line has material at the same height, or
/// where there are no lines. So its distance is no less than from the first stock, and no less than
/// from the lines but for half the diagonal of a cell: the result is the larger of both.
pub(crate) struct StockNow<'s> {
    first: &'s FirstStock<'s>,
    lines: &'s DexelMap,
}

/// Distance of what is nearest, and a point of it where one is known.
struct Near {
    distance: f64,
    place: Option<Point3<f64>>,
}

/// By how much lines may cover less than there is, mm: rounding of corners, and of the ends of
/// material.
const ROUNDING: f64 = 1e-6;

impl<'a> FirstStock<'a> {
    /// `None` where an obstacle is no stock and has none on it. A fixture is not cut, whatever is
    /// on it.
    pub(crate) fn of(obstacle: &VirtualObstacle<'a>, grid: &DexelGrid) -> Option<Self> {
        let has_stock = match obstacle.kind {
            ObstacleKind::Stock => true,
            ObstacleKind::Part | ObstacleKind::Check => obstacle.stock > obstacle.allowance,
            ObstacleKind::Fixture => false,
        };
        let (mesh, thickness) = (obstacle.mesh, obstacle.stock);
        has_stock.then(|| Self { mesh, thickness, beyond: beyond(mesh, thickness, grid) })
    }

    pub(crate) fn at<'s>(&'s self, lines: &'s DexelMap) -> StockNow<'s> {
        StockNow { first: self, lines }
    }
}

/// Boxes around what of a stock is beside the rectangle of the lines, on each side of it.
fn beyond(mesh: &dyn Interference, thickness: f64, grid: &DexelGrid) -> Vec<Aabb> {
    let everywhere = Aabb { min: Point3::from([f64::NEG_INFINITY; 3]), max: Point3::from([f64::INFINITY; 3]) };
    let bounds = mesh.bounds().map(|b| b.dilated(thickness).transformed(&grid.work_from_map().inverse()));
    let all = bounds.unwrap_or(everywhere);
    let sides = (0..2).flat_map(|axis| {
        let (mut below, mut above) = (all, all);
        below.max[axis] = all.max[axis].min(grid.origin()[axis]);
        above.min[axis] = all.min[axis].max(grid.origin()[axis] + grid.n_lines()[axis] as f64 * grid.cell());
        [below, above].map(|side| (side, side.max[axis] - side.min[axis]))
    });
    sides.filter(|(side, width)| *width > ROUNDING && !side.is_empty()).map(|(side, _)| side).collect()
}

impl StockNow<'_> {
    /// Returns a lower bound on the distance of possible material from an undilated body; `None` if
    /// that is not below `at_most`. Of distances up to `enough` any may be returned.
    fn now(&self, core: &Solid, work_from_solid: &Isometry3<f64>, [enough, at_most]: [f64; 2]) -> Option<Near> {
        let beside = outside_layer(self.lines.grid().cell()) + ROUNDING;
        let found = self.lines.nearest(core, work_from_solid, [enough, at_most].map(|d| d + beside));
        let lines = found.map(|n| Near { distance: (n.distance - beside).max(0.0), place: Some(n.place) });
        let map_from_solid = self.lines.grid().work_from_map().inv_mul(work_from_solid);
        let around = core.aabb().transformed(&map_from_solid);
        let beyond = self.first.beyond.iter().map(|side| gap(&around, side)).reduce(f64::min);
        let beyond = beyond.filter(|d| *d <= at_most).map(|distance| Near { distance, place: None });
        lines.into_iter().chain(beyond).reduce(|a, b| if b.distance < a.distance { b } else { a })
    }

    /// Whether a place of the first stock may be left, but for rounding.
    fn may_hold(&self, place: &Point3<f64>) -> bool {
        let grid = self.lines.grid();
        let p = grid.work_from_map().inverse_transform_point(place);
        let [i, j] = [0, 1].map(|k| ((p[k] - grid.origin()[k]) / grid.cell()).floor());
        let n = grid.n_lines();
        if i < 0.0 || j < 0.0 || i >= n[0] as f64 || j >= n[1] as f64 {
            return true;
        }
        let mut intervals = self.lines.intervals(i as usize, j as usize);
        intervals.any(|interval| interval.bottom <= p.z && p.z <= interval.top)
    }

    /// The first stock, where it is not farther than `at_most` from an undilated body: 0 within it.
    fn at_first(&self, core: &Solid, pose: &Isometry3<f64>, at_most: f64, hint: Option<u32>) -> Option<Separation> {
        let FirstStock { mesh, thickness, .. } = *self.first;
        let surface = mesh.core_distance(core, pose, at_most + thickness, hint);
        if surface.is_none_or(|s| s.distance > thickness) {
            let verdict = mesh.verdict(core, pose, hint);
            if let Verdict::Hit(Witness { triangle, point }) = verdict {
                return Some(Separation { distance: 0.0, triangle, point });
            }
        }
        surface.map(|s| Separation { distance: (s.distance - thickness).max(0.0), ..s })
    }
}

/// Largest gap of two boxes along an axis, mm: their distance is no less, and it changes by no more
/// than points of one box move.
fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (a.min - b.max).sup(&(b.min - a.max)).sup(&Vector3::zeros()).max()
}

/// Of the solid, not of its surface: a body within it is at distance 0.
impl Interference for StockNow<'_> {
    fn verdict(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, hint: Option<u32>) -> Verdict {
        let met = self.core_distance(solid, mesh_from_solid, solid.rounding(), hint);
        met.map_or(Verdict::Free, |s| Verdict::Hit(Witness { triangle: s.triangle, point: s.point }))
    }

    fn core_distance(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        at_most: f64,
        hint: Option<u32>,
    ) -> Option<Separation> {
        let core = solid.dilated(-solid.rounding());
        let first = self.at_first(&core, mesh_from_solid, at_most, hint)?;
        // A distance below the initial one makes no difference.
        let now = self.now(&core, mesh_from_solid, [first.distance, at_most])?;
        let left = Some(first.point).filter(|p| self.may_hold(p));
        let point = left.or(now.place).unwrap_or(first.point);
        Some(Separation { distance: now.distance.max(first.distance), triangle: first.triangle, point })
    }
}
