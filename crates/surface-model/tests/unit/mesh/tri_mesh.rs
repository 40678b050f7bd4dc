use crate::mesh::tri_mesh::*;
use crate::test_kit::cuboid;

fn group(name: &str, triangles: std::ops::Range<usize>) -> Group {
    Group { name: name.into(), triangles }
}

#[test]
fn faults_are_named_by_index() {
    let p = |x: f64| Point3::new(x, 0.0, 0.0);
    let nan = TriMesh::new(vec![p(0.0), p(f64::NAN)], vec![]);
    assert_eq!(nan, Err(MeshError::NotFinite { vertex: 1 }));
    let index = TriMesh::new(vec![p(0.0)], vec![[0, 0, 0], [0, 1, 0]]);
    assert_eq!(index, Err(MeshError::BadIndex { triangle: 1, vertex: 1, n_vertices: 1 }));
    for (groups, wrong) in [
        (vec![group("a", 0..1)], 0),
        (vec![group("a", 0..1), group("b", 0..2)], 1),
        (vec![group("a", 0..1), group("b", 1..3)], 1),
        (vec![], 0),
    ] {
        let mesh = TriMesh::with_groups(vec![p(0.0)], vec![[0; 3]; 2], groups);
        assert_eq!(mesh, Err(MeshError::BadGroups { group: wrong }));
    }
}

#[test]
fn joining_selecting_and_reversing_keep_triangles_and_groups() {
    let cube = cuboid(Point3::origin(), Point3::new(1.0, 1.0, 1.0));
    let named = TriMesh::with_groups(
        cube.vertices().to_vec(),
        cube.triangles().to_vec(),
        vec![group("a", 0..3), group("empty", 3..3), group("b", 3..12)],
    )
    .unwrap();
    let moved = named.transformed(&Isometry3::translation(5.0, 0.0, 0.0));
    let both = named.clone().joined(&moved);
    assert_eq!(
        [0, 2, 3, 11, 12, 23, 24].map(|t| both.group_of(t)),
        [Some(0), Some(0), Some(2), Some(2), Some(3), Some(5), None]
    );
    let b = both.select_groups(|name| name == "b");
    assert_eq!((b.triangles().len(), b.groups().len()), (18, 2));
    assert_eq!(b.corners(9), moved.corners(3));
    assert_eq!(both.aabb().max.x, 6.0);
    let inside_out = named.clone().reversed();
    assert!((0..12).all(|t| inside_out.scaled_normal(t) == -named.scaled_normal(t)));
}
