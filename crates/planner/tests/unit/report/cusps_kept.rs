use nalgebra::Vector3;

use super::*;

/// Returns places 1 mm apart on a plane, 0.05 mm high, but for one of another height at x = 20.
fn places_with(height: f64) -> Vec<LeftPlace> {
    let at = |x: i32, y: i32| LeftPlace {
        position: Point3::new(f64::from(x), f64::from(y), 0.0),
        normal: Vector3::z_axis(),
        weight: 1.0,
        height: if (x, y) == (20, 0) { height } else { 0.05 },
        is_cut: true,
    };
    (0..=40).flat_map(|x| (-5..=5).map(move |y| at(x, y))).collect()
}

fn beyond(x: f64, step_over: f64, allowance: f64) -> PointBeyond {
    let place = Point3::new(x, 0.0, allowance);
    PointBeyond { place, in_first: place, step_over, height: Some(0.2) }
}

#[test]
fn the_text_settles_predicted_cusps_where_it_is_measured_to_keep_them() {
    let kept = |points: &[PointBeyond], left: &[LeftPlace], allowance: f64, is_all_on_region: bool| {
        is_kept(points, left, &KeptLimits { least_strip: 2.0, cusp: 0.1, allowance, is_all_on_region })
    };
    let is_kept = |points: &[PointBeyond], left: &[LeftPlace], allowance: f64| kept(points, left, allowance, true);
    let (low, high) = (places_with(0.1), places_with(0.11));
    for allowance in [0.0, 6.0] {
        let at = |x: f64, step_over: f64| beyond(x, step_over, allowance);
        // A high place counts within the step-over of a point, of any of the points.
        assert!(is_kept(&[at(10.0, 5.0)], &high, allowance));
        assert!(!is_kept(&[at(16.0, 5.0)], &high, allowance));
        assert!(!is_kept(&[at(10.0, 5.0), at(16.0, 5.0)], &high, allowance));
        assert!(is_kept(&[at(16.0, 5.0)], &low, allowance));
        // A strip that the places may miss keeps its prediction.
        assert!(!is_kept(&[at(10.0, 1.9)], &low, allowance));
        // So does a point without a place, unless all of its region is low.
        assert!(!is_kept(&[at(60.0, 5.0)], &high, allowance));
        assert!(is_kept(&[at(60.0, 5.0)], &low, allowance));
        assert!(!kept(&[at(60.0, 5.0)], &low, allowance, false));
        assert!(!is_kept(&[at(10.0, 5.0)], &[], allowance));
    }
}
