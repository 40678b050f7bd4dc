use nalgebra::{Point3, Vector3};

use crate::strategy::patch::Patch;

/// Gradients of a field at the vertices of a patch, along the surface, per mm: the mean of the
/// triangles around each, weighted by area. `corner_values` are those of a triangle.
///
/// Linear fields have gradients that jump from triangle to triangle; between the vertices' they are
/// continuous, so feeds do not kink. Zero where a vertex has no triangle with an area.
pub(crate) fn vertex_gradients(patch: &Patch, corner_values: impl Fn(usize) -> [f64; 3]) -> Vec<Vector3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0.0); patch.mesh.vertices().len()];
    for (t, corners) in patch.mesh.triangles().iter().enumerate() {
        let points = corners.map(|v| patch.mesh.vertices()[v as usize]);
        let area = 0.5 * patch.mesh.scaled_normal(t).norm();
        let Some(gradient) = facet_gradient(&points, corner_values(t)) else { continue };
        for &v in corners {
            let (sum, weight) = &mut sums[v as usize];
            *sum += gradient * area;
            *weight += area;
        }
    }
    sums.into_iter().map(|(sum, weight)| if weight > 0.0 { sum / weight } else { sum }).collect()
}

/// Gradient of a linear function on a triangle by its values at the corners; `None` where the
/// triangle has no area.
pub(crate) fn facet_gradient([a, b, c]: &[Point3<f64>; 3], [at_a, at_b, at_c]: [f64; 3]) -> Option<Vector3<f64>> {
    let normal = (b - a).cross(&(c - a));
    let around = (c - b) * at_a + (a - c) * at_b + (b - a) * at_c;
    let gradient = normal.cross(&around) / normal.norm_squared();
    gradient.iter().all(|g| g.is_finite()).then_some(gradient)
}
