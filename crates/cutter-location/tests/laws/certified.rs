//! The search with a proof against dense scans, where feasible stretches are too short for the
//! paper's steps.

use facemill_cl_data::Solid;
use facemill_cutter_location::{
    Hints, MOST_TESTS, PoseTest, SearchOrder, SearchSettings, Widened, certified_search, search,
};
use facemill_interference::{Interference, MeshTree, Separation, Verdict, Witness};
use facemill_sample_parts::{PatchSpec, patch};
use nalgebra::{Isometry3, Point3};

use crate::kit::{Random, cc_on_patch, cc_on_plane, curve_deg, machine, obstacle, plane, tool, workcell};
use crate::rods::{beside, post, stretches};

/// Steps of a dense scan of the curve.
const N: usize = 10_000;

#[test]
fn no_feasible_stretch_of_the_width_lies_before_what_is_found() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let patch = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let flat = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let mut random = Random(77);
    let width = 0.002;
    let settings = SearchSettings { certified: Some(width), ..SearchSettings::default() };
    let (mut beyond_start, mut missed_by_steps, mut narrow, mut total_tests, mut points) = (0, 0, 0, 0, 0);
    for order in [SearchOrder::TiltFirst, SearchOrder::RotateFirst] {
        for weight in [0.3, 1.0, 4.0] {
            for sign in [-1.0, 1.0] {
                let curve = curve_deg([1.0, 0.0], [25.0, sign * 80.0], order, weight);
                for round in 0..4 {
                    let (x, y) = (random.between(-70.0, 70.0), random.between(-70.0, 70.0));
                    let (part, cc) = match round % 2 {
                        0 => (&flat, cc_on_plane(x, y)),
                        _ => (&patch, cc_on_patch(&spec, x, y, random.vector(1.0))),
                    };
                    // A rod under the rear of the cutter up to some u, one before its front from a
                    // bit later on, and some anywhere under it.
                    let u = random.between(0.1, 0.7);
                    let later = curve.at(u + random.between(0.02, 0.12));
                    let mut places = vec![
                        beside(tool.cutter(), &cc, curve.at(u), [-20.0, random.between(-5.0, 5.0), 0.1]),
                        beside(tool.cutter(), &cc, later, [24.94, random.between(-3.0, 3.0), 10.5]),
                    ];
                    for _ in 0..round {
                        let at = [random.between(-24.0, -10.0), random.between(-20.0, 20.0), random.between(0.3, 2.0)];
                        places.push(beside(tool.cutter(), &cc, curve.at(random.between(0.0, 0.5)), at));
                    }
                    let rods: Vec<MeshTree> =
                        places.iter().map(|p| MeshTree::new(&post(p, random.between(0.01, 0.05)))).collect();
                    let mut obstacles = vec![obstacle("part", part)];
                    obstacles.extend(rods.iter().map(|rod| obstacle("rod", rod)));
                    let cell = workcell(&machine, &tool, obstacles);
                    let test = PoseTest::new(&cell);
                    let feasible = stretches(&test, &cc, &curve, N);
                    let certified = certified_search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default());
                    total_tests += certified.tests;
                    points += 1;
                    assert!(certified.tests <= MOST_TESTS && certified.width == width);
                    let through_search = search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default());
                    assert_eq!(through_search, certified.found);
                    let long = feasible.iter().find(|s| s[1] - s[0] >= width);
                    let Ok(found) = certified.found else {
                        assert!(long.is_none(), "{long:?} not found");
                        continue;
                    };
                    let again = test.try_posture(&cc, curve.at(found.u), None, &mut Hints::default());
                    assert_eq!((again, found.width), (Ok(found.pose), Some(width)));
                    if let Some(long) = long {
                        assert!(found.u <= long[0] + settings.u_tolerance, "{found:?} for {long:?}");
                    }
                    beyond_start += usize::from(found.u > 0.0);
                    narrow += usize::from(long.is_some_and(|s| s[1] - s[0] < 0.1));
                    let paper = SearchSettings::default();
                    let stepped = search(&test, &cc, &curve, &paper, 0.0, None, &mut Hints::default());
                    assert!(stepped.as_ref().is_ok_and(|s| s.width.is_none()) || stepped.is_err());
                    assert_eq!(test.widened(), None);
                    missed_by_steps += usize::from(stepped.map_or(true, |s| s.u > found.u + 0.01));
                }
            }
        }
    }
    // Proofs pass over most of the curve: tests of every thousandth would be 500.
    assert!(total_tests < 60 * points, "{total_tests} for {points} points");
    assert!(beyond_start >= 20 && narrow >= 5 && missed_by_steps >= 3, "{beyond_start} {narrow} {missed_by_steps}");
}

#[test]
fn a_search_from_a_later_u_is_proven_from_there_and_a_blocked_curve_names_what_blocks() {
    let flat = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let curve = curve_deg([1.0, 0.0], [25.0, 0.0], SearchOrder::TiltFirst, 1.0);
    let cc = cc_on_plane(10.0, 5.0);
    let settings = SearchSettings { certified: Some(0.001), ..SearchSettings::default() };
    let cell = workcell(&machine, &tool, vec![obstacle("part", &flat)]);
    let test = PoseTest::new(&cell);
    for from in [0.0, 0.3, 1.0] {
        let found = search(&test, &cc, &curve, &settings, from, None, &mut Hints::default()).unwrap();
        assert_eq!(found.u, from, "a plane is free everywhere");
    }
    // A pillar through the middle of the cutter.
    let pillar = MeshTree::new(&post(&Point3::new(-3.0, 5.0, 9.0), 1.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &flat), obstacle("pillar", &pillar)]);
    let test = PoseTest::new(&cell);
    let blocked = certified_search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default());
    assert_eq!(test.describe(&blocked.found.unwrap_err()), "cutter gouges pillar");
    // Proven in a few intervals, not by a thousand tests.
    assert!(blocked.tests < 40, "{}", blocked.tests);
}

/// An obstacle that is hit in every pose, but at no point that a proof could use.
struct Everywhere;

impl Interference for Everywhere {
    fn verdict(&self, _: &Solid, _: &Isometry3<f64>, _: Option<u32>) -> Verdict {
        Verdict::Hit(Witness { triangle: 0, point: Point3::new(1e4, 0.0, 0.0) })
    }

    fn core_distance(&self, _: &Solid, _: &Isometry3<f64>, _: f64, _: Option<u32>) -> Option<Separation> {
        Some(Separation { distance: 0.0, triangle: 0, point: Point3::new(1e4, 0.0, 0.0) })
    }
}

#[test]
fn a_width_that_needs_too_many_tests_gives_way_and_says_so() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let curve = curve_deg([1.0, 0.0], [25.0, -80.0], SearchOrder::TiltFirst, 1.0);
    let cell = workcell(&machine, &tool, vec![obstacle("fog", &Everywhere)]);
    let test = PoseTest::new(&cell);
    let cc = cc_on_plane(10.0, 5.0);
    let at = |width: f64| {
        let settings = SearchSettings { certified: Some(width), ..SearchSettings::default() };
        certified_search(&test, &cc, &curve, &settings, 0.0, None, &mut Hints::default())
    };
    for (requested, wide_enough) in [(0.01, true), (0.002, true), (1e-5, false), (0.0, false)] {
        let blocked = at(requested);
        assert_eq!(test.describe(&blocked.found.unwrap_err()), "cutter gouges fog");
        assert_eq!(blocked.width == requested, wide_enough, "{}", blocked.width);
        // Halving to the width takes twice as many intervals as it leaves, so there are as many as
        // fit and no fewer.
        let intervals = 2.0 / blocked.width;
        assert!(intervals <= 2.0 * MOST_TESTS as f64 && (wide_enough || intervals > 0.25 * MOST_TESTS as f64));
        assert!(blocked.tests <= 12 * MOST_TESTS, "{}", blocked.tests);
    }
}

/// A plate in front of the cutter's axis up to some height of the pose, and so up to some tilt; no
/// proof can use its hits.
struct UpTo {
    tip: f64,
}

impl Interference for UpTo {
    fn verdict(&self, solid: &Solid, pose: &Isometry3<f64>, hint: Option<u32>) -> Verdict {
        // The tip of a tilted cutter is above the contact: the lower, the less it is tilted.
        if (pose * Point3::origin()).z > self.tip { Verdict::Free } else { Everywhere.verdict(solid, pose, hint) }
    }

    fn core_distance(&self, solid: &Solid, pose: &Isometry3<f64>, reach: f64, hint: Option<u32>) -> Option<Separation> {
        if (pose * Point3::origin()).z > self.tip { None } else { Everywhere.core_distance(solid, pose, reach, hint) }
    }
}

#[test]
fn points_at_which_a_width_gave_way_are_counted_once_with_the_largest_one() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let curve = curve_deg([1.0, 0.0], [25.0, -80.0], SearchOrder::TiltFirst, 1.0);
    let settings = |width: f64| SearchSettings { certified: Some(width), ..SearchSettings::default() };
    let blocked = workcell(&machine, &tool, vec![obstacle("fog", &Everywhere)]);
    let test = PoseTest::new(&blocked);
    let at = |x: f64, width: f64| {
        search(&test, &cc_on_plane(x, 5.0), &curve, &settings(width), 0.0, None, &mut Hints::default())
    };
    // Wide enough: nothing to report.
    assert!(at(10.0, 0.002).is_err() && test.widened().is_none());
    let mut largest = 0.0_f64;
    for (x, width, points) in [(10.0, 1e-5, 1), (10.0, 2e-5, 1), (20.0, 1e-4, 2), (10.0, 1e-5, 2)] {
        assert!(at(x, width).is_err());
        let alone = PoseTest::new(&blocked);
        let cc = cc_on_plane(x, 5.0);
        largest = largest
            .max(certified_search(&alone, &cc, &curve, &settings(width), 0.0, None, &mut Hints::default()).width);
        assert_eq!(test.widened(), Some(Widened { points, largest }));
    }
    // Where a posture is found behind what could not be proven finely, it carries the width.
    let cell = workcell(&machine, &tool, vec![obstacle("fog", &UpTo { tip: 5.0 })]);
    let test = PoseTest::new(&cell);
    let cc = cc_on_plane(10.0, 5.0);
    let found = search(&test, &cc, &curve, &settings(1e-5), 0.0, None, &mut Hints::default()).unwrap();
    let width = found.width.unwrap();
    assert!(found.u > 0.1 && width > 1e-5, "{found:?}");
    assert_eq!(test.widened(), Some(Widened { points: 1, largest: width }));
}
