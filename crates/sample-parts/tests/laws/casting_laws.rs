//! Laws of castings, by distances of points from the surface of part and casting.

use facemill_sample_parts::{BladeResolution, CastingAllowance, PropellerSeries, PropellerSpec, blade, casting, hub};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::Point3;

/// Rounding and facets: a vertex moves by the allowance of its own place, and its facets lie
/// between vertices, mm.
const FACETS: f64 = 0.25;

/// Corners and centres of a mesh's triangles.
fn places(mesh: &TriMesh) -> Vec<Point3<f64>> {
    let centre =
        |t: usize| Point3::from(mesh.corners(t).iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0);
    mesh.vertices().iter().copied().chain((0..mesh.triangles().len()).map(centre)).collect()
}

/// Asserts that a casting has material of the allowance everywhere on its part.
fn check(part: &TriMesh, mean: f64, variation: f64) {
    let allowance = CastingAllowance::new(mean, variation).expect("an allowance");
    let cast = casting(part, allowance).expect("a casting");
    assert_eq!(cast.triangles(), part.triangles());
    let (on_part, on_cast) = (
        Surface::new(part.clone(), SurfaceSettings::default()),
        Surface::new(cast.clone(), SurfaceSettings::default()),
    );
    let distance = |surface: &Surface, p: &Point3<f64>| surface.closest_point(p, f64::INFINITY).map(|c| c.distance);
    let mut thicknesses: Vec<f64> = Vec::new();
    for p in places(part) {
        assert!(on_cast.is_inside(&p), "{p} of the part is not in its casting");
        thicknesses.extend(distance(&on_cast, &p));
    }
    assert!(thicknesses.iter().all(|d| *d >= allowance.least() - FACETS), "{thicknesses:?}");
    thicknesses.sort_by(f64::total_cmp);
    let (low, high) = (thicknesses[thicknesses.len() / 50], thicknesses[thicknesses.len() * 49 / 50]);
    let middle = thicknesses[thicknesses.len() / 2];
    assert!(middle < allowance.largest(), "half of the part has more than {middle} mm on it");
    assert!(high - low > 0.5 * variation, "the allowance hardly varies: {low} to {high}");
    for p in places(&cast) {
        assert!(!on_part.is_inside(&p));
        let d = distance(&on_part, &p).expect("a distance");
        assert!(d >= allowance.least() - FACETS, "{d} mm at {p}");
        // Where a corner is sharp its vertex is farther away than its facets.
        assert!(d <= allowance.largest() / 0.35 + FACETS, "{d} mm at {p}");
    }
}

#[test]
fn a_casting_has_its_allowance_on_blade_and_hub() {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 1000.0).expect("a propeller");
    let resolution = BladeResolution::new(30, 40).expect("a resolution");
    check(&blade(&spec, resolution), 6.0, 3.0);
    check(&hub(&spec, 0.05).expect("a hub"), 6.0, 3.0);
}

#[test]
fn a_casting_without_material_is_the_part() {
    let spec = PropellerSpec::new(PropellerSeries::Vp1304, 500.0).expect("a propeller");
    let part = blade(&spec, BladeResolution::new(10, 12).expect("a resolution"));
    let cast = casting(&part, CastingAllowance::new(0.0, 0.0).expect("no allowance")).expect("a casting");
    assert_eq!(cast.vertices(), part.vertices());
}

#[test]
fn an_allowance_varies_by_no_more_than_itself() {
    assert!(CastingAllowance::new(3.0, 3.5).is_err());
    assert!(CastingAllowance::new(-1.0, 0.0).is_err());
    assert!(CastingAllowance::new(f64::NAN, 0.0).is_err());
}
