//! Closed components of a mesh, and whether a point is inside one.

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// How the inside of a closed component is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    /// All triangles are wound alike: inside where the surface winds around the point, however often and in which
    /// sense.
    Winding,
    /// Some are not: inside where a half line crosses the surface an odd number of times.
    Parity,
}

/// The components of a mesh whose every edge is shared by an even number of triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct ClosedParts {
    /// Component of the triangles in the order of the leaves; [`OPEN`] for one that is no part of a closed one.
    component: Vec<u32>,
    rules: Vec<Rule>,
}

/// Component of triangles that bound nothing.
const OPEN: u32 = u32::MAX;

/// An edge of a triangle, with welded vertices in order of their index.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    triangle: u32,
    reversed: bool,
}

impl ClosedParts {
    /// The closed components of a mesh, its triangles named by their place in `order`; vertices with equal coordinates are
    /// one vertex.
    pub(crate) fn new(mesh: &TriMesh, order: &[u32]) -> Self {
        let n_triangles = mesh.triangles().len();
        let edges = grouped_edges(&welded(mesh), mesh.vertices().len());
        let mut sets = Sets::new(n_triangles);
        for pair in edges.windows(2) {
            if pair[0].ends == pair[1].ends {
                sets.join(pair[0].triangle, pair[1].triangle);
            }
        }
        // Triangles without edges (two equal corners) are in no run of edges and so stay open.
        let mut rule = vec![None; n_triangles];
        for run in edges.chunk_by(|a, b| a.ends == b.ends) {
            let root = sets.root(run[0].triangle) as usize;
            let n_reversed = run.iter().filter(|e| e.reversed).count();
            let here = if run.len() % 2 == 1 {
                Whole::Open
            } else if 2 * n_reversed == run.len() {
                Whole::Wound
            } else {
                Whole::Closed
            };
            rule[root] = rule[root].max(Some(here));
        }
        let mut number = vec![OPEN; n_triangles];
        let mut rules = Vec::new();
        for (root, whole) in rule.iter().enumerate() {
            let kind = match whole {
                Some(Whole::Wound) => Rule::Winding,
                Some(Whole::Closed) => Rule::Parity,
                Some(Whole::Open) | None => continue,
            };
            number[root] = rules.len() as u32;
            rules.push(kind);
        }
        let component = order.iter().map(|&t| number[sets.root(t) as usize]).collect();
        Self { component, rules }
    }

    /// Number of closed components.
    pub(crate) fn len(&self) -> usize {
        self.rules.len()
    }

    /// Whether nothing can be inside.
    pub(crate) fn is_empty(&self) -> bool {
        self.rules.is_empty()
    }

    /// Whether `origin` is inside a closed component; if so, the nearest place (in the order of the leaves) and point
    /// where the half line along the unit vector `along` leaves a component that `origin` is inside of. `candidates` are the
    /// places of all triangles that the half line may meet.
    ///
    /// Crossings are counted by a rule that gives every half line through an edge or corner to exactly one side, so a
    /// closed surface is never crossed a wrong number of times. `origin` on the surface may count either way.
    pub(crate) fn way_out(
        &self,
        candidates: impl IntoIterator<Item = usize>,
        corners: &[[Point3<f64>; 3]],
        origin: &Point3<f64>,
        along: &Vector3<f64>,
    ) -> Option<(usize, Point3<f64>)> {
        let ray = Ray::new(origin, along);
        let mut crossings: Vec<Crossing> = candidates
            .into_iter()
            .filter(|&place| self.component[place] != OPEN)
            .filter_map(|place| {
                let (turns, depth) = ray.crossing(&corners[place])?;
                Some(Crossing { component: self.component[place], place, turns, depth })
            })
            .collect();
        crossings.sort_by_key(|c| (c.component, c.place));
        crossings
            .chunk_by(|a, b| a.component == b.component)
            .filter(|run| match self.rules[run[0].component as usize] {
                Rule::Winding => run.iter().map(|c| c.turns).sum::<i32>() != 0,
                Rule::Parity => run.len() % 2 == 1,
            })
            .flatten()
            .min_by(|a, b| a.depth.total_cmp(&b.depth))
            .map(|c| (c.place, origin + along * c.depth))
    }
}

/// What is known of a component from its edges, the worst last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Whole {
    /// Every edge is run along as often in one sense as in the other.
    Wound,
    /// Every edge belongs to an even number of triangles.
    Closed,
    /// Some edge belongs to an odd number.
    Open,
}

/// Where a half line crosses a triangle.
struct Crossing {
    component: u32,
    place: usize,
    /// 1 or −1 by the triangle's sense.
    turns: i32,
    /// Distance along the half line.
    depth: f64,
}

/// A half line with two unit vectors across it.
struct Ray {
    origin: Point3<f64>,
    along: Vector3<f64>,
    across: [Vector3<f64>; 2],
}

impl Ray {
    fn new(origin: &Point3<f64>, along: &Vector3<f64>) -> Self {
        let mut other = Vector3::zeros();
        other[along.iamin()] = 1.0;
        let u = along.cross(&other).normalize();
        Self { origin: *origin, along: *along, across: [u, along.cross(&u)] }
    }

    /// Sense and depth of the crossing with a triangle ahead.
    ///
    /// The triangle's turns around the line are counted edge by edge, each by a sum whose sign the reversed edge has
    /// negated, exactly; so two triangles that share an edge never disagree about the side the line passes on.
    fn crossing(&self, corners: &[Point3<f64>; 3]) -> Option<(i32, f64)> {
        let seen = corners.map(|p| {
            let q = p - self.origin;
            [self.across[0].dot(&q), self.across[1].dot(&q), self.along.dot(&q)]
        });
        let mut turns = 0;
        let mut weights = [0.0; 3];
        for k in 0..3 {
            let (a, b) = (seen[(k + 1) % 3], seen[(k + 2) % 3]);
            weights[k] = a[0] * b[1] - a[1] * b[0];
            turns += i32::from(a[1] <= 0.0 && b[1] > 0.0 && weights[k] > 0.0);
            turns -= i32::from(b[1] <= 0.0 && a[1] > 0.0 && weights[k] < 0.0);
        }
        if turns == 0 {
            return None;
        }
        let depths = seen.map(|p| p[2]);
        let (nearest, farthest) = (depths[0].min(depths[1]).min(depths[2]), depths[0].max(depths[1]).max(depths[2]));
        let total: f64 = weights.iter().sum();
        let mean = weights[0] * depths[0] + weights[1] * depths[1] + weights[2] * depths[2];
        // Seen edge on the triangle has no depth of its own, but it is still crossed between its corners.
        let depth = if total != 0.0 { (mean / total).clamp(nearest, farthest) } else { 0.5 * (nearest + farthest) };
        (depth > 0.0).then_some((turns, depth))
    }
}

/// Vertex numbers of the triangles, the same for equal coordinates.
fn welded(mesh: &TriMesh) -> Vec<[u32; 3]> {
    // Adding 0 makes −0 the same vertex as 0.
    let key = |i: u32| mesh.vertices()[i as usize].coords.map(|c| c + 0.0);
    let order = |a: u32, b: u32| {
        let (p, q) = (key(a), key(b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
    let mut all: Vec<u32> = (0..mesh.vertices().len() as u32).collect();
    all.par_sort_unstable_by(|&a, &b| order(a, b));
    let mut number = vec![0; all.len()];
    for run in all.chunk_by(|&a, &b| order(a, b).is_eq()) {
        // Any of them may stand for all: how edges are ordered changes nothing.
        for &i in run {
            number[i as usize] = run[0];
        }
    }
    mesh.triangles().iter().map(|t| t.map(|v| number[v as usize])).collect()
}

/// The edges of the triangles, those with the same ends next to each other.
fn grouped_edges(triangles: &[[u32; 3]], n_vertices: usize) -> Vec<Edge> {
    // A triangle with two equal corners is an edge there and back: it bounds nothing.
    let proper = || triangles.iter().enumerate().filter(|(_, [a, b, c])| a != b && b != c && c != a);
    let all = || {
        proper().flat_map(|(t, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| Edge {
                ends: [from.min(to), from.max(to)],
                triangle: t as u32,
                reversed: from > to,
            })
        })
    };
    // Counted into place by the smaller end; what is left to sort are the few edges of one vertex.
    let mut start = vec![0usize; n_vertices + 1];
    all().for_each(|e| start[e.ends[0] as usize + 1] += 1);
    for k in 0..n_vertices {
        start[k + 1] += start[k];
    }
    let mut free = start.clone();
    let mut edges = vec![Edge { ends: [0; 2], triangle: 0, reversed: false }; start[n_vertices]];
    for edge in all() {
        let place = &mut free[edge.ends[0] as usize];
        edges[*place] = edge;
        *place += 1;
    }
    for k in 0..n_vertices {
        edges[start[k]..start[k + 1]].sort_unstable();
    }
    edges
}

/// Disjoint sets of triangles.
struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    fn root(&mut self, mut t: u32) -> u32 {
        while self.parent[t as usize] != t {
            // Halving the path keeps later walks short.
            self.parent[t as usize] = self.parent[self.parent[t as usize] as usize];
            t = self.parent[t as usize];
        }
        t
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
