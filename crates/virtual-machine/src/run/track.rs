use facemill_cl_data::Solid;
use facemill_interference::{Interference, Separation, Verdict};
use nalgebra::{Isometry3, Point3, Vector3};

/// A body with what bounds how far it moves from one pose to another.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    /// Undilated body.
    pub(crate) core: Solid,
    anchors: [Point3<f64>; N_ANCHORS],
    /// Largest distance of a point of the body from the hull of the anchors, square to z.
    radius: f64,
}

const N_ANCHORS: usize = 8;

/// A [`Shape`] somewhere, workpiece frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) work_from_solid: Isometry3<f64>,
    anchors: [Point3<f64>; N_ANCHORS],
    axis: Vector3<f64>,
}

impl Shape {
    /// The undilated core of a solid.
    pub(crate) fn core_of(solid: &Solid) -> Self {
        let core = solid.dilated(-solid.rounding());
        let (anchors, radius) = match &core {
            // A turned body is its axis with a disc around every point of it; its own spin moves
            // nothing.
            Solid::Frustum(f) => {
                let on_axis = |k: usize| Point3::new(0.0, 0.0, if k == 0 { f.z_low } else { f.z_high });
                (std::array::from_fn(on_axis), f.radius_low.max(f.radius_high))
            }
            // Those of its box hold a polyhedron.
            Solid::Box(_) | Solid::Hull(_) => {
                let bounds = core.aabb();
                let end = |k: usize, axis: usize| (if k >> axis & 1 == 0 { bounds.min } else { bounds.max })[axis];
                (std::array::from_fn(|k| Point3::new(end(k, 0), end(k, 1), end(k, 2))), 0.0)
            }
        };
        Self { core, anchors, radius }
    }

    pub(crate) fn placed(&self, work_from_solid: Isometry3<f64>) -> Placement {
        Placement {
            work_from_solid,
            anchors: self.anchors.map(|p| work_from_solid * p),
            axis: work_from_solid.rotation * Vector3::z(),
        }
    }

    /// Largest distance of a point of the core at a pose from another one, mm, or a little more.
    pub(crate) fn reach_from(&self, at: &Placement, from: &Point3<f64>) -> f64 {
        let farthest_sq = at.anchors.iter().map(|a| (a - from).norm_squared()).fold(0.0, f64::max);
        farthest_sq.sqrt() + self.radius
    }

    /// Bound on how far any point of the body at one pose is from the body at the other.
    ///
    /// Between two poses of a rigid body the displacement is affine in the point, so that over the
    /// hull of the anchors it is largest at one of them; a disc about the axis adds its radius
    /// times the turn of the axis.
    pub(crate) fn displacement(&self, from: &Placement, to: &Placement) -> f64 {
        let farthest_sq = from.anchors.iter().zip(&to.anchors).map(|(a, b)| (b - a).norm_squared()).fold(0.0, f64::max);
        farthest_sq.sqrt() + self.radius * (to.axis - from.axis).norm()
    }
}

/// Known distance between one body and one obstacle, from pose to pose.
///
/// An answer stays good until the body has moved by as much as it was free: most poses need no
/// query.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    last: Option<Answer>,
    hint: Option<u32>,
    /// How much farther than needed the next query looks, so that it lasts.
    window: f64,
    /// Queries in a row that found nothing.
    n_free: u32,
    /// How many of them are needed before a query looks farther.
    patience: u32,
}

#[derive(Clone, Copy, Debug)]
struct Answer {
    at: Placement,
    /// The mesh is at least this far from the core.
    distance: f64,
    /// Whether the core was neither touching the mesh nor inside a closed component of it.
    is_outside: bool,
}

/// Longest row of free queries after which one looks farther: in steady contact looking farther is
/// in vain, and this makes it rare.
const LARGEST_PATIENCE: u32 = 63;

/// Window after some free queries, mm: about two steps. Wider windows last longer and cost more
/// triangles each.
const FIRST_WINDOW: f64 = 1.0;

/// Largest window, mm: far away one query lasts for hundreds of positions, and more would not be
/// noticed.
const LARGEST_WINDOW: f64 = 250.0;

impl Track {
    /// Nearest point of the mesh to the core where it is not farther than `need` (mm, at least 0,
    /// may be infinite), its distance 0 where the core touches the mesh or is inside it; `None`
    /// where it is farther.
    pub(crate) fn nearest_within(
        &mut self,
        need: f64,
        shape: &Shape,
        at: &Placement,
        mesh: &dyn Interference,
    ) -> Option<Separation> {
        let is_outside = match &self.last {
            None => false,
            Some(last) => {
                let bound = last.distance - shape.displacement(&last.at, at);
                if last.is_outside && bound > need {
                    return None;
                }
                // The body could be brought here without touching the surface, so it is on the same
                // side.
                last.is_outside && bound > 0.0
            }
        };
        let at_most = need + self.window;
        let found = mesh.core_distance(&shape.core, &at.work_from_solid, at_most, self.hint);
        let found = if is_outside { found } else { inside(shape, at, mesh, self.hint, found) };
        self.remember(need, at, found.as_ref(), at_most);
        found.filter(|s| s.distance <= need)
    }

    fn remember(&mut self, need: f64, at: &Placement, found: Option<&Separation>, at_most: f64) {
        let distance = found.map_or(at_most, |s| s.distance);
        self.last = Some(Answer { at: *at, distance, is_outside: distance > 0.0 });
        self.hint = found.map_or(self.hint, |s| Some(s.triangle));
        match found {
            // In contact: what is nearer than needed is all that matters, and looking farther only
            // costs.
            Some(s) if s.distance - need < FIRST_WINDOW => {
                self.patience = (2 * self.patience + u32::from(self.window > 0.0)).min(LARGEST_PATIENCE);
                (self.window, self.n_free) = (0.0, 0);
            }
            Some(s) => (self.window, self.n_free) = ((s.distance - need).min(LARGEST_WINDOW), 0),
            None => {
                self.n_free += 1;
                if self.window > 0.0 {
                    self.patience = 0;
                }
                if self.n_free > self.patience {
                    self.window = (2.0 * self.window).clamp(FIRST_WINDOW, LARGEST_WINDOW);
                }
            }
        }
    }
}

/// `found`, or distance 0 where the core is inside a closed component, which the distance to the
/// surface does not show.
fn inside(
    shape: &Shape,
    at: &Placement,
    mesh: &dyn Interference,
    hint: Option<u32>,
    found: Option<Separation>,
) -> Option<Separation> {
    if found.is_some_and(|s| s.distance <= 0.0) {
        return found;
    }
    match mesh.verdict(&shape.core, &at.work_from_solid, hint) {
        Verdict::Free => found,
        Verdict::Hit(w) => Some(Separation { distance: 0.0, triangle: w.triangle, point: w.point }),
    }
}

#[cfg(test)]
#[path = "../../tests/unit/run/track.rs"]
mod tests;
