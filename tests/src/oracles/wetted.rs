//! The wetted surface of a propeller as points, cut by written programs: the share of it that is
//! left within a tolerance, with no code of the product.

use nalgebra::{Point3, Vector3};

use crate::oracles::brute::{RoundedCylinder, in_tool};
use crate::oracles::gltf_groups::Group;
use crate::oracles::read_back::TipAndAxis;

/// Edge of the cells that points are found by, mm.
const CELL: f64 = 6.0;

/// Heights along the normal between which the surface may be left, mm.
#[derive(Clone, Copy, Debug)]
pub struct Band {
    /// Above the surface, positive.
    pub above: f64,
    /// Below the surface, positive.
    pub below: f64,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
struct WettedPoint {
    /// Index of its group.
    group: usize,
    /// Area that it is for, mm².
    area: f64,
    /// Place at the upper end of the band.
    above: Point3<f64>,
    /// Place at the lower end of the band.
    below: Point3<f64>,
    /// Least distance that a cutter has had from the upper place, mm; at most 0: it is cut.
    clearance: f64,
    /// Whether a cutter has been at the lower place.
    is_gouged: bool,
}

/// Points of the surface, part's frame.
pub struct Wetted {
    groups: Vec<String>,
    points: Vec<WettedPoint>,
    cells: Cells,
}

/// Areas of a group, mm².
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Share {
    /// Name of the group.
    pub group: String,
    /// All of it.
    pub area: f64,
    /// Left above the band.
    pub above: f64,
    /// Of that, farther than 1 mm from every place of a cutter.
    pub uncut: f64,
    /// Cut below the band.
    pub below: f64,
}

impl Wetted {
    /// Points of the groups, each for at most `patch` mm²; the area of a group counts as often as
    /// `weight` says, and not at all with 0.
    pub fn of(groups: &[Group], weight: impl Fn(&str) -> f64, band: Band, patch: f64) -> Self {
        let mut points = Vec::new();
        for (k, (name, triangles)) in groups.iter().enumerate() {
            let weight = weight(name);
            if weight > 0.0 {
                points.extend(triangles.iter().flat_map(|t| points_of(t, k, weight, band, patch)));
            }
        }
        let cells = Cells::new(&points);
        Self { groups: groups.iter().map(|g| g.0.clone()).collect(), points, cells }
    }

    /// Cuts the points by a cutter at places, part's frame.
    pub fn cut(&mut self, cutter: &RoundedCylinder, places: &[TipAndAxis]) {
        let Self { points, cells, .. } = self;
        let reach = cutter.radius.hypot(0.5 * cutter.height) + 1.0;
        for (tip, axis) in places {
            let center = tip + axis.into_inner() * (0.5 * cutter.height);
            cells.near(&center, reach, |k| {
                let p = &mut points[k as usize];
                let distance = |place: &Point3<f64>| {
                    let (rho, z) = in_tool(tip, axis, place);
                    cutter.signed_distance(rho, z)
                };
                p.clearance = p.clearance.min(distance(&p.above));
                p.is_gouged |= distance(&p.below) < 0.0;
            });
        }
    }

    /// Areas of each group that has points.
    pub fn shares(&self) -> Vec<Share> {
        let mut shares: Vec<Share> =
            self.groups.iter().map(|group| Share { group: group.clone(), ..Share::default() }).collect();
        for p in &self.points {
            let share = &mut shares[p.group];
            share.area += p.area;
            share.above += if p.clearance > 0.0 { p.area } else { 0.0 };
            share.uncut += if p.clearance > 1.0 { p.area } else { 0.0 };
            share.below += if p.is_gouged { p.area } else { 0.0 };
        }
        shares.retain(|share| share.area > 0.0);
        shares
    }

    /// Places that are left above the band, on the surface's upper end of it, with the index of
    /// their group and the distance of the nearest cutter.
    pub fn left(&self) -> impl Iterator<Item = (&str, Point3<f64>, f64)> {
        let left = self.points.iter().filter(|p| p.clearance > 0.0);
        left.map(|p| (self.groups[p.group].as_str(), p.above, p.clearance))
    }
}

/// Points in the middles of equal parts of a triangle.
fn points_of([a, b, c]: &[Point3<f64>; 3], group: usize, weight: f64, band: Band, patch: f64) -> Vec<WettedPoint> {
    let twice = (b - a).cross(&(c - a));
    let Some(normal) = twice.try_normalize(0.0) else { return Vec::new() };
    let area = 0.5 * twice.norm();
    let n = (area / patch).sqrt().ceil().max(1.0) as usize;
    let at = |u: f64, v: f64| a + (b - a) * (u / n as f64) + (c - a) * (v / n as f64);
    let point = |place: Point3<f64>| WettedPoint {
        group,
        area: weight * area / (n * n) as f64,
        above: place + normal * band.above,
        below: place - normal * band.below,
        clearance: f64::INFINITY,
        is_gouged: false,
    };
    let third = 1.0 / 3.0;
    let mut points = Vec::with_capacity(n * n);
    for i in 0..n {
        for j in 0..n - i {
            let (u, v) = (i as f64, j as f64);
            points.push(point(at(u + third, v + third)));
            if i + j + 1 < n {
                points.push(point(at(u + 2.0 * third, v + 2.0 * third)));
            }
        }
    }
    points
}

/// Points by cubes of space.
struct Cells {
    low: Point3<f64>,
    n: [usize; 3],
    /// Where the points of each cell begin in `order`, and where those of the last end.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Cells {
    fn new(points: &[WettedPoint]) -> Self {
        let bound = |of: fn(f64, f64) -> f64, from: f64| {
            points.iter().fold(Vector3::repeat(from), |b, p| b.zip_map(&p.above.coords, of))
        };
        let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let low = Point3::from(low);
        let n = [0, 1, 2].map(|c| if points.is_empty() { 1 } else { ((high[c] - low[c]) / CELL) as usize + 1 });
        let cell = |p: &Point3<f64>| {
            let [i, j, k] = [0, 1, 2].map(|c| ((p[c] - low[c]) / CELL) as usize);
            (k * n[1] + j) * n[0] + i
        };
        let mut starts = vec![0; n[0] * n[1] * n[2] + 1];
        for p in points {
            starts[cell(&p.above) + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by_key(|&k| cell(&points[k as usize].above));
        Self { low, n, starts, order }
    }

    /// Calls `f` for the points of all cells that a cube of this half edge about a place meets.
    fn near(&self, center: &Point3<f64>, reach: f64, mut f: impl FnMut(u32)) {
        let span = |c: usize| {
            let at = |x: f64| ((x - self.low[c]) / CELL).floor();
            let (low, high) = (at(center[c] - reach).max(0.0), at(center[c] + reach) + 1.0);
            low as usize..(high.max(0.0) as usize).min(self.n[c])
        };
        let (columns, rows) = (span(0), span(1));
        if columns.is_empty() {
            return;
        }
        for k in span(2) {
            for j in rows.clone() {
                let row = (k * self.n[1] + j) * self.n[0];
                let range = self.starts[row + columns.start] as usize..self.starts[row + columns.end] as usize;
                self.order[range].iter().for_each(|&k| f(k));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;

    /// A plate of 40 × 20 mm, cut along lines 2 mm apart by a ball of 5 mm radius on one half only.
    #[test]
    fn a_plate_cut_on_one_half_is_left_on_the_other() {
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let plate = vec![[p(0.0, 0.0), p(40.0, 0.0), p(40.0, 20.0)], [p(0.0, 0.0), p(40.0, 20.0), p(0.0, 20.0)]];
        let groups = [("plate".to_owned(), plate.clone()), ("other".to_owned(), plate)];
        let of = |above: f64| {
            let band = Band { above, below: 0.06 };
            Wetted::of(&groups, |name| f64::from(u8::from(name == "plate")), band, 0.05)
        };
        let cutter = RoundedCylinder { radius: 5.0, corner: 5.0, height: 20.0 };
        let places = |depth: f64| -> Vec<TipAndAxis> {
            let lines = (0..=10).flat_map(|j| (0..=400).map(move |i| (0.05 * f64::from(i), 2.0 * f64::from(j))));
            lines.map(|(x, y)| (Point3::new(x, y, -depth), Vector3::z_axis())).collect()
        };
        // Ridges between lines are 5 - sqrt(24) = 0.101 mm high.
        let mut within = of(0.12);
        within.cut(&cutter, &places(0.05));
        let [share] = &within.shares()[..] else { panic!("one group") };
        assert!((share.area - 800.0).abs() < 1e-6 && share.below == 0.0, "{share:?}");
        // The ball meets the band 1.29 mm beyond its last place, 0.17 mm above its lowest point.
        assert!((share.above - (400.0 - 20.0 * 1.29)).abs() < 8.0, "{share:?}");
        assert!(share.uncut > 300.0 && share.uncut < share.above, "{share:?}");
        assert!(within.left().all(|(group, place, _)| group == "plate" && place.x > 20.0));
        // Ridges above the band: at 0.03 mm, the ball is 0.548 mm from its line's middle.
        let mut ridged = of(0.03);
        ridged.cut(&cutter, &places(0.0));
        let above = ridged.shares()[0].above;
        assert!((above - (800.0 - 400.0 * 0.548)).abs() < 15.0, "{above}");
        let mut deep = of(0.12);
        deep.cut(&cutter, &places(0.1));
        assert!(deep.shares()[0].below > 200.0, "{:?}", deep.shares());
        let aside = Unit::new_normalize(Vector3::x());
        let mut none = of(0.12);
        none.cut(&cutter, &[(Point3::new(200.0, 0.0, 300.0), aside), (Point3::new(-80.0, -90.0, 0.0), -aside)]);
        assert!((none.shares()[0].uncut - 800.0).abs() < 1e-6);
    }
}
