use crate::map::heights::*;
use crate::raster::height_over;
use facemill_test_kit::Random;

/// Triangles from tiny to as large as the map, of both senses: any, needles, slivers without area,
/// vertical ones, points, and some with corners on nodes.
fn odd_triangles(seed: u64, n: usize) -> TriMesh {
    let mut random = Random(seed);
    let mut vertices = Vec::new();
    for k in 0..n {
        let size = [0.1, 0.6, 4.0, 30.0][k % 4];
        let a = random.point(30.0);
        let (u, v) = (random.point(size).coords, random.point(size).coords);
        let (u, v) = match k / 4 % 8 {
            0 => (u, u * random.between(-1.0, 1.0) + v * 1e-13),
            1 => (u, u * random.between(-1.0, 1.0) + v * 1e-4),
            2 => (u, nalgebra::Vector3::new(0.0, 0.0, v.z)),
            3 => (u, u * 0.5),
            4 if k % 3 == 0 => (u * 0.0, v * 0.0),
            _ => (u, v),
        };
        let corners = [a, a + u, a + v];
        let on_nodes = |p: Point3<f64>| Point3::new(p.x.round(), p.y.round(), p.z);
        vertices.extend(if k / 4 % 8 >= 6 { corners.map(on_nodes) } else { corners });
    }
    // So that the nodes have whole coordinates.
    vertices[0] = Point3::new(-64.0, -64.0, 0.0);
    TriMesh::new(vertices, (0..n as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).unwrap()
}

#[test]
fn nodes_have_the_height_of_every_triangle_looked_at_for_itself() {
    let mut n_on = 0;
    for (seed, cell) in [(1, 1.0), (2, 0.25), (3, 0.73)] {
        let mesh = odd_triangles(seed, 4000);
        let map = NodeHeights::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell, margin: 0.0 }).unwrap();
        let [nx, ny] = map.n_nodes();
        let mut brute = vec![f64::NEG_INFINITY; nx * ny];
        for t in (0..mesh.triangles().len()).map(|t| mesh.corners(t)) {
            // Far beyond what rounding could add.
            let near = |axis: usize, at: f64| {
                let of = t.map(|p| p[axis]);
                of.iter().any(|c| *c >= at - 0.5) && of.iter().any(|c| *c <= at + 0.5)
            };
            for j in (0..ny).filter(|&j| near(1, map.node_position(0, j)[1])) {
                for i in (0..nx).filter(|&i| near(0, map.node_position(i, 0)[0])) {
                    let [x, y] = map.node_position(i, j);
                    if let Some(z) = height_over(&t, x, y) {
                        brute[j * nx + i] = brute[j * nx + i].max(z);
                    }
                }
            }
        }
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            let expected = Some(brute[j * nx + i]).filter(|z| z.is_finite());
            assert_eq!(map.node_height(i, j), expected, "node {i} {j} of {cell}");
            n_on += usize::from(expected.is_some());
        }
    }
    assert!(n_on > 50_000, "{n_on}");
}

#[test]
fn any_number_of_threads_makes_the_same_heights() {
    let mesh = odd_triangles(4, 40_000);
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        let settings = ZMapSettings { cell: 0.2, margin: 1.0 };
        pool.install(|| NodeHeights::build(&mesh, &Isometry3::identity(), &settings).unwrap())
    };
    let one = on(1);
    let bits = |map: &NodeHeights| map.nodes.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    for n in [2, 3, 8] {
        assert!(bits(&one) == bits(&on(n)), "{n} threads");
    }
}

#[test]
fn a_node_on_an_edge_belongs_to_a_triangle_at_it() {
    // Fans around nodes and off them, with edges along rows, columns and diagonals: no hole
    // anywhere inside.
    let mut random = Random(5);
    for k in 0..200 {
        let center = if k % 2 == 0 { Point3::new(0.0, 0.0, 1.0) } else { random.point(0.9) };
        let rim: Vec<_> = (0..8)
            .map(|i| {
                let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
                let far = if k % 3 == 0 { 10.0 } else { 10.0 + random.between(-1.0, 1.0) };
                Point3::new((far * cos).round(), (far * sin).round(), 0.0)
            })
            .collect();
        let triangles =
            (0..8).map(|i| if k % 5 == 0 { [0, (i + 1) % 8 + 1, i + 1] } else { [0, i + 1, (i + 1) % 8 + 1] });
        let mesh = TriMesh::new([vec![center], rim].concat(), triangles.collect()).unwrap();
        let settings = ZMapSettings { cell: 0.25, margin: 0.0 };
        let map = NodeHeights::build(&mesh, &Isometry3::identity(), &settings).unwrap();
        let [nx, ny] = map.n_nodes();
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            let [x, y] = map.node_position(i, j);
            // The rim's corners are 8 or more from the origin, and its sides 6 or more.
            if x.hypot(y) < 6.0 {
                assert!(map.node_height(i, j).is_some(), "fan {k}: hole at {x}, {y}");
            }
        }
    }
}
