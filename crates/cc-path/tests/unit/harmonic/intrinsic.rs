use crate::harmonic::intrinsic::*;
use crate::test_kit::{Random, grid};
use nalgebra::Point3;

/// A bumpy grid with vertices moved about, stretched four times.
fn stretched(seed: u64) -> TriMesh {
    let mut rng = Random(seed);
    let mesh = grid(9, 9, |u, v| Point3::new(40.0 * u, 10.0 * v, (7.0 * u).sin() + (5.0 * v).cos()));
    let moved = mesh.vertices().iter().map(|p| p + rng.point(0.4).coords).collect();
    TriMesh::new(moved, mesh.triangles().to_vec()).unwrap()
}

#[test]
fn flips_keep_the_area_and_leave_a_delaunay_triangulation() {
    for seed in 0..4 {
        let mesh = stretched(seed);
        let jump = |t: usize, k: usize| {
            let [a, b] = [k, (k + 1) % 3].map(|k| f64::from(mesh.triangles()[t][k] * 7 % 5));
            b - a
        };
        let jumps = (0..mesh.triangles().len()).map(|t| [0, 1, 2].map(|k| jump(t, k))).collect();
        let area: f64 = (0..mesh.triangles().len()).map(|t| 0.5 * mesh.scaled_normal(t).norm()).sum();
        let flipped = Intrinsic::of(&mesh, &Edges::of(&mesh), Some(jumps));
        let new_area: f64 = flipped.lengths.iter().map(|l| super::area(*l)).sum();
        assert!((new_area / area - 1.0).abs() < 1e-9, "{new_area} {area}");
        let mut n_moved = 0;
        for side in 0..3 * mesh.triangles().len() as u32 {
            let other = flipped.at(side, &flipped.across);
            if other != NONE {
                assert_eq!(flipped.at(other, &flipped.across), side);
                assert!((flipped.at(other, &flipped.lengths) - flipped.at(side, &flipped.lengths)).abs() < 1e-9);
                assert_eq!(flipped.at(other, &flipped.jumps), -flipped.at(side, &flipped.jumps));
                assert!(flipped.cotangent(side) + flipped.cotangent(other) > -1e-8);
            }
            let t = side as usize / 3;
            n_moved += usize::from(flipped.triangles[t] != mesh.triangles()[t]);
        }
        assert!(n_moved > 30, "{n_moved}");
        // The jumps of a function stay those of it.
        for ([a, b], _, jump) in flipped.sides() {
            assert_eq!(jump, f64::from(b * 7 % 5) - f64::from(a * 7 % 5));
        }
    }
}

#[test]
fn triangles_without_an_area_get_one() {
    let vertices = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0)).to_vec();
    let mesh = TriMesh::new(vertices, vec![[0, 1, 2], [2, 3, 0]]).unwrap();
    let relaxed = Intrinsic::of(&mesh, &Edges::of(&mesh), None);
    assert!(relaxed.sides().all(|(_, weight, _)| weight.is_finite() && weight.abs() < 1e4));
}
