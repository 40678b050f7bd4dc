//! A cutter is several solids: one call tests all of them.

use facemill_interference::{Interference, MeshTree, ParryMesh, Verdict};
use facemill_surface_model::TriMesh;
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3};

/// Returns a small triangle across the radius just below the upper rim of the cutter, at this
/// distance outside of its side.
fn splinter(radius: f64, top: f64, outside: f64) -> TriMesh {
    let at = |y, z| Point3::new(radius + outside, y, z);
    TriMesh::new(vec![at(-0.1, top - 0.2), at(0.1, top - 0.2), at(0.0, top - 0.1)], vec![[0, 1, 2]]).unwrap()
}

#[test]
fn a_splinter_at_the_upper_rim_is_met_by_the_whole_cutter() {
    let pose = Isometry3::identity();
    for (radius, corner, flute) in [(25.0, 2.0, 50.0), (80.0, 6.0, 14.0), (10.0, 10.0, 30.0)] {
        let cutter = Cutter::new(radius, corner, flute).unwrap();
        let bodies = cutter.test_bodies(0.0);
        let near = splinter(radius, flute, -0.05);
        // The rounded top of the first body leaves the rim out; who tests it alone misses the hit.
        assert!(MeshTree::new(&near).verdict(&bodies[0], &pose, None).is_free());
        let far = splinter(radius, flute, 0.05);
        let meshes = |mesh: &TriMesh| -> [Box<dyn Interference>; 2] {
            [Box::new(MeshTree::new(mesh)), Box::new(ParryMesh::new(mesh))]
        };
        for mesh in meshes(&near) {
            assert!(matches!(mesh.verdict_of_all(&bodies, 0.0, &pose, None), Verdict::Hit(_)));
        }
        for mesh in meshes(&far) {
            assert!(mesh.verdict_of_all(&bodies, 0.0, &pose, None).is_free());
            assert!(!mesh.verdict_of_all(&bodies, 0.06, &pose, None).is_free(), "dilated, all are");
        }
    }
}
