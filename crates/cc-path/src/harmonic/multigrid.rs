use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::harmonic::sparse::{Entry, Sparse};

/// Solver of symmetric positive definite systems: conjugate gradients, preconditioned by a cycle of
/// smoothed aggregation multigrid (Vaněk, Mandel, Brezina 1996).
///
/// The work for a Laplacian of a surface grows in proportion to the number of unknowns. All sums
/// have a fixed order, so the solution does not depend on the number of threads.
pub(crate) struct Solver {
    grids: Vec<Grid>,
    coarsest: Coarsest,
}

/// A system, and how it leads to the next coarser one.
struct Grid {
    matrix: Sparse,
    inverse_diagonal: Vec<f64>,
    /// From the coarser grid to this one.
    prolongation: Sparse,
    restriction: Sparse,
}

/// The system where coarsening ends.
struct Coarsest {
    matrix: Sparse,
    inverse_diagonal: Vec<f64>,
    /// `None` where it is too large, or rounding has made it indefinite.
    factor: Option<Cholesky<f64, Dyn>>,
}

/// Systems of at most so many unknowns are solved directly.
const DIRECT: usize = 200;
/// A grid that keeps more than this share of the unknowns ends coarsening.
const LEAST_COARSENING: f64 = 0.8;
/// Unknowns are strongly coupled where |a_ij| is above this share of √(a_ii·a_jj).
const STRONG: f64 = 0.08;
/// Damping of the smoothed prolongation: 4/3 over the largest eigenvalue of D⁻¹A, which is at most
/// 2 for a Laplacian.
const DAMPING: f64 = 2.0 / 3.0;
const MAX_ITERATIONS: usize = 300;
/// Iterations without half the residual after which it counts as stalled.
const STALLED: usize = 30;
/// Sweeps on a coarsest grid that has no factor.
const SWEEPS: usize = 20;

/// A system that was not solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NotSolved {
    /// Norm of the residual as a share of the right side's.
    pub(crate) residual: f64,
}

impl Solver {
    /// Prepares a symmetric matrix with positive diagonal.
    pub(crate) fn new(matrix: Sparse) -> Self {
        let mut grids = Vec::new();
        let mut matrix = matrix;
        while matrix.n_rows() > DIRECT {
            let prolongation = smoothed_prolongation(&matrix);
            let restriction = prolongation.transposed();
            if restriction.n_rows() as f64 > LEAST_COARSENING * matrix.n_rows() as f64 {
                break;
            }
            let coarser = restriction.product(&matrix.product(&prolongation));
            let inverse_diagonal = inverse_diagonal(&matrix);
            grids.push(Grid { matrix, inverse_diagonal, prolongation, restriction });
            matrix = coarser;
        }
        Self { grids, coarsest: Coarsest::new(matrix) }
    }

    fn matrix(&self) -> &Sparse {
        self.grids.first().map_or(&self.coarsest.matrix, |grid| &grid.matrix)
    }

    /// Solves for a right side until the residual is at most `accuracy` of it; `enough` will do
    /// where rounding lets it fall no further.
    ///
    /// # Errors
    /// When that takes too many iterations.
    pub(crate) fn solve(&self, right: &[f64], accuracy: f64, enough: f64) -> Result<Vec<f64>, NotSolved> {
        let size = norm(right);
        let mut x = vec![0.0; right.len()];
        if size == 0.0 {
            return Ok(x);
        }
        let mut residual = right.to_vec();
        let mut z = self.cycle(0, &residual);
        let mut direction = z.clone();
        let mut product = dot(&residual, &z);
        let mut best = (f64::INFINITY, 0);
        for k in 0..MAX_ITERATIONS {
            let image = self.matrix().times(&direction);
            let step = product / dot(&direction, &image);
            add(&mut x, step, &direction);
            add(&mut residual, -step, &image);
            let share = norm(&residual) / size;
            if share <= accuracy {
                return Ok(x);
            }
            // The last digits do not fall for ever.
            best = if share < 0.5 * best.0 { (share, k) } else { best };
            if !share.is_finite() || k - best.1 > STALLED {
                break;
            }
            z = self.cycle(0, &residual);
            let next = dot(&residual, &z);
            let share = next / product;
            product = next;
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        }
        // The recursion's residual drifts from the true one.
        let image = self.matrix().times(&x);
        let residual = norm(&right.iter().zip(&image).map(|(b, i)| b - i).collect::<Vec<_>>()) / size;
        if residual <= enough { Ok(x) } else { Err(NotSolved { residual }) }
    }

    /// Approximate solution on a grid: one sweep, the rest on the coarser grid, one sweep back.
    fn cycle(&self, k: usize, right: &[f64]) -> Vec<f64> {
        let Some(grid) = self.grids.get(k) else { return self.coarsest.solve(right) };
        let mut x = vec![0.0; right.len()];
        sweep(&grid.matrix, &grid.inverse_diagonal, right, &mut x, 0..right.len());
        let image = grid.matrix.times(&x);
        let residual: Vec<f64> = right.iter().zip(&image).map(|(b, i)| b - i).collect();
        let coarse = self.cycle(k + 1, &grid.restriction.times(&residual));
        add(&mut x, 1.0, &grid.prolongation.times(&coarse));
        sweep(&grid.matrix, &grid.inverse_diagonal, right, &mut x, (0..right.len()).rev());
        x
    }
}

impl Coarsest {
    fn new(matrix: Sparse) -> Self {
        let n = matrix.n_rows();
        let dense = || {
            let mut dense = DMatrix::zeros(n, n);
            for row in 0..n {
                for (column, value) in matrix.row(row) {
                    dense[(row, column)] = value;
                }
            }
            dense
        };
        let factor = (n <= DIRECT).then(|| Cholesky::new(dense())).flatten();
        Self { inverse_diagonal: inverse_diagonal(&matrix), matrix, factor }
    }

    fn solve(&self, right: &[f64]) -> Vec<f64> {
        if let Some(factor) = &self.factor {
            return factor.solve(&DVector::from_column_slice(right)).as_slice().to_vec();
        }
        let mut x = vec![0.0; right.len()];
        for _ in 0..SWEEPS {
            sweep(&self.matrix, &self.inverse_diagonal, right, &mut x, 0..right.len());
            sweep(&self.matrix, &self.inverse_diagonal, right, &mut x, (0..right.len()).rev());
        }
        x
    }
}

/// A sweep of Gauss and Seidel.
fn sweep(matrix: &Sparse, inverse_diagonal: &[f64], right: &[f64], x: &mut [f64], order: impl Iterator<Item = usize>) {
    for row in order {
        x[row] += inverse_diagonal[row] * (right[row] - matrix.row_times(row, x));
    }
}

/// Interpolation from aggregates of strongly coupled unknowns, smoothed by a step of Jacobi.
fn smoothed_prolongation(matrix: &Sparse) -> Sparse {
    let n = matrix.n_rows();
    let diagonal = matrix.diagonal();
    let strong = |row: usize| {
        let diagonal = &diagonal;
        matrix
            .row(row)
            .filter(move |&(c, a)| c != row && a.abs() > STRONG * (diagonal[row].abs() * diagonal[c].abs()).sqrt())
    };
    let (aggregate, n_aggregates) = aggregates(n, strong);
    let mut entries: Vec<Entry> = Vec::with_capacity(4 * n);
    for row in 0..n {
        let own = aggregate[row];
        entries.push((row as u32, own, 1.0));
        // Weak couplings are lumped on the diagonal, so a constant stays one where rows sum up to
        // 0.
        let lumped = matrix.row(row).map(|e| e.1).sum::<f64>() - strong(row).map(|e| e.1).sum::<f64>();
        if lumped > 0.0 {
            entries.push((row as u32, own, -DAMPING));
            entries.extend(strong(row).map(|(c, a)| (row as u32, aggregate[c], -a * DAMPING / lumped)));
        }
    }
    Sparse::of_entries(n, n_aggregates, &entries)
}

/// The aggregate of each unknown, and their number: an unknown whose strong neighbours are all free
/// takes them, the others join the aggregate of their strongest neighbour.
fn aggregates<'a, I>(n: usize, strong: impl Fn(usize) -> I) -> (Vec<u32>, usize)
where
    I: Iterator<Item = (usize, f64)> + 'a,
{
    const FREE: u32 = u32::MAX;
    let mut aggregate = vec![FREE; n];
    let mut n_aggregates = 0;
    for row in 0..n {
        if aggregate[row] == FREE && strong(row).all(|(c, _)| aggregate[c] == FREE) {
            aggregate[row] = n_aggregates;
            strong(row).for_each(|(c, _)| aggregate[c] = n_aggregates);
            n_aggregates += 1;
        }
    }
    let seeds = aggregate.clone();
    for row in (0..n).filter(|&row| seeds[row] == FREE) {
        let nearest = strong(row).filter(|(c, _)| seeds[*c] != FREE).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        if let Some((c, _)) = nearest {
            aggregate[row] = seeds[c];
        }
    }
    for row in 0..n {
        if aggregate[row] == FREE {
            aggregate[row] = n_aggregates;
            strong(row).for_each(|(c, _)| {
                if aggregate[c] == FREE {
                    aggregate[c] = n_aggregates;
                }
            });
            n_aggregates += 1;
        }
    }
    (aggregate, n_aggregates as usize)
}

fn inverse_diagonal(matrix: &Sparse) -> Vec<f64> {
    matrix.diagonal().into_iter().map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn add(x: &mut [f64], factor: f64, step: &[f64]) {
    x.iter_mut().zip(step).for_each(|(x, s)| *x += factor * s);
}

#[cfg(test)]
#[path = "../../tests/unit/harmonic/multigrid.rs"]
mod tests;
