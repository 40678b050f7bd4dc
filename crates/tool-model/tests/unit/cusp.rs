use super::*;
use crate::contact::cl_from_cc;
use crate::cutter::Cutter;
use facemill_cl_data::{CcPoint, Posture};
use facemill_test_kit::Random;
use nalgebra::{Point3, Vector3};

const FLAT: FeedCurvature = FeedCurvature::straight(0.0);

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
        assert!((height(cusp_height_between(&ball, &ball, step, &FLAT)) - plane).abs() < 1e-9);
        for radius in [30.0, -60.0, 1e7] {
            // Ball centres on the circle of radius rho + 10 about the section's centre, at half the
            // angle each.
            let (angle, centre) = (0.5 * step / radius, radius + 10.0);
            let across = centre * f64::sin(angle);
            let expected = centre * f64::cos(angle) - (100.0 - across * across).sqrt() - radius;
            let cusp = height(cusp_height_between(&ball, &ball, step, &FeedCurvature::straight(1.0 / radius)));
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
        let cusp = height(cusp_height_between(&mill, &mill, step, &FLAT));
        assert!((cusp - expected).abs() < 1e-9, "{step}: {cusp} for {expected}");
    }
}

/// Highest point above the plane or circle that neither outline clears, by dense sampling.
fn sampled_ridge(a: &Outline, b: &Outline, step: f64, curvature: f64) -> f64 {
    let section = CircularSection { right: a, left: b, step, surface: FeedCurvature::straight(curvature) };
    let n = 20_000;
    (0..=n).map(|k| section.heights(step * f64::from(k) / f64::from(n))).map(|(p, q)| p.min(q)).fold(0.0, f64::max)
}

#[test]
fn ridge_is_the_highest_uncleared_point_of_a_dense_sampling() {
    let (a, b) = (outline(25.0, 2.0, 2.0, 0.0), outline(25.0, 2.0, 9.0, -40.0));
    let c = outline(25.0, 0.0, 5.0, 89.9);
    for (p, q) in [(&a, &b), (&b, &a), (&a, &a), (&c, &a), (&a, &c.mirrored()), (&c, &c)] {
        for (step, curvature) in [(3.0, 0.0), (12.0, 0.002), (20.0, -0.001)] {
            let exact = cusp_height_between(p, q, step, &FeedCurvature::straight(curvature));
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
    assert_eq!(cusp_height_between(&mill, &mill, 51.0, &FLAT), Cusp::Uncut);
    assert_eq!(cusp_height_between(&mill, &mill, f64::NAN, &FLAT), Cusp::Uncut);
    assert_eq!(cusp_height_between(&mill, &mill, -1.0, &FLAT), Cusp::Uncut);
    assert_eq!(height(cusp_height_between(&mill, &mill, 0.0, &FLAT)), 0.0);
}

#[test]
fn untilted_mill_leaves_no_ridge_on_a_plane() {
    let flat = outline(25.0, 2.0, 0.0, 0.0);
    assert!(height(cusp_height_between(&flat, &flat, 30.0, &FLAT)) < 1e-12);
}

#[test]
fn step_over_meets_its_cusp() {
    let mill = outline(80.0, 6.0, 2.0, 0.0);
    let bent = FeedCurvature::straight(0.0005);
    let step = step_over_for_cusp(&mill, &mill, 0.1, &bent, 120.0);
    assert!(step > 10.0 && step < 120.0);
    assert!(cusp_height_between(&mill, &mill, step, &bent).is_within(0.1));
    assert!(!cusp_height_between(&mill, &mill, step + 2e-4, &bent).is_within(0.1));
    assert_eq!(step_over_for_cusp(&mill, &mill, 0.1, &FLAT, 5.0), 5.0);
}

/// A cylinder about the y axis through (0, 0, −radius), concave from outside with a negative
/// radius, along which passes go straight at an angle to its axis.
struct SlantedPasses {
    radius: f64,
    angle: f64,
    cutter: Cutter,
    posture: Posture,
}

impl SlantedPasses {
    /// Place and frame at a way along the feed and aside, both along the surface.
    fn cc(&self, along: f64, aside: f64) -> CcPoint {
        let (sin, cos) = self.angle.sin_cos();
        let (around, way) = (along * sin - aside * cos, along * cos + aside * sin);
        let (s, c) = (around / self.radius).sin_cos();
        let position = Point3::new(self.radius * s, way, self.radius * (c - 1.0));
        let (normal, tangent) = (Vector3::new(s, 0.0, c), Vector3::new(c, 0.0, -s));
        CcPoint::new(position, normal, Vector3::y() * cos + tangent * sin).unwrap()
    }

    /// Curvature in the frame of the feed, by Euler's formula.
    fn surface(&self) -> FeedCurvature {
        let (sin, cos) = self.angle.sin_cos();
        FeedCurvature {
            along: sin * sin / self.radius,
            twist: -sin * cos / self.radius,
            across: cos * cos / self.radius,
        }
    }

    /// Distance of a place from the corner's torus of the cutter, which has a flat bottom, when it
    /// touches the pass `aside` at `along`.
    fn distance(&self, place: &Point3<f64>, along: f64, aside: f64) -> f64 {
        let cl = cl_from_cc(&self.cutter, &self.cc(along, aside), self.posture);
        let from_tip = place - cl.tip;
        let up = from_tip.dot(&cl.axis) - self.cutter.corner_radius();
        let out = (from_tip.norm_squared() - from_tip.dot(&cl.axis).powi(2)).max(0.0).sqrt();
        (out - self.cutter.rim_radius()).max(0.0).hypot(up) - self.cutter.corner_radius().max(1e-9)
    }

    /// Lowest height over the surface at which the cutter on the pass `aside` is at a place `at`
    /// aside: by search over where it touches, and from below for where it begins.
    fn cleared(&self, at: f64, aside: f64) -> f64 {
        let foot = self.cc(0.0, at);
        let entry = |along: f64| {
            let distance =
                |height: f64| self.distance(&(foot.position + foot.normal.into_inner() * height), along, aside);
            // The cutter is convex: nearest at one height, and entered once below it.
            let (mut low, mut high) = (-1.0, self.cutter.radius());
            for _ in 0..45 {
                let (a, b) = (low + 0.45 * (high - low), low + 0.55 * (high - low));
                if distance(a) < distance(b) { high = b } else { low = a }
            }
            if distance(low) > 0.0 {
                return f64::INFINITY;
            }
            let (mut outside, mut inside) = (-1.0, low);
            for _ in 0..30 {
                let middle = 0.5 * (outside + inside);
                if distance(middle) > 0.0 { outside = middle } else { inside = middle }
            }
            inside
        };
        let (mut from, mut to) = (-1.2 * self.cutter.radius(), 1.2 * self.cutter.radius());
        let mut lowest = f64::INFINITY;
        for _ in 0..5 {
            let n = 20;
            let place = |k: i32| from + (to - from) * f64::from(k) / f64::from(n);
            let entries: Vec<f64> = (0..=n).map(|k| entry(place(k))).collect();
            let best = (0..entries.len()).min_by(|&a, &b| entries[a].total_cmp(&entries[b])).unwrap() as i32;
            lowest = entries[best as usize].min(lowest);
            (from, to) = (place(best - 2), place(best + 2));
        }
        lowest
    }

    /// Height of the ridge between two passes.
    fn ridge(&self, step: f64) -> f64 {
        let (mut low, mut high) = (0.0, step);
        for _ in 0..14 {
            let middle = 0.5 * (low + high);
            if self.cleared(middle, 0.0) < self.cleared(middle, step) { low = middle } else { high = middle }
        }
        self.cleared(low, 0.0)
    }
}

#[test]
fn ridge_on_a_cylinder_is_what_the_moving_cutter_leaves_whatever_the_feed() {
    let mut random = Random(7);
    let (mut n, mut straight_errors) = (0, Vec::new());
    while n < 40 {
        let radius = random.between(8.0, 40.0);
        let corner = [0.0, 0.1 * radius, radius * random.unit(), radius][n % 4];
        let cutter = Cutter::new(radius, corner, 2.0 * radius).unwrap();
        let posture = Posture { tilt: random.between(0.03, 0.3), rotate: random.between(-1.3, 1.3) };
        let bend = random.between(120.0, 600.0) * if random.unit() < 0.3 { -1.0 } else { 1.0 };
        let passes = SlantedPasses { radius: bend, angle: random.between(-1.5, 1.5), cutter, posture };
        let surface = passes.surface();
        let curvature = crate::silhouette::envelope_curvature(&cutter, posture, &surface);
        // Not where the cutter hardly fits: then the ridge is a difference of nearly equal bends.
        let step = (8.0 * 0.1 / curvature).sqrt().min(0.5 * radius);
        // Nor where it gouges elsewhere.
        if curvature < 0.002 || [-step, 0.0, step].iter().any(|&at| passes.cleared(at, 0.0) < -1e-6) {
            continue;
        }
        n += 1;
        let outline = Outline::new(&cutter, posture);
        let (found, exact) = (height(cusp_height_between(&outline, &outline, step, &surface)), passes.ridge(step));
        let case = format!("{cutter:?} {posture:?} {bend} {} {step}", passes.angle);
        assert!((found - exact).abs() < 0.01 * exact + 1e-6, "{case}: {found} {exact}");
        let second_order = step * step * curvature / 8.0;
        assert!((second_order - exact).abs() < 0.1 * exact, "{case}: {second_order} {exact}");
        let straight = FeedCurvature::straight(surface.across);
        straight_errors.push((height(cusp_height_between(&outline, &outline, step, &straight)) / exact - 1.0).abs());
    }
    // A prediction that takes the feed as straight is far off in a fourth of these cases.
    straight_errors.sort_by(f64::total_cmp);
    assert!(straight_errors[3 * n / 4] > 0.12, "{straight_errors:?}");
}
