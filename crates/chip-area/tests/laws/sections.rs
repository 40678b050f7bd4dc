//! Laws of the chip area: closed forms on a plane, symmetries, limits, refusals, and the general
//! section.

use std::f64::consts::PI;

use facemill_chip_area::{
    ChipAreaError, ChipSection, Position, SectionCutter, SectionSurface, StepSign, chip_area,
    chip_area_between_outlines,
};

const CUTTERS: [SectionCutter; 2] = [SectionCutter::Flat { radius: 6.0 }, SectionCutter::Ball { radius: 6.0 }];
const STEPS: [StepSign; 2] = [StepSign::Positive, StepSign::Negative];
const SURFACES: [SectionSurface; 3] =
    [SectionSurface::Plane, SectionSurface::Convex { radius: 20.0 }, SectionSurface::Concave { radius: 20.0 }];

/// A section with its outward normal at the polar angle `normal` and the axis `off` clockwise from
/// the normal.
fn section(cutter: SectionCutter, surface: SectionSurface, step_sign: StepSign, normal: f64, off: f64) -> ChipSection {
    let alpha0 = if matches!(surface, SectionSurface::Concave { .. }) { normal + PI } else { normal };
    ChipSection { cutter, surface, depth_of_cut: 2.0, step_over: 1.0, step_sign, alpha0, lean: PI / 2.0 - normal + off }
}

/// Every cutter, surface and sense of step at several directions, where the tool is not below the
/// surface.
fn sections() -> Vec<ChipSection> {
    let mut all = Vec::new();
    for cutter in CUTTERS {
        for surface in SURFACES {
            for step_sign in STEPS {
                for off in [-0.7, -0.35, 0.2, 0.5] {
                    all.push(section(cutter, surface, step_sign, 0.9, off));
                }
            }
        }
    }
    all.retain(|s| chip_area(s).is_ok());
    assert!(all.len() > 40, "{}", all.len());
    all
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + b.abs())
}

#[test]
fn on_a_plane_the_chip_is_depth_times_step_less_the_cusp() {
    for step_sign in STEPS {
        for off in [-1.2, -0.5, -0.01, 0.0, 1e-7, 0.3, 1.0] {
            for (depth_of_cut, step_over) in [(2.0, 1.0), (9.0, 0.5), (0.4, 2.5)] {
                for cutter in CUTTERS {
                    let base = section(cutter, SectionSurface::Plane, step_sign, 2.0, off);
                    let area = chip_area(&ChipSection { depth_of_cut, step_over, ..base }).unwrap();
                    // At each height the tool is wider than the step, or the chip is as wide as the
                    // tool.
                    let full = depth_of_cut * step_over;
                    let missing = match cutter {
                        SectionCutter::Flat { .. } => {
                            let widening = f64::tan(off.abs()) + 1.0 / f64::tan(off.abs());
                            let top = (step_over / widening).min(depth_of_cut);
                            step_over * top - 0.5 * widening.min(1e300) * top * top
                        }
                        SectionCutter::Ball { radius: r } => {
                            let half = 0.5 * step_over;
                            let flat = (r * r - half * half).sqrt();
                            assert!(r - flat < depth_of_cut);
                            step_over * r - half * flat - r * r * (half / r).asin()
                        }
                    };
                    assert!(close(area, full - missing, 1e-10), "{base:?} {depth_of_cut} {step_over}: {area}");
                }
            }
        }
    }
}

#[test]
fn turning_mirroring_and_scaling_the_section_keep_the_area() {
    for s in sections() {
        let area = chip_area(&s).unwrap();
        let turned = ChipSection { alpha0: s.alpha0 + 1.234, lean: s.lean - 1.234, ..s };
        assert!(close(chip_area(&turned).unwrap(), area, 1e-12), "{s:?}");
        let other = if s.step_sign == StepSign::Positive { StepSign::Negative } else { StepSign::Positive };
        let mirrored = ChipSection { alpha0: PI - s.alpha0, lean: -s.lean, step_sign: other, ..s };
        assert!(close(chip_area(&mirrored).unwrap(), area, 1e-12), "{s:?}");
        for scale in [1e-3, 25.4, 1e4] {
            let cutter = match s.cutter {
                SectionCutter::Flat { radius } => SectionCutter::Flat { radius: scale * radius },
                SectionCutter::Ball { radius } => SectionCutter::Ball { radius: scale * radius },
            };
            let surface = match s.surface {
                SectionSurface::Plane => SectionSurface::Plane,
                SectionSurface::Convex { radius } => SectionSurface::Convex { radius: scale * radius },
                SectionSurface::Concave { radius } => SectionSurface::Concave { radius: scale * radius },
            };
            let scaled = ChipSection { cutter, surface, depth_of_cut: 2.0 * scale, step_over: scale, ..s };
            assert!(close(chip_area(&scaled).unwrap() / (scale * scale), area, 1e-11), "{s:?} {scale}");
        }
    }
}

#[test]
fn the_area_goes_to_zero_with_depth_and_with_step() {
    for s in sections() {
        assert_eq!(chip_area(&ChipSection { depth_of_cut: 0.0, ..s }), Ok(0.0));
        assert_eq!(chip_area(&ChipSection { step_over: 0.0, ..s }), Ok(0.0));
        let (mut thin, mut narrow) = (f64::INFINITY, f64::INFINITY);
        for power in 1..12 {
            let small = 10f64.powi(-power);
            let area = chip_area(&ChipSection { depth_of_cut: small, ..s }).unwrap();
            assert!(area <= thin && area <= 3.0 * small, "{s:?} depth {small}: {area}");
            thin = area;
            let area = chip_area(&ChipSection { step_over: small, ..s }).unwrap();
            assert!(area < narrow && area <= 3.0 * small, "{s:?} step {small}: {area}");
            // A chip of vanishing width keeps a height between the depth of cut and the value from
            // the curvature.
            assert!(power < 4 || area >= 0.5 * small, "{s:?} step {small}: {area}");
            narrow = area;
        }
    }
}

#[test]
fn the_area_grows_with_the_depth() {
    for s in sections() {
        let areas: Vec<f64> = (0..40)
            .map(|i| chip_area(&ChipSection { depth_of_cut: 0.1 * f64::from(i), ..s }))
            .map_while(Result::ok)
            .collect();
        assert!(areas.len() > 10 && areas.windows(2).all(|a| a[0] <= a[1] + 1e-12), "{s:?}: {areas:?}");
    }
}

#[test]
fn curved_surfaces_of_growing_radius_become_the_plane() {
    for cutter in CUTTERS {
        for step_sign in STEPS {
            for off in [-0.7, -0.35, 0.2, 0.5] {
                let plane = chip_area(&section(cutter, SectionSurface::Plane, step_sign, 0.9, off)).unwrap();
                for power in 3..15 {
                    let radius = 10f64.powi(power);
                    for surface in [SectionSurface::Convex { radius }, SectionSurface::Concave { radius }] {
                        let area = chip_area(&section(cutter, surface, step_sign, 0.9, off)).unwrap();
                        assert!((area - plane).abs() < 100.0 / radius + 1e-12, "{surface:?}: {area}, plane {plane}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_area_is_continuous_in_the_lean() {
    // Where the bottom of a flat cutter passes through the direction of the surface the other
    // corner touches.
    for cutter in CUTTERS {
        for surface in
            [SectionSurface::Plane, SectionSurface::Convex { radius: 20.0 }, SectionSurface::Concave { radius: 20.0 }]
        {
            for lean in [-0.2, 0.0, 0.1] {
                let at = |lean: f64| {
                    let s = section(cutter, surface, StepSign::Positive, PI / 4.0, 0.0);
                    chip_area(&ChipSection { lean, ..s }).unwrap()
                };
                for small in [1e-3, 1e-6, 1e-9, 1e-12] {
                    assert!(
                        (at(lean + small) - at(lean)).abs() < 20.0 * small + 1e-12,
                        "{cutter:?} {surface:?} {lean}"
                    );
                    assert!(
                        (at(lean - small) - at(lean)).abs() < 20.0 * small + 1e-12,
                        "{cutter:?} {surface:?} {lean}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_ball_at_its_equator_joins_the_cut_without_flute() {
    // tmax on a plane with the axis 45° off its normal: the flute begins at r·(1 − sin 45°) above
    // the plane on the side toward which the axis leans, and there it undercuts.
    let t_max = 6.0 * (1.0 - 0.5f64.sqrt());
    for step_sign in STEPS {
        let s = section(CUTTERS[1], SectionSurface::Plane, step_sign, 0.6, PI / 4.0);
        let at = |depth_of_cut: f64| chip_area(&ChipSection { depth_of_cut, ..s }).unwrap();
        assert!((at(t_max + 1e-9) - at(t_max - 1e-9)).abs() < 1e-8);
        // Above the cusp each further layer is as wide as the step, by ball and by flute.
        assert!((at(t_max + 1.5) - at(t_max - 0.5) - 2.0).abs() < 1e-12);
    }
}

#[test]
fn impossible_sections_are_refused() {
    let s = section(CUTTERS[1], SectionSurface::Plane, StepSign::Positive, PI / 2.0, 0.0);
    let concave = ChipSection { alpha0: -PI / 2.0, surface: SectionSurface::Concave { radius: 20.0 }, ..s };
    let flat = |s: ChipSection| ChipSection { cutter: SectionCutter::Flat { radius: 6.0 }, ..s };
    let refused = |s: ChipSection| chip_area(&s).unwrap_err();

    assert_eq!(refused(ChipSection { lean: f64::NAN, ..s }), ChipAreaError::NotFinite { field: "lean" });
    assert_eq!(refused(ChipSection { step_over: f64::INFINITY, ..s }), ChipAreaError::NotFinite { field: "step_over" });
    let surface = SectionSurface::Convex { radius: f64::NAN };
    assert_eq!(refused(ChipSection { surface, ..s }), ChipAreaError::NotFinite { field: "surface.radius" });
    let cutter = SectionCutter::Flat { radius: 0.0 };
    assert_eq!(refused(ChipSection { cutter, ..s }), ChipAreaError::NotPositive { field: "cutter.radius", value: 0.0 });
    assert_eq!(
        refused(ChipSection { depth_of_cut: -0.1, ..s }),
        ChipAreaError::Negative { field: "depth_of_cut", value: -0.1 }
    );
    for radius in [20.0, 21.0] {
        let cutter = SectionCutter::Ball { radius };
        assert_eq!(
            refused(ChipSection { cutter, ..concave }),
            ChipAreaError::BallTooLarge { cutter_radius: radius, surface_radius: 20.0 }
        );
    }
    assert_eq!(
        refused(ChipSection { depth_of_cut: 20.0, ..concave }),
        ChipAreaError::DepthReachesCentre { depth_of_cut: 20.0, surface_radius: 20.0 }
    );
    assert_eq!(
        refused(ChipSection { step_over: 63.0, ..concave }),
        ChipAreaError::StepTooLong { step_over: 63.0, surface_radius: 20.0 }
    );
    assert_eq!(refused(ChipSection { lean: 2.0, ..s }), ChipAreaError::BelowSurface { position: Position::First });
    assert_eq!(refused(ChipSection { lean: PI / 2.0, ..s }), ChipAreaError::AxisInPlane);
    // A flat bottom tangent to a concave surface reaches below it with its other end; the flute of
    // a ball that lies on its side runs into it.
    assert_eq!(refused(flat(concave)), ChipAreaError::BelowSurface { position: Position::First });
    assert_eq!(
        refused(ChipSection { lean: 1.5, ..concave }),
        ChipAreaError::BelowSurface { position: Position::First }
    );
    // On top of a convex surface a flat cutter passes from one corner to the other.
    let convex = SectionSurface::Convex { radius: 20.0 };
    let over_the_top = ChipSection { surface: convex, alpha0: PI / 2.0 - 0.02, ..flat(s) };
    assert_eq!(refused(over_the_top), ChipAreaError::CornerChanges);
    // The step alone moves the second position below: the axis is above the surface only at the
    // first.
    let beside = ChipSection { surface: convex, alpha0: PI - 0.02, ..s };
    assert_eq!(refused(beside), ChipAreaError::BelowSurface { position: Position::Second });
}

#[test]
fn the_section_between_outlines_is_chips_ball_section() {
    // CHIP's ball cases without flute contact, seen along the feed with the tool axis upright:
    // rotate by the lean.
    let mut compared = 0;
    for surface in SURFACES {
        for step_sign in STEPS {
            for off in [-0.5, -0.2, 0.0, 0.3] {
                let s = section(CUTTERS[1], surface, step_sign, 1.1, off);
                let exact = chip_area(&s).unwrap();
                let sign = if step_sign == StepSign::Positive { 1.0 } else { -1.0 };
                let (r2, ta) = (6.0, s.depth_of_cut);
                let angle = s.alpha0 + s.lean;
                let (sin, cos) = angle.sin_cos();
                let center = |step: f64| match surface {
                    SectionSurface::Plane => [cos * r2 - sin * sign * step, sin * r2 + cos * sign * step],
                    SectionSurface::Convex { radius } => {
                        let (sin, cos) = (angle + sign * step / radius).sin_cos();
                        [cos * (radius + r2), sin * (radius + r2)]
                    }
                    SectionSurface::Concave { radius } => {
                        let (sin, cos) = (angle + sign * step / radius).sin_cos();
                        [cos * (radius - r2), sin * (radius - r2)]
                    }
                };
                let ball = |[cy, cz]: [f64; 2]| {
                    move |y: f64| ((y - cy).abs() <= r2).then(|| cz - (r2 * r2 - (y - cy) * (y - cy)).sqrt())
                };
                let stock_top = |y: f64| match surface {
                    SectionSurface::Plane => (ta - cos * y) / sin,
                    SectionSurface::Convex { radius } if y.abs() <= radius + ta => {
                        ((radius + ta).powi(2) - y * y).sqrt()
                    }
                    SectionSurface::Concave { radius } if y.abs() <= radius - ta => {
                        -((radius - ta).powi(2) - y * y).sqrt()
                    }
                    _ => f64::NEG_INFINITY,
                };
                let second = center(1.0);
                let range = second[0] - r2..=second[0] + r2;
                let area = chip_area_between_outlines(ball(center(0.0)), ball(second), stock_top, range, 1e-7).unwrap();
                assert!((area - exact).abs() < 1e-6, "{s:?}: {area}, exact {exact}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 24);
}
