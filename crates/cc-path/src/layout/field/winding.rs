use std::collections::VecDeque;

use crate::error::PathError;
use crate::harmonic::laplace::angle;
use crate::layout::field::ends::connected_parts;
use crate::strategy::patch::Patch;

/// The angle around a tube, of period 1: harmonic, and growing by 1 along every closed level in the
/// forward direction.
pub(crate) struct Winding {
    /// The angle at each vertex, less whole turns.
    values: Vec<f64>,
    /// Jumps along the sides of each triangle that cross the seam.
    jumps: Vec<[f64; 3]>,
}

impl Winding {
    /// The angle on a patch whose levels from `first` to `last` are closed; `None` where no way
    /// leads from below the first to above the last.
    ///
    /// # Errors
    /// When the mesh allows no solution.
    pub(crate) fn of(patch: &Patch, [first, last]: [f64; 2]) -> Result<Option<Self>, PathError> {
        let Some(seam) = seam(patch, first, last) else { return Ok(None) };
        let mut jumps = vec![[0.0; 3]; patch.mesh.triangles().len()];
        for (t, [entered, left]) in seam {
            jumps[t as usize][entered] = -1.0;
            jumps[t as usize][left] = 1.0;
        }
        let mut fixed = vec![None; patch.mesh.vertices().len()];
        for part in connected_parts(patch) {
            fixed[patch.mesh.triangles()[part[0] as usize][0] as usize] = Some(0.0);
        }
        let values = angle(&patch.mesh, &patch.edges, jumps.clone(), &fixed)
            .map_err(|e| PathError::NoField { residual: e.residual })?;
        Ok(Some(Self { values, jumps }))
    }

    /// The angle at a vertex, less whole turns.
    pub(crate) fn at(&self, v: u32) -> f64 {
        self.values[v as usize]
    }

    /// Whole turns that make the angle continuous on a triangle, at its corners.
    pub(crate) fn turns(&self, t: u32) -> [f64; 3] {
        let [to_second, _, from_third] = self.jumps[t as usize];
        [0.0, -to_second, from_third]
    }
}

/// A strip of triangles from the border below the first level to the border above the last, each
/// with the sides through which it is entered and left.
fn seam(patch: &Patch, first: f64, last: f64) -> Option<Vec<(u32, [usize; 2])>> {
    let n = patch.mesh.triangles().len();
    let across = |t: u32, k: usize| patch.edges.across(&patch.mesh, t, k);
    let border = |t: u32, on: &dyn Fn(f64) -> bool| {
        let v = patch.mesh.triangles()[t as usize];
        (0..3).find(|&k| {
            across(t, k).is_none() && on(patch.levels[v[k] as usize]) && on(patch.levels[v[(k + 1) % 3] as usize])
        })
    };
    // The side through which each triangle is entered; 3 where it is not reached.
    let mut entered = vec![3u8; n];
    let mut queue = VecDeque::new();
    for t in 0..n as u32 {
        if let Some(k) = border(t, &|level| level < first) {
            entered[t as usize] = k as u8;
            queue.push_back(t);
        }
    }
    while let Some(t) = queue.pop_front() {
        if let Some(k) = border(t, &|level| level >= last) {
            return Some(way_back(patch, &entered, t, k));
        }
        for (u, j) in (0..3).filter_map(|k| across(t, k)) {
            if entered[u as usize] == 3 {
                entered[u as usize] = j as u8;
                queue.push_back(u);
            }
        }
    }
    None
}

fn way_back(patch: &Patch, entered: &[u8], mut t: u32, mut left: usize) -> Vec<(u32, [usize; 2])> {
    let mut way = Vec::new();
    loop {
        let side = entered[t as usize] as usize;
        way.push((t, [side, left]));
        let Some((before, k)) = patch.edges.across(&patch.mesh, t, side) else { return way };
        (t, left) = (before, k);
    }
}
