use super::*;

#[test]
fn a_line_reaches_half_way_to_the_farthest_end_beside_on_either_side() {
    let cc = CcPoint::new(nalgebra::Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let end = |which| SegmentEnd { cc: &cc, outward: Vector3::x(), which };
    // A partial pass ends far back and a little nearer than the full one that ends farther out.
    let found = [(28.0, -69.6), (29.3, 20.2), (58.0, 44.0), (-28.8, -22.0)];
    let exit = end(PassEnd::Exit);
    let right = exit.lead_of_side(&found, 1.0, 80.0);
    assert!((right - (10.1 + 29.3 * 29.3 / 640.0)).abs() < 1e-9, "the next strip but one has no say: {right}");
    let left = exit.lead_of_side(&found, -1.0, 80.0);
    assert!((left - 28.8 * 28.8 / 640.0).abs() < 1e-9, "{left}");
    assert_eq!(end(PassEnd::Entry).lead_of_side(&found, 1.0, 80.0), 10.1);
    assert_eq!(end(PassEnd::Entry).lead_of_side(&[], 1.0, 80.0), 0.0);
}
