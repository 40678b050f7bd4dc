//! glTF documents of every kind, sound and broken.
use facemill_surface_model::{ImportSettings, MeshFormat, TriMesh, import_mesh, no_external_files};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::io;

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bytes
        .chunks(3)
        .flat_map(|c| {
            let n = c.iter().fold(0u32, |n, &b| n << 8 | u32::from(b)) << (8 * (3 - c.len()));
            (0..4).map(move |k| if k <= c.len() { DIGITS[(n >> (18 - 6 * k) & 63) as usize] as char } else { '=' })
        })
        .collect()
}

/// A unit square in the xy plane (glTF frame, metres) with any indices; the buffer holds positions,
/// then indices.
fn square(mode: u32, index_type: Option<u32>, indices: &[u32]) -> Value {
    let mut bytes: Vec<u8> = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    for &i in indices {
        let size = match index_type {
            Some(5121) => 1,
            Some(5123) => 2,
            _ => 4,
        };
        bytes.extend(&i.to_le_bytes()[..size]);
    }
    let mut primitive = json!({"attributes": {"POSITION": 0, "_OWN": 0, "NORMAL": 7}, "mode": mode});
    if index_type.is_some() {
        primitive["indices"] = json!(1);
    }
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "square"}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": index_type.unwrap_or(5125), "count": indices.len().max(1), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": bytes.len() - 48},
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:;base64,{}", base64(&bytes))}],
    })
}

fn push(document: &mut Value, list: &str, value: Value) {
    document[list].as_array_mut().unwrap().push(value);
}

fn plain_square() -> Value {
    square(4, Some(5123), &[0, 1, 2, 0, 2, 3])
}

fn read_with(document: &Value, resolve: &dyn Fn(&str) -> io::Result<Vec<u8>>) -> Result<TriMesh, String> {
    let settings = ImportSettings::default_for(MeshFormat::Gltf);
    import_mesh("p.gltf", document.to_string().as_bytes(), MeshFormat::Gltf, &settings, resolve)
        .map(|i| i.mesh)
        .map_err(|e| e.to_string())
}

fn read(document: &Value) -> Result<TriMesh, String> {
    read_with(document, &no_external_files)
}

fn area_vector(mesh: &TriMesh) -> Vector3<f64> {
    (0..mesh.triangles().len()).map(|t| mesh.scaled_normal(t) * 0.5).sum()
}

/// The square's area in mm², normal +z, which is −y with +Z up.
const AREA: Vector3<f64> = Vector3::new(0.0, -1e6, 0.0);

#[test]
fn every_mode_and_index_type_gives_the_same_square() {
    let mut documents = vec![];
    for index_type in [5121, 5123, 5125] {
        documents.push(square(4, Some(index_type), &[0, 1, 2, 0, 2, 3]));
        documents.push(square(5, Some(index_type), &[0, 1, 3, 2]));
        documents.push(square(6, Some(index_type), &[1, 2, 3, 0]));
    }
    documents.push(square(6, None, &[]));
    for document in documents {
        let mesh = read(&document).unwrap();
        assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (4, 2));
        assert!((area_vector(&mesh) - AREA).norm() < 1e-6, "{document}");
        assert_eq!(mesh.groups()[0].name, "square");
    }
    // Positions without indices, taken as a list: the fourth makes no triangle.
    let found = read(&square(4, None, &[])).unwrap_err();
    assert!(found.contains("meshes[0].primitives[0]: 4 indices do not make triangles"), "{found}");
}

#[test]
fn nodes_move_turn_scale_and_mirror() {
    let mut document = plain_square();
    document["nodes"] = json!([
        {"name": "root", "translation": [0, 0, 1], "rotation": [0, 0, 1, 1], "children": [1, 2, 3]},
        {"name": "a", "mesh": 0, "scale": [2, 1, 1]},
        {"name": "mirrored", "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
        {"mesh": 0, "children": []},
    ]);
    document["meshes"][0]["name"] = json!("of mesh");
    let mesh = read(&document).unwrap();
    let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["a", "mirrored", "of mesh"]);
    let part = |name: &str| mesh.select_groups(|n| n == name);
    assert!((area_vector(&part("a")) - 2.0 * AREA).norm() < 1.0);
    // Mirroring turns the winding too, so the normal is unchanged.
    assert!((area_vector(&part("mirrored")) - AREA).norm() < 1.0);
    // Turned by 90° about z: (1, 0, 0) becomes (0, 1, 0), and 2 m along x become 2 m along y, which
    // is +Z here.
    let aabb = part("a").aabb();
    assert!((aabb.max.z - 2000.0).abs() < 1e-3 && (aabb.min.y + 1000.0).abs() < 1e-3, "{aabb:?}");
    assert!((part("mirrored").aabb().min.y + 6000.0).abs() < 1e-3);
}

#[test]
fn cyclic_and_shared_nodes_are_errors() {
    for nodes in [
        json!([{"mesh": 0, "children": [0]}]),
        json!([{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [1]}]),
        json!([{"children": [1, 1]}, {"mesh": 0}]),
    ] {
        let mut document = plain_square();
        document["nodes"] = nodes;
        let found = read(&document).unwrap_err();
        assert!(found.contains("it is reached twice: the nodes are cyclic, or it has two parents"), "{found}");
    }
    // Without any scene a cycle has no root, so nothing is left.
    let mut document = plain_square();
    document["nodes"] = json!([{"mesh": 0, "children": [0]}]);
    document.as_object_mut().unwrap().retain(|k, _| !k.starts_with("scene"));
    assert!(read(&document).unwrap_err().contains("no triangle"));
    document["nodes"] = json!([{"children": [1]}, {"mesh": 0}]);
    assert!(read(&document).is_ok());
}

#[test]
fn sparse_positions_are_put_in_place() {
    let mut document = plain_square();
    let bytes: Vec<u8> =
        [2u8, 0, 0, 0].into_iter().chain([2f32, 2.0, 0.0].iter().flat_map(|x| x.to_le_bytes())).collect();
    push(
        &mut document,
        "buffers",
        json!({"byteLength": 16, "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes))}),
    );
    push(&mut document, "bufferViews", json!({"buffer": 1, "byteLength": 16}));
    let sparse = json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 2, "byteOffset": 4}});
    document["accessors"][0]["sparse"] = sparse;
    let mesh = read(&document).unwrap();
    assert_eq!(mesh.aabb().max.x, 2000.0);
    assert!((area_vector(&mesh).norm() - 2e6).abs() < 1e-3);
    document["accessors"][0]["count"] = json!(2);
    assert!(
        read(&document)
            .unwrap_err()
            .contains("accessors[0] (used by meshes[0].primitives[0]): a sparse index is out of range")
    );
}

#[test]
fn strided_and_external_buffers_are_read() {
    let mut document = plain_square();
    let mut bytes = Vec::new();
    for (k, p) in [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].iter().enumerate() {
        bytes.extend([k as u8; 4]);
        bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
    }
    push(&mut document, "buffers", json!({"byteLength": 64, "uri": "a%20b.bin"}));
    document["bufferViews"][0] = json!({"buffer": 1, "byteLength": 64, "byteStride": 16});
    document["accessors"][0]["byteOffset"] = json!(4);
    // Other buffers and images are not requested.
    push(&mut document, "buffers", json!({"byteLength": 64, "uri": "animation.bin"}));
    document["images"] = json!([{"uri": "texture.png"}]);
    let resolve = |uri: &str| if uri == "a b.bin" { Ok(bytes.clone()) } else { Err(io::Error::other(uri.to_owned())) };
    assert!((area_vector(&read_with(&document, &resolve).unwrap()) - AREA).norm() < 1e-6);
    assert!(read(&document).unwrap_err().contains("the buffer \"a b.bin\" it refers to cannot be read"));
    let found = read_with(&document, &|_| Ok(bytes[..60].to_vec())).unwrap_err();
    assert!(found.contains("buffers[1]") && found.contains("is to hold 64 bytes, but there are only 60"), "{found}");
}

#[test]
fn what_cannot_be_read_is_refused_with_its_place() {
    let cases: Vec<(&str, Value, &str)> = vec![
        (
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "compressed geometry (KHR_draco_mesh_compression) is not read",
        ),
        (
            "/extensionsRequired",
            json!(["EXT_meshopt_compression"]),
            "compressed geometry (EXT_meshopt_compression) is not read",
        ),
        ("/extensionsRequired", json!(["ACME_warp"]), "the extension ACME_warp"),
        ("/extensionsUsed", json!(["EXT_mesh_gpu_instancing"]), "instancing by EXT_mesh_gpu_instancing"),
        ("/accessors/0/componentType", json!(5122), "accessors[0]: positions that are not float"),
        ("/accessors/0/componentType", json!(1), "accessors[0] (used by meshes[0].primitives[0])"),
        ("/accessors/0/type", json!("VEC2"), "positions must be of type VEC3"),
        (
            "/accessors/0/count",
            json!(5),
            "bufferViews[0] (used by meshes[0].primitives[0]): it is shorter than the accessor",
        ),
        ("/accessors/0/count", json!(u64::MAX), "bufferViews[0]"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "bufferViews[0]"),
        ("/accessors/0/bufferView", json!(9), "bufferViews[9] (used by meshes[0].primitives[0]): it does not exist"),
        (
            "/accessors/0/bufferView",
            Value::Null,
            "accessors[0] (used by meshes[0].primitives[0]): it has no buffer view",
        ),
        ("/accessors/1/componentType", json!(5126), "accessors[1] (used by meshes[0].primitives[0]): indices must be"),
        ("/accessors/1/type", json!("VEC3"), "indices must be of type SCALAR"),
        (
            "/bufferViews/0/byteOffset",
            json!(100),
            "bufferViews[0] (used by meshes[0].primitives[0]): it reaches beyond",
        ),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "it reaches beyond"),
        ("/bufferViews/0/byteStride", json!(0), "its stride is less than the size of an element"),
        ("/bufferViews/0/buffer", json!(3), "buffers[3]"),
        ("/buffers/0/byteLength", json!(20), "it reaches beyond"),
        ("/buffers/0/byteLength", json!(4000), "there are only 60"),
        ("/buffers/0/uri", json!("data:;base64,A"), "its data cannot be decoded"),
        ("/buffers/0/uri", Value::Null, "buffers[0] (used by meshes[0].primitives[0]): it has no data"),
        ("/meshes/0/primitives/0/attributes", json!({}), "meshes[0].primitives[0]: it has no POSITION"),
        ("/meshes/0/primitives/0/attributes", json!({"POSITION": 4}), "accessors[4]"),
        ("/meshes/0/primitives/0/indices", json!(4), "accessors[4]"),
        ("/meshes/0/primitives/0/mode", json!(17), "mode is not known"),
        ("/meshes/0/primitives/0/mode", json!(1), "no triangle"),
        ("/meshes/0/weights", json!([0.5]), "nodes[0]: a skinned or morphed mesh"),
        ("/nodes/0/mesh", json!(1), "meshes[1]: it does not exist"),
        ("/nodes/0/children", json!([5]), "nodes[5]: it does not exist"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "nodes[0]: its rotation is zero"),
        ("/nodes/0/translation", json!([1e39, 0, 0]), ""),
        ("/nodes/0/skin", json!(0), "nodes[0]: a skinned or morphed mesh"),
        ("/scene", json!(2), "scenes[2]"),
        ("/scenes/0/nodes", json!([4]), "nodes[4]"),
        ("/asset", Value::Null, "the glTF document cannot be read"),
    ];
    for (pointer, value, message) in cases {
        let mut document = plain_square();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        document.pointer_mut(parent).unwrap()[key] = value.clone();
        let found = read(&document).expect_err(pointer);
        assert!(found.starts_with("p.gltf: ") && found.contains(message), "{pointer} {value}: {found}");
    }
    let index = read(&square(4, Some(5121), &[0, 1, 4])).unwrap_err();
    assert!(index.contains("meshes[0].primitives[0]: its index 2 is 4, but there are only 4 vertices"), "{index}");
}

#[test]
fn harmless_extensions_may_be_required() {
    let mut document = plain_square();
    document["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]);
    assert!(read(&document).is_ok());
}

#[test]
fn nan_positions_are_found() {
    let mut document = plain_square();
    let mut bytes: Vec<u8> = [0f32; 12].iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes[28..32].copy_from_slice(&f32::NAN.to_le_bytes());
    bytes.extend([0; 12]);
    document["buffers"][0]["uri"] = json!(format!("data:;base64,{}", base64(&bytes)));
    let found = read(&document).unwrap_err();
    assert!(
        found.contains("vertex 2 of meshes[0].primitives[0] has a coordinate that is not a finite number"),
        "{found}"
    );
}
