//! Raising the nodes of a grid to a triangle.

use nalgebra::Point3;
use pulp::NullaryFnOnce;

use crate::raster::{Grid, height_over, width_at};

/// The nodes of a grid, with what locating them takes.
#[derive(Clone, Copy)]
pub(crate) struct Lattice {
    x0: f64,
    y0: f64,
    cell: f64,
    per_cell: f64,
    /// Largest index along x and y.
    last: [i32; 2],
    /// Margin of the rows and columns of a triangle, in cells: covers the rounding of their
    /// computation. Smaller than that, nodes on an edge could be missed; larger costs the test of a
    /// node now and then.
    margin: f64,
}

/// Columns and rows of the nodes that may be under or over a triangle, both ends included.
#[derive(Clone, Copy)]
pub(crate) struct NodeWindow {
    columns: [i32; 2],
    /// Rows.
    pub(crate) rows: [i32; 2],
}

/// Least margin, in cells.
const LEAST_MARGIN: f64 = 1e-6;

/// Columns of nodes from which a row of a triangle is looked at between its edges only: dividing
/// pays from here on.
const WIDE: i32 = 6;

/// Corners of a triangle where the mesh has them: copied first, they cost as much as the rest.
pub(crate) type Corners<'a> = [&'a Point3<f64>; 3];

/// Nodes side by side.
const LANES: usize = 4;

/// Twice the area of a triangle's projection, as part of the square of its extent, below which it
/// is looked at with care: far above the rounding (some 1e-15), so that above it no node is beyond
/// all three edges.
const SLIVER: f64 = 1e-12;

/// Raising nodes to triangles where they are below them.
///
/// Of its own type, because of a closure called by [`pulp::Arch::dispatch`] only a shell would get
/// the vector instructions.
pub(crate) struct Raise<'a, I> {
    pub(crate) lattice: Lattice,
    pub(crate) triangles: I,
    /// Row of the first of `nodes`, which are whole rows.
    pub(crate) first_row: usize,
    pub(crate) nodes: &'a mut [f64],
}

impl<'t, I: Iterator<Item = Corners<'t>>> NullaryFnOnce for Raise<'_, I> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for t in self.triangles {
            self.lattice.raise(&t, self.first_row as i32, self.nodes);
        }
    }
}

impl Lattice {
    pub(crate) fn new(grid: &Grid) -> Self {
        let per_cell = 1.0 / grid.cell;
        // A map has at most 2²⁵ cells.
        let last = [grid.nx as i32, grid.ny as i32];
        let margin = LEAST_MARGIN + grid.slack * per_cell;
        Self { x0: grid.x0, y0: grid.y0, cell: grid.cell, per_cell, last, margin }
    }

    /// Number of nodes of a row.
    #[inline(always)]
    fn n(&self) -> usize {
        self.last[0] as usize + 1
    }

    #[inline(always)]
    fn x(&self, i: f64) -> f64 {
        self.x0 + self.cell * i
    }

    #[inline(always)]
    fn y(&self, j: i32) -> f64 {
        self.y0 + self.cell * f64::from(j)
    }

    /// Indices of the nodes between two coordinates of an axis that starts at `from`, for a range
    /// within the grid.
    #[inline(always)]
    fn between(&self, low: f64, high: f64, from: f64, last: i32) -> [i32; 2] {
        let first = nearest((low - from) * self.per_cell - self.margin + 0.5);
        let end = nearest((high - from) * self.per_cell + self.margin - 0.5);
        [first.max(0), end.min(last)]
    }

    /// Nodes that may be under or over a triangle of the mesh; `None` where there are none.
    #[inline(always)]
    pub(crate) fn window(&self, t: &Corners) -> Option<NodeWindow> {
        let columns = self.between(least(t, 0), largest(t, 0), self.x0, self.last[0]);
        let rows = self.between(least(t, 1), largest(t, 1), self.y0, self.last[1]);
        (columns[0] <= columns[1] && rows[0] <= rows[1]).then_some(NodeWindow { columns, rows })
    }

    /// Raises nodes to the triangle where they are below it; `nodes` are whole rows from
    /// `first_row` on.
    ///
    /// A node is under or over a triangle when it is on the inner side of all three edges or on
    /// them. Both triangles at an edge compute its side of a node alike, so that a node on an edge
    /// cannot fall outside of both.
    #[inline(always)]
    fn raise(&self, t: &Corners, first_row: i32, nodes: &mut [f64]) {
        let Some(mut window) = self.window(t) else { return };
        let last_row = first_row + (nodes.len() / self.n()) as i32 - 1;
        window.rows = [window.rows[0].max(first_row), window.rows[1].min(last_row)];
        let Some(facet) = Facet::new(t) else { return self.raise_to_sliver(t, &window, first_row, nodes) };
        if window.columns[1] - window.columns[0] >= WIDE {
            return self.raise_between_edges(&facet, &window, first_row, nodes);
        }
        let [first, last] = window.columns.map(|i| i as usize);
        for j in window.rows[0]..=window.rows[1] {
            let at_row = facet.at_row(self.y(j));
            let row = &mut nodes[(j - first_row) as usize * self.n()..][..self.n()];
            for (k, height) in (window.columns[0]..).zip(&mut row[first..=last]) {
                let weights = facet.weights(&at_row, self.x(f64::from(k)));
                if is_inside(&weights) {
                    let z = facet.height(&weights);
                    *height = if z > *height { z } else { *height };
                }
            }
        }
    }

    /// The same where the window is wide: of each row only what is between the edges, several nodes
    /// at a time.
    #[inline(always)]
    fn raise_between_edges(&self, facet: &Facet, window: &NodeWindow, first_row: i32, nodes: &mut [f64]) {
        let crossings = facet.crossings();
        let bounds = window.columns.map(|i| self.x(f64::from(i)));
        for j in window.rows[0]..=window.rows[1] {
            let at_row = facet.at_row(self.y(j));
            let [left, right] = facet.span(&at_row, &crossings, bounds);
            let [first, last] = self.between(left, right, self.x0, self.last[0]);
            if first <= last {
                let row = &mut nodes[(j - first_row) as usize * self.n()..][..self.n()];
                self.raise_row(facet, &at_row, first, &mut row[first as usize..=last as usize]);
            }
        }
    }

    /// Raises a run of nodes that begins at the column `first`.
    #[inline(always)]
    fn raise_row(&self, facet: &Facet, at_row: &[f64; 3], first: i32, nodes: &mut [f64]) {
        let mut i = f64::from(first);
        let raised = |i: f64, height: f64| {
            let weights = facet.weights(at_row, self.x(i));
            let z = facet.height(&weights);
            if is_inside(&weights) & (z > height) { z } else { height }
        };
        let mut runs = nodes.chunks_exact_mut(LANES);
        for run in &mut runs {
            let mut heights = [0.0; LANES];
            for k in 0..LANES {
                heights[k] = raised(i + k as f64, run[k]);
            }
            run.copy_from_slice(&heights);
            i += LANES as f64;
        }
        for height in runs.into_remainder() {
            *height = raised(i, *height);
            i += 1.0;
        }
    }

    /// The same for a triangle whose projection is nearly or wholly without area.
    #[cold]
    fn raise_to_sliver(&self, t: &Corners, window: &NodeWindow, first_row: i32, nodes: &mut [f64]) {
        let (low, high) = (least(t, 1), largest(t, 1));
        let t = &t.map(|p| *p);
        for j in window.rows[0]..=window.rows[1] {
            let y = self.y(j);
            if !(low <= y && y <= high) {
                continue;
            }
            // A long sliver crosses a row in a node or two of thousands.
            let [left, right] = width_at(t, y);
            let [first, last] = self.between(left - self.cell, right + self.cell, self.x0, self.last[0]);
            for i in first.max(window.columns[0])..=last.min(window.columns[1]) {
                let height = &mut nodes[(j - first_row) as usize * self.n() + i as usize];
                if let Some(z) = height_over(t, self.x(f64::from(i)), y) {
                    *height = height.max(z);
                }
            }
        }
    }
}

/// The whole number nearest to one of magnitude below 2³¹: in a double of this size the last place
/// is a whole one.
#[inline(always)]
fn nearest(v: f64) -> i32 {
    const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
    (v + WHOLE).to_bits() as i32
}

#[inline(always)]
fn least(t: &Corners, axis: usize) -> f64 {
    let less = |a: f64, b: f64| if a < b { a } else { b };
    less(less(t[0][axis], t[1][axis]), t[2][axis])
}

#[inline(always)]
fn largest(t: &Corners, axis: usize) -> f64 {
    let more = |a: f64, b: f64| if a > b { a } else { b };
    more(more(t[0][axis], t[1][axis]), t[2][axis])
}

#[inline(always)]
fn is_inside([a, b, c]: &[f64; 3]) -> bool {
    (*a >= 0.0) & (*b >= 0.0) & (*c >= 0.0)
}

/// A triangle whose projection has an area.
struct Facet {
    /// The edges opposite the corners.
    edges: [Edge; 3],
    z: [f64; 3],
    low: f64,
    high: f64,
}

impl Facet {
    /// `None` where the projection has hardly any area.
    #[inline(always)]
    fn new(t: &Corners) -> Option<Self> {
        let (u, v) = (t[1] - t[0], t[2] - t[0]);
        let area = u.x * v.y - u.y * v.x;
        let (width, height) = (largest(t, 0) - least(t, 0), largest(t, 1) - least(t, 1));
        let size = if width > height { width } else { height };
        let has_area = area.abs() > SLIVER * size * size;
        if !has_area {
            return None;
        }
        let facing = 1f64.copysign(area);
        let edges = [Edge::new(t[1], t[2], facing), Edge::new(t[2], t[0], facing), Edge::new(t[0], t[1], facing)];
        Some(Self { edges, z: [t[0].z, t[1].z, t[2].z], low: least(t, 2), high: largest(t, 2) })
    }

    /// The part of the weights that is the same along a row.
    #[inline(always)]
    fn at_row(&self, y: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.edges[k].dx * (y - self.edges[k].ay))
    }

    /// Weights of the corners at x: twice the areas opposite them, negative beyond an edge.
    #[inline(always)]
    fn weights(&self, at_row: &[f64; 3], x: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| at_row[k] - self.edges[k].dy * (x - self.edges[k].ax))
    }

    #[inline(always)]
    fn height(&self, [a, b, c]: &[f64; 3]) -> f64 {
        let z = (a * self.z[0] + b * self.z[1] + c * self.z[2]) / (a + b + c);
        let z = if z < self.low { self.low } else { z };
        if z > self.high { self.high } else { z }
    }

    /// Returns the factors of [`Facet::span`].
    #[inline(always)]
    fn crossings(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| 1.0 / self.edges[k].dy)
    }

    /// Smallest and largest x of a row on the inner side of the edges, within bounds; up to
    /// rounding.
    #[inline(always)]
    fn span(&self, at_row: &[f64; 3], crossings: &[f64; 3], bounds: [f64; 2]) -> [f64; 2] {
        let [mut left, mut right] = bounds;
        for k in 0..3 {
            // Along an edge that is parallel to the row this is no number or no bound.
            let x = self.edges[k].ax + at_row[k] * crossings[k];
            left = if (self.edges[k].dy < 0.0) & (x > left) { x } else { left };
            right = if (self.edges[k].dy > 0.0) & (x < right) { x } else { right };
        }
        // Of a row beyond the triangle nothing is left; what is out of range must not be counted in
        // columns.
        [if left > bounds[1] { bounds[1] } else { left }, if right < bounds[0] { bounds[0] } else { right }]
    }
}

/// An edge of the projection, computed from its smaller end to the larger one: so that both
/// triangles at it round alike.
#[derive(Clone, Copy)]
struct Edge {
    ax: f64,
    ay: f64,
    /// Toward the other end, or away from it: so that the inner side is the positive one.
    dx: f64,
    dy: f64,
}

impl Edge {
    #[inline(always)]
    fn new(a: &Point3<f64>, b: &Point3<f64>, facing: f64) -> Self {
        let is_turned = (b.x < a.x) | ((b.x == a.x) & (b.y < a.y));
        let (from, to) = if is_turned { (b, a) } else { (a, b) };
        let sign = if is_turned { -facing } else { facing };
        Self { ax: from.x, ay: from.y, dx: sign * (to.x - from.x), dy: sign * (to.y - from.y) }
    }
}
