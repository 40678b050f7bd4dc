//! One point in each cell of square lattices across the axes, and where they meet facets and
//! borders.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use facemill_cl_data::{Aabb, mixed_bits};
use facemill_surface_model::TriMesh;
use nalgebra::{Point2, Point3, Unit, Vector3};

use crate::samples::RegionSample;

/// A facet: index, corners, normal.
pub(crate) type Facet = (u32, [Point3<f64>; 3], Unit<Vector3<f64>>);

/// Cells that are looked at, at most, for the area of facets and for their edges: a second of
/// processor time.
const MAX_CELLS: f64 = 4e6;

/// Points on a border, at most.
const MAX_BORDER_POINTS: f64 = 20_000.0;

/// A sample with its place in the order that no mesh decides.
pub(crate) struct LatticePoint {
    axis: usize,
    cell: [i64; 2],
    pub(crate) sample: RegionSample,
}

impl LatticePoint {
    /// Row after row along each axis, from low to high.
    pub(crate) fn order(&self, other: &Self) -> Ordering {
        let along = |p: &Self| p.sample.position[p.axis];
        let cells = (self.axis, self.cell).cmp(&(other.axis, other.cell));
        cells.then(along(self).total_cmp(&along(other)))
    }
}

/// Side of the cells with which facets get one point for each `area_each` (mm²) of them, or as many
/// as can be looked at.
pub(crate) fn side_of(facets: impl Iterator<Item = Facet>, area_each: f64, bounds: Option<&Aabb>) -> f64 {
    let (mut area, mut seen, mut within, mut edges) = (0.0, 0.0, 0.0, 0.0);
    for (_, corners, normal) in facets {
        let axis = normal.iamax();
        let [a, b, c] = corners;
        let facet = 0.5 * (b - a).cross(&(c - a)).norm();
        area += facet;
        seen += facet * normal[axis].abs();
        let [low, high] = extent(&corners, axis, bounds);
        let sides = [0, 1].map(|k| (high[k] - low[k]).max(0.0));
        within += (facet * normal[axis].abs()).min(sides[0] * sides[1]);
        edges += sides[0] + sides[1];
    }
    let even = if area > 0.0 { (area_each * seen / area).sqrt() } else { 1.0 };
    even.max((within / MAX_CELLS).sqrt()).max(edges / MAX_CELLS).max(f64::MIN_POSITIVE)
}

/// The other two axes.
fn plane_of(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Rectangle across an axis around a facet, as far as it is in the bounds.
fn extent(corners: &[Point3<f64>; 3], axis: usize, bounds: Option<&Aabb>) -> [[f64; 2]; 2] {
    let plane = plane_of(axis);
    let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max]
        .map(|f| plane.map(|k| f(f(corners[0][k], corners[1][k]), corners[2][k])));
    match bounds {
        Some(b) => [[0, 1].map(|n| low[n].max(b.min[plane[n]])), [0, 1].map(|n| high[n].min(b.max[plane[n]]))],
        None => [low, high],
    }
}

/// Square cells across each axis, with a point in each.
pub(crate) struct Lattice<'a> {
    side: f64,
    bounds: Option<&'a Aabb>,
}

impl<'a> Lattice<'a> {
    pub(crate) fn new(side: f64, bounds: Option<&'a Aabb>) -> Self {
        Self { side, bounds }
    }

    /// Point of a cell: anywhere in it, and always there.
    fn point(&self, axis: usize, cell: [i64; 2]) -> Point2<f64> {
        let bits = mixed_bits(mixed_bits(mixed_bits(axis as u64) ^ cell[0] as u64) ^ cell[1] as u64);
        let [u, v] = [bits >> 32, bits & 0xffff_ffff].map(|half| (half as f64 + 0.5) / 4_294_967_296.0);
        Point2::new((cell[0] as f64 + u) * self.side, (cell[1] as f64 + v) * self.side)
    }

    fn number(&self, coordinate: f64) -> i64 {
        (coordinate / self.side).floor() as i64
    }

    /// Points of the cells that lie under a facet, on it. Facets that share an edge leave no point
    /// between them out.
    pub(crate) fn on_facet(&self, (triangle, corners, normal): Facet) -> Vec<LatticePoint> {
        let axis = normal.iamax();
        let [k, l] = plane_of(axis);
        let flat = corners.map(|p| Point2::new(p[k], p[l]));
        let [low, high] = extent(&corners, axis, self.bounds);
        let area = self.side * self.side / normal[axis].abs();
        let mut points = Vec::new();
        if low[0] > high[0] || low[1] > high[1] {
            return points;
        }
        for row in self.number(low[1])..=self.number(high[1]) {
            let strip = [row as f64 * self.side, (row + 1) as f64 * self.side];
            let Some([from, to]) = width_in(&flat, strip) else { continue };
            for column in self.number(from.max(low[0]))..=self.number(to.min(high[0])) {
                let Some(weights) = weights(&flat, &self.point(axis, [column, row])) else { continue };
                let position = Point3::from((0..3).fold(Vector3::zeros(), |p, c| p + corners[c].coords * weights[c]));
                let sample = RegionSample { position, normal, triangle, area, length: 0.0 };
                points.push(LatticePoint { axis, cell: [row, column], sample });
            }
        }
        points
    }

    /// Points on the edges that only one of the triangles has, without area: one in each cell along
    /// the axis that is nearest to the edge.
    pub(crate) fn on_border(
        &self,
        mesh: &TriMesh,
        triangles: &[u32],
        normal_of: impl Fn(u32) -> Option<Unit<Vector3<f64>>>,
    ) -> Vec<LatticePoint> {
        let mut edges: BTreeMap<[u32; 2], (u32, usize)> = BTreeMap::new();
        for &t in triangles {
            let [a, b, c] = mesh.triangles()[t as usize];
            for [from, to] in [[a, b], [b, c], [c, a]] {
                edges.entry([from.min(to), from.max(to)]).or_insert((t, 0)).1 += 1;
            }
        }
        let ends = |[a, b]: [u32; 2]| [a, b].map(|v| mesh.vertices()[v as usize]);
        let border: Vec<([Point3<f64>; 2], u32)> =
            edges.iter().filter(|(_, (_, n))| *n == 1).map(|(e, (t, _))| (ends(*e), *t)).collect();
        let length: f64 = border.iter().map(|([a, b], _)| (b - a).norm()).sum();
        let coarse = Self { side: self.side.max(length / MAX_BORDER_POINTS), bounds: None };
        let of_edge = |&(ends, triangle): &([Point3<f64>; 2], u32)| {
            normal_of(triangle).map(|normal| coarse.on_edge(ends, triangle, normal)).unwrap_or_default()
        };
        border.iter().flat_map(of_edge).collect()
    }

    fn on_edge(&self, ends: [Point3<f64>; 2], triangle: u32, normal: Unit<Vector3<f64>>) -> Vec<LatticePoint> {
        let axis = (ends[1] - ends[0]).iamax();
        let [a, b] = if ends[0][axis] <= ends[1][axis] { ends } else { [ends[1], ends[0]] };
        let point = |number: i64| {
            let along = self.point(axis, [number, 0]).x;
            let position = a + (b - a) * ((along - a[axis]) / (b[axis] - a[axis]));
            // Half open, so that edges in a row share no point.
            let is_on = (a[axis]..b[axis]).contains(&along);
            let sample = RegionSample { position, normal, triangle, area: 0.0, length: 0.0 };
            is_on.then_some(LatticePoint { axis, cell: [number, 0], sample })
        };
        (self.number(a[axis])..=self.number(b[axis])).filter_map(point).collect()
    }
}

/// From where to where a triangle goes in a strip of its plane; `None` where it is not in it.
fn width_in(flat: &[Point2<f64>; 3], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let mut width = [f64::INFINITY, f64::NEG_INFINITY];
    let mut take = |x: f64| width = [width[0].min(x), width[1].max(x)];
    for k in 0..3 {
        let (a, b) = (flat[k], flat[(k + 1) % 3]);
        if (low..=high).contains(&a.y) {
            take(a.x);
        }
        for y in [low, high] {
            if (a.y - y) * (b.y - y) < 0.0 {
                take(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
            }
        }
    }
    (width[0] <= width[1]).then_some(width)
}

/// Barycentric coordinates of a point in a triangle of the plane; `None` outside.
fn weights(flat: &[Point2<f64>; 3], p: &Point2<f64>) -> Option<[f64; 3]> {
    let opposite = [0, 1, 2].map(|k| beside(flat[(k + 1) % 3], flat[(k + 2) % 3], p));
    let sum: f64 = opposite.iter().sum();
    let is_in = opposite.iter().all(|&w| w * sum >= 0.0);
    (is_in && sum != 0.0).then(|| opposite.map(|w| w / sum))
}

/// Twice the area of a triangle over an edge, with the same rounding from both sides of the edge.
fn beside(a: Point2<f64>, b: Point2<f64>, p: &Point2<f64>) -> f64 {
    let cross = |a: Point2<f64>, b: Point2<f64>| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    if (a.x, a.y) <= (b.x, b.y) { cross(a, b) } else { -cross(b, a) }
}
