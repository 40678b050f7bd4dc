//! Poses along a cut.

use facemill_cl_data::ClPoint;
use nalgebra::{Unit, Vector3};

use crate::cuts::FilePoint;

/// Largest turn of the axis between two poses, rad.
const LARGEST_TURN: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Most poses between two points of a file.
const MOST: f64 = 1e6;

/// Returns the number of steps from one point to the next: the tip moves by at most `max_step` mm
/// in each.
pub(crate) fn steps(from: &FilePoint, to: &FilePoint, max_step: f64) -> usize {
    let turn = from.cl.axis.angle(&to.cl.axis) / LARGEST_TURN;
    let length = (to.cl.tip - from.cl.tip).norm() / max_step;
    // Rounding of a length must not make one more.
    (turn.max(length) - 1e-9).ceil().clamp(1.0, MOST) as usize
}

/// Returns the pose between two points, where the tip moves on a line and the axis turns evenly.
/// The line of the file is that of the second one.
pub(crate) fn between(from: &FilePoint, to: &FilePoint, t: f64) -> FilePoint {
    let axis = from.cl.axis.try_slerp(&to.cl.axis, t, 1e-12).unwrap_or(from.cl.axis);
    FilePoint { line: to.line, cl: ClPoint { tip: from.cl.tip + (to.cl.tip - from.cl.tip) * t, axis } }
}

/// Returns the direction of the tip at each point of a cut: that to the next one, or from the one
/// before at its end; zero where the tip rests throughout.
pub(crate) fn directions(points: &[FilePoint]) -> Vec<Vector3<f64>> {
    let mut last = points.windows(2).find_map(|w| direction(&w[0], &w[1])).unwrap_or_else(Vector3::zeros);
    let mut all = Vec::with_capacity(points.len());
    for k in 0..points.len() {
        last = points.get(k + 1).and_then(|next| direction(&points[k], next)).unwrap_or(last);
        all.push(last);
    }
    all
}

fn direction(from: &FilePoint, to: &FilePoint) -> Option<Vector3<f64>> {
    Unit::try_new(to.cl.tip - from.cl.tip, 1e-9).map(Unit::into_inner)
}
