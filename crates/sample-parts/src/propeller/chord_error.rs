use nalgebra::Point3;

use crate::propeller::blade::{BladeResolution, MOST_ROWS};
use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_section::BladeSide;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::spec::PropellerSpec;
use crate::spec_error::{SpecError, in_range};

/// Largest distance found between the smooth blade and the facets that [`crate::blade`] puts in its
/// place, mm.
///
/// An estimate: taken in the middle of every quad and of its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ChordError {
    /// Within the groups `suction` and `pressure`.
    pub sides: f64,
    /// Within the edges' bands outside the hub.
    pub edges: f64,
    /// Within the rounding of the tip.
    pub tip: f64,
}

/// How far the facets of a blade are from the smooth blade.
pub fn chord_error(spec: &PropellerSpec, resolution: BladeResolution) -> ChordError {
    let surface = BladeSurface::new(spec);
    let grid = BladeGrid::new(&surface, resolution);
    let n_columns = grid.fractions.len() - 1;
    let mut error = ChordError { sides: 0.0, edges: 0.0, tip: 0.0 };
    for row in grid.hub_row..grid.radii.len() - 1 {
        let rows = row_points(&surface, &grid, row);
        for column in 0..n_columns {
            let of_part = if row >= grid.tip_row {
                &mut error.tip
            } else if column < grid.n_edge || column + grid.n_edge >= n_columns {
                &mut error.edges
            } else {
                &mut error.sides
            };
            for points in &rows {
                *of_part = of_part.max(quad_error(points, column, n_columns));
            }
        }
    }
    error
}

impl BladeResolution {
    /// A resolution whose facets are within `tolerance` mm of the smooth blade on the suction and
    /// pressure side, by [`chord_error`]'s estimate, with not many more quads than that takes.
    ///
    /// Rows and columns keep the proportion of the default.
    ///
    /// # Errors
    /// When the tolerance is not positive, or finer than the finest resolution allows.
    pub fn for_chord_tolerance(spec: &PropellerSpec, tolerance: f64) -> Result<Self, SpecError> {
        in_range("chord tolerance", tolerance, f64::MIN_POSITIVE, spec.diameter())?;
        let mut n_radial = 16;
        loop {
            let resolution = Self::new(n_radial, n_radial * 3 / 2)?;
            let error = chord_error(spec, resolution).sides;
            if error <= tolerance {
                return Ok(resolution);
            }
            // Errors go with the square of the spacing; a twentieth more ends the search within a
            // few rounds.
            #[expect(
                clippy::cast_precision_loss,
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "saturates where it is refused anyway"
            )]
            let next = (n_radial as f64 * (error / tolerance).sqrt() * 1.05).ceil() as usize;
            if next.saturating_mul(3) / 2 > MOST_ROWS {
                return Err(SpecError::TooFine { tolerance, most: MOST_ROWS });
            }
            n_radial = next.max(n_radial + 1);
        }
    }
}

/// Points of both sides on a row, midway to the next and on the next, at the columns and midway
/// between them.
fn row_points(surface: &BladeSurface, grid: &BladeGrid, row: usize) -> [[Vec<Point3<f64>>; 3]; 2] {
    let (from, to) = (grid.radii[row], grid.radii[row + 1]);
    let mut fractions = Vec::with_capacity(2 * grid.fractions.len());
    for pair in grid.fractions.windows(2) {
        fractions.extend([pair[0], 0.5 * (pair[0] + pair[1])]);
    }
    fractions.push(1.0);
    let sections = [from, 0.5 * (from + to), to].map(|radius| surface.section(radius));
    [BladeSide::Suction, BladeSide::Pressure].map(|side| {
        [0, 1, 2].map(|k| fractions.iter().map(|&x| sections[k].point(side, sections[k].column(side, x))).collect())
    })
}

/// Largest distance of the middle points of a quad and its edges from the triangles of its quad and
/// the quads beside it.
///
/// Those beside it count because columns are bent along the surface: the middle of an edge may lie
/// over the next quad.
fn quad_error(points: &[Vec<Point3<f64>>; 3], column: usize, n_columns: usize) -> f64 {
    let beside = column.saturating_sub(1)..(column + 2).min(n_columns);
    let triangles: Vec<_> = beside.flat_map(|k| quad_triangles(points, 2 * k)).collect();
    let middles = [(1, 1), (0, 1), (1, 0), (1, 2), (2, 1)].map(|(row, k)| points[row][2 * column + k]);
    let nearest =
        |p: &Point3<f64>| triangles.iter().map(|t| distance_point_triangle(p, t)).fold(f64::INFINITY, f64::min);
    middles.iter().map(nearest).fold(0.0, f64::max)
}

/// The triangles of a quad, split as in the mesh.
fn quad_triangles(points: &[Vec<Point3<f64>>; 3], first: usize) -> [[Point3<f64>; 3]; 2] {
    let [a, b, c, d] = [points[0][first], points[0][first + 2], points[2][first + 2], points[2][first]];
    if (c - a).norm_squared() <= (d - b).norm_squared() { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

/// Distance of a point from a triangle.
pub(crate) fn distance_point_triangle(point: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = |p: &Point3<f64>, q: &Point3<f64>| normal.cross(&(q - p)).dot(&(point - p)) >= 0.0;
    if normal.norm_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return normal.dot(&(point - a)).abs() / normal.norm();
    }
    let to_edge = |p: &Point3<f64>, q: &Point3<f64>| {
        let along = q - p;
        let length_sq = along.norm_squared();
        let part = if length_sq > 0.0 { (along.dot(&(point - p)) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
        (point - (p + along * part)).norm()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}
