use crate::surface::level_curves::*;
use crate::test_kit::{Random, grid, torus};
use std::f64::consts::TAU;

/// Checks the laws of every set of curves, for any values.
fn check(mesh: &TriMesh, values: &[f64], level: f64, curves: &[LevelCurve]) {
    for c in curves {
        assert!(c.points.len() >= if c.closed { 3 } else { 2 });
        let n = c.points.len();
        for (k, p) in c.points.iter().enumerate() {
            let last = !c.closed && k + 1 == n;
            let [a, b] = p.edge.map(|v| v as usize);
            assert!(a < b && (values[a] >= level) != (values[b] >= level));
            let at = mesh.vertices()[a] + (mesh.vertices()[b] - mesh.vertices()[a]) * p.fraction;
            assert!((at - p.position).norm() < 1e-12);
            assert!(((1.0 - p.fraction) * values[a] + p.fraction * values[b] - level).abs() < 1e-9);
            let corners = mesh.triangles()[p.triangle as usize];
            assert!(corners.contains(&p.edge[0]) && corners.contains(&p.edge[1]), "on its triangle");
            if last {
                continue;
            }
            // The piece to the next point lies in the triangle of this one, with the higher values
            // on the left.
            let next = &c.points[(k + 1) % n];
            let step = next.position - p.position;
            assert!(step.norm() > 0.0);
            let normal = mesh.scaled_normal(p.triangle as usize).normalize();
            assert!(step.dot(&normal).abs() < 1e-9, "in the plane of the triangle");
            let left = normal.cross(&step);
            let [i, j] = [0, 1].map(|m| corners.map(|v| v as usize)[m]);
            let slope = mesh.corners(p.triangle as usize);
            // The gradient of the values over the triangle.
            let k3 = corners[2] as usize;
            let (e1, e2) = (slope[1] - slope[0], slope[2] - slope[0]);
            let (d1, d2) = (values[j] - values[i], values[k3] - values[i]);
            let n2 = e1.cross(&e2);
            let gradient = (e2.cross(&n2) * d1 + n2.cross(&e1) * d2) / n2.norm_squared();
            assert!(left.dot(&gradient) > 0.0);
        }
    }
}

#[test]
fn random_values_give_sound_curves_that_cover_every_crossing_once() {
    let closed_mesh = torus(20.0, 6.0, 16);
    let open_mesh = grid((12, 9), (false, false), |u, v| Point3::new(9.0 * u, 7.0 * v, u * v));
    let mut rng = Random(12);
    for mesh in [&closed_mesh, &open_mesh] {
        for round in 0..40 {
            // Small whole numbers put many vertices exactly on the level.
            let values: Vec<f64> = (0..mesh.vertices().len())
                .map(|_| if round % 2 == 0 { (rng.unit() * 5.0).floor() } else { rng.unit() * 4.0 })
                .collect();
            let curves = level_curves(mesh, &values, 2.0);
            check(mesh, &values, 2.0, &curves);
            assert_eq!(curves, level_curves(mesh, &values, 2.0));
            if round % 2 == 1 {
                let n_crossed = mesh
                    .triangles()
                    .iter()
                    .filter(|t| {
                        t.iter().any(|&v| values[v as usize] >= 2.0) && t.iter().any(|&v| values[v as usize] < 2.0)
                    })
                    .count();
                let n_pieces: usize = curves.iter().map(|c| c.points.len() - usize::from(!c.closed)).sum();
                assert_eq!(n_pieces, n_crossed);
            }
            if std::ptr::eq(mesh, &closed_mesh) {
                assert!(curves.iter().all(|c| c.closed));
            }
        }
    }
}

#[test]
fn a_plane_through_vertices_cuts_a_torus_in_two_whole_circles() {
    let mesh = torus(20.0, 6.0, 16);
    let values: Vec<f64> = mesh.vertices().iter().map(|p| if p.z.abs() < 1e-9 { 0.0 } else { p.z }).collect();
    let curves = level_curves(&mesh, &values, 0.0);
    assert_eq!(curves.len(), 2);
    for (curve, radius) in curves.iter().zip([14.0, 26.0]) {
        assert!(curve.closed && curve.points.len() == 16, "the vertices, each once");
        assert!(curve.points.iter().all(|p| (p.position.coords.norm() - radius).abs() < 1e-9));
    }
}

#[test]
fn the_length_of_a_slanted_section_is_that_of_the_ellipse() {
    // Cylinder of radius 5 about z, cut by z = x / 2: half axes 5 and 5·√1.25; circumference after
    // Ramanujan.
    let mesh = grid((200, 30), (true, false), |u, v| {
        Point3::new(5.0 * (u * TAU).cos(), 5.0 * (u * TAU).sin(), 12.0 * v - 6.0)
    });
    let values: Vec<f64> = mesh.vertices().iter().map(|p| p.z - 0.5 * p.x).collect();
    let curves = level_curves(&mesh, &values, 0.0);
    assert_eq!(curves.len(), 1);
    let p = &curves[0].points;
    let length: f64 = (0..p.len()).map(|k| (p[(k + 1) % p.len()].position - p[k].position).norm()).sum();
    let (a, b) = (5.0 * 1.25f64.sqrt(), 5.0);
    let h = ((a - b) / (a + b)).powi(2);
    let exact = TAU / 2.0 * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    assert!((length / exact - 1.0).abs() < 1e-3, "{length} {exact}");
}

#[test]
fn missing_values_and_left_out_triangles_end_curves() {
    let mesh = grid((6, 1), (false, false), |u, v| Point3::new(6.0 * u, v, 0.0));
    let mut values: Vec<f64> = mesh.vertices().iter().map(|p| p.y).collect();
    assert_eq!(level_curves(&mesh, &values, 0.5).len(), 1);
    let edges = Edges::of(&mesh);
    assert_eq!(level_curves_among(&mesh, &edges, &values, 0.5, (0..12).filter(|&t| t != 5)).len(), 2);
    assert_eq!(level_curves(&mesh, &values[..4], 0.5).len(), 1);
    values[6] = f64::NAN;
    assert_eq!(level_curves(&mesh, &values, 0.5).len(), 2);
    assert!(level_curves(&mesh, &[], 0.5).is_empty());
    let huge: Vec<f64> = mesh.vertices().iter().map(|p| if p.y > 0.5 { f64::MAX } else { -f64::MAX }).collect();
    assert!(level_curves(&mesh, &huge, 0.0)[0].points.iter().all(|p| (p.position.y - 0.5).abs() < 1e-12));
}

#[test]
fn a_tip_that_just_reaches_the_level_leaves_no_curve() {
    let mesh = grid((4, 4), (false, false), |u, v| Point3::new(u, v, 0.0));
    let mut values = vec![0.0; 25];
    values[12] = 1.0;
    assert!(level_curves(&mesh, &values, 1.0).is_empty());
    assert_eq!(level_curves(&mesh, &values, 0.5).len(), 1);
}

#[test]
fn curves_end_at_a_non_manifold_edge() {
    // Three leaves on one edge.
    let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let vertices = vec![p(0.0, 0.0, 0.0), p(0.0, 0.0, 1.0), p(1.0, 0.0, 0.0), p(-1.0, 1.0, 0.0), p(-1.0, -1.0, 0.0)];
    let mesh = TriMesh::new(vertices, vec![[0, 2, 1], [0, 3, 1], [0, 4, 1]]).unwrap();
    let values: Vec<f64> = mesh.vertices().iter().map(|p| p.z).collect();
    let curves = level_curves(&mesh, &values, 0.5);
    assert_eq!(curves.len(), 3);
    assert!(curves.iter().all(|c| !c.closed && c.points.len() == 2));
}
