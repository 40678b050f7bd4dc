use super::*;

fn volume(mesh: &TriMesh) -> f64 {
    facemill_test_kit::volume(mesh.vertices(), mesh.triangles())
}

#[test]
fn solids_are_closed_and_wound_outward() {
    let b = box_mesh(&BoxStockFile { min_mm: [1.0, 2.0, 3.0], max_mm: [3.0, 5.0, 7.0] });
    assert!((volume(&b) - 24.0).abs() < 1e-9);
    let file = CylinderStockFile { base_mm: [1.0, 2.0, 3.0], axis: [1.0, 1.0, 0.0], radius_mm: 10.0, height_mm: 5.0 };
    let exact = std::f64::consts::PI * 500.0;
    let v = volume(&cylinder_mesh(&file));
    assert!(v > exact && v < exact * 1.002, "{v} {exact}");
}
