use facemill_z_map::SurfacePlace;
use nalgebra::Vector3;

use super::*;

/// Places on a plane at x, each with its height.
fn places(at: &[[f64; 2]]) -> Vec<LeftPlace> {
    let place = |&[x, height]: &[f64; 2]| LeftPlace {
        position: Point3::new(x, 0.0, 0.0),
        normal: Vector3::z_axis(),
        weight: 0.0,
        height,
        is_cut: true,
        is_never_cut: false,
        left: SurfacePlace { position: Point3::new(x, 0.0, 0.0), normal: Vector3::z_axis(), stock: height },
    };
    at.iter().map(place).collect()
}

#[test]
fn the_text_settles_a_predicted_cusp_where_it_is_measured_to_keep_it() {
    // A point at x = 0 with a step-over of 5, on passes 2 above the surface.
    let in_first = Point3::new(0.0, 0.0, 2.0);
    let across = Vector3::x_axis();
    let point = PointBeyond { place: in_first, copy: 0, in_first, across, step_over: 5.0, height: None };
    let keeps = |all: &[[f64; 2]], is_all_on_region: bool, strips: &[[f64; 2]]| {
        let all = places(all);
        let highest = all.iter().map(|place| place.height).reduce(f64::max).filter(|_| is_all_on_region);
        TextHeights { places: &all, highest, allowance: 2.0 }.keep(&point, &places(strips), 0.1)
    };
    let low = [[1.0, 0.05], [2.0, 0.1]];
    // Within the step-over the place counts, on the strips and all over the region, beyond it not.
    assert!(keeps(&[[4.9, 0.1], [5.1, 0.2]], true, &low));
    assert!(!keeps(&[[4.9, 0.11], [3.0, 0.0]], true, &low));
    assert!(!keeps(&[[4.9, 0.1]], true, &[[1.0, 0.11], [2.0, 0.1]]));
    // Without places of the one or the other, only a low region that has all passes settles it.
    assert!(keeps(&[[9.0, 0.1]], true, &low) && !keeps(&[[9.0, 0.1]], false, &low));
    assert!(keeps(&[[9.0, 0.1]], true, &[]) && !keeps(&[[1.0, 0.1]], false, &[]));
    assert!(!keeps(&[[9.0, 0.11]], true, &low) && !keeps(&[], true, &low) && !keeps(&[], true, &[]));
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
