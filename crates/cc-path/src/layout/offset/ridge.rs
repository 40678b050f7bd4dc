//! Ridges of curvature: lines on a patch across which it bends most sharply.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use crate::distance::patch_vertices::PatchVertices;
use crate::error::PathError;
use crate::layout::offset::edge_lines::lines_between;
use crate::layout::offset::offset_field::longest_side;
use crate::layout::offset::ridge_profile::RidgeProfile;
use crate::layout::offset::section_walk::{SectionWalk, WalkStep};
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::section_layout::extent;
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
    let mut ridges: Vec<(SurfacePath, f64)> = Vec::new();
    let mut failures = Failures::default();
    for candidate in &candidates {
        let is_own = |(path, window): &(SurfacePath, f64)| {
            is_near(path, &candidate.position, OWN * window.max(candidate.window))
        };
        if failures.hold(patch, candidate) || ridges.iter().any(is_own) {
            continue;
        }
        match trace(patch, candidate) {
            Some(_) if ridges.len() == MOST_RIDGES => return Err(PathError::TooManyRidges { limit: MOST_RIDGES }),
            Some(ridge) => ridges.push((ridge, candidate.window)),
            None => failures.enter(patch, candidate)?,
        }
    }
    if ridges.is_empty() {
        return Err(PathError::NoRidge { sharpest: candidates.first().map(|c| (c.window, c.position)) });
    }
    Ok(ridges.into_iter().map(|(path, _)| path).collect())
}

/// Candidates that are no ridge.
#[derive(Default)]
struct Failures {
    n: usize,
    /// Places and normals of those after the first [`MOST_FAILURES`].
    apart: Vec<(Point3<f64>, Unit<Vector3<f64>>)>,
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

fn is_near(path: &SurfacePath, p: &Point3<f64>, distance: f64) -> bool {
    let ends = path.nodes.windows(2).map(|w| [w[0], w[1]]);
    let way_back = path.closed.then(|| [path.nodes[path.nodes.len() - 1], path.nodes[0]]);
    ends.chain(way_back).any(|[a, b]| {
        let along = b - a;
        let t = ((p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - (a + along * t)).norm() <= distance
    })
}

/// The ridge through a candidate; `None` where there is none.
fn trace(patch: &Patch, candidate: &Candidate) -> Option<SurfacePath> {
    let (start, _) = ridge_near(patch, candidate)?;
    let (ahead, closed) = march(patch, &start, candidate.along);
    let mut nodes = Vec::new();
    if !closed {
        let (behind, _) = march(patch, &start, -candidate.along);
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
fn ridge_near(patch: &Patch, near: &Candidate) -> Option<(RidgeNode, bool)> {
    let mut window = near.window;
    for _ in 0..4 {
        let profile = RidgeProfile::of(patch, near.triangle, near.position, &near.along, window)?;
        let place = profile.sharpest(window)?;
        if place.turn < LEAST_TURN {
            window *= 1.5;
            continue;
        }
        let is_ridge = place.stands_out && place.way.abs() <= 2.0 * window;
        let node = RidgeNode { position: place.position, triangle: place.triangle, window };
        return is_ridge.then_some((node, place.is_whole));
    }
    None
}

/// Nodes of the ridge from a place of it on, and whether they lead back to it.
fn march(patch: &Patch, start: &RidgeNode, along: Unit<Vector3<f64>>) -> (Vec<RidgeNode>, bool) {
    let (mut here, mut along) = (*start, along);
    let mut nodes: Vec<RidgeNode> = Vec::new();
    while nodes.len() < MOST_NODES {
        let step = 2.0 * here.window;
        let Some(StepAhead { position, triangle, border }) = ahead(patch, &here, &along, step) else { break };
        let near = Candidate { position, triangle, along, window: here.window };
        let found = ridge_near(patch, &near);
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
    let mut walk = vec![WalkStep { position: here.position, triangle: here.triangle, way: 0.0 }];
    for next in SectionWalk::from_place(patch, here.triangle, here.position, across, along)? {
        walk.push(next);
        if next.way >= (1.0 + BEFORE_BORDER) * step {
            break;
        }
    }
    let at = |way: f64| {
        let k = walk.partition_point(|s| s.way < way).clamp(1, walk.len() - 1);
        let (a, b) = (&walk[k - 1], &walk[k]);
        let share = if b.way > a.way { ((way - a.way) / (b.way - a.way)).clamp(0.0, 1.0) } else { 1.0 };
        (a.position + (b.position - a.position) * share, b.triangle)
    };
    let end = walk.last().filter(|_| walk.len() > 1)?;
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
