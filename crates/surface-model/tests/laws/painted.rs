//! Meshes with colours, read back by other code; meshes in smaller triangles.

use std::collections::HashMap;

use facemill_surface_model::{ExportError, TriMesh, write_painted_glb};
use nalgebra::{Point3, Vector3};
use serde_json::Value;

/// A tetrahedron with long and short sides.
fn tetrahedron() -> TriMesh {
    let p = [[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 1.0, 7.0]].map(Point3::from);
    TriMesh::new(p.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap()
}

/// The crate that reads glTF finds the same points, +Y up, and the colours as light; the JSON meets
/// the requirements of the format.
#[test]
fn colours_come_back_as_light_and_the_file_is_what_gltf_asks() {
    let mesh = tetrahedron();
    let colours = [[255, 0, 0], [0, 128, 255], [10, 200, 30], [255, 255, 255]];
    let bytes = write_painted_glb("deviation", &mesh, &colours).unwrap();
    assert_eq!(bytes, write_painted_glb("deviation", &mesh, &colours).unwrap());

    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = blob.unwrap();
    let node = document.default_scene().or(document.scenes().next()).unwrap().nodes().next().unwrap();
    assert_eq!(node.name(), Some("deviation"));
    let primitive = node.mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&blob));
    let points: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    for (found, p) in points.iter().zip(mesh.vertices()) {
        let expected = Vector3::new(p.x, p.z, -p.y) * 1e-3;
        assert!((Vector3::from(found.map(f64::from)) - expected).amax() < 1e-8);
    }
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices, mesh.triangles().concat());
    let found: Vec<[f32; 4]> = reader.read_colors(0).unwrap().into_rgba_f32().collect();
    assert_eq!(found.len(), 4);
    for (found, srgb) in found.iter().zip(colours) {
        assert_eq!(found[3], 1.0);
        for (light, byte) in found.iter().zip(srgb) {
            // The reverse: from light to screen values.
            let l = f64::from(*light);
            let c = if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
            assert!((c * 255.0 - f64::from(byte)).abs() < 0.1, "{c} {byte}");
        }
    }
    let material = primitive.material();
    assert!(material.double_sided() && material.pbr_metallic_roughness().metallic_factor() == 0.0);

    // The container by hand: lengths, alignment, and no dangling references.
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], u32_at(4), u32_at(8)), (&b"glTF"[..], 2, bytes.len()));
    let json_length = u32_at(12);
    let json: Value = serde_json::from_slice(&bytes[20..20 + json_length]).unwrap();
    let bin_length = u32_at(20 + json_length);
    assert_eq!(28 + json_length + bin_length, bytes.len());
    let views = json["bufferViews"].as_array().unwrap();
    let size = |a: &Value| match (a["componentType"].as_u64().unwrap(), a["type"].as_str().unwrap()) {
        (5126, "VEC3") => 12,
        (5123, "VEC4") => 8,
        (5125, "SCALAR") => 4,
        other => panic!("{other:?}"),
    };
    for a in json["accessors"].as_array().unwrap() {
        let view = &views[a["bufferView"].as_u64().unwrap() as usize];
        let (start, length) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
        let at = a["byteOffset"].as_u64().unwrap();
        assert!(at + size(a) * a["count"].as_u64().unwrap() <= length && start + length <= bin_length as u64);
        assert_eq!((start + at) % 4, 0);
    }
    let color = json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64().unwrap() as usize;
    assert_eq!(json["accessors"][color]["normalized"], true);
    assert_eq!(json["accessors"][color]["count"], 4);

    assert_eq!(write_painted_glb("x", &mesh, &colours[1..]), Err(ExportError::Colours { n_colours: 3, n_vertices: 4 }));
    assert_eq!(write_painted_glb("x", &TriMesh::default(), &[]), Err(ExportError::Empty));
}

/// Edges are short, every edge still has one triangle on each side, areas and normals are those of
/// the parents, and the limit holds.
#[test]
fn refined_triangles_are_the_same_surface_without_gaps() {
    let mesh = tetrahedron();
    for edge in [100.0, 5.0, 0.9] {
        let fine = mesh.refined(edge, 1_000_000);
        assert!(!fine.is_coarse && fine.parents.len() == fine.mesh.triangles().len());
        let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
        let mut areas = [Vector3::zeros(); 4];
        for (t, parent) in fine.mesh.triangles().iter().zip(&fine.parents) {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *sides.entry((a, b)).or_default() += 1;
                assert!((fine.mesh.vertices()[a as usize] - fine.mesh.vertices()[b as usize]).norm() <= edge);
            }
            let [a, b, c] = t.map(|v| fine.mesh.vertices()[v as usize]);
            let area = (b - a).cross(&(c - a));
            assert!(area.dot(&mesh.scaled_normal(*parent as usize)) > 0.0);
            areas[*parent as usize] += area;
        }
        assert!(sides.iter().all(|(&(a, b), &n)| n == 1 && sides.get(&(b, a)) == Some(&1)));
        assert!((0..4).all(|t| (areas[t] - mesh.scaled_normal(t)).amax() < 1e-9));
    }
    let coarse = mesh.refined(0.01, 500);
    assert!(coarse.is_coarse && (125..=500).contains(&coarse.mesh.triangles().len()));
}
