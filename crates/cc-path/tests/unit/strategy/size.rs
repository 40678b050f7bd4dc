use crate::layout::generate_passes::lay_passes;
use crate::region::Region;
use crate::sections::{CylindricalSections, ParallelPlanes};
use crate::strategy::size::*;
use crate::test_kit::{plane, surface};
use facemill_cl_data::Silent;
use nalgebra::Vector3;

fn planes() -> Sections {
    let normal = Vector3::y_axis();
    Sections::ParallelPlanes(ParallelPlanes { origin: Point3::origin(), normal, from: None, to: None })
}

fn rings() -> Sections {
    let axis_direction = Vector3::z_axis();
    let axis_origin = Point3::new(-5.0, 3.0, 0.0);
    Sections::CylindricalSections(CylindricalSections {
        axis_origin,
        axis_direction,
        from_radius: 10.0,
        to_radius: 100.0,
    })
}

#[test]
fn passes_with_too_many_points_are_refused_with_a_setting_that_is_enough() {
    let s = surface(plane(30.0, 20.0, 3, 2));
    let cases = [
        (planes(), LaySettings { max_step: 1e-3, max_points: 500, ..LaySettings::default() }),
        (rings(), LaySettings { chord_tolerance: 1e-4, max_points: 300, ..LaySettings::default() }),
        (rings(), LaySettings { max_step: 0.2, max_points: 500, ..LaySettings::default() }),
    ];
    let laid = |strategy: &Sections, settings: &LaySettings| {
        lay_passes(&s, &Region::default(), &(*strategy).into(), settings, &|_| f64::INFINITY, &Silent)
    };
    for (strategy, settings) in cases {
        let Err(PathError::TooManyPoints { limit, remedy, .. }) = laid(&strategy, &settings) else {
            panic!("{settings:?}")
        };
        let enough = match remedy {
            Remedy::LargestStep(max_step) => LaySettings { max_step, ..settings.clone() },
            Remedy::ChordTolerance(chord_tolerance) => LaySettings { chord_tolerance, ..settings.clone() },
            other => panic!("{other}"),
        };
        let n: usize = laid(&strategy, &enough).expect("a setting").passes.iter().map(|p| p.pass.points.len()).sum();
        assert!(n <= limit && n > limit / 8, "{n} of {limit}");
    }
}

#[test]
fn regions_with_too_many_pieces_are_refused_with_a_setting_that_is_enough() {
    let big = [Point3::origin(), Point3::new(900.0, 0.0, 0.0), Point3::new(0.0, 800.0, 50.0)];
    let facets = || std::iter::repeat_n(big, 3);
    for (strategy, fineness) in [
        (planes(), Fineness { max_edge: 0.01, max_bend: 1.0, cuts_range: false }),
        (rings(), Fineness { max_edge: 50.0, max_bend: 1e-5, cuts_range: false }),
    ] {
        let Err(PathError::TooManyPieces { remedy, .. }) = check_pieces(facets(), Some(&strategy), &fineness) else {
            panic!("{strategy:?}")
        };
        let enough = match remedy {
            Remedy::LargestStepOver(max_edge) => Fineness { max_edge, ..fineness },
            Remedy::ChordTolerance(chord) => Fineness { max_bend: 0.5 * chord, ..fineness },
            other => panic!("{other}"),
        };
        check_pieces(facets(), Some(&strategy), &enough).unwrap();
    }
}

#[test]
fn a_longest_edge_that_is_a_share_of_the_step_over_asks_for_a_step_over_that_is_enough() {
    let big = [Point3::origin(), Point3::new(900.0, 0.0, 0.0), Point3::new(0.0, 800.0, 50.0)];
    let checked = |step_over: f64| {
        let fineness = Fineness { max_edge: 0.25 * step_over, max_bend: 1.0, cuts_range: true };
        check_pieces([big].into_iter(), None, &fineness).map_err(|e| e.with_edge_share(0.25))
    };
    let e = checked(2.4).unwrap_err();
    let Some(Remedy::LargestStepOver(enough)) = e.remedy() else { panic!("{e}") };
    assert!(enough > 2.4 && enough < 5.0, "{e}");
    checked(enough).unwrap();
}

#[test]
fn remedies_are_rounded_up_to_two_digits() {
    for (value, up) in [(0.1234, 0.13), (1.0, 1.1), (987.0, 990.0), (2.0e-5, 2.1e-5)] {
        let Remedy::LargestStep(rounded) = Remedy::LargestStep(value).rounded_up() else { panic!() };
        assert!((rounded / up - 1.0).abs() < 1e-12, "{value}: {rounded}");
    }
}
