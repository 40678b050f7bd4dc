use std::slice::from_ref;

use facemill_z_map::SurfacePlace;
use nalgebra::Vector3;

use super::*;

#[test]
fn rounds_look_at_what_further_passes_may_lower() {
    let place = |x: f64, is_cut: bool| {
        let (position, normal, height) = (Point3::new(x, 0.0, 0.0), Vector3::z_axis(), 0.3);
        let left = SurfacePlace { position, normal, stock: height };
        LeftPlace { position, normal, weight: 1.0, height, is_cut, is_never_cut: !is_cut, left }
    };
    let left = [place(0.0, true), place(4.0, false), place(9.0, true), place(11.0, true), place(30.0, true)];
    let at = |of: &[LeftPlace]| of.iter().map(|p| p.position.x).collect::<Vec<_>>();
    assert_eq!(at(&within_reach(&left, &[], 5.0)), [0.0, 9.0, 11.0, 30.0]);
    let without = [Point3::new(10.0, 4.0, 0.0), Point3::new(30.0, 0.0, 5.5)];
    assert_eq!(at(&within_reach(&left, &without, 5.0)), [0.0, 30.0]);
}

fn figures(out_of_reach: f64, above_fraction: f64, time_s: f64, points_without_posture: usize) -> RoundFigures {
    let report = WidthRoundReport {
        passes: 10,
        passes_added: 0,
        length_mm: 1000.0,
        time_s,
        largest_mm: 0.1,
        above_fraction,
        points_without_posture,
        is_cut: false,
    };
    RoundFigures { report, out_of_reach }
}

#[test]
fn a_better_round_reaches_as_much_whatever_points_it_has_without_posture() {
    let first = figures(0.01, 0.0, 100.0, 5);
    let is_better = |round: &RoundFigures, other: &RoundFigures| {
        super::is_better(&[], from_ref(&first), from_ref(round), from_ref(other))
    };
    let reaches = figures(0.0105, 0.0, 90.0, 500);
    let loses = figures(0.0115, 0.0, 80.0, 5);
    assert!(is_better(&reaches, &first) && !is_better(&first, &reaches));
    assert!(is_better(&first, &loses) && !is_better(&loses, &reaches));
}
