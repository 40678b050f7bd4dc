//! Closed components of a mesh, and whether a point is inside one.

use facemill_cl_data::mixed_bits;
use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Vector3};

/// Rule that decides the inside of a closed component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    /// All triangles are wound alike: inside where the surface winds around the point, however
    /// often and in which sense.
    Winding,
    /// Some are not: inside where a half line crosses the surface an odd number of times.
    Parity,
}

/// The components of a mesh whose every edge is shared by an even number of triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct ClosedParts {
    /// Component of the triangles in the order of the leaves; [`OPEN`] for one that is no part of a
    /// closed one.
    component: Vec<u32>,
    rules: Vec<Rule>,
}

/// Component of triangles that bound nothing.
const OPEN: u32 = u32::MAX;

impl ClosedParts {
    /// Number of closed components.
    pub(crate) fn len(&self) -> usize {
        self.rules.len()
    }

    /// Whether nothing can be inside.
    pub(crate) fn is_empty(&self) -> bool {
        self.rules.is_empty()
    }

    /// Whether `origin` is inside a closed component; if so, the nearest place (in the order of the
    /// leaves) and point where the half line along the unit vector `along` leaves a component that
    /// `origin` is inside of. `candidates` are the places of all triangles that the half line may
    /// meet.
    ///
    /// Crossings are counted by a rule that gives every half line through an edge or corner to
    /// exactly one side, so a closed surface is never crossed a wrong number of times. `origin` on
    /// the surface may count either way.
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

/// State of a component by its edges, the worst last.
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
    /// The triangle's turns around the line are counted edge by edge, each by a sum whose sign the
    /// reversed edge has negated, exactly; so two triangles that share an edge never disagree about
    /// the side the line passes on.
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
        // Seen edge on the triangle has no depth of its own, but it is still crossed between its
        // corners.
        let depth = if total != 0.0 { (mean / total).clamp(nearest, farthest) } else { 0.5 * (nearest + farthest) };
        (depth > 0.0).then_some((turns, depth))
    }
}

/// The closed components of a mesh; vertices with equal coordinates are one vertex.
pub(crate) struct Components {
    /// Component of each triangle; [`OPEN`] for one that is no part of a closed one.
    number: Vec<u32>,
    rules: Vec<Rule>,
}

impl Components {
    /// The components with their triangles named by their place in `order`.
    pub(crate) fn ordered(self, order: &[u32]) -> ClosedParts {
        let component = order.iter().map(|&t| self.number[t as usize]).collect();
        ClosedParts { component, rules: self.rules }
    }

    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let triangles = welded(mesh);
        let Sides { start, mut sides } = Sides::of(&triangles, mesh.vertices().len());
        let mut sets = Sets::new(triangles.len());
        // Triangles without edges (two equal corners) bound nothing.
        let mut whole: Vec<Whole> =
            triangles.iter().map(|t| if is_proper(t) { Whole::Wound } else { Whole::Open }).collect();
        for ends in start.windows(2) {
            let of_vertex = &mut sides[ends[0]..ends[1]];
            of_vertex.sort_unstable();
            for run in of_vertex.chunk_by(|a, b| a.other_end() == b.other_end()) {
                let first = run[0].triangle();
                run[1..].iter().for_each(|side| sets.join(first, side.triangle()));
                let n_reversed = run.iter().filter(|side| side.is_reversed()).count();
                let here = if run.len() % 2 == 1 {
                    Whole::Open
                } else if 2 * n_reversed == run.len() {
                    Whole::Wound
                } else {
                    Whole::Closed
                };
                whole[first as usize] = whole[first as usize].max(here);
            }
        }
        let roots = sets.roots();
        for (t, &root) in roots.iter().enumerate() {
            whole[root as usize] = whole[root as usize].max(whole[t]);
        }
        // A component is numbered by its first triangle, which is its root.
        let (mut number, mut rules) = (vec![OPEN; triangles.len()], Vec::new());
        for (t, &root) in roots.iter().enumerate() {
            let rule = match whole[root as usize] {
                Whole::Wound => Rule::Winding,
                Whole::Closed => Rule::Parity,
                Whole::Open => continue,
            };
            if root as usize == t {
                number[t] = rules.len() as u32;
                rules.push(rule);
            } else {
                number[t] = number[root as usize];
            }
        }
        Self { number, rules }
    }
}

/// Whether no two corners are one: else it is an edge there and back.
fn is_proper([a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Vertex numbers of the triangles, the same for equal coordinates.
fn welded(mesh: &TriMesh) -> Vec<[u32; 3]> {
    // Adding 0 makes −0 the same vertex as 0.
    let key = |i: u32| mesh.vertices()[i as usize].coords.map(|c| (c + 0.0).to_bits());
    let n = mesh.vertices().len();
    // At most half full, so that a free slot is near.
    let mut slots = vec![NO_VERTEX; (2 * n).next_power_of_two()];
    let mask = slots.len() - 1;
    let mut number = vec![0; n];
    for i in 0..n as u32 {
        let key_i = key(i);
        let mut at = mixed(&key_i) as usize & mask;
        while slots[at] != NO_VERTEX && key(slots[at]) != key_i {
            at = (at + 1) & mask;
        }
        if slots[at] == NO_VERTEX {
            slots[at] = i;
        }
        number[i as usize] = slots[at];
    }
    mesh.triangles().iter().map(|t| t.map(|v| number[v as usize])).collect()
}

/// No vertex: a mesh has fewer.
const NO_VERTEX: u32 = u32::MAX;

/// Bits of three coordinates, all mixed into all: regular grids differ in few of them.
fn mixed(key: &Vector3<u64>) -> u64 {
    key.iter().fold(0, |hash, bits| mixed_bits(hash ^ bits))
}

/// A side of a triangle seen from the smaller of its ends: the other end (32 bits), the triangle
/// (31 bits, as in the tree), and whether it runs toward the smaller end. Sides of one edge sort
/// next to each other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side(u64);

impl Side {
    fn new(other_end: u32, triangle: u32, is_reversed: bool) -> Self {
        Self(u64::from(other_end) << 32 | u64::from(triangle) << 1 | u64::from(is_reversed))
    }

    fn other_end(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn triangle(self) -> u32 {
        self.0 as u32 >> 1
    }

    fn is_reversed(self) -> bool {
        self.0 & 1 == 1
    }
}

/// The sides of all triangles by their smaller end.
struct Sides {
    /// Where the sides of each vertex start, and the end of all.
    start: Vec<usize>,
    sides: Vec<Side>,
}

impl Sides {
    fn of(triangles: &[[u32; 3]], n_vertices: usize) -> Self {
        let proper = || triangles.iter().enumerate().filter(|(_, t)| is_proper(t));
        let ends = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
        let mut start = vec![0usize; n_vertices + 1];
        for (_, t) in proper() {
            ends(*t).iter().for_each(|(a, b)| start[*a.min(b) as usize + 1] += 1);
        }
        for k in 0..n_vertices {
            start[k + 1] += start[k];
        }
        let mut free = start.clone();
        let mut sides = vec![Side(0); start[n_vertices]];
        for (t, corners) in proper() {
            for (a, b) in ends(*corners) {
                let place = &mut free[a.min(b) as usize];
                sides[*place] = Side::new(a.max(b), t as u32, a > b);
                *place += 1;
            }
        }
        Self { start, sides }
    }
}

/// Disjoint sets of triangles; the lowest member identifies its set.
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

    /// The lowest member of each triangle's set.
    fn roots(mut self) -> Vec<u32> {
        for t in 0..self.parent.len() {
            // Parents come first, so theirs is known.
            self.parent[t] = self.parent[self.parent[t] as usize];
        }
        self.parent
    }
}
