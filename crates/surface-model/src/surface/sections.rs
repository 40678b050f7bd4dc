use nalgebra::{Point3, Unit, Vector3};

use crate::surface::level_curves::{LevelPoint, march};
use crate::surface::{Surface, SurfacePoint};

/// Points of a surface in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// Points; between two of them the line runs through the triangle of the first.
    pub points: Vec<SurfacePoint>,
    /// Whether the last point is followed by the first.
    pub closed: bool,
}

/// Returns the curves in which a surface meets the plane through `origin` with the given normal.
///
/// Exact up to rounding: every point lies on an edge of the mesh and in the plane. Seen from
/// outside, the side that `normal` points to is on the left. `keep` selects the triangles; order
/// and ends as in [`level_curves`](crate::surface::level_curves::level_curves).
pub fn plane_section(
    surface: &Surface,
    origin: &Point3<f64>,
    normal: &Unit<Vector3<f64>>,
    keep: impl Fn(u32) -> bool,
) -> Vec<Polyline> {
    implicit_section(surface, |p| (p - origin).dot(normal), keep)
}

/// Returns the curves on a surface where `f` is 0, with its zeros on the edges found to rounding,
/// whatever its shape in between.
///
/// `f` is evaluated at the vertices; a zero between vertices of the same sign is missed. Where `f`
/// is not finite there is no curve. Seen from outside, positive values are on the left.
///
/// Sections of other shapes than planes, such as the cylinders about a shaft in which blades are
/// designed:
///
/// ```
/// use facemill_surface_model::{Surface, SurfaceSettings, TriMesh, implicit_section};
/// use nalgebra::Point3;
///
/// let corners = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]].map(Point3::from);
/// let plate = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]])?;
/// let surface = Surface::new(plate, SurfaceSettings::default());
/// let arcs = implicit_section(&surface, |p| p.coords.xy().norm() - 6.0, |_| true);
/// assert!(arcs.len() == 1 && arcs[0].points.iter().all(|p| (p.position.coords.norm() - 6.0).abs() < 1e-12));
/// # Ok::<(), facemill_surface_model::MeshError>(())
/// ```
pub fn implicit_section(
    surface: &Surface,
    f: impl Fn(&Point3<f64>) -> f64,
    keep: impl Fn(u32) -> bool,
) -> Vec<Polyline> {
    let mesh = surface.mesh();
    let values: Vec<f64> = mesh.vertices().iter().map(&f).collect();
    let refine = |a: u32, b: u32, linear: f64| {
        let (p, q) = (mesh.vertices()[a as usize], mesh.vertices()[b as usize]);
        zero_between(|s| f(&(p + (q - p) * s)), values[a as usize], values[b as usize], linear)
    };
    let drawn = (0..mesh.triangles().len() as u32).filter(|&t| surface.facet_normal(t).is_some() && keep(t));
    march(mesh, surface.edges(), &values, 0.0, drawn, refine)
        .into_iter()
        .map(|c| Polyline { points: c.points.iter().map(|p| surface_point(surface, p)).collect(), closed: c.closed })
        .collect()
}

/// Returns a zero of `f` in 0..1, where it is `f0` at 0 and `f1` at 1 and these have different
/// signs, from a first guess.
///
/// Regula falsi in the Illinois form, which converges to a smooth zero in a few steps; every third
/// step halves the bracket, so 160 of them reach rounding for any function.
fn zero_between(f: impl Fn(f64) -> f64, f0: f64, f1: f64, guess: f64) -> f64 {
    let (mut low, mut high) = ((0.0, f0), (1.0, f1));
    let mut s = guess;
    let mut last_low = None;
    for step in 0..160 {
        let inside = |s: f64| low.0 < s && s < high.0;
        if !inside(s) {
            s = 0.5 * (low.0 + high.0);
        }
        if !inside(s) {
            break;
        }
        let value = f(s);
        if value == 0.0 || !value.is_finite() {
            break;
        }
        let is_low = (value >= 0.0) == (f0 >= 0.0);
        if is_low {
            high.1 *= if last_low == Some(true) { 0.5 } else { 1.0 };
            low = (s, value);
        } else {
            low.1 *= if last_low == Some(false) { 0.5 } else { 1.0 };
            high = (s, value);
        }
        last_low = Some(is_low);
        let falsi = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        s = if step % 3 == 2 { 0.5 * (low.0 + high.0) } else { falsi };
    }
    s
}

fn surface_point(surface: &Surface, p: &LevelPoint) -> SurfacePoint {
    let corners = surface.mesh().triangles()[p.triangle as usize];
    let mut barycentric = [0.0; 3];
    for (weight, v) in [(1.0 - p.fraction, p.edge[0]), (p.fraction, p.edge[1])] {
        if let Some(k) = corners.iter().position(|&c| c == v) {
            barycentric[k] = weight;
        }
    }
    SurfacePoint { position: p.position, triangle: p.triangle, barycentric, distance: 0.0 }
}

#[cfg(test)]
#[path = "../../tests/unit/surface/sections.rs"]
mod tests;
