//! How near a convex solid is to the material on the lines.

use facemill_cl_data::{Aabb, Solid};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::dexel::grid::DexelGrid;
use crate::dexel::map::DexelMap;
use crate::dexel::tile::{Interval, SIDE, Tile};

/// Most by which a reported distance may fall short of the real one, mm. Larger: bodies seem
/// nearer; smaller: more looks at each line.
const RESOLUTION: f64 = 1e-4;

/// The material of a line that is nearest to a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestMaterial {
    /// Distance from the solid, mm: no more than it is, and at most 1e-4 less than that of `place`;
    /// 0 where they meet.
    pub distance: f64,
    /// A point of the material; workpiece frame, mm.
    pub place: Point3<f64>,
}

impl DexelMap {
    /// The material of the lines that is nearest to a solid, its dilation included, at this pose;
    /// `None` where no line has material nearer than `at_most` (mm, may be infinite). Where there
    /// is some that is no farther than `enough` (mm, at least 0), any such is returned: the search
    /// ends there.
    ///
    /// Both are proven for all material of all lines, up to rounding; what lies between the lines
    /// is not seen. A solid whose pose or size is not finite counts as one that meets the material,
    /// where there is any.
    pub fn nearest(
        &self,
        solid: &Solid,
        work_from_solid: &Isometry3<f64>,
        [enough, at_most]: [f64; 2],
    ) -> Option<NearestMaterial> {
        let mut search = Search::new(&self.grid, solid, work_from_solid, [enough, at_most]);
        if !search.is_finite() {
            let place = self.some_material()?;
            return Some(NearestMaterial { distance: 0.0, place });
        }
        let apart = |(k, tile): (usize, &Tile)| search.apart_from_tile(self.corner(k), tile).map(|bound| (bound, k));
        let mut open: Vec<(f64, usize)> = self.tiles.iter().enumerate().filter_map(apart).collect();
        open.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (bound, k) in open {
            if search.is_no_nearer(bound) {
                break;
            }
            search.tile(self.corner(k), &self.tiles[k]);
        }
        let found = search.found?;
        let distance = (search.least - RESOLUTION - solid.rounding()).max(0.0);
        (distance < at_most).then(|| NearestMaterial { distance, place: self.grid.work_from_map() * found })
    }

    /// Column and row of the first line of a tile.
    fn corner(&self, tile: usize) -> [usize; 2] {
        [tile % self.tiles_x() * SIDE, tile / self.tiles_x() * SIDE]
    }

    fn some_material(&self) -> Option<Point3<f64>> {
        let [nx, ny] = self.grid.n_lines();
        let mut lines = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        lines.find_map(|(i, j)| Some(self.grid.in_work(i, j, self.intervals(i, j).next()?.top)))
    }
}

/// A search for the least distance of the undilated solid.
struct Search<'a> {
    grid: &'a DexelGrid,
    solid: &'a Solid,
    solid_from_map: Isometry3<f64>,
    /// Box around the undilated solid, map frame.
    around: Aabb,
    /// Distance at which the search ends, mm.
    enough: f64,
    /// Least distance so far, mm.
    least: f64,
    /// Where it is, map frame.
    found: Option<Point3<f64>>,
}

impl<'a> Search<'a> {
    fn new(
        grid: &'a DexelGrid,
        solid: &'a Solid,
        work_from_solid: &Isometry3<f64>,
        [enough, at_most]: [f64; 2],
    ) -> Self {
        let map_from_solid = grid.work_from_map().inv_mul(work_from_solid);
        let around = solid.dilated(-solid.rounding()).aabb().transformed(&map_from_solid);
        // Material that is not nearer than this by the resolution is not sought.
        let least = at_most + solid.rounding() + RESOLUTION;
        let enough = enough + solid.rounding();
        Self { grid, solid, solid_from_map: map_from_solid.inverse(), around, enough, least, found: None }
    }

    fn is_finite(&self) -> bool {
        let corners = [self.around.min, self.around.max];
        corners.iter().all(|p| p.coords.iter().all(|c| c.is_finite())) && !self.least.is_nan()
    }

    /// Whether what is no nearer to the undilated solid than this changes nothing.
    fn is_no_nearer(&self, distance: f64) -> bool {
        distance >= self.least - RESOLUTION || self.found.is_some() && self.least <= self.enough
    }

    /// Distance from a point of the map's frame to the undilated solid.
    fn distance(&self, p: &Point3<f64>) -> f64 {
        self.solid.core_distance(&(self.solid_from_map * p))
    }

    /// Returns a lower bound on the distance of the undilated solid from a box of the map's frame:
    /// that of its own box; and that of the middle, less the farthest distance from there, because
    /// the distance changes by no more than the motion.
    fn apart(&self, from: &Aabb) -> f64 {
        let gap = (self.around.min - from.max).sup(&(from.min - self.around.max)).sup(&Vector3::zeros()).norm();
        if self.is_no_nearer(gap) { gap } else { gap.max(self.distance(&from.center()) - from.half_extents().norm()) }
    }

    /// The same of all material of a tile; `None` where it is of no interest.
    fn apart_from_tile(&self, [i, j]: [usize; 2], tile: &Tile) -> Option<f64> {
        let [low, high] = tile.bounds();
        if low > high {
            return None;
        }
        let ends = |v: f64| [v, v + (SIDE - 1) as f64 * self.grid.cell()];
        let ([x0, x1], [y0, y1]) = (ends(self.grid.x(i)), ends(self.grid.y(j)));
        let bound = self.apart(&Aabb { min: Point3::new(x0, y0, low), max: Point3::new(x1, y1, high) });
        (!self.is_no_nearer(bound)).then_some(bound)
    }

    fn tile(&mut self, [i0, j0]: [usize; 2], tile: &Tile) {
        for row in 0..SIDE {
            let ([low, high], y) = (tile.row_bounds(row), self.grid.y(j0 + row));
            if low > high {
                continue;
            }
            let min = Point3::new(self.grid.x(i0), y, low);
            let max = Point3::new(self.grid.x(i0 + SIDE - 1), y, high);
            if self.is_no_nearer(self.apart(&Aabb { min, max })) {
                continue;
            }
            for column in 0..SIDE {
                let x = self.grid.x(i0 + column);
                tile.intervals(row * SIDE + column).for_each(|interval| self.material([x, y], interval));
            }
        }
    }

    /// One interval of a line. Along it the distance is convex: between two heights it is nowhere
    /// below the line through the values at two others on one side of them.
    fn material(&mut self, [x, y]: [f64; 2], Interval { bottom, top }: Interval) {
        let at = |z: f64| Point3::new(x, y, z);
        // Farther up and down than this nothing is nearer than what is known.
        let low = bottom.max(self.around.min.z - self.least);
        let high = top.min(self.around.max.z + self.least);
        if low > high || self.is_no_nearer(self.apart(&Aabb { min: at(low), max: at(high) })) {
            return;
        }
        let mut z = [low, low + SHORTER * (high - low), low + LONGER * (high - low), high];
        let mut f = z.map(|z| self.look(&at(z)));
        while z[0] < z[1] && z[1] < z[2] && z[2] < z[3] && !self.is_no_nearer(least_between(&z, &f)) {
            if f[1] < f[2] {
                let new = z[0] + SHORTER * (z[2] - z[0]);
                (z, f) = ([z[0], new, z[1], z[2]], [f[0], self.look(&at(new)), f[1], f[2]]);
            } else {
                let new = z[1] + LONGER * (z[3] - z[1]);
                (z, f) = ([z[1], z[2], new, z[3]], [f[1], f[2], self.look(&at(new)), f[3]]);
            }
        }
    }

    /// Distance at a place with material.
    fn look(&mut self, p: &Point3<f64>) -> f64 {
        let distance = self.distance(p);
        if distance < self.least {
            (self.least, self.found) = (distance, Some(*p));
        }
        distance
    }
}

/// Parts of an interval that divide it so that one of them divides what is left in the same way.
const LONGER: f64 = 0.618_033_988_749_895;
const SHORTER: f64 = 1.0 - LONGER;

/// Returns a lower bound of a convex function between the first and the last of four rising places,
/// from its values there.
fn least_between(z: &[f64; 4], f: &[f64; 4]) -> f64 {
    let slope = |k: usize| (f[k + 1] - f[k]) / (z[k + 1] - z[k]);
    let outer = f[1] - slope(1).max(0.0) * (z[1] - z[0]);
    let outer = outer.min(f[2] + slope(1).min(0.0) * (z[3] - z[2]));
    let from_below = f[1] + slope(0).min(0.0) * (z[2] - z[1]);
    let from_above = f[2] - slope(2).max(0.0) * (z[2] - z[1]);
    outer.min(from_below.max(from_above))
}
