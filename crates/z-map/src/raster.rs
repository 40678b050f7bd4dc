//! Regular grid of a Z-map, and triangles raised on it.

use nalgebra::Point3;

/// The regular grid of a Z-map in its own frame: cell (i, j) is between the nodes (i, j) and (i +
/// 1, j + 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    pub(crate) x0: f64,
    pub(crate) y0: f64,
    pub(crate) cell: f64,
    /// Number of cells along x.
    pub(crate) nx: usize,
    /// Number of cells along y.
    pub(crate) ny: usize,
    /// Largest motion of a point of the mesh by rounding, mm: cells are taken larger by it and
    /// their maxima higher.
    pub(crate) slack: f64,
}

impl Grid {
    pub(crate) fn node_x(&self, i: usize) -> f64 {
        self.x0 + self.cell * i as f64
    }

    pub(crate) fn node_y(&self, j: usize) -> f64 {
        self.y0 + self.cell * j as f64
    }

    /// Column of a point, clamped to the grid; the first one for NaN.
    pub(crate) fn column(&self, x: f64) -> usize {
        (((x - self.x0) / self.cell) as usize).min(self.nx - 1)
    }

    /// Row of a point, clamped to the grid; the first one for NaN.
    pub(crate) fn row(&self, y: f64) -> usize {
        (((y - self.y0) / self.cell) as usize).min(self.ny - 1)
    }

    /// Rows of cells that a triangle has points in, both ends included.
    pub(crate) fn rows(&self, triangle: &[Point3<f64>; 3]) -> [usize; 2] {
        let [low, high] = extent(triangle, 1);
        [self.row(low - self.slack), self.row(high + self.slack)]
    }
}

/// Some rows of cells, from `first_row` on, to be raised by triangles.
pub(crate) struct Band<'a> {
    pub(crate) grid: Grid,
    pub(crate) first_row: usize,
    /// Maxima of the cells, row by row.
    pub(crate) cells: &'a mut [f64],
}

impl Band<'_> {
    /// Raises cells to the triangle where they are below it.
    pub(crate) fn add(&mut self, triangle: &[Point3<f64>; 3]) {
        let (grid, n) = (self.grid, self.grid.nx);
        let rows = grid.rows(triangle);
        for j in rows[0].max(self.first_row)..=rows[1] {
            let Some(row) = self.cells.get_mut((j - self.first_row) * n..(j - self.first_row + 1) * n) else { break };
            let strip = [grid.node_y(j) - grid.slack, grid.node_y(j + 1) + grid.slack];
            let part = Polygon::new(triangle).clipped(1, strip);
            let Some([left, right]) = part.extent(0) else { continue };
            let highest = part.top() + grid.slack;
            let columns = [grid.column(left - grid.slack), grid.column(right + grid.slack)];
            for (i, max) in row.iter_mut().enumerate().take(columns[1] + 1).skip(columns[0]) {
                if highest > *max {
                    let cell = [grid.node_x(i) - grid.slack, grid.node_x(i + 1) + grid.slack];
                    *max = max.max(part.clipped(0, cell).top() + grid.slack);
                }
            }
        }
    }
}

pub(crate) fn extent(points: &[Point3<f64>], axis: usize) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
}

/// Smallest and largest x of the triangle's projection at y, up to rounding.
pub(crate) fn width_at(triangle: &[Point3<f64>; 3], y: f64) -> [f64; 2] {
    edges(triangle).fold([f64::INFINITY, f64::NEG_INFINITY], |[left, right], (a, b)| {
        if (a.y < y && b.y < y) || (a.y > y && b.y > y) {
            return [left, right];
        }
        let x = if a.y == b.y {
            [a.x.min(b.x), a.x.max(b.x)]
        } else {
            let x = a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
            [x, x]
        };
        [left.min(x[0]), right.max(x[1])]
    })
}

fn edges(t: &[Point3<f64>; 3]) -> impl Iterator<Item = (Point3<f64>, Point3<f64>)> + use<> {
    [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].into_iter()
}

/// Height of a triangle over (x, y), its border included; the largest one where it is vertical.
pub(crate) fn height_over(t: &[Point3<f64>; 3], x: f64, y: f64) -> Option<f64> {
    let weights = [side(&t[1], &t[2], x, y), side(&t[2], &t[0], x, y), side(&t[0], &t[1], x, y)];
    if !(weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0)) {
        return None;
    }
    let sum: f64 = weights.iter().sum();
    if sum == 0.0 {
        return edges(t).filter_map(|(a, b)| height_on_edge(&a, &b, x, y)).reduce(f64::max);
    }
    let z = (weights[0] * t[0].z + weights[1] * t[1].z + weights[2] * t[2].z) / sum;
    let [low, high] = extent(t, 2);
    Some(z.clamp(low, high))
}

/// Twice the area of the projected triangle a, b, (x, y), with the same rounding, and just the
/// opposite sign, for the edge from b to a: so a point on an edge that two triangles share cannot
/// fall outside of both.
fn side(a: &Point3<f64>, b: &Point3<f64>, x: f64, y: f64) -> f64 {
    if (b.x, b.y) < (a.x, a.y) {
        return -side(b, a, x, y);
    }
    (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
}

/// Height over (x, y), which is on the line of the projected edge, if it is between its ends.
fn height_on_edge(a: &Point3<f64>, b: &Point3<f64>, x: f64, y: f64) -> Option<f64> {
    let axis = usize::from((b.y - a.y).abs() > (b.x - a.x).abs());
    let (at, from, to) = ([x, y][axis], a[axis], b[axis]);
    if !(from.min(to) <= at && at <= from.max(to)) {
        return None;
    }
    if from == to {
        // The edge is a point of the projection.
        return ([x, y] == [a.x, a.y]).then(|| a.z.max(b.z));
    }
    Some((a.z + (b.z - a.z) * ((at - from) / (to - from))).clamp(a.z.min(b.z), a.z.max(b.z)))
}

/// A triangle clipped by up to four planes.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [Point3<f64>; Self::MOST_CORNERS],
    n: usize,
}

impl Polygon {
    /// Of a convex polygon a clip adds one corner, so four make 7. A sliver may be no longer convex
    /// by rounding: even then a clip leaves at most half as many corners again, 3, 4, 6, 9, 13.
    const MOST_CORNERS: usize = 13;

    fn new(triangle: &[Point3<f64>; 3]) -> Self {
        let mut corners = [triangle[0]; Self::MOST_CORNERS];
        corners[..3].copy_from_slice(triangle);
        Self { corners, n: 3 }
    }

    fn corners(&self) -> &[Point3<f64>] {
        &self.corners[..self.n]
    }

    /// Smallest and largest coordinate; `None` for nothing.
    fn extent(&self, axis: usize) -> Option<[f64; 2]> {
        (self.n > 0).then(|| extent(self.corners(), axis))
    }

    /// Largest z; −∞ for nothing.
    fn top(&self) -> f64 {
        self.corners().iter().fold(f64::NEG_INFINITY, |top, p| top.max(p.z))
    }

    /// The part with a coordinate between two bounds, both included.
    fn clipped(&self, axis: usize, bounds: [f64; 2]) -> Self {
        let Some([low, high]) = self.extent(axis) else { return *self };
        let mut part = *self;
        if low < bounds[0] {
            part = part.clipped_by(|p| p[axis] - bounds[0]);
        }
        if high > bounds[1] {
            part = part.clipped_by(|p| bounds[1] - p[axis]);
        }
        part
    }

    /// The part where `inside`, a linear function, is not negative.
    fn clipped_by(&self, inside: impl Fn(&Point3<f64>) -> f64) -> Self {
        let mut part = Self { n: 0, ..*self };
        for (k, b) in self.corners().iter().enumerate() {
            let a = &self.corners[(k + self.n - 1) % self.n];
            let (at_a, at_b) = (inside(a), inside(b));
            if (at_a < 0.0) != (at_b < 0.0) {
                part.push(a + (b - a) * (at_a / (at_a - at_b)));
            }
            if at_b >= 0.0 {
                part.push(*b);
            }
        }
        part
    }

    fn push(&mut self, p: Point3<f64>) {
        self.corners[self.n] = p;
        self.n += 1;
    }
}
