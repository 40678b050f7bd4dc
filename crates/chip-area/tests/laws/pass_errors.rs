//! Sections without a chip area; all others have one within bounds.

use std::f64::consts::FRAC_PI_2;

use facemill_chip_area::{
    Beside, CutterEnd, Engagement, NeighbourAxis, Orientation, PassError, PassSection, Pose, SectionSurface,
    chip_of_pass,
};

use crate::kit::Random;

fn cut(step_over: f64) -> Beside {
    Beside::Cut { step_over }
}

fn with(section: &PassSection, change: impl FnOnce(&mut PassSection)) -> PassSection {
    let mut changed = *section;
    change(&mut changed);
    changed
}

#[test]
fn bad_values_are_refused_by_their_field() {
    let good = PassSection {
        cutter: CutterEnd { radius: 6.0, corner_radius: 2.0 },
        surface: SectionSurface::Concave { radius: 30.0 },
        engagement: Engagement { depth_of_cut: 2.0, left: Beside::Border { distance: 3.0 }, right: cut(1.5) },
        orientation: Orientation { lead: 0.4, lean: 0.3 },
        neighbour_axis: NeighbourAxis::Parallel,
    };
    assert!(chip_of_pass(&good).is_ok());
    let refused = |change: &dyn Fn(&mut PassSection)| chip_of_pass(&with(&good, |s| change(s))).unwrap_err();
    let not_finite = [
        ("cutter.radius", refused(&|s| s.cutter.radius = f64::INFINITY)),
        ("cutter.corner_radius", refused(&|s| s.cutter.corner_radius = f64::INFINITY)),
        ("surface.radius", refused(&|s| s.surface = SectionSurface::Convex { radius: f64::INFINITY })),
        ("engagement.depth_of_cut", refused(&|s| s.engagement.depth_of_cut = f64::INFINITY)),
        ("engagement.left.distance", refused(&|s| s.engagement.left = Beside::Border { distance: f64::INFINITY })),
        ("engagement.right.step_over", refused(&|s| s.engagement.right = cut(f64::INFINITY))),
        ("orientation.lead", refused(&|s| s.orientation.lead = f64::INFINITY)),
        ("orientation.lean", refused(&|s| s.orientation.lean = f64::INFINITY)),
    ];
    for (field, error) in not_finite {
        assert_eq!(error, PassError::NotFinite { field, value: f64::INFINITY });
    }
    assert!(matches!(
        refused(&|s| s.orientation.lean = f64::NAN),
        PassError::NotFinite { field: "orientation.lean", .. }
    ));
    assert_eq!(refused(&|s| s.cutter.radius = 0.0), PassError::NotPositive { field: "cutter.radius", value: 0.0 });
    assert_eq!(
        refused(&|s| s.surface = SectionSurface::Concave { radius: -1.0 }),
        PassError::NotPositive { field: "surface.radius", value: -1.0 }
    );
    assert_eq!(
        refused(&|s| s.engagement.depth_of_cut = -1.0),
        PassError::Negative { field: "engagement.depth_of_cut", value: -1.0 }
    );
    assert_eq!(
        refused(&|s| s.engagement.right = cut(-1.0)),
        PassError::Negative { field: "engagement.right.step_over", value: -1.0 }
    );
    assert_eq!(
        refused(&|s| s.cutter.corner_radius = 7.0),
        PassError::CornerTooLarge { corner_radius: 7.0, radius: 6.0 }
    );
    assert_eq!(
        refused(&|s| s.orientation.lead = FRAC_PI_2),
        PassError::AxisNotAbove { field: "orientation.lead", value: FRAC_PI_2 }
    );
    assert_eq!(
        refused(&|s| s.engagement.depth_of_cut = 30.0),
        PassError::DepthReachesCentre { depth_of_cut: 30.0, surface_radius: 30.0 }
    );
    assert_eq!(
        refused(&|s| s.surface = SectionSurface::Concave { radius: 2.0 }),
        PassError::CornerDoesNotFit { corner_radius: 2.0, surface_radius: 2.0 }
    );
    assert_eq!(
        refused(&|s| s.engagement.left = Beside::Border { distance: 48.0 }),
        PassError::TooFarAround { field: "engagement.left.distance", value: 48.0, surface_radius: 30.0 }
    );
    // Upright, the bottom is below the concave surface; on a convex one the neighbour's axis is.
    assert_eq!(refused(&|s| s.orientation = Orientation::default()), PassError::BelowSurface { pose: Pose::This });
    let over_the_side = refused(&|s| {
        s.surface = SectionSurface::Convex { radius: 4.0 };
        s.engagement.right = cut(4.0);
        s.orientation.lean = 1.0;
    });
    assert_eq!(over_the_side, PassError::BelowSurface { pose: Pose::Right });
    for (field, error) in not_finite {
        assert!(error.to_string().contains(field) && error.to_string().contains("give"), "{error}");
    }
}

#[test]
fn whatever_is_given_there_is_an_area_within_bounds_or_an_error() {
    let mut random = Random(43);
    let value = |random: &mut Random| match (12.0 * random.unit()) as u32 {
        0 => 0.0,
        1 => -random.unit(),
        2 => [f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, f64::MAX][(4.0 * random.unit()) as usize],
        3..6 => 10f64.powf(random.between(-9.0, 9.0)),
        _ => random.between(0.0, 10.0),
    };
    let angle = |random: &mut Random| match (8.0 * random.unit()) as u32 {
        0 => 0.0,
        1 => value(random),
        2 => 10f64.powf(random.between(-18.0, 0.0)),
        _ => random.between(-1.6, 1.6),
    };
    let beside = |random: &mut Random| match (3.0 * random.unit()) as u32 {
        0 => Beside::Stock,
        1 => Beside::Border { distance: value(random) },
        _ => cut(value(random)),
    };
    let mut areas = 0;
    for _ in 0..5_000 {
        let (radius, share) = (value(&mut random), random.unit());
        let surface = match (3.0 * random.unit()) as u32 {
            0 => SectionSurface::Plane,
            1 => SectionSurface::Convex { radius: value(&mut random) },
            _ => SectionSurface::Concave { radius: value(&mut random) },
        };
        let section = PassSection {
            cutter: CutterEnd { radius, corner_radius: [0.0, radius, radius * share][(3.0 * random.unit()) as usize] },
            surface,
            engagement: Engagement {
                depth_of_cut: value(&mut random),
                left: beside(&mut random),
                right: beside(&mut random),
            },
            orientation: Orientation { lead: angle(&mut random), lean: angle(&mut random) },
            neighbour_axis: if random.one_in(16.0) { NeighbourAxis::Turned } else { NeighbourAxis::Parallel },
        };
        match chip_of_pass(&section) {
            Ok(chip) => {
                let alone =
                    with(&section, |s| (s.engagement.left, s.engagement.right) = (Beside::Stock, Beside::Stock));
                let most = chip_of_pass(&alone).unwrap().area * (1.0 + 1e-9) + 2.0 * chip.error_bound;
                assert!(chip.error_bound.is_finite(), "{section:?}: {chip:?}");
                assert!((0.0..=most).contains(&chip.area), "{section:?}: {chip:?}, at most {most}");
                areas += 1;
            }
            Err(error) => assert!(error.to_string().len() > 20),
        }
    }
    assert!(areas > 500, "{areas}");
}

#[test]
fn lengths_of_no_cutter_are_refused() {
    let good = PassSection {
        cutter: CutterEnd { radius: 6.0, corner_radius: 2.0 },
        surface: SectionSurface::Convex { radius: 30.0 },
        engagement: Engagement { depth_of_cut: 2.0, left: Beside::Stock, right: cut(1.5) },
        orientation: Orientation { lead: 0.4, lean: 0.3 },
        neighbour_axis: NeighbourAxis::Parallel,
    };
    let refused = |change: &dyn Fn(&mut PassSection)| chip_of_pass(&with(&good, |s| change(s))).unwrap_err();
    let out = |field, value| PassError::OutOfRange { field, value };
    assert_eq!(refused(&|s| s.cutter.radius = 1e-7), out("cutter.radius", 1e-7));
    assert_eq!(refused(&|s| s.cutter.radius = 1e8), out("cutter.radius", 1e8));
    assert_eq!(refused(&|s| s.engagement.depth_of_cut = 2e7), out("engagement.depth_of_cut", 2e7));
    assert_eq!(refused(&|s| s.engagement.right = cut(2e7)), out("engagement.right.step_over", 2e7));
    assert_eq!(refused(&|s| s.surface = SectionSurface::Concave { radius: 1e16 }), out("surface.radius", 1e16));
}
