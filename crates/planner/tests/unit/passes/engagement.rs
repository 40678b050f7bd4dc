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

#[test]
fn what_cuts_of_the_rim_lies_in_the_reach() {
    let kinds = [[8.0, 1e-6], [8.0, 2.0], [8.0, 8.0]].map(|[radius, corner]| Cutter::new(radius, corner, 9.0).unwrap());
    for cutter in &kinds {
        for tilt in [0.02, 0.2, 1.0, 1.5] {
            for rotate in [0.0_f64, 0.4, 1.5, 2.0, 3.1].into_iter().flat_map(|angle| [angle, -angle]) {
                let posture = Posture { tilt, rotate };
                let [back, front] = cutting_reach(posture, cutter);
                assert!(back <= 0.0 && front >= 0.0, "{posture:?}: {back} to {front}");
                // Points of the corner: around a circle about the axis, each with the ball of the
                // corner below and beside it.
                let axis = Vector3::new(tilt.sin() * rotate.cos(), tilt.sin() * rotate.sin(), tilt.cos());
                let lowest = (axis * axis.z - Vector3::z()).normalize();
                let (rim, r) = (cutter.rim_radius(), cutter.corner_radius());
                let contact = lowest * rim - Vector3::z() * r;
                for k in 0..72 {
                    let (sin, cos) = (f64::from(k) / 72.0 * std::f64::consts::TAU).sin_cos();
                    let toward = lowest * cos + axis.cross(&lowest) * sin;
                    for share in 0..=4 {
                        let place = toward * cutter.radius()
                            + axis * (cutter.flute_length() - r) * (f64::from(share) / 4.0)
                            - contact;
                        let cuts = toward.x > 1e-9;
                        assert!(!cuts || (back - 1e-3..=front + 1e-3).contains(&place.x), "{posture:?}: flute");
                    }
                    for lean in 0..=18 {
                        let (sin, cos) = (f64::from(lean) / 18.0 * std::f64::consts::FRAC_PI_2).sin_cos();
                        let normal = toward * sin - axis * cos;
                        let place = toward * rim + normal * r - contact;
                        // It cuts where it moves into the material.
                        let cuts = normal.x > 1e-9;
                        assert!(!cuts || (back - 1e-3..=front + 1e-3).contains(&place.x), "{posture:?}: {}", place.x);
                    }
                }
            }
        }
    }
}
