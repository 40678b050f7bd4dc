use crate::test_kit::Random;

use super::*;

/// The same by joining all pairs that are near, again and again.
fn by_pairs(places: &[(Point3<f64>, Unit<Vector3<f64>>)], reach: f64) -> Vec<Vec<usize>> {
    let n = places.len();
    let mut first: Vec<usize> = (0..n).collect();
    loop {
        let before = first.clone();
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
            let ((p, u), (q, v)) = (&places[a], &places[b]);
            if (p - q).norm() <= reach && u.dot(v) > 0.0 {
                let least = first[a].min(first[b]);
                (first[a], first[b]) = (least, least);
            }
        }
        if first == before {
            break;
        }
    }
    let of = |k: usize| (0..n).filter(|&a| first[a] == k).collect::<Vec<_>>();
    (0..n).map(of).filter(|island| !island.is_empty()).collect()
}

#[test]
fn islands_are_those_of_all_pairs() {
    let mut random = Random(77);
    for reach in [0.0, 2.0, 4.0, 9.0] {
        let place = |_| (random.point(12.0), random.direction());
        let places: Vec<_> = (0..60).map(place).collect();
        assert_eq!(place_islands(&places, reach), by_pairs(&places, reach), "{reach}");
    }
    assert!(place_islands(&[], 1.0).is_empty());
}
