//! Lattices of places of the tip on a level, and cells around them.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::room::LevelRoom;

/// Square lattice of places of the tip, with whether a cutter fits at each.
pub(crate) struct NodeLattice {
    /// Least coordinates of the nodes, level's frame.
    pub(crate) origin: Point2<f64>,
    /// Distance of the nodes, mm.
    pub(crate) cell: f64,
    /// Number of nodes along x and y.
    pub(crate) nodes: [usize; 2],
    fits: Vec<bool>,
}

impl NodeLattice {
    /// Returns a lattice with a decision at each node, about a cutter whose radius is less by
    /// `narrower` (mm): where there is none, it counts as fitting.
    pub(crate) fn new(room: &LevelRoom<'_>, origin: Point2<f64>, cell: f64, nodes: [usize; 2], narrower: f64) -> Self {
        let mut lattice = Self { origin, cell, nodes, fits: Vec::new() };
        lattice.fits = lattice.decided(room, narrower);
        lattice
    }

    /// Returns whether the cutter fits with its tip at a node.
    pub(crate) fn fits_at(&self, i: usize, j: usize) -> bool {
        self.fits[j * self.nodes[0] + i]
    }

    /// Returns the coordinates of a node, level's frame.
    pub(crate) fn at(&self, i: usize, j: usize) -> [f64; 2] {
        [self.origin.x + i as f64 * self.cell, self.origin.y + j as f64 * self.cell]
    }

    /// Calls back with each node where the cutter fits beside one where it does not, or at the end
    /// of the lattice: of all nodes where it fits, these are nearest to places beyond them.
    pub(crate) fn visit_border(&self, mut visit: impl FnMut([f64; 2])) {
        for j in 0..self.nodes[1] {
            for i in 0..self.nodes[0] {
                if self.fits_at(i, j) && self.is_at_border(i, j) {
                    visit(self.at(i, j));
                }
            }
        }
    }

    /// Decides at all nodes, block by block.
    fn decided(&self, room: &LevelRoom<'_>, narrower: f64) -> Vec<bool> {
        let [nx, ny] = self.nodes;
        let blocks: Vec<NodeBlock> = (0..ny)
            .step_by(BLOCK)
            .flat_map(|j| (0..nx).step_by(BLOCK).map(move |i| NodeBlock { at: [i, j], side: BLOCK }))
            .collect();
        let decided: Vec<Vec<(NodeBlock, bool)>> = blocks
            .par_iter()
            .map(|block| {
                let mut found = Vec::new();
                self.decide((room, narrower), *block, &mut found);
                found
            })
            .collect();
        let mut fits = vec![false; nx * ny];
        for (NodeBlock { at: [i, j], side }, does) in decided.into_iter().flatten() {
            for j in j..(j + side).min(ny) {
                fits[j * nx + i..j * nx + (i + side).min(nx)].fill(does);
            }
        }
        fits
    }

    /// Decides at the nodes of a block, all at once or in quarters.
    fn decide(&self, by: (&LevelRoom<'_>, f64), block: NodeBlock, found: &mut Vec<(NodeBlock, bool)>) {
        let (room, narrower) = by;
        let NodeBlock { at: [i, j], side } = block;
        if i >= self.nodes[0] || j >= self.nodes[1] {
            return;
        }
        let half = 0.5 * (side - 1) as f64 * self.cell;
        let [x, y] = self.at(i, j).map(|least| least + half);
        match room.fits_around(&room.plane().at(x, y), half * std::f64::consts::SQRT_2, narrower) {
            Some(all) => found.push((block, all)),
            None if side == 1 => found.push((block, true)),
            None => {
                let half = side / 2;
                for at in [[i, j], [i + half, j], [i, j + half], [i + half, j + half]] {
                    self.decide(by, NodeBlock { at, side: half }, found);
                }
            }
        }
    }

    fn is_at_border(&self, i: usize, j: usize) -> bool {
        let [nx, ny] = self.nodes;
        if i == 0 || j == 0 || i + 1 == nx || j + 1 == ny {
            return true;
        }
        (j - 1..=j + 1).any(|j| (i - 1..=i + 1).any(|i| !self.fits_at(i, j)))
    }
}

/// Nodes along the side of a block that is decided at once, if it can be.
const BLOCK: usize = 32;

/// Square block of nodes.
#[derive(Clone, Copy)]
struct NodeBlock {
    /// First node.
    at: [usize; 2],
    /// Number of nodes along a side: a power of two.
    side: usize,
}
