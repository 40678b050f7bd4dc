use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::cut_point::{CutPoint, Strip};
use facemill_test_kit::Random;
use nalgebra::Vector3;

use super::*;

#[test]
fn places_of_a_strip_are_those_between_its_sides_and_near_the_line_across() {
    let mut rng = Random(3);
    let mut point = |size: f64| Point3::from(Vector3::from_fn(|_, _| rng.between(-size, size)));
    let places: Vec<HighPlace> = (0..400)
        .map(|k| HighPlace {
            position: point(10.0),
            normal: Vector3::z_axis(),
            height: 0.1 + f64::from(k) * 1e-4,
            round: 1,
        })
        .collect();
    let high = HighPlaces::new(places.clone());
    let mut n_found = 0;
    for _ in 0..200 {
        let at = |position: Point3<f64>| CutPoint {
            cc: CcPoint::new(position, Vector3::z(), Vector3::x()).unwrap(),
            posture: Posture::default(),
        };
        let (own, other) = (at(point(8.0)), at(point(8.0)));
        let width = (other.cc.position - own.cc.position).norm();
        let beside =
            Neighbour { point: other, strip: Strip::on_plane(width), is_left: true, is_earlier: true, arc: width };
        // By angles at both ends and the distance from the line.
        let is_in = |place: &HighPlace| {
            let (a, b) = (place.position - own.cc.position, place.position - other.cc.position);
            let across = other.cc.position - own.cc.position;
            let is_between = a.dot(&across) >= 0.0 && b.dot(&across) <= 0.0;
            is_between && a.cross(&across).norm() / width <= BESIDE * width
        };
        let highest = places.iter().filter(|p| is_in(p)).map(|p| p.height).reduce(f64::max);
        assert_eq!(high.in_strip(&own, &beside), highest);
        n_found += usize::from(highest.is_some());
    }
    assert!((20..200).contains(&n_found), "{n_found}");
}
