use facemill_cl_data::Aabb;

use super::*;
use crate::region::Region;
use crate::strategy::patch::Fineness;
use crate::test_kit::{Random, irregular_grid, surface};

#[test]
fn normals_on_edges_are_those_of_the_smooth_surface_on_both_sides_of_creases() {
    // A roof, creased along x = 3, whose sides bend.
    let roof = irregular_grid(12, 9, 0.5, |u, v| {
        let (x, y) = (6.0 * u, 5.0 * v);
        Point3::new(x, y, 0.2 * (2.0 * y).sin() - 0.8 * (x - 3.0).abs() - 0.05 * x * x)
    });
    let s = surface(roof);
    let bounds = Aabb { min: Point3::new(0.7, 0.9, -100.0), max: Point3::new(5.1, 4.3, 100.0) };
    let region = Region { bounds: Some(bounds), ..Region::default() };
    let fineness = Fineness { max_edge: 0.3, max_bend: f64::INFINITY, cuts_range: false };
    let patch = Patch::new(&s, &region, None, &fineness).unwrap();
    let normals = CornerNormals::of(&patch);
    let mut rng = Random(5);
    for (t, corners) in patch.mesh.triangles().iter().enumerate() {
        for k in 0..3 {
            let (edge, share) = ([corners[k], corners[(k + 1) % 3]], rng.unit());
            let [a, b] = edge.map(|v| patch.mesh.vertices()[v as usize]);
            let p = a + (b - a) * share;
            let expected = patch.normal(t as u32, &p);
            let off = normals.on_edge(t as u32, edge, share, &p).angle(&expected);
            assert!(off < 1e-7, "{off} at {p}");
            let reversed = normals.on_edge(t as u32, [edge[1], edge[0]], 1.0 - share, &p).angle(&expected);
            assert!(reversed < 1e-7, "{reversed} at {p}");
        }
    }
}
