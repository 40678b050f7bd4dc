//! Laws of castings, by distances of points from the surface of part and casting.

use facemill_sample_parts::{
    BladeResolution, Bore, CastingAllowance, PropellerSeries, PropellerSpec, RootFillet, SolidForm, TurnedHub, blade,
    blade_pose, casting, hub, propeller_solid, turned_casting,
};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::Point3;

/// Corners and centres of a mesh's triangles.
fn places(mesh: &TriMesh) -> Vec<Point3<f64>> {
    let centre =
        |t: usize| Point3::from(mesh.corners(t).iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0);
    mesh.vertices().iter().copied().chain((0..mesh.triangles().len()).map(centre)).collect()
}

fn surface(mesh: &TriMesh) -> Surface {
    Surface::new(mesh.clone(), SurfaceSettings::default())
}

/// Asserts that a casting has material of the allowance everywhere on its part, and returns its
/// volume, mm³.
fn check(part: &TriMesh, (mean, variation): (f64, f64), cell: f64) -> f64 {
    let allowance = CastingAllowance::new(mean, variation).expect("an allowance");
    let cast = casting(part, allowance, cell).expect("a casting");
    let (on_part, on_cast) = (surface(part), surface(&cast));
    assert!(on_cast.topology().components.iter().all(|c| c.closed), "open");
    assert_eq!(on_cast.topology().components.len(), 1);
    let distance =
        |surface: &Surface, p: &Point3<f64>| surface.closest_point(p, f64::INFINITY).expect("a point").distance;
    // Twice that of the lattice, for facets between its edges.
    let slack = |a: f64| cell * cell / a;
    let mut thicknesses: Vec<f64> = Vec::new();
    for p in places(part) {
        assert!(on_cast.is_inside(&p), "{p} of the part is not in its casting");
        let d = distance(&on_cast, &p);
        assert!(d >= allowance.least() - slack(allowance.least()), "{d} mm at {p}");
        thicknesses.push(d);
    }
    thicknesses.sort_by(f64::total_cmp);
    let (low, high) = (thicknesses[thicknesses.len() / 50], thicknesses[thicknesses.len() * 49 / 50]);
    assert!(high - low > 0.5 * variation, "the allowance hardly varies: {low} to {high}");
    for p in places(&cast) {
        assert!(!on_part.is_inside(&p));
        let d = distance(&on_part, &p);
        // On the outside of edges nearer; farther in hollows, where facets span the crease.
        assert!(d >= allowance.least() - slack(allowance.least()) && d <= allowance.largest() + cell, "{d} mm at {p}");
    }
    (0..cast.triangles().len())
        .map(|t| cast.corners(t))
        .map(|[a, b, c]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0)
        .sum()
}

#[test]
fn a_casting_has_its_allowance_all_over_a_propeller() {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).expect("a propeller");
    let resolution = BladeResolution::new(20, 24).expect("a resolution");
    let blade = blade(&spec, resolution);
    let blades = (0..spec.n_blades()).map(|k| blade.transformed(&blade_pose(&spec, k)));
    let part = blades.fold(hub(&spec, 0.1).expect("a hub"), |whole, blade| whole.joined(&blade));
    check(&part, (6.0, 3.0), 4.0);
}

#[test]
fn a_casting_of_a_box_is_the_box_with_rounded_edges() {
    let (vertices, triangles) = facemill_test_kit::box_mesh([-20.0, -15.0, -10.0], [20.0, 15.0, 10.0]);
    let part = TriMesh::new(vertices, triangles).expect("a box");
    let volume = check(&part, (5.0, 0.0), 1.0);
    let [x, y, z, a] = [40.0, 30.0, 20.0, 5.0];
    let pi = std::f64::consts::PI;
    let exact = x * y * z + 2.0 * a * (x * y + y * z + z * x) + pi * a * a * (x + y + z) + 4.0 / 3.0 * pi * a.powi(3);
    assert!((volume / exact - 1.0).abs() < 2e-3, "{volume} instead of {exact}");
}

#[test]
fn a_lattice_has_a_size() {
    let (vertices, triangles) = facemill_test_kit::box_mesh([-20.0, -15.0, -10.0], [20.0, 15.0, 10.0]);
    let part = TriMesh::new(vertices, triangles).expect("a box");
    let allowance = CastingAllowance::new(5.0, 1.0).expect("an allowance");
    for cell in [0.0, -1.0, f64::NAN, 8.1, 0.01] {
        assert!(casting(&part, allowance, cell).is_err(), "{cell}");
    }
}

#[test]
fn an_allowance_varies_by_no_more_than_itself() {
    assert!(CastingAllowance::new(3.0, 3.5).is_err());
    assert!(CastingAllowance::new(-1.0, 0.0).is_err());
    assert!(CastingAllowance::new(f64::NAN, 0.0).is_err());
}

#[test]
fn nothing_of_a_turned_casting_is_beyond_its_faces_or_in_its_bore() {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).expect("a propeller");
    let form = SolidForm {
        fillet: RootFillet::constant(7.5).expect("a fillet"),
        bore: Some(Bore::cylinder(0.45 * spec.hub_radius()).expect("a bore")),
    };
    let resolution = BladeResolution::new(20, 24).expect("a resolution");
    let part = propeller_solid(&spec, &form, resolution, 0.1).expect("a solid");
    let faces = part.select_groups(|name| name == "hub/faces").aabb();
    let bore = part.select_groups(|name| name == "hub/bore");
    let bore_radius = bore.vertices()[bore.triangles()[0][0] as usize].coords.xy().norm();
    let hub = TurnedHub { bore_radius, faces: [faces.min.z, faces.max.z] };
    let (allowance, cell) = (CastingAllowance::new(6.0, 3.0).expect("an allowance"), 4.0);
    let turned = turned_casting(&part, allowance, cell, hub).expect("a casting");
    let whole = casting(&part, allowance, cell).expect("a casting");
    let on_whole = surface(&whole);
    assert!(surface(&turned).topology().components.iter().all(|c| c.closed), "open");
    // The part is within it in z, by the rounding of files and no more.
    let bounds = turned.aabb();
    assert!(bounds.max.z > faces.max.z + 1e-3 && bounds.max.z < faces.max.z + 0.05);
    assert!(bounds.min.z < faces.min.z - 1e-3 && bounds.min.z > faces.min.z - 0.05);
    let mut on_wall = 0;
    for p in places(&turned) {
        let radius = p.coords.xy().norm();
        assert!(radius > bore_radius - 1e-9, "{p} is in the bore");
        // Cubes that a face or the bore cuts are 1.8 cells across.
        let near = 2.0 * cell;
        let is_turned = radius < bore_radius + near || p.z > faces.max.z - near || p.z < faces.min.z + near;
        on_wall += usize::from(radius < bore_radius + 0.5 * cell);
        // Elsewhere it is the casting.
        let distance = || on_whole.closest_point(&p, 1.0).map_or(1.0, |foot| foot.distance);
        assert!(is_turned || distance() < 1e-9, "{p}");
    }
    assert!(on_wall > 100, "{on_wall} places on the wall of the bore");
    let wrong = TurnedHub { faces: [5.0, -5.0], ..hub };
    assert!(turned_casting(&part, allowance, cell, wrong).is_err());
    assert!(turned_casting(&part, allowance, cell, TurnedHub { bore_radius: 3.0, ..hub }).is_err());
}
