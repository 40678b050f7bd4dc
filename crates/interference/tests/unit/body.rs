use super::*;
use crate::test_kit::{Random, sample_solids};

#[test]
fn distance_is_that_of_the_solid_and_its_gradient_a_slope() {
    let mut lcg = Random(11);
    for solid in sample_solids() {
        for _ in 0..400 {
            let pose = lcg.pose(40.0);
            let p = pose * lcg.point(60.0);
            let (f, g) = distance(&Placed::new(&solid, &pose), &p);
            let expected = solid.core_distance(&pose.inverse_transform_point(&p));
            assert!((f - expected).abs() < 1e-11, "{solid:?}: {f} for {expected}");
            assert!(f == 0.0 || (g.norm() - 1.0).abs() < 1e-12);
            // Convexity: the slope bounds the distance everywhere.
            let q = pose * lcg.point(60.0);
            let (there, _) = distance(&Placed::new(&solid, &pose), &q);
            assert!(there >= f + g.dot(&(q - p)) - 1e-10, "{solid:?}");
        }
    }
}

#[test]
fn support_point_is_of_the_body_and_none_is_farther() {
    let mut lcg = Random(12);
    for solid in sample_solids() {
        for _ in 0..100 {
            let pose = lcg.pose(40.0);
            let along = lcg.direction().into_inner();
            let body = Placed::new(&solid, &pose);
            let s = support(&body, &along);
            assert!(distance(&body, &s).0 < 1e-12);
            for _ in 0..50 {
                // The nearest point of the body to any point is p − f·g.
                let p = pose * lcg.point(80.0);
                let (f, g) = distance(&body, &p);
                assert!(along.dot(&(p - g * f - s)) < 1e-11, "{solid:?}");
            }
        }
    }
}

#[test]
fn eight_distances_are_those_of_one_at_a_time() {
    let mut lcg = Random(13);
    for solid in sample_solids() {
        for k in 0..300 {
            let pose = lcg.pose(40.0);
            let body = Placed::new(&solid, &pose);
            let (mut points, mut normals) = (Lanes3::ZERO, Lanes3::ZERO);
            for lane in 0..N {
                // On the axis, in the body, level with an end, and anywhere.
                let q = match (k + lane) % 4 {
                    0 => Point3::new(0.0, 0.0, lcg.between(-60.0, 60.0)),
                    1 => solid.interior_point(),
                    2 => Point3::new(lcg.between(-60.0, 60.0), 0.0, solid.aabb().min.z),
                    _ => lcg.point(60.0),
                };
                points.set(lane, &(pose * q).coords);
                normals.set(lane, &lcg.direction().into_inner());
            }
            let (f, along) = for_body!(&body, |b| b.distances(&points, &normals));
            for lane in 0..N {
                let (expected, g) = distance(&body, &points.get(lane).into());
                if matches!(solid, Solid::Hull(_)) {
                    // A bound with its own slope, which holds everywhere.
                    let q = points.get(lane) + normals.get(lane) * lcg.between(-30.0, 30.0);
                    let along_normal = (q - points.get(lane)).dot(&normals.get(lane));
                    let there = distance(&body, &q.into()).0;
                    assert!(f[lane] <= expected + 1e-12 && f[lane] >= 0.0);
                    assert!(there >= f[lane] + along[lane] * along_normal - 1e-10, "{solid:?}");
                    continue;
                }
                assert!((f[lane] - expected).abs() < 1e-12, "{solid:?}: {} for {expected}", f[lane]);
                // Where the distance is rounding only, its slope is, too.
                if expected > 1e-9 {
                    assert!((along[lane] - g.dot(&normals.get(lane))).abs() < 1e-6, "{solid:?}");
                }
            }
        }
    }
}

fn distance(body: &Placed, p: &Point3<f64>) -> (f64, Vector3<f64>) {
    for_body!(body, |b| b.distance(p))
}

fn support(body: &Placed, along: &Vector3<f64>) -> Point3<f64> {
    for_body!(body, |b| b.support(along))
}
