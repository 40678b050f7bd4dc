//! Ridges of curvature: lines on a patch across which it bends most sharply.

use std::sync::atomic::{AtomicBool, Ordering};

use facemill_cl_data::Aabb;
use facemill_surface_model::Tree;
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::distance::patch_vertices::PatchVertices;
use crate::error::PathError;
use crate::layout::offset::corner_normals::CornerNormals;
use crate::layout::offset::edge_lines::lines_between;
use crate::layout::offset::offset_field::longest_side;
use crate::layout::offset::ridge_profile::RidgeProfile;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::section_layout::extent;
use crate::layout::section_walk::{SectionWalk, WalkStep};
use crate::strategy::edge::EdgeLine;
use crate::strategy::patch::Patch;

/// Place from which a ridge may be traced.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    position: Point3<f64>,
    triangle: u32,
    along: Unit<Vector3<f64>>,
    /// Radius of curvature across, mm: length of the window in which a ridge turns.
    window: f64,
}

/// Place of a ridge on the way.
#[derive(Clone, Copy, Debug)]
struct RidgeNode {
    position: Point3<f64>,
    triangle: u32,
    window: f64,
}

/// Candidates that are tried without success one by one, sharpest first. From there on, those near
/// to one that has failed are left out, and as many more may fail: a round body has no ridge at any
/// of its vertices, but few places that are apart by their radius.
const MOST_FAILURES: usize = 2_000;

/// Candidates nearer to one that has failed than this share of their window see the same section,
/// where their normals agree. Ridges are far longer.
const SAME_PLACE: f64 = 0.5;

/// Cosine of the angle from which normals are of two sides of a thin body, 60°.
const SAME_SIDE: f64 = 0.5;

/// Candidates that are looked at together: so many after a ridge, because those behind it mostly
/// belong to it, and twice as many each time, up to the second number, as long as there is none.
const BATCHES: [usize; 2] = [8, 1024];

/// Nodes of a ridge whose distance is looked at only where the box around them is near.
const STRETCH: usize = 16;

/// Most ridges of a region.
const MOST_RIDGES: usize = 64;

/// Most nodes of a ridge to one side.
const MOST_NODES: usize = 50_000;

/// Least turn within a window of the radius, rad (29°): less is a shallow bend.
const LEAST_TURN: f64 = 0.5;

/// Radii above this share of the region's extent are no edge.
const LARGEST_RADIUS: f64 = 0.2;

/// A border that comes so soon after a step, as a share of it, ends the ridge.
const BEFORE_BORDER: f64 = 0.5;

/// Distance from the border of the last section across a ridge, as a share of a step.
const BESIDE_BORDER: f64 = 0.5;

/// Places nearer to a ridge than this many windows belong to it.
const OWN: f64 = 6.0;

/// The middle lines of an edge on a patch.
///
/// # Errors
/// When there is none, there are too many, or no such group.
pub(crate) fn lines_of_edge(
    patch: &Patch,
    vertices: &PatchVertices,
    line: &EdgeLine,
) -> Result<Vec<SurfacePath>, PathError> {
    match line {
        EdgeLine::Ridge => ridges(patch, vertices),
        EdgeLine::BetweenGroups(groups) => lines_between(patch, groups),
    }
}

/// The ridges of a patch, sharpest first.
///
/// Each is traced from its sharpest place in steps of two radii. At every step the section of the
/// patch across the ridge is searched for the window, one radius long, in which the normal turns
/// most; where windows turn alike, as on a rounded edge of constant radius, the middle of them is
/// the ridge. A ridge ends at the border of the region, and where the surface beside it bends half
/// as much.
///
/// # Errors
/// When there is none, there are too many, or too many places that bend sharply are none.
fn ridges(patch: &Patch, vertices: &PatchVertices) -> Result<Vec<SurfacePath>, PathError> {
    let candidates = candidates(patch, vertices);
    let mut search = RidgeSearch::on(patch);
    search.search(&candidates, BATCHES)?;
    if search.ridges.is_empty() {
        return Err(PathError::NoRidge { sharpest: candidates.first().map(|c| (c.window, c.position)) });
    }
    Ok(search.ridges.into_iter().map(|ridge| ridge.path).collect())
}

/// Search for ridges, candidate after candidate.
struct RidgeSearch<'a> {
    patch: &'a Patch<'a>,
    normals: CornerNormals<'a>,
    ridges: Vec<FoundRidge>,
    failures: Failures,
}

/// Candidates that are no ridge.
#[derive(Default)]
struct Failures {
    n: usize,
    /// Places and normals of those after the first [`MOST_FAILURES`].
    apart: Vec<(Point3<f64>, Unit<Vector3<f64>>)>,
}

/// A ridge with the boxes of its stretches of [`STRETCH`] nodes.
struct FoundRidge {
    path: SurfacePath,
    stretches: Tree,
}

impl<'a> RidgeSearch<'a> {
    fn on(patch: &'a Patch<'a>) -> Self {
        Self { patch, normals: CornerNormals::of(patch), ridges: Vec::new(), failures: Failures::default() }
    }

    /// Finds the ridges of candidates that are in rising order of their windows, in batches.
    ///
    /// # Errors
    /// When there are too many ridges, or too many places that bend sharply are none.
    fn search(&mut self, candidates: &[Candidate], [smallest, largest]: [usize; 2]) -> Result<(), PathError> {
        let (mut rest, mut size) = (candidates, smallest);
        while !rest.is_empty() {
            let (batch, after) = rest.split_at(size.min(rest.len()));
            let n_before = self.ridges.len();
            // The result is that of one candidate after the other: only what does not depend on
            // those before it in the batch is found at once.
            let start = |c: &Candidate| (!self.is_settled(c)).then(|| ridge_near(&self.normals, c));
            let starts: Vec<_> = batch.par_iter().map(start).collect();
            for (candidate, start) in batch.iter().zip(starts) {
                if let Some(start) = start.filter(|_| !self.is_settled(candidate)) {
                    self.enter(candidate, start.map(|(node, _)| node))?;
                }
            }
            rest = after;
            size = if self.ridges.len() > n_before { smallest } else { largest.min(2 * size) };
        }
        Ok(())
    }

    /// Traces the ridge of a candidate, or enters it among those that are none.
    ///
    /// # Errors
    /// When there are too many of either.
    fn enter(&mut self, candidate: &Candidate, start: Option<RidgeNode>) -> Result<(), PathError> {
        match start.and_then(|start| trace(&self.normals, candidate, start)) {
            Some(_) if self.ridges.len() == MOST_RIDGES => Err(PathError::TooManyRidges { limit: MOST_RIDGES }),
            Some(path) => {
                self.ridges.push(FoundRidge::new(path));
                Ok(())
            }
            None => self.failures.enter(self.patch, candidate),
        }
    }

    /// Whether a candidate belongs to a ridge, or is the same place as one that has failed.
    fn is_settled(&self, candidate: &Candidate) -> bool {
        // Ridges that were found before have smaller windows.
        let own = OWN * candidate.window;
        self.failures.hold(self.patch, candidate) || self.ridges.iter().any(|r| r.is_near(&candidate.position, own))
    }
}

impl Failures {
    /// # Errors
    /// When there are too many.
    fn enter(&mut self, patch: &Patch, candidate: &Candidate) -> Result<(), PathError> {
        let Candidate { position, triangle, window, .. } = *candidate;
        self.n += 1;
        if self.n > MOST_FAILURES {
            self.apart.push((position, patch.normal(triangle, &position)));
        }
        if self.apart.len() > MOST_FAILURES {
            return Err(PathError::RidgesUnclear { limit: MOST_FAILURES, radius: window, position });
        }
        Ok(())
    }

    /// Whether a candidate is the same place as one that has failed.
    fn hold(&self, patch: &Patch, candidate: &Candidate) -> bool {
        let near = (SAME_PLACE * candidate.window).powi(2);
        let normal = || patch.normal(candidate.triangle, &candidate.position);
        let is_same = |(position, of_failed): &(Point3<f64>, Unit<Vector3<f64>>)| {
            nalgebra::distance_squared(position, &candidate.position) < near && of_failed.dot(&normal()) > SAME_SIDE
        };
        self.apart.iter().any(is_same)
    }
}

impl FoundRidge {
    fn new(path: SurfacePath) -> Self {
        let nodes = &path.nodes;
        let of_stretch = |first: usize| {
            let end = (first + STRETCH + 1).min(nodes.len());
            let way_back = (path.closed && end == nodes.len()).then_some(nodes[0]);
            Aabb::of_points(nodes[first..end].iter().chain(&way_back))
        };
        let boxes: Vec<Aabb> = (0..nodes.len()).step_by(STRETCH).map(of_stretch).collect();
        Self { stretches: Tree::build(&boxes), path }
    }

    fn is_near(&self, p: &Point3<f64>, distance: f64) -> bool {
        let nodes = &self.path.nodes;
        let is_near = |k: usize| {
            let next = if k + 1 < nodes.len() { nodes[k + 1] } else { nodes[if self.path.closed { 0 } else { k }] };
            let (a, along) = (nodes[k], next - nodes[k]);
            let t = ((p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            (p - (a + along * t)).norm() <= distance
        };
        let in_stretch = |stretch: u32| {
            let first = stretch as usize * STRETCH;
            (first..(first + STRETCH).min(nodes.len())).any(is_near).then_some(())
        };
        // A box may be farther than what it holds by rounding.
        let most = distance * distance * (1.0 + 1e-9);
        self.stretches.find_in_boxes(|b| b.distance_sq(p) <= most, in_stretch).is_some()
    }
}

/// Convex places with their radius across, sharpest first: vertices of the smooth surface, and
/// middles of creases.
fn candidates(patch: &Patch, vertices: &PatchVertices) -> Vec<Candidate> {
    let largest = LARGEST_RADIUS * extent(&patch.mesh);
    let mut is_border = vec![false; patch.mesh.vertices().len()];
    for e in (0..patch.edges.len() as u32).filter(|&e| patch.edges.sides(e).len() == 1) {
        patch.edges.vertices(e).into_iter().for_each(|v| is_border[v as usize] = true);
    }
    let mut all: Vec<Candidate> = Vec::new();
    for v in (0..patch.mesh.vertices().len() as u32).filter(|&v| !is_border[v as usize]) {
        let Some(&triangle) = vertices.triangles(v).first() else { continue };
        let position = patch.mesh.vertices()[v as usize];
        let Some(curvature) = patch.curvature(triangle, &position).map(|c| c.principal()) else { continue };
        if curvature.max * largest > 1.0 {
            all.push(Candidate { position, triangle, along: curvature.min_direction, window: 1.0 / curvature.max });
        }
    }
    let crease = patch.surface.settings().crease_angle.cos();
    for e in 0..patch.edges.len() as u32 {
        let &[a, b] = patch.edges.sides(e) else { continue };
        let [from, to] = patch.edges.vertices(e).map(|v| patch.mesh.vertices()[v as usize]);
        let triangle = a / 3;
        let (Some(left), Some(right)) = (patch.facet_normal(triangle), patch.facet_normal(b / 3)) else { continue };
        let third = |side: u32| patch.mesh.triangles()[side as usize / 3][(side as usize % 3 + 2) % 3];
        let is_convex = left.dot(&(patch.mesh.vertices()[third(b) as usize] - from)) < 0.0;
        let Some(along) = Unit::try_new(to - from, 0.0) else { continue };
        if is_convex && left.dot(&right) < crease {
            let window = 0.5 * longest_side(patch, triangle).min(longest_side(patch, b / 3));
            all.push(Candidate { position: nalgebra::center(&from, &to), triangle, along, window });
        }
    }
    all.sort_by(|a, b| a.window.total_cmp(&b.window));
    all
}

/// The ridge of a candidate through a place of it; `None` where it is too short.
fn trace(normals: &CornerNormals, candidate: &Candidate, start: RidgeNode) -> Option<SurfacePath> {
    let along = candidate.along;
    // Both ways at once; a closed ridge is that of the first, and the second ends as soon as this
    // is known.
    let is_closed = AtomicBool::new(false);
    let ahead = || {
        let (nodes, closed) = march(normals, &start, along, &|| false);
        is_closed.store(closed, Ordering::Relaxed);
        (nodes, closed)
    };
    let behind = || march(normals, &start, -along, &|| is_closed.load(Ordering::Relaxed)).0;
    let ((ahead, closed), behind) = rayon::join(ahead, behind);
    let mut nodes = Vec::new();
    if !closed {
        nodes.extend(behind.into_iter().rev());
    }
    nodes.push(start);
    nodes.extend(ahead);
    let long_enough = nodes.len() >= 4;
    long_enough.then(|| SurfacePath {
        triangles: nodes.iter().map(|n| n.triangle).collect(),
        nodes: smoothed(&nodes.iter().map(|n| n.position).collect::<Vec<_>>(), closed),
        closed,
    })
}

/// The ridge in the section across a place, with a window in which it turns enough, and whether the
/// section is whole.
fn ridge_near(normals: &CornerNormals, near: &Candidate) -> Option<(RidgeNode, bool)> {
    let mut window = near.window;
    let mut profile = RidgeProfile::at(normals, near.triangle, near.position, &near.along)?;
    for _ in 0..4 {
        let place = profile.sharpest(window)?;
        if place.turn < LEAST_TURN {
            window *= 1.5;
            continue;
        }
        let is_ridge = place.is_top && place.way.abs() <= 2.0 * window && profile.is_flatter_beside(&place, window);
        let node = RidgeNode { position: place.position, triangle: place.triangle, window };
        return is_ridge.then_some((node, place.is_whole));
    }
    None
}

/// Nodes of the ridge from a place of it on, as long as they are of use, and whether they lead back
/// to it.
fn march(
    normals: &CornerNormals,
    start: &RidgeNode,
    along: Unit<Vector3<f64>>,
    is_useless: &dyn Fn() -> bool,
) -> (Vec<RidgeNode>, bool) {
    let (mut here, mut along) = (*start, along);
    let mut nodes: Vec<RidgeNode> = Vec::new();
    while nodes.len() < MOST_NODES && !is_useless() {
        let step = 2.0 * here.window;
        let Some(StepAhead { position, triangle, border }) = ahead(normals.patch(), &here, &along, step) else { break };
        let near = Candidate { position, triangle, along, window: here.window };
        let found = ridge_near(normals, &near);
        if let Some((position, triangle)) = border {
            // As far aside as beside the border, where the section is not cut off.
            let aside = found
                .filter(|(_, is_whole)| *is_whole)
                .map_or_else(Vector3::zeros, |(r, _)| r.position - near.position);
            nodes.push(RidgeNode { position: position + aside, triangle, ..here });
            break;
        }
        let Some((next, _)) = found else { break };
        let Some(direction) = Unit::try_new(next.position - here.position, 1e-12) else { break };
        let back = start.position - next.position;
        if nodes.len() > 2 && back.norm() < 0.75 * step && direction.dot(&along) > 0.0 {
            return (nodes, true);
        }
        nodes.push(next);
        (here, along) = (next, direction);
    }
    (nodes, false)
}

/// A place on the patch, about a step ahead.
struct StepAhead {
    position: Point3<f64>,
    triangle: u32,
    /// The border behind it, with its triangle, where it comes soon.
    border: Option<(Point3<f64>, u32)>,
}

/// The place a step ahead on the patch; where the border comes soon after the step, the place
/// beside the border, because sections across the ridge are cut off near it.
fn ahead(patch: &Patch, here: &RidgeNode, along: &Unit<Vector3<f64>>, step: f64) -> Option<StepAhead> {
    let normal = patch.normal(here.triangle, &here.position);
    let across = Unit::try_new(normal.cross(along), 1e-9)?;
    let start = (here.position, 0.0);
    let mut walk: Vec<WalkStep> = Vec::new();
    for next in SectionWalk::from_place(patch, here.triangle, here.position, across, along)? {
        walk.push(next);
        if next.way >= (1.0 + BEFORE_BORDER) * step {
            break;
        }
    }
    let end = walk.last()?;
    let at = |way: f64| {
        let k = walk.partition_point(|s| s.way < way).min(walk.len() - 1);
        let (a, from) = if k == 0 { start } else { (walk[k - 1].position, walk[k - 1].way) };
        let b = &walk[k];
        let share = if b.way > from { ((way - from) / (b.way - from)).clamp(0.0, 1.0) } else { 1.0 };
        (a + (b.position - a) * share, b.triangle)
    };
    if end.way >= (1.0 + BEFORE_BORDER) * step {
        let (position, triangle) = at(step);
        return Some(StepAhead { position, triangle, border: None });
    }
    let (position, triangle) = at((end.way - BESIDE_BORDER * step).max(0.5 * end.way));
    // A crumb at the border is no node of its own.
    (end.way > 1e-3 * step).then_some(StepAhead { position, triangle, border: Some((end.position, end.triangle)) })
}

/// Nodes on the parabolas through five at a time, by least squares over the way; the two at each
/// end of an open ridge stay.
fn smoothed(nodes: &[Point3<f64>], closed: bool) -> Vec<Point3<f64>> {
    let n = nodes.len();
    let at = |k: usize| {
        if n < 6 || (!closed && (k < 2 || k + 2 >= n)) {
            return nodes[k];
        }
        let five = [0, 1, 2, 3, 4].map(|j| nodes[(k + n + j - 2) % n]);
        parabola_middle(&five).unwrap_or(nodes[k])
    };
    (0..n).map(at).collect()
}

/// The place at the middle node of the parabola nearest to five.
fn parabola_middle(five: &[Point3<f64>; 5]) -> Option<Point3<f64>> {
    let step = |k: usize| (five[k + 1] - five[k]).norm();
    let ways = [-step(0) - step(1), -step(1), 0.0, step(2), step(2) + step(3)];
    let (mut square, mut right) = (Matrix3::zeros(), Matrix3::zeros());
    for (way, p) in ways.iter().zip(five) {
        let row = Vector3::new(1.0, way / ways[4], (way / ways[4]).powi(2));
        square += row * row.transpose();
        right += row * (p - five[2]).transpose();
    }
    let solved = square.cholesky()?.solve(&right);
    Some(five[2] + solved.row(0).transpose())
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/offset/ridge.rs"]
mod tests;
