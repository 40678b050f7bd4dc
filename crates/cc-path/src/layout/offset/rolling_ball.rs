//! Ball that rolls in the corner between two groups of the surface.

use facemill_surface_model::Surface;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::distance::patch_vertices::{PatchVertices, on_edge};
use crate::layout::scallop::surface_path::{SurfacePath, trace_zero};
use crate::strategy::patch::Patch;

/// Smallest radius of the ball, mm: a sharp cutter touches both sides in the corner itself, where
/// its contact has no place on either. Larger: the first pass of a sharp cutter leaves the corner.
/// Smaller: rounding of mesh files decides.
const LEAST_RADIUS: f64 = 0.01;

/// Material that a ball leaves in a corner between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerRest {
    /// Height above the corner's edge, mm, along the line that halves the angle: r (1 / sin(φ/2) −
    /// 1) for planes at the opening angle φ.
    pub height: f64,
    /// Opening angle φ of the corner, rad, from the normals where the ball touches both sides.
    pub opening: f64,
    /// Where the ball touches the side that passes lie on, workpiece frame.
    pub position: Point3<f64>,
}

/// A ball that touches a patch, beside the surface of another group.
pub(crate) struct RollingBall<'a> {
    patch: &'a Patch<'a>,
    vertices: &'a PatchVertices,
    other: &'a Surface,
    radius: f64,
}

impl<'a> RollingBall<'a> {
    pub(crate) fn new(patch: &'a Patch<'a>, vertices: &'a PatchVertices, other: &'a Surface, radius: f64) -> Self {
        Self { patch, vertices, other, radius: radius.max(LEAST_RADIUS) }
    }

    /// Distance between the other surface and the ball that touches the patch at a place, mm, below
    /// 0 where both meet; at most as large as the radius.
    fn clearance(&self, p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        let centre = p + normal.into_inner() * self.radius;
        let Some(foot) = self.other.closest_point(&centre, 2.0 * self.radius) else { return self.radius };
        let outward = self.other.normal_at(&foot).dot(&(centre - foot.position));
        foot.distance.copysign(if outward < 0.0 { -1.0 } else { 1.0 }) - self.radius
    }

    /// Where the ball touches both, with the places where it is free to the left.
    pub(crate) fn track(&self) -> Vec<SurfacePath> {
        let n = self.patch.mesh.vertices().len();
        let at_vertex = |v: usize| self.clearance(&self.patch.mesh.vertices()[v], &self.vertices.normal(v as u32));
        let values: Vec<f64> = (0..n).into_par_iter().map(at_vertex).collect();
        let all: Vec<u32> = (0..self.patch.mesh.triangles().len() as u32).collect();
        trace_zero(self.patch, &values, &all, |edge, t| match t {
            0.0 => values[edge[0] as usize],
            1.0 => values[edge[1] as usize],
            _ => self.clearance(&on_edge(self.patch, edge, t), &self.vertices.normal_between(edge, t)),
        })
    }

    /// The largest rest along a track.
    pub(crate) fn largest_rest(&self, track: &[SurfacePath]) -> Option<CornerRest> {
        let places = track.iter().flat_map(|path| path.nodes.iter().zip(&path.triangles));
        let rests = places.filter_map(|(p, &t)| self.rest(p, &self.patch.normal(t, p)));
        rests.reduce(|most, rest| if rest.height > most.height { rest } else { most })
    }

    fn rest(&self, p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> Option<CornerRest> {
        let centre = p + normal.into_inner() * self.radius;
        let foot = self.other.closest_point(&centre, 2.0 * self.radius)?;
        let opening = std::f64::consts::PI - Unit::try_new(centre - foot.position, 0.0)?.angle(normal);
        let height = self.radius * (1.0 / (0.5 * opening).sin() - 1.0);
        Some(CornerRest { height, opening, position: *p })
    }
}
