use crate::harmonic::multigrid::*;
use crate::test_kit::Random;

/// The five-point Laplacian of n × n unknowns with random conductances, grounded at one side.
fn laplacian(n: usize, stretch: f64, rng: &mut Random) -> Sparse {
    let mut entries: Vec<Entry> = Vec::new();
    let mut couple = |a: usize, b: usize, weight: f64| {
        let (a, b) = (a as u32, b as u32);
        entries.extend([(a, a, weight), (b, b, weight), (a, b, -weight), (b, a, -weight)]);
    };
    for i in 0..n {
        for j in 0..n - 1 {
            couple(n * i + j, n * i + j + 1, stretch * (0.5 + rng.unit()));
            couple(n * j + i, n * (j + 1) + i, 0.5 + rng.unit());
        }
    }
    entries.extend((0..n as u32).map(|k| (k, k, 1.0)));
    Sparse::of_entries(n * n, n * n, &entries)
}

#[test]
fn laplacians_are_solved_to_rounding_however_large_or_stretched() {
    let mut rng = Random(9);
    for (n, stretch) in [(2, 1.0), (12, 1.0), (90, 1.0), (90, 16.0)] {
        let matrix = laplacian(n, stretch, &mut rng);
        let x: Vec<f64> = (0..n * n).map(|_| rng.unit()).collect();
        let right = matrix.times(&x);
        let solution = Solver::new(matrix).solve(&right, 1e-13, 1e-10).unwrap();
        let off = x.iter().zip(&solution).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8, "{n} {stretch}: {off}");
    }
}

#[test]
fn a_system_without_a_solution_is_told_apart() {
    // Nothing is grounded, and the right side does not sum up to 0.
    let matrix = Sparse::of_entries(2, 2, &[(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]);
    assert!(Solver::new(matrix).solve(&[1.0, 1.0], 1e-13, 1e-10).is_err());
}
