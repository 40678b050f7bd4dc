use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};
use pulp::Arch;
use rayon::prelude::*;

use crate::lattice::{Lattice, NodeWindow, Raise};
use crate::map::{ZMapError, ZMapSettings, grid_over};
use crate::raster::Grid;

/// The heights of a Z-map's nodes alone: what the paper's test needs, at a fraction of the time of
/// a [`crate::map::ZMap`], whose proven maxima of the cells they lack. For pictures and first
/// looks at large meshes:
///
/// ```
/// use facemill_surface_model::TriMesh;
/// use facemill_z_map::{NodeHeights, ZMapSettings};
/// use nalgebra::{Isometry3, Point3};
///
/// let corners = [[0.0, 0.0, 5.0], [40.0, 0.0, 5.0], [0.0, 40.0, 5.0]].map(Point3::from);
/// let plate = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]])?;
/// let settings = ZMapSettings { cell: 1.0, margin: 0.0 };
/// let heights = NodeHeights::build(&plate, &Isometry3::identity(), &settings)?;
/// assert_eq!((heights.node_height(3, 4), heights.node_height(39, 39)), (Some(5.0), None));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NodeHeights {
    grid: Grid,
    nodes: Vec<f64>,
}

impl NodeHeights {
    /// The largest z of a mesh over every node, in the frame that `map_from_mesh` leads to; exact
    /// up to rounding.
    ///
    /// Runs in parallel; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// As [`crate::map::ZMap::build`].
    pub fn build(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>, settings: &ZMapSettings) -> Result<Self, ZMapError> {
        let vertices = moved(mesh, map_from_mesh);
        let grid = grid_over(mesh, &vertices, map_from_mesh, settings)?;
        Ok(Self { grid, nodes: rasterised(&grid, &vertices, mesh.triangles()) })
    }

    /// Number of nodes along x and y.
    pub fn n_nodes(&self) -> [usize; 2] {
        [self.grid.nx + 1, self.grid.ny + 1]
    }

    /// Position of the node (i, j) in the map's xy plane.
    pub fn node_position(&self, i: usize, j: usize) -> [f64; 2] {
        [self.grid.node_x(i), self.grid.node_y(j)]
    }

    /// Height of the mesh over the node (i, j), map frame, mm. `None` where there is no surface or
    /// no such node.
    pub fn node_height(&self, i: usize, j: usize) -> Option<f64> {
        let [nx, ny] = self.n_nodes();
        (i < nx && j < ny).then(|| self.nodes[j * nx + i]).filter(|z| z.is_finite())
    }
}

/// Rows of nodes per unit of parallel work.
const STRIP: usize = 16;

/// Triangles sorted into strips at a time.
const CHUNK: usize = 1 << 14;

/// The mesh's vertices in the map's frame.
pub(crate) fn moved(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let (turn, shift) = (map_from_mesh.rotation.to_rotation_matrix(), map_from_mesh.translation.vector);
    mesh.vertices().par_iter().map(|p| Point3::from(turn * p.coords + shift)).collect()
}

/// Heights of the nodes, row by row; −∞ where there is no surface.
///
/// A node meets its triangles in the order of the mesh, whatever the number of threads.
pub(crate) fn rasterised(grid: &Grid, vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<f64> {
    let lattice = Lattice::new(grid);
    let n = grid.nx + 1;
    let corners = |t: &[u32; 3]| t.map(|v| &vertices[v as usize]);
    let arch = Arch::new();
    if rayon::current_num_threads() == 1 {
        let mut nodes = vec![f64::NEG_INFINITY; n * (grid.ny + 1)];
        arch.dispatch(Raise { lattice, triangles: triangles.iter().map(corners), first_row: 0, nodes: &mut nodes });
        return nodes;
    }
    let n_strips = (grid.ny + 1).div_ceil(STRIP);
    let binned: Vec<Binned> = triangles
        .par_chunks(CHUNK)
        .map(|chunk| Binned::new(chunk.iter().map(|t| lattice.window(&corners(t))), n_strips))
        .collect();
    // Zeros come from the system as they are needed, by the thread that fills them.
    let mut nodes = vec![0.0; n * (grid.ny + 1)];
    nodes.par_chunks_mut(STRIP * n).enumerate().for_each(|(strip, rows)| {
        rows.fill(f64::NEG_INFINITY);
        for (chunk, binned) in triangles.chunks(CHUNK).zip(&binned) {
            let triangles = binned.of(strip).iter().map(|&t| corners(&chunk[t as usize]));
            arch.dispatch(Raise { lattice, triangles, first_row: STRIP * strip, nodes: rows });
        }
    });
    nodes
}

/// The triangles of a chunk by strips of rows, in the order of the mesh.
struct Binned {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Binned {
    fn new(windows: impl Iterator<Item = Option<NodeWindow>>, n_strips: usize) -> Self {
        let some: Vec<(u32, [usize; 2])> =
            (0..).zip(windows).filter_map(|(t, w)| w.map(|w| (t, w.rows.map(|j| j as usize / STRIP)))).collect();
        let mut starts = vec![0u32; n_strips + 1];
        some.iter().for_each(|(_, [low, high])| (*low..=*high).for_each(|k| starts[k + 1] += 1));
        (1..=n_strips).for_each(|k| starts[k] += starts[k - 1]);
        let mut free = starts.clone();
        let mut triangles = vec![0; starts[n_strips] as usize];
        for (t, [low, high]) in some {
            for at in &mut free[low..=high] {
                triangles[*at as usize] = t;
                *at += 1;
            }
        }
        Self { starts, triangles }
    }

    fn of(&self, strip: usize) -> &[u32] {
        &self.triangles[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

#[cfg(test)]
#[path = "../../tests/unit/map/heights.rs"]
mod tests;
