use std::io;

use gltf::json;
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};

use super::RawMesh;
use super::accessor::{Accessors, fault};
use super::uri;
use crate::import::settings::ImportFault;

/// Reads glTF or GLB: all triangles of the default scene, in metres or the file's own unit, with
/// node transforms applied.
///
/// Points and lines are left out. Skinned and morphed meshes, compression and instancing by
/// extension are refused: the accessors read here do not give their true shape.
pub(super) fn read(bytes: &[u8], resolve: &dyn Fn(&str) -> io::Result<Vec<u8>>) -> Result<RawMesh, ImportFault> {
    let file = document(bytes)?;
    let root = file.document.as_json();
    check_extensions(root)?;
    let mut accessors = Accessors::new(root, file.blob, resolve);
    let mut mesh = RawMesh::default();
    let mut visited = vec![false; root.nodes.len()];
    let mut todo: Vec<(usize, Matrix4<f64>)> =
        roots(root)?.into_iter().rev().map(|n| (n, Matrix4::identity())).collect();
    while let Some((index, parent)) = todo.pop() {
        let node = root.nodes.get(index).ok_or_else(|| fault("nodes", index, "it does not exist"))?;
        // Also ends nodes that share children many times over, whose number would grow without
        // bound.
        if std::mem::replace(&mut visited[index], true) {
            return Err(fault("nodes", index, "it is reached twice: the nodes are cyclic, or it has two parents"));
        }
        let scene_from_node = parent * local(node, index)?;
        if let Some(m) = node.mesh {
            add_mesh(&mut mesh, &mut accessors, root, index, m.value(), &scene_from_node)?;
        }
        let children = node.children.iter().flatten().rev();
        todo.extend(children.map(|c| (c.value(), scene_from_node)));
    }
    Ok(mesh)
}

/// Returns the names of the files that hold buffers.
pub(super) fn external_files(bytes: &[u8]) -> Result<Vec<String>, ImportFault> {
    let file = document(bytes)?;
    let addresses = file.document.as_json().buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    Ok(addresses.filter(|address| uri::embedded(address).is_none()).map(uri::percent_decoded).collect())
}

fn document(bytes: &[u8]) -> Result<gltf::Gltf, ImportFault> {
    check_container(bytes)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| ImportFault::Document(error_text(&e)))
}

/// Refuses a GLB header that announces less than its own size, which makes the gltf crate subtract
/// below zero.
fn check_container(bytes: &[u8]) -> Result<(), ImportFault> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    match length.map(|l| l as usize) {
        Some(length) if length > bytes.len() => {
            let message = format!("the GLB header announces {length} bytes, but the file ends here: it is truncated");
            Err(ImportFault::Byte { offset: bytes.len(), message })
        }
        Some(20..) => Ok(()),
        _ => Err(ImportFault::Byte { offset: 8, message: "the GLB container is shorter than its own header".into() }),
    }
}

fn error_text(e: &gltf::Error) -> String {
    // The crate's text for JSON errors hides their place.
    match e {
        gltf::Error::Deserialize(e) => e.to_string(),
        e => e.to_string(),
    }
}

/// Refuses extensions that change the meaning of the accessors. All others concern materials,
/// lights, names and the like, and may be required without changing a triangle.
fn check_extensions(root: &json::Root) -> Result<(), ImportFault> {
    const COMPRESSED: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
    const HARMLESS: [&str; 12] = [
        "KHR_materials_",
        "KHR_texture_",
        "KHR_lights_",
        "KHR_xmp",
        "KHR_techniques_webgl",
        "KHR_animation_pointer",
        "EXT_texture_",
        "EXT_lights_",
        "EXT_mesh_manifold",
        "EXT_structural_metadata",
        "MSFT_texture_",
        "ADOBE_materials_",
    ];
    for name in &root.extensions_required {
        if COMPRESSED.contains(&name.as_str()) {
            let feature = format!("compressed geometry ({name})");
            return Err(ImportFault::Unsupported { feature, hint: "write the file without compression" });
        }
        // Quantized positions are recognised by their accessor; other attributes are not read.
        if name != "KHR_mesh_quantization" && !HARMLESS.iter().any(|h| name.starts_with(h)) {
            let feature = format!("the extension {name}, which the file requires,");
            return Err(ImportFault::Unsupported { feature, hint: "write the file without it" });
        }
    }
    match root.extensions_used.iter().find(|name| *name == "EXT_mesh_gpu_instancing") {
        Some(name) => Err(ImportFault::Unsupported {
            feature: format!("instancing by {name}"),
            hint: "write each instance as a node of its own",
        }),
        None => Ok(()),
    }
}

/// Returns the nodes of the default scene, else of the first; without scenes, all nodes that are no
/// other's child.
fn roots(root: &json::Root) -> Result<Vec<usize>, ImportFault> {
    let scene = root.scene.map_or(0, |s| s.value());
    match root.scenes.get(scene) {
        Some(s) => Ok(s.nodes.iter().map(|n| n.value()).collect()),
        None if root.scene.is_some() => Err(fault("scenes", scene, "the default scene does not exist")),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                if let Some(c) = is_child.get_mut(child.value()) {
                    *c = true;
                }
            }
            Ok((0..root.nodes.len()).filter(|&n| !is_child[n]).collect())
        }
    }
}

/// Returns `parent_from_node`, from a matrix or from scale, rotation and translation, applied in
/// this order.
fn local(node: &json::Node, index: usize) -> Result<Matrix4<f64>, ImportFault> {
    let matrix = match node.matrix {
        Some(m) => Matrix4::from_column_slice(&m.map(f64::from)),
        None => {
            let translation = Vector3::from(node.translation.unwrap_or_default().map(f64::from));
            let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
            let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0)
                .ok_or_else(|| fault("nodes", index, "its rotation is zero"))?;
            let scale = Vector3::from(node.scale.unwrap_or([1.0; 3]).map(f64::from));
            let placed = Matrix4::new_translation(&translation) * rotation.to_homogeneous();
            placed * Matrix4::new_nonuniform_scaling(&scale)
        }
    };
    if matrix.iter().all(|x| x.is_finite()) {
        Ok(matrix)
    } else {
        Err(fault("nodes", index, "its transform is not finite"))
    }
}

fn add_mesh(
    mesh: &mut RawMesh,
    accessors: &mut Accessors<'_>,
    root: &json::Root,
    node_index: usize,
    mesh_index: usize,
    scene_from_node: &Matrix4<f64>,
) -> Result<(), ImportFault> {
    let source = root.meshes.get(mesh_index).ok_or_else(|| fault("meshes", mesh_index, "it does not exist"))?;
    let node = &root.nodes[node_index];
    let morphs = node.weights.iter().chain(&source.weights).flatten().any(|&w| w != 0.0);
    if node.skin.is_some() || morphs {
        return Err(ImportFault::Unsupported {
            feature: format!("nodes[{node_index}]: a skinned or morphed mesh"),
            hint: "write the mesh in the shape that is meant",
        });
    }
    mesh.begin_group(node.name.as_ref().or(source.name.as_ref()).map_or("", |n| n));
    for (k, primitive) in source.primitives.iter().enumerate() {
        add_primitive(mesh, accessors, primitive, scene_from_node).map_err(|f| within_primitive(f, mesh_index, k))?;
    }
    Ok(())
}

/// Adds the primitive to an accessor's fault that does not name one.
fn within_primitive(fault: ImportFault, mesh: usize, primitive: usize) -> ImportFault {
    let place = format!("meshes[{mesh}].primitives[{primitive}]");
    match fault {
        ImportFault::Element { element, message } => {
            let element = if element.is_empty() { place } else { format!("{element} (used by {place})") };
            ImportFault::Element { element, message }
        }
        ImportFault::NotFinite { place: vertex } => ImportFault::NotFinite { place: format!("{vertex} of {place}") },
        other => other,
    }
}

fn add_primitive(
    mesh: &mut RawMesh,
    accessors: &mut Accessors<'_>,
    primitive: &json::mesh::Primitive,
    scene_from_node: &Matrix4<f64>,
) -> Result<(), ImportFault> {
    let here = |message: String| ImportFault::Element { element: String::new(), message };
    let Checked::Valid(mode) = primitive.mode else { return Err(here("its mode is not known".into())) };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(());
    }
    let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let position = position.ok_or_else(|| here("it has no POSITION".into()))?;
    let points = accessors.points(position.value())?;
    if let Some(k) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(ImportFault::NotFinite { place: format!("vertex {k}") });
    }
    let n_points = u32::try_from(points.len()).map_err(|_| here("it has too many vertices".into()))?;
    let corners = match primitive.indices {
        Some(a) => accessors.indices(a.value())?,
        None => (0..n_points).collect(),
    };
    if let Some(k) = corners.iter().position(|&v| v >= n_points) {
        let message = format!("its index {k} is {}, but there are only {n_points} vertices", corners[k]);
        return Err(here(message));
    }
    if mode == Mode::Triangles && corners.len() % 3 != 0 {
        return Err(here(format!("{} indices do not make triangles", corners.len())));
    }
    let first = u32::try_from(mesh.vertices.len()).ok().filter(|f| f.checked_add(n_points).is_some());
    let first = first.ok_or(ImportFault::TooLarge { limit: u32::MAX as usize / 3 })?;
    // A mirroring node reverses the winding (glTF 2.0, 3.7.4).
    let mirrors = scene_from_node.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    for t in triangles(mode, &corners) {
        let [a, b, c] = t.map(|v| v + first);
        mesh.push(if mirrors { [a, c, b] } else { [a, b, c] })?;
    }
    let place = |p: &[f32; 3]| {
        let p = scene_from_node * Point3::from(p.map(f64::from)).to_homogeneous();
        Point3::new(p.x, p.y, p.z)
    };
    mesh.vertices.extend(points.iter().map(place));
    Ok(())
}

/// Returns the triangles of a list, strip or fan, all wound as the first (glTF 2.0, 3.7.2.1).
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    let strip = |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
    match mode {
        Mode::TriangleStrip => corners.windows(3).enumerate().map(strip).collect(),
        Mode::TriangleFan => corners.windows(2).skip(1).map(|w| [w[0], w[1], corners[0]]).collect(),
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}
