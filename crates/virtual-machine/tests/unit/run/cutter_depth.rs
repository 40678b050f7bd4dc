use crate::kit;
use crate::run::cutter_depth::*;
use facemill_interference::MeshTree;
use facemill_surface_model::TriMesh;
use facemill_test_kit::{Random, grid_by_rows};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// Bumpy open patch of 2·n² triangles, 100 mm square, about z = 0.
fn patch(n: u32, rng: &mut Random) -> TriMesh {
    let (vertices, triangles) = grid_by_rows([n, n], |i, j| {
        let [x, y] = [i, j].map(|k| 100.0 * (f64::from(k) / f64::from(n) - 0.5));
        Point3::new(x, y, rng.between(-2.0, 2.0))
    });
    TriMesh::new(vertices, triangles).unwrap()
}

fn square(half: f64) -> MeshTree {
    let corner = |x: f64, y: f64| Point3::new(x * half, y * half, 0.0);
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    MeshTree::new(&TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap())
}

fn pose(tip: [f64; 3], turn: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(tip), UnitQuaternion::from_scaled_axis(turn))
}

/// Points of every triangle, at most `spacing` from any other point of it.
fn samples(mesh: &TriMesh, spacing: f64) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    for k in 0..mesh.triangles().len() {
        let [a, b, c] = mesh.corners(k);
        let n = ((b - a).norm().max((c - b).norm()).max((a - c).norm()) / spacing).ceil();
        for i in 0..=n as u32 {
            for j in 0..=(n as u32 - i) {
                points.push(a + (b - a) * (f64::from(i) / n) + (c - a) * (f64::from(j) / n));
            }
        }
    }
    points
}

/// Depth of a point in the cutter as a solid, from its outline in the half plane; negative outside.
fn depth_in_cutter(c: &Cutter, p: &Point3<f64>) -> f64 {
    let (rho, r) = (p.x.hypot(p.y), c.corner_radius());
    let (out, up) = (rho - c.rim_radius(), r - p.z);
    if out > 0.0 && up > 0.0 { r - out.hypot(up) } else { (c.radius() - rho).min(p.z) }
}

#[test]
fn depth_of_random_poses_is_that_of_a_dense_cloud_of_mesh_points() {
    let mut rng = Random(3);
    let mesh = patch(6, &mut rng);
    let (tree, spacing) = (MeshTree::new(&mesh), 0.5);
    let cloud = samples(&mesh, spacing);
    let cutter = Cutter::new(16.0, 5.0, 60.0).unwrap();
    let probe = CutterDepth::new(&cutter);
    let mut track = CutterTrack::default();
    let mut n_deep = 0;
    for _ in 0..150 {
        let turn = Vector3::new(rng.between(-0.3, 0.3), rng.between(-0.3, 0.3), rng.between(-3.0, 3.0));
        let at = pose([rng.between(-30.0, 30.0), rng.between(-30.0, 30.0), rng.between(1.0, 7.0)], turn);
        let deepest = cloud.iter().map(|p| depth_in_cutter(&cutter, &at.inverse_transform_point(p)));
        let sampled = deepest.fold(f64::NEG_INFINITY, f64::max);
        let found = probe.beyond(0.0, 0.0, &probe.placed(&at), &mut track, &tree).map_or(0.0, |d| d.depth);
        // Below r the depth of a point is its distance from the cutter's surface; deeper, sharp
        // bodies bound it.
        if sampled < 4.0 {
            assert!(found >= sampled - 1e-9, "{found} {sampled}");
            assert!(found <= sampled.max(0.0) + spacing, "{found} {sampled}");
        } else {
            assert!(found >= sampled - 2.0 * RESOLUTION && found <= 1.5 * sampled + 1.0, "{found} {sampled}");
        }
        n_deep += i32::from(found > 0.0);
    }
    assert!((30..145).contains(&n_deep), "{n_deep} of 150 poses are in the mesh");
}

#[test]
fn flat_bottom_and_deep_torus_have_their_true_depth_in_a_plane() {
    let plane = square(100.0);
    for (r, h) in [(0.0, 0.02), (0.0, 1.0), (2.0, 0.5), (2.0, 1.999), (2.0, 3.0), (8.0, 0.1)] {
        let probe = CutterDepth::new(&Cutter::new(8.0, r, 30.0).unwrap());
        let at = probe.placed(&pose([3.0, -4.0, -h], Vector3::zeros()));
        let d = probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &plane).unwrap();
        assert!((d.depth - h).abs() < 2.0 * RESOLUTION, "r {r} h {h}: {d:?}");
        // 1 mm that has to stay makes it 1 mm deeper.
        let d = probe.beyond(0.0, 1.0, &at, &mut CutterTrack::default(), &plane).unwrap();
        assert!(d.depth >= h + 1.0 - 1e-9 && d.depth < 1.5 * (h + 1.0), "r {r} h {h}: {d:?}");
    }
}

#[test]
fn tilted_flat_cutter_is_at_least_as_deep_as_its_lowest_point_and_at_most_root_two_of_it() {
    let plane = square(100.0);
    let probe = CutterDepth::new(&Cutter::new(8.0, 0.0, 30.0).unwrap());
    for tilt in [0.05_f64, 0.3, 0.7] {
        for h in [0.05, 0.4] {
            let at = probe.placed(&pose([0.0, 0.0, 8.0 * tilt.sin() - h], Vector3::new(0.0, tilt, 0.0)));
            let d = probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &plane).unwrap();
            assert!(d.depth >= h - 1e-9 && d.depth <= SQRT_2 * h + RESOLUTION, "tilt {tilt} h {h}: {d:?}");
            assert_eq!(probe.beyond(SQRT_2 * h + 0.01, 0.0, &at, &mut CutterTrack::default(), &plane), None);
        }
    }
}

#[test]
fn upper_rim_of_a_short_flute_is_part_of_the_cutter() {
    // The wall at x = 0 ends below: only the top corner of the flute reaches it.
    let wall = |low: f64| {
        let corner = |y, z| Point3::new(0.0, y, z);
        let v = vec![corner(-50.0, low), corner(50.0, low), corner(50.0, 40.0), corner(-50.0, 40.0)];
        MeshTree::new(&TriMesh::new(v, vec![[0, 1, 2], [0, 2, 3]]).unwrap())
    };
    let probe = CutterDepth::new(&Cutter::new(20.0, 6.0, 10.0).unwrap());
    let at = probe.placed(&pose([-19.7, 0.0, 0.0], Vector3::zeros()));
    let depth = |low| probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &wall(low)).unwrap().depth;
    assert!((depth(8.0) - 0.3).abs() < 2.0 * RESOLUTION, "{}", depth(8.0));
    // A tenth below the top it is nearer to the top than to the wall.
    assert!((0.1..=0.1 * SQRT_2 + RESOLUTION).contains(&depth(9.9)), "{}", depth(9.9));
    assert_eq!(probe.beyond(0.0, 0.0, &at, &mut CutterTrack::default(), &wall(10.1)), None);
}

#[test]
fn cutter_wholly_inside_a_closed_part_is_deep() {
    let cube = MeshTree::new(&kit::box_mesh([-200.0; 3], [200.0; 3]));
    let probe = CutterDepth::new(&Cutter::new(8.0, 2.0, 30.0).unwrap());
    let mut track = CutterTrack::default();
    let outside = probe.placed(&pose([0.0, 0.0, 300.0], Vector3::zeros()));
    assert_eq!(probe.beyond(0.0, 0.0, &outside, &mut track, &cube), None);
    let inside = probe.placed(&pose([0.0, 0.0, -50.0], Vector3::zeros()));
    assert!(probe.beyond(0.0, 0.0, &inside, &mut track, &cube).is_some_and(|d| d.depth >= 8.0));
    assert_eq!(probe.beyond(0.0, 0.0, &outside, &mut track, &cube), None);
}
