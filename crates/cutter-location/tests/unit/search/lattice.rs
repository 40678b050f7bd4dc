use crate::search::bezier::SearchOrder;
use crate::search::lattice::*;

fn lattice(tilt: [f64; 2], rotate: [f64; 2]) -> Lattice {
    let posture = |k: usize| Posture { tilt: tilt[k].to_radians(), rotate: rotate[k].to_radians() };
    Lattice::new(&SearchCurve::new(posture(0), posture(1), SearchOrder::TiltFirst, 1.0).unwrap())
}

#[test]
fn every_posture_of_the_ranges_is_near_one_of_the_lattice() {
    for (tilt, rotate) in [([2.0, 15.0], [0.0, -85.0]), ([0.0, 60.0], [0.0, 180.0]), ([5.0, 5.0], [30.0, 30.0])] {
        let lattice = lattice(tilt, rotate);
        assert!(!lattice.postures.is_empty() && lattice.postures.len() <= MOST);
        let axis = |p: Posture| {
            let (sin, cos) = p.tilt.sin_cos();
            nalgebra::Vector3::new(sin * p.rotate.cos(), sin * p.rotate.sin(), cos)
        };
        for i in 0..=20 {
            for j in 0..=20 {
                let within = |ends: [f64; 2], k: i32| (ends[0] + (ends[1] - ends[0]) * f64::from(k) / 20.0).abs();
                let p = Posture { tilt: within(tilt, i).to_radians(), rotate: within(rotate, j).to_radians() };
                let nearest = lattice.postures.iter().map(|q| axis(*q).angle(&axis(p))).fold(f64::INFINITY, f64::min);
                assert!(nearest <= lattice.spacing, "{p:?}: {nearest} {}", lattice.spacing);
            }
        }
    }
    assert_eq!(lattice([5.0, 5.0], [30.0, 30.0]).postures.len(), 1);
}
