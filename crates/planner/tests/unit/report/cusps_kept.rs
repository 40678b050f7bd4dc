use nalgebra::Vector3;

use super::*;

fn places(heights: &[f64]) -> Vec<LeftPlace> {
    let at = |&height: &f64| LeftPlace {
        position: Point3::origin(),
        normal: Vector3::z_axis(),
        weight: 0.0,
        height,
        is_cut: true,
    };
    heights.iter().map(at).collect()
}

#[test]
fn the_text_settles_predicted_cusps_where_it_is_measured_to_keep_them() {
    let kept = |beside: &[Vec<LeftPlace>], region: Option<&[LeftPlace]>| is_kept(beside, region, 0.1);
    let (low, high) = (places(&[0.05, 0.1, 0.0]), places(&[0.05, 0.11, 0.0]));
    // A high place counts beside any of the points, a high one elsewhere on the region does not.
    assert!(kept(&[low.clone(), low.clone()], Some(&high)));
    assert!(!kept(&[low.clone(), high.clone()], Some(&high)));
    assert!(!kept(&[low.clone(), high], Some(&low)));
    // A point without a place keeps its prediction, unless all of its region is known to be low.
    assert!(!kept(&[low.clone(), Vec::new()], None));
    assert!(!kept(&[low.clone(), Vec::new()], Some(&[])));
    assert!(kept(&[low.clone(), Vec::new()], Some(&low)));
}

#[test]
fn places_across_the_strips_find_the_crests_beside_a_point() {
    let (in_first, across) = (Point3::new(3.0, 4.0, 5.0), Vector3::x_axis());
    for step_over in [0.2, 7.0] {
        let point = PointBeyond { place: in_first, copy: 2, in_first, across, step_over, height: Some(0.2) };
        let strips: Vec<NearSurface> = point.across_strips(1.0).collect();
        assert_eq!(strips.len(), 2 * PLACES_ACROSS as usize);
        // Wherever the strips begin: passes lie a step-over to both sides, and the crest of a ridge
        // of height 1 lies anywhere between.
        for crest in (0..=100).map(|k| (f64::from(k) / 50.0 - 1.0) * step_over) {
            let ridge = |near: &NearSurface| 1.0 - (2.0 * (near.point.x - in_first.x - crest) / step_over).powi(2);
            let highest = strips.iter().map(ridge).fold(f64::NEG_INFINITY, f64::max);
            assert!((0.98..=1.0).contains(&highest), "{highest} at {crest}");
        }
        let within = |near: &NearSurface| (near.point - in_first).norm() <= near.reach && near.copy == 2;
        assert!(strips.iter().all(within));
    }
}

#[test]
fn a_high_place_of_the_region_within_the_step_over_keeps_the_prediction() {
    let at = |x: f64, height: f64| LeftPlace { position: Point3::new(x, 0.0, 0.0), ..places(&[height])[0] };
    let in_first = Point3::new(0.0, 0.0, 2.0);
    let point =
        PointBeyond { place: in_first, copy: 0, in_first, across: Vector3::x_axis(), step_over: 5.0, height: None };
    let is_low = |all: &[LeftPlace], is_all_on_region: bool| {
        OnRegion { places: all, is_all_on_region, allowance: 2.0 }.is_low_around(&point, 0.1)
    };
    assert!(is_low(&[at(4.9, 0.1), at(5.1, 0.2)], true));
    assert!(!is_low(&[at(4.9, 0.11), at(3.0, 0.0)], true));
    // Without a place near it only a low region that has all passes settles it.
    assert!(is_low(&[at(9.0, 0.1)], true));
    assert!(!is_low(&[at(9.0, 0.1)], false));
    assert!(!is_low(&[], true));
}
