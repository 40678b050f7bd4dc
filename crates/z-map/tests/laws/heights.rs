//! Nodes and cells of a Z-map against the mesh.

use facemill_surface_model::TriMesh;
use facemill_z_map::{ZMap, ZMapError, ZMapSettings};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kit::{Random, ball, field, highest_along, points_of, soup, waves};

fn build(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>, cell: f64) -> ZMap {
    ZMap::build(mesh, map_from_mesh, &ZMapSettings { cell, margin: 2.0 }).unwrap()
}

fn frames() -> Vec<Isometry3<f64>> {
    let mut random = Random(5);
    let mut frames =
        vec![Isometry3::identity(), Isometry3::rotation(Vector3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0))];
    frames.extend((0..3).map(|_| random.pose(50.0)));
    frames
}

fn meshes() -> Vec<TriMesh> {
    vec![waves(), ball(Point3::new(4.0, 5.0, 6.0), 20.0, 24), soup(1, 200), field(4, 10.0, |_, _| 3.0)]
}

#[test]
fn node_heights_are_those_of_vertical_rays() {
    let mut on_surface = 0;
    for mesh in meshes() {
        for frame in frames() {
            let map = build(&mesh, &frame, 1.7);
            let down = frame.inverse_transform_vector(&-Vector3::z());
            let [nx, ny] = map.n_cells();
            for (i, j) in (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i, j))) {
                let [x, y] = map.node_position(i, j);
                let ray = |dx: f64, dy: f64| {
                    let above = frame.inverse_transform_point(&Point3::new(x + dx, y + dy, 0.0));
                    highest_along(&mesh, above, -down)
                };
                let height = map.node_height(i, j);
                let same = |a: Option<f64>, b: Option<f64>| match (a, b) {
                    (Some(a), Some(b)) => (a - b).abs() < 1e-8,
                    (a, b) => a == b,
                };
                // A ray through an edge hits or misses by rounding: then one beside it decides.
                let nearby = [(0.0, 0.0), (1e-10, 0.0), (-1e-10, 0.0), (0.0, 1e-10), (0.0, -1e-10)];
                assert!(nearby.iter().any(|&(dx, dy)| same(height, ray(dx, dy))), "node {i} {j}: {height:?}");
                on_surface += usize::from(height.is_some());
            }
        }
    }
    assert!(on_surface > 10_000, "{on_surface}");
}

#[test]
fn a_surface_has_no_holes_at_its_edges_and_vertices() {
    // Nodes on vertices, on edges, and along diagonals: every node over the field has the height of
    // the field.
    for (square, cell) in [(3.0, 1.0), (1.0, 0.5), (0.1, 0.1), (0.7, 0.35), (3.0, 1.1)] {
        let slope = |x: f64, y: f64| 0.25 * x - 0.5 * y;
        let mesh = field(12, square, slope);
        let map = ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell, margin: 0.0 }).unwrap();
        let [nx, ny] = map.n_cells();
        for (i, j) in (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i, j))) {
            let [x, y] = map.node_position(i, j);
            let outside = x > 12.0 * square - 1e-9 || y > 12.0 * square - 1e-9;
            match map.node_height(i, j) {
                Some(z) => assert!((z - slope(x, y)).abs() < 1e-12),
                None => assert!(outside, "hole at {x}, {y}"),
            }
        }
    }
}

#[test]
fn no_point_of_the_mesh_is_above_the_maximum_of_its_cell() {
    for mesh in meshes() {
        for frame in frames() {
            for cell in [0.6, 5.0] {
                let map = build(&mesh, &frame, cell);
                assert_eq!(map.check_invariants(), Ok(()));
                for t in 0..mesh.triangles().len() {
                    for p in points_of(mesh.corners(t), 30) {
                        let p = frame * p;
                        let max = map.max_over(p.x..=p.x, p.y..=p.y);
                        assert!(p.z <= max, "triangle {t}: {p} above {max}");
                    }
                }
            }
        }
    }
}

/// Largest height over a cell: of the range that is its middle.
fn cell_max(map: &ZMap, i: usize, j: usize) -> Option<f64> {
    let [x, y] = map.node_position(i, j).map(|low| low + 0.5 * map.cell());
    Some(map.max_over(x..=x, y..=y)).filter(|z| z.is_finite())
}

#[test]
fn maxima_are_reached_by_the_mesh() {
    // Over a slope the maximum of a cell is at one of its corners.
    let slope = |x: f64, y: f64| 0.25 * x - 0.5 * y;
    let mesh = field(12, 3.1, slope);
    let map = ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell: 2.0, margin: 1.0 }).unwrap();
    let [nx, ny] = map.n_cells();
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        let end = 12.0 * 3.1;
        let ([left, low], [right, high]) = (map.node_position(i, j), map.node_position(i + 1, j + 1));
        let over = right >= 0.0 && left <= end && high >= 0.0 && low <= end;
        match cell_max(&map, i, j) {
            Some(max) => assert!(over && (max - slope(right.min(end), low.max(0.0))).abs() < 1e-11),
            None => assert!(!over),
        }
    }
    // Of any mesh.
    for frame in frames() {
        let mesh = soup(3, 60);
        let map = build(&mesh, &frame, 4.0);
        let [nx, ny] = map.n_cells();
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            let ([left, low], [right, high]) = (map.node_position(i, j), map.node_position(i + 1, j + 1));
            let triangles = (0..mesh.triangles().len()).map(|t| mesh.corners(t).map(|p| frame * p));
            let exact =
                triangles.map(|t| highest_over(t, [left, right], [low, high])).fold(f64::NEG_INFINITY, f64::max);
            let max = cell_max(&map, i, j).unwrap_or(f64::NEG_INFINITY);
            // Cells are taken a trifle larger, which steep slivers of the soup show.
            assert!(max >= exact && (max - exact < 1e-5 || max == exact), "cell {i} {j}: {max}, exact {exact}");
        }
    }
}

/// Largest z of a triangle over a rectangle: at a corner of the triangle, where an edge crosses the
/// border, or over a corner of the rectangle.
fn highest_over(t: [Point3<f64>; 3], x: [f64; 2], y: [f64; 2]) -> f64 {
    let inside = |p: &Point3<f64>| x[0] <= p.x && p.x <= x[1] && y[0] <= p.y && p.y <= y[1];
    let mut candidates: Vec<Point3<f64>> = t.into_iter().filter(inside).collect();
    for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
        for (axis, bound) in [(0, x[0]), (0, x[1]), (1, y[0]), (1, y[1])] {
            let s = (bound - a[axis]) / (b[axis] - a[axis]);
            let mut p = a + (b - a) * s;
            p[axis] = bound;
            if (0.0..=1.0).contains(&s) && inside(&p) {
                candidates.push(p);
            }
        }
    }
    let single = TriMesh::new(t.to_vec(), vec![[0, 1, 2]]).unwrap();
    for (x, y) in [(x[0], y[0]), (x[1], y[0]), (x[0], y[1]), (x[1], y[1])] {
        let z = highest_along(&single, Point3::new(x, y, 0.0), Vector3::z());
        candidates.extend(z.map(|z| Point3::new(x, y, z)));
    }
    candidates.into_iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_spike_between_nodes_is_missed_by_the_nodes_and_kept_by_the_maxima() {
    let flat = field(4, 10.0, |_, _| 0.0);
    let tip = Point3::new(12.5, 22.5, 7.0);
    let base = [Vector3::new(-0.2, -0.2, -7.0), Vector3::new(0.2, -0.2, -7.0), Vector3::new(0.0, 0.2, -7.0)];
    let spike =
        TriMesh::new(vec![tip, tip + base[0], tip + base[1], tip + base[2]], vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]]);
    let map =
        ZMap::build(&flat.joined(&spike.unwrap()), &Isometry3::identity(), &ZMapSettings { cell: 1.0, margin: 0.0 })
            .unwrap();
    assert_eq!(map.height_at(12.5, 22.5), Some(0.0));
    assert!((map.max_over(12.1..=12.2, 22.1..=22.2) - 7.0).abs() < 1e-9);
    assert!((cell_max(&map, 12, 22).unwrap() - 7.0).abs() < 1e-9);
    assert!(map.max_over(13.1..=40.0, 0.0..=40.0) < 1e-9);
    assert!((map.max_over(0.0..=40.0, 0.0..=40.0) - 7.0).abs() < 1e-9);
}

#[test]
fn ranges_answer_for_the_cells_they_touch() {
    let map = build(&waves(), &Isometry3::identity(), 1.3);
    let [nx, ny] = map.n_cells();
    let [x0, y0] = map.node_position(0, 0);
    let mut random = Random(9);
    for _ in 0..2000 {
        let (a, b, c, d) = (
            random.between(-10.0, 70.0),
            random.between(-10.0, 70.0),
            random.between(-10.0, 70.0),
            random.between(-10.0, 70.0),
        );
        let (x, y) = ([a.min(b), a.max(b)], [c.min(d), c.max(d)]);
        let touches = |i: usize, j: usize| {
            let (left, low) = (x0 + 1.3 * i as f64, y0 + 1.3 * j as f64);
            left <= x[1] && x[0] < left + 1.3 && low <= y[1] && y[0] < low + 1.3
        };
        let brute = (0..nx)
            .flat_map(|i| (0..ny).map(move |j| (i, j)))
            .filter(|&(i, j)| touches(i, j))
            .filter_map(|(i, j)| cell_max(&map, i, j))
            .fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(map.max_over(x[0]..=x[1], y[0]..=y[1]), brute);
    }
    let all = map.max_over(f64::NEG_INFINITY..=f64::INFINITY, f64::NEG_INFINITY..=f64::INFINITY);
    assert_eq!(map.max_over(f64::NAN..=f64::NAN, f64::NAN..=f64::NAN), all);
    assert!((all - 7.5).abs() < 0.5);
    assert_eq!(map.max_over(3.0..=2.0, 0.0..=50.0), f64::NEG_INFINITY);
    assert_eq!(map.max_over(100.0..=200.0, 0.0..=50.0), f64::NEG_INFINITY);
}

#[test]
fn heights_between_nodes_are_bilinear_and_nowhere_outside() {
    let map = ZMap::build(
        &field(4, 10.0, |x, y| 0.1 * x * y),
        &Isometry3::identity(),
        &ZMapSettings { cell: 10.0, margin: 0.0 },
    )
    .unwrap();
    for (x, y) in [(0.0, 0.0), (5.0, 15.0), (39.9, 0.1), (12.0, 40.0), (40.0, 40.0)] {
        assert!((map.height_at(x, y).unwrap() - 0.1 * x * y).abs() < 1e-12, "{x} {y}");
    }
    for (x, y) in [(-0.1, 5.0), (40.1, 5.0), (5.0, 1e9), (f64::NAN, 5.0), (5.0, f64::INFINITY)] {
        assert_eq!(map.height_at(x, y), None);
    }
    assert_eq!(map.node_height(1000, 0), None);
}

#[test]
fn one_thread_and_two_make_the_same_map() {
    let mesh = soup(7, 3000);
    let frame = Random(2).pose(20.0);
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| build(&mesh, &frame, 0.4))
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one, two);
    let [nx, ny] = one.n_cells();
    let bits = |map: &ZMap, i, j| (map.node_height(i, j).map(f64::to_bits), cell_max(map, i, j).map(f64::to_bits));
    assert!((0..nx).all(|i| (0..ny).all(|j| bits(&one, i, j) == bits(&two, i, j))));
}

#[test]
fn a_rigid_motion_of_mesh_and_frame_keeps_the_map() {
    let mesh = waves();
    let motion = Random(4).pose(100.0);
    let (plain, moved) =
        (build(&mesh, &Isometry3::identity(), 1.0), build(&mesh.transformed(&motion), &motion.inverse(), 1.0));
    let [nx, ny] = plain.n_cells();
    for (i, j) in (1..nx).flat_map(|i| (1..ny).map(move |j| (i, j))) {
        if let (Some(a), Some(b)) = (plain.node_height(i, j), moved.node_height(i, j)) {
            assert!((a - b).abs() < 1e-10);
        }
    }
}

#[test]
fn what_makes_no_map_is_refused() {
    let mesh = field(2, 10.0, |_, _| 0.0);
    let with = |cell: f64, margin: f64| {
        ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell, margin }).unwrap_err()
    };
    assert_eq!(with(0.0, 0.0), ZMapError::BadCell { cell: 0.0 });
    assert!(matches!(with(f64::NAN, 0.0), ZMapError::BadCell { .. }));
    assert_eq!(with(1.0, -1.0), ZMapError::BadMargin { margin: -1.0 });
    let empty = ZMap::build(&TriMesh::default(), &Isometry3::identity(), &ZMapSettings::default());
    assert_eq!(empty.unwrap_err(), ZMapError::EmptyMesh);
    let lost = Isometry3::translation(f64::INFINITY, 0.0, 0.0);
    assert_eq!(ZMap::build(&mesh, &lost, &ZMapSettings::default()).unwrap_err(), ZMapError::FrameNotFinite);
    for cell in [1e-3, 1e-9, 1e-300] {
        let error = with(cell, 0.0);
        let ZMapError::TooManyCells { coarser, n_cells, .. } = error else { panic!("{error}") };
        // The hint is one that works, and hardly coarser than it must be.
        assert!(n_cells > ZMap::MAX_CELLS as f64 && (20.0 / coarser + 1.0).powi(2) <= ZMap::MAX_CELLS as f64);
        assert!((20.0 / (0.9 * coarser)).powi(2) > ZMap::MAX_CELLS as f64, "{error}");
    }
}

#[test]
fn a_mesh_of_a_point_or_a_line_has_a_map() {
    let p = Point3::new(1.0, 2.0, 3.0);
    for q in [p, p + Vector3::new(0.0, 0.0, 4.0), p + Vector3::new(5.0, 0.0, 1.0)] {
        let mesh = TriMesh::new(vec![p, q], vec![[0, 1, 1]]).unwrap();
        let map = build(&mesh, &Isometry3::identity(), 1.0);
        assert_eq!(map.check_invariants(), Ok(()));
        assert!((map.max_over(p.x..=q.x, p.y..=q.y) - q.z).abs() < 1e-12);
    }
}
