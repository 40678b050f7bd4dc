use facemill_cl_data::{CcPoint, Pass};
use facemill_surface_model::{Surface, SurfacePoint};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::error::PathError;
use crate::path_file::{PassFile, PathFile, PathFrame};
use crate::strategy::settings::require;

/// How a path file is put on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectSettings {
    /// Farthest that a point may be from the surface, mm.
    pub max_distance: f64,
    /// Pose of the drive mesh, for paths in its frame.
    pub work_from_mesh: Isometry3<f64>,
}

/// Points of a pass nearer than this are the same, mm: the direction from one to the other would be rounding noise at
/// coordinates of 10 m.
const SAME_POINT: f64 = 1e-9;

/// The passes of a path file on a drive surface (workpiece frame): every point moved to the nearest point of the surface.
///
/// The feed is the direction of the projected pass: at each point that of the parabola through it and the points around it, at
/// an end through the next two. Normals are the file's where it has them, else the surface's.
///
/// # Errors
/// When a point is farther from the surface than allowed, two points in a row project on the same point, a normal of the
/// file is more than 90° from the surface's, or the feed turns back on itself or stands on the surface. The error names
/// pass and point.
pub fn project(
    path: &PathFile,
    surface: &Surface,
    settings: &ProjectSettings,
) -> Result<Vec<Pass<CcPoint>>, PathError> {
    let max_distance = settings.max_distance;
    require("max_distance", max_distance, "a number, not below 0", max_distance >= 0.0)?;
    path.check()?;
    let work_from_path = match path.frame {
        PathFrame::Work => Isometry3::identity(),
        PathFrame::Mesh => settings.work_from_mesh,
    };
    let passes = path.passes.iter().enumerate();
    passes.map(|(pass, file)| project_pass(pass, file, surface, &work_from_path, max_distance)).collect()
}

fn project_pass(
    pass: usize,
    file: &PassFile,
    surface: &Surface,
    work_from_path: &Isometry3<f64>,
    max_distance: f64,
) -> Result<Pass<CcPoint>, PathError> {
    let on_surface = |(point, p): (usize, &[f64; 3])| {
        let position = work_from_path * Point3::from(*p);
        let too_far = PathError::TooFar { pass, point, position, max_distance };
        surface.closest_point(&position, max_distance).ok_or(too_far)
    };
    let found: Vec<SurfacePoint> = file.points_mm.iter().enumerate().map(on_surface).collect::<Result<_, _>>()?;
    let positions: Vec<Point3<f64>> = found.iter().map(|s| s.position).collect();
    let repeated = positions.windows(2).position(|w| (w[1] - w[0]).norm() < SAME_POINT);
    if let Some(before) = repeated {
        return Err(PathError::RepeatedPoint { pass, point: before + 1 });
    }
    let cc = |(point, at): (usize, &SurfacePoint)| {
        let smooth = surface.normal_at(at);
        let normal = match &file.normals {
            Some(normals) => checked_normal(pass, point, work_from_path * Vector3::from(normals[point]), &smooth)?,
            None => smooth,
        };
        CcPoint::new(at.position, normal.into_inner(), feed(&positions, point)).map_err(|source| PathError::Point {
            pass,
            point,
            source,
        })
    };
    found.iter().enumerate().map(cc).collect::<Result<_, _>>().map(Pass::new)
}

fn checked_normal(
    pass: usize,
    point: usize,
    given: Vector3<f64>,
    smooth: &Unit<Vector3<f64>>,
) -> Result<Unit<Vector3<f64>>, PathError> {
    // Scaled first, so that a normal of any length keeps its digits in the squares.
    let given = given / given.amax();
    let angle = given.angle(smooth);
    if angle > std::f64::consts::FRAC_PI_2 {
        return Err(PathError::NormalOpposed { pass, point, angle_deg: angle.to_degrees() });
    }
    Ok(Unit::new_normalize(given))
}

/// Direction of the curve through the points, exact for a parabola through three of them; none where it turns back, by more
/// than 120°.
fn feed(positions: &[Point3<f64>], k: usize) -> Vector3<f64> {
    let before = k.checked_sub(1).map(|j| positions[k] - positions[j]);
    let after = positions.get(k + 1).map(|p| p - positions[k]);
    match (before, after) {
        (Some(before), Some(after)) => {
            // Unit directions, each weighted by the other's length: the nearer neighbour says more.
            let (b, a) = (before.norm(), after.norm());
            if before.dot(&after) < -0.5 * a * b {
                return Vector3::zeros();
            }
            (before / b) * (a / (a + b)) + (after / a) * (b / (a + b))
        }
        (Some(before), None) => at_end(before, k.checked_sub(2).map(|j| positions[k - 1] - positions[j])),
        (None, Some(after)) => at_end(after, positions.get(k + 2).map(|p| p - positions[k + 1])),
        (None, None) => Vector3::zeros(),
    }
}

/// Direction at the end of a curve, by the chord at the end and the next one, both along the feed: exact for a parabola. A chord
/// alone is off by half the bend, which a strong bend between points far apart makes 10° and more.
///
/// Where the next chord turns by more than 60°, it says nothing about the end.
fn at_end(chord: Vector3<f64>, next: Option<Vector3<f64>>) -> Vector3<f64> {
    let length = chord.norm();
    let Some(next) = next.filter(|next| next.dot(&chord) >= 0.5 * length * next.norm()) else { return chord };
    let (unit, next_length) = (chord / length, next.norm());
    unit + (unit - next / next_length) * (length / (length + next_length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path_file::{PathFileError, PathFormat};
    use crate::test_kit::{Lcg, cylinder, plane, surface};
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
        let mut rng = Lcg::new(11);
        let mesh = cylinder(50.0, 100.0, 1.0, 5, 40);
        let points: Vec<[f64; 3]> = (1..9).map(|k| [10.0 * f64::from(k), 5.0, 50.0]).collect();
        let normals = Some(vec![[0.0, 0.1, 1.0]; 8]);
        let still = path(points, normals);
        let expected = project(&still, &surface(mesh.clone()), &within(1.0)).unwrap();
        let work_from_mesh = rng.motion();
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
}
