use crate::chips::*;
use facemill_chip_area::{Beside, Engagement, NeighbourAxis, Orientation, PassSection, SectionSurface, chip_of_pass};
use facemill_cl_data::CcPoint;
use facemill_cl_data::Posture;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::ridges;
use facemill_tool_model::Cutter;
use nalgebra::{Point3, Unit, Vector3};

/// Points of a pass along x at arc length `s` to the left over a cylinder along x, whose top line
/// is the x axis.
fn pass(curvature: f64, s: f64, posture: Posture) -> Vec<CutPoint> {
    let (sin, cos) = (curvature * s).sin_cos();
    let (y, z) = if curvature == 0.0 { (s, 0.0) } else { (sin / curvature, (cos - 1.0) / curvature) };
    let normal = Unit::new_normalize(Vector3::new(0.0, sin, cos)).into_inner();
    let at = |x: f64| CcPoint::new(Point3::new(x, y, z), normal, Vector3::x()).unwrap();
    [-10.0, 0.0, 10.0].into_iter().map(|x| CutPoint { cc: at(x), posture }).collect()
}

#[test]
fn areas_are_those_of_the_section_of_a_pass_on_planes_and_cylinders() {
    let mut n = 0;
    let cutters = [(80.0, 6.0), (40.0, 8.0), (10.0, 10.0), (25.0, 0.0)];
    let surfaces = [
        (0.0, SectionSurface::Plane),
        (1.0 / 900.0, SectionSurface::Convex { radius: 900.0 }),
        (-1.0 / 2500.0, SectionSurface::Concave { radius: 2500.0 }),
    ];
    for (radius, corner_radius) in cutters {
        for (curvature, surface) in surfaces {
            for (tilt, rotate) in [(0.1, 0.0), (0.26, -0.4), (0.2, 0.9), (0.05, 1.2)] {
                for (depth, step) in [(2.0, 0.3 * radius), (0.5, 2.0), (2.0, f64::INFINITY)] {
                    let posture = Posture { tilt, rotate };
                    let cutter = Cutter::new(radius, corner_radius, 60.0).unwrap();
                    let own = &pass(curvature, 0.0, posture)[1..2];
                    // The neighbour is on the right.
                    let before = if step.is_finite() { pass(curvature, -step, posture) } else { Vec::new() };
                    let ridge = ridges(&cutter, own, &before, 300.0)[0];
                    let top = StockTop::Layer { thickness: depth, curvature };
                    let site = ChipSite::new(Outline::new(&cutter, posture), ridge.as_ref(), top);
                    let right = if step.is_finite() { Beside::Cut { step_over: step } } else { Beside::Stock };
                    let section = PassSection {
                        cutter: CutterEnd { radius, corner_radius },
                        surface,
                        engagement: Engagement { depth_of_cut: depth, left: Beside::Stock, right },
                        orientation: Orientation { lead: posture.lead(), lean: posture.lean() },
                        neighbour_axis: NeighbourAxis::Turned,
                    };
                    let Ok(exact) = chip_of_pass(&section) else { continue };
                    let area = site.area().unwrap();
                    let allowed = SMALLEST_AREA.max(AREA_ACCURACY * exact.area) + exact.error_bound;
                    assert!((area - exact.area).abs() <= allowed, "{section:?}: {area} for {exact:?}");
                    n += 1;
                }
            }
        }
    }
    assert!(n > 120, "{n} cases");
}

#[test]
fn between_two_passes_cut_before_only_what_both_have_left_is_a_chip() {
    let (step, depth) = (14.0, 2.0);
    for (tilt, rotate) in [(0.1, 0.0), (0.2, -0.5)] {
        let posture = Posture { tilt, rotate };
        let cutter = Cutter::new(40.0, 8.0, 60.0).unwrap();
        let own = &pass(0.0, 0.0, posture)[1..2];
        let both = [-step, step].map(|s| ridges(&cutter, own, &pass(0.0, s, posture), 300.0)[0].unwrap());
        let top = StockTop::Layer { thickness: depth, curvature: 0.0 };
        let site = ChipSite::new(Outline::new(&cutter, posture), &both, top);
        let section = PassSection {
            cutter: CutterEnd { radius: 40.0, corner_radius: 8.0 },
            surface: SectionSurface::Plane,
            engagement: Engagement {
                depth_of_cut: depth,
                left: Beside::Cut { step_over: step },
                right: Beside::Cut { step_over: step },
            },
            orientation: Orientation { lead: posture.lead(), lean: posture.lean() },
            neighbour_axis: NeighbourAxis::Turned,
        };
        let exact = chip_of_pass(&section).unwrap();
        let area = site.area().unwrap();
        let allowed = SMALLEST_AREA.max(AREA_ACCURACY * exact.area) + exact.error_bound;
        assert!((area - exact.area).abs() <= allowed, "{area} for {exact:?}");
    }
}

#[test]
fn a_solid_counts_as_high_as_it_is_beside_each_place() {
    let heights = vec![0.0, 2.0, 2.0, 4.0];
    let top = StockTop::Solid { extent: [-3.0, 3.0], heights };
    for (y, z) in [(-5.0, 0.0), (-3.0, 0.0), (-2.0, 1.0), (0.0, 2.0), (2.0, 3.0), (3.0, 4.0), (9.0, 4.0)] {
        assert!((top.at(y) - z).abs() < 1e-12, "{y}");
    }
}

#[test]
fn the_highest_place_over_an_interval_is_that_of_many_places() {
    let tops = [
        StockTop::Layer { thickness: 2.0, curvature: 0.02 },
        StockTop::Layer { thickness: 2.0, curvature: -0.02 },
        StockTop::Layer { thickness: 2.0, curvature: 0.0 },
        StockTop::Solid { extent: [-30.0, 30.0], heights: vec![1.0, 4.0, 4.0, 0.0, 2.0, 2.0, 1.0] },
    ];
    for top in tops {
        for (from, to) in [(-30.0, 30.0), (-7.0, 9.0), (3.0, 4.0), (12.0, 12.0), (-29.0, -14.0), (-70.0, -20.0)] {
            let at = |k: i32| top.at(from + (to - from) * f64::from(k) / 6000.0);
            let sampled = (0..=6000).map(at).fold(f64::NEG_INFINITY, f64::max);
            let highest = top.highest([from, to]);
            assert!(highest == sampled || (highest - sampled).abs() < 1e-3, "{top:?} {from} {to}: {highest} {sampled}");
            assert!(highest >= sampled - 1e-12);
        }
    }
}

#[test]
fn the_thickest_place_beside_a_pass_is_not_above_that_in_full_stock() {
    let cutter = Cutter::new(80.0, 6.0, 12.0).unwrap();
    for (tilt, rotate) in [(0.1, 0.0), (0.26, -0.4), (0.2, 0.9)] {
        let posture = Posture { tilt, rotate };
        let own = &pass(0.0, 0.0, posture)[1..2];
        let of = |step: Option<f64>| {
            let before = step.map(|s| pass(0.0, -s, posture)).unwrap_or_default();
            let ridge = ridges(&cutter, own, &before, 300.0)[0];
            let top = StockTop::Layer { thickness: 2.0, curvature: 0.0 };
            ChipSite::new(Outline::new(&cutter, posture), ridge.as_ref(), top).thickness(THICKNESS_ACCURACY)
        };
        let (narrow, wide, full) = (of(Some(2.0)), of(Some(40.0)), of(None));
        assert!(0.0 < narrow && narrow <= wide + 1e-3 && wide <= full + 1e-3, "{narrow} {wide} {full}");
        assert!(full <= 1.0 + 1e-3);
    }
}

#[test]
fn circle_height_is_that_of_the_circle() {
    for curvature in [0.01f64, -0.01] {
        let r = 1.0 / curvature + 2.0;
        let exact = r.signum() * (r * r - 100.0).sqrt() - r;
        assert!((circle_height(curvature, 2.0, 10.0) - exact).abs() < 1e-12);
    }
}
