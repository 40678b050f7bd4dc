use facemill_surface_model::{SurfaceSettings, TriMesh};
use facemill_test_kit::box_mesh;
use nalgebra::Vector3;

use super::*;

/// Boxes as one solid.
fn solid(boxes: &[[[f64; 3]; 2]]) -> Surface {
    let meshes = boxes.iter().map(|&[low, high]| {
        let (vertices, triangles) = box_mesh(low, high);
        TriMesh::new(vertices, triangles).unwrap()
    });
    Surface::new(meshes.reduce(|all, mesh| all.joined(&mesh)).unwrap(), SurfaceSettings::default())
}

fn heights(solid: &Surface, posture: Posture) -> Vec<f64> {
    let cutter = Cutter::new(8.0, 1.0, 6.0).unwrap();
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let StockTop::Solid { heights, .. } = solid_over(solid, &cc, &Outline::new(&cutter, posture)) else {
        panic!("a layer")
    };
    heights
}

#[test]
fn stock_above_the_cutter_is_not_over_its_contact() {
    let level = Posture { tilt: 0.1, rotate: 0.3 };
    let block = [[-20.0, -20.0, -5.0], [20.0, 20.0, 3.0]];
    let alone = heights(&solid(&[block]), level);
    assert!(alone.iter().all(|h| (h - 3.0).abs() < 1e-9), "{alone:?}");
    // A neighbour far above changes nothing; one within the flute counts, with the gap below it.
    assert_eq!(heights(&solid(&[block, [[-20.0, -20.0, 40.0], [20.0, 20.0, 60.0]]]), level), alone);
    let near = heights(&solid(&[block, [[-20.0, -20.0, 4.0], [20.0, 20.0, 5.0]]]), level);
    assert!(near.iter().all(|h| (h - 5.0).abs() < 1e-9), "{near:?}");
    // Of a block that is higher than the cutter as much as the cutter is: the flute of 6 mm, and
    // the lean of a rim of 8 mm.
    let high = heights(&solid(&[[[-20.0, -20.0, -5.0], [20.0, 20.0, 300.0]]]), level);
    assert!(high.iter().all(|h| *h >= 6.0 && *h < 6.0 + 16.0 * 0.1 + 3.0), "{high:?}");
    // One that begins within the flute and ends above it.
    let across = heights(&solid(&[block, [[-20.0, -20.0, 4.0], [20.0, 20.0, 300.0]]]), level);
    assert_eq!(across, high);
    // A cutter that lies is as high as it is wide.
    let lying = heights(&solid(&[[[-20.0, -20.0, -5.0], [20.0, 20.0, 300.0]]]), Posture { tilt: 1.5, rotate: 1.5 });
    assert!(lying.iter().all(|h| *h >= 15.0 && *h < 18.0), "{lying:?}");
}
