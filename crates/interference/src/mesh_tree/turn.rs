//! Verdicts over a range of turns about a fixed point: what a body touches in no pose of it.
//!
//! A cutter that turns about the point where it touches the surface moves far at its other end and
//! not at all at the contact, so that one bound for all its points proves nothing. Seen from the
//! body it is the mesh that turns, and a point q of the mesh moves in proportion to its own
//! distance from the centre. The body's distance f is convex: with its slope g at a point c, f(q′)
//! ≥ f(c) + g·(q′ − c) wherever q gets to. To first order q′ is linear in the angles and in q, so
//! that the least value over a slab or triangle and over all angles is at their corners; what is
//! left is second order in the angles, times the distance from the centre.

use facemill_cl_data::Solid;
use nalgebra::{Point3, Vector3};

use crate::body::bound::Slab;
use crate::body::edge::{Goal, Sample};
use crate::body::facet::nearest_on_triangle;
use crate::body::lanes::vectorized;
use crate::body::{Body, Placed, for_body};
use crate::mesh_tree::build::Child;
use crate::mesh_tree::{MeshTree, STACK, TOUCH, is_finite};
use crate::query::sweep_verdict::{SweepVerdict, TurnRange};

/// Subdivisions of a triangle: 2^−12 of a facet of a metre is a quarter of a millimetre.
const MAX_SPLITS: u32 = 12;

impl MeshTree {
    /// Whether the dilated solid touches nothing of the mesh in any pose of a range, and is in no
    /// closed component.
    ///
    /// Clear is proven, up to the rounding band of verdicts. Unproven says that the solid may
    /// touch, or that the range is too large; a smaller one may prove more. `hint` is a triangle to
    /// look at first.
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
        // A body that never touches the surface is inside in all poses or in none.
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

    /// Returns the additions of the turns to a slope, at the four corners of the range: movements
    /// of q along g are q's height along g × turn.
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

    /// Lower bound of the distance over a triangle and all corners of the range, from its slope at
    /// one point, but for the remainder.
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
