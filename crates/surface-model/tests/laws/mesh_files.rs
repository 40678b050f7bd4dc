//! Files of every kind, sound and broken, through the public reader.
use facemill_surface_model::{
    ImportFault, ImportSettings, Imported, LengthUnit, MeshFormat, TriMesh, UpAxis, import_mesh, no_external_files,
};
use nalgebra::{Matrix3, Point3, Vector3};

fn import(bytes: &[u8], format: MeshFormat) -> Result<Imported, ImportFault> {
    import_mesh("part", bytes, format, &ImportSettings::default_for(format), &no_external_files).map_err(|e| e.fault)
}

fn error(bytes: &[u8], format: MeshFormat) -> String {
    let settings = ImportSettings::default_for(format);
    import_mesh("blade.x", bytes, format, &settings, &no_external_files).unwrap_err().to_string()
}

fn area_vector(mesh: &TriMesh) -> Vector3<f64> {
    (0..mesh.triangles().len()).map(|t| mesh.scaled_normal(t) * 0.5).sum()
}

fn group_names(mesh: &TriMesh) -> Vec<&str> {
    mesh.groups().iter().map(|g| g.name.as_str()).collect()
}

/// A unit cube, each face an object of its own with vertices of its own.
fn cube_of_objects() -> String {
    let corner = |k: usize| format!("v {} {} {}\n", k & 1, k >> 1 & 1, k >> 2 & 1);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let side = |(k, f): (usize, &[usize; 4])| {
        format!("o side {k}\n{}f -4 -3 -2 -1\n", f.iter().map(|&v| corner(v)).collect::<String>())
    };
    faces.iter().enumerate().map(side).collect()
}

#[test]
fn obj_objects_with_vertices_of_their_own_are_welded_to_a_solid() {
    let Imported { mesh, report } = import(cube_of_objects().as_bytes(), MeshFormat::Obj).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (8, 12));
    assert_eq!(group_names(&mesh), ["side 0", "side 1", "side 2", "side 3", "side 4", "side 5"]);
    assert_eq!((report.n_welded_vertices, report.n_open_edges, report.n_components, report.n_closed), (16, 0, 1, 1));
    assert!((report.components[0].volume_mm3.unwrap() - 1.0).abs() < 1e-15);
}

#[test]
fn obj_in_all_its_spellings() {
    let text = "# comment\r\nmtllib no such file.mtl\nv 0 0 0 0.5 0.5 0.5 # colour\nv 2 0 0\nv 4 4 0 2\nv 0 2 0 1 0 0\n\
                vt 0 0\nvn 0 0 1\nusemtl red\n  g  a  b \nf 1/1 2/99999999999999999999/1 -2//-5 \\\n 4 # behind\n\
                usemtl blue\nl 1 2\np 1\ng\nf 1 2 3\ns off\n";
    let Imported { mesh, report } = import(text.as_bytes(), MeshFormat::Obj).unwrap();
    assert_eq!(group_names(&mesh), ["a b"], "the last face is a duplicate of half the quad");
    assert_eq!((report.n_triangles_in, report.n_duplicates), (3, 1));
    assert_eq!(area_vector(&mesh), Vector3::new(0.0, 0.0, 4.0));
}

#[test]
fn obj_faces_may_stand_before_their_vertices() {
    let text = "g late\nf 1 2 3\nv 0 0 0\nv 1 0 0\ng other\nv 0 1 0\nv 0 0 1\nf -1 -2 -3\n";
    let mesh = import(text.as_bytes(), MeshFormat::Obj).unwrap().mesh;
    assert_eq!((group_names(&mesh), mesh.triangles().len()), (vec!["late", "other"], 2));
    assert_eq!(mesh.corners(0), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from));
}

#[test]
fn obj_errors_name_the_line() {
    let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, message) in [
        ("v 0 nan 0\n", "the vertex in line 4 has a coordinate that is not a finite number"),
        ("v 0 0 1 0\n", "the vertex in line 4 has"),
        ("v 0 0\n", "line 4: a vertex needs three coordinates, there are 2"),
        ("v 0 0 x\n", "line 4: \"x\" is not a number"),
        ("\nf 1 2 4\n", "line 5: the face uses vertex 4, but there are 3, 3 of them before it"),
        ("f 1 2 0\n", "line 4: the face uses vertex 0"),
        ("f 1 2 -4\n", "line 4: the face uses vertex -4"),
        ("f 1 2 -9223372036854775808\n", "line 4: the face uses vertex"),
        ("f 1 2\n", "line 4: a face needs three corners, there are 2"),
        ("f 1 2 a/1\n", "line 4: \"a/1\" is not a face corner"),
        ("f 1 2 2\n", "there is no triangle with an area in it (1 without)"),
        ("", "there is no triangle with an area in it (0 without)"),
    ] {
        let found = error(format!("{start}{text}").as_bytes(), MeshFormat::Obj);
        assert!(found.starts_with("blade.x: ") && found.contains(message), "{text:?}: {found}");
    }
}

const TRIANGLE: &str =
    "facet normal 0 0 nan\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\nendfacet\n";

#[test]
fn stl_text_in_all_its_spellings() {
    let other = TRIANGLE.replace("0 1 0", "0 1 5e-1");
    for text in [
        format!("solid\n{TRIANGLE}{other}endsolid\n"),
        format!("solid   facet\r\n{TRIANGLE}{other}endsolid facet\n").replace('\n', "\r\n"),
        format!("\u{feff}\n SOLID\n{TRIANGLE}{other}ENDSOLID\n").to_uppercase().replace("NAN", "nan"),
        format!("solid a\n{TRIANGLE}endsolid\nsolid b\n{other}endsolid b"),
    ] {
        let Imported { mesh, report } = import(text.as_bytes(), MeshFormat::Stl).unwrap();
        assert_eq!((mesh.vertices().len(), report.n_welded_vertices), (4, 2));
        assert_eq!(area_vector(&mesh), Vector3::new(0.0, -0.25, 1.0));
        if text.contains("solid b") {
            assert_eq!(group_names(&mesh), ["a", "b"]);
        }
    }
}

#[test]
fn stl_text_errors_name_the_line() {
    for (text, message) in [
        (format!("solid\n{TRIANGLE}"), "line 8: the file ends here"),
        (
            format!("solid\n{}", &TRIANGLE[..44]),
            "line 4: the file ends here, where a coordinate is expected: it is truncated",
        ),
        (format!("solid\n{}endsolid", TRIANGLE.replace("1 0 0", "1 inf 0")), "the vertex in line 5 has"),
        (
            format!("solid\n{}endsolid", TRIANGLE.replace("1 0 0", "1 0,5 0")),
            "line 5: a number expected, \"0,5\" found",
        ),
        (
            format!("solid\n{}endsolid", TRIANGLE.replace("endloop", "vertex 1 2 3 endloop")),
            "line 7: \"endloop\" expected",
        ),
        ("solid\nendsolid".into(), "no triangle with an area"),
    ] {
        let found = error(text.as_bytes(), MeshFormat::Stl);
        assert!(found.contains(message), "{text:?}: {found}");
    }
}

fn binary_stl(header: &[u8], triangles: &[[f32; 9]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0xff, 0xff]);
    }
    bytes
}

#[test]
fn binary_stl_whatever_its_header_says() {
    let t = [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]];
    for header in [&b""[..], b"solid", b"SOLID facet normal", b"\0\0"] {
        let mut bytes = binary_stl(header, &t);
        assert_eq!(import(&bytes, MeshFormat::Stl).unwrap().mesh.vertices().len(), 4);
        bytes.extend([0; 7]);
        assert_eq!(import(&bytes, MeshFormat::Stl).unwrap().mesh.triangles().len(), 2, "padded");
        let found = error(&bytes[..150], MeshFormat::Stl);
        assert!(found.contains("byte 150: the header announces 2 triangles, but the file holds 1"), "{found}");
        bytes.extend([0; 50]);
        assert!(error(&bytes, MeshFormat::Stl).contains("byte 80: the header announces 2 triangles"));
    }
    let mut broken = t;
    broken[1][4] = f32::NAN;
    assert!(error(&binary_stl(b"", &broken), MeshFormat::Stl).contains("triangle 1 (byte 134) has a coordinate"));
    assert!(error(b"\0\0\0", MeshFormat::Stl).contains("byte 3: the file ends within the header"));
    assert!(error(b"", MeshFormat::Stl).contains("byte 0: the file ends"));
}

#[test]
fn units_and_axes_give_mm_with_z_up_and_mirror_nothing() {
    for axis in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| axis.to_z_up(v));
        assert_eq!(Matrix3::from_columns(&columns).determinant(), 1.0);
        let up = match axis {
            UpAxis::X => Vector3::x(),
            UpAxis::Y => Vector3::y(),
            UpAxis::Z => Vector3::z(),
        };
        assert_eq!(axis.to_z_up(up), Vector3::z());
    }
    let text = cube_of_objects();
    for (unit, size) in [
        (LengthUnit::Metre, 1e3),
        (LengthUnit::Centimetre, 10.0),
        (LengthUnit::Millimetre, 1.0),
        (LengthUnit::Inch, 25.4),
    ] {
        let settings = ImportSettings { unit, up_axis: UpAxis::Y, weld_tolerance: 0.0 };
        let cube = import_mesh("c", text.as_bytes(), MeshFormat::Obj, &settings, &no_external_files).unwrap();
        let aabb = cube.mesh.aabb();
        assert_eq!((aabb.min, aabb.max), (Point3::new(0.0, -size, 0.0), Point3::new(size, 0.0, size)));
        assert!((cube.report.components[0].volume_mm3.unwrap() / size.powi(3) - 1.0).abs() < 1e-12);
    }
    assert_eq!(MeshFormat::from_extension("GLB"), Some(MeshFormat::Gltf));
    assert_eq!(MeshFormat::from_extension(".stl"), Some(MeshFormat::Stl));
    assert_eq!(MeshFormat::from_extension("step"), None);
}

#[test]
fn welding_is_by_the_tolerance_and_flat_triangles_leave_no_slit() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0.001\nv 1 1 0\nv 0 1 0.001\nf 1 2 3\nf 4 5 6\n";
    let read = |weld_tolerance: f64| {
        let settings = ImportSettings { weld_tolerance, ..ImportSettings::default_for(MeshFormat::Obj) };
        import_mesh("w", text.as_bytes(), MeshFormat::Obj, &settings, &no_external_files).unwrap().report
    };
    assert_eq!((read(1e-6).n_welded_vertices, read(1e-6).n_open_edges, read(1e-6).n_components), (0, 6, 2));
    assert_eq!((read(0.002).n_welded_vertices, read(0.002).n_open_edges, read(0.002).n_components), (2, 4, 1));
    // A cube whose bottom edge 1–2 has a point 9 in it on one side, and a triangle without area to
    // make up for it.
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nv 0.5 0 0\n\
                f 1 3 4 2\nf 5 6 8 7\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\nf 1 9 5\nf 9 6 5\nf 9 2 6\nf 9 1 2\n";
    let report = import(cube.as_bytes(), MeshFormat::Obj).unwrap().report;
    assert_eq!((report.n_turned, report.n_degenerate, report.n_open_edges, report.n_closed), (1, 0, 0, 1));
    assert!((report.components[0].volume_mm3.unwrap() - 1.0).abs() < 1e-12);
}
