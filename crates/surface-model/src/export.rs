//! Meshes and scenes written to files.

mod glb;
mod painted;

use std::fmt::Write as _;

use nalgebra::{Isometry3, Vector3};

use crate::mesh::tri_mesh::TriMesh;

pub use glb::write_glb;
pub use painted::write_painted_glb;

/// A mesh placed in a scene under a name. Several nodes can have the same mesh, as the blades of a
/// propeller.
#[derive(Clone, Debug)]
pub struct NamedNode<'a> {
    /// Name of the node; the import makes it the group's name.
    pub name: &'a str,
    /// Index of its mesh.
    pub mesh: usize,
    /// Pose: `scene_from_mesh`, mm, +Z up.
    pub transform: Isometry3<f64>,
}

/// Reason why a scene cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A node has the index of a mesh that does not exist.
    #[error("node \"{node}\" uses mesh {mesh}, but there are only {n_meshes}")]
    NoMesh {
        /// Name of the node.
        node: String,
        /// Index it uses.
        mesh: usize,
        /// Number of meshes.
        n_meshes: usize,
    },
    /// The number of colours differs from that of the vertices.
    #[error("there are {n_colours} colours for {n_vertices} vertices")]
    Colours {
        /// Number of colours.
        n_colours: usize,
        /// Number of vertices of the mesh.
        n_vertices: usize,
    },
    /// No node has a triangle, and no reader accepts an empty scene.
    #[error("there is no triangle to write")]
    Empty,
    /// The format counts with 32 bits.
    #[error("the scene is too large for the format, which counts with 32 bits")]
    TooLarge,
}

/// Writes Wavefront OBJ text in mm, +Z up: a `g` per node, or `node/group` where its mesh has
/// several groups.
///
/// Coordinates are written with enough digits to read back the same numbers. The same scene always
/// gives the same bytes. Control characters and `#` in names become `_`.
///
/// # Errors
/// When a node's mesh does not exist or nothing has a triangle.
pub fn write_obj(meshes: &[&TriMesh], nodes: &[NamedNode<'_>]) -> Result<Vec<u8>, ExportError> {
    check(meshes, nodes)?;
    let mut text = String::from("# facemill: mm, +Z up\n");
    let mut first_vertex = 1;
    for node in nodes {
        let mesh = meshes[node.mesh];
        for p in mesh.vertices() {
            let p = node.transform * p;
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for (name, range) in named_groups(node.name, mesh) {
            let name = name.replace(|c: char| c.is_control() || c == '#', "_");
            let _ = writeln!(text, "g {name}");
            for t in &mesh.triangles()[range] {
                let [a, b, c] = t.map(|v| v as usize + first_vertex);
                let _ = writeln!(text, "f {a} {b} {c}");
            }
        }
        first_vertex += mesh.vertices().len();
    }
    Ok(text.into_bytes())
}

/// Writes binary STL in mm, +Z up, all nodes in one solid; coordinates are rounded to single
/// precision.
///
/// # Errors
/// When a node's mesh does not exist, nothing has a triangle, or there are more than 2³² triangles.
pub fn write_stl_binary(meshes: &[&TriMesh], nodes: &[NamedNode<'_>]) -> Result<Vec<u8>, ExportError> {
    check(meshes, nodes)?;
    let n: usize = nodes.iter().map(|node| meshes[node.mesh].triangles().len()).sum();
    let n_written = u32::try_from(n).map_err(|_| ExportError::TooLarge)?;
    let mut bytes = Vec::with_capacity(84 + 50 * n);
    // Not "solid": readers would take it for text.
    bytes.extend_from_slice(b"facemill binary STL, mm, +Z up");
    bytes.resize(80, b' ');
    bytes.extend_from_slice(&n_written.to_le_bytes());
    for node in nodes {
        let mesh = meshes[node.mesh];
        for t in 0..mesh.triangles().len() {
            let normal = mesh.scaled_normal(t).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            let corners = mesh.corners(t).map(|p| (node.transform * p).coords);
            for v in [node.transform * normal, corners[0], corners[1], corners[2]] {
                v.iter().for_each(|&x| bytes.extend_from_slice(&(x as f32).to_le_bytes()));
            }
            bytes.extend_from_slice(&[0, 0]);
        }
    }
    Ok(bytes)
}

fn check(meshes: &[&TriMesh], nodes: &[NamedNode<'_>]) -> Result<(), ExportError> {
    if let Some(node) = nodes.iter().find(|n| n.mesh >= meshes.len()) {
        return Err(ExportError::NoMesh { node: node.name.into(), mesh: node.mesh, n_meshes: meshes.len() });
    }
    if nodes.iter().all(|n| meshes[n.mesh].triangles().is_empty()) {
        return Err(ExportError::Empty);
    }
    Ok(())
}

/// Returns the names of a mesh's groups under a node, without empty groups.
fn named_groups(node: &str, mesh: &TriMesh) -> Vec<(String, std::ops::Range<usize>)> {
    let several = mesh.groups().len() > 1;
    let groups = mesh.groups().iter().enumerate().filter(|(_, g)| !g.triangles.is_empty());
    groups
        .map(|(k, g)| {
            let name = match g.name.as_str() {
                _ if !several => node.to_owned(),
                "" => format!("{node}/{k}"),
                group => format!("{node}/{group}"),
            };
            (name, g.triangles.clone())
        })
        .collect()
}
