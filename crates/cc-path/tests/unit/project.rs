use super::*;
use crate::path_file::{PathFileError, PathFormat};
use crate::test_kit::{Random, cylinder, plane, surface};
use facemill_cl_data::CcPointError;

fn path(points_mm: Vec<[f64; 3]>, normals: Option<Vec<[f64; 3]>>) -> PathFile {
    let passes = vec![PassFile { points_mm, normals }];
    PathFile { format: PathFormat::V1, frame: PathFrame::Work, passes }
}

fn within(max_distance: f64) -> ProjectSettings {
    ProjectSettings { max_distance, work_from_mesh: Isometry3::identity() }
}

#[test]
fn points_land_on_the_nearest_point_with_its_normal_and_the_feed_of_the_pass() {
    let s = surface(cylinder(50.0, 100.0, 1.0, 20, 200));
    // A helix a little above the wall, unevenly spaced.
    let at = |t: f64| Vector3::new(50.0 + 20.0 * t, 50.0 * t.sin(), 50.0 * t.cos());
    let ts: Vec<f64> = (0..=40).map(|k| -0.8 + 0.04 * f64::from(k) + 0.01 * f64::from(k % 3)).collect();
    let lifted = |t: f64| [at(t).x, at(t).y * 1.004, at(t).z * 1.004];
    let passes = project(&path(ts.iter().map(|&t| lifted(t)).collect(), None), &s, &within(0.3)).unwrap();
    for (cc, &t) in passes[0].points.iter().zip(&ts).skip(1).take(ts.len() - 2) {
        // Facets stand back by 50·0.01²/8 = 0.6 µm.
        assert!((cc.position.coords - at(t)).norm() < 2e-3, "{}", (cc.position.coords - at(t)).norm());
        assert!(cc.normal.angle(&Vector3::new(0.0, t.sin(), t.cos())) < 1e-4);
        assert!(cc.feed.angle(&Vector3::new(20.0, 50.0 * t.cos(), -50.0 * t.sin())) < 1e-3);
    }
}

#[test]
fn a_point_too_far_away_is_named_with_its_place() {
    let s = surface(plane(10.0, 10.0, 2, 2));
    let far = path(vec![[1.0, 1.0, 0.1], [2.0, 1.0, 0.1], [3.0, 1.0, 0.6]], None);
    let e = project(&far, &s, &within(0.5)).unwrap_err();
    let position = Point3::new(3.0, 1.0, 0.6);
    assert_eq!(e, PathError::TooFar { pass: 0, point: 2, position, max_distance: 0.5 });
    assert!(e.to_string().contains("pass 0, point 2 at (3.000000, 1.000000, 0.600000)"), "{e}");
    assert!(project(&far, &s, &within(0.7)).is_ok());
    assert!(matches!(project(&far, &s, &within(f64::NAN)), Err(PathError::Setting { .. })));
}

#[test]
fn points_without_a_feed_direction_are_refused() {
    let s = surface(plane(10.0, 10.0, 2, 2));
    // Both project on the same point.
    let e = project(&path(vec![[1.0, 1.0, 0.1], [2.0, 1.0, 0.1], [2.0, 1.0, 0.3]], None), &s, &within(1.0));
    assert_eq!(e.unwrap_err(), PathError::RepeatedPoint { pass: 0, point: 2 });
    let back = path(vec![[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0]], None);
    let e = project(&back, &s, &within(1.0)).unwrap_err();
    assert_eq!(e, PathError::Point { pass: 0, point: 1, source: CcPointError::FeedAlongNormal });
    // Back by less than forward, and past a sharp corner.
    for (third, corner) in [([1.4, 1.0, 0.0], true), ([1.6, 2.0, 0.0], false)] {
        let points = path(vec![[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], third], None);
        assert_eq!(project(&points, &s, &within(1.0)).is_err(), corner);
    }
    let single = project(&path(vec![[1.0, 1.0, 0.0]], None), &s, &within(1.0)).unwrap_err();
    assert_eq!(single, PathError::File(PathFileError::TooFewPoints { pass: 0, n_points: 1 }));
}

#[test]
fn normals_of_the_file_are_kept_unless_they_point_into_the_material() {
    let s = surface(plane(10.0, 10.0, 2, 2));
    let points = || vec![[1.0, 1.0, 0.0], [2.0, 1.0, 0.0]];
    let leaning = path(points(), Some(vec![[0.0, 0.0, 5.0], [0.0, 3.0, 4.0]]));
    let passes = project(&leaning, &s, &within(0.1)).unwrap();
    assert!((passes[0].points[1].normal.into_inner() - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
    let opposed = path(points(), Some(vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]));
    let e = project(&opposed, &s, &within(0.1)).unwrap_err();
    assert_eq!(e, PathError::NormalOpposed { pass: 0, point: 1, angle_deg: 180.0 });
}

#[test]
fn a_path_in_the_mesh_frame_moves_with_the_part() {
    let mut rng = Random(11);
    let mesh = cylinder(50.0, 100.0, 1.0, 5, 40);
    let points: Vec<[f64; 3]> = (1..9).map(|k| [10.0 * f64::from(k), 5.0, 50.0]).collect();
    let normals = Some(vec![[0.0, 0.1, 1.0]; 8]);
    let still = path(points, normals);
    let expected = project(&still, &surface(mesh.clone()), &within(1.0)).unwrap();
    let work_from_mesh = rng.motion(200.0);
    let moving = PathFile { frame: PathFrame::Mesh, ..still };
    let moved = surface(mesh.transformed(&work_from_mesh));
    let passes = project(&moving, &moved, &ProjectSettings { max_distance: 1.0, work_from_mesh }).unwrap();
    for (cc, e) in passes[0].points.iter().zip(&expected[0].points) {
        let e = e.transformed(&work_from_mesh);
        assert!((cc.position - e.position).norm() < 1e-9);
        assert!((cc.normal.into_inner() - e.normal.into_inner()).norm() < 1e-9);
        assert!((cc.feed.into_inner() - e.feed.into_inner()).norm() < 1e-9);
    }
}
