//! Assumptions about meshes that are not closed.

use std::collections::HashMap;

use facemill_surface_model::{Edges, Topology, TriMesh};
use facemill_virtual_machine::Assumption;
use nalgebra::Point3;

use crate::load::job::Setup;
use crate::load::obstacle_meshes::ObstacleRole;

/// Returns the assumption that stock given as an allowance is on both sides of part and check
/// surfaces; `None` if these are closed together, if the stock is a solid, or if there is no stock.
pub fn open_stock(setup: &Setup<'_>) -> Option<Assumption> {
    let allowance = setup.own_stock.as_ref().map_or(setup.stock_thickness, |own| own.allowance);
    let is_surface = |role: ObstacleRole| matches!(role, ObstacleRole::Part | ObstacleRole::Check);
    let surfaces = setup.obstacles.iter().filter(|o| is_surface(o.role));
    if allowance <= 0.0 || is_closed(surfaces.map(|o| &o.mesh)) {
        return None;
    }
    let text = format!(
        "part and check surfaces are not closed: the stock on them, {allowance} mm (stock.offset), is taken to be on both sides"
    );
    Some(Assumption { line: None, text })
}

/// Returns an assumption for each mesh file of a setup whose inside cannot be checked.
pub fn open_files(setup: &Setup<'_>) -> impl Iterator<Item = Assumption> {
    let text = |file: &str| format!("the mesh {file} is not closed: a body wholly inside it is not found");
    setup.reports.iter().filter(|r| r.is_open()).map(move |r| Assumption { line: None, text: text(&r.file) })
}

/// Returns whether meshes bound volumes together; joins meshes that meet at the same vertices.
fn is_closed<'a>(meshes: impl Iterator<Item = &'a TriMesh>) -> bool {
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let mut triangles = Vec::new();
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    for mesh in meshes {
        let mut vertex = |k: u32| {
            let p = mesh.vertices()[k as usize];
            // Both zeros become one.
            let key = [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
            *known.entry(key).or_insert_with(|| {
                vertices.push(p);
                vertices.len() as u32 - 1
            })
        };
        triangles.extend(mesh.triangles().iter().map(|t| t.map(&mut vertex)));
    }
    let Ok(mesh) = TriMesh::new(vertices, triangles) else { return false };
    Topology::of(&mesh, &Edges::of(&mesh)).components.iter().all(|c| c.closed)
}

#[cfg(test)]
#[path = "../../tests/unit/load/open_meshes.rs"]
mod tests;
