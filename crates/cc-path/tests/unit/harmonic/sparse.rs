use crate::harmonic::sparse::*;
use crate::test_kit::Random;
use nalgebra::DMatrix;

fn random(rng: &mut Random, rows: usize, columns: usize) -> (Sparse, DMatrix<f64>) {
    let mut dense = DMatrix::zeros(rows, columns);
    let entry = |rng: &mut Random| {
        let [row, column] = [rows, columns].map(|n| (rng.unit() * n as f64) as u32);
        (row, column, rng.unit() - 0.5)
    };
    let entries: Vec<Entry> = (0..3 * rows).map(|_| entry(rng)).collect();
    for &(row, column, value) in &entries {
        dense[(row as usize, column as usize)] += value;
    }
    (Sparse::of_entries(rows, columns, &entries), dense)
}

fn dense(sparse: &Sparse, columns: usize) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(sparse.n_rows(), columns);
    for row in 0..sparse.n_rows() {
        let columns: Vec<usize> = sparse.row(row).map(|e| e.0).collect();
        assert!(columns.is_sorted_by(|a, b| a < b));
        for (column, value) in sparse.row(row) {
            dense[(row, column)] = value;
        }
    }
    dense
}

#[test]
fn products_and_transposes_are_those_of_dense_matrices() {
    let mut rng = Random(4);
    for (n, m, k) in [(1, 1, 1), (7, 5, 9), (20, 31, 12)] {
        let ((a, dense_a), (b, dense_b)) = (random(&mut rng, n, m), random(&mut rng, m, k));
        assert!((dense(&a.product(&b), k) - &dense_a * &dense_b).amax() < 1e-14);
        assert_eq!(dense(&a.transposed(), n), dense_a.transpose());
        let x: Vec<f64> = (0..m).map(|_| rng.unit()).collect();
        let image = &dense_a * nalgebra::DVector::from_column_slice(&x);
        assert!((nalgebra::DVector::from_column_slice(&a.times(&x)) - image).amax() < 1e-14);
    }
}
