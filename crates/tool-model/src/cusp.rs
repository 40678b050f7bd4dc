//! Ridge that two neighbouring passes leave between them.

use nalgebra::Point2;

use crate::feed_curvature::FeedCurvature;
use crate::outline::Outline;

/// Ridge that two neighbouring passes leave between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cusp {
    /// Height of the ridge above the surface along its normal, mm, at least 0.
    Height(f64),
    /// The outlines do not meet over the surface between the passes: a strip is not cut at all.
    Uncut,
}

impl Cusp {
    /// Whether the ridge is at most `limit` high, mm.
    pub fn is_within(&self, limit: f64) -> bool {
        matches!(self, Self::Height(h) if *h <= limit)
    }
}

/// Height of the ridge between a pass and its neighbour to the left, from their exact outlines.
///
/// `step` is the arc length (mm) on the surface's section across the feed, a circle (a line where
/// the curvature across the feed is 0), from the CC point of `right` to that of `left`. Both
/// outlines are in their own CC point's frame with the same feed direction; a pass cut in the
/// opposite one is [`mirrored`](Outline::mirrored).
///
/// Both cutters keep contact with a surface of this curvature along the whole feed, and leave what
/// is in [`Outline::swept_height_at`]. On a cylinder at any angle to the feed the ridge is within 1
/// % of the true one up to steps of half a radius; on a straight feed it is exact. The ridge is
/// highest where the height to which `right` clears the surface, which grows to the left, meets
/// that of `left`, which falls. That place is found to 1e-9 mm for outlines that do so, which all
/// do that do not gouge the surface; a pass that gouges it there counts as height 0. A step of 0
/// gives 0; a step that is not a finite length ≥ 0, or that spans more than half of the circle, is
/// [`Cusp::Uncut`].
pub fn cusp_height_between(right: &Outline, left: &Outline, step: f64, surface: &FeedCurvature) -> Cusp {
    let spanned = step * surface.across.abs();
    if !(step >= 0.0 && step.is_finite() && spanned <= std::f64::consts::PI) {
        return Cusp::Uncut;
    }
    let section = CircularSection { right, left, step, surface: *surface };
    let ridge = section.crossing();
    if ridge.is_finite() { Cusp::Height(ridge.max(0.0)) } else { Cusp::Uncut }
}

/// Largest step-over at most `max_step` (mm) whose ridge is at most `cusp` high, to 1e-6 of
/// `max_step`, never above it.
///
/// Same outlines and frame as [`cusp_height_between`]; the ridge is taken to grow with the step, as
/// it does for outlines that do not gouge. A cusp of 0 or less gives 0, unless the outlines are
/// flat.
pub fn step_over_for_cusp(right: &Outline, left: &Outline, cusp: f64, surface: &FeedCurvature, max_step: f64) -> f64 {
    let fits = |step: f64| cusp_height_between(right, left, step, surface).is_within(cusp);
    if fits(max_step) {
        return max_step;
    }
    let (mut low, mut high) = (0.0, max_step);
    // 2^-20 of max_step is below the stated 1e-6 of it.
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Two outlines over a circular section of the surface.
struct CircularSection<'a> {
    right: &'a Outline,
    left: &'a Outline,
    step: f64,
    surface: FeedCurvature,
}

impl CircularSection<'_> {
    /// Height of `outline` over the surface at arc length `s` from the outline's own CC point;
    /// infinite where it does not reach.
    fn height(&self, outline: &Outline, s: f64) -> f64 {
        let turn = self.surface.across * s;
        // Point of the circle by sinc forms, which have no pole at curvature 0.
        let half = 0.5 * turn;
        let chord = if half.abs() < 1e-9 { s } else { s * half.sin() / half };
        let foot = Point2::new(chord * half.cos(), -chord * half.sin());
        outline.seen_from(foot, -turn).swept_height_at(0.0, s, &self.surface).unwrap_or(f64::INFINITY)
    }

    /// Heights of both outlines at arc length `s` from the right one.
    fn heights(&self, s: f64) -> (f64, f64) {
        (self.height(self.right, s), self.height(self.left, s - self.step))
    }

    /// Height at which the rising outline of `right` meets the falling one of `left`.
    fn crossing(&self) -> f64 {
        let (mut low, mut high) = (0.0, self.step);
        let difference = |(a, b): (f64, f64)| if a == b { 0.0 } else { a - b };
        let (at_low, at_high) = (self.heights(low), self.heights(high));
        let (mut g_low, mut g_high) = (difference(at_low), difference(at_high));
        let mut best = at_low.0.min(at_low.1).max(at_high.0.min(at_high.1));
        if !(g_low < 0.0 && g_high > 0.0) {
            return best;
        }
        // Regula falsi that gives an end half its weight when it stays (Illinois), every third step
        // a bisection, so that the bracket shrinks whatever the outlines' shape.
        let mut went_up = None;
        for k in 0..200 {
            let secant = low - g_low * (high - low) / (g_high - g_low);
            let s = if k % 3 < 2 && low < secant && secant < high { secant } else { 0.5 * (low + high) };
            if s <= low || s >= high {
                break;
            }
            let at = self.heights(s);
            best = best.max(at.0.min(at.1));
            let g = difference(at);
            if g.abs() <= 1e-10 {
                break;
            }
            let up = g < 0.0;
            let stays = went_up == Some(up);
            if up {
                (low, g_low) = (s, g);
                g_high *= if stays { 0.5 } else { 1.0 };
            } else {
                (high, g_high) = (s, g);
                g_low *= if stays { 0.5 } else { 1.0 };
            }
            went_up = Some(up);
        }
        best
    }
}

#[cfg(test)]
#[path = "../tests/unit/cusp.rs"]
mod tests;
