//! Propellers as files of meshes with names.

use facemill_sample_parts::{BladeResolution, PropellerSpec, blade, blade_pose, hub};
use facemill_surface_model::{NamedNode, TriMesh, write_glb};
use nalgebra::{Isometry3, Point3};

/// Quads between hub and tip, and between leading and trailing edge: facets of about 10 mm on a
/// blade of 3 m diameter, 2 MB for the file.
pub(crate) const RADIAL_QUADS: usize = 160;

/// Quads of a blade along the chord.
pub(crate) const CHORD_QUADS: usize = 120;

/// Returns the propeller as a file, and its lowest and highest z, mm.
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

/// Returns a mesh as a file in which each of its groups, or the whole where it has none, is a node.
pub(crate) fn grouped_glb(mesh: &TriMesh) -> Result<Vec<u8>, String> {
    let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
    let parts: Vec<TriMesh> = match names[..] {
        [] => vec![mesh.clone()],
        _ => names.iter().map(|g| compact(&mesh.select_groups(|name| name == *g))).collect(),
    };
    let node = |k: usize| NamedNode {
        name: names.get(k).copied().unwrap_or("solid"),
        mesh: k,
        transform: Isometry3::identity(),
    };
    let nodes: Vec<NamedNode<'_>> = (0..parts.len()).map(node).collect();
    write_glb(&parts.iter().collect::<Vec<_>>(), &nodes).map_err(|e| e.to_string())
}
