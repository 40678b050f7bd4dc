//! Band of the hub's cylinder around the blades' roots, as triangles.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point2, Point3};
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, HasPosition, RefinementParameters, Triangulation};

use crate::propeller_solid::ball::fault;
use crate::propeller_solid::sector::Corner;
use crate::spec_error::SpecError;

/// Closed curve on the hub where the balls of one blade touch it.
///
/// Points are in a plane that is the hub's cylinder unrolled and scaled by the number of blades K
/// over the hub radius: x = K·θ, y = K·z/r. A sector of the hub is a strip 2π wide, both of whose
/// sides are the same line.
#[derive(Debug)]
pub(crate) struct HubLoop {
    points: Vec<Point2<f64>>,
}

/// Longest band in the scaled plane: coordinates of its image in the plane of the triangulation
/// span the exponential of it, and their fourth powers must be numbers.
const LONGEST_BAND: f64 = 200.0;

/// Least number of lattice points in a sector: larger triangles would be bent by the mapping.
const LEAST_AROUND: usize = 24;

/// Least distance of lattice points from the loop over the lattice's spacing.
const CLEARANCE: f64 = 0.6;

/// Angle above which triangles between loop and lattice are brought, degrees; larger takes many
/// more points, smaller leaves slivers.
const LEAST_ANGLE: f64 = 25.0;

/// Most lattice points of a sector.
const MOST_POINTS: usize = 1_000_000;

/// Trials with a lattice of ever smaller spacing.
const MOST_TRIALS: usize = 8;

impl HubLoop {
    /// Returns the loop through points on a hub, or a fault where it crosses itself or that of the
    /// next blade; `angles` are the points' contour angles.
    pub(crate) fn new(
        on_hub: impl Iterator<Item = Point3<f64>>,
        angles: &[f64],
        n_blades: usize,
        hub_radius: f64,
    ) -> Result<Self, SpecError> {
        let k = n_blades as f64;
        let mut points: Vec<Point2<f64>> = Vec::new();
        for p in on_hub {
            let (x, y) = (k * p.y.atan2(p.x), k * p.z / hub_radius);
            // Turns around the hub are K times 2π wide here.
            let near = points.last().map_or(0.0, |last| last.x);
            points.push(Point2::new(x + k * TAU * ((near - x) / (k * TAU)).round(), y));
        }
        let found = Self { points };
        match found.crossing() {
            None => Ok(found),
            Some((place, 0)) => {
                Err(fault(angles[place], "the fillet cuts into itself on the hub; make its radius smaller".to_owned()))
            }
            Some((place, _)) => Err(fault(
                angles[place],
                "the fillets of two blades meet on the hub; make their radius smaller".to_owned(),
            )),
        }
    }

    /// Returns the first segment that crosses another, with the number of blades between them.
    fn crossing(&self) -> Option<(usize, usize)> {
        let n = self.points.len();
        let (low, high) = self.range(|p| p.x);
        let most = ((high - low) / TAU).ceil() as usize;
        (0..n).find_map(|i| {
            let [a, b] = [self.points[i], self.points[(i + 1) % n]];
            (0..=most).find_map(|turn| {
                let shift = nalgebra::Vector2::new(TAU * turn as f64, 0.0);
                let crosses = |j: usize| {
                    let is_beside = turn == 0 && (j == i || (j + 1) % n == i || (i + 1) % n == j);
                    !is_beside && cross(&a, &b, &(self.points[j] + shift), &(self.points[(j + 1) % n] + shift))
                };
                (0..n).any(crosses).then_some((i, turn))
            })
        })
    }

    fn range(&self, of: impl Fn(&Point2<f64>) -> f64) -> (f64, f64) {
        self.points.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }

    /// Returns the least and the largest z of the loop, mm.
    pub(crate) fn z_range(&self, n_blades: usize, hub_radius: f64) -> [f64; 2] {
        let (low, high) = self.range(|p| p.y * hub_radius / n_blades as f64);
        [low, high]
    }

    /// Returns the segments that reach a height or come nearer to it than `clearance`.
    fn segments_near(&self, y: f64, clearance: f64) -> Vec<[Point2<f64>; 2]> {
        let n = self.points.len();
        let segments = (0..n).map(|i| [self.points[i], self.points[(i + 1) % n]]);
        segments.filter(|[a, b]| a.y.min(b.y) <= y + clearance && a.y.max(b.y) >= y - clearance).collect()
    }
}

/// Whether a point is neither inside the loop nor nearer to it than `clearance`, nor to those of
/// other blades; by the segments near its height.
fn is_free(segments: &[[Point2<f64>; 2]], p: &Point2<f64>, clearance: f64) -> bool {
    let (low, high) = segments
        .iter()
        .flatten()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (q.x.min(low), q.x.max(high)));
    if low > high {
        return true;
    }
    let first = ((low - clearance - p.x) / TAU).ceil() as i64;
    let last = ((high + clearance - p.x) / TAU).floor() as i64;
    (first..=last).all(|turn| {
        let q = Point2::new(p.x + TAU * turn as f64, p.y);
        let mut is_inside = false;
        for [a, b] in segments {
            if distance_sq(&q, a, b) < clearance * clearance {
                return false;
            }
            if (a.y > q.y) != (b.y > q.y) && q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y) {
                is_inside = !is_inside;
            }
        }
        !is_inside
    })
}

/// Triangles of a sector's band.
#[derive(Debug)]
pub(crate) struct HubPatch {
    /// Vertices in the scaled plane: of the loop, of the lower and the upper ring, and others.
    vertices: Vec<Point2<f64>>,
    /// Corners of triangles, wound outward, by indices of `vertices` and sectors on.
    pub(crate) triangles: Vec<[(usize, i32); 3]>,
    /// Number of the loop's vertices.
    pub(crate) n_loop: usize,
    /// Number of vertices of a sector's rings.
    pub(crate) n_around: usize,
}

impl HubPatch {
    /// Returns the band between two heights of the scaled plane, without the inside of the loop, in
    /// triangles that span no more than `span` of x.
    ///
    /// The function exp(−y + i·x) maps the band onto the ring between two circles, angles kept and
    /// both sides of the sector on one line. There a Delaunay triangulation with the loop and both
    /// circles as constraints has no seam. All triangles are wound alike in the band as well, so
    /// that they cover it once; spans are measured there. `None` when no lattice is fine enough.
    pub(crate) fn new(around: &HubLoop, [low, high]: [f64; 2], span: f64) -> Option<Self> {
        if high - low > LONGEST_BAND {
            return None;
        }
        let mut n_around = ((1.5 * TAU / span).ceil() as usize).max(LEAST_AROUND);
        for _ in 0..MOST_TRIALS {
            let patch = Self::on_lattice(around, [low, high], n_around);
            if let Some(patch) = patch.filter(|patch| patch.spans_at_most(span)) {
                return Some(patch);
            }
            n_around += n_around / 4;
        }
        None
    }

    /// Returns the band with a lattice of `n_around` points around a sector; `None` where triangles
    /// are bent over, and for a lattice of too many points.
    fn on_lattice(around: &HubLoop, [low, high]: [f64; 2], n_around: usize) -> Option<Self> {
        let n_loop = around.points.len();
        let spacing = TAU / n_around as f64;
        let n_rows = ((high - low) / (0.75_f64.sqrt() * spacing)).round().max(1.0) as usize;
        if n_rows.checked_mul(n_around)? > MOST_POINTS {
            return None;
        }
        let mut vertices = around.points.clone();
        for y in [low, high] {
            vertices.extend((0..n_around).map(|i| Point2::new(spacing * i as f64, y)));
        }
        for row in 1..n_rows {
            let y = low + (high - low) * row as f64 / n_rows as f64;
            let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
            let points = (0..n_around).map(|i| Point2::new(spacing * (i as f64 + shift), y));
            let near = around.segments_near(y, CLEARANCE * spacing);
            vertices.extend(points.filter(|p| is_free(&near, p, CLEARANCE * spacing)));
        }
        let ring = |start: usize, n: usize| (0..n).map(move |i| [start + i, start + (i + 1) % n]);
        let edges: Vec<[usize; 2]> =
            ring(0, n_loop).chain(ring(n_loop, n_around)).chain(ring(n_loop + n_around, n_around)).collect();
        let middle = 0.5 * (low + high);
        let triangles = triangulated(&mut vertices, edges, middle)?;
        let patch = Self { vertices, triangles: Vec::new(), n_loop, n_around };
        patch.with_triangles(&triangles)
    }

    /// Adds triangles, with the sectors of their corners; `None` if one is not wound as it should.
    fn with_triangles(mut self, triangles: &[[usize; 3]]) -> Option<Self> {
        for &[a, b, c] in triangles {
            let beside = |v: usize| {
                let way = self.vertices[v].x - self.vertices[a].x;
                (v, -(way / TAU).round() as i32)
            };
            let corners = [(a, 0), beside(b), beside(c)];
            let [p, q, r] = corners.map(|corner| self.place(corner));
            if (q - p).perp(&(r - p)) <= 0.0 {
                return None;
            }
            self.triangles.push(corners);
        }
        Some(self)
    }

    fn place(&self, (vertex, turn): (usize, i32)) -> Point2<f64> {
        let p = self.vertices[vertex];
        Point2::new(p.x + TAU * f64::from(turn), p.y)
    }

    fn spans_at_most(&self, span: f64) -> bool {
        self.triangles.iter().all(|triangle| {
            let x = triangle.map(|corner| self.place(corner).x);
            x[0].max(x[1]).max(x[2]) - x[0].min(x[1]).min(x[2]) <= span
        })
    }

    /// Returns the vertices behind those of the loop, on the hub.
    pub(crate) fn points(&self, n_blades: usize, hub_radius: f64) -> impl Iterator<Item = Point3<f64>> {
        let k = n_blades as f64;
        self.vertices[self.n_loop..].iter().map(move |p| {
            let (sin, cos) = (p.x / k).sin_cos();
            Point3::new(hub_radius * cos, hub_radius * sin, p.y * hub_radius / k)
        })
    }

    /// Returns the corner of a ring's vertex: of the lower ring, or of the upper one.
    pub(crate) fn ring_vertex(&self, is_upper: bool, at: usize) -> usize {
        self.n_loop + usize::from(is_upper) * self.n_around + at
    }
}

/// Corner of a triangle in a sector whose vertices have these indices.
pub(crate) fn corner(vertices: &[u32], (vertex, turn): (usize, i32)) -> Corner {
    Corner::Turned { vertex: vertices[vertex], turn }
}

/// Vertex of the triangulation.
struct ImagePoint(spade::Point2<f64>);

impl HasPosition for ImagePoint {
    type Scalar = f64;

    fn position(&self) -> spade::Point2<f64> {
        self.0
    }
}

impl From<spade::Point2<f64>> for ImagePoint {
    fn from(p: spade::Point2<f64>) -> Self {
        Self(p)
    }
}

/// Triangles between the constraints; vertices that the triangulation adds follow those given.
///
/// `None` when constraints cross, which takes loops nearer to each other than their chords allow.
fn triangulated(vertices: &mut Vec<Point2<f64>>, edges: Vec<[usize; 2]>, middle: f64) -> Option<Vec<[usize; 3]>> {
    let image = |p: &Point2<f64>| {
        let (sin, cos) = p.x.sin_cos();
        let radius = (middle - p.y).exp();
        ImagePoint(spade::Point2::new(radius * cos, radius * sin))
    };
    let (mut n_crossings, n_edges) = (0, edges.len());
    let images = vertices.iter().map(image).collect();
    let made = ConstrainedDelaunayTriangulation::<ImagePoint>::try_bulk_load_cdt(images, edges, |_| n_crossings += 1);
    let mut made = made.ok().filter(|made| {
        n_crossings == 0 && made.num_vertices() == vertices.len() && made.num_constraints() == n_edges
    })?;
    let parameters = RefinementParameters::new()
        .with_angle_limit(AngleLimit::from_deg(LEAST_ANGLE))
        .with_max_additional_vertices(4 * vertices.len())
        .keep_constraint_edges()
        .exclude_outer_faces(true);
    let outside = made.refine(parameters).excluded_faces;
    let outside: std::collections::HashSet<_> = outside.into_iter().collect();
    let n_given = vertices.len();
    vertices.extend(made.vertices().skip(n_given).map(|v| {
        let p = v.position();
        Point2::new(p.y.atan2(p.x), middle - p.x.hypot(p.y).ln())
    }));
    let inside = made.inner_faces().filter(|face| !outside.contains(&face.fix()));
    Some(inside.map(|face| face.vertices().map(|v| v.fix().index())).collect())
}

/// Square of a point's distance from a segment.
fn distance_sq(p: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    let along = b - a;
    let length_sq = along.norm_squared();
    let share = if length_sq > 0.0 { (along.dot(&(p - a)) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + along * share)).norm_squared()
}

/// Whether segments cross or touch.
fn cross(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>, d: &Point2<f64>) -> bool {
    let side = |p: &Point2<f64>, q: &Point2<f64>, r: &Point2<f64>| (q - p).perp(&(r - p));
    let overlap =
        |of: fn(&Point2<f64>) -> f64| of(a).min(of(b)) <= of(c).max(of(d)) && of(c).min(of(d)) <= of(a).max(of(b));
    overlap(|p| p.x) && overlap(|p| p.y) && side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// Largest span of x, in the scaled plane, of triangles within a tolerance of the hub.
///
/// Seen along the axis a triangle lies outside the chord of its span.
pub(crate) fn largest_span(tolerance: f64, n_blades: usize, hub_radius: f64) -> f64 {
    // sagitta = r·(1 − cos(span/2)) = 2·r·sin²(span/4)
    let angle = 4.0 * (tolerance / (2.0 * hub_radius)).sqrt().min(1.0).asin();
    (n_blades as f64 * angle).min(0.5 * PI)
}
