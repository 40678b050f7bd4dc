use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::Posture;
use nalgebra::{Point2, Vector2, Vector3};

use crate::contact::canonical;
use crate::cutter::Cutter;

/// Outline of a tilted cutter seen along the feed: what a straight pass leaves of the stock.
///
/// It lies in the section plane across the feed: y to the left of the feed (N × Et), z along N, origin at the CC point,
/// mm. The region it bounds is convex: the bottom rim (circle of radius R − r about a point r above the tip) is seen as
/// an ellipse, the corner offsets it by r, and the flute sweeps it along the tool axis up to the upper rim (radius R).
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
    /// The outline of a cutter that touches the CC point in this posture, as [`cl_from_cc`](crate::contact::cl_from_cc) puts it.
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

    /// The point of the outline whose outward normal is (sin φ, −cos φ): φ = 0 is the lowest point, the contact; −π/2
    /// and π/2 are the ends to the right and left. Closed form (support function of the ellipse, offset by r).
    ///
    /// Where a straight piece has that normal, it is one point of that piece: its middle where the bottom is seen edge
    /// on.
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
        // The normal's part across the axis is n − (a·n)·a, here without its cancellation at small tilts.
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
    /// Accurate to 1e-12·R: it is the exact height at some y′ with |y′ − y| ≤ 1e-12·R. That says little only where the
    /// outline is vertical (the cylinder's wall at small lean, the ends of the extent).
    pub fn height_at(&self, y: f64) -> Option<f64> {
        let (mut low, mut high) = (-FRAC_PI_2, FRAC_PI_2);
        let (mut from, mut to) = (self.point_at(low), self.point_at(high));
        if !(from.x <= y && y <= to.x) {
            return None;
        }
        // y grows with the normal's angle: Newton within a bracket, which is halved instead where Newton's step leaves it or
        // does not come at least twice as near as the last.
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

    /// The same outline in the frame with this origin, its y axis turned by `turn` (rad) from y toward z.
    #[must_use]
    pub fn seen_from(&self, origin: Point2<f64>, turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let into = |v: Vector2<f64>| Vector2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x);
        Self { tip: Point2::from(into(self.tip - origin)), axis: into(self.axis), ..*self }
    }

    /// The outline seen from the other side, with left and right exchanged: that of a pass cut in the opposite
    /// direction, in the frame of this one.
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

    /// Unit vector along the tool axis, from the tip to the spindle: along the feed, to its left, along the normal.
    pub fn axis(&self) -> Vector3<f64> {
        Vector3::new(self.axis_along, self.axis.x, self.axis.y)
    }

    /// The cutter it is the outline of.
    pub fn cutter(&self) -> &Cutter {
        &self.cutter
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cl_from_cc;
    use crate::silhouette::{SilhouetteCurvature, silhouette_curvature};
    use facemill_cl_data::CcPoint;
    use nalgebra::Point3;

    const CUTTERS: [(f64, f64, f64); 4] = [(25.0, 2.0, 50.0), (80.0, 6.0, 6.0), (10.0, 0.0, 5.0), (8.0, 8.0, 12.0)];
    const TILTS: [f64; 6] = [0.0, 1e-7, 0.01, 0.05, 0.26, 1.0];
    const ROTATES: [f64; 7] = [0.0, -0.3, -1.0, -1.4835, 0.7, 2.0, std::f64::consts::PI];

    fn cases() -> impl Iterator<Item = (Cutter, Posture)> {
        CUTTERS.into_iter().flat_map(|(radius, corner, flute)| {
            let cutter = Cutter::new(radius, corner, flute).unwrap();
            TILTS
                .into_iter()
                .flat_map(move |tilt| ROTATES.into_iter().map(move |rotate| (cutter, Posture { tilt, rotate })))
        })
    }

    /// Points of the cutter's surface for the contact in the origin, N = z.
    fn surface_points(cutter: &Cutter, posture: Posture, feed: Vector3<f64>, n: u32) -> Vec<Point3<f64>> {
        let cc = CcPoint::new(Point3::origin(), Vector3::z(), feed).unwrap();
        let cl = cl_from_cc(cutter, &cc, posture);
        let u = cl.axis.cross(&Vector3::new(0.3, 0.9, 0.2)).normalize();
        let v = cl.axis.cross(&u);
        let mut points = Vec::new();
        for i in 0..n {
            let (sin, cos) = (f64::from(i) / f64::from(n) * std::f64::consts::TAU).sin_cos();
            let out = u * cos + v * sin;
            for k in 0..=n / 8 {
                let (s, c) = (f64::from(k) / f64::from(n / 8) * FRAC_PI_2).sin_cos();
                let r = cutter.corner_radius();
                let (radial, z) = (cutter.rim_radius() + r * s, r - r * c);
                points.push(cl.tip + out * radial + cl.axis.into_inner() * z);
            }
            points.push(cl.tip + out * cutter.radius() + cl.axis.into_inner() * cutter.flute_length());
        }
        points
    }

    #[test]
    fn outline_is_the_hull_of_the_sampled_cutter() {
        for (cutter, posture) in cases() {
            let outline = Outline::new(&cutter, posture);
            let points = surface_points(&cutter, posture, Vector3::x(), 480);
            // Nothing is below the outline, and in every direction of the lower half something comes near it.
            for p in points.iter().step_by(7) {
                if let Some(z) = outline.height_at(p.y) {
                    let vertical = p.y - outline.extent().0 < 1e-6 || outline.extent().1 - p.y < 1e-6;
                    assert!(vertical || p.z >= z - 1e-9, "{cutter:?} {posture:?}: {p} is below {z}");
                } else {
                    let (low, high) = outline.extent();
                    assert!((low - p.y).max(p.y - high) < 1e-9, "{cutter:?} {posture:?}: {p} outside");
                }
            }
            for k in -30..=30 {
                let phi = f64::from(k) / 30.0 * FRAC_PI_2;
                let (sin, cos) = phi.sin_cos();
                let reach = points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max);
                let q = outline.point_at(phi);
                let exact = q.x * sin - q.y * cos;
                // Chord error of the sampling: R·(1 − cos(π/480)) and r·(1 − cos(π/240)).
                assert!(reach <= exact + 1e-9, "{cutter:?} {posture:?} {phi}: {reach} beyond {exact}");
                assert!(reach >= exact - 1e-4 * cutter.radius(), "{cutter:?} {posture:?} {phi}: {reach} of {exact}");
            }
        }
    }

    #[test]
    fn tip_and_axis_are_those_of_the_cl_point() {
        for (cutter, posture) in cases() {
            let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
            let (cl, outline) = (cl_from_cc(&cutter, &cc, posture), Outline::new(&cutter, posture));
            assert!((outline.axis() - cl.axis.into_inner()).norm() < 1e-14, "{cutter:?} {posture:?}");
            let apart = (outline.tip().x - cl.tip.y).abs().max((outline.tip().y - cl.tip.z).abs());
            assert!(apart < 1e-12 * cutter.radius(), "{cutter:?} {posture:?}: {apart}");
        }
    }

    #[test]
    fn height_at_inverts_the_parametric_form() {
        for (cutter, posture) in cases() {
            let outline = Outline::new(&cutter, posture);
            for k in -299..300 {
                let phi = f64::from(k) / 300.0 * FRAC_PI_2;
                let p = outline.point_at(phi);
                let z = outline.height_at(p.x).unwrap();
                // By convexity the height lies on or above the tangent, and not above a point of the outline.
                let slack = 1e-11 * cutter.radius() * (1.0 + phi.tan().abs());
                assert!((z - p.y).abs() <= slack, "{cutter:?} {posture:?} {phi}: {z} for {}", p.y);
            }
            let (low, high) = outline.extent();
            assert_eq!(outline.height_at(low - 1e-6), None);
            assert_eq!(outline.height_at(high + 1e-6), None);
            assert_eq!(outline.height_at(f64::NAN), None);
        }
    }

    #[test]
    fn outline_touches_the_contact_from_above() {
        for (cutter, posture) in cases() {
            let outline = Outline::new(&cutter, posture);
            let (low, high) = outline.extent();
            let at_contact = outline.height_at(0.0).unwrap_or(0.0);
            assert!(at_contact.abs() < 1e-9, "{cutter:?} {posture:?}: {at_contact}");
            for k in 0..=100 {
                let y = low + (high - low) * f64::from(k) / 100.0;
                assert!(outline.height_at(y).is_none_or(|z| z >= -1e-11 * cutter.radius()));
            }
        }
    }

    #[test]
    fn curvature_at_the_contact_is_the_silhouette_curvature() {
        let mut n_round = 0;
        for (cutter, posture) in cases() {
            let SilhouetteCurvature::Round(k) = silhouette_curvature(&cutter, posture) else { continue };
            let outline = Outline::new(&cutter, posture);
            // Divided difference of the turn of the normal over the arc length, from the parametric form alone.
            let h = 1e-5 * posture.tilt.min(1.0) + 1e-9 * f64::from(u8::from(posture.tilt == 0.0));
            let arc = (outline.point_at(h) - outline.point_at(-h)).norm();
            let measured = 2.0 * h / arc;
            if arc > 1e-7 {
                assert!((measured / k - 1.0).abs() < 1e-4, "{cutter:?} {posture:?}: {measured} for {k}");
                n_round += 1;
            }
        }
        assert!(n_round > 50, "{n_round}");
    }

    #[test]
    fn curvature_is_that_of_a_sampled_silhouette() {
        // Independent of the outline: radius of curvature h + h'' of the samples' support function h seen along the
        // feed.
        let cutter = Cutter::new(25.0, 2.0, 20.0).unwrap();
        for (tilt, rotate) in [(0.05, 0.0), (0.1, -0.5), (0.2, -1.2)] {
            let posture = Posture { tilt, rotate };
            let points = surface_points(&cutter, posture, Vector3::x(), 6000);
            let support = |phi: f64| {
                let (sin, cos) = phi.sin_cos();
                points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max)
            };
            let step = 0.1 * tilt;
            let radius = support(0.0) + (support(step) + support(-step) - 2.0 * support(0.0)) / (step * step);
            let exact = silhouette_curvature(&cutter, posture).radius();
            // The second difference is off by its step squared, the samples by less.
            assert!((radius / exact - 1.0).abs() < 0.03, "{posture:?}: {radius} for {exact}");
        }
    }

    #[test]
    fn degenerate_curvatures_are_named() {
        let at = |radius: f64, corner: f64, tilt: f64, rotate: f64| {
            silhouette_curvature(&Cutter::new(radius, corner, 20.0).unwrap(), Posture { tilt, rotate })
        };
        assert_eq!(at(10.0, 2.0, 0.0, 0.0), SilhouetteCurvature::Flat);
        assert_eq!(at(10.0, 0.0, 0.1, -FRAC_PI_2), SilhouetteCurvature::Sharp);
        assert_eq!(at(10.0, 10.0, 0.0, 0.0), SilhouetteCurvature::Round(0.1));
        let SilhouetteCurvature::Round(k) = at(10.0, 0.0, 0.1, 0.0) else { panic!() };
        assert!((k - 0.1f64.sin() / 10.0).abs() < 1e-15);
        let SilhouetteCurvature::Round(k) = at(10.0, 2.0, 0.1, -FRAC_PI_2) else { panic!() };
        assert!((k - 0.5).abs() < 1e-15);
    }

    #[test]
    fn turned_frame_sees_the_same_outline() {
        for (cutter, posture) in cases().step_by(5) {
            let outline = Outline::new(&cutter, posture);
            let (origin, turn) = (Point2::new(0.7, -0.2), 0.05);
            let seen = outline.seen_from(origin, turn);
            let (sin, cos) = turn.sin_cos();
            for k in -20..=20 {
                let phi = f64::from(k) / 20.0;
                let p = outline.point_at(phi) - origin;
                let q = seen.point_at(phi - turn);
                let edge_on = outline.axis_along == 0.0;
                let moved = Point2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x);
                assert!(edge_on || (moved - q).norm() < 1e-6, "{cutter:?} {posture:?} {phi}: {moved} {q}");
            }
        }
    }

    #[test]
    fn opposite_feed_shows_the_mirrored_outline() {
        for (cutter, posture) in cases().filter(|(_, p)| p.tilt >= 0.01) {
            let outline = Outline::new(&cutter, posture).mirrored();
            let points = surface_points(&cutter, posture, -Vector3::x(), 240);
            for k in -10..=10 {
                let (sin, cos) = (0.15 * f64::from(k)).sin_cos();
                let reach = points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max);
                let q = outline.point_at(0.15 * f64::from(k));
                let missed = q.x * sin - q.y * cos - reach;
                assert!(missed > -1e-9 && missed < 4e-4 * cutter.radius(), "{cutter:?} {posture:?} {k}: {missed}");
            }
            assert_eq!(outline.mirrored(), Outline::new(&cutter, posture));
        }
    }
}
