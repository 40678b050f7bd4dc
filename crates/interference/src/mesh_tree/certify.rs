//! Verdicts over an interval of time: what a moving body touches at no moment of it.
//!
//! A body that slides along a surface is near to it all the time, so that its speed proves nothing:
//! what counts is how far it moves *toward* each piece of the surface. With the separating
//! direction g of a piece in the middle of the interval (the gradient of the distance there), the
//! distance at any time is at least g·p − h, the extent h of the body along g at that time. To
//! first order in time every point of the body goes straight, and the extent of points that go
//! straight is a largest value of linear functions, so it is largest at an end of the interval,
//! where it is a support point in another direction. What motion departs from the straight one is
//! bounded by the caller.

use facemill_cl_data::Solid;
use nalgebra::{Point3, Vector3};

use crate::body::edge::Goal;
use crate::body::facet::{lower_bound, nearest_on_triangle};
use crate::body::lanes::vectorized;
use crate::body::{Body, Placed, for_body};
use crate::mesh_tree::build::Child;
use crate::mesh_tree::{MeshTree, STACK, TOUCH, is_finite};
use crate::query::sweep_verdict::{MotionInterval, SweepVerdict};

impl MeshTree {
    /// Whether the dilated solid touches nothing of the mesh at any time of an interval, and is in
    /// no closed component.
    ///
    /// Clear is proven, up to the rounding band of
    /// [`Interference::verdict`](crate::query::Interference::verdict). Unproven says that the solid
    /// may touch, that the core does in the middle, or that the interval is too long; a shorter one
    /// may prove more. The lack falls with the square of the length where `deviation` does. `hint`
    /// is a triangle to look at first.
    pub(crate) fn swept(&self, solid: &Solid, motion: &MotionInterval, hint: Option<u32>) -> SweepVerdict {
        let pose = &motion.mesh_from_solid;
        let numbers = motion.velocity.iter().chain(motion.spin.iter()).chain([&motion.half, &motion.deviation]);
        if !is_finite(solid, pose) || !numbers.into_iter().all(|v| v.is_finite()) {
            return SweepVerdict::Unproven(None);
        }
        let rounding = solid.rounding();
        let verdict = for_body!(Placed::new(solid, pose), |body| {
            let sweep = Sweep::new(&body, solid, motion);
            vectorized(
                self.arch,
                #[inline(always)]
                || self.swept_surface(&sweep, rounding, hint),
            )
        });
        // A body that never touches the surface is inside at all times or at none.
        match verdict {
            SweepVerdict::Clear => match self.way_out(solid, pose, &(pose * Vector3::z())) {
                None => SweepVerdict::Clear,
                Some(witness) => SweepVerdict::Unproven(Some(witness.triangle)),
            },
            unproven => unproven,
        }
    }

    #[inline(always)]
    fn swept_surface<B: Body>(&self, sweep: &Sweep<'_, B>, rounding: f64, hint: Option<u32>) -> SweepVerdict {
        let beyond = rounding + TOUCH;
        let clear = |place: usize| sweep.clears_triangle(&self.corners[place], beyond);
        if let Some(place) = self.hinted(hint)
            && !clear(place)
        {
            return SweepVerdict::Unproven(hint);
        }
        let mut pending = [0u32; STACK];
        let mut n = usize::from(!self.nodes.is_empty());
        pending[0] = Child::Node(0).pack();
        while n > 0 {
            n -= 1;
            let node = match Child::unpack(pending[n]) {
                Child::Node(index) => &self.nodes[index as usize],
                Child::Triangle(place) => {
                    if clear(place as usize) {
                        continue;
                    }
                    return SweepVerdict::Unproven(Some(self.triangles[place as usize]));
                }
            };
            let bounds = node.slabs.least_distances(sweep.body);
            for (lane, child) in node.packed_children() {
                if bounds[lane] - sweep.farthest > beyond {
                    continue;
                }
                let slab = node.slabs.get(lane);
                let (distance, slope) = sweep.body.distance(&slab.center);
                if distance > 0.0 && slab.least_along(distance, &slope) - sweep.approach(&slope) > beyond {
                    continue;
                }
                pending[n] = child;
                n += 1;
            }
        }
        SweepVerdict::Clear
    }
}

/// A body in the middle of its interval, with its motion.
struct Sweep<'b, B> {
    body: &'b B,
    origin: Point3<f64>,
    motion: &'b MotionInterval,
    /// No point of the body gets farther than this from where it is in the middle, mm.
    farthest: f64,
}

impl<'b, B: Body> Sweep<'b, B> {
    fn new(body: &'b B, solid: &Solid, motion: &'b MotionInterval) -> Self {
        let bounds = solid.dilated(-solid.rounding()).aabb();
        let reach = bounds.min.coords.abs().sup(&bounds.max.coords.abs()).norm();
        let farthest = motion.half.abs() * (motion.velocity.norm() + motion.spin.norm() * reach) + motion.deviation;
        Self { body, origin: motion.mesh_from_solid * Point3::origin(), motion, farthest }
    }

    /// How much farther the body reaches along a unit direction at some time of the interval than
    /// in its middle, mm.
    #[inline(always)]
    fn approach(&self, along: &Vector3<f64>) -> f64 {
        let extent = |direction: &Vector3<f64>| (self.body.support(direction) - self.origin).dot(direction);
        let MotionInterval { velocity, spin, half, deviation, .. } = self.motion;
        // g·(ω × y) is (g × ω)·y: the points' motion turns the direction instead of the body.
        let (turn, shift) = (along.cross(spin) * *half, along.dot(velocity) * half);
        let later = extent(&(along + turn)) + shift;
        let earlier = extent(&(along - turn)) - shift;
        later.max(earlier) - extent(along) + deviation
    }

    /// Whether a triangle is proven to stay farther than `beyond`.
    #[inline(always)]
    fn clears_triangle(&self, corners: &[Point3<f64>; 3], beyond: f64) -> bool {
        let goal = Goal { enough: TOUCH, beyond: beyond + self.farthest };
        match nearest_on_triangle(self.body, corners, goal) {
            None => true,
            Some(nearest) if nearest.distance <= TOUCH => false,
            Some(nearest) => lower_bound(&nearest, corners) - self.approach(&nearest.gradient) > beyond,
        }
    }
}
