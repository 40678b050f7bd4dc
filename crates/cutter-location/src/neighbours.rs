//! Which passes lie beside a point of a pass, found in the plane across its feed.

use std::cell::Cell;

use facemill_cl_data::{Aabb, CcPoint};
use facemill_surface_model::Tree;
use nalgebra::{Point3, Vector3};

use crate::cusp::{CutPoint, Strip};

/// A pass, or a piece of one, among others.
#[derive(Clone, Debug, PartialEq)]
pub struct CutPass {
    /// Its points in cutting order.
    pub points: Vec<CutPoint>,
    /// Whether the uncut stock lies to the left of its feed.
    pub uncut_left: bool,
}

/// How far from a point a pass counts as beside it, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourReach {
    /// Any pass. Larger: wider strips that stay uncut are seen.
    pub far: f64,
    /// A pass that has its uncut stock on the same side as the point's, seen from the strip between both: either the file
    /// names the side of one of them wrongly, or what lies between is not one strip, as between both arms of a hairpin.
    pub opposed: f64,
}

/// Passes in cutting order, to be asked what lies beside a point.
#[derive(Clone, Debug)]
pub struct Neighbours {
    passes: Vec<CutPass>,
    /// Pass of each segment, and the number of its first point.
    segments: Vec<[u32; 2]>,
    tree: Tree,
    reach: NeighbourReach,
}

/// A point of one of the passes, by number of the pass and of the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnPlace {
    /// Number of the pass.
    pub pass: usize,
    /// Number of the point.
    pub point: usize,
}

/// A pass beside a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Where the plane across the point's feed meets it, with the posture of the nearer of the two points around.
    pub point: CutPoint,
    /// The surface on the way there.
    pub strip: Strip,
    /// Arc length in the plane, mm: more than the step-over where both feeds diverge.
    pub arc: f64,
    /// Whether it lies to the left of the feed.
    pub is_left: bool,
    /// Whether it is cut before the point.
    pub is_earlier: bool,
}

/// What lies beside a point: to the right of its feed, and to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beside {
    /// The nearest pass.
    pub nearest: [Option<Neighbour>; 2],
    /// The nearest pass of those that are cut before.
    pub earlier: [Option<Neighbour>; 2],
}

impl Beside {
    /// The passes that this point's pass leaves a ridge toward: the nearest ones, where they are cut before. A pass that is
    /// cut later leaves the ridge itself.
    pub fn before(&self) -> impl Iterator<Item = &Neighbour> {
        self.nearest.iter().flatten().filter(|n| n.is_earlier)
    }

    /// The strip that this point's posture decides on: the widest toward a pass before, else the narrowest toward one behind.
    pub fn strip(&self) -> Option<Strip> {
        let widest = |a: Strip, b: Strip| if b.step_over > a.step_over { b } else { a };
        let narrowest = |a: Strip, b: Strip| if b.step_over < a.step_over { b } else { a };
        let before = self.before().map(|n| n.strip).reduce(widest);
        before.or_else(|| self.nearest.iter().flatten().map(|n| n.strip).reduce(narrowest))
    }

    /// Curvature of the surface across the feed, of the nearest pass.
    pub fn curvature(&self) -> Option<f64> {
        let nearer = |a: Strip, b: Strip| if b.step_over < a.step_over { b } else { a };
        self.nearest.iter().flatten().map(|n| n.strip).reduce(nearer).map(|strip| strip.curvature)
    }
}

/// Nearer than this, mm, a crossing is the point itself, or of a pass that is cut again.
const SAME_POINT: f64 = 1e-6;

/// Least cosine between both feeds: passes that cross each other at more than 60° leave no strip between them.
const LEAST_ALONG: f64 = 0.5;

/// Largest difference of the sines by which the chord leaves both tangent planes: on a circle it leaves them alike. Two
/// places of which one is 0.4 chords above the other's tangent plane, beyond what their normals tell, are on different
/// walls.
const LARGEST_STEP: f64 = 0.8;

impl Neighbours {
    /// The passes of one place, in cutting order.
    pub fn new(passes: Vec<CutPass>, reach: NeighbourReach) -> Self {
        let mut segments = Vec::new();
        let mut boxes = Vec::new();
        for (pass, of) in passes.iter().enumerate() {
            for (k, pair) in of.points.windows(2).enumerate() {
                segments.push([pass as u32, k as u32]);
                let [a, b] = [&pair[0].cc, &pair[1].cc];
                // A curve with these feeds at its ends may bulge by this much.
                let bulge = 0.25 * (b.position - a.position).norm() * (1.0 - a.feed.dot(&b.feed)).max(0.0).sqrt();
                boxes.push(Aabb::of_points([&a.position, &b.position]).dilated(bulge + END_REACH));
            }
        }
        Self { tree: Tree::build(&boxes), passes, segments, reach }
    }

    /// The passes, as they were given.
    pub fn passes(&self) -> &[CutPass] {
        &self.passes
    }

    /// What lies beside a point of one of the passes: those before it, and its own up to it, are cut earlier.
    pub fn of(&self, at: OwnPlace) -> Beside {
        self.find(&self.passes[at.pass].points[at.point], Some(at))
    }

    /// What lies beside a point of another pass, which is cut after all of these.
    pub fn beside(&self, own: &CutPoint) -> Beside {
        self.find(own, None)
    }

    /// Whether any earlier pass comes within a distance of a point of one of the passes, wherever it lies.
    pub fn is_near_earlier(&self, at: OwnPlace, distance: f64) -> bool {
        let position = self.passes[at.pass].points[at.point].cc.position;
        let near = |b: &Aabb| b.distance_sq(&position) <= distance * distance;
        let earlier = |k: u32| (self.segments[k as usize][0] < at.pass as u32).then_some(());
        self.tree.find_in_boxes(near, earlier).is_some()
    }

    fn find(&self, own: &CutPoint, at: Option<OwnPlace>) -> Beside {
        let (position, feed) = (own.cc.position, own.cc.feed);
        let mut found = Found::default();
        let farthest = Cell::new(self.reach.far);
        let enter = |b: &Aabb| {
            let (center, half) = (nalgebra::center(&b.min, &b.max), 0.5 * (b.max - b.min));
            let reaches = feed.x.abs() * half.x + feed.y.abs() * half.y + feed.z.abs() * half.z;
            feed.dot(&(center - position)).abs() <= reaches + SAME_POINT
                && b.distance_sq(&position) <= farthest.get() * farthest.get()
        };
        self.tree.visit_boxes(enter, |k| {
            let [pass, segment] = self.segments[k as usize].map(|n| n as usize);
            let is_own = at.filter(|at| at.pass == pass);
            // The segments at the point itself cross the plane there.
            if is_own.is_some_and(|at| segment == at.point || segment + 1 == at.point) {
                return;
            }
            let points = &self.passes[pass].points;
            let Some(crossing) = self.crossing(own, [&points[segment], &points[segment + 1]]) else { return };
            let distance = (crossing.point.cc.position - position).norm();
            if at.is_some_and(|at| self.is_apart(at, (pass, &crossing), distance)) {
                return;
            }
            let is_earlier = at.is_none_or(|at| pass < at.pass || (pass == at.pass && segment < at.point));
            found.take(distance, Neighbour { is_earlier, ..crossing });
            farthest.set(found.farthest(self.reach.far));
        });
        found.beside()
    }

    /// Whether a crossing is not a neighbour for the side on which both passes have their uncut stock: of two arms of the same
    /// pass, or of passes that are far apart, they lie on different sides of the strip between.
    fn is_apart(&self, at: OwnPlace, (pass, crossing): (usize, &Neighbour), distance: f64) -> bool {
        let own = &self.passes[at.pass];
        let cc = &own.points[at.point].cc;
        let other = &crossing.point.cc;
        let seen_left = other.left().dot(&(cc.position - other.position)) > 0.0;
        let opposed = (crossing.is_left == own.uncut_left) == (seen_left == self.passes[pass].uncut_left);
        opposed && (pass == at.pass || distance > self.reach.opposed)
    }

    /// Where a segment crosses the plane across the feed, as a neighbour; `None` where it does not, or where what it
    /// crosses is no neighbour.
    fn crossing(&self, own: &CutPoint, ends: [&CutPoint; 2]) -> Option<Neighbour> {
        let point = section_crossing(&own.cc, ends)?;
        let between = point.cc.position - own.cc.position;
        let chord = between.norm();
        let along = own.cc.feed.dot(&point.cc.feed).abs();
        if chord <= SAME_POINT || chord > self.reach.far || along < LEAST_ALONG {
            return None;
        }
        let leaves = -own.cc.normal.dot(&between) / chord;
        let arrives = point.cc.normal.dot(&between) / chord;
        // The normals of one strip turn by less than a right angle, and the chord leaves both tangent planes alike.
        if own.cc.normal.dot(&point.cc.normal) <= 0.0 || (arrives - leaves).abs() > LARGEST_STEP {
            return None;
        }
        // Normals of a convex surface spread apart.
        let curvature = (arrives + leaves) / chord;
        let half_turn = 0.5 * chord * curvature;
        let arc = if half_turn.abs() < 1e-6 { chord } else { 2.0 * half_turn.clamp(-1.0, 1.0).asin() / curvature };
        // Two lines that diverge are as far apart as across the middle between them.
        let step_over = arc * along / (0.5 * (1.0 + along)).sqrt();
        let is_left = own.cc.left().dot(&between) > 0.0;
        Some(Neighbour { point, strip: Strip { step_over, curvature }, arc, is_left, is_earlier: true })
    }
}

/// The nearest crossings so far, with their distances.
#[derive(Default)]
struct Found {
    nearest: [Option<(f64, Neighbour)>; 2],
    earlier: [Option<(f64, Neighbour)>; 2],
}

impl Found {
    fn take(&mut self, distance: f64, neighbour: Neighbour) {
        let side = usize::from(neighbour.is_left);
        put(&mut self.nearest[side], distance, neighbour);
        if neighbour.is_earlier {
            put(&mut self.earlier[side], distance, neighbour);
        }
    }

    /// Distance beyond which nothing is wanted.
    fn farthest(&self, reach: f64) -> f64 {
        let all = self.nearest.iter().chain(&self.earlier);
        all.map(|f| f.as_ref().map_or(reach, |(distance, _)| *distance)).fold(0.0, f64::max)
    }

    fn beside(self) -> Beside {
        let only = |f: Option<(f64, Neighbour)>| f.map(|(_, neighbour)| neighbour);
        Beside { nearest: self.nearest.map(only), earlier: self.earlier.map(only) }
    }
}

/// Puts a neighbour where the one there is farther. Of equal distances the same one stays whatever order they come in.
fn put(best: &mut Option<(f64, Neighbour)>, distance: f64, neighbour: Neighbour) {
    let key = |n: &Neighbour| n.point.cc.position;
    let better = best
        .as_ref()
        .is_none_or(|(d, b)| (distance, key(&neighbour).coords.as_slice()) < (*d, key(b).coords.as_slice()));
    if better {
        *best = Some((distance, neighbour));
    }
}

/// How far past its end a pass counts as beside a point, mm: little against what a cutter reaches.
const END_REACH: f64 = 0.02;

/// Bisections of a segment of 5 mm to 5 nm.
const CROSSING_STEPS: u32 = 20;

/// Where the segment between two points crosses the plane through `cc` across its feed.
///
/// The segment is the cubic with both feeds at its ends where they go its way, so that points far apart on a strong bend
/// do not cut the corner; else the chord.
fn section_crossing(cc: &CcPoint, [a, b]: [&CutPoint; 2]) -> Option<CutPoint> {
    let ahead = |p: &Point3<f64>| (p - cc.position).dot(&cc.feed);
    let (at_a, at_b) = (ahead(&a.cc.position), ahead(&b.cc.position));
    if (at_a > 0.0) == (at_b > 0.0) {
        // Passes that all end on one line: which end lies beyond the plane is rounding.
        let end = if at_a.abs() < at_b.abs() { a } else { b };
        return (at_a.abs().min(at_b.abs()) <= END_REACH).then_some(*end);
    }
    let chord = b.cc.position - a.cc.position;
    let length = chord.norm();
    let goes_along = |p: &CutPoint| p.cc.feed.dot(&chord) > 0.5 * length;
    let linear = at_a / (at_a - at_b);
    let (t, position) = if goes_along(a) && goes_along(b) {
        let (from, to) = (a.cc.feed.into_inner() * length, b.cc.feed.into_inner() * length);
        let at = |t: f64| {
            let s = 1.0 - t;
            a.cc.position + chord * (t * t * (3.0 - 2.0 * t)) + from * (t * s * s) - to * (t * t * s)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..CROSSING_STEPS {
            let middle = 0.5 * (low + high);
            if (ahead(&at(middle)) > 0.0) == (at_a > 0.0) { low = middle } else { high = middle }
        }
        let t = 0.5 * (low + high);
        (t, at(t))
    } else {
        (linear, a.cc.position + chord * linear)
    };
    let nearer = if t < 0.5 { a } else { b };
    let blend = |p: &Vector3<f64>, q: &Vector3<f64>| p * (1.0 - t) + q * t;
    let cc = CcPoint::new(position, blend(&a.cc.normal, &b.cc.normal), blend(&a.cc.feed, &b.cc.feed)).ok()?;
    Some(CutPoint { cc, posture: nearer.posture })
}
