//! Outline of a cutter across the feed.

use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::Posture;
use nalgebra::{Point2, Vector2, Vector3};

use crate::contact::canonical;
use crate::cutter::Cutter;
use crate::feed_curvature::FeedCurvature;

/// Outline of a tilted cutter seen along the feed: what a straight pass leaves of the stock. For
/// what a pass along a curved surface leaves, see [`swept_height_at`](Self::swept_height_at).
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
    /// Tool tip along the feed.
    tip_along: f64,
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
        let axis_along = sin * turn_cos;
        let tip_along = -rim * cos * turn_cos - r * axis_along;
        Self { cutter: *cutter, tip, tip_along, axis, axis_along }
    }

    /// The point of the outline whose outward normal is (sin φ, −cos φ): φ = 0 is the lowest point,
    /// the contact; −π/2 and π/2 are the ends to the right and left. Closed form (support function
    /// of the ellipse, offset by r).
    ///
    /// Where a straight piece has that normal, it is one point of that piece: its middle where the
    /// bottom is seen edge on.
    pub fn point_at(&self, phi: f64) -> Point2<f64> {
        self.place_of(phi).point
    }

    /// The place of normal φ.
    fn place_of(&self, phi: f64) -> OutlinePlace {
        let (sin, cos) = phi.sin_cos();
        let n = Vector2::new(sin, -cos);
        let along_axis = self.axis.dot(&n);
        let beside_axis = Vector2::new(-self.axis.y, self.axis.x);
        let across_axis = beside_axis.dot(&n);
        // Sine of the angle between the normal and the axis in space.
        let s = self.axis_along.hypot(across_axis);
        // The feed in the directions of the meridian and of the rim there.
        let (along, across) = if s > 0.0 { (self.axis_along / s, across_axis / s) } else { (0.0, 0.0) };
        // The normal's part across the axis is n − (a·n)·a, here without its cancellation at small
        // tilts.
        let m = n * (along * self.axis_along) + beside_axis * across;
        let is_below = along_axis <= 0.0;
        let (height, rim, r) = if is_below {
            (self.cutter.corner_radius(), self.cutter.rim_radius(), self.cutter.corner_radius())
        } else {
            (self.cutter.flute_length(), self.cutter.radius(), 0.0)
        };
        let bulge = if s > 0.0 { along * along / s } else { 0.0 };
        let over_corner = if along == 0.0 { 0.0 } else { along * along / r };
        let around = if rim > 0.0 { across * across * s / (rim + r * s) } else { across * across / r };
        OutlinePlace {
            point: self.tip + self.axis * height + m * rim + n * r,
            radius: rim * bulge + r,
            along: self.tip_along + self.axis_along * height - along * along_axis * rim,
            bend: if rim > 0.0 || s > 0.0 { over_corner + around } else { 1.0 / r },
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
        self.lowest_at(y).map(|lowest| lowest.height)
    }

    /// Lowest z at y of all that the cutter passes over on a surface that is curved along the feed
    /// or twists, mm; `None` outside the outline's extent.
    ///
    /// `arc` is the distance (mm, positive to the left) on the surface from the CC point to the
    /// place below y: on the surface's section across the feed, whose own curvature counts with
    /// whoever measures the height over it. Exact for a straight feed; else to the second order of
    /// the surface and of the cutter's distance from it along the feed.
    ///
    /// The cutter touches its outline a distance x ahead of the section, and the surface there is
    /// ½·along·x² + twist·x·arc lower than across the feed: as much higher is the cutter over the
    /// section when it has gone back by x, except for what it is lower at most a radius before or
    /// after. At the contact this is the curvature det D/D_xx of the envelope over the surface
    /// (docs/method.md, outline along the feed, and cusp). A cutter that the surface bends to more
    /// than it does itself has no such envelope: its straight outline counts.
    pub fn swept_height_at(&self, y: f64, arc: f64, surface: &FeedCurvature) -> Option<f64> {
        let LowestPlace { height, along: x, bend } = self.lowest_at(y)?;
        if surface.along == 0.0 && surface.twist == 0.0 {
            return Some(height);
        }
        let over = bend + surface.along;
        if !(over > 0.0 && x.is_finite()) {
            return Some(height);
        }
        let slope = surface.along * x + surface.twist * arc;
        let further = (-slope / over).clamp(-self.cutter.radius(), self.cutter.radius());
        // An edge does not give way: infinite times nothing.
        let gives_way = if further == 0.0 { 0.0 } else { further * (slope + 0.5 * over * further) };
        Some(height + 0.5 * surface.along * x * x + surface.twist * x * arc + gives_way)
    }

    fn lowest_at(&self, y: f64) -> Option<LowestPlace> {
        let (mut low, mut high) = (-FRAC_PI_2, FRAC_PI_2);
        let (mut from, mut to) = (self.place_of(low), self.place_of(high));
        if !(from.point.x <= y && y <= to.point.x) {
            return None;
        }
        // y grows with the normal's angle: Newton within a bracket, which is halved instead where
        // Newton's step leaves it or does not come at least twice as near as the last.
        let close = 1e-13 * self.cutter.radius();
        let mut phi = 0.5 * (low + high);
        let mut last = f64::INFINITY;
        for _ in 0..200 {
            let p = self.place_of(phi);
            let miss = y - p.point.x;
            if miss.abs() <= close {
                return Some(LowestPlace {
                    height: p.point.y + phi.tan() * miss,
                    along: p.along,
                    bend: p.bend / phi.cos(),
                });
            }
            let newton = phi + miss / (p.radius * phi.cos());
            if miss > 0.0 {
                (low, from) = (phi, p);
            } else {
                (high, to) = (phi, p);
            }
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let nears = miss.abs() <= 0.5 * last;
            last = miss.abs();
            phi = if nears && low < newton && newton < high { newton } else { middle };
        }
        // A straight piece of the outline: its two ends have the same normal.
        let span = to.point.x - from.point.x;
        let share = if span > 0.0 { (y - from.point.x) / span } else { 0.0 };
        let between = |a: f64, b: f64| a + (b - a) * share;
        Some(LowestPlace {
            height: between(from.point.y, to.point.y),
            along: between(from.along, to.along),
            bend: from.bend.min(to.bend) / phi.cos(),
        })
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
        Self { tip, tip_along: -self.tip_along, axis, axis_along: -self.axis_along, ..*self }
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

/// A place of the outline.
struct OutlinePlace {
    point: Point2<f64>,
    /// Radius of curvature of the outline, mm.
    radius: f64,
    /// Distance ahead of the section at which the cutter touches its outline, mm.
    along: f64,
    /// Curvature of the cutter along the feed, 1/mm; infinite at a sharp edge.
    bend: f64,
}

/// The outline at a y.
struct LowestPlace {
    height: f64,
    /// As in [`OutlinePlace`].
    along: f64,
    /// Second derivative of the cutter's height along the feed, 1/mm.
    bend: f64,
}

#[cfg(test)]
#[path = "../tests/unit/outline.rs"]
mod tests;
