use super::*;

/// A closed plate, much thinner than its cells are wide, with `n` × `n` squares on each side.
fn plate(n: u32, thickness: f64) -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for z in [0.0, thickness] {
        for j in 0..=n {
            for i in 0..=n {
                vertices.push(Point3::new(f64::from(i), f64::from(j), z));
            }
        }
    }
    let at = |side: u32, i: u32, j: u32| side * (n + 1) * (n + 1) + j * (n + 1) + i;
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(1, i, j), at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
            let [a, b, c, d] = [at(0, i, j), at(0, i + 1, j), at(0, i + 1, j + 1), at(0, i, j + 1)];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    TriMesh::new(vertices, triangles).expect("a mesh")
}

#[test]
fn a_thinned_mesh_has_no_more_triangles_than_permitted_and_keeps_both_sides_of_a_thin_wall() {
    let mesh = plate(60, 0.1);
    let thin = thinned(&mesh, 2000);
    assert!(thin.triangles.len() <= 2000 && thin.triangles.len() > 500, "{}", thin.triangles.len());
    let on = |z: f64| thin.vertices.iter().filter(|p| (p.z - z).abs() < 1e-9).count();
    assert_eq!(on(0.0) + on(0.1), thin.vertices.len(), "vertices stay on their side");
    assert!(on(0.0) > 100 && on(0.1) > 100);
    for (p, n) in thin.vertices.iter().zip(&thin.normals) {
        assert!(n.z * (p.z - 0.05) > 0.0, "normals point outward");
    }
}

#[test]
fn a_small_mesh_stays_as_it_is() {
    let mesh = plate(3, 1.0);
    let thin = thinned(&mesh, 1000);
    assert_eq!(thin.triangles, mesh.triangles());
    assert_eq!(thin.vertices, mesh.vertices());
}

#[test]
fn triangles_of_two_meshes_are_joined_once() {
    let mesh = plate(4, 1.0);
    let half = TriMesh::new(mesh.vertices().to_vec(), mesh.triangles()[..10].to_vec()).expect("a mesh");
    assert_eq!(joined_once([&half, &mesh].into_iter()).triangles().len(), mesh.triangles().len());
}

#[test]
fn an_outline_is_the_hull_of_its_points() {
    let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
    let mut points = square.to_vec();
    points.extend([[1.0, 1.0], [1.0, 0.0], [0.5, 1.5], [2.0, 2.0]]);
    assert_eq!(outline(points), square);
    assert!(outline(vec![[f64::NAN, 0.0]]).is_empty());
}
