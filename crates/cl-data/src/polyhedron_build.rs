//! A convex polyhedron around points, cut from their box by half spaces that hold them all.
//!
//! For any directions of the cuts, the rest contains every point; the directions decide only how
//! much more it contains.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use crate::polyhedron::ConvexPolyhedron;

/// Reason why there is no body around points.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolyhedronError {
    /// A coordinate is NaN or infinite.
    #[error("point {index} is not finite")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
    /// A coordinate is larger than [`ConvexPolyhedron::FARTHEST`].
    #[error("point {index} is more than a kilometre from the origin (is the unit right?)")]
    TooFar {
        /// Index of the point, from 0.
        index: usize,
    },
    /// The points are all in a plane, or there are fewer than four.
    #[error("its points are in one plane, to a micrometre: a body needs four that are not")]
    Flat,
    /// Rounding left no closed body.
    #[error("its points are too thin or too near to each other for a body around them")]
    Degenerate,
}

/// Least depth of a cut, mm: a polyhedron may exceed its points by this much anyway, and thinner
/// slices only cost vertices.
const LEAST_CUT: f64 = 1e-4;

/// Least thickness of a body, mm.
const LEAST_THICKNESS: f64 = 1e-3;

/// Relative distance to a plane below which a vertex counts as on it: some hundred times the
/// rounding of coordinates, so planes through one vertex do not leave slivers.
const ON_PLANE: f64 = 1e-13;

/// Relative distance outside up to which a point counts as contained: 1e-9 mm at a metre, the band
/// of verdicts. Vertices on several planes may be off by several times [`ON_PLANE`].
const HELD: f64 = 1e-12;

/// A polyhedron of this many faces has at most 128 vertices.
const MOST_FACES: usize = ConvexPolyhedron::MOST_VERTICES / 2 + 2;

/// Largest number of directions taken from the surface itself, those of the largest area.
const MOST_FACETS: usize = 500;

impl ConvexPolyhedron {
    /// Largest coordinate of a point, mm: a kilometre.
    pub const FARTHEST: f64 = 1e6;

    /// Creates a convex polyhedron that contains all the points, to 1e-12 of their coordinates
    /// (1e-9 mm at a metre); 0.1 s for 4000.
    ///
    /// It is their box, cut by planes that touch the points: along the facets of their hull where
    /// these are few, which gives the hull itself, and else along as many as
    /// [`Self::MOST_VERTICES`] allow, the deepest cut first. `facets` are normals of the surface of
    /// the points, of the length of a facet's area: hints that make it tighter, and may be empty.
    ///
    /// # Errors
    /// [`PolyhedronError`].
    pub fn around(
        points: &[Point3<f64>],
        facets: impl IntoIterator<Item = Vector3<f64>>,
    ) -> Result<Self, PolyhedronError> {
        let size = checked_size(points)?;
        let on_plane = ON_PLANE * size.max(1.0);
        let cuts = directions(points, facets).into_iter().map(|n| Cut::touching(points, n, on_plane));
        let (along_facets, others): (Vec<_>, Vec<_>) = cuts.partition(|cut| cut.is_along_facet);
        let cut = Cell::of_box(points).cut_deepest_first(along_facets, on_plane).cut_deepest_first(others, on_plane);
        // Everything above can only make it looser; this checks that it contains the points. Their
        // box always does.
        let holds = |polyhedron: &Self| points.iter().all(|p| polyhedron.nearest(p).distance <= HELD * size.max(1.0));
        [cut, Cell::of_box(points)].iter().filter_map(Cell::closed).find(holds).ok_or(PolyhedronError::Degenerate)
    }
}

/// A half space that contains the points and touches them.
struct Cut {
    normal: Vector3<f64>,
    offset: f64,
    /// Whether it touches at least three of them.
    is_along_facet: bool,
}

impl Cut {
    fn touching(points: &[Point3<f64>], normal: Vector3<f64>, on_plane: f64) -> Self {
        let offset = reach(points, &normal);
        let near = 10.0 * on_plane;
        let n_touched = points.iter().filter(|p| normal.dot(&p.coords) >= offset - near).take(3).count();
        Self { normal, offset, is_along_facet: n_touched == 3 }
    }
}

/// Returns the largest coordinate of points that a body can be made around.
fn checked_size(points: &[Point3<f64>]) -> Result<f64, PolyhedronError> {
    let mut size = 0.0f64;
    for (index, p) in points.iter().enumerate() {
        if !p.iter().all(|v| v.is_finite()) {
            return Err(PolyhedronError::NotFinite { index });
        }
        if p.coords.amax() > ConvexPolyhedron::FARTHEST {
            return Err(PolyhedronError::TooFar { index });
        }
        size = size.max(p.coords.amax());
    }
    if thickness(points) < LEAST_THICKNESS { Err(PolyhedronError::Flat) } else { Ok(size) }
}

/// Returns the distance of the farthest point from the plane of three that are far apart, mm.
fn thickness(points: &[Point3<f64>]) -> f64 {
    let farthest = |of: &dyn Fn(&Point3<f64>) -> f64| {
        points.iter().map(|p| (of(p), *p)).reduce(|a, b| if b.0 > a.0 { b } else { a })
    };
    let Some(&first) = points.first() else { return 0.0 };
    let Some((_, a)) = farthest(&|p| (p - first).norm()) else { return 0.0 };
    let Some((length, b)) = farthest(&|p| (p - a).norm()) else { return 0.0 };
    let along = (b - a) / length;
    let Some((width, c)) = farthest(&|p| (p - a).cross(&along).norm()) else { return 0.0 };
    let normal = along.cross(&(c - a)) / width;
    let height = farthest(&|p| normal.dot(&(p - a)).abs()).map_or(0.0, |(height, _)| height);
    if height.is_finite() { height.min(width) } else { 0.0 }
}

/// Returns the largest coordinate along a direction.
fn reach(points: &[Point3<f64>], along: &Vector3<f64>) -> f64 {
    points.iter().map(|p| along.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max)
}

/// Returns unit vectors to cut along: those of the surface, those of the hull's facets found from
/// directions all around, and these directions.
fn directions(points: &[Point3<f64>], facets: impl IntoIterator<Item = Vector3<f64>>) -> Vec<Vector3<f64>> {
    let mut all = largest_facets(facets);
    all.extend(hull_facet(points, &Vector3::z()).into_iter().flat_map(|first| wrapped(points, first)));
    let around = || (0..125).map(|k| Vector3::new(k % 5, k / 5 % 5, k / 25).map(|c| f64::from(c) - 2.0));
    for direction in around().filter_map(|v| v.try_normalize(0.0)) {
        all.extend(hull_facet(points, &direction).map(|facet| facet.normal));
        all.push(direction);
    }
    all
}

/// Returns the directions of the largest area, only one of those within half a degree.
fn largest_facets(facets: impl IntoIterator<Item = Vector3<f64>>) -> Vec<Vector3<f64>> {
    let mut by_direction: BTreeMap<[i32; 3], (f64, f64, Vector3<f64>)> = BTreeMap::new();
    for scaled in facets {
        let area = scaled.norm();
        let Some(normal) = scaled.try_normalize(0.0).filter(|n| n.iter().all(|v| v.is_finite())) else { continue };
        let key = normal.map(|v| (v * 128.0).round() as i32).into();
        let entry = by_direction.entry(key).or_insert((0.0, 0.0, normal));
        entry.0 += area;
        if area > entry.1 {
            (entry.1, entry.2) = (area, normal);
        }
    }
    let mut all: Vec<_> = by_direction.into_values().collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(MOST_FACETS).map(|(_, _, normal)| normal).collect()
}

/// A facet of the points' hull: a plane that touches three of them.
struct HullFacet {
    normal: Vector3<f64>,
    corners: [usize; 3],
}

/// Returns a facet of the hull near a direction: the plane that touches the points there, turned
/// until it touches a second and a third one. `None` where they do not determine it.
fn hull_facet(points: &[Point3<f64>], direction: &Vector3<f64>) -> Option<HullFacet> {
    let farther =
        |a: usize, b: usize| if direction.dot(&points[b].coords) > direction.dot(&points[a].coords) { b } else { a };
    let a = (0..points.len()).reduce(farther)?;
    let across = direction.cross(&Vector3::ith(direction.iamin(), 1.0)).try_normalize(0.0)?;
    let (normal, b) = turned(points, &points[a], direction, &across)?;
    let edge = (points[b] - points[a]).try_normalize(0.0)?;
    let (normal, c) = turned(points, &points[a], &normal, &edge)?;
    Some(HullFacet { normal, corners: [a, b, c] })
}

/// Follows facets of the hull from one to the next over their edges, all of them where the hull has
/// few.
fn wrapped(points: &[Point3<f64>], first: HullFacet) -> Vec<Vector3<f64>> {
    let mut all = vec![first.normal];
    let (mut passed, mut pending) = (BTreeSet::new(), vec![first]);
    while let Some(HullFacet { normal, corners: [a, b, c] }) = pending.pop() {
        for (from, to, third) in [(a, b, c), (b, c, a), (c, a, b)] {
            if passed.len() >= MOST_TURNS || !passed.insert((from.min(to), from.max(to))) {
                continue;
            }
            let Some(edge) = (points[to] - points[from]).try_normalize(0.0) else { continue };
            // Away from the facet itself.
            let inward = edge.cross(&normal).dot(&(points[third] - points[from])) > 0.0;
            let axis = if inward { -edge } else { edge };
            let Some((normal, next)) = turned(points, &points[from], &normal, &axis) else { continue };
            all.push(normal);
            pending.push(HullFacet { normal, corners: [from, to, next] });
        }
    }
    all
}

/// Turns a plane through `a` about `axis` until it touches a point, and returns that point.
fn turned(
    points: &[Point3<f64>],
    a: &Point3<f64>,
    normal: &Vector3<f64>,
    axis: &Vector3<f64>,
) -> Option<(Vector3<f64>, usize)> {
    let toward = axis.cross(normal);
    // The plane may turn by more than a right angle.
    let touched = points.iter().enumerate().filter_map(|(k, p)| {
        let (beside, below) = (toward.dot(&(p - a)), -normal.dot(&(p - a)).min(0.0));
        let near = 1e-9 * (1.0 + (p - a).norm());
        let from_axis = beside.hypot(below);
        (beside > near || below > near).then_some((beside / from_axis, below / from_axis, k))
    });
    let (cos, sin, k) = touched.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    Some(((normal * cos + toward * sin).try_normalize(0.0)?, k))
}

/// Largest number of edges over which facets of the hull are followed: enough for all hulls that
/// can be kept as they are.
const MOST_TURNS: usize = 400;

/// A convex polyhedron under construction.
struct Cell {
    vertices: Vec<Point3<f64>>,
    /// Outward unit normals, and corners counterclockwise seen from outside.
    faces: Vec<(Vector3<f64>, Vec<u32>)>,
}

impl Cell {
    /// Returns the box of the points.
    fn of_box(points: &[Point3<f64>]) -> Self {
        let along = |k: usize, sign: f64| sign * reach(points, &(Vector3::ith(k, 1.0) * sign));
        let (min, max) = (Vector3::from_fn(|k, _| along(k, -1.0)), Vector3::from_fn(|k, _| along(k, 1.0)));
        let corner = |k: usize| Vector3::from_fn(|axis, _| if k >> axis & 1 == 0 { min[axis] } else { max[axis] });
        let quads: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let normal = |k: usize| Vector3::ith(k / 2, if k.is_multiple_of(2) { -1.0 } else { 1.0 });
        Self {
            vertices: (0..8).map(|k| corner(k).into()).collect(),
            faces: quads.iter().enumerate().map(|(k, quad)| (normal(k), quad.to_vec())).collect(),
        }
    }

    /// Cuts along the deepest of the cuts, and repeats, until no remaining cut is deep enough or
    /// the number of faces is at its limit.
    fn cut_deepest_first(mut self, mut cuts: Vec<Cut>, on_plane: f64) -> Self {
        while self.faces.len() < MOST_FACES {
            let depths = cuts.iter().enumerate().map(|(k, cut)| (reach(&self.vertices, &cut.normal) - cut.offset, k));
            let Some((depth, k)) = depths.reduce(|a, b| if b.0 > a.0 { b } else { a }) else { break };
            if depth.is_nan() || depth < LEAST_CUT {
                break;
            }
            let cut = cuts.swap_remove(k);
            // A cut spoiled by rounding is left out: the rest contains the points as before.
            if let Some(smaller) = self.cut(&cut.normal, cut.offset, on_plane) {
                self = smaller;
            }
        }
        self
    }

    /// Returns the part behind a plane, to within `on_plane`; `None` if that is no polyhedron of
    /// the allowed size.
    fn cut(&self, normal: &Vector3<f64>, offset: f64, on_plane: f64) -> Option<Self> {
        let heights: Vec<f64> = self.vertices.iter().map(|v| normal.dot(&v.coords) - offset).collect();
        let mut cut = Self { vertices: self.vertices.clone(), faces: Vec::new() };
        let mut crossings = BTreeMap::new();
        // Successor of each corner on the new face's border.
        let mut border = BTreeMap::new();
        for (face_normal, corners) in &self.faces {
            let mut left = Vec::new();
            let (mut leaves, mut returns) = (None, None);
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                let (above_a, above_b) = (heights[a as usize] > on_plane, heights[b as usize] > on_plane);
                if !above_a {
                    left.push(a);
                }
                if above_a != above_b {
                    let (inner, outer) = if above_a { (b, a) } else { (a, b) };
                    let crossing = *crossings
                        .entry((inner, outer))
                        .or_insert_with(|| cut.crossing(inner, outer, &heights, on_plane));
                    let end = if above_a { &mut returns } else { &mut leaves };
                    if end.replace(crossing).is_some() {
                        return None;
                    }
                    if crossing != inner {
                        left.push(crossing);
                    }
                }
            }
            if let (Some(leaves), Some(returns)) = (leaves, returns)
                && leaves != returns
                && border.insert(returns, leaves).is_some()
            {
                return None;
            }
            if left.len() >= 3 {
                cut.faces.push((*face_normal, left));
            }
        }
        cut.faces.push((*normal, closed_loop(&border)?));
        cut.without_unused();
        (cut.vertices.len() <= ConvexPolyhedron::MOST_VERTICES && cut.closed().is_some()).then_some(cut)
    }

    /// Returns the vertex where an edge leaves through the plane: its inner end where that is on
    /// the plane, else a new one.
    fn crossing(&mut self, inner: u32, outer: u32, heights: &[f64], on_plane: f64) -> u32 {
        let (low, high) = (heights[inner as usize], heights[outer as usize]);
        if low >= -on_plane {
            return inner;
        }
        let (a, b) = (self.vertices[inner as usize], self.vertices[outer as usize]);
        self.vertices.push(a + (b - a) * (low / (low - high)));
        (self.vertices.len() - 1) as u32
    }

    fn without_unused(&mut self) {
        let mut new_place = vec![None; self.vertices.len()];
        let mut kept = Vec::new();
        for corner in self.faces.iter_mut().flat_map(|f| &mut f.1) {
            let place = new_place[*corner as usize].get_or_insert_with(|| {
                kept.push(self.vertices[*corner as usize]);
                (kept.len() - 1) as u32
            });
            *corner = *place;
        }
        self.vertices = kept;
    }

    fn closed(&self) -> Option<ConvexPolyhedron> {
        ConvexPolyhedron::from_faces(self.vertices.clone(), self.faces.clone())
    }
}

/// Returns the one loop made by steps from corner to corner; `None` where they make none or
/// several.
fn closed_loop(next: &BTreeMap<u32, u32>) -> Option<Vec<u32>> {
    let first = *next.keys().next()?;
    let mut all = vec![first];
    loop {
        let following = *next.get(all.last()?)?;
        if following == first {
            break;
        }
        if all.len() == next.len() {
            return None;
        }
        all.push(following);
    }
    (all.len() == next.len() && all.len() >= 3).then_some(all)
}
