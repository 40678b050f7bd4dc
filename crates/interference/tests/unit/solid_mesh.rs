use super::*;
use facemill_cl_data::RoundBox;

fn volume(mesh: &TriMesh) -> f64 {
    facemill_test_kit::volume(mesh.vertices(), mesh.triangles())
}

#[test]
fn box_is_closed_and_wound_outward() {
    let half_extents = Vector3::new(1.0, 2.5, 4.0);
    let mesh = solid_mesh(&Solid::Box(RoundBox { half_extents, rounding: 3.0 })).unwrap();
    assert!((volume(&mesh) - 2.0 * 5.0 * 8.0).abs() < 1e-9);
}

#[test]
fn prism_holds_the_frustum_and_hardly_more() {
    for (radius_low, radius_high) in
        [(0.5, 0.5), (30.0, 80.0), (2000.0, 2000.0), (4000.0, 100.0), (0.0, 60.0), (60.0, 0.0)]
    {
        let f = RoundFrustum { z_low: -3.0, z_high: 7.0, radius_low, radius_high, rounding: 2.0 };
        let mesh = solid_mesh(&Solid::Frustum(f)).unwrap();
        let squares = radius_low * radius_low + radius_low * radius_high + radius_high * radius_high;
        let exact = PI / 3.0 * 10.0 * squares;
        assert!(volume(&mesh) > exact && volume(&mesh) < exact * 1.02, "{} {exact}", volume(&mesh));
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.norm() > 0.0, "no facet without an area");
            // The supporting plane of each facet has the whole frustum on its inner side.
            let n = normal.normalize();
            let highest = |radius: f64, z: f64| radius * n.x.hypot(n.y) + z * n.z;
            let support = highest(radius_low, -3.0).max(highest(radius_high, 7.0));
            assert!(support <= n.dot(&a.coords) + 1e-9, "{f:?} {n:?}");
        }
        for p in mesh.vertices() {
            assert!(f.core_distance(p) <= LARGEST_EXCESS + 1e-9, "{p} {}", f.core_distance(p));
        }
    }
}
