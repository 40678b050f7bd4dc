//! Points of a path file projected on a surface.

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

/// Points of a pass nearer than this are the same, mm: the direction from one to the other would be
/// rounding noise at coordinates of 10 m.
const SAME_POINT: f64 = 1e-9;

/// The passes of a path file on a drive surface (workpiece frame): every point moved to the nearest
/// point of the surface.
///
/// The feed is the direction of the projected pass: at each point that of the parabola through it
/// and the points around it, at an end through the next two. Normals are the file's where it has
/// them, else the surface's.
///
/// # Errors
/// When a point is farther from the surface than allowed, two points in a row project on the same
/// point, a normal of the file is more than 90° from the surface's, or the feed turns back on
/// itself or is normal to the surface. The error names pass and point.
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
        CcPoint::new(at.position, normal.into_inner(), feed_along(&positions, point))
            .map_err(|source| PathError::Point { pass, point, source })
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

/// Returns the direction of the curve through the points at the one of index `k`, exact for a
/// parabola through three of them; zero where it turns back, by more than 120°.
///
/// # Panics
/// If there is no point of that index.
pub fn feed_along(positions: &[Point3<f64>], k: usize) -> Vector3<f64> {
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

/// Direction at the end of a curve, by the chord at the end and the next one, both along the feed:
/// exact for a parabola. A chord alone is off by half the bend, which a strong bend between points
/// far apart makes 10° and more.
///
/// Where the next chord turns by more than 60°, it is no measure of the bend at the end.
fn at_end(chord: Vector3<f64>, next: Option<Vector3<f64>>) -> Vector3<f64> {
    let length = chord.norm();
    let Some(next) = next.filter(|next| next.dot(&chord) >= 0.5 * length * next.norm()) else { return chord };
    let (unit, next_length) = (chord / length, next.norm());
    unit + (unit - next / next_length) * (length / (length + next_length))
}

#[cfg(test)]
#[path = "../tests/unit/project.rs"]
mod tests;
