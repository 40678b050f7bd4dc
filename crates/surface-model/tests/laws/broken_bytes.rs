//! No bytes make the reader panic or hang, and no truncated bytes pass for a whole file.
use facemill_surface_model::{
    ImportSettings, MeshFormat, NamedNode, TriMesh, import_mesh, no_external_files, write_glb, write_obj,
    write_stl_binary,
};
use nalgebra::{Isometry3, Point3};

fn tetrahedron() -> TriMesh {
    let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let vertices = vec![p(0.0, 0.0, 0.0), p(1.5, 0.0, 0.0), p(0.0, 2.5, 0.0), p(0.0, 0.0, 3.5)];
    TriMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap()
}

fn samples() -> Vec<(MeshFormat, Vec<u8>)> {
    let mesh = tetrahedron();
    let nodes = ["a", "b"].map(|name| NamedNode { name, mesh: 0, transform: Isometry3::translation(0.0, 9.0, 0.0) });
    let stl: String = (0..4)
        .map(|t| {
            let corner = |p: Point3<f64>| format!("vertex {} {} {}\n", p.x, p.y, p.z);
            let corners: String = mesh.corners(t).map(corner).concat();
            format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
        })
        .collect();
    vec![
        (MeshFormat::Gltf, write_glb(&[&mesh], &nodes).unwrap()),
        (MeshFormat::Obj, write_obj(&[&mesh], &nodes).unwrap()),
        (MeshFormat::Stl, write_stl_binary(&[&mesh], &nodes).unwrap()),
        (MeshFormat::Stl, format!("solid t\n{stl}endsolid t\n").into_bytes()),
    ]
}

fn import(bytes: &[u8], format: MeshFormat) -> bool {
    import_mesh("x", bytes, format, &ImportSettings::default_for(format), &no_external_files).is_ok()
}

#[test]
fn cut_off_files_are_errors_in_formats_that_can_tell() {
    for (format, bytes) in samples() {
        assert!(import(&bytes, format));
        for n in 0..bytes.len() {
            let sound = import(&bytes[..n], format);
            // An OBJ file has no end of its own, and an ASCII STL ends with its keyword, whatever
            // follows.
            let has_end = format != MeshFormat::Obj && n + 3 < bytes.len();
            assert!(!(sound && has_end), "{format:?} cut to {n} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn changed_bytes_never_panic() {
    let mut state = facemill_test_kit::Random(1);
    let mut random = |n: usize| (state.bits() >> 33) as usize % n;
    const PIECES: [&[u8]; 12] = [
        b"-1",
        b"9999999999",
        b"4294967295",
        b"1e308",
        b"nan",
        b"\\\n",
        b"null",
        b"[]",
        b"\0",
        b"\xff\xff\xff\xff",
        b"-",
        b"0",
    ];
    for (format, sample) in samples() {
        for _ in 0..3000 {
            let mut bytes = sample.clone();
            for _ in 0..1 + random(4) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes[at] = random(256) as u8,
                    1 => drop(bytes.splice(at..at, PIECES[random(PIECES.len())].iter().copied())),
                    2 => {
                        let piece = PIECES[random(PIECES.len())];
                        let end = (at + piece.len()).min(bytes.len());
                        bytes.splice(at..end, piece.iter().copied());
                    }
                    _ => {
                        let end = (at + 1 + random(20)).min(bytes.len());
                        bytes.drain(at..end);
                    }
                }
                if bytes.is_empty() {
                    bytes.push(b' ');
                }
            }
            import(&bytes, format);
        }
    }
}

#[test]
fn a_glb_header_shorter_than_itself_is_an_error() {
    let (_, mut glb) = samples().swap_remove(0);
    for length in [0u32, 11, 12, 19, u32::MAX] {
        glb[8..12].copy_from_slice(&length.to_le_bytes());
        assert!(!import(&glb, MeshFormat::Gltf), "{length}");
    }
}

/// A count of a billion triangles in a file of some hundred bytes, with and without ASCII before
/// it, reserves nothing and is an error.
#[test]
fn a_billion_announced_triangles_are_an_error() {
    let (_, sound) = samples().remove(2);
    assert!(import(&sound, MeshFormat::Stl));
    for count in [1_000_000_000_u32, u32::MAX, 85_899_346] {
        for title in [&b"binary"[..], b"solid t"] {
            let mut bytes = sound.clone();
            bytes[..title.len()].copy_from_slice(title);
            bytes[80..84].copy_from_slice(&count.to_le_bytes());
            assert!(!import(&bytes, MeshFormat::Stl), "{count}");
        }
    }
}
