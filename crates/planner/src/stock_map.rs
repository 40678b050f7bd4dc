//! A setup's stock as lines of material.

use facemill_surface_model::TriMesh;
use facemill_z_map::{DexelMap, MeshStockError};
use nalgebra::Isometry3;

use crate::Failure;
use crate::load::{Job, ObstacleRole, Setup};

/// The stock of a setup before anything is cut: lines along z of the workpiece frame, `cell` mm apart.
///
/// Stock that is told as an allowance is part and check surfaces with it around them; where one of these meshes is open, it is
/// a layer on both sides.
///
/// # Errors
/// When a mesh of the stock is not closed, or the lines are too many.
pub(crate) fn stock_map(job: &Job, setup: &Setup<'_>, cell: f64) -> Result<DexelMap, Failure> {
    let meshes = |roles: &[ObstacleRole]| {
        let of_role = setup.obstacles.iter().filter(|o| roles.contains(&o.role));
        of_role.fold(TriMesh::default(), |all, o| all.joined(&o.mesh))
    };
    let frame = Isometry3::identity();
    let (mesh, allowance) = if setup.stock_solid.is_some() {
        (meshes(&[ObstacleRole::Stock]), 0.0)
    } else {
        (meshes(&[ObstacleRole::Part, ObstacleRole::Check]), setup.stock_thickness)
    };
    let found = match DexelMap::of_mesh_with_allowance(&mesh, &frame, cell, allowance) {
        Err(MeshStockError::NotClosed { .. }) if allowance > 0.0 => DexelMap::of_layer(&mesh, &frame, cell, allowance),
        found => found,
    };
    found.map_err(|e| job.wrong(format!("setup \"{}\": stock: {e}", setup.file.name)))
}
