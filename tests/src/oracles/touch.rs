//! Whether a body touches a mesh, over all triangles, by subdividing them: the slow definition of a
//! verdict.
//!
//! Nothing here comes from the crate under test: own formulas for the nearest point of a body, and
//! one argument. The distance f of a convex body is convex, so that over a triangle it is at least
//! f(c) + g·(q − c), where g is the unit vector from the nearest point to the centre c. A triangle
//! whose bound is beyond the limit is out, one whose centre is within the limit touches, any other
//! is cut in four. Before, planes along the triangle may part it from the body.

use std::collections::HashMap;

use facemill::cl_data::Solid;
use facemill::surface_model::TriMesh;
use facemill_test_kit::crossing_of_line;
use nalgebra::{Isometry3, Point3, Vector3};

/// A triangle.
type Corners = [Point3<f64>; 3];

/// Triangles that follow each other in the mesh and share one bounding ball.
const RUN: usize = 32;

/// Size (mm) of a piece of a triangle that is not cut any more: within it the distance changes by
/// less than any band that verdicts are compared in.
const LEAST_PIECE: f64 = 1e-10;

/// Pieces of one triangle: grazing ones take some hundreds. More would only tell more of sharp
/// bodies that touch along a line.
const MOST_PIECES: usize = 10_000;

/// A mesh to be touched.
pub struct Touchable {
    triangles: Vec<Corners>,
    balls: Vec<(Point3<f64>, f64)>,
    closed: Vec<ClosedComponent>,
    size: f64,
}

/// Triangles whose every edge belongs to an even number of them.
struct ClosedComponent {
    triangles: Vec<Corners>,
    balls: Vec<(Point3<f64>, f64)>,
    /// Whether every edge is run along as often in one sense as in the other.
    is_wound: bool,
}

impl Touchable {
    /// Of a mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        let triangles: Vec<Corners> = (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect();
        let points = || triangles.iter().flatten();
        let low = points().fold(Vector3::repeat(f64::INFINITY), |m, p| m.inf(&p.coords));
        let high = points().fold(Vector3::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.coords));
        let size = (high - low).norm();
        Self { balls: balls(&triangles), closed: closed_components(&triangles), size, triangles }
    }

    /// Diagonal of the mesh's box, mm.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Corners of the triangles.
    pub fn triangles(&self) -> &[Corners] {
        &self.triangles
    }

    /// Whether the surface has a point within the solid, which is dilated by `by` (mm) more;
    /// negative: made smaller. `None` where that takes too many pieces to tell: within some 1e-9 mm
    /// of touching along a line.
    pub fn touches(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, by: f64) -> Option<bool> {
        let (core, limit) = core_and_limit(solid, by);
        let from_mesh = mesh_from_solid.inverse();
        let runs = self.triangles.chunks(RUN).zip(&self.balls);
        let near = runs.filter(|(_, (center, radius))| distance(&core, &(from_mesh * center)).0 <= limit + radius);
        let mut is_sure = true;
        for t in near.flat_map(|(run, _)| run) {
            match piece_touches(&core, t.map(|p| from_mesh * p), limit) {
                Some(true) => return Some(true),
                Some(false) => {}
                None => is_sure = false,
            }
        }
        is_sure.then_some(false)
    }

    /// Whether a point is inside a closed component, by the crossings of a half line in the
    /// direction `along`. The direction should be any but a special one: a half line through an
    /// edge is counted by chance.
    pub fn contains(&self, point: &Point3<f64>, along: &Vector3<f64>) -> bool {
        self.closed.iter().any(|component| {
            let runs = component.triangles.chunks(RUN).zip(&component.balls);
            let near = runs.filter(|(_, (center, radius))| {
                let to_center = center - point;
                (to_center - along * to_center.dot(along)).norm() <= radius * (1.0 + 1e-9)
            });
            let turns: Vec<i32> = near.flat_map(|(run, _)| run).filter_map(|t| crossing(t, point, along)).collect();
            if component.is_wound { turns.iter().sum::<i32>() != 0 } else { turns.len() % 2 == 1 }
        })
    }
}

/// Whether some point of a triangle (the solid's frame) is within `limit` of the core; `None` where
/// [`MOST_PIECES`] do not tell.
fn piece_touches(core: &Core, triangle: Corners, limit: f64) -> Option<bool> {
    if is_apart_along_normal(core, &triangle, limit) {
        return Some(false);
    }
    let mut pieces = vec![triangle];
    let mut n_pieces = 0;
    while let Some(t) = pieces.pop() {
        n_pieces += 1;
        if n_pieces > MOST_PIECES {
            return None;
        }
        let center = Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0);
        let (f, nearest) = distance(core, &center);
        if f <= limit {
            return Some(true);
        }
        let g = (center - nearest) / f;
        let least = t.iter().map(|p| g.dot(&(p - center))).fold(f64::INFINITY, f64::min);
        if f + least > limit {
            continue;
        }
        if t.iter().map(|p| (p - center).norm()).fold(0.0, f64::max) < LEAST_PIECE {
            return None;
        }
        let middle = |a: usize, b: usize| nalgebra::center(&t[a], &t[b]);
        let [m, n, o] = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let mut four = [[t[0], m, o], [m, t[1], n], [o, n, t[2]], [m, n, o]];
        // The nearest is looked at first.
        let far = |t: &Corners| distance(core, &Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0)).0;
        four.sort_by(|a, b| far(b).total_cmp(&far(a)));
        pieces.extend(four);
    }
    Some(false)
}

/// Whether planes along the triangle are more than `limit` apart, the body on one side and the
/// triangle on the other.
fn is_apart_along_normal(core: &Core, t: &Corners, limit: f64) -> bool {
    let scaled = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let area = scaled.norm();
    [scaled / area, -scaled / area].iter().any(|n| {
        let reach = match core {
            Core::Box(half) => n.abs().dot(half),
            Core::Turned(section) => {
                let across = (n.x * n.x + n.y * n.y).sqrt();
                section.iter().map(|(rho, z)| rho * across + z * n.z).fold(f64::NEG_INFINITY, f64::max)
            }
        };
        t.iter().all(|p| n.dot(&p.coords) - reach > limit)
    })
}

/// An undilated body in its own frame.
enum Core {
    /// Corners of the half section in (distance from the axis, z), from the lower end of the axis
    /// to the upper one.
    Turned([(f64, f64); 4]),
    /// Half extents.
    Box(Vector3<f64>),
}

/// The undilated body, made smaller where the dilation would be negative, and the dilation that is
/// left.
fn core_and_limit(solid: &Solid, by: f64) -> (Core, f64) {
    let limit = solid.rounding() + by;
    let less = (-limit).max(0.0);
    let core = match solid {
        Solid::Frustum(f) => {
            let (low, high) = (f.z_low + less, f.z_high - less);
            let (r_low, r_high) = ((f.radius_low - less).max(0.0), (f.radius_high - less).max(0.0));
            Core::Turned([(0.0, low), (r_low, low), (r_high, high), (0.0, high)])
        }
        Solid::Box(b) => Core::Box(b.half_extents.add_scalar(-less)),
        Solid::Hull(_) => panic!("no scene of this oracle has a body that is a mesh"),
    };
    (core, limit.max(0.0))
}

/// Distance of a point from the body and the body's nearest point.
fn distance(core: &Core, p: &Point3<f64>) -> (f64, Point3<f64>) {
    let nearest = match core {
        Core::Box(half) => Point3::from(p.coords.zip_map(half, |x, h| x.max(-h).min(h))),
        Core::Turned(section) => {
            let rho = (p.x * p.x + p.y * p.y).sqrt();
            let (r, z) = nearest_of_section(section, rho, p.z);
            let share = if rho > 0.0 { r / rho } else { 0.0 };
            let beside = if rho > 0.0 { (p.x * share, p.y * share) } else { (r, 0.0) };
            Point3::new(beside.0, beside.1, z)
        }
    };
    ((p - nearest).norm(), nearest)
}

/// Nearest point of a convex half section: the point itself, or the nearest of its three sides off
/// the axis.
fn nearest_of_section(s: &[(f64, f64); 4], rho: f64, z: f64) -> (f64, f64) {
    let ((r_low, low), (r_high, high)) = (s[1], s[2]);
    let is_beside_wall = (rho - r_low) * (high - low) - (z - low) * (r_high - r_low) > 0.0;
    if low <= z && z <= high && !is_beside_wall && (high > low || rho <= r_low.max(r_high)) {
        return (rho, z);
    }
    let mut best = (f64::INFINITY, (rho, z));
    for w in s.windows(2) {
        let ((ax, az), (ux, uz)) = (w[0], (w[1].0 - w[0].0, w[1].1 - w[0].1));
        let length_sq = ux * ux + uz * uz;
        let t = if length_sq > 0.0 { (((rho - ax) * ux + (z - az) * uz) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
        let q = (ax + t * ux, az + t * uz);
        let far = (rho - q.0).hypot(z - q.1);
        if far < best.0 {
            best = (far, q);
        }
    }
    best.1
}

/// 1 or −1 where a half line leaves through the triangle's front or enters by it, `None` where it
/// passes by.
fn crossing(t: &Corners, origin: &Point3<f64>, along: &Vector3<f64>) -> Option<i32> {
    let is_outward = (t[1] - t[0]).cross(&(t[2] - t[0])).dot(along) > 0.0;
    crossing_of_line(t, origin, along).filter(|s| *s > 0.0).map(|_| if is_outward { 1 } else { -1 })
}

fn balls(triangles: &[Corners]) -> Vec<(Point3<f64>, f64)> {
    let ball = |run: &[Corners]| {
        let n = 3.0 * run.len() as f64;
        let center = Point3::from(run.iter().flatten().fold(Vector3::zeros(), |sum, p| sum + p.coords) / n);
        (center, run.iter().flatten().map(|p| (p - center).norm()).fold(0.0, f64::max) * (1.0 + 1e-12))
    };
    triangles.chunks(RUN).map(ball).collect()
}

/// Components that hang together by edges and are closed; points with equal coordinates are one.
fn closed_components(triangles: &[Corners]) -> Vec<ClosedComponent> {
    let key = |p: &Point3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    // Of each edge: the triangles with the sense in which they run along it.
    let mut edges: HashMap<[[u64; 3]; 2], Vec<(usize, bool)>> = HashMap::new();
    for (k, t) in triangles.iter().enumerate() {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (key(&t[a]), key(&t[b]));
            if a != b {
                edges.entry([a.min(b), a.max(b)]).or_default().push((k, a < b));
            }
        }
    }
    let mut parent: Vec<usize> = (0..triangles.len()).collect();
    for users in edges.values() {
        for other in &users[1..] {
            let (a, b) = (root(&mut parent, users[0].0), root(&mut parent, other.0));
            parent[a] = b;
        }
    }
    let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
    (0..triangles.len()).for_each(|k| members.entry(root(&mut parent, k)).or_default().push(k));
    let mut kind: HashMap<usize, (bool, bool)> = HashMap::new();
    for users in edges.values() {
        let forward = users.iter().filter(|u| u.1).count();
        let (is_closed, is_wound) = kind.entry(root(&mut parent, users[0].0)).or_insert((true, true));
        *is_closed &= users.len() % 2 == 0;
        *is_wound &= 2 * forward == users.len();
    }
    let closed = members.into_iter().filter_map(|(root, members)| {
        let &(is_closed, is_wound) = kind.get(&root)?;
        let triangles: Vec<Corners> = members.iter().map(|&k| triangles[k]).collect();
        is_closed.then(|| ClosedComponent { balls: balls(&triangles), triangles, is_wound })
    });
    closed.collect()
}

fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}
