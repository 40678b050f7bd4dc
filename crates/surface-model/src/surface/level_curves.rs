use nalgebra::Point3;

use crate::mesh::edges::Edges;
use crate::mesh::tri_mesh::TriMesh;

/// A curve on a mesh along which a function has a given value: one straight piece per triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelCurve {
    /// Points in order, no two in a row at the same place; at least two.
    pub points: Vec<LevelPoint>,
    /// Whether the last point is followed by the first.
    pub closed: bool,
}

/// A point of a level curve, on an edge of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelPoint {
    /// Where, mm.
    pub position: Point3<f64>,
    /// The triangle that the curve runs through after this point; at the end of an open curve the one before it.
    pub triangle: u32,
    /// Vertices of the edge it lies on, the lower index first.
    pub edge: [u32; 2],
    /// How far along the edge, from 0 at its first vertex to 1 at its second.
    pub fraction: f64,
}

/// The curves on a mesh along which values given at its vertices, linear between them, are `level`.
///
/// Values at the level count as above it, so no curve branches, and a curve through a vertex meets it exactly. A row of
/// vertices at the level gives a curve along them, where lower values are beside it. Seen from outside, the higher values are
/// on the left. Curves end at open and non-manifold edges and where neighbours are wound against each other. Triangles with
/// a vertex whose value is missing or not finite carry no curve. Where only one vertex reaches the level, the curve has no
/// length and is left out.
///
/// The order is fixed by the triangles: open curves by their first triangle, then closed ones by their lowest.
#[must_use]
pub fn level_curves(mesh: &TriMesh, values: &[f64], level: f64) -> Vec<LevelCurve> {
    level_curves_among(mesh, &Edges::of(mesh), values, level, 0..mesh.triangles().len() as u32)
}

/// As [`level_curves`], in some of the triangles, with the mesh's edges already found.
///
/// `among` are the triangles in rising order, those that do not cross the level included. The work grows with their number, not with the
/// size of the mesh.
#[must_use]
pub fn level_curves_among(
    mesh: &TriMesh,
    edges: &Edges,
    values: &[f64],
    level: f64,
    among: impl IntoIterator<Item = u32>,
) -> Vec<LevelCurve> {
    march(mesh, edges, values, level, among, |_, _, fraction| fraction)
}

/// The marching itself; `place` may correct where on an edge (lower vertex, higher vertex) the curve crosses.
pub(crate) fn march(
    mesh: &TriMesh,
    edges: &Edges,
    values: &[f64],
    level: f64,
    among: impl IntoIterator<Item = u32>,
    place: impl Fn(u32, u32, f64) -> f64,
) -> Vec<LevelCurve> {
    let crossing = |t: u32| Some((t, Crossing::of(mesh.triangles()[t as usize], values, level)?));
    let crossings: Vec<(u32, Crossing)> = among.into_iter().filter_map(crossing).collect();
    let index = |t: u32| crossings.binary_search_by_key(&t, |(t, _)| *t).ok();
    // Across the side where the values rise lies the triangle that the curve runs through next.
    let beyond = |k: usize, side: usize| edges.across(mesh, crossings[k].0, side).and_then(|(u, _)| index(u));
    let mut done = vec![false; crossings.len()];
    let mut curves = Vec::new();
    for closed in [false, true] {
        for start in 0..crossings.len() {
            if done[start] || (!closed && beyond(start, crossings[start].1.falling).is_some()) {
                continue;
            }
            let mut chain = Vec::new();
            let mut next = Some(start);
            while let Some(k) = next.filter(|&k| !done[k]) {
                done[k] = true;
                chain.push(k);
                next = beyond(k, crossings[k].1.rising);
            }
            curves.extend(curve(&chain, closed, |k, rising| {
                let (t, c) = crossings[k];
                level_point(mesh, t, if rising { c.rising } else { c.falling }, values, level, &place)
            }));
        }
    }
    curves
}

/// The sides of a triangle on which the values cross the level, going round counter-clockwise.
#[derive(Clone, Copy)]
struct Crossing {
    /// Side on which they fall from above to below.
    falling: usize,
    /// Side on which they rise from below to above.
    rising: usize,
}

impl Crossing {
    fn of(triangle: [u32; 3], values: &[f64], level: f64) -> Option<Self> {
        let mut above = [false; 3];
        for (k, v) in triangle.into_iter().enumerate() {
            above[k] = *values.get(v as usize).filter(|x| x.is_finite())? >= level;
        }
        let side = |from: bool| (0..3).find(|&k| above[k] == from && above[(k + 1) % 3] != from);
        Some(Self { falling: side(true)?, rising: side(false)? })
    }
}

/// Puts the points of a chain of triangles together: each is entered where values fall and left where they rise.
fn curve(chain: &[usize], closed: bool, point: impl Fn(usize, bool) -> LevelPoint) -> Option<LevelCurve> {
    let mut points: Vec<LevelPoint> = chain.iter().map(|&k| point(k, false)).collect();
    if !closed {
        points.extend(chain.last().map(|&k| point(k, true)));
    }
    // Of points at the same place the last one leads on.
    let n = points.len();
    let mut kept: Vec<LevelPoint> = Vec::with_capacity(n);
    for p in points {
        match kept.last_mut() {
            Some(last) if last.position == p.position => *last = p,
            _ => kept.push(p),
        }
    }
    if closed && kept.len() > 1 && kept[0].position == kept[kept.len() - 1].position {
        kept.pop();
    }
    (kept.len() >= if closed { 3 } else { 2 }).then_some(LevelCurve { points: kept, closed })
}

fn level_point(
    mesh: &TriMesh,
    triangle: u32,
    side: usize,
    values: &[f64],
    level: f64,
    place: impl Fn(u32, u32, f64) -> f64,
) -> LevelPoint {
    let v = mesh.triangles()[triangle as usize];
    let (a, b) = (v[side].min(v[(side + 1) % 3]), v[side].max(v[(side + 1) % 3]));
    // Always from the lower vertex, so that both triangles at the edge get the same bits.
    let (from, to) = (values[a as usize], values[b as usize]);
    let linear = (0.5 * level - 0.5 * from) / (0.5 * to - 0.5 * from);
    let fraction = place(a, b, linear.clamp(0.0, 1.0));
    let (p, q) = (mesh.vertices()[a as usize], mesh.vertices()[b as usize]);
    let position = match fraction {
        0.0 => p,
        1.0 => q,
        _ => p + (q - p) * fraction,
    };
    LevelPoint { position, triangle, edge: [a, b], fraction }
}

#[cfg(test)]
mod tests {
    use crate::surface::level_curves::*;
    use crate::test_kit::{Lcg, grid, torus};
    use std::f64::consts::TAU;

    /// What holds for every set of curves, whatever the values.
    fn check(mesh: &TriMesh, values: &[f64], level: f64, curves: &[LevelCurve]) {
        for c in curves {
            assert!(c.points.len() >= if c.closed { 3 } else { 2 });
            let n = c.points.len();
            for (k, p) in c.points.iter().enumerate() {
                let last = !c.closed && k + 1 == n;
                let [a, b] = p.edge.map(|v| v as usize);
                assert!(a < b && (values[a] >= level) != (values[b] >= level));
                let at = mesh.vertices()[a] + (mesh.vertices()[b] - mesh.vertices()[a]) * p.fraction;
                assert!((at - p.position).norm() < 1e-12);
                assert!(((1.0 - p.fraction) * values[a] + p.fraction * values[b] - level).abs() < 1e-9);
                let corners = mesh.triangles()[p.triangle as usize];
                assert!(corners.contains(&p.edge[0]) && corners.contains(&p.edge[1]), "on its triangle");
                if last {
                    continue;
                }
                // The piece to the next point lies in the triangle of this one, with the higher values on the left.
                let next = &c.points[(k + 1) % n];
                let step = next.position - p.position;
                assert!(step.norm() > 0.0);
                let normal = mesh.scaled_normal(p.triangle as usize).normalize();
                assert!(step.dot(&normal).abs() < 1e-9, "in the plane of the triangle");
                let left = normal.cross(&step);
                let [i, j] = [0, 1].map(|m| corners.map(|v| v as usize)[m]);
                let slope = mesh.corners(p.triangle as usize);
                // The gradient of the values over the triangle.
                let k3 = corners[2] as usize;
                let (e1, e2) = (slope[1] - slope[0], slope[2] - slope[0]);
                let (d1, d2) = (values[j] - values[i], values[k3] - values[i]);
                let n2 = e1.cross(&e2);
                let gradient = (e2.cross(&n2) * d1 + n2.cross(&e1) * d2) / n2.norm_squared();
                assert!(left.dot(&gradient) > 0.0);
            }
        }
    }

    #[test]
    fn random_values_give_sound_curves_that_cover_every_crossing_once() {
        let closed_mesh = torus(20.0, 6.0, 16);
        let open_mesh = grid((12, 9), (false, false), |u, v| Point3::new(9.0 * u, 7.0 * v, u * v));
        let mut rng = Lcg::new(12);
        for mesh in [&closed_mesh, &open_mesh] {
            for round in 0..40 {
                // Small whole numbers put many vertices exactly on the level.
                let values: Vec<f64> = (0..mesh.vertices().len())
                    .map(|_| if round % 2 == 0 { (rng.unit() * 5.0).floor() } else { rng.unit() * 4.0 })
                    .collect();
                let curves = level_curves(mesh, &values, 2.0);
                check(mesh, &values, 2.0, &curves);
                assert_eq!(curves, level_curves(mesh, &values, 2.0));
                if round % 2 == 1 {
                    let n_crossed = mesh
                        .triangles()
                        .iter()
                        .filter(|t| {
                            t.iter().any(|&v| values[v as usize] >= 2.0) && t.iter().any(|&v| values[v as usize] < 2.0)
                        })
                        .count();
                    let n_pieces: usize = curves.iter().map(|c| c.points.len() - usize::from(!c.closed)).sum();
                    assert_eq!(n_pieces, n_crossed);
                }
                if std::ptr::eq(mesh, &closed_mesh) {
                    assert!(curves.iter().all(|c| c.closed));
                }
            }
        }
    }

    #[test]
    fn a_plane_through_vertices_cuts_a_torus_in_two_whole_circles() {
        let mesh = torus(20.0, 6.0, 16);
        let values: Vec<f64> = mesh.vertices().iter().map(|p| if p.z.abs() < 1e-9 { 0.0 } else { p.z }).collect();
        let curves = level_curves(&mesh, &values, 0.0);
        assert_eq!(curves.len(), 2);
        for (curve, radius) in curves.iter().zip([14.0, 26.0]) {
            assert!(curve.closed && curve.points.len() == 16, "the vertices, each once");
            assert!(curve.points.iter().all(|p| (p.position.coords.norm() - radius).abs() < 1e-9));
        }
    }

    #[test]
    fn the_length_of_a_slanted_section_is_that_of_the_ellipse() {
        // Cylinder of radius 5 about z, cut by z = x / 2: half axes 5 and 5·√1.25; circumference after Ramanujan.
        let mesh = grid((200, 30), (true, false), |u, v| {
            Point3::new(5.0 * (u * TAU).cos(), 5.0 * (u * TAU).sin(), 12.0 * v - 6.0)
        });
        let values: Vec<f64> = mesh.vertices().iter().map(|p| p.z - 0.5 * p.x).collect();
        let curves = level_curves(&mesh, &values, 0.0);
        assert_eq!(curves.len(), 1);
        let p = &curves[0].points;
        let length: f64 = (0..p.len()).map(|k| (p[(k + 1) % p.len()].position - p[k].position).norm()).sum();
        let (a, b) = (5.0 * 1.25f64.sqrt(), 5.0);
        let h = ((a - b) / (a + b)).powi(2);
        let exact = TAU / 2.0 * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        assert!((length / exact - 1.0).abs() < 1e-3, "{length} {exact}");
    }

    #[test]
    fn missing_values_and_left_out_triangles_end_curves() {
        let mesh = grid((6, 1), (false, false), |u, v| Point3::new(6.0 * u, v, 0.0));
        let mut values: Vec<f64> = mesh.vertices().iter().map(|p| p.y).collect();
        assert_eq!(level_curves(&mesh, &values, 0.5).len(), 1);
        let edges = Edges::of(&mesh);
        assert_eq!(level_curves_among(&mesh, &edges, &values, 0.5, (0..12).filter(|&t| t != 5)).len(), 2);
        assert_eq!(level_curves(&mesh, &values[..4], 0.5).len(), 1);
        values[6] = f64::NAN;
        assert_eq!(level_curves(&mesh, &values, 0.5).len(), 2);
        assert!(level_curves(&mesh, &[], 0.5).is_empty());
        let huge: Vec<f64> = mesh.vertices().iter().map(|p| if p.y > 0.5 { f64::MAX } else { -f64::MAX }).collect();
        assert!(level_curves(&mesh, &huge, 0.0)[0].points.iter().all(|p| (p.position.y - 0.5).abs() < 1e-12));
    }

    #[test]
    fn a_tip_that_just_reaches_the_level_leaves_no_curve() {
        let mesh = grid((4, 4), (false, false), |u, v| Point3::new(u, v, 0.0));
        let mut values = vec![0.0; 25];
        values[12] = 1.0;
        assert!(level_curves(&mesh, &values, 1.0).is_empty());
        assert_eq!(level_curves(&mesh, &values, 0.5).len(), 1);
    }

    #[test]
    fn curves_end_at_a_non_manifold_edge() {
        // Three leaves on one edge.
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let vertices =
            vec![p(0.0, 0.0, 0.0), p(0.0, 0.0, 1.0), p(1.0, 0.0, 0.0), p(-1.0, 1.0, 0.0), p(-1.0, -1.0, 0.0)];
        let mesh = TriMesh::new(vertices, vec![[0, 2, 1], [0, 3, 1], [0, 4, 1]]).unwrap();
        let values: Vec<f64> = mesh.vertices().iter().map(|p| p.z).collect();
        let curves = level_curves(&mesh, &values, 0.5);
        assert_eq!(curves.len(), 3);
        assert!(curves.iter().all(|c| !c.closed && c.points.len() == 2));
    }
}
