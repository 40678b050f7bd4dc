use super::*;
use facemill_cl_data::RoundBox;

fn solids() -> Vec<Solid> {
    let mut all = vec![Solid::Box(RoundBox { half_extents: Vector3::new(3.0, 2.0, 0.5), rounding: 1.0 })];
    for (radius_low, radius_high) in [(4.0, 4.0), (4.0, 1.0), (0.0, 3.0), (0.0, 0.0)] {
        for z_high in [1.0, 5.0] {
            all.push(Solid::Frustum(RoundFrustum { z_low: 1.0, z_high, radius_low, radius_high, rounding: 0.5 }));
        }
    }
    all
}

#[test]
fn the_nearest_point_is_in_the_body_and_at_its_distance() {
    for solid in solids() {
        for i in 0..1000i32 {
            let at = |k: i32| f64::from((i / k) % 10) * 1.7 - 7.0;
            let p = Point3::new(at(1), at(10), at(100));
            let near = nearest_of_core(&solid, &p);
            assert!(solid.core_distance(&near) < 1e-12, "{solid:?} {p}: {near}");
            assert!(((p - near).norm() - solid.core_distance(&p)).abs() < 1e-12, "{solid:?} {p}: {near}");
            // No point of the body is beyond the support in the direction away from it.
            let direction = p - near;
            assert!(direction.dot(&near.coords) <= core_support(&solid, &direction) + 1e-9);
        }
    }
}

#[test]
fn a_proven_gap_is_not_more_than_the_distance_and_close_to_it() {
    for solid in solids() {
        for i in 0..1000i32 {
            let at = |k: i32| f64::from((i / k) % 10) * 2.3 - 10.0;
            let min = Point3::new(at(1), at(10), at(100));
            let body = Aabb { min, max: min + Vector3::new(1.0, 2.0, 8.0) };
            let pose = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.4, f64::from(i), 0.1));
            // Distance of points on a grid of the box, which is at most a grid step too large.
            let n = 8;
            let points = (0..=n).flat_map(|a| (0..=n).flat_map(move |b| (0..=n).map(move |c| [a, b, c])));
            let sampled = points
                .map(|k| {
                    let t = k.map(|k| f64::from(k) / f64::from(n));
                    let p = min + Vector3::new(t[0], 2.0 * t[1], 8.0 * t[2]);
                    solid.core_distance(&pose.inverse_transform_point(&p))
                })
                .fold(f64::INFINITY, f64::min);
            match gap(&body, &solid, &pose, 0.25, 50) {
                Gap::AtLeast(d) => assert!(d > 0.25 && d <= sampled + 1e-12, "{solid:?} {body:?}: {d} {sampled}"),
                Gap::Within => assert!(sampled < 0.25 + 0.6, "{solid:?} {body:?}: {sampled}"),
                Gap::Unknown => assert!(sampled < 0.25 + 0.6, "{solid:?} {body:?}: {sampled}"),
            }
        }
    }
}
