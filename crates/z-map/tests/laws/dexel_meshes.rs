//! Stock from meshes, and meshes from stock.

use std::f64::consts::{PI, TAU};

use facemill_surface_model::TriMesh;
use facemill_test_kit::{open_edges, volume};
use facemill_z_map::{DexelMap, MeshStockError};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::dexel_kit::{block, body, cut, pose};
use crate::kit::Random;

/// A cube from −half to half; its diagonals, edges and corners are where lines of simple lattices
/// go.
fn cube(half: f64) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh([-half; 3], [half; 3]);
    TriMesh::new(vertices, triangles).unwrap()
}

/// A sphere in n × 2n patches, corners on the sphere.
fn sphere(radius: f64, n: u32) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::ball_mesh(radius, [n, 2 * n]);
    TriMesh::new(vertices, triangles).unwrap()
}

/// Volume by the divergence theorem, and whether every edge has as many triangles on one side as on
/// the other.
fn enclosed(mesh: &TriMesh) -> (f64, bool) {
    (volume(mesh.vertices(), mesh.triangles()), open_edges(mesh.triangles()) == 0)
}

#[test]
fn a_cube_does_not_leak_at_edges_and_corners() {
    // Lines through vertical faces, edges, corners and diagonals, in whole frames and in turned
    // ones.
    for (half, cell) in [(2.0, 1.0), (2.5, 1.0), (3.0, 0.5), (1.0, 2.0)] {
        let map = DexelMap::of_mesh(&cube(half), &Isometry3::identity(), cell).unwrap();
        map.check_invariants().unwrap();
        for i in 0..map.grid().n_lines()[0] {
            for j in 0..map.grid().n_lines()[1] {
                let found: Vec<_> = map.intervals(i, j).map(|i| [i.bottom, i.top]).collect();
                let inside = |c: f64| (-half..half).contains(&c);
                let expected =
                    if inside(map.grid().x(i)) && inside(map.grid().y(j)) { vec![[-half, half]] } else { vec![] };
                assert_eq!(found, expected, "half {half} cell {cell} line ({i}, {j})");
            }
        }
    }
    // Corners and edges exactly on lines: whole coordinates, the lattice moved by an allowance that
    // is half a cell.
    let map = DexelMap::of_mesh_with_allowance(&cube(2.0), &Isometry3::identity(), 1.0, 0.5).unwrap();
    map.check_invariants().unwrap();
    for k in 0..5 {
        let of_edge: Vec<_> = map.intervals(0, k).map(|i| [i.bottom, i.top]).collect();
        assert!(of_edge.len() == 1 && (of_edge[0][1] - 2.5).abs() < 1e-9, "{of_edge:?}");
    }
    let mut random = Random(4);
    for _ in 0..5 {
        let frame = random.pose(20.0);
        let map = DexelMap::of_mesh(&cube(4.0), &frame, 0.2).unwrap();
        map.check_invariants().unwrap();
        assert!((map.volume() - 512.0).abs() < 512.0 * 0.03, "{}", map.volume());
    }
}

#[test]
fn a_sphere_of_triangles_has_its_volume() {
    let mesh = sphere(10.0, 40);
    let (exact, is_closed) = enclosed(&mesh);
    assert!(is_closed && (exact - 4.0 / 3.0 * PI * 1000.0).abs() < 40.0);
    let error = |cell: f64| {
        let map = DexelMap::of_mesh(&mesh, &Isometry3::translation(0.013, 0.027, 0.0), cell).unwrap();
        map.check_invariants().unwrap();
        (map.volume() - exact).abs()
    };
    let errors = [1.0, 0.5, 0.25].map(error);
    assert!(errors[0] < 30.0 && errors[2] < 4.0 && errors[2] < 0.6 * errors[0].max(4.0), "{errors:?}");
}

#[test]
fn an_allowance_is_all_within_it() {
    let mesh = cube(5.0);
    let volume = |d: f64| 1000.0 + 600.0 * d + 30.0 * PI * d * d + 4.0 / 3.0 * PI * d * d * d;
    let mut random = Random(7);
    for frame in [Isometry3::identity(), random.pose(10.0), random.pose(10.0)] {
        for allowance in [0.3, 2.0] {
            let map = DexelMap::of_mesh_with_allowance(&mesh, &frame, 0.2, allowance).unwrap();
            map.check_invariants().unwrap();
            assert!((map.volume() / volume(allowance) - 1.0).abs() < 0.02, "{} {}", map.volume(), volume(allowance));
            // The ends of every line are exactly as far from the cube.
            let grid = *map.grid();
            for (i, j) in (0..grid.n_lines()[1]).step_by(3).flat_map(|j| (0..grid.n_lines()[0]).map(move |i| (i, j))) {
                let intervals: Vec<_> = map.intervals(i, j).collect();
                assert!(intervals.len() <= 1, "{intervals:?}");
                for end in intervals.iter().flat_map(|i| [i.bottom, i.top]) {
                    let p = grid.in_work(i, j, end);
                    let distance = p.coords.map(|c| (c.abs() - 5.0).max(0.0)).norm();
                    assert!((distance - allowance).abs() < 1e-7, "{p} is {distance} away");
                }
            }
        }
    }
}

#[test]
fn a_mesh_that_is_open_or_inside_out_is_refused_with_the_place() {
    let whole = cube(3.0);
    let open = TriMesh::new(whole.vertices().to_vec(), whole.triangles()[..11].to_vec()).unwrap();
    let top =
        TriMesh::new(whole.vertices().to_vec(), [&whole.triangles()[..2], &whole.triangles()[3..]].concat()).unwrap();
    let frame = Isometry3::identity();
    assert!(DexelMap::of_mesh(&open, &frame, 0.4).is_ok(), "no line along z goes through the side that is open");
    let sideways = Isometry3::new(Vector3::zeros(), Vector3::new(0.0, PI / 2.0, 0.0));
    assert!(matches!(DexelMap::of_mesh(&open, &sideways, 0.4), Err(MeshStockError::NotClosed { .. })));
    let Err(MeshStockError::NotClosed { at, n_in: 1, n_out: 0 }) = DexelMap::of_mesh(&top, &frame, 0.4) else {
        panic!("a cube with half a lid is not closed");
    };
    assert!(at.x.abs() < 3.0 && at.y.abs() < 3.0 && (at.z + 3.0).abs() < 1e-9, "{at}");
    assert!(matches!(DexelMap::of_mesh(&whole.reversed(), &frame, 0.4), Err(MeshStockError::NotClosed { .. })));
}

#[test]
fn the_mesh_of_a_stock_is_closed_and_has_its_volume() {
    let mut map = DexelMap::of_mesh(&sphere(6.0, 12), &Random(2).pose(30.0), 0.7).unwrap();
    let tool = body(3.0, 1.0, 2.5);
    let centre = map.grid().work_from_map() * (map.grid().work_from_map().inverse() * Point3::origin());
    let at = |k: u32| {
        let (sin, cos) = (TAU * f64::from(k) / 5.0).sin_cos();
        pose([centre.x + 5.0 * cos, centre.y + 5.0 * sin, 0.3 * f64::from(k)], [sin, 0.2, cos])
    };
    for k in 0..5 {
        cut(&mut map, &tool, at(k), at(k), 0.01);
    }
    let (volume, is_closed) = enclosed(&map.to_mesh().unwrap());
    assert!(is_closed && (volume - map.volume()).abs() < 1e-8 * volume, "{volume} {}", map.volume());
    assert_eq!(block([0.0; 3], [2.0, 1.0, 1.0], 1.0).to_mesh().unwrap().triangles().len(), 20);
}

#[test]
fn a_region_has_the_lines_of_the_whole_stock_and_no_others() {
    let (mesh, frame, cell, allowance) = (sphere(4.0, 10), Isometry3::translation(1.0, 2.0, 3.0), 0.25, 0.5);
    let whole = DexelMap::of_mesh_with_allowance(&mesh, &frame, cell, allowance).unwrap();
    let origin = whole.grid().origin();
    // From the line (6, 9) on, 11 and 13 lines.
    let low = [origin[0] + 6.0 * cell, origin[1] + 9.0 * cell];
    let high = [low[0] + 11.0 * cell, low[1] + 13.0 * cell];
    let part = DexelMap::of_mesh_within(&mesh, &frame, cell, (allowance, true), [low, high]).unwrap();
    part.check_invariants().unwrap();
    assert_eq!(part.grid().n_lines(), [11, 13]);
    for (i, j) in (0..13).flat_map(|j| (0..11).map(move |i| (i, j))) {
        let ends =
            |map: &DexelMap, i: usize, j: usize| map.intervals(i, j).map(|i| [i.bottom, i.top]).collect::<Vec<_>>();
        let (of_part, of_whole) = (ends(&part, i, j), ends(&whole, i + 6, j + 9));
        assert_eq!(of_part.len(), of_whole.len());
        let off = of_part.as_flattened().iter().zip(of_whole.as_flattened()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6, "{of_part:?} {of_whole:?}");
    }
    // Beyond the stock there are no lines, and a region beside it is none.
    let wide = DexelMap::of_mesh_within(&mesh, &frame, cell, (allowance, true), [[-99.0; 2], [99.0; 2]]).unwrap();
    assert_eq!(wide, whole);
    for region in [[[50.0; 2], [60.0; 2]], [[1.0; 2], [0.0; 2]], [[f64::NAN; 2], [1.0; 2]]] {
        let refused = DexelMap::of_mesh_within(&mesh, &frame, cell, (allowance, true), region);
        assert!(matches!(refused, Err(MeshStockError::BadRegion { .. })), "{region:?}");
    }
}
