//! Laws of the chip of a pass: limits, symmetries, and sums.

use std::f64::consts::FRAC_PI_2;

use facemill_chip_area::{
    Beside, ChipSection, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassError, PassSection,
    SectionCutter, SectionSurface, StepSign, chip_area, chip_of_pass,
};

use crate::kit::Random;

const CORNERS: [f64; 4] = [0.0, 1e-3, 2.5, 6.0];
const SURFACES: [SectionSurface; 3] =
    [SectionSurface::Plane, SectionSurface::Convex { radius: 30.0 }, SectionSurface::Concave { radius: 30.0 }];
/// Lead and lean.
const AXES: [(f64, f64); 7] = [(0.0, 0.5), (0.0, -0.5), (0.4, 0.0), (-0.6, 0.3), (0.3, -0.7), (0.01, 0.4), (1.2, 0.6)];

fn cut(step_over: f64) -> Beside {
    Beside::Cut { step_over }
}

/// A cutter of radius 6 with 2 mm of stock and a neighbour 1.5 mm to the right, in every
/// orientation and on every surface.
fn sections() -> Vec<PassSection> {
    let mut all = Vec::new();
    for corner_radius in CORNERS {
        for surface in SURFACES {
            for (lead, lean) in AXES {
                all.push(PassSection {
                    cutter: CutterEnd { radius: 6.0, corner_radius },
                    surface,
                    engagement: Engagement { depth_of_cut: 2.0, left: Beside::Stock, right: cut(1.5) },
                    orientation: Orientation { lead, lean },
                    neighbour_axis: NeighbourAxis::Parallel,
                });
            }
        }
    }
    let total = all.len();
    all.retain(|s| chip_of_pass(s).is_ok());
    assert!(all.len() > total - 12, "{} of {total}", all.len());
    all
}

fn area(section: &PassSection) -> f64 {
    chip_of_pass(section).unwrap_or_else(|e| panic!("{section:?}: {e}")).area
}

fn with(section: &PassSection, change: impl FnOnce(&mut PassSection)) -> PassSection {
    let mut changed = *section;
    change(&mut changed);
    changed
}

fn engaged(section: &PassSection, depth_of_cut: f64, left: Beside, right: Beside) -> PassSection {
    with(section, |s| s.engagement = Engagement { depth_of_cut, left, right })
}

#[test]
fn chips_sections_are_those_of_a_pass() {
    // CHIP's axis is fixed in space; its first position is the neighbour. With a positive step the
    // first position is clockwise from the second, which is to the right with the normal up.
    let mut compared = 0;
    for surface in SURFACES {
        for (cutter, corner_radius) in
            [(SectionCutter::Flat { radius: 6.0 }, 0.0), (SectionCutter::Ball { radius: 6.0 }, 6.0)]
        {
            for step_sign in [StepSign::Positive, StepSign::Negative] {
                for lean in [-0.6, -0.3, 0.2, 0.5] {
                    let sense = if step_sign == StepSign::Positive { 1.0 } else { -1.0 };
                    let (curvature, inward) = match surface {
                        SectionSurface::Concave { radius } => (-1.0 / radius, 1.0),
                        SectionSurface::Convex { radius } => (1.0 / radius, 0.0),
                        SectionSurface::Plane => (0.0, 0.0),
                    };
                    let step = 1.5;
                    // The normal of the second position points up; its polar angle is a quarter
                    // turn.
                    let alpha0 = FRAC_PI_2 + inward * std::f64::consts::PI - sense * step * f64::abs(curvature);
                    let chip = ChipSection {
                        cutter,
                        surface,
                        depth_of_cut: 2.0,
                        step_over: step,
                        step_sign,
                        alpha0,
                        lean: -lean,
                    };
                    // Counter-clockwise is to the left of an upward normal on the outside of a
                    // circle, to the right on its inside.
                    let from_right = (sense > 0.0) == (inward == 0.0);
                    let (left, right) =
                        if from_right { (Beside::Stock, cut(step)) } else { (cut(step), Beside::Stock) };
                    let pass = PassSection {
                        cutter: CutterEnd { radius: 6.0, corner_radius },
                        surface,
                        engagement: Engagement { depth_of_cut: 2.0, left, right },
                        orientation: Orientation { lead: 0.0, lean },
                        neighbour_axis: NeighbourAxis::Parallel,
                    };
                    let Ok(exact) = chip_area(&chip) else { continue };
                    assert!((area(&pass) - exact).abs() < 1e-12, "{pass:?}: {}, {exact}", area(&pass));
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 40, "{compared}");
}

#[test]
fn the_area_vanishes_with_depth_and_with_step_and_grows_with_both() {
    for s in sections() {
        assert_eq!(area(&engaged(&s, 0.0, Beside::Stock, cut(1.5))), 0.0);
        assert_eq!(area(&engaged(&s, 2.0, Beside::Stock, cut(0.0))), 0.0);
        let (mut thin, mut narrow) = (f64::INFINITY, f64::INFINITY);
        for power in 1..12 {
            let small = 10f64.powi(-power);
            let depth = area(&engaged(&s, small, Beside::Stock, cut(1.5)));
            assert!(depth <= thin + 1e-13 && depth <= 3.0 * small, "{s:?} depth {small}: {depth}");
            let step = area(&engaged(&s, 2.0, Beside::Stock, cut(small)));
            assert!(step < narrow && step <= 6.0 * small, "{s:?} step {small}: {step}");
            // A strip as long as the cutter's side in the stock is deep.
            assert!(step >= 0.5 * small, "{s:?} step {small}: {step}");
            (thin, narrow) = (depth, step);
        }
    }
}

#[test]
fn curved_surfaces_of_growing_radius_become_the_plane() {
    for s in sections().into_iter().filter(|s| s.surface == SectionSurface::Plane) {
        for (left, right) in [(Beside::Stock, cut(1.5)), (cut(0.7), Beside::Border { distance: 1.0 })] {
            let plane = area(&engaged(&s, 2.0, left, right));
            for power in 3..15 {
                let radius = 10f64.powi(power);
                for surface in [SectionSurface::Convex { radius }, SectionSurface::Concave { radius }] {
                    let curved = area(&with(&engaged(&s, 2.0, left, right), |s| s.surface = surface));
                    assert!((curved - plane).abs() < 300.0 / radius + 1e-11, "{s:?} {surface:?}: {curved}, {plane}");
                }
            }
        }
    }
}

#[test]
fn the_area_is_continuous_in_lead_and_lean() {
    for s in sections() {
        let Orientation { lead, lean } = s.orientation;
        for small in [1e-3, 1e-6, 1e-9, 1e-12, -1e-3, -1e-6, -1e-9] {
            let at = |lead, lean| area(&with(&s, |s| s.orientation = Orientation { lead, lean }));
            let here = at(lead, lean);
            // Nearly along the axis a small turn moves the contact far: R·small / sin(lead).
            let steep = if lead == 0.0 { 1.0 } else { 1.0 / lead.abs().min(1.0) };
            let bound = 60.0 * steep * f64::abs(small) + 1e-10;
            assert!((at(lead + small, lean) - here).abs() < bound, "{s:?} {small}");
            assert!((at(lead, lean + small) - here).abs() < bound, "{s:?} {small}");
        }
    }
}

#[test]
fn the_bull_nose_becomes_the_flat_end_and_the_ball() {
    for s in sections() {
        let at = |corner_radius: f64| area(&with(&s, |s| s.cutter.corner_radius = corner_radius));
        if s.cutter.corner_radius == 0.0 {
            for power in 2..14 {
                let r = 10f64.powi(-power);
                assert!((at(r) - at(0.0)).abs() < 20.0 * r + 1e-11, "{s:?} {r}: {} {}", at(r), at(0.0));
            }
        }
        if s.cutter.corner_radius == 6.0 {
            for power in 2..14 {
                let rim = 10f64.powi(-power);
                assert!((at(6.0 - rim) - at(6.0)).abs() < 20.0 * rim + 1e-11, "{s:?} {rim}");
            }
        }
    }
}

#[test]
fn a_lead_that_vanishes_becomes_the_axis_in_the_section_plane() {
    for s in sections() {
        let at = |lead: f64| {
            let section = with(&s, |s| s.orientation = Orientation { lead, lean: s.orientation.lean });
            chip_of_pass(&section)
        };
        let Ok(exact) = at(0.0) else { continue };
        assert_eq!(exact.method, Method::ClosedForm);
        // Upright, the contact of the neighbour, whose normal is turned by only a step, moves by
        // R·lead / turn.
        let steep = if s.orientation.lean == 0.0 { 300.0 } else { 30.0 };
        for power in 1..16 {
            let lead = 10f64.powi(-power);
            let chip = at(lead).unwrap();
            assert!((chip.area - exact.area).abs() < steep * lead + 1e-10, "{s:?} {lead}: {chip:?}, {exact:?}");
        }
    }
}

#[test]
fn mirrored_turned_back_and_scaled_sections_have_the_same_area() {
    for s in sections() {
        let base = engaged(&s, 2.0, cut(2.2), Beside::Border { distance: 1.3 });
        let exact = area(&base);
        let mirrored = with(&base, |s| {
            (s.engagement.left, s.engagement.right) = (s.engagement.right, s.engagement.left);
            s.orientation.lean = -s.orientation.lean;
        });
        assert!((area(&mirrored) - exact).abs() < 1e-11, "{s:?}");
        // Seen against the feed the outline is mirrored twice.
        let back = with(&base, |s| s.orientation.lead = -s.orientation.lead);
        assert!((area(&back) - exact).abs() < 1e-11, "{s:?}");
        for scale in [1e-3, 25.4, 1e4] {
            let large = |surface| match surface {
                SectionSurface::Plane => SectionSurface::Plane,
                SectionSurface::Convex { radius } => SectionSurface::Convex { radius: scale * radius },
                SectionSurface::Concave { radius } => SectionSurface::Concave { radius: scale * radius },
            };
            let CutterEnd { radius, corner_radius } = base.cutter;
            let scaled = PassSection {
                cutter: CutterEnd { radius: scale * radius, corner_radius: scale * corner_radius },
                surface: large(base.surface),
                engagement: Engagement {
                    depth_of_cut: 2.0 * scale,
                    left: cut(2.2 * scale),
                    right: Beside::Border { distance: 1.3 * scale },
                },
                ..base
            };
            assert!((area(&scaled) / (scale * scale) - exact).abs() < 1e-10, "{s:?} {scale}");
        }
    }
}

#[test]
fn what_both_neighbours_and_this_pass_cut_adds_up() {
    // Strips of two passes beside each other, in either order, are what both cut together.
    for s in sections().into_iter().filter(|s| s.surface == SectionSurface::Plane) {
        let full = area(&engaged(&s, 2.0, Beside::Stock, Beside::Stock));
        let right = area(&engaged(&s, 2.0, Beside::Stock, cut(1.5)));
        let left = area(&engaged(&s, 2.0, cut(1.5), Beside::Stock));
        // On a plane the same tool, moved sideways, cuts as much as this one, so the rest is the
        // same.
        assert!((left - right).abs() < 1e-11, "{s:?}: {left} {right}");
        assert!(right < full);
        let both = area(&engaged(&s, 2.0, cut(1.5), cut(1.5)));
        assert!(both <= left.min(right) + 1e-12, "{s:?}");
        // First, the next 1.5 mm beside, then the one between them: in total as much as one after
        // the other.
        let far = area(&engaged(&s, 2.0, Beside::Stock, cut(3.0)));
        assert!((far + both - 2.0 * right).abs() < 1e-11, "{s:?}: {far} {both} {right}");
    }
}

#[test]
fn borders_far_away_are_no_borders_and_those_on_both_sides_add_up() {
    for s in sections() {
        let at = |left, right| area(&engaged(&s, 2.0, left, right));
        let border = |distance| Beside::Border { distance };
        let full = at(Beside::Stock, Beside::Stock);
        if s.surface == SectionSurface::Plane {
            assert!((at(border(1e4), border(1e4)) - full).abs() < 1e-10, "{s:?}");
        }
        // The stock on the left of the CC point and that on its right.
        let halves = at(Beside::Stock, border(0.0)) + at(border(0.0), Beside::Stock);
        assert!((halves - full).abs() < 1e-10, "{s:?}: {halves} {full}");
        let (mut last, bounds) = (0.0, [0.0, 0.01, 0.5, 2.0, 5.0, 9.0]);
        for distance in bounds {
            let here = at(Beside::Stock, border(distance));
            assert!(here >= last - 1e-11 && here <= full + 1e-10, "{s:?} {distance}");
            last = here;
        }
    }
}

#[test]
fn a_step_as_wide_as_the_cutter_leaves_full_stock() {
    let base = PassSection {
        cutter: CutterEnd { radius: 6.0, corner_radius: 2.0 },
        surface: SectionSurface::Plane,
        engagement: Engagement { depth_of_cut: 2.0, left: Beside::Stock, right: Beside::Stock },
        orientation: Orientation { lead: 0.2, lean: 0.0 },
        neighbour_axis: NeighbourAxis::Parallel,
    };
    let full = area(&base);
    assert!((area(&engaged(&base, 2.0, Beside::Stock, cut(12.0 - 1e-9))) - full).abs() < 1e-8);
    assert_eq!(
        chip_of_pass(&engaged(&base, 2.0, Beside::Stock, cut(12.5))),
        Err(PassError::StepBeyondCutter { field: "engagement.right.step_over", step_over: 12.5, width: 12.0 })
    );
}

#[test]
fn a_leading_disc_cuts_the_squashed_chip_of_a_ball_to_the_error_bound() {
    let mut random = Random(41);
    for _ in 0..2000 {
        let (radius, depth) = (random.between(1.0, 50.0), random.between(0.0, 1.0));
        let step_over = random.between(0.0, radius);
        // A disc appears as an ellipse, with half the height given by the sine of its lead.
        let section = |lead| PassSection {
            cutter: CutterEnd { radius, corner_radius: 0.0 },
            surface: SectionSurface::Plane,
            engagement: Engagement {
                depth_of_cut: depth * radius * f64::sin(lead),
                left: Beside::Stock,
                right: cut(step_over),
            },
            orientation: Orientation { lead, lean: 0.0 },
            neighbour_axis: NeighbourAxis::Parallel,
        };
        let lead = random.between(0.01, 1.5);
        let chip = chip_of_pass(&section(lead)).unwrap();
        // That is the circle of a ball, squashed, and so is its chip on a plane.
        let ball = PassSection {
            cutter: CutterEnd { radius, corner_radius: radius },
            engagement: Engagement { depth_of_cut: depth * radius, left: Beside::Stock, right: cut(step_over) },
            ..section(0.0)
        };
        let ball = chip_of_pass(&ball).unwrap();
        let off = (chip.area - ball.area * lead.sin()).abs();
        assert!(off <= chip.error_bound + ball.error_bound, "{chip:?} {ball:?} {off:e}");
    }
}

#[test]
fn turned_neighbours_become_parallel_ones_on_the_plane_and_add_up_on_circles() {
    for s in sections() {
        let turned = |s: &PassSection| with(s, |s| s.neighbour_axis = NeighbourAxis::Turned);
        let chip = chip_of_pass(&turned(&s)).unwrap();
        if s.surface == SectionSurface::Plane {
            assert_eq!(chip, chip_of_pass(&s).unwrap());
            for radius in [1e3, 1e5, 1e8] {
                for surface in [SectionSurface::Convex { radius }, SectionSurface::Concave { radius }] {
                    let curved = chip_of_pass(&turned(&with(&s, |s| s.surface = surface))).unwrap();
                    let bound = 300.0 / radius + curved.error_bound + chip.error_bound;
                    assert!((curved.area - chip.area).abs() < bound, "{s:?} {surface:?}: {curved:?}, {chip:?}");
                }
            }
        } else {
            // The cutter turned about the centre cuts the same area everywhere: the strips on both
            // sides are equal, and two steps cut as much as one after the other.
            let at = |left, right| chip_of_pass(&turned(&engaged(&s, 2.0, left, right))).unwrap();
            let (left, far, both) = (at(cut(1.5), Beside::Stock), at(Beside::Stock, cut(3.0)), at(cut(1.5), cut(1.5)));
            let bound = 4.0 * (chip.error_bound + left.error_bound + far.error_bound + both.error_bound);
            assert!((left.area - chip.area).abs() < bound, "{s:?}: {left:?}, {chip:?}");
            assert!((far.area + both.area - 2.0 * chip.area).abs() < bound, "{s:?}: {far:?}, {both:?}, {chip:?}");
        }
    }
}
