use crate::harmonic::laplace::*;
use crate::test_kit::irregular_grid;
use nalgebra::Point3;

#[test]
fn a_linear_function_on_an_irregular_flat_mesh_is_found_exactly() {
    // So irregular that many triangles are obtuse.
    let mesh = irregular_grid(20, 14, 0.8, |u, v| Point3::new(100.0 * u, 60.0 * v, 0.0));
    let of = |y: f64| [0.0, 60.0].contains(&y).then_some(y / 60.0);
    let fixed: Vec<Option<f64>> = mesh.vertices().iter().map(|p| of(p.y)).collect();
    let u = harmonic(&mesh, &Edges::of(&mesh), &fixed).unwrap();
    for (u, p) in u.iter().zip(mesh.vertices()) {
        assert!((u - p.y / 60.0).abs() < 1e-11, "{u} at {p}");
    }
}
