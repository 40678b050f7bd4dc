use crate::mesh::topology::*;
use crate::test_kit::{cuboid, torus};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

fn topology(mesh: &TriMesh) -> Topology {
    Topology::of(mesh, &Edges::of(mesh))
}

fn reversed(mesh: &TriMesh) -> TriMesh {
    TriMesh::new(mesh.vertices().to_vec(), mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect()).unwrap()
}

#[test]
fn volumes_of_closed_components_are_those_of_the_shapes() {
    let cube = cuboid(Point3::new(100.0, 0.0, 0.0), Point3::new(102.0, 3.0, 4.0));
    let t = topology(&cube.clone().joined(&reversed(&cube)).joined(&torus(5.0, 2.0, 200)));
    assert_eq!((t.n_open_edges, t.n_non_manifold_edges, t.n_miswound_edges), (0, 0, 0));
    let volumes: Vec<f64> = t.components.iter().map(|c| c.volume_mm3.unwrap()).collect();
    assert!((volumes[0] - 24.0).abs() < 1e-9 && (volumes[1] + 24.0).abs() < 1e-9);
    assert!((volumes[2] / (2.0 * PI * PI * 5.0 * 4.0) - 1.0).abs() < 1e-3);
    assert_eq!(t.components.iter().map(Component::is_inverted).collect::<Vec<_>>(), [false, true, false]);
    assert_eq!(t.component_of[11..13], [0, 1]);
}

#[test]
fn a_missing_triangle_opens_three_edges_and_a_turned_one_miswinds_three() {
    let cube = cuboid(Point3::origin(), Point3::from(Vector3::repeat(1.0)));
    let open = TriMesh::new(cube.vertices().to_vec(), cube.triangles()[1..].to_vec()).unwrap();
    let t = topology(&open);
    assert_eq!((t.n_open_edges, t.components.len(), t.components[0].closed), (3, 1, false));
    assert_eq!(t.components[0].volume_mm3, None);
    let mut triangles = cube.triangles().to_vec();
    triangles[0].swap(1, 2);
    let t = topology(&TriMesh::new(cube.vertices().to_vec(), triangles).unwrap());
    assert_eq!((t.n_open_edges, t.n_miswound_edges, t.components[0].closed), (0, 3, false));
}

#[test]
fn two_solids_that_share_an_edge_stay_closed() {
    // Two boxes touching in an edge with shared vertices: four triangles on it, two each way.
    let a = cuboid(Point3::origin(), Point3::from(Vector3::repeat(1.0)));
    let b = cuboid(Point3::new(1.0, 1.0, 0.0), Point3::new(2.0, 2.0, 1.0));
    // Vertices 3 and 7 of the first box are vertices 0 and 4 of the second.
    let joint = |v: u32| match v {
        0 => 3,
        4 => 7,
        v => v + 8,
    };
    let vertices = [a.vertices(), b.vertices()].concat();
    let triangles = a.triangles().iter().copied().chain(b.triangles().iter().map(|t| t.map(joint))).collect();
    let t = topology(&TriMesh::new(vertices, triangles).unwrap());
    assert_eq!((t.n_open_edges, t.n_non_manifold_edges, t.components.len()), (0, 1, 1));
    assert!((t.components[0].volume_mm3.unwrap() - 2.0).abs() < 1e-12);
}
