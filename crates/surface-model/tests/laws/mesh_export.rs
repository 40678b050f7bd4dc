//! A written mesh is read back as it was.
use facemill_surface_model::{
    ExportError, Group, ImportSettings, Imported, MeshFormat, NamedNode, TriMesh, import_mesh, no_external_files,
    write_glb, write_obj, write_stl_binary,
};
use nalgebra::{Isometry3, Point3, Vector3};

/// A curved patch in two groups, no two of its triangles alike.
fn patch() -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([12, 9], |i, j| {
        let [u, v] = [i, j].map(f64::from);
        Point3::new(700.0 + 31.7 * u, 3.3 * v * v, 0.1 * u * v + (u * 0.7).sin())
    });
    let groups = vec![
        Group { name: "suction".into(), triangles: 0..100 },
        Group { name: String::new(), triangles: 100..triangles.len() },
    ];
    TriMesh::with_groups(vertices, triangles, groups).unwrap()
}

fn single(name: &str, mesh: &TriMesh) -> TriMesh {
    let groups = vec![Group { name: name.into(), triangles: 0..mesh.triangles().len() }];
    TriMesh::with_groups(mesh.vertices().to_vec(), mesh.triangles().to_vec(), groups).unwrap()
}

fn read(bytes: &[u8], format: MeshFormat) -> Imported {
    import_mesh("round trip", bytes, format, &ImportSettings::default_for(format), &no_external_files).unwrap()
}

fn assert_same(found: &TriMesh, expected: &TriMesh, tolerance: f64) {
    // Vertices may come back in another order, triangles and their corners do not.
    assert_eq!(found.vertices().len(), expected.vertices().len());
    assert!(found.groups() == expected.groups(), "{:?}", found.groups());
    for t in 0..expected.triangles().len() {
        for (p, q) in found.corners(t).iter().zip(expected.corners(t)) {
            assert!((p - q).amax() <= tolerance, "{p} {q}");
        }
    }
}

fn blades() -> (TriMesh, Vec<Isometry3<f64>>) {
    let turns = (0..3)
        .map(|k| Isometry3::new(Vector3::new(0.0, 0.0, 10.0 * f64::from(k)), Vector3::z() * 2.094_395 * f64::from(k)));
    (single("", &patch()), turns.collect())
}

#[test]
fn one_mesh_in_many_nodes_comes_back_as_groups_of_that_name() {
    let (blade, turns) = blades();
    let names = ["blade 1", "blade \"2\"", "Flügel 3"];
    let nodes: Vec<NamedNode<'_>> =
        names.iter().zip(&turns).map(|(name, t)| NamedNode { name, mesh: 0, transform: *t }).collect();
    let expected = names
        .iter()
        .zip(&turns)
        .map(|(name, t)| single(name, &blade.transformed(t)))
        .reduce(|a, b| a.joined(&b))
        .unwrap();
    let glb = write_glb(&[&blade], &nodes).unwrap();
    assert!(glb.len() < 2 * (blade.vertices().len() * 12 + blade.triangles().len() * 12), "stored once");
    assert_eq!(glb, write_glb(&[&blade], &nodes).unwrap());
    // Single precision at 1.1 m, and of the node's rotation.
    assert_same(&read(&glb, MeshFormat::Gltf).mesh, &expected, 2e-4);
    let obj = write_obj(&[&blade], &nodes).unwrap();
    assert_same(&read(&obj, MeshFormat::Obj).mesh, &expected, 0.0);
    // Half of the last digit of single precision above 1024 mm.
    let stl = read(&write_stl_binary(&[&blade], &nodes).unwrap(), MeshFormat::Stl).mesh;
    assert_same(&stl, &single("", &expected), 6.2e-5);
}

#[test]
fn groups_of_a_mesh_come_back_below_the_node() {
    let mesh = patch();
    let nodes = [NamedNode { name: "blade", mesh: 0, transform: Isometry3::identity() }];
    for (bytes, format) in [
        (write_glb(&[&mesh], &nodes).unwrap(), MeshFormat::Gltf),
        (write_obj(&[&mesh], &nodes).unwrap(), MeshFormat::Obj),
    ] {
        let found = read(&bytes, format);
        let names: Vec<&str> = found.mesh.groups().iter().map(|g| g.name.as_str()).collect();
        assert_eq!(names, ["blade/suction", "blade/1"]);
        assert_eq!(found.mesh.vertices().len(), mesh.vertices().len(), "the seam is welded");
        assert_eq!(found.report.n_components, 1);
    }
}

#[test]
fn glb_chunks_are_aligned_and_bounds_are_those_of_the_data() {
    let (blade, _) = blades();
    let glb = write_glb(&[&blade], &[NamedNode { name: "x", mesh: 0, transform: Isometry3::identity() }]).unwrap();
    let number = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&glb[..4], number(4), number(8)), (&b"glTF"[..], 2, glb.len()));
    let json_length = number(12);
    assert!(json_length % 4 == 0 && &glb[16..20] == b"JSON" && &glb[20 + json_length + 4..][..4] == b"BIN\0");
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    let position = &json["accessors"][0];
    let aabb = blade.aabb();
    let bound = |key: &str, k: usize| position[key][k].as_f64().unwrap() * 1e3;
    assert!((bound("min", 0) - aabb.min.x).abs() < 1e-4 && (bound("max", 1) - aabb.max.z).abs() < 1e-4);
    assert!((bound("min", 2) + aabb.max.y).abs() < 1e-4);
}

#[test]
fn scenes_that_make_no_sense_are_errors() {
    let mesh = patch();
    let node = |mesh: usize| NamedNode { name: "n", mesh, transform: Isometry3::identity() };
    for write in [write_glb, write_obj, write_stl_binary] {
        let missing = ExportError::NoMesh { node: "n".into(), mesh: 1, n_meshes: 1 };
        assert_eq!(write(&[&mesh], &[node(0), node(1)]), Err(missing));
        assert_eq!(write(&[&mesh], &[]), Err(ExportError::Empty));
        assert_eq!(write(&[&TriMesh::default()], &[node(0)]), Err(ExportError::Empty));
        assert!(write(&[&TriMesh::default(), &mesh], &[node(0), node(1)]).is_ok());
    }
}
