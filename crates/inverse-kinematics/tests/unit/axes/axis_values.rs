use crate::axes::axis_values::*;

#[test]
fn lerp_meets_both_ends_exactly() {
    let (a, b) = (AxisValues::from([0.1, -7.3, 1e6]), AxisValues::from([0.7, 3.3, -1.0 / 3.0]));
    assert_eq!(a.lerp(&b, 0.0), a);
    assert_eq!(a.lerp(&b, 1.0), b);
}

#[test]
fn too_many_values_are_refused() {
    assert!(AxisValues::from_slice(&[0.0; MAX_AXES]).is_some());
    assert!(AxisValues::from_slice(&[0.0; MAX_AXES + 1]).is_none());
}
