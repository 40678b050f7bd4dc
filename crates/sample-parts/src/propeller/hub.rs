use std::f64::consts::{FRAC_PI_2, TAU};

use facemill_surface_model::TriMesh;
use nalgebra::Point3;

use crate::grouped_mesh::GroupedMesh;
use crate::propeller::blade::BladeResolution;
use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_section::BladeSide;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::spec::PropellerSpec;
use crate::spec_error::{SpecError, in_range};

/// Radius of the rounding between the hub's cylinder and its flat ends, over the hub radius.
pub(crate) const ROUNDING: f64 = 0.25;

/// Length of the cylinder beyond the blade's root on both sides, over the hub radius.
pub(crate) const MARGIN: f64 = 0.1;

/// Longest quad of the cylinder over its width around the axis.
pub(crate) const LONGEST_QUAD: f64 = 4.0;

/// The hub: a closed cylinder about +Z with rounded edges and flat ends, mm, in the frame of
/// [`crate::blade`].
///
/// Its cylinder (group `cylinder`) is as long as the blade's root and a little more, or as long as
/// the table says; group `ends` is the rest. Vertices lie on the smooth hub, facets within
/// `chord_tolerance` mm of it. A turn by 2π/Z maps the mesh on itself up to rounding. It is solid:
/// blades reach into it, so hub and blades are overlapping solids.
///
/// # Errors
/// When the tolerance is not between 1e-6 and 1e-1 of the hub radius.
pub fn hub(spec: &PropellerSpec, chord_tolerance: f64) -> Result<TriMesh, SpecError> {
    let radius = spec.hub_radius();
    in_range("chord tolerance of the hub", chord_tolerance, 1e-6 * radius, 0.1 * radius)?;
    let n_around = steps(TAU, radius, chord_tolerance).next_multiple_of(2 * spec.n_blades());
    let profile = profile(spec, chord_tolerance, n_around);
    let mut mesh = GroupedMesh::new(&["cylinder", "ends"]);
    let rings: Vec<Vec<u32>> = profile.iter().map(|&(r, z)| ring(&mut mesh, r, z, n_around)).collect();
    for (k, pair) in rings.windows(2).enumerate() {
        let on_cylinder = profile[k].0 >= radius && profile[k + 1].0 >= radius;
        for i in 0..n_around {
            let j = (i + 1) % n_around;
            mesh.quad(usize::from(!on_cylinder), [pair[0][i], pair[0][j], pair[1][j], pair[1][i]]);
        }
    }
    for (ring, up) in [(&rings[0], false), (&rings[rings.len() - 1], true)] {
        let z = profile[if up { profile.len() - 1 } else { 0 }].1;
        let centre = mesh.vertex(Point3::new(0.0, 0.0, z));
        for i in 0..n_around {
            let (a, b) = (ring[i], ring[(i + 1) % n_around]);
            mesh.triangle(1, if up { [a, b, centre] } else { [b, a, centre] });
        }
    }
    Ok(mesh.build())
}

/// Steps over an arc whose chords stay within a tolerance, and at least 16 to a full turn.
pub(crate) fn steps(angle: f64, radius: f64, tolerance: f64) -> usize {
    // sagitta = r·(1 − cos(step/2)) = 2·r·sin²(step/4)
    let step = (4.0 * (tolerance / (2.0 * radius)).sqrt().min(1.0).asin()).min(TAU / 16.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, limited by the tolerance")]
    let n = (angle / step).ceil() as usize;
    n.max(1)
}

fn ring(mesh: &mut GroupedMesh, radius: f64, z: f64, n: usize) -> Vec<u32> {
    #[expect(clippy::cast_precision_loss, reason = "counts are small")]
    let angle = |i: usize| TAU * i as f64 / n as f64;
    (0..n).map(|i| mesh.vertex(Point3::new(radius * angle(i).cos(), radius * angle(i).sin(), z))).collect()
}

/// Outline as `(r, z)` from the lower to the upper end.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small counts"
)]
fn profile(spec: &PropellerSpec, chord_tolerance: f64, n_around: usize) -> Vec<(f64, f64)> {
    let radius = spec.hub_radius();
    let (low, high) = root_range(spec);
    let rounding = ROUNDING * radius;
    let (low, high) = match spec.hub_length() {
        None => (low - MARGIN * radius, high + MARGIN * radius),
        Some(length) => {
            let (middle, half) = (0.5 * (low + high), 0.5 * length - rounding);
            (middle - half, middle + half)
        }
    };
    let n_arc = steps(FRAC_PI_2, rounding, chord_tolerance).max(4);
    let arc = |k: usize| (FRAC_PI_2 * k as f64 / n_arc as f64).sin_cos();
    let n_along = ((high - low) / (LONGEST_QUAD * TAU * radius / n_around as f64)).ceil().max(1.0) as usize;
    let lower = (0..n_arc).map(|k| (radius - rounding * (1.0 - arc(k).0), low - rounding * arc(k).1));
    let middle = (0..=n_along).map(|k| (radius, low + (high - low) * k as f64 / n_along as f64));
    let upper = (0..n_arc).rev().map(|k| (radius - rounding * (1.0 - arc(k).0), high + rounding * arc(k).1));
    lower.chain(middle).chain(upper).collect()
}

/// Length of the hub whose cylinder is as long as the blade's root, mm.
pub(crate) fn least_hub_length(spec: &PropellerSpec) -> f64 {
    let (low, high) = root_range(spec);
    high - low + 2.0 * ROUNDING * spec.hub_radius()
}

/// Range of z that the blade takes up from its root to a little above the hub.
pub(crate) fn root_range(spec: &PropellerSpec) -> (f64, f64) {
    let surface = BladeSurface::new(spec);
    let grid = BladeGrid::new(&surface, BladeResolution::default());
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for radius in [grid.radii[0], spec.hub_radius(), 1.05 * spec.hub_radius()] {
        let section = surface.section(radius);
        for side in [BladeSide::Suction, BladeSide::Pressure] {
            for &x in &grid.fractions {
                let z = section.point(side, x).z;
                (low, high) = (low.min(z), high.max(z));
            }
        }
    }
    (low, high)
}
