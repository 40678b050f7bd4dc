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

/// Plane region by the places that it holds.
struct PlaneRegion<F>(F);

impl<F: Fn(f64, f64) -> bool + Sync> CutRegion for PlaneRegion<F> {
    fn holds(&self, _: u32, p: &Point3<f64>) -> bool {
        self.0(p.x, p.y)
    }

    fn half_strip(&self) -> f64 {
        10.0
    }
}

/// Half a strip times the slope of the border, whether it leans to one side or the region ends in a
/// corner ahead; nothing more is needed where it lies across.
#[test]
fn a_line_reaches_as_far_as_the_region_goes_on_in_the_half_strips_beside_it() {
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let end = |which| SegmentEnd { cc: &cc, outward: Vector3::x(), which, slant: 0.0 };
    let lead =
        |region: &dyn CutRegion, found: &[(f64, f64)]| end(PassEnd::Entry).lead_to_border(found, (region, 0), 80.0);
    let length = |region: &dyn CutRegion, found: &[(f64, f64)]| lead(region, found).unwrap().lead;
    let beside = [(12.0, 12.0), (-12.0, -12.0)];
    for slope in [0.0, 0.3, 1.0, 1.7] {
        let leaning = PlaneRegion(move |x, y| x <= slope * y);
        assert_eq!(lead(&leaning, &beside).unwrap().is_aslant, slope > 0.0);
        let found = length(&leaning, &beside);
        assert!((found - 6.0 * slope).abs() < 0.05, "{slope}: {found}");
    }
    // The end beside is as far out, and the corner of the region is between both.
    let corner = PlaneRegion(|x: f64, y: f64| x <= y.min(12.0 - y));
    let found = length(&corner, &[(12.0, 0.0), (-12.0, -12.0)]);
    assert!((found - 6.0).abs() < 0.05, "{found}");
    // Beside the last pass the strip is as wide as any may be.
    let found = length(&PlaneRegion(|x, y| x <= y), &[(-12.0, -12.0)]);
    assert!((found - 10.0).abs() < 0.1, "{found}");
    let exit = end(PassEnd::Exit).lead_to_border(&beside, (&PlaneRegion(|x, _| x <= 0.0), 0), 80.0).unwrap();
    assert!(
        (exit.lead - 36.0 / 160.0).abs() < 0.05 && !exit.is_aslant,
        "{exit:?}: the rim cuts the side of the strip later"
    );
    let inside = PlaneRegion(|x, _| x <= 50.0);
    assert_eq!(lead(&inside, &beside), None, "the end is not at the border");
}
