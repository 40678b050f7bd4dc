//! Choice of lines of stock that suit the surfaces that a setup's operations cut.

use facemill_surface_model::TriMesh;

use crate::load::job::Setup;

/// Largest cosine between a facet's normal and the lines at which the facet is a wall: within 10
/// deg. Upright lines show the cut of a layer on it beside them, or all at once if the layer is
/// thinner than a cell.
const WALL: f64 = 0.174;

/// Least share of the drive surface's area at which walls are worth lines across them: two more
/// maps of the stock. Borders of blades are below it, sides of plates above.
const SHARE: f64 = 0.1;

/// Least share of a direction among the lines: the surface that one block cuts may be square to it,
/// regardless of where most of the surface lies.
const LEAST: f64 = 0.05;

/// Returns whether the drive surface of any of these setups has walls along z of the workpiece
/// frame.
pub fn has_walls(setups: &[&Setup<'_>]) -> bool {
    setups.iter().any(|setup| wall_share(setup.drive.mesh()) >= SHARE)
}

/// Returns the share of a mesh's area that is within 10 deg of upright.
fn wall_share(mesh: &TriMesh) -> f64 {
    let of = |is_counted: &dyn Fn(f64) -> bool| {
        areas(mesh).filter(|a| is_counted(a[2].abs() / norm(a))).map(|a| norm(&a)).sum::<f64>()
    };
    let all = of(&|_| true);
    if all > 0.0 { of(&|upright| upright <= WALL) / all } else { 0.0 }
}

/// Returns weights of lines along x, y and z for showing a cut of these setups' drive surfaces: the
/// mean squares of the components of their normals, none below a twentieth, together 1. The lines
/// that are square to a facet show a cut of it best.
pub fn weights(setups: &[&Setup<'_>]) -> [f64; 3] {
    weights_of(setups.iter().flat_map(|setup| areas(setup.drive.mesh())))
}

fn weights_of(areas: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let mut sums = [0.0_f64; 3];
    for area in areas {
        (0..3).for_each(|k| sums[k] += area[k] * area[k] / norm(&area));
    }
    let all: f64 = sums.iter().sum();
    let shares = sums.map(|s| if all > 0.0 { (s / all).max(LEAST) } else { 1.0 });
    let all: f64 = shares.iter().sum();
    shares.map(|s| s / all)
}

/// Returns the triangles of a mesh as vectors along their normals, as long as their areas, without
/// those of no area.
fn areas(mesh: &TriMesh) -> impl Iterator<Item = [f64; 3]> + '_ {
    let of = |k: usize| {
        let [a, b, c] = mesh.corners(k);
        let area: [f64; 3] = ((b - a).cross(&(c - a)) * 0.5).into();
        area
    };
    (0..mesh.triangles().len()).map(of).filter(|area| norm(area) > 0.0)
}

fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
#[path = "../../tests/unit/stock/walls.rs"]
mod tests;
