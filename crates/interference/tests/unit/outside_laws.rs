use facemill_surface_model::TriMesh;
use facemill_test_kit::{Random, ball_mesh, box_mesh, ring_mesh};
use nalgebra::Vector3;

use super::*;

/// Times that the triangles wind around a place, by their solid angles.
fn winding(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|corner| corner - p);
        let [la, lb, lc] = [a, b, c].map(|v| v.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    (0..mesh.triangles().len()).map(of).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

fn mesh((vertices, triangles): (Vec<Point3<f64>>, Vec<[u32; 3]>)) -> TriMesh {
    TriMesh::new(vertices, triangles).unwrap()
}

fn moved(mesh: &TriMesh, by: [f64; 3]) -> TriMesh {
    mesh.transformed(&nalgebra::Translation3::from(by).into())
}

/// Each with the parts that are closed on their own.
fn samples() -> Vec<Vec<TriMesh>> {
    let (ball, small) = (mesh(ball_mesh(40.0, [24, 48])), mesh(ball_mesh(25.0, [24, 48])));
    let ring = mesh(ring_mesh([50.0, 9.0], [90, 24]));
    vec![
        vec![ball.clone()],
        // A cavity, which is inside of the outer one.
        vec![ball.clone(), small.clone().reversed()],
        vec![ring.clone(), moved(&ball, [140.0, 10.0, -30.0])],
        // Shells that overlap.
        vec![ring, moved(&small, [50.0, 0.0, 0.0])],
        vec![ball.reversed()],
        // Too few triangles for a grid.
        vec![mesh(box_mesh([-7.0, -30.0, 2.0], [20.0, 10.0, 3.0]))],
    ]
}

#[test]
fn no_closed_part_winds_around_a_place_that_is_outside() {
    for (number, parts) in samples().into_iter().enumerate() {
        let all = parts.iter().fold(TriMesh::default(), |all, part| all.joined(part));
        let corners: Vec<_> = (0..all.triangles().len()).map(|t| all.corners(t)).collect();
        let outside = Outside::of(&corners);
        let mut random = Random(number as u64);
        let bounds = all.aabb().dilated(12.0);
        let (mut n_outside, mut n_known) = (0, 0);
        for k in 0..400 {
            // Every other one beside the surface.
            let place = if k % 2 == 0 {
                let size = bounds.max - bounds.min;
                bounds.min + Vector3::from_fn(|axis, _| size[axis] * random.unit())
            } else {
                corners[random.below(corners.len())][0] + random.direction().into_inner() * random.between(1e-4, 3.0)
            };
            let is_outside = parts.iter().all(|part| winding(part, &place).abs() < 0.5);
            assert!(is_outside || !outside.holds(&place), "mesh {number}: {place}");
            n_outside += usize::from(is_outside && k % 2 == 0);
            n_known += usize::from(outside.holds(&place) && k % 2 == 0);
        }
        // Cells are small beside the meshes, where there are any.
        assert!(corners.len() < FEWEST || 10 * n_known >= 9 * n_outside, "mesh {number}: {n_known} of {n_outside}");
    }
}

#[test]
fn a_closed_room_is_not_outside_and_a_room_with_a_door_is() {
    // A room of six thick walls of tiles; without a tile in the middle of one wall it has a door.
    let half = 30.0;
    let wall = |normal: usize, sign: f64, has_door: bool| {
        let n = 24;
        let at = |i: u32, j: u32| {
            let mut p = Point3::origin();
            p[normal] = sign * half;
            p[(normal + 1) % 3] = half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
            p[(normal + 2) % 3] = half * (2.0 * f64::from(j) / f64::from(n) - 1.0);
            p
        };
        let mut tiles = Vec::new();
        for i in 0..n {
            for j in 0..n {
                if has_door && i == 11 && j == 12 {
                    continue;
                }
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                tiles.extend([[a, b, c], [a, c, d]]);
            }
        }
        tiles
    };
    for has_door in [false, true] {
        let walls = (0..3).flat_map(|normal| [-1.0, 1.0].map(|sign| (normal, sign)));
        let corners: Vec<_> =
            walls.flat_map(|(normal, sign)| wall(normal, sign, has_door && normal == 1 && sign > 0.0)).collect();
        let outside = Outside::of(&corners);
        assert_eq!(outside.holds(&Point3::new(3.0, -20.0, 11.0)), has_door);
        assert!(outside.holds(&Point3::new(3.0, 31.5, 11.0)));
    }
}

#[test]
fn nothing_is_known_of_places_that_are_no_numbers_nor_of_meshes_that_are_not() {
    let ball = mesh(ball_mesh(40.0, [24, 48]));
    let mut corners: Vec<_> = (0..ball.triangles().len()).map(|t| ball.corners(t)).collect();
    let outside = Outside::of(&corners);
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!outside.holds(&Point3::new(500.0, wrong, 0.0)));
    }
    assert!(outside.holds(&Point3::new(500.0, 1e300, 0.0)));
    corners[3][1].y = f64::INFINITY;
    let outside = Outside::of(&corners);
    assert!(!outside.holds(&Point3::new(500.0, 0.0, 0.0)));
    assert!(!Outside::of(&[]).holds(&Point3::origin()));
}

#[test]
fn large_triangles_in_a_fine_grid_give_the_grid_up_in_bounded_time() {
    // Long needles across the whole box: each would mark all of it.
    let mut random = Random(5);
    let mut needle = || {
        let p = random.point(50.0);
        [p, Point3::from(-p.coords), Point3::from(-p.coords + Vector3::repeat(1e-3))]
    };
    let corners: Vec<_> = (0..200_000).map(|_| needle()).collect();
    let outside = Outside::of(&corners);
    assert!(outside.cells.is_empty());
    assert!(outside.holds(&Point3::new(0.0, 0.0, 80.0)) && !outside.holds(&Point3::origin()));
}
