//! The mesh of a lofted blade.

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Unit, Vector3};

use crate::blade_loft::loft_caps::close_row;
use crate::blade_loft::loft_edges::{LOFT_GROUPS, ROOT, TIP};
use crate::blade_loft::loft_surface::{BladeLoft, LoftRow};
use crate::grouped_mesh::GroupedMesh;
use crate::spec_error::LoftError;

/// Most vertices of a mesh.
const MOST_VERTICES: usize = 2_000_000;

/// Share of the tolerance that each of both directions of facets may use at first.
const FIRST_SHARE: f64 = 0.4;

/// Rounds of refinement where the first one leaves more than the tolerance.
const MOST_ROUNDS: usize = 8;

/// Mesh of a blade with the normals of its smooth surface.
#[derive(Clone, Debug)]
pub struct LoftedBlade {
    /// Closed mesh, wound outward, with the groups `suction`, `pressure`, `leading-edge`,
    /// `trailing-edge`, `tip` and `root`.
    pub mesh: TriMesh,
    /// Outward unit normal of the smooth surface at each vertex; at a corner that of the side
    /// behind it, in the order of the points.
    pub normals: Vec<Unit<Vector3<f64>>>,
    /// Largest distance of the surface from the facets, measured at the middle of each facet's quad
    /// and its sides, mm.
    pub chord_mm: f64,
}

/// How many parts each gap between sections, and between columns, is divided into.
struct Divisions {
    spans: Vec<usize>,
    gaps: Vec<usize>,
}

impl BladeLoft {
    /// The blade as a mesh whose facets are nearer to the surface than a tolerance, mm. Every point
    /// of the sections is a vertex; tip and root are closed by facets between the points of the
    /// last and first section.
    ///
    /// # Errors
    /// If the tolerance is not above zero or needs more than 2,000,000 vertices, or the surface
    /// folds.
    pub fn mesh(&self, chord_tolerance: f64) -> Result<LoftedBlade, LoftError> {
        let too_fine = || LoftError::TooFine { tolerance: chord_tolerance, most: MOST_VERTICES };
        if !chord_tolerance.is_finite() || chord_tolerance <= 0.0 {
            return Err(too_fine());
        }
        let mut divisions = self.first_divisions(FIRST_SHARE * chord_tolerance);
        for _ in 0..MOST_ROUNDS {
            let [rows, columns] = [&divisions.spans, &divisions.gaps].map(|parts| parts.iter().sum::<usize>());
            if rows.saturating_mul(columns) > MOST_VERTICES {
                break;
            }
            let made = self.divided(&divisions)?;
            if made.chord_mm <= chord_tolerance {
                return Ok(made);
            }
            for parts in divisions.spans.iter_mut().chain(&mut divisions.gaps) {
                *parts += parts.div_ceil(3);
            }
        }
        Err(too_fine())
    }

    /// Divisions by the largest sagitta of each gap, at its middle.
    fn first_divisions(&self, tolerance: f64) -> Divisions {
        let n = self.parameters.n_columns();
        let n_spans = self.span.len() - 1;
        let (mut along, mut across) = (vec![0.0_f64; n], vec![0.0_f64; n_spans]);
        for (span, across) in across.iter_mut().enumerate() {
            let rows = [0.0, 0.5, 1.0].map(|share| self.row(span, share));
            for (gap, along) in along.iter_mut().enumerate() {
                let [low, middle, high] = [0, 1, 2].map(|k| rows[k].at(gap, 0.0).0);
                *across = across.max(off_line(&middle, [&low, &high]));
                for row in &rows {
                    let [a, b, c] = [0.0, 0.5, 1.0].map(|share| row.at(gap, share).0);
                    *along = along.max(off_line(&b, [&a, &c]));
                }
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the number of vertices")]
        let parts = |sagitta: f64| (sagitta / tolerance).sqrt().ceil().clamp(1.0, MOST_VERTICES as f64) as usize;
        Divisions { spans: across.into_iter().map(parts).collect(), gaps: along.into_iter().map(parts).collect() }
    }

    fn divided(&self, divisions: &Divisions) -> Result<LoftedBlade, LoftError> {
        let shares = |parts: &[usize]| -> Vec<(usize, f64)> {
            let of = |(k, &n): (usize, &usize)| {
                (0..2 * n).map(move |i| {
                    #[expect(clippy::cast_precision_loss, reason = "at most the number of vertices")]
                    let share = i as f64 / (2 * n) as f64;
                    (k, share)
                })
            };
            parts.iter().enumerate().flat_map(of).collect()
        };
        // Each second place is one between vertices, to measure at.
        let columns = shares(&divisions.gaps);
        let mut rows = shares(&divisions.spans);
        rows.push((divisions.spans.len() - 1, 1.0));
        let mut mesh = GroupedMesh::new(&LOFT_GROUPS);
        let mut normals = Vec::new();
        let (mut vertices, mut middles): (Vec<Vec<u32>>, Vec<Vec<Point3<f64>>>) = (Vec::new(), Vec::new());
        let mut before: Vec<Point3<f64>> = Vec::new();
        let mut chord = 0.0_f64;
        for (k, &(span, share)) in rows.iter().enumerate() {
            let row = self.row(span, share);
            let points = self.points(&row, &columns, span, (k % 2 == 0).then_some(&mut normals))?;
            if k % 2 == 1 {
                middles.push(points);
                continue;
            }
            vertices.push(points.iter().step_by(2).map(|p| mesh.vertex(*p)).collect());
            if let Some(middle) = middles.last() {
                chord = chord.max(off_quads([&before, middle, &points]));
            }
            before = points;
        }
        self.fill(&mut mesh, &vertices, &divisions.gaps);
        Ok(LoftedBlade { mesh: mesh.build(), normals, chord_mm: chord })
    }

    /// Points of a row; adds the normals at each second one.
    fn points(
        &self,
        row: &LoftRow<'_>,
        columns: &[(usize, f64)],
        section: usize,
        mut normals: Option<&mut Vec<Unit<Vector3<f64>>>>,
    ) -> Result<Vec<Point3<f64>>, LoftError> {
        let n = self.parameters.n_columns();
        let mut points = Vec::with_capacity(columns.len());
        for (k, &(gap, share)) in columns.iter().enumerate() {
            let (point, derivatives) = row.at(gap, share);
            let folded = LoftError::Folded { section, point: gap };
            let chord = row.at((gap + 1) % n, 0.0).0 - row.at(gap, 0.0).0;
            let normal = self.normal(&derivatives).ok_or(folded.clone())?;
            if derivatives[0].dot(&chord) <= 0.0 {
                return Err(folded);
            }
            if let Some(normals) = normals.as_mut().filter(|_| k % 2 == 0) {
                normals.push(normal);
            }
            points.push(point);
        }
        Ok(points)
    }

    fn fill(&self, mesh: &mut GroupedMesh, vertices: &[Vec<u32>], parts: &[usize]) {
        let mut starts = vec![0];
        for n in parts {
            starts.push(starts[starts.len() - 1] + n);
        }
        let groups: Vec<usize> = parts.iter().zip(&self.groups).flat_map(|(&n, &group)| vec![group; n]).collect();
        let n = groups.len();
        for pair in vertices.windows(2) {
            for k in 0..n {
                let next = (k + 1) % n;
                let [a, b, c, d] = [pair[0][k], pair[0][next], pair[1][next], pair[1][k]];
                mesh.quad(groups[k], if self.is_counter_clockwise { [a, b, c, d] } else { [a, d, c, b] });
            }
        }
        // From the middle of the leading to the middle of the trailing edge.
        let ends = self.edges.map(|[from, to]| {
            let n = self.parameters.n_columns();
            starts[(from + (to + n - from) % n / 2) % n]
        });
        close_row(mesh, TIP, &vertices[vertices.len() - 1], ends, !self.is_counter_clockwise);
        close_row(mesh, ROOT, &vertices[0], ends, self.is_counter_clockwise);
    }
}

/// Distance of a point from the line through two others.
fn off_line(point: &Point3<f64>, [a, b]: [&Point3<f64>; 2]) -> f64 {
    let side = b - a;
    let from = point - a;
    (from - side * (from.dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE))).norm()
}

/// Largest distance of the points between vertices from the facets of their quads; rows are the
/// lower one, the one between, and the upper one, with the first column behind the last.
fn off_quads([low, middle, high]: [&[Point3<f64>]; 3]) -> f64 {
    let n = low.len();
    let quad = |k: usize| {
        let (mid, next) = (k + 1, (k + 2) % n);
        let [a, b, c, d] = [low[k], low[next], high[next], high[k]];
        // As in `GroupedMesh::quad`.
        let is_first = (c - a).norm_squared() <= (d - b).norm_squared();
        let [lower, upper] = if is_first { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        let [left, right] = if is_first { [upper, lower] } else { [lower, upper] };
        let sides = [(low[mid], lower), (high[mid], upper), (middle[k], left), (middle[next], right)];
        let at_sides = sides.iter().map(|(point, facet)| off_plane(point, facet)).fold(0.0, f64::max);
        at_sides.max(off_plane(&middle[mid], &lower).min(off_plane(&middle[mid], &upper)))
    };
    (0..n).step_by(2).map(quad).fold(0.0, f64::max)
}

/// Distance of a point from the plane of a facet; zero from one without area.
fn off_plane(point: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let length = normal.norm();
    if length > 0.0 { (point - a).dot(&normal).abs() / length } else { 0.0 }
}
