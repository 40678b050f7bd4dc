//! Meshes of solid stock.

use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Rotation3, Vector3};

use crate::format::job_file::{BoxStockFile, CylinderStockFile, StockFile};
use crate::frames::direction;

/// Sides of the prism that replaces a round bar; its corners lie outside the bar, so that the prism
/// contains it.
const CYLINDER_SIDES: u32 = 96;

/// Returns the mesh of a box or a cylinder, from outside; empty for stock that is no solid of its
/// own.
pub(crate) fn stock_mesh(stock: &StockFile) -> TriMesh {
    match stock {
        StockFile::Box(b) => box_mesh(b),
        StockFile::Cylinder(c) => cylinder_mesh(c),
        StockFile::Offset(_) | StockFile::Mesh(_) => TriMesh::default(),
    }
}

fn box_mesh(b: &BoxStockFile) -> TriMesh {
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { b.min_mm[axis] } else { b.max_mm[axis] };
        Point3::new(pick(0), pick(1), pick(2))
    };
    let vertices = (0..8).map(corner).collect();
    // Each face as a quad, counter-clockwise from outside; bit k of a corner's number is its side
    // along axis k.
    let quads: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|[p, q, r, s]| [[*p, *q, *r], [*p, *r, *s]]).collect();
    TriMesh::new(vertices, triangles).unwrap_or_default()
}

fn cylinder_mesh(c: &CylinderStockFile) -> TriMesh {
    let turn = Rotation3::rotation_between(&Vector3::z(), &direction(&c.axis))
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let pose = Isometry3::from_parts(c.base_mm.into(), turn.into());
    frustum_mesh(c.radius_mm, c.radius_mm, 0.0, c.height_mm).transformed(&pose)
}

/// Returns a frustum about z, from outside.
fn frustum_mesh(radius_low: f64, radius_high: f64, z_low: f64, z_high: f64) -> TriMesh {
    let n = CYLINDER_SIDES;
    let outside = 1.0 / (std::f64::consts::PI / f64::from(n)).cos();
    let ring = |radius: f64, z: f64| {
        (0..n).map(move |k| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
            Point3::new(radius * outside * cos, radius * outside * sin, z)
        })
    };
    let mut vertices: Vec<Point3<f64>> = ring(radius_low, z_low).chain(ring(radius_high, z_high)).collect();
    vertices.push(Point3::new(0.0, 0.0, z_low));
    vertices.push(Point3::new(0.0, 0.0, z_high));
    let (bottom, top) = (2 * n, 2 * n + 1);
    let triangles = (0..n)
        .flat_map(|k| {
            let next = (k + 1) % n;
            [[k, next, n + next], [k, n + next, n + k], [bottom, next, k], [top, n + k, n + next]]
        })
        .collect();
    TriMesh::new(vertices, triangles).unwrap_or_default()
}

#[cfg(test)]
#[path = "../../tests/unit/load/stock_solid.rs"]
mod tests;
