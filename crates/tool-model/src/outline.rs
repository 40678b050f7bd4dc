//! Outline of a cutter across the feed.

use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::Posture;
use nalgebra::{Point2, Vector2, Vector3};

use crate::contact::canonical;
use crate::cutter::Cutter;

/// Outline of a tilted cutter seen along the feed: what a straight pass leaves of the stock.
///
/// It lies in the section plane across the feed: y to the left of the feed (N × Et), z along N,
/// origin at the CC point, mm. The region it bounds is convex: the bottom rim (circle of radius R −
/// r about a point r above the tip) is seen as an ellipse, the corner offsets it by r, and the
/// flute sweeps it along the tool axis up to the upper rim (radius R).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    cutter: Cutter,
    /// Tool tip.
    tip: Point2<f64>,
    /// Tool axis in the plane; shorter than 1 by what lies along the feed.
    axis: Vector2<f64>,
    /// Tool axis along the feed.
    axis_along: f64,
}

impl Outline {
    /// The outline of a cutter that touches the CC point in this posture, as
    /// [`cl_from_cc`](crate::contact::cl_from_cc) puts it.
    pub fn new(cutter: &Cutter, posture: Posture) -> Self {
        let Posture { tilt, rotate } = canonical(posture);
        let ((sin, cos), (turn_sin, turn_cos)) = (tilt.sin_cos(), rotate.sin_cos());
        let (rim, r) = (cutter.rim_radius(), cutter.corner_radius());
        let axis = Vector2::new(sin * turn_sin, cos);
        // r·(1 − cos α), without its cancellation at small tilts.
        let corner_lift = 2.0 * r * (0.5 * tilt).sin().powi(2);
        let tip = Point2::new(-rim * cos * turn_sin - r * axis.x, rim * sin + corner_lift);
        Self { cutter: *cutter, tip, axis, axis_along: sin * turn_cos }
    }

    /// The point of the outline whose outward normal is (sin φ, −cos φ): φ = 0 is the lowest point,
    /// the contact; −π/2 and π/2 are the ends to the right and left. Closed form (support function
    /// of the ellipse, offset by r).
    ///
    /// Where a straight piece has that normal, it is one point of that piece: its middle where the
    /// bottom is seen edge on.
    pub fn point_at(&self, phi: f64) -> Point2<f64> {
        self.point_and_radius(phi).0
    }

    /// The point of normal φ and the radius of curvature there.
    fn point_and_radius(&self, phi: f64) -> (Point2<f64>, f64) {
        let (sin, cos) = phi.sin_cos();
        let n = Vector2::new(sin, -cos);
        let along_axis = self.axis.dot(&n);
        let beside_axis = Vector2::new(-self.axis.y, self.axis.x);
        let across_axis = beside_axis.dot(&n);
        // Sine of the angle between the normal and the axis in space.
        let s = self.axis_along.hypot(across_axis);
        // The normal's part across the axis is n − (a·n)·a, here without its cancellation at small
        // tilts.
        let (m, bulge) = if s > 0.0 {
            let (along, across) = (self.axis_along / s, across_axis / s);
            (n * (along * self.axis_along) + beside_axis * across, along * along / s)
        } else {
            (Vector2::zeros(), 0.0)
        };
        if along_axis <= 0.0 {
            let (rim, r) = (self.cutter.rim_radius(), self.cutter.corner_radius());
            (self.tip + self.axis * r + m * rim + n * r, rim * bulge + r)
        } else {
            let radius = self.cutter.radius();
            (self.tip + self.axis * self.cutter.flute_length() + m * radius, radius * bulge)
        }
    }

    /// Smallest and largest y of the outline, mm.
    pub fn extent(&self) -> (f64, f64) {
        (self.point_at(-FRAC_PI_2).x, self.point_at(FRAC_PI_2).x)
    }

    /// Lowest z of the outline at y, mm; `None` outside its extent.
    ///
    /// Accurate to 1e-12·R: it is the exact height at some y′ with |y′ − y| ≤ 1e-12·R. That says
    /// little only where the outline is vertical (the cylinder's wall at small lean, the ends of
    /// the extent).
    pub fn height_at(&self, y: f64) -> Option<f64> {
        let (mut low, mut high) = (-FRAC_PI_2, FRAC_PI_2);
        let (mut from, mut to) = (self.point_at(low), self.point_at(high));
        if !(from.x <= y && y <= to.x) {
            return None;
        }
        // y grows with the normal's angle: Newton within a bracket, which is halved instead where
        // Newton's step leaves it or does not come at least twice as near as the last.
        let close = 1e-13 * self.cutter.radius();
        let mut phi = 0.5 * (low + high);
        let mut last = f64::INFINITY;
        for _ in 0..200 {
            let (p, radius) = self.point_and_radius(phi);
            let miss = y - p.x;
            if miss.abs() <= close {
                return Some(p.y + phi.tan() * miss);
            }
            if miss > 0.0 {
                (low, from) = (phi, p);
            } else {
                (high, to) = (phi, p);
            }
            let newton = phi + miss / (radius * phi.cos());
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let nears = miss.abs() <= 0.5 * last;
            last = miss.abs();
            phi = if nears && low < newton && newton < high { newton } else { middle };
        }
        // A straight piece of the outline: its two ends have the same normal.
        let span = to.x - from.x;
        let share = if span > 0.0 { (y - from.x) / span } else { 0.0 };
        Some(from.y + (to.y - from.y) * share)
    }

    /// The same outline in the frame with this origin, its y axis turned by `turn` (rad) from y
    /// toward z.
    #[must_use]
    pub fn seen_from(&self, origin: Point2<f64>, turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let into = |v: Vector2<f64>| Vector2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x);
        Self { tip: Point2::from(into(self.tip - origin)), axis: into(self.axis), ..*self }
    }

    /// The outline seen from the other side, with left and right exchanged: that of a pass cut in
    /// the opposite direction, in the frame of this one.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let (mut tip, mut axis) = (self.tip, self.axis);
        (tip.x, axis.x) = (-tip.x, -axis.x);
        Self { tip, axis, axis_along: -self.axis_along, ..*self }
    }

    /// y and z of the tool tip, mm.
    pub fn tip(&self) -> Point2<f64> {
        self.tip
    }

    /// Unit vector along the tool axis, from the tip to the spindle: along the feed, to its left,
    /// along the normal.
    pub fn axis(&self) -> Vector3<f64> {
        Vector3::new(self.axis_along, self.axis.x, self.axis.y)
    }

    /// The cutter it is the outline of.
    pub fn cutter(&self) -> &Cutter {
        &self.cutter
    }
}

#[cfg(test)]
#[path = "../tests/unit/outline.rs"]
mod tests;
