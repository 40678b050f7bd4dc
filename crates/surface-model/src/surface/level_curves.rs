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
    /// Position, mm.
    pub position: Point3<f64>,
    /// Triangle through which the curve runs after this point; at the end of an open curve, the one
    /// before it.
    pub triangle: u32,
    /// Vertices of the edge it lies on, the lower index first.
    pub edge: [u32; 2],
    /// Fraction of the edge, from 0 at its first vertex to 1 at its second.
    pub fraction: f64,
}

/// Returns the curves on a mesh along which values given at its vertices, linear between them, are
/// `level`.
///
/// Values at the level count as above it, so no curve branches, and a curve through a vertex meets
/// it exactly. A row of vertices at the level gives a curve along them, where lower values are
/// beside it. Seen from outside, the higher values are on the left. Curves end at open and
/// non-manifold edges and where neighbours are wound against each other. Triangles with a vertex
/// whose value is missing or not finite carry no curve. Where only one vertex reaches the level,
/// the curve has no length and is left out.
///
/// The triangles determine the order: open curves by their first triangle, then closed ones by
/// their lowest.
#[must_use]
pub fn level_curves(mesh: &TriMesh, values: &[f64], level: f64) -> Vec<LevelCurve> {
    level_curves_among(mesh, &Edges::of(mesh), values, level, 0..mesh.triangles().len() as u32)
}

/// Computes [`level_curves`] in some of the triangles, with the mesh's edges already found.
///
/// `among` are the triangles in rising order, including those that do not cross the level. The work
/// grows with their number, not with the size of the mesh.
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

/// Marches through the triangles; `place` may correct where on an edge (lower vertex, higher
/// vertex) the curve crosses.
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
    // The next triangle of the curve lies across the side where the values rise.
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

/// Sides of a triangle on which the values cross the level, in counter-clockwise order.
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

/// Joins the points of a chain of triangles: each is entered where values fall and left where they
/// rise.
fn curve(chain: &[usize], closed: bool, point: impl Fn(usize, bool) -> LevelPoint) -> Option<LevelCurve> {
    let mut points: Vec<LevelPoint> = chain.iter().map(|&k| point(k, false)).collect();
    if !closed {
        points.extend(chain.last().map(|&k| point(k, true)));
    }
    // Among points at the same place, the last one continues the curve.
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
#[path = "../../tests/unit/surface/level_curves.rs"]
mod tests;
