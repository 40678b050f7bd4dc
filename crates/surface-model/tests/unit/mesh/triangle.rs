use crate::mesh::triangle::*;
use crate::test_kit::Random;

/// The nearest point is the one from which no point of the triangle lies further towards `p`.
#[test]
fn no_corner_lies_further_towards_the_point() {
    let mut rng = Random(5);
    for k in 0..20_000 {
        let mut t = [rng.point(1.0), rng.point(1.0), rng.point(1.0)];
        match k % 10 {
            0 => t[2] = t[0],
            1 => t[2] = t[0] + (t[1] - t[0]) * 0.3,
            2 => t[2] = t[0] + (t[1] - t[0]) * 0.3 + rng.vector(1e-9),
            _ => {}
        }
        let far = if k % 11 == 0 { 1e3 } else { 2.0 };
        let p = if k % 7 == 0 { t[1] + (t[2] - t[1]) * rng.unit() } else { rng.point(far) };
        let w = closest_on_triangle(&p, &t);
        assert!(w.iter().all(|x| (0.0..=1.0).contains(x)) && (w.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{w:?}");
        let q = Point3::from(t[0].coords * w[0] + t[1].coords * w[1] + t[2].coords * w[2]);
        for corner in &t {
            assert!((p - q).dot(&(corner - q)) < 2e-9 * far, "case {k}: {w:?}");
        }
    }
}
