//! Bodies as meshes, so that other bodies' distances from them can be measured.
use std::f64::consts::{PI, TAU};

use facemill_cl_data::{RoundFrustum, Solid};
use facemill_surface_model::{MeshError, TriMesh};
use nalgebra::{Point3, Vector3};

/// Largest excess of the prism that replaces a turned body over it, mm. Smaller makes more
/// triangles, larger tests a body that is not there.
const LARGEST_EXCESS: f64 = 0.05;

/// Fewest and most sides of a prism; above a radius of 5 m the excess grows.
const SIDES: [f64; 2] = [24.0, 720.0];

/// The undilated core of a solid in its own frame, closed and wound outward. It holds the core, so
/// that no distance from it is too large; a turned body sticks out by at most 0.05 mm (up to a
/// radius of 5 m).
///
/// # Errors
/// When a number of the solid is not finite.
pub fn solid_mesh(solid: &Solid) -> Result<TriMesh, MeshError> {
    let (vertices, triangles) = match solid {
        Solid::Frustum(f) => prism(f),
        Solid::Box(b) => cuboid(&b.half_extents),
        Solid::Hull(h) => (h.core.vertices().to_vec(), h.core.triangles().collect()),
    };
    TriMesh::new(vertices, triangles)
}

fn prism(f: &RoundFrustum) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let sides = sides_of(f.radius_low.max(f.radius_high));
    let outside = 1.0 / (PI / f64::from(sides)).cos();
    let ring = |radius: f64, z: f64| {
        (0..sides).map(move |k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            Point3::new(radius * outside * cos, radius * outside * sin, z)
        })
    };
    let mut vertices: Vec<_> = ring(f.radius_low, f.z_low).chain(ring(f.radius_high, f.z_high)).collect();
    vertices.extend([Point3::new(0.0, 0.0, f.z_low), Point3::new(0.0, 0.0, f.z_high)]);
    let (bottom, top) = (2 * sides, 2 * sides + 1);
    // A ring without a radius is the point on the axis.
    let low = |k: u32| if f.radius_low > 0.0 { k } else { bottom };
    let high = |k: u32| if f.radius_high > 0.0 { sides + k } else { top };
    let triangles = (0..sides).flat_map(|k| {
        let next = (k + 1) % sides;
        let [a, b, c, d] = [low(k), low(next), high(next), high(k)];
        [[a, b, c], [a, c, d], [bottom, b, a], [top, d, c]]
    });
    (vertices, triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

/// Sides of a prism around a circle of this radius: its corners lie at radius / cos(π / n).
fn sides_of(radius: f64) -> u32 {
    let needed = PI / (radius / (radius + LARGEST_EXCESS)).acos();
    needed.ceil().clamp(SIDES[0], SIDES[1]) as u32
}

fn cuboid(half: &Vector3<f64>) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let side = |k: usize, axis: usize| if k >> axis & 1 == 0 { -half[axis] } else { half[axis] };
    let vertices = (0..8).map(|k| Point3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
    // Each face counter-clockwise from outside; bit k of a corner's number is its side along axis
    // k.
    let quads: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (vertices, quads.iter().flat_map(|&[p, q, r, s]| [[p, q, r], [p, r, s]]).collect())
}

#[cfg(test)]
#[path = "../tests/unit/solid_mesh.rs"]
mod tests;
