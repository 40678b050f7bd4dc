use crate::mesh::edges::*;
use crate::test_kit::{cuboid, torus};
use nalgebra::Point3;

#[test]
fn a_closed_mesh_meets_eulers_formula_and_every_side_has_one_across() {
    for (mesh, characteristic) in [(cuboid(Point3::origin(), Point3::new(1.0, 2.0, 3.0)), 2), (torus(5.0, 2.0, 12), 0)]
    {
        let edges = Edges::of(&mesh);
        let (v, t) = (mesh.vertices().len() as i64, mesh.triangles().len() as i64);
        assert_eq!(v - edges.len() as i64 + t, characteristic);
        for t in 0..mesh.triangles().len() as u32 {
            for k in 0..3 {
                let (u, j) = edges.across(&mesh, t, k).unwrap();
                assert_eq!(edges.across(&mesh, u, j), Some((t, k)));
                assert_eq!(edges.directions(&mesh, edges.of_side(t, k).unwrap()), (1, 1));
            }
        }
    }
}

#[test]
fn no_neighbour_across_open_non_manifold_and_miswound_edges() {
    let points = vec![Point3::origin(); 5];
    let mesh = TriMesh::new(points, vec![[0, 1, 2], [0, 1, 3], [0, 1, 4], [1, 2, 3], [4, 4, 0]]).unwrap();
    let edges = Edges::of(&mesh);
    assert_eq!(edges.across(&mesh, 0, 0), None, "three triangles");
    assert_eq!(edges.across(&mesh, 0, 1), None, "both run from 1 to 2");
    assert_eq!(edges.across(&mesh, 0, 2), None, "open");
    assert_eq!(edges.of_side(4, 0), None, "no length");
    assert_eq!(edges.directions(&mesh, edges.of_side(0, 0).unwrap()), (3, 0));
}
