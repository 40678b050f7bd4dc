//! Part of a level that an upright cutter sweeps, on a lattice.

use facemill_surface_model::{Group, TriMesh};
use nalgebra::{Point2, Point3};
use rayon::prelude::*;

use crate::plane::LevelPlane;
use crate::room::LevelRoom;

/// Cells of the lattice across the flat bottom's radius: an uncertain border of a tenth of it.
const CELLS_PER_RIM: f64 = 12.0;

/// Largest number of cells over the stock: a mesh of two triangles for each.
const MOST_CELLS: f64 = 30_000.0;

/// Nodes along the side of a block that is decided at once, if it can be.
const BLOCK: usize = 16;

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
    /// Least coordinates of the nodes, level's frame.
    origin: Point2<f64>,
    cell: f64,
    /// Number of nodes along x and y.
    nodes: [usize; 2],
    /// Whether the cutter fits with its tip at a node.
    fits: Vec<bool>,
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
        let mut reach = Self {
            plane: *room.plane(),
            origin,
            cell,
            nodes,
            fits: Vec::new(),
            first: [beyond; 2],
            cells,
            swept: Vec::new(),
        };
        reach.fits = reach.fitting(room);
        reach.swept = reach.sweep(rim);
        reach
    }

    /// Returns the side of a cell, mm.
    pub fn cell(&self) -> f64 {
        self.cell
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
    /// condition holds, and of those of them that are not swept.
    pub fn areas(&self, holds: impl Fn(usize) -> bool) -> [f64; 2] {
        let counted = |(all, kept): (usize, usize), k: usize| (all + 1, kept + usize::from(!self.swept[k]));
        let (all, kept) = (0..self.swept.len()).filter(|&k| holds(k)).fold((0, 0), counted);
        [all, kept].map(|n| n as f64 * self.cell * self.cell)
    }

    /// Returns the number of nodes along x and y.
    pub(crate) fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Returns the position of a node, workpiece frame.
    pub(crate) fn node(&self, i: usize, j: usize) -> Point3<f64> {
        self.plane.at(self.origin.x + i as f64 * self.cell, self.origin.y + j as f64 * self.cell)
    }

    /// Returns whether the cutter fits with its tip at a node.
    pub(crate) fn fits_at(&self, i: usize, j: usize) -> bool {
        self.fits[j * self.nodes[0] + i]
    }

    fn all_cells(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let [nx, ny] = self.cells;
        (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)))
    }

    /// Coordinates of the middle of a cell, level's frame.
    fn middle(&self, i: usize, j: usize) -> (f64, f64) {
        let at = |k: usize, n: usize| self.origin[k] + ((self.first[k] + n) as f64 + 0.5) * self.cell;
        (at(0, i), at(1, j))
    }

    /// Decides at all nodes whether the cutter fits, block by block.
    fn fitting(&self, room: &LevelRoom<'_>) -> Vec<bool> {
        let [nx, ny] = self.nodes;
        let blocks: Vec<NodeBlock> = (0..ny)
            .step_by(BLOCK)
            .flat_map(|j| (0..nx).step_by(BLOCK).map(move |i| NodeBlock { at: [i, j], side: BLOCK }))
            .collect();
        let decided: Vec<Vec<([usize; 2], bool)>> = blocks
            .par_iter()
            .map(|block| {
                let mut found = Vec::new();
                self.decide(room, *block, &mut found);
                found
            })
            .collect();
        let mut fits = vec![false; nx * ny];
        decided.into_iter().flatten().for_each(|([i, j], does)| fits[j * nx + i] = does);
        fits
    }

    /// Decides at the nodes of a block, all at once or in quarters.
    fn decide(&self, room: &LevelRoom<'_>, block: NodeBlock, found: &mut Vec<([usize; 2], bool)>) {
        let NodeBlock { at: [i, j], side } = block;
        let [nx, ny] = self.nodes;
        if i >= nx || j >= ny {
            return;
        }
        if side == 1 {
            found.push(([i, j], room.fits(&self.node(i, j))));
            return;
        }
        let half = 0.5 * (side - 1) as f64 * self.cell;
        let x = self.origin.x + i as f64 * self.cell + half;
        let y = self.origin.y + j as f64 * self.cell + half;
        match room.fits_around(&self.plane.at(x, y), half * std::f64::consts::SQRT_2) {
            Some(all) => {
                let nodes = (j..(j + side).min(ny)).flat_map(|j| (i..(i + side).min(nx)).map(move |i| [i, j]));
                found.extend(nodes.map(|node| (node, all)));
            }
            None => {
                let half = side / 2;
                for at in [[i, j], [i + half, j], [i, j + half], [i + half, j + half]] {
                    self.decide(room, NodeBlock { at, side: half }, found);
                }
            }
        }
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
        // Beyond them, nodes beside one that does not fit reach farthest.
        let reach = rim - self.cell * std::f64::consts::FRAC_1_SQRT_2;
        if reach <= 0.0 {
            return swept;
        }
        let most = (reach / self.cell).ceil() as isize + 1;
        for nj in 0..self.nodes[1] {
            for ni in 0..self.nodes[0] {
                if !self.fits_at(ni, nj) || !self.is_at_border(ni, nj) {
                    continue;
                }
                let [ci, cj] = [ni as isize - self.first[0] as isize, nj as isize - self.first[1] as isize];
                for j in (cj - most).max(0)..(cj + most).min(ny as isize) {
                    for i in (ci - most).max(0)..(ci + most).min(nx as isize) {
                        let [dx, dy] = [(i - ci) as f64 + 0.5, (j - cj) as f64 + 0.5];
                        if dx.hypot(dy) * self.cell <= reach {
                            swept[j as usize * nx + i as usize] = true;
                        }
                    }
                }
            }
        }
        swept
    }

    /// Returns whether a node beside this one does not fit, or it is at the end of the lattice.
    fn is_at_border(&self, i: usize, j: usize) -> bool {
        let [nx, ny] = self.nodes;
        if i == 0 || j == 0 || i + 1 == nx || j + 1 == ny {
            return true;
        }
        (j - 1..=j + 1).any(|j| (i - 1..=i + 1).any(|i| !self.fits_at(i, j)))
    }
}

/// Square block of nodes.
#[derive(Clone, Copy)]
struct NodeBlock {
    /// First node.
    at: [usize; 2],
    /// Number of nodes along a side: a power of two.
    side: usize,
}
