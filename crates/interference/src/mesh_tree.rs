//! Tree of a mesh: exact verdicts and distances of convex bodies.

pub(crate) mod build;
pub(crate) mod certify;
pub(crate) mod deepest;
pub(crate) mod lift_search;
pub(crate) mod turn;

use facemill_cl_data::{Aabb, Solid};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use pulp::Arch;

use crate::body::edge::{Goal, Sample};
use crate::body::facet::nearest_on_triangle;
use crate::body::lanes::{Lanes, vectorized};
use crate::body::{Body, Placed, for_body};
use crate::closed::{ClosedParts, Components};
use crate::mesh_tree::build::{Child, Node, Tree};
use crate::mesh_tree::lift_search::LiftedSolid;
use crate::outside::Outside;
use crate::query::Interference;
use crate::query::sweep_verdict::{MotionInterval, SweepVerdict, TurnRange};
use crate::query::verdict::{Separation, Verdict, Witness};

/// Exact interference against a mesh by a tree of flat slabs.
///
/// Each child's slab lies in the plane of its piece of the surface, and one evaluation of the
/// body's (convex) distance at its centre bounds the distance of the whole piece, for eight
/// children at once; over a triangle the least distance is found exactly. Verdicts are exact but
/// for a band of 1e-9 mm in the rounding, distances to 1e-9 mm, for coordinates up to some metres.
///
/// A body whose pose or size is not finite counts as a hit, and as distance 0; against an empty
/// mesh everything is free.
#[derive(Clone, Debug)]
pub struct MeshTree {
    pub(crate) nodes: Vec<Node>,
    /// Corners of the triangles in the order of the leaves.
    pub(crate) corners: Vec<[Point3<f64>; 3]>,
    /// Index in the mesh of the triangles in the order of the leaves.
    pub(crate) triangles: Vec<u32>,
    /// Place in the order of the leaves of the mesh's triangles.
    place: Vec<u32>,
    pub(crate) closed: ClosedParts,
    /// Places that are in none of them.
    outside: Outside,
    /// The vector instructions that the processor has.
    pub(crate) arch: Arch,
}

/// Distance at which the body counts as touching, mm. A point computed to be on the body is off it
/// by the rounding of its coordinates (1e-12 mm at 4 m): smaller than that, a body of rounding 0
/// that a triangle passes through would be missed; larger, poses that are free would be refused.
pub(crate) const TOUCH: f64 = 1e-10;

/// Splits of 2^31 triangles into eight are 11 deep; all but one child wait per level.
pub(crate) const STACK: usize = 96;

impl MeshTree {
    /// The tree of a mesh; some 2 µs and 150 bytes per triangle. If it is closed, up to 0.8 MB
    /// more, and some 20 MB while the tree is made.
    pub fn new(mesh: &TriMesh) -> Self {
        let (tree, components) = rayon::join(|| Tree::build(mesh), || Components::of(mesh));
        let Tree { nodes, order: triangles, corners } = tree;
        let mut place = vec![0; triangles.len()];
        for (k, &t) in triangles.iter().enumerate() {
            place[t as usize] = k as u32;
        }
        let closed = components.ordered(&triangles);
        let outside = Outside::of(if closed.is_empty() { &[] } else { &corners });
        Self { nodes, corners, closed, outside, triangles, place, arch: Arch::new() }
    }

    /// Number of the mesh's components that are closed, so that a body can be inside them.
    ///
    /// A mesh that is meant as a solid but has a hole is a surface only, and a body within it is
    /// free. A caller that tests bodies against solids counts first:
    ///
    /// ```
    /// use facemill_interference::MeshTree;
    /// use facemill_surface_model::TriMesh;
    /// use nalgebra::Point3;
    ///
    /// let corners = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0]].map(Point3::from);
    /// let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    /// let n_closed = |faces: &[[u32; 3]]| -> Result<usize, facemill_surface_model::MeshError> {
    ///     Ok(MeshTree::new(&TriMesh::new(corners.to_vec(), faces.to_vec())?).n_closed_components())
    /// };
    /// assert_eq!((n_closed(&faces)?, n_closed(&faces[1..])?), (1, 0), "a tetrahedron, and one that lacks a face");
    /// # Ok::<(), facemill_surface_model::MeshError>(())
    /// ```
    pub fn n_closed_components(&self) -> usize {
        self.closed.len()
    }

    #[inline(always)]
    fn surface_verdict(&self, body: &impl Body, rounding: f64, hint: Option<u32>) -> Verdict {
        let goal = Goal { enough: rounding + TOUCH, beyond: rounding + TOUCH };
        let test = |place: usize| {
            let sample = nearest_on_triangle(body, &self.corners[place], goal)?;
            Some(Witness { triangle: self.triangles[place], point: sample.point })
        };
        if let Some(witness) = self.hinted(hint).and_then(test) {
            return Verdict::Hit(witness);
        }
        let mut stack = Pending::new();
        stack.push_root(&self.nodes);
        while let Some((_, child)) = stack.pop() {
            match Child::unpack(child) {
                Child::Node(node) => stack.push_children(&self.nodes[node as usize], body, goal.beyond),
                Child::Triangle(place) => {
                    if let Some(witness) = test(place as usize) {
                        return Verdict::Hit(witness);
                    }
                }
            }
        }
        Verdict::Free
    }

    #[inline(always)]
    fn surface_distance(&self, body: &impl Body, at_most: f64, hint: Option<u32>) -> Option<Separation> {
        let mut nearest = Nearest { beyond: at_most, found: None };
        if let Some(place) = self.hinted(hint) {
            nearest.look(body, &self.corners, place);
        }
        let mut stack = Pending::new();
        stack.push_root(&self.nodes);
        while let Some((bound, child)) = stack.pop() {
            if nearest.meets() {
                break;
            }
            // A nearer triangle may have overtaken a node in the queue.
            if bound > nearest.beyond {
                continue;
            }
            match Child::unpack(child) {
                Child::Node(node) => stack.push_children(&self.nodes[node as usize], body, nearest.beyond),
                Child::Triangle(place) => nearest.look(body, &self.corners, place as usize),
            }
        }
        let (sample, place) = nearest.found?;
        Some(Separation { distance: sample.distance, triangle: self.triangles[place], point: sample.point })
    }

    /// Place of the hinted triangle.
    pub(crate) fn hinted(&self, hint: Option<u32>) -> Option<usize> {
        self.place.get(hint? as usize).map(|&p| p as usize)
    }
}

impl Interference for MeshTree {
    fn bounds(&self) -> Option<Aabb> {
        Some(Aabb::of_points(self.corners.iter().flatten()))
    }

    fn verdict(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, hint: Option<u32>) -> Verdict {
        if !is_finite(solid, mesh_from_solid) {
            return self
                .first_corner()
                .map_or(Verdict::Free, |(triangle, point)| Verdict::Hit(Witness { triangle, point }));
        }
        let rounding = solid.rounding();
        let verdict = for_body!(Placed::new(solid, mesh_from_solid), |body| vectorized(
            self.arch,
            #[inline(always)]
            || self.surface_verdict(&body, rounding, hint),
        ));
        if !verdict.is_free() {
            return verdict;
        }
        // Nothing of the surface is in the body: it is inside as a whole or not at all.
        self.way_out(solid, mesh_from_solid, &(mesh_from_solid * Vector3::z())).map_or(Verdict::Free, Verdict::Hit)
    }

    fn sweep(&self, solid: &Solid, motion: &MotionInterval, hint: Option<u32>) -> SweepVerdict {
        self.swept(solid, motion, hint)
    }

    fn turn(&self, solid: &Solid, range: &TurnRange, hint: Option<u32>) -> SweepVerdict {
        self.turned(solid, range, hint)
    }

    fn core_distance(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        at_most: f64,
        hint: Option<u32>,
    ) -> Option<Separation> {
        if !is_finite(solid, mesh_from_solid) {
            return self.first_corner().map(|(triangle, point)| Separation { distance: 0.0, triangle, point });
        }
        for_body!(Placed::new(solid, mesh_from_solid), |body| vectorized(
            self.arch,
            #[inline(always)]
            || self.surface_distance(&body, at_most, hint),
        ))
    }

    fn core_depth(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, met: Separation) -> (f64, Separation) {
        self.deepest(solid, mesh_from_solid, met)
    }

    fn least_lift(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        direction: Unit<Vector3<f64>>,
        max_lift: f64,
        resolution: f64,
    ) -> Option<f64> {
        if !is_finite(solid, mesh_from_solid) || !direction.iter().all(|v| v.is_finite()) {
            return self.triangles.is_empty().then_some(0.0);
        }
        let max_lift = if max_lift.is_nan() { 0.0 } else { max_lift };
        let lifted = LiftedSolid { solid, mesh_from_solid, direction: direction.into_inner(), max_lift, resolution };
        for_body!(Placed::new(solid, mesh_from_solid), |body| self.first_free(&body, &lifted))
    }
}

impl MeshTree {
    /// Where the half line from inside the body along a unit vector leaves a closed component that
    /// it starts in.
    pub(crate) fn way_out(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        along: &Vector3<f64>,
    ) -> Option<Witness> {
        if self.closed.is_empty() {
            return None;
        }
        let origin = mesh_from_solid * solid.interior_point();
        if self.outside.holds(&origin) {
            return None;
        }
        let candidates = self.along_ray(&origin, along);
        let (place, point) = self.closed.way_out(candidates, &self.corners, &origin, along)?;
        Some(Witness { triangle: self.triangles[place], point })
    }

    /// Places of the triangles that a half line may meet.
    fn along_ray(&self, origin: &Point3<f64>, along: &Vector3<f64>) -> Vec<usize> {
        let mut found = Vec::new();
        let mut pending = vec![0u32];
        while let Some(node) = pending.pop() {
            let Some(node) = self.nodes.get(node as usize) else { continue };
            for (lane, child) in node.packed_children() {
                if !node.slabs.get(lane).may_meet_ray(origin, along) {
                    continue;
                }
                match Child::unpack(child) {
                    Child::Node(node) => pending.push(node),
                    Child::Triangle(place) => found.push(place as usize),
                }
            }
        }
        found
    }

    /// A triangle and a point of it to name where nothing can be computed; `None` for an empty
    /// mesh.
    fn first_corner(&self) -> Option<(u32, Point3<f64>)> {
        Some((*self.triangles.first()?, self.corners.first()?[0]))
    }
}

/// Whether every number of the body and its pose is finite.
pub(crate) fn is_finite(solid: &Solid, pose: &Isometry3<f64>) -> bool {
    let finite_pose = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|v| v.is_finite());
    let finite_solid = match solid {
        Solid::Frustum(f) => [f.z_low, f.z_high, f.radius_low, f.radius_high, f.rounding].iter().all(|v| v.is_finite()),
        Solid::Box(b) => b.half_extents.iter().all(|v| v.is_finite()) && b.rounding.is_finite(),
        // A polyhedron is made of finite numbers only.
        Solid::Hull(h) => h.rounding.is_finite(),
    };
    finite_pose && finite_solid
}

/// The nearest sample found so far, and the distance beyond which nothing is of interest.
struct Nearest {
    beyond: f64,
    found: Option<(Sample, usize)>,
}

impl Nearest {
    #[inline(always)]
    fn look(&mut self, body: &impl Body, corners: &[[Point3<f64>; 3]], place: usize) {
        let goal = Goal { enough: TOUCH, beyond: self.beyond };
        let Some(mut sample) = nearest_on_triangle(body, &corners[place], goal) else { return };
        if sample.distance <= TOUCH {
            sample.distance = 0.0;
        }
        let nearer = sample.distance < self.beyond || self.found.is_none() && sample.distance <= self.beyond;
        if nearer {
            self.beyond = sample.distance;
            self.found = Some((sample, place));
        }
    }

    fn meets(&self) -> bool {
        self.found.is_some() && self.beyond <= 0.0
    }
}

/// Children still to be looked at with their bounds, the nearest of a node's children on top.
pub(crate) struct Pending {
    children: [(f64, u32); STACK],
    n: usize,
}

impl Pending {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { children: [(0.0, 0); STACK], n: 0 }
    }

    #[inline(always)]
    pub(crate) fn push_root(&mut self, nodes: &[Node]) {
        if !nodes.is_empty() {
            self.children[0] = (f64::NEG_INFINITY, Child::Node(0).pack());
            self.n = 1;
        }
    }

    /// All children unless proven farther than `beyond`.
    #[inline(always)]
    pub(crate) fn push_children(&mut self, node: &Node, body: &impl Body, beyond: f64) {
        self.push_bounded(node, &node.slabs.least_distances(body), beyond);
    }

    /// All children whose bounds are not above `beyond`.
    #[inline(always)]
    pub(crate) fn push_bounded(&mut self, node: &Node, bounds: &Lanes, beyond: f64) {
        let first = self.n;
        for (lane, child) in node.packed_children() {
            let bound = bounds[lane];
            // A bound that is not a number proves nothing.
            if bound > beyond {
                continue;
            }
            let mut at = self.n;
            while at > first && self.children[at - 1].0 < bound {
                self.children[at] = self.children[at - 1];
                at -= 1;
            }
            self.children[at] = (bound, child);
            self.n += 1;
        }
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<(f64, u32)> {
        self.n = self.n.checked_sub(1)?;
        Some(self.children[self.n])
    }
}
