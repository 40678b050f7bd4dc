//! Largest chip thickness: closed forms, and dense sums over the cutting surface with independent
//! vectors.

use facemill_chip_area::{
    Beside, CutterEnd, CutterPose, Engagement, NeighbourAxis, Orientation, PassSection, SectionSurface, chip_of_pass,
    largest_thickness,
};
use nalgebra::{Unit, Vector3};

use crate::kit::Random;

const ACCURACY: f64 = 1e-3;
const FLUTE: f64 = 30.0;

fn upright(radius: f64, corner_radius: f64) -> CutterPose {
    let cutter = CutterEnd { radius, corner_radius };
    CutterPose { cutter, flute_length: FLUTE, axis: [0.0, 0.0, 1.0], tip: [0.0, 0.0] }
}

/// A cutter that touches the plane z = 0 in the origin: CLOPT (2), feed along x.
fn touching(cutter: CutterEnd, lead: f64, lean: f64) -> CutterPose {
    let a = Vector3::new(lead.tan(), lean.tan(), 1.0).normalize();
    let n = Vector3::z();
    let down = a.cross(&n).cross(&a);
    let toward = if down.norm() > 1e-12 { down.normalize() } else { Vector3::zeros() };
    // The middle of the rim is at r·N + ρ·d; d lies across the axis, on the side to which N leans.
    let middle = n * cutter.corner_radius + toward * (cutter.radius - cutter.corner_radius);
    let tip = middle - a * cutter.corner_radius;
    CutterPose { cutter, flute_length: FLUTE, axis: a.into(), tip: [tip.y, tip.z] }
}

fn assert_is(found: f64, exact: f64, what: &str) {
    assert!(found >= exact - 1e-12 && found <= exact + ACCURACY, "{what}: {found} for {exact}");
}

#[test]
fn a_flat_end_in_a_full_slot_takes_the_whole_feed_per_tooth() {
    assert_is(largest_thickness(&upright(20.0, 0.0), |_| 3.0, ACCURACY), 1.0, "slot");
}

#[test]
fn radial_engagement_thins_the_chip_of_a_flat_end() {
    let radius = 20.0;
    for part in [0.01, 0.1, 0.25, 0.5, 0.9, 1.0] {
        // Stock from the left side of the cutter to its engagement.
        let edge = radius * (1.0 - part);
        let highest = |[_, to]: [f64; 2]| if to >= edge { 3.0 } else { f64::NEG_INFINITY };
        let exact = (1.0f64 - (1.0 - part).powi(2)).sqrt();
        assert_is(largest_thickness(&upright(radius, 0.0), highest, ACCURACY), exact, &format!("ae/R = {part}"));
    }
}

#[test]
fn a_round_insert_thins_the_chip_by_the_sine_of_its_angle_at_the_top() {
    let corner = 6.0;
    for depth in [1e-3, 0.01, 0.1, 0.5, 2.0, 5.9, 6.0, 9.0] {
        let share: f64 = f64::min(depth / corner, 1.0);
        let exact = (2.0 * share - share * share).sqrt();
        for radius in [6.0, 10.0, 80.0] {
            let found = largest_thickness(&upright(radius, corner), |_| depth, ACCURACY);
            assert_is(found, exact, &format!("R {radius}, depth {depth}"));
        }
    }
}

#[test]
fn nothing_left_has_no_thickness_and_a_leading_bottom_has_that_of_its_lead() {
    let pose = touching(CutterEnd { radius: 20.0, corner_radius: 2.0 }, 0.1, 0.05);
    assert_eq!(largest_thickness(&pose, |_| f64::NEG_INFINITY, ACCURACY), 0.0);
    // The axis leans back, so the bottom meets the stock: with little stock only the bottom does.
    let lead = -0.3f64;
    let pose = touching(CutterEnd { radius: 20.0, corner_radius: 0.0 }, lead, 0.0);
    let found = largest_thickness(&pose, |_| 1e-3, ACCURACY);
    assert!(found >= -lead.sin() - 1e-12, "{found}");
}

#[test]
fn more_stock_is_not_thinner() {
    let mut random = Random(11);
    for _ in 0..60 {
        let radius = random.between(3.0, 60.0);
        let cutter = CutterEnd { radius, corner_radius: radius * random.unit() };
        let pose = touching(cutter, random.between(-0.4, 0.6), random.between(-0.6, 0.6));
        let mut last = 0.0;
        for depth in [0.0, 0.01, 0.3, 1.0, 4.0, 20.0] {
            let found = largest_thickness(&pose, |_| depth, ACCURACY);
            assert!(found >= last - ACCURACY && found <= 1.0 + ACCURACY, "{pose:?}: {last}, then {found}");
            last = found;
        }
    }
}

/// A small part of the cutting surface: z, normal along the feed, area.
struct Patch {
    z: f64,
    along_feed: f64,
    area: f64,
}

/// Corner, flute and bottom as small parts, by vectors in space.
fn patches(pose: &CutterPose, n: u32) -> Vec<Patch> {
    let CutterEnd { radius, corner_radius: r } = pose.cutter;
    let a = Unit::new_normalize(Vector3::from(pose.axis));
    let u = Unit::new_normalize(a.cross(&Vector3::new(0.31, -0.77, 0.45)));
    let v = a.cross(&u);
    let tip = Vector3::new(0.0, pose.tip[0], pose.tip[1]);
    let rim = radius - r;
    let mut all = Vec::new();
    let mut add = |p: Vector3<f64>, normal: Vector3<f64>, area: f64| {
        all.push(Patch { z: p.z, along_feed: normal.x, area });
    };
    let turn = std::f64::consts::TAU / f64::from(n);
    let (rows, flute_rows) = (n / 4, n / 2);
    for i in 0..n {
        let e = (f64::from(i) + 0.5) * turn;
        let e = u.into_inner() * e.cos() + v * e.sin();
        for k in 0..rows {
            let step = std::f64::consts::FRAC_PI_2 / f64::from(rows);
            let theta = (f64::from(k) + 0.5) * step;
            let normal = e * theta.sin() - a.into_inner() * theta.cos();
            let out = rim + r * theta.sin();
            let p = tip + a.into_inner() * r + e * rim + normal * r;
            if r > 0.0 {
                add(p, normal, out * turn * r * step);
            }
            // The bottom in rings.
            let ring = rim / f64::from(rows);
            let at = (f64::from(k) + 0.5) * ring;
            add(tip + e * at, -a.into_inner(), at * turn * ring);
        }
        let step = (pose.flute_length - r) / f64::from(flute_rows);
        for k in 0..flute_rows {
            let h = r + (f64::from(k) + 0.5) * step;
            add(tip + a.into_inner() * h + e * radius, e, radius * turn * step);
        }
    }
    all
}

#[test]
fn the_engaged_surface_seen_along_the_feed_is_the_chip_and_nothing_of_it_is_steeper() {
    let mut random = Random(7);
    let mut n = 0;
    for case in 0..40 {
        let radius = random.between(4.0, 60.0);
        let corner_radius = if case % 4 == 0 { 0.0 } else { radius * random.between(0.05, 1.0) };
        let cutter = CutterEnd { radius, corner_radius };
        let (lead, lean) = (random.between(-0.3, 0.5), random.between(-0.5, 0.5));
        let depth = random.between(0.02, 0.4) * radius.min(20.0);
        let engagement = Engagement { depth_of_cut: depth, left: Beside::Stock, right: Beside::Stock };
        let section = PassSection {
            cutter,
            surface: SectionSurface::Plane,
            engagement,
            orientation: Orientation { lead, lean },
            neighbour_axis: NeighbourAxis::Parallel,
        };
        let exact = chip_of_pass(&section).unwrap().area;
        let pose = touching(cutter, lead, lean);
        let found = largest_thickness(&pose, |_| depth, ACCURACY);
        let all = patches(&pose, 900);
        // There is nothing below the surface; where the flute is long enough it leaves the stock.
        let engaged = all.iter().filter(|p| p.along_feed > 0.0 && p.z <= depth);
        let (mut area, mut steepest) = (0.0, 0.0);
        for p in engaged {
            area += p.area * p.along_feed;
            steepest = f64::max(steepest, p.along_feed);
        }
        assert!((area - exact).abs() < 0.02 * exact, "{section:?}: {area} mm² for {exact}");
        assert!(found >= steepest - 1e-12, "{section:?}: {found}, but {steepest}");
        // The parts are some hundredths of the corner large.
        let coarse = if corner_radius > 0.0 { 0.03 } else { 0.01 };
        assert!(found <= steepest + ACCURACY + coarse, "{section:?}: {found} for {steepest}");
        n += 1;
    }
    assert_eq!(n, 40);
}

#[test]
fn beside_a_ball_s_pass_the_thickest_place_is_where_the_stock_is_highest_or_foremost() {
    let (radius, depth) = (6.0f64, 2.0f64);
    for step in [0.2, 1.0, 3.0, 6.0] {
        // The pass before was on the left: above its half circle nothing is left.
        let below = |y: f64| {
            let off = y - step;
            if off.abs() < radius { radius - (radius * radius - off * off).sqrt() } else { f64::INFINITY }
        };
        let highest = |[from, to]: [f64; 2]| depth.min(below(from).max(below(to)));
        let pose = upright(radius, radius);
        let found = largest_thickness(&pose, highest, ACCURACY);
        // The normal's part along the feed at y and z on the front of the ball.
        let along = |y: f64, z: f64| (1.0 - (y * y + (z - radius).powi(2)) / (radius * radius)).max(0.0).sqrt();
        let mut steepest = 0.0;
        for k in -60_000..=60_000 {
            let y = radius * f64::from(k) / 60_000.0;
            let z = depth.min(below(y));
            if z >= radius - (radius * radius - y * y).sqrt() {
                steepest = f64::max(steepest, along(y, z));
            }
        }
        assert!(found >= steepest - 1e-9 && found <= steepest + ACCURACY, "step {step}: {found} for {steepest}");
    }
}
