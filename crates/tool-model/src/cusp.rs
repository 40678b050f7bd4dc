use nalgebra::Point2;

use crate::outline::Outline;

/// What two neighbouring passes leave standing between them.
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
/// `step` is the arc length (mm) on the surface's section across the feed, a circle of curvature `surface_curvature`
/// (1/mm, positive where the part is convex, 0 for a plane), from the CC point of `right` to that of `left`. Both
/// outlines are in their own CC point's frame with the same feed direction; a pass cut in the opposite one is
/// [`mirrored`](Outline::mirrored).
///
/// The ridge is highest where the height to which `right` clears the surface, which grows to the left, meets that of
/// `left`, which falls. Its height is exact to 1e-9 mm for outlines that do so, which all do that do not gouge the
/// circle; a pass that gouges it there counts as height 0. A step of 0 gives 0; a step that is not a finite length ≥ 0,
/// or that spans more than half of the circle, is [`Cusp::Uncut`].
pub fn cusp_height_between(right: &Outline, left: &Outline, step: f64, surface_curvature: f64) -> Cusp {
    let spanned = step * surface_curvature.abs();
    if !(step >= 0.0 && step.is_finite() && spanned <= std::f64::consts::PI) {
        return Cusp::Uncut;
    }
    let section = Section { right, left, step, curvature: surface_curvature };
    let ridge = section.crossing();
    if ridge.is_finite() { Cusp::Height(ridge.max(0.0)) } else { Cusp::Uncut }
}

/// Largest step-over at most `max_step` (mm) whose ridge is at most `cusp` high, to 1e-6 of `max_step`, never above it.
///
/// Same outlines and frame as [`cusp_height_between`]; the ridge is taken to grow with the step, as it does for
/// outlines that do not gouge. A cusp of 0 or less gives 0, unless the outlines are flat.
pub fn step_over_for_cusp(right: &Outline, left: &Outline, cusp: f64, surface_curvature: f64, max_step: f64) -> f64 {
    let fits = |step: f64| cusp_height_between(right, left, step, surface_curvature).is_within(cusp);
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
struct Section<'a> {
    right: &'a Outline,
    left: &'a Outline,
    step: f64,
    curvature: f64,
}

impl Section<'_> {
    /// Height of `outline` over the surface at arc length `s` from the outline's own CC point; infinite where it does
    /// not reach.
    fn height(&self, outline: &Outline, s: f64) -> f64 {
        let turn = self.curvature * s;
        // Point of the circle by sinc forms, which have no pole at curvature 0.
        let half = 0.5 * turn;
        let chord = if half.abs() < 1e-9 { s } else { s * half.sin() / half };
        let foot = Point2::new(chord * half.cos(), -chord * half.sin());
        outline.seen_from(foot, -turn).height_at(0.0).unwrap_or(f64::INFINITY)
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
        // Regula falsi that gives an end half its weight when it stays (Illinois), every third step a bisection, so that the
        // bracket shrinks whatever the outlines' shape.
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
mod tests {
    use super::*;
    use crate::cutter::Cutter;
    use facemill_cl_data::Posture;

    fn outline(radius: f64, corner: f64, tilt_deg: f64, rotate_deg: f64) -> Outline {
        let posture = Posture { tilt: f64::to_radians(tilt_deg), rotate: f64::to_radians(rotate_deg) };
        Outline::new(&Cutter::new(radius, corner, 40.0f64.max(radius)).unwrap(), posture)
    }

    fn height(cusp: Cusp) -> f64 {
        match cusp {
            Cusp::Height(h) => h,
            Cusp::Uncut => panic!("uncut"),
        }
    }

    #[test]
    fn ball_cusp_on_plane_and_cylinders_is_the_closed_form() {
        let ball = outline(10.0, 10.0, 7.0, 20.0);
        for step in [0.1, 1.0, 6.0, 15.0] {
            let plane = 10.0 - (100.0f64 - 0.25 * step * step).sqrt();
            assert!((height(cusp_height_between(&ball, &ball, step, 0.0)) - plane).abs() < 1e-9);
            for radius in [30.0, -60.0, 1e7] {
                // Ball centres on the circle of radius rho + 10 about the section's centre, at half the angle each.
                let (angle, centre) = (0.5 * step / radius, radius + 10.0);
                let across = centre * f64::sin(angle);
                let expected = centre * f64::cos(angle) - (100.0 - across * across).sqrt() - radius;
                let cusp = height(cusp_height_between(&ball, &ball, step, 1.0 / radius));
                // The closed form itself loses digits on the huge radius.
                let slack = 1e-9 + 1e-15 * f64::abs(radius);
                assert!((cusp - expected).abs() < slack, "{radius} {step}: {cusp} for {expected}");
            }
        }
    }

    #[test]
    fn sharp_face_mill_cuts_the_ellipse_its_rim_is_seen_as() {
        let mill = outline(80.0, 0.0, 3.0, 0.0);
        for step in [1.0, 20.0, 40.0, 100.0] {
            let expected = 80.0 * 3f64.to_radians().sin() * (1.0 - (1.0 - (step / 160.0f64).powi(2)).sqrt());
            let cusp = height(cusp_height_between(&mill, &mill, step, 0.0));
            assert!((cusp - expected).abs() < 1e-9, "{step}: {cusp} for {expected}");
        }
    }

    /// Highest point above the plane or circle that neither outline clears, by dense sampling.
    fn sampled_ridge(a: &Outline, b: &Outline, step: f64, curvature: f64) -> f64 {
        let section = Section { right: a, left: b, step, curvature };
        let n = 20_000;
        (0..=n).map(|k| section.heights(step * f64::from(k) / f64::from(n))).map(|(p, q)| p.min(q)).fold(0.0, f64::max)
    }

    #[test]
    fn ridge_is_the_highest_uncleared_point_of_a_dense_sampling() {
        let (a, b) = (outline(25.0, 2.0, 2.0, 0.0), outline(25.0, 2.0, 9.0, -40.0));
        let c = outline(25.0, 0.0, 5.0, 89.9);
        for (p, q) in [(&a, &b), (&b, &a), (&a, &a), (&c, &a), (&a, &c.mirrored()), (&c, &c)] {
            for (step, curvature) in [(3.0, 0.0), (12.0, 0.002), (20.0, -0.001)] {
                let exact = cusp_height_between(p, q, step, curvature);
                let sampled = sampled_ridge(p, q, step, curvature);
                if let Cusp::Height(h) = exact {
                    assert!(h >= sampled - 1e-9, "{step} {curvature}: {h} below {sampled}");
                    assert!(h <= sampled + 0.01 * step, "{step} {curvature}: {h} above {sampled}");
                } else {
                    assert!(sampled.is_infinite());
                }
            }
        }
    }

    #[test]
    fn passes_too_far_apart_leave_a_strip() {
        let mill = outline(25.0, 2.0, 2.0, 0.0);
        assert_eq!(cusp_height_between(&mill, &mill, 51.0, 0.0), Cusp::Uncut);
        assert_eq!(cusp_height_between(&mill, &mill, f64::NAN, 0.0), Cusp::Uncut);
        assert_eq!(cusp_height_between(&mill, &mill, -1.0, 0.0), Cusp::Uncut);
        assert_eq!(height(cusp_height_between(&mill, &mill, 0.0, 0.0)), 0.0);
    }

    #[test]
    fn untilted_mill_leaves_no_ridge_on_a_plane() {
        let flat = outline(25.0, 2.0, 0.0, 0.0);
        assert!(height(cusp_height_between(&flat, &flat, 30.0, 0.0)) < 1e-12);
    }

    #[test]
    fn step_over_meets_its_cusp() {
        let mill = outline(80.0, 6.0, 2.0, 0.0);
        let step = step_over_for_cusp(&mill, &mill, 0.1, 0.0005, 120.0);
        assert!(step > 10.0 && step < 120.0);
        assert!(cusp_height_between(&mill, &mill, step, 0.0005).is_within(0.1));
        assert!(!cusp_height_between(&mill, &mill, step + 2e-4, 0.0005).is_within(0.1));
        assert_eq!(step_over_for_cusp(&mill, &mill, 0.1, 0.0, 5.0), 5.0);
    }
}
