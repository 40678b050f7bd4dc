//! The first free lift of a body: from the end of one triangle's interval of lifts to the next.

use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Translation3, Vector3};

use crate::body::Body;
use crate::body::edge::Goal;
use crate::body::facet::nearest_on_triangle;
use crate::body::lanes::vectorized;
use crate::mesh_tree::build::Child;
use crate::mesh_tree::{MeshTree, Pending, TOUCH};
use crate::query::lift::LiftSearch;

/// Most trials on the way up: what is then left is climbed triangle by triangle.
const MAX_TRIALS: usize = 32;

/// Height (mm) of a trial above the present lift, at least, and as part of what the last one
/// brought: smaller, and more trials end below the free lift; larger, and more of the surface is as
/// near to the trial as what is in the way.
const LEAST_HEADROOM: f64 = 0.003;

const HEADROOM: f64 = 0.01;

/// A solid to be lifted.
pub(crate) struct LiftedSolid<'a> {
    pub(crate) solid: &'a Solid,
    pub(crate) mesh_from_solid: &'a Isometry3<f64>,
    pub(crate) direction: Vector3<f64>,
    pub(crate) max_lift: f64,
    pub(crate) resolution: f64,
}

impl MeshTree {
    /// The first lift at which the body touches nothing and is inside nothing, but for windows
    /// narrower than the resolution.
    pub(crate) fn first_free(&self, body: &impl Body, lifted: &LiftedSolid) -> Option<f64> {
        // A little more than a verdict's, which rounds the pose in another way.
        let reach = lifted.solid.rounding() + 2.0 * TOUCH;
        let search = LiftSearch { body, direction: lifted.direction, reach, accuracy: 0.5 * lifted.resolution };
        let mut lift = 0.0;
        loop {
            lift = vectorized(
                self.arch,
                #[inline(always)]
                || self.clear_lift(&search, lift, lifted.max_lift),
            )?;
            let pose = Translation3::from(lifted.direction * lift) * lifted.mesh_from_solid;
            let Some(out) = self.way_out(lifted.solid, &pose, &lifted.direction) else { return Some(lift) };
            // Inside until the half line leaves.
            let depth = lifted.direction.dot(&(out.point - pose * lifted.solid.interior_point()));
            lift += depth.max(lifted.resolution);
            if lift > lifted.max_lift {
                return None;
            }
        }
    }

    /// The first lift not below `lift` at which the body touches nothing; `None` where it is above
    /// `max_lift`.
    #[inline(always)]
    fn clear_lift<B: Body>(&self, search: &LiftSearch<B>, lift: f64, max_lift: f64) -> Option<f64> {
        let (mut lift, is_free) = self.climbed(search, lift);
        if lift > max_lift {
            return None;
        }
        if is_free {
            return Some(lift);
        }
        let goal = Goal { enough: search.reach, beyond: search.reach };
        let mut stack = Pending::new();
        loop {
            let mut body = search.at(lift);
            let before = lift;
            stack.push_root(&self.nodes);
            while let Some((_, child)) = stack.pop() {
                match Child::unpack(child) {
                    Child::Node(node) => stack.push_children(&self.nodes[node as usize], &body, goal.beyond),
                    Child::Triangle(place) => {
                        let corners = &self.corners[place as usize];
                        if nearest_on_triangle(&body, corners, goal).is_some() {
                            lift = search.exit(corners, lift);
                            if lift > max_lift {
                                return None;
                            }
                            body = search.at(lift);
                        }
                    }
                }
            }
            // A triangle passed by at smaller lifts may be in the way now.
            if lift == before {
                return Some(lift);
            }
        }
    }

    /// A lift with no free one below it, and whether it is proven free itself, which it mostly is.
    ///
    /// Triangles are looked at from a trial lift above, the nearest first: what is as far as the
    /// trial is above the present lift cannot be in the way in between. From each that is touched
    /// at the present lift, that goes to the end of its interval.
    #[inline(always)]
    fn climbed<B: Body>(&self, search: &LiftSearch<B>, mut lift: f64) -> (f64, bool) {
        let mut before = lift;
        let Some(place) = self.touched(&search.at(lift), search.reach) else { return (lift, true) };
        lift = search.exit(&self.corners[place], lift);
        for _ in 0..MAX_TRIALS {
            let above = lift + LEAST_HEADROOM.max(HEADROOM * (lift - before));
            before = lift;
            let passed = self.climbed_below(search, above, &mut lift);
            if lift <= above {
                return (lift, self.are_clear(search, &passed, above, lift));
            }
        }
        (lift, false)
    }

    /// Raises a lift up to a trial at `above`, or beyond it, by triangles that are touched on the
    /// way; returns those that may be in the way between lift and trial.
    #[inline(always)]
    fn climbed_below<B: Body>(&self, search: &LiftSearch<B>, above: f64, lift: &mut f64) -> Passed {
        let body = search.at(above);
        let mut passed = Passed { near: [(0.0, 0); MOST_PASSED], n: 0 };
        let mut stack = Pending::new();
        stack.push_root(&self.nodes);
        while let Some((bound, child)) = stack.pop() {
            let beyond = search.reach + (above - *lift);
            if bound > beyond {
                continue;
            }
            let place = match Child::unpack(child) {
                Child::Triangle(place) => place,
                Child::Node(node) => {
                    stack.push_children(&self.nodes[node as usize], &body, beyond);
                    continue;
                }
            };
            let corners = &self.corners[place as usize];
            let goal = Goal { enough: search.reach, beyond };
            let Some(nearest) = nearest_on_triangle(&body, corners, goal) else { continue };
            let is_away = nearest.distance > search.reach;
            if !search.touches(corners, *lift) {
                passed.push(nearest.distance, place);
                continue;
            }
            *lift =
                if is_away { search.exit_below(corners, *lift, above, &nearest) } else { search.exit(corners, above) };
            if *lift > above {
                break;
            }
        }
        passed
    }

    /// Whether none of the triangles passed at a trial lift is touched at a lift below: with the
    /// others, that proves it free.
    #[inline(always)]
    fn are_clear<B: Body>(&self, search: &LiftSearch<B>, passed: &Passed, above: f64, lift: f64) -> bool {
        let beyond = search.reach + (above - lift);
        let is_clear = |place: u32| !search.touches(&self.corners[place as usize], lift);
        passed.n <= MOST_PASSED
            && passed.near[..passed.n].iter().all(|&(distance, place)| distance > beyond || is_clear(place))
    }

    /// Place of a triangle within `reach` of the body.
    #[inline(always)]
    fn touched(&self, body: &impl Body, reach: f64) -> Option<usize> {
        let goal = Goal { enough: reach, beyond: reach };
        let mut stack = Pending::new();
        stack.push_root(&self.nodes);
        while let Some((_, child)) = stack.pop() {
            match Child::unpack(child) {
                Child::Node(node) => stack.push_children(&self.nodes[node as usize], body, reach),
                Child::Triangle(place) => {
                    if nearest_on_triangle(body, &self.corners[place as usize], goal).is_some() {
                        return Some(place as usize);
                    }
                }
            }
        }
        None
    }
}

/// Most triangles kept aside: with more of them the tree is walked again.
const MOST_PASSED: usize = 128;

/// Triangles near a trial that were not touched at the lift of the moment, with their distances at
/// the trial.
struct Passed {
    near: [(f64, u32); MOST_PASSED],
    /// Their number, or one more than there is room for.
    n: usize,
}

impl Passed {
    #[inline(always)]
    fn push(&mut self, distance: f64, place: u32) {
        if let Some(free) = self.near.get_mut(self.n) {
            *free = (distance, place);
            self.n += 1;
        } else {
            self.n = MOST_PASSED + 1;
        }
    }
}
