use nalgebra::Vector3;
use serde::Serialize;

use super::{ExportError, NamedNode, check, named_groups};
use crate::mesh::tri_mesh::TriMesh;

/// Writes binary glTF 2.0 in metres, +Y up.
///
/// Each mesh is stored once, however many nodes use it. A mesh with several groups becomes a node
/// with a child `node/group` for each. Coordinates are rounded to single precision of a metre (at
/// 1.5 m that is 1e-4 mm). The same scene always gives the same bytes.
///
/// # Errors
/// When a node's mesh does not exist, nothing has a triangle, or the data takes more than 4 GiB.
pub fn write_glb(meshes: &[&TriMesh], nodes: &[NamedNode<'_>]) -> Result<Vec<u8>, ExportError> {
    check(meshes, nodes)?;
    let mut document = Document::default();
    let mut bin = Vec::new();
    let stored: Vec<Vec<u32>> = meshes
        .iter()
        .enumerate()
        .map(|(k, m)| if nodes.iter().any(|n| n.mesh == k) { document.store(m, k, &mut bin) } else { Ok(Vec::new()) })
        .collect::<Result<_, _>>()?;
    for node in nodes {
        document.add_node(node, meshes[node.mesh], &stored[node.mesh]);
    }
    document.bytes(bin)
}

/// Converts a point in mm, +Z up, to glTF: metres, +Y up.
fn to_gltf(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.z, -v.y)
}

// Written parts of the glTF schema. They are structs and not a map of values because the order of
// the keys, and with it the bytes, is fixed here.
#[derive(Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    scene: u32,
    scenes: [Scene; 1],
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<Material>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<BufferView>,
    buffers: Vec<Buffer>,
}

#[derive(Serialize)]
struct Asset {
    version: &'static str,
    generator: &'static str,
}

impl Default for Asset {
    fn default() -> Self {
        Self { version: "2.0", generator: "facemill" }
    }
}

#[derive(Default, Serialize)]
struct Scene {
    nodes: Vec<u32>,
}

#[derive(Default, Serialize)]
struct Node {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<u32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    children: Vec<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation: Option<[f64; 4]>,
}

#[derive(Serialize)]
struct Mesh {
    name: String,
    primitives: [Primitive; 1],
}

#[derive(Serialize)]
struct Primitive {
    attributes: Attributes,
    indices: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<u32>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Material {
    pbr_metallic_roughness: Metal,
    double_sided: bool,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Metal {
    metallic_factor: f32,
    roughness_factor: f32,
}

#[derive(Serialize)]
struct Attributes {
    #[serde(rename = "POSITION")]
    position: u32,
    #[serde(rename = "COLOR_0", skip_serializing_if = "Option::is_none")]
    color: Option<u32>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: u32,
    byte_offset: usize,
    component_type: u32,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    normalized: bool,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<[f32; 3]>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    buffer: u32,
    byte_offset: usize,
    byte_length: usize,
    target: u32,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Buffer {
    byte_length: usize,
}

const FLOAT: u32 = 5126;

const UNSIGNED_SHORT: u32 = 5123;

const UNSIGNED_INT: u32 = 5125;

const ARRAY_BUFFER: u32 = 34962;

const ELEMENT_ARRAY_BUFFER: u32 = 34963;

impl Document {
    /// Stores a mesh and returns the index of the glTF mesh of each of its groups that is not
    /// empty.
    pub(super) fn store(&mut self, mesh: &TriMesh, index: usize, bin: &mut Vec<u8>) -> Result<Vec<u32>, ExportError> {
        if mesh.triangles().is_empty() {
            return Ok(Vec::new());
        }
        let (position, index_view) = (self.accessors.len() as u32, self.buffer_views.len() as u32 + 1);
        let points: Vec<[f32; 3]> =
            mesh.vertices().iter().map(|p| to_gltf(&(p.coords * 1e-3)).map(|x| x as f32).into()).collect();
        let bound = |f: fn(f32, f32) -> f32| {
            points.iter().copied().reduce(|a, b| [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])])
        };
        self.view(bin, points.iter().flatten().flat_map(|x| x.to_le_bytes()), ARRAY_BUFFER);
        self.view(bin, mesh.triangles().iter().flatten().flat_map(|v| v.to_le_bytes()), ELEMENT_ARRAY_BUFFER);
        u32::try_from(bin.len()).map_err(|_| ExportError::TooLarge)?;
        self.accessors.push(Accessor {
            buffer_view: index_view - 1,
            byte_offset: 0,
            component_type: FLOAT,
            normalized: false,
            count: points.len(),
            kind: "VEC3",
            min: bound(f32::min),
            max: bound(f32::max),
        });
        let mut stored = Vec::new();
        for (name, range) in named_groups(&format!("mesh{index}"), mesh) {
            let indices = self.accessors.len() as u32;
            self.accessors.push(Accessor {
                buffer_view: index_view,
                byte_offset: 12 * range.start,
                component_type: UNSIGNED_INT,
                normalized: false,
                count: 3 * range.len(),
                kind: "SCALAR",
                min: None,
                max: None,
            });
            stored.push(self.meshes.len() as u32);
            let attributes = Attributes { position, color: None };
            self.meshes.push(Mesh { name, primitives: [Primitive { attributes, indices, material: None }] });
        }
        Ok(stored)
    }

    /// Gives all meshes these vertex colours: linear red, green and blue of 16 bits, and a dull
    /// material.
    pub(super) fn paint(&mut self, colours: &[[u16; 3]], bin: &mut Vec<u8>) -> Result<(), ExportError> {
        let (buffer_view, accessor) = (self.buffer_views.len() as u32, self.accessors.len() as u32);
        let opaque = colours.iter().flat_map(|&[r, g, b]| [r, g, b, u16::MAX]);
        self.view(bin, opaque.flat_map(u16::to_le_bytes), ARRAY_BUFFER);
        u32::try_from(bin.len()).map_err(|_| ExportError::TooLarge)?;
        self.accessors.push(Accessor {
            buffer_view,
            byte_offset: 0,
            component_type: UNSIGNED_SHORT,
            normalized: true,
            count: colours.len(),
            kind: "VEC4",
            min: None,
            max: None,
        });
        // Without a material the default is metal, which is black where it mirrors nothing.
        let pbr_metallic_roughness = Metal { metallic_factor: 0.0, roughness_factor: 0.9 };
        self.materials.push(Material { pbr_metallic_roughness, double_sided: true });
        for primitive in self.meshes.iter_mut().flat_map(|m| &mut m.primitives) {
            (primitive.attributes.color, primitive.material) = (Some(accessor), Some(0));
        }
        Ok(())
    }

    /// Returns the bytes of the file.
    pub(super) fn bytes(mut self, bin: Vec<u8>) -> Result<Vec<u8>, ExportError> {
        self.buffers.push(Buffer { byte_length: bin.len() });
        let json = serde_json::to_vec(&self).map_err(|_| ExportError::TooLarge)?;
        container(json, bin)
    }

    fn view(&mut self, bin: &mut Vec<u8>, data: impl Iterator<Item = u8>, target: u32) {
        let byte_offset = bin.len();
        bin.extend(data);
        self.buffer_views.push(BufferView { buffer: 0, byte_offset, byte_length: bin.len() - byte_offset, target });
    }

    pub(super) fn add_node(&mut self, node: &NamedNode<'_>, mesh: &TriMesh, stored: &[u32]) {
        let place = self.nodes.len() as u32;
        self.scenes[0].nodes.push(place);
        let turn = node.transform.rotation.quaternion();
        let axis = to_gltf(&turn.imag());
        let mut root = Node {
            name: node.name.into(),
            translation: Some(to_gltf(&(node.transform.translation.vector * 1e-3)).into()),
            rotation: Some([axis.x, axis.y, axis.z, turn.w]),
            ..Node::default()
        };
        if let &[single] = stored {
            root.mesh = Some(single);
            self.nodes.push(root);
            return;
        }
        root.children = (0..stored.len() as u32).map(|k| place + 1 + k).collect();
        self.nodes.push(root);
        for ((name, _), &mesh) in named_groups(node.name, mesh).into_iter().zip(stored) {
            self.nodes.push(Node { name, mesh: Some(mesh), ..Node::default() });
        }
    }
}

/// Builds the GLB container: header, JSON chunk padded with blanks, BIN chunk padded with zeros.
fn container(mut json: Vec<u8>, mut bin: Vec<u8>) -> Result<Vec<u8>, ExportError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| ExportError::TooLarge);
    let total = 12 + 8 + json.len() + 8 + bin.len();
    let mut bytes = Vec::with_capacity(total);
    bytes.extend_from_slice(b"glTF");
    bytes.extend_from_slice(&2u32.to_le_bytes());
    bytes.extend_from_slice(&length(total)?);
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        bytes.extend_from_slice(&length(chunk.len())?);
        bytes.extend_from_slice(kind);
        bytes.extend_from_slice(chunk);
    }
    Ok(bytes)
}
