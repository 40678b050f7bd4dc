use facemill_cc_path::StockHeight;
use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::cut_point::Strip;
use nalgebra::{Point3, Vector3};

use super::*;

/// Returns the region where 0.3 mm is left on two squares of 10 mm, at x 0 to 10 and 30 to 40.
fn two_islands() -> LeftRegion {
    let place = |i: i32, j: i32| StockHeight {
        position: Point3::new(f64::from(i), f64::from(j), 0.0),
        normal: Vector3::z_axis(),
        height: if (0..=10).contains(&i) || (30..=40).contains(&i) { 0.3 } else { 0.0 },
        reach: 1.5,
        area: 1.0,
    };
    let measured: Vec<StockHeight> = (-5..=45).flat_map(|i| (0..=10).map(move |j| place(i, j))).collect();
    LeftRegion::new(&measured, 0.1, 1.0)
}

fn point(x: f64, facing: Vector3<f64>) -> CutPoint {
    let cc = CcPoint::new(Point3::new(x, 5.0, 0.0), facing, Vector3::y()).unwrap();
    CutPoint { cc, posture: Posture { tilt: 0.1, rotate: 0.0 } }
}

fn is_between(gaps: &LeftGaps, copy: usize, from: f64, to: f64) -> bool {
    let strip = Strip::on_plane((to - from).abs());
    let beside =
        Neighbour { point: point(to, Vector3::z()), strip, arc: strip.step_over, is_left: false, is_earlier: true };
    gaps.is_between(copy, &point(from, Vector3::z()), &beside)
}

#[test]
fn a_strip_ends_in_a_gap_where_its_middle_is_not_to_be_cut() {
    let gaps = LeftGaps { left: Some(Arc::new(two_islands())), first_from_place: vec![Isometry3::identity()] };
    for (from, to, is_gap) in [(2.0, 8.0, false), (9.0, 31.0, true), (31.0, 9.0, true), (32.0, 38.0, false)] {
        assert_eq!(is_between(&gaps, 0, from, to), is_gap, "{from} to {to}");
    }
    // Where the middle is within the overlap, the strip is to be cut.
    assert!(!is_between(&gaps, 0, 8.0, 15.0));
    // There is no such place of the pattern.
    assert!(!is_between(&gaps, 1, 9.0, 31.0));
}

#[test]
fn gaps_lie_in_each_place_of_the_pattern_as_in_the_first() {
    let moved = Isometry3::translation(100.0, 0.0, 0.0);
    let first_from_place = vec![Isometry3::identity(), moved.inverse()];
    let gaps = LeftGaps { left: Some(Arc::new(two_islands())), first_from_place };
    assert!(is_between(&gaps, 1, 109.0, 131.0) && !is_between(&gaps, 1, 102.0, 108.0));
}

#[test]
fn a_region_without_limits_has_no_gaps() {
    let gaps = LeftGaps { left: None, first_from_place: vec![Isometry3::identity()] };
    assert!(!is_between(&gaps, 0, 9.0, 31.0));
}
