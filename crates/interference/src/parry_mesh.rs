//! The same queries by the collision library parry3d, as a reference.

use std::sync::Arc;

use facemill_cl_data::{ConvexPolyhedron, RoundFrustum, Solid};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry3d_f64::query::gjk;
use parry3d_f64::query::gjk::{CsoPoint, GJKResult, VoronoiSimplex};
use parry3d_f64::shape::{Cuboid, SupportMap, Triangle};

use crate::closed::{ClosedParts, Components};
use crate::mesh_tree::is_finite;
use crate::query::Interference;
use crate::query::verdict::{Separation, Verdict, Witness};

/// The plain reference: parry3d's tree of boxes, and its GJK distance for each triangle whose box
/// the body's meets.
///
/// Exact shapes, no sampling. GJK stops at a relative error of some 5e-8 of the distance, so
/// distances are exact to that, verdicts within that of the rounding; a pair on which it does not
/// settle counts as touching. Insideness is decided by the same count of crossings as in
/// [`MeshTree`](crate::mesh_tree::MeshTree), over all triangles. That one is the one to use: this
/// is a hundred times slower. A body whose pose or size is not finite counts as a hit, and as
/// distance 0.
pub struct ParryMesh {
    boxes: Bvh,
    corners: Vec<[Point3<f64>; 3]>,
    closed: ClosedParts,
}

impl ParryMesh {
    /// The reference for a mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        let corners: Vec<_> = (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect();
        let boxes: Vec<_> = corners.iter().map(|c| Aabb::from_points(c.iter().map(vector))).collect();
        let order: Vec<u32> = (0..corners.len() as u32).collect();
        let closed = Components::of(mesh).ordered(&order);
        Self { boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), corners, closed }
    }

    /// Triangles whose boxes meet the box around the body dilated by `reach`.
    fn candidates(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, reach: f64) -> Vec<u32> {
        let around = solid.dilated(-solid.rounding()).aabb().transformed(mesh_from_solid).dilated(reach);
        let around = Aabb::new(vector(&around.min), vector(&around.max));
        self.boxes.intersect_aabb(&around).collect()
    }

    fn separation(&self, core: &dyn SupportMap, mesh_from_solid: &Isometry3<f64>, triangle: u32) -> Separation {
        let corners = self.corners[triangle as usize].map(|p| mesh_from_solid.inverse_transform_point(&p));
        let facet = Triangle::new(vector(&corners[0]), vector(&corners[1]), vector(&corners[2]));
        let (distance, point) = gjk_distance(core, &facet);
        let point = mesh_from_solid * Point3::new(point.x, point.y, point.z);
        Separation { distance, triangle, point }
    }
}

impl Interference for ParryMesh {
    fn verdict(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, _hint: Option<u32>) -> Verdict {
        if let Some(s) = self.core_distance(solid, mesh_from_solid, solid.rounding(), None) {
            return Verdict::Hit(Witness { triangle: s.triangle, point: s.point });
        }
        let (origin, along) = (mesh_from_solid * solid.interior_point(), mesh_from_solid * Vector3::z());
        let way_out = self.closed.way_out(0..self.corners.len(), &self.corners, &origin, &along);
        way_out.map_or(Verdict::Free, |(place, point)| Verdict::Hit(Witness { triangle: place as u32, point }))
    }

    fn core_distance(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        at_most: f64,
        _hint: Option<u32>,
    ) -> Option<Separation> {
        if !is_finite(solid, mesh_from_solid) {
            let corners = self.corners.first()?;
            return Some(Separation { distance: 0.0, triangle: 0, point: corners[0] });
        }
        let core = core_of(solid);
        self.candidates(solid, mesh_from_solid, at_most)
            .into_iter()
            .map(|t| self.separation(core.as_ref(), mesh_from_solid, t))
            .filter(|s| s.distance <= at_most)
            .min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle)))
    }
}

/// Distance of a core and a facet in the core's frame, and the facet's nearest point.
fn gjk_distance(core: &dyn SupportMap, facet: &Triangle) -> (f64, Vector) {
    let pose = Pose::identity();
    let center = (facet.a + facet.b + facet.c) / 3.0;
    // A start off the line through the centres: on it GJK meets ties of symmetric bodies at once.
    for start in [center + Vector::new(0.3, 0.2, 0.1), Vector::X, Vector::new(-0.6, 0.5, 0.7)] {
        let direction = start.try_normalize().unwrap_or(Vector::Z);
        let mut simplex = VoronoiSimplex::new();
        simplex.reset(CsoPoint::from_shapes(&pose, core, facet, direction));
        match gjk::closest_points(&pose, core, facet, f64::MAX, true, &mut simplex) {
            GJKResult::ClosestPoints(a, b, _) => return ((a - b).length(), b),
            GJKResult::Intersection => return (0.0, center),
            GJKResult::Proximity(_) | GJKResult::NoIntersection(_) => {}
        }
    }
    (0.0, center)
}

fn core_of(solid: &Solid) -> Box<dyn SupportMap> {
    match solid {
        Solid::Frustum(f) => Box::new(FrustumSupport(*f)),
        Solid::Box(b) => Box::new(Cuboid::new(vector(&Point3::from(b.half_extents)))),
        Solid::Hull(h) => Box::new(HullSupport(Arc::clone(&h.core))),
    }
}

fn vector(p: &Point3<f64>) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

/// A polyhedron as parry sees it.
struct HullSupport(Arc<ConvexPolyhedron>);

impl SupportMap for HullSupport {
    fn local_support_point(&self, direction: Vector) -> Vector {
        vector(&self.0.support(&Vector3::new(direction.x, direction.y, direction.z)))
    }
}

/// A frustum as parry sees it: parry has cylinders and cones, but none cut off.
struct FrustumSupport(RoundFrustum);

impl SupportMap for FrustumSupport {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let f = &self.0;
        let beside = direction.x.hypot(direction.y);
        let (x, y) = if beside > 0.0 { (direction.x / beside, direction.y / beside) } else { (1.0, 0.0) };
        let reach = |radius: f64, z: f64| radius * beside + z * direction.z;
        let (radius, z) = if reach(f.radius_low, f.z_low) >= reach(f.radius_high, f.z_high) {
            (f.radius_low, f.z_low)
        } else {
            (f.radius_high, f.z_high)
        };
        Vector::new(radius * x, radius * y, z)
    }
}
