use crate::load::open_meshes::*;

/// Returns sides of the unit cube by their axis, or all.
fn sides(of: &[usize]) -> TriMesh {
    let corner = |k: usize| Point3::from([0, 1, 2].map(|axis| (k >> axis & 1) as f64));
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for quad in of.iter().flat_map(|axis| &quads[2 * axis..2 * axis + 2]) {
        let first = vertices.len() as u32;
        vertices.extend(quad.iter().map(|k| corner(*k)));
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    TriMesh::new(vertices, triangles).unwrap()
}

#[test]
fn surfaces_that_meet_at_their_vertices_are_closed_together() {
    let [all, walls, ends] = [sides(&[0, 1, 2]), sides(&[0, 1]), sides(&[2])];
    assert!(is_closed([&all].into_iter()));
    assert!(is_closed([&walls, &ends].into_iter()));
    assert!(!is_closed([&walls].into_iter()) && !is_closed([&ends].into_iter()));
    assert!(!is_closed([&all, &ends].into_iter()), "each of two edges has two sides more on it");
}
