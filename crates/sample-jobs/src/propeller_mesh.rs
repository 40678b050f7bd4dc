//! Propellers as files of meshes with names.

use facemill_sample_parts::{BladeResolution, PropellerSpec, blade, blade_pose, hub};
use facemill_surface_model::{NamedNode, TriMesh, write_glb};
use nalgebra::{Isometry3, Point3};

/// Quads between hub and tip, and between leading and trailing edge: facets of about 10 mm on a
/// blade of 3 m diameter, 2 MB for the file.
pub(crate) const RADIAL_QUADS: usize = 160;

/// Quads of a blade along the chord.
pub(crate) const CHORD_QUADS: usize = 120;

/// Returns blades and hub of a propeller as a binary glTF file in metres with a node for each of
/// their groups, and the lowest and highest z of the propeller, mm.
///
/// # Errors
/// If the hub cannot be meshed, or the mesh is too large for a file.
pub fn propeller_glb(spec: &PropellerSpec, resolution: BladeResolution) -> Result<(Vec<u8>, [f64; 2]), String> {
    let blade = blade(spec, resolution);
    let hub = hub(spec, 2e-4 * spec.hub_radius()).map_err(|e| e.to_string())?;
    let blade_groups: Vec<String> = blade.groups().iter().map(|g| g.name.clone()).collect();
    let hub_groups: Vec<String> = hub.groups().iter().map(|g| g.name.clone()).collect();
    let part = |mesh: &TriMesh, group: &str| compact(&mesh.select_groups(|name| name == group));
    let meshes: Vec<TriMesh> =
        blade_groups.iter().map(|g| part(&blade, g)).chain(hub_groups.iter().map(|g| part(&hub, g))).collect();
    let mut nodes: Vec<(String, usize, Isometry3<f64>)> = Vec::new();
    for k in 0..spec.n_blades() {
        for (mesh, group) in blade_groups.iter().enumerate() {
            nodes.push((format!("blade-{}/{group}", k + 1), mesh, blade_pose(spec, k)));
        }
    }
    for (k, group) in hub_groups.iter().enumerate() {
        nodes.push((format!("hub/{group}"), blade_groups.len() + k, Isometry3::identity()));
    }
    let nodes: Vec<NamedNode<'_>> =
        nodes.iter().map(|(name, mesh, transform)| NamedNode { name, mesh: *mesh, transform: *transform }).collect();
    // Blades turn about z: all are as high as the first.
    let heights = || meshes.iter().flat_map(TriMesh::vertices).map(|p| p.z);
    let reach = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let meshes: Vec<&TriMesh> = meshes.iter().collect();
    Ok((write_glb(&meshes, &nodes).map_err(|e| e.to_string())?, reach))
}

/// Returns the mesh without vertices that no triangle uses.
pub(crate) fn compact(mesh: &TriMesh) -> TriMesh {
    let mut new_index = vec![u32::MAX; mesh.vertices().len()];
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let triangles: Vec<[u32; 3]> = mesh
        .triangles()
        .iter()
        .map(|t| {
            t.map(|v| {
                let new = &mut new_index[v as usize];
                if *new == u32::MAX {
                    *new = vertices.len() as u32;
                    vertices.push(mesh.vertices()[v as usize]);
                }
                *new
            })
        })
        .collect();
    TriMesh::with_groups(vertices, triangles, mesh.groups().to_vec()).unwrap_or_default()
}

/// Returns the names of a mesh's groups and the mesh of each.
pub(crate) fn parts_by_group(mesh: &TriMesh) -> (Vec<String>, Vec<TriMesh>) {
    let names: Vec<String> = mesh.groups().iter().map(|g| g.name.clone()).collect();
    let parts = names.iter().map(|g| compact(&mesh.select_groups(|name| name == g))).collect();
    (names, parts)
}

/// Returns a node for each mesh, where it is.
pub(crate) fn nodes_in_place(names: &[String]) -> Vec<NamedNode<'_>> {
    let node = |(mesh, name)| NamedNode { name, mesh, transform: Isometry3::identity() };
    names.iter().map(String::as_str).enumerate().map(node).collect()
}

/// Returns a mesh as a binary glTF file in which each of its groups, or the whole where it has
/// none, is a node.
pub(crate) fn grouped_glb(mesh: &TriMesh) -> Result<Vec<u8>, String> {
    let (names, parts) = match mesh.groups() {
        [] => (vec!["solid".to_owned()], vec![mesh.clone()]),
        _ => parts_by_group(mesh),
    };
    write_glb(&parts.iter().collect::<Vec<_>>(), &nodes_in_place(&names)).map_err(|e| e.to_string())
}
