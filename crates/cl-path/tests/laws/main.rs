//! Laws of passes from CL files.

mod contacts;
mod cuts;
mod passes;

use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::Point3;

/// Surface of vertices and triangles.
fn surface((vertices, triangles): (Vec<Point3<f64>>, Vec<[u32; 3]>)) -> Surface {
    Surface::new(TriMesh::new(vertices, triangles).expect("a mesh"), SurfaceSettings::default())
}

/// A plate at height 0 between these corners.
fn plate([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> Surface {
    let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| Point3::new(x, y, 0.0));
    surface((corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]))
}
