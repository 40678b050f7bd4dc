//! Verdicts over an interval of time: what a moving body touches at no moment of it.
//!
//! A body that slides along a surface is near to it all the time, so that its speed says nothing: what counts is how far
//! it moves *toward* each piece of the surface. With the separating direction g of a piece in the middle of the interval
//! (the gradient of the distance there), the distance at any time is at least g·p − h, the extent h of the body along g
//! at that time. To first order in time every point of the body goes straight, and the extent of points that go straight
//! is a largest value of linear functions, so it is largest at an end of the interval, where it is a support point in
//! another direction. What motion departs from the straight one is bounded by the caller.

use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{Body, Placed, for_body};
use crate::edge::Goal;
use crate::facet::{lower_bound, nearest_on_triangle};
use crate::lanes::vectorized;
use crate::mesh_tree::{MeshTree, STACK, TOUCH, is_finite};
use crate::tree_build::Child;

/// What is known of the motion of a solid over an interval of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionInterval {
    /// Pose in the middle of the interval.
    pub mesh_from_solid: Isometry3<f64>,
    /// Velocity of the solid's origin there, mm per unit of time, mesh frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity there, rad per unit of time, mesh frame.
    pub spin: Vector3<f64>,
    /// Half of the interval's length: time runs from −half to half.
    pub half: f64,
    /// No point of the solid's core is ever farther than this from where its velocity in the middle would have brought it,
    /// mm.
    pub deviation: f64,
}

/// Whether a moving solid touches the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepVerdict {
    /// At no time of the interval: proven.
    Clear,
    /// Not proven; the triangle that could not be told apart from the solid.
    Unproven(Option<u32>),
}

impl MeshTree {
    /// Whether the dilated solid touches nothing of the mesh at any time of an interval, and is in no closed component.
    ///
    /// Clear is proven, up to the rounding band of [`Interference::verdict`](crate::Interference::verdict). Unproven says
    /// that the solid may touch, that the core does in the middle, or that the interval is too long; a shorter one tells more.
    /// The lack falls with the square of the length where `deviation` does. `hint` is a triangle to look at first.
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
        // What never touches the surface is inside at all times or at none.
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

    /// How much farther the body reaches along a unit direction at some time of the interval than in its middle, mm.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_kit::{Lcg, cube, frustum, sample_solids, sheet, square};
    use crate::{Interference, MeshTree};
    use facemill_surface_model::TriMesh;
    use nalgebra::{Translation3, UnitQuaternion};

    /// Turn about an axis through the solid's origin at constant rate, and constant velocity of the origin: its pose at a
    /// time, and how far points of the solid leave their tangents.
    struct Screw {
        middle: Isometry3<f64>,
        velocity: Vector3<f64>,
        spin: Vector3<f64>,
    }

    impl Screw {
        fn at(&self, t: f64) -> Isometry3<f64> {
            let turn = UnitQuaternion::from_scaled_axis(self.spin * t);
            let shift = self.middle.translation.vector + self.velocity * t;
            Isometry3::from_parts(Translation3::from(shift), turn * self.middle.rotation)
        }

        fn interval(&self, solid: &Solid, half: f64) -> MotionInterval {
            let bounds = solid.aabb();
            let reach = bounds.min.coords.abs().sup(&bounds.max.coords.abs()).norm();
            let deviation = 0.5 * self.spin.norm_squared() * reach * half * half;
            let Self { middle, velocity, spin } = *self;
            MotionInterval { mesh_from_solid: middle, velocity, spin, half, deviation }
        }
    }

    #[test]
    fn what_is_clear_is_touched_at_no_sampled_time() {
        let mesh = sheet();
        let tree = MeshTree::new(&mesh);
        let mut lcg = Lcg::new(71);
        let (mut clear, mut near) = (0, 0);
        for solid in sample_solids() {
            for _ in 0..120 {
                let middle = lcg.pose(45.0);
                let screw = Screw {
                    middle,
                    velocity: lcg.unit() * lcg.range(0.0, 6.0),
                    spin: lcg.unit() * lcg.range(0.0, 0.2),
                };
                let half = lcg.range(0.05, 1.0);
                if tree.sweep(&solid, &screw.interval(&solid, half), None) != SweepVerdict::Clear {
                    continue;
                }
                clear += 1;
                let mut least = f64::INFINITY;
                for k in 0..=60 {
                    let t = half * (f64::from(k) / 30.0 - 1.0);
                    assert!(tree.verdict(&solid, &screw.at(t), None).is_free(), "{solid:?} at {t}");
                    let near = tree.core_distance(&solid, &screw.at(t), solid.rounding() + 5.0, None);
                    least = least.min(near.map_or(5.0, |s| s.distance - solid.rounding()));
                }
                near += usize::from(least < 1.0);
            }
        }
        assert!(clear > 200 && near > 15, "{clear} clear, {near} of them near");
    }

    #[test]
    fn a_short_enough_interval_proves_what_is_free() {
        // By the square of the length: the lack of an interval is the motion that is not straight.
        let tree = MeshTree::new(&sheet());
        let mut lcg = Lcg::new(72);
        let mut proven = 0;
        for solid in sample_solids() {
            for _ in 0..60 {
                let middle = lcg.pose(45.0);
                let gap =
                    tree.core_distance(&solid, &middle, 100.0, None).map_or(100.0, |s| s.distance) - solid.rounding();
                if !(1e-3..=20.0).contains(&gap) {
                    continue;
                }
                let screw = Screw { middle, velocity: lcg.unit() * 5.0, spin: lcg.unit() * 0.3 };
                // No point of the samples is farther than 100 mm from its origin: 35 mm per unit of time.
                let half = gap / 40.0;
                assert_eq!(
                    tree.sweep(&solid, &screw.interval(&solid, half), None),
                    SweepVerdict::Clear,
                    "{solid:?} {gap}"
                );
                proven += 1;
            }
        }
        assert!(proven > 60, "{proven}");
    }

    #[test]
    fn a_disc_that_slides_along_a_plane_is_certified_over_its_whole_way() {
        let tree = MeshTree::new(&square(500.0));
        let mill = frustum([2.0, 48.0], [23.0, 23.0], 2.0);
        let slide = |gap: f64, toward: f64| MotionInterval {
            mesh_from_solid: Isometry3::translation(0.0, 0.0, gap),
            velocity: Vector3::new(100.0, 0.0, -toward),
            spin: Vector3::zeros(),
            half: 1.0,
            deviation: 0.0,
        };
        // A micrometre over the plane, 200 mm far: distance over speed would have to stop every micrometre.
        assert_eq!(tree.sweep(&mill, &slide(1e-3, 0.0), None), SweepVerdict::Clear);
        assert_eq!(tree.sweep(&mill, &slide(1e-3, 0.9e-3), None), SweepVerdict::Clear);
        assert!(matches!(tree.sweep(&mill, &slide(1e-3, 1.1e-3), None), SweepVerdict::Unproven(Some(_))));
        assert!(matches!(tree.sweep(&mill, &slide(-1e-6, 0.0), None), SweepVerdict::Unproven(Some(_))));
        // Tilted about its lowest point, the rim stays where it is to first order.
        let (sin, cos) = 0.05f64.sin_cos();
        let lowest = |gap: f64| gap + 23.0 * sin + 2.0 - 2.0 * cos;
        let pose = Isometry3::from_parts(
            Translation3::new(0.0, 0.0, lowest(1e-3)),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05),
        );
        let rim = pose * Point3::new(23.0, 0.0, 2.0);
        let spin = Vector3::new(0.0, 0.02, 0.0);
        let velocity = -spin.cross(&(rim - pose * Point3::origin()));
        let half = 0.1;
        let deviation = 0.5 * (0.02f64 * half).powi(2) * 60.0;
        let motion = MotionInterval { mesh_from_solid: pose, velocity, spin, half, deviation };
        assert_eq!(tree.sweep(&mill, &motion, None), SweepVerdict::Clear, "{deviation}");
    }

    #[test]
    fn a_needle_that_is_met_between_the_ends_is_never_cleared() {
        let spike = vec![Point3::new(10.0, 0.0, -5.0), Point3::new(10.01, 0.0, -5.0), Point3::new(10.005, 0.0, 0.3)];
        let tree = MeshTree::new(&TriMesh::new(spike, vec![[0, 1, 2]]).unwrap());
        let disc = frustum([0.0, 20.0], [3.0, 3.0], 0.0);
        let motion = |half: f64, x: f64| MotionInterval {
            mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
            velocity: Vector3::new(10.0, 0.0, 0.0),
            spin: Vector3::zeros(),
            half,
            deviation: 0.0,
        };
        // Free at both ends, through the spike between.
        for x in [0.0, 20.0] {
            assert!(tree.verdict(&disc, &Isometry3::translation(x, 0.0, 0.0), None).is_free());
        }
        assert!(matches!(tree.sweep(&disc, &motion(1.0, 10.0), None), SweepVerdict::Unproven(_)));
        assert_eq!(tree.sweep(&disc, &motion(0.6, 0.0), None), SweepVerdict::Clear);
        assert!(matches!(tree.sweep(&disc, &motion(0.72, 0.0), None), SweepVerdict::Unproven(_)));
    }

    #[test]
    fn a_body_inside_a_closed_part_and_numbers_that_are_none_are_not_cleared() {
        let tree = MeshTree::new(&cube(20.0, 1));
        let ball = frustum([0.0, 0.0], [0.0, 0.0], 1.0);
        let still = |x: f64, deviation: f64| MotionInterval {
            mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            half: 1.0,
            deviation,
        };
        assert!(matches!(tree.sweep(&ball, &still(0.0, 0.0), None), SweepVerdict::Unproven(Some(_))));
        assert_eq!(tree.sweep(&ball, &still(30.0, 0.0), None), SweepVerdict::Clear);
        assert_eq!(tree.sweep(&ball, &still(30.0, f64::NAN), None), SweepVerdict::Unproven(None));
        assert_eq!(tree.sweep(&ball, &still(f64::INFINITY, 0.0), None), SweepVerdict::Unproven(None));
    }
}
