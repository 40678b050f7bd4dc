//! Places of the tip that a cutter keeps off, because there is too much material.

use nalgebra::Point2;

/// Places of the tip on a level that a cutter keeps off, on a lattice; beyond it, those of the
/// nearest node.
pub struct KeptOff {
    /// Least coordinates of the nodes, level's frame.
    pub(crate) origin: Point2<f64>,
    /// Distance of the nodes, mm.
    pub(crate) cell: f64,
    /// Number of nodes along x and y.
    pub(crate) nodes: [usize; 2],
    pub(crate) is_off: Vec<bool>,
}

impl KeptOff {
    /// Returns whether there is no such place.
    pub fn is_empty(&self) -> bool {
        !self.is_off.contains(&true)
    }

    /// Returns whether a place is one, by its coordinates in the level's frame.
    pub(crate) fn contains(&self, x: f64, y: f64) -> bool {
        let at = [x, y];
        let [i, j] = [0, 1].map(|k| {
            let node = ((at[k] - self.origin[k]) / self.cell).round();
            node.clamp(0.0, (self.nodes[k] - 1) as f64) as usize
        });
        self.is_off[j * self.nodes[0] + i]
    }
}
