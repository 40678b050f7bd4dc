//! Groups of a binary glTF file, read with no code of the product.

use std::path::Path;

use nalgebra::Point3;
use serde_json::Value;

/// A group of a mesh: its name, and its triangles in the part's frame, mm.
pub type Group = (String, Vec<[Point3<f64>; 3]>);

/// Returns the groups of a binary glTF file in metres, y up, without transforms.
///
/// # Panics
/// When the file cannot be read, or is of another kind.
pub fn groups_of(file: &Path) -> Vec<Group> {
    let bytes = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    let gltf: Value = serde_json::from_slice(&bytes[20..20 + word(12)]).expect("JSON");
    let binary = 20 + word(12) + 8;
    let number = |value: &Value, key: &str| value.get(key).map_or(0, |n| n.as_u64().expect("a whole number") as usize);
    let start = |accessor: &Value| {
        let view = &gltf["bufferViews"][number(accessor, "bufferView")];
        binary + number(view, "byteOffset") + number(accessor, "byteOffset")
    };
    let group = |node: &Value| {
        let primitive = &gltf["meshes"][number(node, "mesh")]["primitives"][0];
        let positions = start(&gltf["accessors"][number(&primitive["attributes"], "POSITION")]);
        let of_indices = &gltf["accessors"][number(primitive, "indices")];
        let (indices, is_short) = (start(of_indices), number(of_indices, "componentType") == 5123);
        let index = |k: usize| match is_short {
            true => u16::from_le_bytes([bytes[indices + 2 * k], bytes[indices + 2 * k + 1]]) as usize,
            false => word(indices + 4 * k),
        };
        let vertex = |k: usize| {
            let [x, y, z] = [0, 4, 8].map(|c| 1000.0 * f64::from(f32::from_bits(word(positions + 12 * k + c) as u32)));
            Point3::new(x, -z, y)
        };
        let triangles = (0..number(of_indices, "count") / 3).map(|t| [0, 1, 2].map(|c| vertex(index(3 * t + c))));
        (node["name"].as_str().expect("a name").to_owned(), triangles.collect())
    };
    let nodes = gltf["nodes"].as_array().expect("nodes");
    nodes.iter().filter(|node| node.get("mesh").is_some()).map(group).collect()
}
