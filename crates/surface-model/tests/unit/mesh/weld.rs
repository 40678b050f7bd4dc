use crate::mesh::weld::*;
use crate::test_kit::Random;

#[test]
fn welding_is_that_of_a_plain_loop() {
    let mut rng = Random(6);
    for tolerance in [0.0, 1e-6, 0.1, 0.5] {
        let mut points: Vec<Point3<f64>> = (0..400).map(|_| rng.point(2.0)).collect();
        for k in 0..400 {
            let p = points[k] + rng.vector(if k % 2 == 0 { 0.0 } else { tolerance });
            points.push(p);
        }
        points.push(Point3::new(-0.0, 0.0, 0.0));
        points.push(Point3::new(0.0, -0.0, 0.0));
        let mut plain: Vec<u32> = Vec::new();
        for (k, p) in points.iter().enumerate() {
            let stands = |j: &u32| plain[*j as usize] == *j;
            let near = |j: &u32| (points[*j as usize] - p).norm() <= tolerance;
            let joined = (0..k as u32).filter(stands).find(near).unwrap_or(k as u32);
            plain.push(joined);
        }
        assert_eq!(weld(&points, tolerance), plain);
        assert_eq!(plain[801], plain[800]);
    }
}
