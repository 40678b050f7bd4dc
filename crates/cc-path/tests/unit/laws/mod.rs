//! Promises of layout passes, checked against the smooth surfaces that the meshes were made from.

mod constant_scallop;
mod edge_fill;
mod edges;
mod flow;
mod left_above;
mod parts;
mod passes;
mod points;
mod prism;
mod roots;
mod spiral;
mod strips;

use facemill_cl_data::{Aabb, Cancelled, CcPoint, Monitor, Silent};
use facemill_sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, blade};
use facemill_surface_model::{Surface, TriMesh};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::files::*;
use crate::strategies::*;
use crate::test_kit::{Random, cylinder, grid, irregular_grid, plane, sphere_cap, sphere_patch, surface};
use crate::*;

fn planes(normal: Unit<Vector3<f64>>) -> Strategy {
    Strategy::ParallelPlanes(ParallelPlanes { origin: Point3::origin(), normal, from: None, to: None })
}

fn rings(axis_origin: Point3<f64>, from_radius: f64, to_radius: f64) -> Strategy {
    let axis_direction = Vector3::z_axis();
    Strategy::CylindricalSections(CylindricalSections { axis_origin, axis_direction, from_radius, to_radius })
}

fn lay(s: &Surface, strategy: &Strategy, settings: &LaySettings) -> PassLayout {
    lay_on(s, &Region::default(), strategy, settings)
}

fn lay_on(s: &Surface, region: &Region, strategy: &Strategy, settings: &LaySettings) -> PassLayout {
    lay_passes(s, region, strategy, settings, &|_| f64::INFINITY, &Silent).unwrap()
}

/// A bumpy patch of 100 × 80 with slopes up to 35°.
fn waves(n: u32) -> TriMesh {
    let height = |x: f64, y: f64| 6.0 * (x / 11.0).sin() * (y / 13.0).cos() + 0.1 * y;
    grid(n, n, |u, v| Point3::new(100.0 * u, 80.0 * v, height(100.0 * u, 80.0 * v)))
}

fn oblique() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::new(0.2, 1.0, 0.1))
}

fn points(layout: &PassLayout) -> impl Iterator<Item = (&LaidPass, &CcPoint)> {
    layout.passes.iter().flat_map(|p| p.pass.points.iter().map(move |cc| (p, cc)))
}

fn gaps(layout: &PassLayout) -> impl Iterator<Item = (&LaidPass, [&CcPoint; 2])> {
    layout.passes.iter().flat_map(|p| p.pass.points.windows(2).map(move |w| (p, [&w[0], &w[1]])))
}

fn distance_to_segment(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let ab = b - a;
    let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
    (p - (a + ab * t)).norm()
}

fn distance_to_passes(p: &Point3<f64>, layout: &PassLayout) -> f64 {
    gaps(layout).map(|(_, [a, b])| distance_to_segment(p, &a.position, &b.position)).fold(f64::INFINITY, f64::min)
}
