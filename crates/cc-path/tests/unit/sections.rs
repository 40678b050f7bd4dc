use super::*;
use crate::test_kit::Random;

fn cylinders(axis_origin: Point3<f64>, axis: Vector3<f64>) -> Sections {
    let axis_direction = Unit::new_normalize(axis);
    let sections = CylindricalSections { axis_origin, axis_direction, from_radius: 0.0, to_radius: 1e9 };
    Sections::CylindricalSections(sections)
}

#[test]
fn a_crossing_has_the_level_wherever_the_ends_straddle_it() {
    let mut rng = Random(1);
    for _ in 0..3000 {
        let planes = ParallelPlanes { origin: rng.point(5.0), normal: rng.direction(), from: None, to: None };
        for s in [Sections::ParallelPlanes(planes), cylinders(rng.point(5.0), rng.direction().into_inner())] {
            let (a, b) = (rng.point(100.0), rng.point(100.0));
            let level = s.level(&a) + rng.unit() * (s.level(&b) - s.level(&a));
            for (p, q) in [(a, b), (b, a)] {
                let at = p + (q - p) * s.crossing(&p, &q, level);
                assert!((s.level(&at) - level).abs() < 1e-11, "{s:?} from {p} to {q}: {}", s.level(&at));
            }
        }
    }
}

#[test]
fn the_slope_is_what_the_level_gains_per_length_along_the_surface() {
    let mut rng = Random(2);
    for _ in 0..500 {
        let s = cylinders(rng.point(5.0), rng.direction().into_inner());
        let (p, n) = (rng.point(100.0), rng.direction());
        let across = Unit::try_new(n.cross(&Vector3::new(0.3, 0.5, 0.7)), 1e-3).unwrap();
        let steepest = (0..720)
            .map(|k| nalgebra::Rotation3::from_axis_angle(&n, f64::from(k).to_radians() / 2.0) * across)
            .map(|d| (s.level(&(p + d.into_inner() * 1e-5)) - s.level(&p)) / 1e-5)
            .fold(0.0, f64::max);
        assert!((s.slope(&p, &n) - steepest).abs() < 1e-4);
    }
    let on_axis = cylinders(Point3::origin(), Vector3::z());
    assert_eq!(on_axis.slope(&Point3::new(0.0, 0.0, 3.0), &Vector3::z_axis()), 1.0);
}
