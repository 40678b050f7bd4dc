//! Dense scans of search curves, and rods that leave short feasible stretches on them.

use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::{Hints, PoseTest, SearchCurve};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{Cutter, cl_from_cc};
use nalgebra::{Point3, Vector3};

/// Returns the feasible stretches of a curve, as first and last u, by a scan in `n` steps.
pub(crate) fn stretches(test: &PoseTest<'_>, cc: &CcPoint, curve: &SearchCurve, n: usize) -> Vec<[f64; 2]> {
    let mut hints = Hints::default();
    let at = |k: usize| k as f64 / n as f64;
    let scan: Vec<bool> = (0..=n).map(|k| test.try_posture(cc, curve.at(at(k)), None, &mut hints).is_ok()).collect();
    let mut found = Vec::new();
    let mut k = 0;
    for run in scan.chunk_by(|a, b| a == b) {
        if run[0] {
            found.push([at(k), at(k + run.len() - 1)]);
        }
        k += run.len();
    }
    found
}

/// Returns a thin rod that reaches up to a place.
pub(crate) fn post(at: &Point3<f64>, width: f64) -> TriMesh {
    let corner = |x: f64, y: f64| at + Vector3::new(x, y, 0.0);
    let top = [corner(-width, -width), corner(width, -width), corner(0.0, width)];
    let bottom = top.map(|p| p - Vector3::z() * 30.0);
    let vertices: Vec<Point3<f64>> = top.into_iter().chain(bottom).collect();
    let sides = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5], [0, 1, 2]];
    TriMesh::new(vertices, sides.to_vec()).unwrap()
}

/// Returns a place in the frame of the cutter at a posture: along the front (the tilt's direction),
/// to its left, and up the axis.
pub(crate) fn beside(cutter: &Cutter, cc: &CcPoint, posture: Posture, front_left_up: [f64; 3]) -> Point3<f64> {
    let cl = cl_from_cc(cutter, cc, posture);
    let (sin, cos) = posture.tilt.sin_cos();
    let front = cc.tilt_direction(posture.rotate).into_inner() * cos - cc.normal.into_inner() * sin;
    let left = cl.axis.cross(&front);
    let [x, y, z] = front_left_up;
    cl.tip + front * x + left * y + cl.axis.into_inner() * z
}
