use crate::body::bound::*;
use crate::body::{Placed, for_body};
use crate::test_kit::{Random, sample_solids};

#[test]
fn bound_is_below_the_distance_of_every_point() {
    let mut lcg = Random(21);
    for solid in sample_solids() {
        for _ in 0..300 {
            let pose = lcg.pose(30.0);
            let flat = lcg.pose(30.0);
            let thickness = lcg.between(0.0, 3.0);
            let points: Vec<_> = (0..12)
                .map(|_| {
                    flat * Point3::new(lcg.between(-9.0, 9.0), lcg.between(-9.0, 9.0), lcg.between(0.0, thickness))
                })
                .collect();
            let slab = Slab::across(least_spread(points.iter()), points.iter());
            let mut slabs = Slabs::NONE;
            slabs.set(3, &slab);
            let bound = for_body!(Placed::new(&solid, &pose), |b| slabs.least_distances(&b)[3]);
            for p in &points {
                let distance = solid.core_distance(&pose.inverse_transform_point(p));
                assert!(bound <= distance + 1e-12, "{solid:?}: {bound} above {distance}");
            }
        }
    }
}

#[test]
fn slab_of_a_flat_piece_is_thin() {
    let mut lcg = Random(22);
    for _ in 0..100 {
        let flat = lcg.pose(50.0);
        let points: Vec<_> =
            (0..20).map(|_| flat * Point3::new(lcg.between(-9.0, 9.0), lcg.between(-9.0, 9.0), 0.0)).collect();
        let slab = Slab::across(least_spread(points.iter()), points.iter());
        assert!(slab.half_thickness < 1e-6 && slab.radius < 14.0);
    }
}

#[test]
fn single_and_repeated_points_have_a_slab() {
    for n in 1..4 {
        let points = vec![Point3::new(1.0, 2.0, 3.0); n];
        let slab = Slab::across(least_spread(points.iter()), points.iter());
        assert!((slab.center - points[0]).norm() < 1e-12 && slab.radius < 1e-10);
    }
}
