use nalgebra::Vector3;

use super::*;

#[test]
fn rounds_look_at_what_further_passes_may_lower() {
    let place = |x: f64, is_cut: bool| LeftPlace {
        position: Point3::new(x, 0.0, 0.0),
        normal: Vector3::z_axis(),
        weight: 1.0,
        height: 0.3,
        is_cut,
    };
    let left = [place(0.0, true), place(4.0, false), place(9.0, true), place(11.0, true), place(30.0, true)];
    let at = |of: &[LeftPlace]| of.iter().map(|p| p.position.x).collect::<Vec<_>>();
    assert_eq!(at(&within_reach(&left, &[], 5.0)), [0.0, 9.0, 11.0, 30.0]);
    let without = [Point3::new(10.0, 4.0, 0.0), Point3::new(30.0, 0.0, 5.5)];
    assert_eq!(at(&within_reach(&left, &without, 5.0)), [0.0, 30.0]);
}
