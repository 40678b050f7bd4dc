use super::*;

#[test]
fn a_line_reaches_half_way_to_the_farthest_end_beside_on_either_side() {
    let cc = CcPoint::new(nalgebra::Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let end = |which| SegmentEnd { cc: &cc, outward: Vector3::x(), which, slant: 0.0 };
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

/// A disc that leans aside cuts one half of its strip later than the other: that one needs a longer
/// line.
#[test]
fn a_slanted_rim_needs_more_way_on_the_side_that_it_cuts_later() {
    let cc = CcPoint::new(nalgebra::Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let found = [(30.0, 20.0), (-30.0, 20.0)];
    for slant in [-0.5, 0.0, 0.4] {
        let end = SegmentEnd { cc: &cc, outward: Vector3::x(), which: PassEnd::Entry, slant };
        let [right, left] = [-1.0, 1.0].map(|side| end.lead_of_side(&found, side, 80.0));
        assert!((left - (10.0 - 15.0 * slant).max(10.0)).abs() < 1e-9, "{left}");
        assert!((right - (10.0 + 15.0 * slant).max(10.0)).abs() < 1e-9, "{right}");
    }
}

/// The border of a region leans on beside its last pass.
#[test]
fn beside_the_last_pass_the_border_runs_on_as_on_the_other_side() {
    let cc = CcPoint::new(nalgebra::Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let end = SegmentEnd { cc: &cc, outward: Vector3::x(), which: PassEnd::Entry, slant: 0.0 };
    let leads = |found: &[(f64, f64)]| [1.0, -1.0].map(|side| end.lead_of_side(found, side, 80.0));
    assert_eq!(leads(&[(26.8, -16.0)]), [0.0, 8.0]);
    assert_eq!(leads(&[(26.8, 16.0)]), [8.0, 0.0]);
}
