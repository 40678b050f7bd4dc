//! Part of a level that an upright cutter sweeps, on a lattice.

use std::f64::consts::FRAC_1_SQRT_2;

use facemill_surface_model::{Group, TriMesh};
use nalgebra::{Point2, Point3};

use crate::kept_off::KeptOff;
use crate::nodes::NodeLattice;
use crate::plane::LevelPlane;
use crate::room::LevelRoom;

/// Cells of the lattice across the flat bottom's radius: an uncertain border of a tenth of it.
const CELLS_PER_RIM: f64 = 12.0;

/// Largest number of cells over the stock: a mesh of two triangles for each.
const MOST_CELLS: f64 = 100_000.0;

/// Nodes along a cell for what the cutter may reach, an even number: a border of a sixth of a cell
/// stays uncertain.
const FINER: usize = 8;

/// Name of the group of the swept part.
const GROUP: &str = "level";

/// Lattice over a level: nodes where the cutter's tip may be, and cells that its flat bottom sweeps
/// from there.
///
/// Guarantee: every cell that counts as swept lies within the flat bottom at a node where the
/// cutter fits, or has room for the tip at all four corners. Cells at the border of what can be
/// swept may count as not swept.
pub struct Reach {
    plane: LevelPlane,
    lattice: NodeLattice,
    /// First cell over the stock, and number of these cells along x and y.
    first: [usize; 2],
    cells: [usize; 2],
    swept: Vec<bool>,
}

impl Reach {
    /// Returns the reach of a cutter over a rectangle of the level (level's frame: least and
    /// largest coordinates), around which its tip may be, too.
    pub fn new(room: &LevelRoom<'_>, [low, high]: [[f64; 2]; 2]) -> Self {
        let size = [0, 1].map(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let rim = room.rim_radius();
        let by_number = (size[0] * size[1] / MOST_CELLS).sqrt().max(size[0].max(size[1]) / MOST_CELLS);
        let cell = (rim / CELLS_PER_RIM).max(by_number).max(f64::MIN_POSITIVE);
        let beyond = (rim / cell).ceil() as usize + 1;
        let cells = size.map(|s| (s / cell).ceil().clamp(1.0, MOST_CELLS) as usize);
        let nodes = cells.map(|n| n + 1 + 2 * beyond);
        let origin = Point2::new(low[0] - beyond as f64 * cell, low[1] - beyond as f64 * cell);
        let lattice = NodeLattice::new(room, origin, cell, nodes, 0.0);
        let mut reach = Self { plane: *room.plane(), lattice, first: [beyond; 2], cells, swept: Vec::new() };
        reach.swept = reach.sweep(rim);
        reach
    }

    /// Returns the side of a cell, mm.
    pub fn cell(&self) -> f64 {
        self.lattice.cell
    }

    /// Returns the swept cells as a mesh of one group, facing up, workpiece frame; without
    /// triangles where nothing can be swept.
    pub fn swept_mesh(&self) -> TriMesh {
        let row = self.cells[0] + 1;
        let mut index = vec![u32::MAX; row * (self.cells[1] + 1)];
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for (i, j) in self.all_cells().filter(|&(i, j)| self.swept[j * self.cells[0] + i]) {
            let mut vertex = |i: usize, j: usize| {
                let known = &mut index[j * row + i];
                if *known == u32::MAX {
                    *known = vertices.len() as u32;
                    vertices.push(self.node(self.first[0] + i, self.first[1] + j));
                }
                *known
            };
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let groups = vec![Group { name: GROUP.to_owned(), triangles: 0..triangles.len() }];
        TriMesh::with_groups(vertices, triangles, groups).unwrap_or_default()
    }

    /// Iterates over the middles of all cells over the stock, in their order, with whether they are
    /// swept.
    pub fn middles(&self) -> impl Iterator<Item = (Point3<f64>, bool)> + '_ {
        self.all_cells().map(|(i, j)| {
            let (x, y) = self.middle(i, j);
            (self.plane.at(x, y), self.swept[j * self.cells[0] + i])
        })
    }

    /// Returns the area (mm²) of the cells for whose indices, in the order of [`Reach::middles`], a
    /// condition holds.
    pub fn area(&self, holds: impl Fn(usize) -> bool) -> f64 {
        (0..self.swept.len()).filter(|&k| holds(k)).count() as f64 * self.cell() * self.cell()
    }

    /// Returns whether a cell is swept, by its index.
    pub fn is_swept(&self, k: usize) -> bool {
        self.swept[k]
    }

    /// Returns for each cell, in the order of [`Reach::middles`], whether its middle may be swept
    /// from any place of the level, on the lattice or not.
    ///
    /// Guarantee: a middle for which it returns `false` cannot be swept by the cutter in this room.
    pub fn may_be_swept(&self, room: &LevelRoom<'_>) -> Vec<bool> {
        let nodes = self.lattice.nodes.map(|n| (n - 1) * FINER + 1);
        let cell = self.cell() / FINER as f64;
        // Each tip is within half a diagonal of a node: where the cutter fits there, the narrower
        // one fits at the node.
        let apart = cell * FRAC_1_SQRT_2;
        let lattice = NodeLattice::new(room, self.lattice.origin, cell, nodes, apart);
        let mut may = self.swept.clone();
        for (k, (i, j)) in self.all_cells().enumerate() {
            let [i, j] = [self.first[0] + i, self.first[1] + j].map(|n| n * FINER + FINER / 2);
            may[k] |= lattice.fits_at(i, j);
        }
        self.cover(&mut may, &lattice, room.rim_radius() + apart);
        may
    }

    /// Returns the places of the tip from which a cutter of a radius (mm) meets too much material:
    /// a swept cell for whose index, in the order of [`Reach::middles`], `is_tall` holds.
    ///
    /// Strips of such cells not wider than twice the error of the material's side (mm) do not
    /// count: a bound of stock has them beside walls.
    pub fn kept_off(&self, is_tall: &[bool], error: f64, radius: f64) -> KeptOff {
        let [nx, ny] = self.cells;
        let is_tall = |i: usize, j: usize| is_tall[j * nx + i] && self.swept[j * nx + i];
        let most = error / self.cell();
        let around = |c: usize, n: usize| c.saturating_sub(most as usize)..(c + most as usize + 1).min(n);
        let is_wide = |&(i, j): &(usize, usize)| {
            let near = |a: usize, b: usize| (a as f64 - i as f64).hypot(b as f64 - j as f64) <= most;
            around(j, ny).all(|b| around(i, nx).all(|a| !near(a, b) || is_tall(a, b)))
        };
        let [n, m] = self.lattice.nodes;
        let mut is_off = vec![false; n * m];
        // Opposite sides of cells and of steps between nodes count, too.
        let within = radius + error + 2.0 * self.cell();
        let beyond = (within / self.cell()).ceil() as usize;
        for (i, j) in self.all_cells().filter(|&(i, j)| is_tall(i, j)).filter(is_wide) {
            let [i, j] = [i + self.first[0], j + self.first[1]];
            for b in j.saturating_sub(beyond)..(j + beyond + 1).min(m) {
                for a in i.saturating_sub(beyond)..(i + beyond + 1).min(n) {
                    let apart = (a as f64 - i as f64 - 0.5).hypot(b as f64 - j as f64 - 0.5) * self.cell();
                    is_off[b * n + a] |= apart <= within;
                }
            }
        }
        KeptOff { origin: self.lattice.origin, cell: self.cell(), nodes: self.lattice.nodes, is_off }
    }

    /// Returns the number of nodes along x and y.
    pub(crate) fn nodes(&self) -> [usize; 2] {
        self.lattice.nodes
    }

    /// Returns the position of a node, workpiece frame.
    pub(crate) fn node(&self, i: usize, j: usize) -> Point3<f64> {
        let [x, y] = self.lattice.at(i, j);
        self.plane.at(x, y)
    }

    /// Returns whether the cutter fits with its tip at a node.
    pub(crate) fn fits_at(&self, i: usize, j: usize) -> bool {
        self.lattice.fits_at(i, j)
    }

    fn all_cells(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let [nx, ny] = self.cells;
        (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)))
    }

    /// Coordinates of the middle of a cell, level's frame.
    fn middle(&self, i: usize, j: usize) -> (f64, f64) {
        let at = |k: usize, n: usize| self.lattice.origin[k] + ((self.first[k] + n) as f64 + 0.5) * self.cell();
        (at(0, i), at(1, j))
    }

    /// Returns the cells that the flat bottom covers from nodes where the cutter fits.
    fn sweep(&self, rim: f64) -> Vec<bool> {
        let [nx, ny] = self.cells;
        let mut swept = vec![false; nx * ny];
        for (i, j) in self.all_cells() {
            let [ni, nj] = [self.first[0] + i, self.first[1] + j];
            let corners = [[ni, nj], [ni + 1, nj], [ni, nj + 1], [ni + 1, nj + 1]];
            swept[j * nx + i] = corners.iter().all(|[i, j]| self.fits_at(*i, *j));
        }
        self.cover(&mut swept, &self.lattice, rim - self.cell() * FRAC_1_SQRT_2);
        swept
    }

    /// Marks the cells with their middle within a distance of nodes at the border of a room.
    fn cover(&self, covered: &mut [bool], lattice: &NodeLattice, within: f64) {
        if within <= 0.0 {
            return;
        }
        let (cell, (x, y)) = (self.cell(), self.middle(0, 0));
        lattice.visit_border(|node| {
            // In cells from the first middle.
            let [cx, cy] = [(node[0] - x) / cell, (node[1] - y) / cell];
            let most = within / cell;
            let range = |c: f64, n: usize| {
                (c - most).ceil().max(0.0) as usize..((c + most).floor() + 1.0).clamp(0.0, n as f64) as usize
            };
            for j in range(cy, self.cells[1]) {
                for i in range(cx, self.cells[0]) {
                    if (i as f64 - cx).hypot(j as f64 - cy) <= most {
                        covered[j * self.cells[0] + i] = true;
                    }
                }
            }
        });
    }
}
