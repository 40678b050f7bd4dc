//! Verdicts over a range of turns about a fixed point: what a body touches in no pose of it.
//!
//! A cutter that turns about the point where it touches the surface moves far at its other end and not at all at the
//! contact, so that one bound for all its points proves nothing. Seen from the body it is the mesh that turns, and a point
//! q of the mesh moves in proportion to its own distance from the centre. The body's distance f is convex: with its slope
//! g at a point c, f(q′) ≥ f(c) + g·(q′ − c) wherever q gets to. To first order q′ is linear in the angles and in q, so
//! that the least value over a slab or triangle and over all angles is at their corners; what is left is second order in
//! the angles, times the distance from the centre.

use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{Body, Placed, for_body};
use crate::bound::Slab;
use crate::certify::SweepVerdict;
use crate::edge::{Goal, Sample};
use crate::facet::nearest_on_triangle;
use crate::lanes::vectorized;
use crate::mesh_tree::{MeshTree, STACK, TOUCH, is_finite};
use crate::tree_build::Child;

/// Poses that a solid gets into by two turns about a fixed point.
///
/// For a and b in −1..=1, the solid is turned from its pose in the middle about the centre by a times the first turn, then
/// by b times the second, and moved by at most `shift`. A solid of revolution may be spun about its own axis besides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnRange {
    /// Pose in the middle, a = b = 0.
    pub mesh_from_solid: Isometry3<f64>,
    /// The fixed point, mesh frame.
    pub center: Point3<f64>,
    /// Largest turns, as axis times angle (rad), mesh frame.
    pub turns: [Vector3<f64>; 2],
    /// Largest movement besides, mm.
    pub shift: f64,
}

impl TurnRange {
    /// Sum of both angles, rad.
    fn angle(&self) -> f64 {
        self.turns[0].norm() + self.turns[1].norm()
    }

    /// No point at a distance from the centre moves farther than this, mm.
    pub fn farthest(&self, from_center: f64) -> f64 {
        self.angle() * from_center + self.shift
    }

    /// What a point at a distance from the centre may depart from its first-order movement, mm.
    ///
    /// The second derivative along a straight way from the middle to any (a, b) is no longer than the square of the sum of
    /// the angles times the distance.
    pub fn remainder(&self, from_center: f64) -> f64 {
        0.5 * self.angle().powi(2) * from_center + self.shift
    }

    /// First-order movements of a mesh point, seen from the solid, at the four corners of the range.
    pub fn corner_moves(&self, q: &Point3<f64>) -> [Vector3<f64>; 4] {
        let [first, second] = self.turns.map(|turn| turn.cross(&(q - self.center)));
        [first + second, first - second, second - first, -first - second]
    }

    fn is_finite(&self) -> bool {
        let turns = self.turns.iter().flat_map(|t| t.iter());
        self.center.iter().chain(turns).chain([&self.shift]).all(|v| v.is_finite())
    }
}

/// Subdivisions of a triangle: 2^−12 of a facet of a metre is a quarter of a millimetre.
const MAX_SPLITS: u32 = 12;

impl MeshTree {
    /// Whether the dilated solid touches nothing of the mesh in any pose of a range, and is in no closed component.
    ///
    /// Clear is proven, up to the rounding band of verdicts. Unproven says that the solid may touch, or that the range is
    /// too large; a smaller one tells more. `hint` is a triangle to look at first.
    pub(crate) fn turned(&self, solid: &Solid, range: &TurnRange, hint: Option<u32>) -> SweepVerdict {
        let pose = &range.mesh_from_solid;
        if !(is_finite(solid, pose) && range.is_finite()) {
            return SweepVerdict::Unproven(None);
        }
        let beyond = solid.rounding() + TOUCH;
        let verdict = for_body!(Placed::new(solid, pose), |body| {
            let turned = Turned { body: &body, range, beyond };
            vectorized(
                self.arch,
                #[inline(always)]
                || self.turned_surface(&turned, hint),
            )
        });
        // What never touches the surface is inside in all poses or in none.
        match verdict {
            SweepVerdict::Clear => match self.way_out(solid, pose, &(pose * Vector3::z())) {
                None => SweepVerdict::Clear,
                Some(witness) => SweepVerdict::Unproven(Some(witness.triangle)),
            },
            unproven => unproven,
        }
    }

    #[inline(always)]
    fn turned_surface<B: Body>(&self, turned: &Turned<'_, B>, hint: Option<u32>) -> SweepVerdict {
        if let Some(place) = self.hinted(hint)
            && !turned.clears_triangle(&self.corners[place], MAX_SPLITS)
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
                    if turned.clears_triangle(&self.corners[place as usize], MAX_SPLITS) {
                        continue;
                    }
                    return SweepVerdict::Unproven(Some(self.triangles[place as usize]));
                }
            };
            let bounds = node.slabs.least_distances(turned.body);
            for (lane, child) in node.packed_children() {
                let slab = node.slabs.get(lane);
                if bounds[lane] - turned.farthest(&slab) > turned.beyond || turned.clears_slab(&slab) {
                    continue;
                }
                pending[n] = child;
                n += 1;
            }
        }
        SweepVerdict::Clear
    }
}

/// A body in the middle of its range.
struct Turned<'b, B> {
    body: &'b B,
    range: &'b TurnRange,
    /// Core distance that has to be exceeded.
    beyond: f64,
}

impl<B: Body> Turned<'_, B> {
    /// No point of a slab moves farther against the body than this, mm.
    #[inline(always)]
    fn farthest(&self, slab: &Slab) -> f64 {
        self.range.farthest(self.reach_of(slab))
    }

    #[inline(always)]
    fn reach_of(&self, slab: &Slab) -> f64 {
        (slab.center - self.range.center).norm() + slab.radius + slab.half_thickness
    }

    /// What the turns add to a slope, at the four corners of the range: movements of q along g are q's height along g × turn.
    #[inline(always)]
    fn turned_slopes(&self, slope: &Vector3<f64>) -> [Vector3<f64>; 4] {
        let [first, second] = self.range.turns.map(|turn| slope.cross(&turn));
        [first + second, first - second, second - first, -first - second]
    }

    #[inline(always)]
    fn clears_slab(&self, slab: &Slab) -> bool {
        let (distance, slope) = self.body.distance(&slab.center);
        if distance <= 0.0 {
            return false;
        }
        let from_center = slab.center - self.range.center;
        let least = self
            .turned_slopes(&slope)
            .iter()
            .map(|added| from_center.dot(added) - slab.extent(&(slope + added)))
            .fold(f64::INFINITY, f64::min);
        distance + least - self.range.remainder(self.reach_of(slab)) > self.beyond
    }

    /// Whether a triangle is proven to stay farther than `beyond` in all poses.
    fn clears_triangle(&self, corners: &[Point3<f64>; 3], splits: u32) -> bool {
        let reach = corners.iter().map(|p| (p - self.range.center).norm()).fold(0.0, f64::max);
        let goal = Goal { enough: self.beyond, beyond: self.beyond + self.range.farthest(reach) };
        let Some(nearest) = nearest_on_triangle(self.body, corners, goal) else { return true };
        if nearest.distance <= self.beyond || nearest.distance.is_nan() {
            return false;
        }
        let at_corners = self.least_over(&nearest, corners) - self.range.remainder(reach);
        if at_corners > self.beyond {
            return true;
        }
        // Where the point itself is not cleared, no smaller triangle around it is.
        let own_reach = (nearest.point - self.range.center).norm();
        let own = self.least_over(&nearest, &[nearest.point; 3]) - self.range.remainder(own_reach);
        if splits == 0 || own.is_nan() || own <= self.beyond {
            return false;
        }
        quarters(corners).iter().all(|quarter| self.clears_triangle(quarter, splits - 1))
    }

    /// Lower bound of the distance over a triangle and all corners of the range, from its slope at one point, but for the
    /// remainder.
    fn least_over(&self, sample: &Sample, corners: &[Point3<f64>; 3]) -> f64 {
        let from_center = sample.point - self.range.center;
        let slopes = self.turned_slopes(&sample.gradient);
        let at = |added: &Vector3<f64>, p: &Point3<f64>| {
            (sample.gradient + added).dot(&(p - sample.point)) + from_center.dot(added)
        };
        let least = slopes.iter().flat_map(|s| corners.iter().map(move |p| at(s, p))).fold(f64::INFINITY, f64::min);
        sample.distance + least
    }
}

/// A triangle in four, split at the middles of its edges.
fn quarters([a, b, c]: &[Point3<f64>; 3]) -> [[Point3<f64>; 3]; 4] {
    let (ab, bc, ca) = (nalgebra::center(a, b), nalgebra::center(b, c), nalgebra::center(c, a));
    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_kit::{Lcg, cube, frustum, sample_solids, sheet, square};
    use crate::{Interference, MeshTree};
    use facemill_surface_model::TriMesh;
    use nalgebra::{Translation3, UnitQuaternion};

    fn turned_pose(range: &TurnRange, a: f64, b: f64, shift: Vector3<f64>) -> Isometry3<f64> {
        let turn =
            UnitQuaternion::from_scaled_axis(range.turns[1] * b) * UnitQuaternion::from_scaled_axis(range.turns[0] * a);
        let to_center = Translation3::from(range.center.coords);
        Translation3::from(shift) * to_center * turn * to_center.inverse() * range.mesh_from_solid
    }

    #[test]
    fn what_is_clear_is_touched_in_no_sampled_pose() {
        let tree = MeshTree::new(&sheet());
        let mut lcg = Lcg::new(81);
        let (mut clear, mut near) = (0, 0);
        for solid in sample_solids() {
            for _ in 0..400 {
                let middle = lcg.pose(45.0);
                let range = TurnRange {
                    mesh_from_solid: middle,
                    center: middle * lcg.point(20.0),
                    turns: [lcg.unit() * lcg.range(0.0, 0.2), lcg.unit() * lcg.range(0.0, 0.2)],
                    shift: lcg.range(0.0, 0.5),
                };
                if tree.turn(&solid, &range, None) != SweepVerdict::Clear {
                    continue;
                }
                clear += 1;
                let mut least = f64::INFINITY;
                for k in 0..81 {
                    // A grid with the corners, where the turns are largest.
                    let (a, b) = (f64::from(k / 9) / 4.0 - 1.0, f64::from(k % 9) / 4.0 - 1.0);
                    let pose = turned_pose(&range, a, b, lcg.unit() * range.shift);
                    assert!(tree.verdict(&solid, &pose, None).is_free(), "{solid:?} at {a}, {b}");
                    let near = tree.core_distance(&solid, &pose, solid.rounding() + 5.0, None);
                    least = least.min(near.map_or(5.0, |s| s.distance - solid.rounding()));
                }
                near += usize::from(least < 1.0);
            }
        }
        assert!(clear > 1000 && near > 25, "{clear} clear, {near} of them near");
    }

    #[test]
    fn a_mill_that_turns_about_its_contact_is_cleared_over_degrees() {
        // R 25, r 2, smaller by 0.02 as its test body, leaning by 6° on a plane, its corner's centre 2 mm above the contact.
        let mill = frustum([2.0, 48.0], [23.0, 23.0], 1.98);
        let center = Point3::new(0.0, 0.0, 2.0);
        let tilt = 6f64.to_radians();
        let at = |tilt: f64, turns: [f64; 2]| {
            let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
            let from_contact = Translation3::new(-23.0, 0.0, -2.0);
            TurnRange {
                mesh_from_solid: Translation3::from(center.coords) * lean * from_contact,
                center,
                turns: [Vector3::y() * turns[0], Vector3::z() * turns[1]],
                shift: 0.0,
            }
        };
        for mesh in [square(500.0), square(60.0)] {
            let tree = MeshTree::new(&mesh);
            for turns in [[0.02, 0.02], [0.04, 0.0], [0.0, 0.08], [0.001, 0.001]] {
                assert_eq!(tree.turn(&mill, &at(tilt, turns), None), SweepVerdict::Clear, "{turns:?}");
            }
            // Down to below the plane: at −0.1° the trailing edge is 46·sin(0.1°) = 0.08 mm in it.
            let below = tilt + 0.1f64.to_radians();
            assert!(matches!(tree.turn(&mill, &at(tilt, [below, 0.0]), None), SweepVerdict::Unproven(Some(_))));
            assert!(matches!(tree.turn(&mill, &at(-0.002, [1e-4; 2]), None), SweepVerdict::Unproven(Some(_))));
        }
    }

    #[test]
    fn a_needle_that_is_met_within_the_range_is_never_cleared() {
        let spike = vec![Point3::new(30.0, 0.0, -5.0), Point3::new(30.01, 0.0, -5.0), Point3::new(30.0, 0.0, 0.5)];
        let tree = MeshTree::new(&TriMesh::new(spike, vec![[0, 1, 2]]).unwrap());
        let arm = frustum([-1.0, 1.0], [0.5, 0.5], 0.0);
        // At the end of an arm of 30 mm that turns about the origin.
        let at = |angle: f64, half: f64| TurnRange {
            mesh_from_solid: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
                * Translation3::new(30.0, 0.0, 0.0),
            center: Point3::origin(),
            turns: [Vector3::zeros(), Vector3::z() * half],
            shift: 0.0,
        };
        let half_width = 0.5 / 30.0;
        assert!(matches!(tree.turn(&arm, &at(0.1, 0.1 - 0.9 * half_width), None), SweepVerdict::Unproven(_)));
        assert!(matches!(tree.turn(&arm, &at(0.1, 0.2), None), SweepVerdict::Unproven(_)));
        assert_eq!(tree.turn(&arm, &at(0.1, 0.05), None), SweepVerdict::Clear);
        for k in 0..200 {
            let angle = -0.2 + 0.002 * f64::from(k);
            if tree.turn(&arm, &at(angle, 0.001), None) == SweepVerdict::Clear {
                assert!(angle.abs() + 0.001 > half_width, "{angle}");
            } else {
                assert!(angle.abs() < half_width + 0.0015, "{angle}");
            }
        }
    }

    #[test]
    fn a_point_that_comes_nearer_to_second_order_only_is_not_overlooked() {
        // Above a disc that turns about a point 50 mm below its top: to first order a point over the middle goes sideways.
        let disc = frustum([40.0, 50.0], [30.0, 30.0], 0.0);
        for angle in [0.05f64, 0.1, 0.2] {
            let dip = 50.0 * (1.0 - angle.cos());
            for (gap, clear) in [(0.9 * dip, false), (1.2 * dip, true)] {
                let top = Point3::new(0.0, 0.0, 50.0 + gap);
                let speck = vec![top, top + Vector3::new(1e-3, 0.0, 0.0), top + Vector3::new(0.0, 1e-3, 0.0)];
                let tree = MeshTree::new(&TriMesh::new(speck, vec![[0, 1, 2]]).unwrap());
                let range = |turns: [f64; 2]| TurnRange {
                    mesh_from_solid: Isometry3::identity(),
                    center: Point3::origin(),
                    turns: [Vector3::x() * turns[0], Vector3::x() * turns[1]],
                    shift: 0.0,
                };
                // In one turn, or half of it in each.
                for turns in [[angle, 0.0], [0.0, angle], [0.5 * angle, 0.5 * angle]] {
                    let verdict = tree.turn(&disc, &range(turns), None);
                    assert_eq!(verdict == SweepVerdict::Clear, clear, "{angle} {gap} {verdict:?}");
                    let met = tree.verdict(&disc, &turned_pose(&range(turns), 1.0, 1.0, Vector3::zeros()), None);
                    assert_eq!(met.is_free(), clear, "{angle} {gap}");
                }
            }
        }
    }

    #[test]
    fn a_body_inside_a_closed_part_and_numbers_that_are_none_are_not_cleared() {
        let tree = MeshTree::new(&cube(20.0, 1));
        let ball = frustum([0.0, 0.0], [0.0, 0.0], 1.0);
        let still = |x: f64, shift: f64| TurnRange {
            mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
            center: Point3::origin(),
            turns: [Vector3::zeros(), Vector3::z() * 0.01],
            shift,
        };
        assert!(matches!(tree.turn(&ball, &still(0.0, 0.0), None), SweepVerdict::Unproven(Some(_))));
        assert_eq!(tree.turn(&ball, &still(30.0, 0.0), None), SweepVerdict::Clear);
        assert_eq!(tree.turn(&ball, &still(30.0, f64::NAN), None), SweepVerdict::Unproven(None));
        assert_eq!(tree.turn(&ball, &still(f64::INFINITY, 0.0), None), SweepVerdict::Unproven(None));
    }
}
