//! Heights that a moving cutter leaves, against closed forms and against dense poses tested by the
//! definition of the solid.

use facemill_cl_data::{ClPoint, Silent};
use facemill_tool_model::Cutter;
use facemill_z_map::{CutterMotion, LeftHeight, SurfacePlace, SweptCutter, left_heights};
use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::kit::Random;

/// Straight passes along x over z = 0, `step` apart in y, with the axis leaning by `tilt` along the
/// feed.
fn passes(step: f64, tilt: f64, lift: f64) -> Vec<CutterMotion> {
    let axis = Unit::new_normalize(Vector3::new(-tilt.sin(), 0.0, tilt.cos()));
    (-4..=4)
        .map(|k| {
            let tip = |x: f64| Point3::new(x, f64::from(k) * step, lift);
            CutterMotion {
                from: ClPoint { tip: tip(-60.0), axis },
                to: ClPoint { tip: tip(60.0), axis },
                id: (k + 10) as u32,
            }
        })
        .collect()
}

fn place(x: f64, y: f64, stock: f64) -> SurfacePlace {
    SurfacePlace { position: Point3::new(x, y, 0.0), normal: Vector3::z_axis(), stock }
}

fn left_on(swept: &SweptCutter, place: &SurfacePlace) -> LeftHeight {
    left_heights(std::slice::from_ref(swept), &[*place], &Silent).expect("a monitor that never cancels")[0]
}

#[test]
fn a_ball_leaves_the_ridges_of_the_closed_form() {
    let cutter = Cutter::new(8.0, 8.0, 20.0).expect("a ball");
    let swept = SweptCutter::new(&cutter, passes(5.0, 0.0, 0.0));
    for k in 0..50 {
        let y = 0.1 * f64::from(k) + 0.03;
        let beside = (y + 2.5).rem_euclid(5.0) - 2.5;
        let closed = 8.0 - (64.0 - beside * beside).sqrt();
        let left = left_on(&swept, &place(1.3, y, 3.0));
        assert!((left.height - closed).abs() < SweptCutter::ACCURACY, "{y}: {} {closed}", left.height);
        assert_eq!(left.cut_by, Some(10 + (y / 5.0).round() as u32));
    }
}

#[test]
fn a_flat_disc_leaves_nothing_under_it_and_all_of_the_stock_beside_it() {
    for corner in [0.0, 1.5] {
        let cutter = Cutter::new(10.0, corner, 20.0).expect("a disc");
        let swept = SweptCutter::new(&cutter, passes(30.0, 0.0, 0.0));
        let under = left_on(&swept, &place(0.0, 8.0, 2.0));
        assert!(under.height.abs() < 1e-9 && under.cut_by == Some(10), "{under:?}");
        let beside = left_on(&swept, &place(0.0, 15.0, 2.0));
        assert!(beside.height == 2.0 && beside.cut_by.is_none(), "{beside:?}");
        let lifted = left_on(&SweptCutter::new(&cutter, passes(30.0, 0.0, 0.25)), &place(0.0, 3.0, 2.0));
        assert!((lifted.height - 0.25).abs() < 1e-6, "{lifted:?}");
    }
}

#[test]
fn a_disc_that_leans_forward_leaves_the_ellipse_of_its_rim() {
    // The rim of a sharp disc, seen along the feed: half axes R and R·sin(tilt), its lowest point
    // on the surface.
    let (radius, tilt) = (20.0, 0.1_f64);
    let cutter = Cutter::new(radius, 0.0, 20.0).expect("a disc");
    let lift = radius * tilt.sin();
    let swept = SweptCutter::new(&cutter, passes(12.0, tilt, lift));
    for k in 0..60 {
        let y = 0.1 * f64::from(k);
        let closed = lift - lift * (1.0 - (y / radius).powi(2)).sqrt();
        let left = left_on(&swept, &place(0.0, y, 2.0));
        assert!((left.height - closed).abs() < 2e-4, "{y}: {} {closed}", left.height);
    }
}

/// Whether a point is in the cutter: the union of its flat core, its ring of balls and its upper
/// cylinder.
fn is_in(cutter: &Cutter, pose: &ClPoint, p: &Point3<f64>) -> bool {
    let from = p - pose.tip;
    let z = from.dot(&pose.axis);
    let radial = (from - pose.axis.into_inner() * z).norm();
    let (r, rim) = (cutter.corner_radius(), cutter.radius() - cutter.corner_radius());
    let in_ring = (radial - rim).powi(2) + (z - r).powi(2) <= r * r;
    (0.0..=cutter.flute_length()).contains(&z)
        && ((radial <= rim) || (z >= r && radial <= cutter.radius()) || (radial > rim && z < r && in_ring))
}

/// Least height of a dense walk up the normal at dense poses.
fn by_walking(cutter: &Cutter, motions: &[CutterMotion], place: &SurfacePlace) -> f64 {
    let mut best = place.stock;
    for m in motions {
        for k in 0..=60 {
            let t = f64::from(k) / 60.0;
            let turn = Rotation3::rotation_between(&m.from.axis, &m.to.axis).unwrap_or_default().powf(t);
            let pose = ClPoint { tip: m.from.tip + (m.to.tip - m.from.tip) * t, axis: turn * m.from.axis };
            let mut way = 0.0;
            while way < best && !is_in(cutter, &pose, &(place.position + place.normal.into_inner() * way)) {
                way += 0.004;
            }
            best = best.min(way);
        }
    }
    best
}

#[test]
fn random_motions_leave_what_a_walk_over_dense_poses_finds() {
    let mut random = Random(11);
    let mut cut = 0;
    for case in 0..60 {
        let corner = [0.0, 0.5, 3.0, 6.0][case % 4];
        // Every other case turns the axis, by as little as parts of a program's motions do.
        let turning = if case % 8 < 4 { 0.0 } else { 0.03 };
        let cutter = Cutter::new(6.0, corner, 9.0).expect("a cutter");
        let mut pose = |z: f64| ClPoint {
            tip: Point3::new(random.between(-6.0, 6.0), random.between(-6.0, 6.0), z),
            axis: Unit::new_normalize(Vector3::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5), 1.0)),
        };
        let mut from = pose(0.3);
        let motions: Vec<CutterMotion> = (0..4)
            .map(|id| {
                let to = pose(0.2);
                let near = ClPoint { axis: Unit::new_normalize(from.axis.lerp(&to.axis, turning)), ..to };
                let m = CutterMotion { from, to: near, id };
                from = near;
                m
            })
            .collect();
        let swept = SweptCutter::new(&cutter, motions.clone());
        for _ in 0..6 {
            let normal = Unit::new_normalize(Vector3::new(random.between(-0.4, 0.4), random.between(-0.4, 0.4), 1.0));
            let position = Point3::new(random.between(-9.0, 9.0), random.between(-9.0, 9.0), random.between(-0.5, 0.0));
            let place = SurfacePlace { position, normal, stock: 4.0 };
            let (found, walked) = (left_on(&swept, &place).height, by_walking(&cutter, &motions, &place));
            // The walk looks at some poses only, and stops up to a step too high; near a tangent a
            // pose between is lower.
            let beside = 11.0 * turning * turning + SweptCutter::ACCURACY;
            assert!(found <= walked + beside, "case {case}: {found} above {walked}");
            assert!(walked - found < 0.06, "case {case}: {found} far below {walked}");
            cut += usize::from(found < 4.0);
        }
    }
    assert!(cut > 150, "only {cut} places are cut");
}

#[test]
fn heights_do_not_depend_on_threads_or_on_the_order_of_motions() {
    let cutter = Cutter::new(12.0, 2.0, 20.0).expect("a cutter");
    let mut random = Random(5);
    let places: Vec<SurfacePlace> =
        (0..1000).map(|_| place(random.between(-50.0, 50.0), random.between(-30.0, 30.0), 3.0)).collect();
    let motions = passes(7.0, 0.08, 0.9);
    let heights = |threads: usize, motions: Vec<CutterMotion>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| left_heights(&[SweptCutter::new(&cutter, motions)], &places, &Silent).expect("not cancelled"))
    };
    let one = heights(1, motions.clone());
    assert_eq!(one, heights(3, motions.clone()));
    let reversed = heights(1, motions.into_iter().rev().collect());
    assert!(one.iter().zip(&reversed).all(|(a, b)| (a.height - b.height).abs() < 1e-4));
}

#[test]
fn several_sweeps_leave_the_least_of_each_by_itself() {
    let mut rng = Random(29);
    let mut between = move |low: f64, high: f64| low + (high - low) * rng.unit();
    let cutters = [(10.0, 1.5), (8.0, 8.0), (6.0, 2.0), (10.0, 1.5)];
    let mut sweeps: Vec<SweptCutter> = (0u32..4)
        .zip(cutters)
        .map(|(k, (radius, corner))| {
            let cutter = Cutter::new(radius, corner, 20.0).expect("a cutter");
            let mut end = || {
                let axis = Unit::new_normalize(Vector3::new(between(-0.4, 0.4), between(-0.4, 0.4), 1.0));
                ClPoint { tip: Point3::new(between(-30.0, 30.0), between(-30.0, 30.0), between(-0.2, 2.0)), axis }
            };
            let motion = |id| {
                let from = end();
                CutterMotion { from, to: ClPoint { tip: end().tip, ..from }, id: 100 * k + id }
            };
            SweptCutter::new(&cutter, (0..12).map(motion).collect())
        })
        .collect();
    // One that cuts the same again: of equal heights the first counts.
    let motions = |id| passes(7.0, 0.1, 0.3).into_iter().map(move |m| CutterMotion { id: id + m.id, ..m }).collect();
    let disc = Cutter::new(10.0, 1.5, 20.0).expect("a disc");
    sweeps.extend([400, 500].map(|id| SweptCutter::new(&disc, motions(id))));
    let places: Vec<SurfacePlace> =
        (0..900).map(|k| place(f64::from(k % 30) * 2.0 - 29.0, f64::from(k / 30) * 2.0 - 29.0, 1.5)).collect();
    let together = left_heights(&sweeps, &places, &Silent).expect("a monitor that never cancels");
    let mut by = [0; 6];
    for (at, found) in places.iter().zip(&together) {
        let mut least = LeftHeight { height: at.stock, cut_by: None };
        for one in sweeps.iter().map(|swept| left_on(swept, at)) {
            if one.cut_by.is_some() && (least.cut_by.is_none() || one.height < least.height) {
                least = one;
            }
        }
        assert_eq!((found.height.to_bits(), found.cut_by), (least.height.to_bits(), least.cut_by), "{at:?}");
        found.cut_by.into_iter().for_each(|id| by[(id / 100) as usize] += 1);
    }
    assert!(by[..5].iter().all(|n| *n > 10) && by[5..] == [0], "{by:?}");
}
