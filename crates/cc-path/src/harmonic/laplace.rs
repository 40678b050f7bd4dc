use facemill_surface_model::{Edges, TriMesh};

use crate::harmonic::intrinsic::Intrinsic;
use crate::harmonic::multigrid::{NotSolved, Solver};
use crate::harmonic::sparse::{Entry, Sparse};

/// Norm of the residual that a solution may have, as a share of the right side's.
const ACCURACY: f64 = 1e-13;

/// A residual that is accepted where rounding allows no smaller one.
const ENOUGH: f64 = 1e-9;

/// The harmonic function with given values at some vertices, by linear finite elements on the
/// intrinsic Delaunay triangulation: its gradient runs along all borders that have no value.
///
/// Exact up to rounding where a function linear on a flat mesh is the solution. Vertices without a
/// triangle have no value (NaN). Every other vertex has to be connected with one that has a value.
///
/// # Errors
/// When the system cannot be solved.
pub(crate) fn harmonic(mesh: &TriMesh, edges: &Edges, fixed: &[Option<f64>]) -> Result<Vec<f64>, NotSolved> {
    solve(mesh, &Intrinsic::of(mesh, edges, None), fixed)
}

/// The harmonic function that gains the jump, turned round, along each side: an angle around a
/// tube, of period 1.
///
/// `jumps` along the sides of each triangle sum up to 0 around it. From corner a to corner b of a
/// side, the angle grows by `value(b) − value(a) − jump`. One vertex of each component has to be
/// fixed.
///
/// # Errors
/// When the system cannot be solved.
pub(crate) fn angle(
    mesh: &TriMesh,
    edges: &Edges,
    jumps: Vec<[f64; 3]>,
    fixed: &[Option<f64>],
) -> Result<Vec<f64>, NotSolved> {
    solve(mesh, &Intrinsic::of(mesh, edges, Some(jumps)), fixed)
}

fn solve(mesh: &TriMesh, intrinsic: &Intrinsic, fixed: &[Option<f64>]) -> Result<Vec<f64>, NotSolved> {
    const NONE: u32 = u32::MAX;
    let mut is_used = vec![false; fixed.len()];
    mesh.triangles().iter().flatten().for_each(|&v| is_used[v as usize] = true);
    let mut unknown = vec![NONE; fixed.len()];
    let mut n = 0;
    for v in (0..fixed.len()).filter(|&v| is_used[v] && fixed[v].is_none()) {
        unknown[v] = n;
        n += 1;
    }
    let mut entries: Vec<Entry> = Vec::with_capacity(12 * mesh.triangles().len());
    let mut right = vec![0.0; n as usize];
    for ([a, b], weight, jump) in intrinsic.sides().filter(|([a, b], ..)| a != b) {
        for (from, to, jump) in [(a, b, jump), (b, a, -jump)] {
            let row = unknown[from as usize];
            if row == NONE {
                continue;
            }
            entries.push((row, row, weight));
            right[row as usize] -= weight * jump;
            match (unknown[to as usize], fixed[to as usize]) {
                (_, Some(value)) => right[row as usize] += weight * value,
                (column, None) => entries.push((row, column, -weight)),
            }
        }
    }
    let solver = Solver::new(Sparse::of_entries(n as usize, n as usize, &entries));
    drop(entries);
    let solution = solver.solve(&right, ACCURACY, ENOUGH)?;
    let value = |v: usize| match (fixed[v], unknown[v]) {
        (Some(value), _) => value,
        (None, NONE) => f64::NAN,
        (None, k) => solution[k as usize],
    };
    Ok((0..fixed.len()).map(value).collect())
}

#[cfg(test)]
#[path = "../../tests/unit/harmonic/laplace.rs"]
mod tests;
