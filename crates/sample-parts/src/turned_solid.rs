//! Solids of revolution: clamping parts such as pedestals, arbors and nuts.

use facemill_surface_model::TriMesh;
use nalgebra::Point3;

use crate::grouped_mesh::GroupedMesh;

/// Facets around the axis.
const AROUND: u32 = 96;

/// Returns a closed solid about the z axis. Its outline is `[radius, z]` (mm) from the lower end to
/// the upper one, both joined to the axis by flat faces; its facets enclose the round solid, with
/// edges outside of it by 0.05 % of the radius.
///
/// Guarantee: watertight and wound outward, in one group of that name.
///
/// # Panics
/// If the outline has fewer than two points, a radius that is not above 0, or does not go up.
#[must_use]
pub fn turned_solid(name: &'static str, outline: &[[f64; 2]]) -> TriMesh {
    let is_outline = outline.len() > 1
        && outline.iter().all(|[r, z]| *r > 0.0 && r.is_finite() && z.is_finite())
        && outline.windows(2).all(|pair| pair[1][1] >= pair[0][1])
        && outline[outline.len() - 1][1] > outline[0][1];
    assert!(is_outline, "an outline goes up, with radii above 0: {outline:?}");
    let mut mesh = GroupedMesh::new(&[name]);
    let step = std::f64::consts::TAU / f64::from(AROUND);
    let around = 1.0 / (0.5 * step).cos();
    let rings: Vec<Vec<u32>> = outline
        .iter()
        .map(|[r, z]| {
            let at = |k: u32| {
                let (sin, cos) = (f64::from(k) * step).sin_cos();
                Point3::new(around * r * cos, around * r * sin, *z)
            };
            (0..AROUND).map(|k| mesh.vertex(at(k))).collect()
        })
        .collect();
    let next = |k: usize| (k + 1) % AROUND as usize;
    for pair in rings.windows(2) {
        for k in 0..AROUND as usize {
            mesh.quad(0, [pair[0][k], pair[0][next(k)], pair[1][next(k)], pair[1][k]]);
        }
    }
    let [low, high] = [outline[0][1], outline[outline.len() - 1][1]].map(|z| mesh.vertex(Point3::new(0.0, 0.0, z)));
    for k in 0..AROUND as usize {
        mesh.triangle(0, [low, rings[0][next(k)], rings[0][k]]);
        mesh.triangle(0, [high, rings[rings.len() - 1][k], rings[rings.len() - 1][next(k)]]);
    }
    mesh.build()
}
