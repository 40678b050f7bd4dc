//! The tool path of Ma, Yuan, Shen, Gao: Optimal feedrate planning on a five-axis parametric tool
//! path with global geometric and kinematic constraints, J. Comput. Des. Eng. 9 (6) (2022), doi
//! 10.1093/jcde/qwac116, appendix 1: a cubic B-spline of tip and top points on a machine with a
//! table that tilts about X (A) and turns about Z (C).

use facemill_feedrate::{AxisBounds, Jet, JointPath, MotionBounds, PathPoint};
use facemill_inverse_kinematics::AxisValues;
use nalgebra::Vector3;

const KNOTS: [f64; 12] = [0.0, 0.0, 0.0, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0, 1.0];
const TIP: [[f64; 3]; 8] = [
    [5.0, 0.0, 0.0],
    [-10.0, 20.0, 0.0],
    [10.0, 20.0, 0.0],
    [20.0, 30.0, 0.0],
    [30.0, 30.0, 0.0],
    [40.0, 30.0, 0.0],
    [50.0, 20.0, 0.0],
    [55.0, 0.0, 0.0],
];
const TOP: [[f64; 3]; 8] = [
    [0.0, 0.0, 15.0],
    [-15.0, 20.0, 15.0],
    [5.0, 25.0, 15.0],
    [15.0, 35.0, 15.0],
    [30.0, 35.0, 15.0],
    [45.0, 35.0, 15.0],
    [55.0, 25.0, 15.0],
    [60.0, 0.0, 15.0],
];

/// The published path.
pub(crate) struct SplinePath;

/// The published limits.
pub(crate) fn published_bounds() -> MotionBounds {
    let linear = AxisBounds { velocity: 100.0, acceleration: 500.0, jerk: 3000.0 };
    let a = AxisBounds { velocity: 0.4, acceleration: 0.5, jerk: 1.5 };
    let c = AxisBounds { velocity: 0.8, ..a };
    MotionBounds::new(vec![linear, linear, linear, a, c])
}

/// De Boor's algorithm on jets.
fn de_boor(points: &[[f64; 3]; 8], piece: usize, u: f64) -> [Jet; 3] {
    let u = Jet::parameter(u);
    [0, 1, 2].map(|coordinate| {
        let mut d: [Jet; 4] = std::array::from_fn(|j| Jet::constant(points[piece + j][coordinate]));
        for r in 1..4 {
            for j in (r..4).rev() {
                let (low, high) = (KNOTS[piece + j], KNOTS[piece + j + 4 - r]);
                let alpha = (u - Jet::constant(low)) * (1.0 / (high - low));
                d[j] = d[j - 1] * (Jet::constant(1.0) - alpha) + d[j] * alpha;
            }
        }
        d[3]
    })
}

impl JointPath for SplinePath {
    fn breaks(&self) -> Vec<f64> {
        vec![0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    }

    fn at(&self, piece: usize, u: f64) -> PathPoint {
        let p = de_boor(&TIP, piece, u);
        let top = de_boor(&TOP, piece, u);
        let o = [top[0] - p[0], top[1] - p[1], top[2] - p[2]];
        let a = (o[0] * o[0] + o[1] * o[1]).sqrt().atan2(o[2]);
        let c = o[0].atan2(o[1]);
        let ((ca, sa), (cc, sc)) = ((a.cos(), a.sin()), (c.cos(), c.sin()));
        let turned = sc * p[0] + cc * p[1];
        let joints = [cc * p[0] - sc * p[1], ca * turned - sa * p[2], sa * turned + ca * p[2], a, c];
        PathPoint {
            axes: [0, 1, 2, 3].map(|d| AxisValues::from(joints.map(|j| j.0[d]))),
            tip: Some([0, 1, 2, 3].map(|d| Vector3::new(p[0].0[d], p[1].0[d], p[2].0[d]))),
        }
    }
}

/// Points of the spline by the recursion of its basis functions, with no derivatives.
fn spline(points: &[[f64; 3]; 8], u: f64) -> Vector3<f64> {
    fn basis(i: usize, degree: usize, u: f64) -> f64 {
        if degree == 0 {
            let last = KNOTS[i + 1] == 1.0 && u == 1.0;
            return if (KNOTS[i] <= u && u < KNOTS[i + 1]) || (last && KNOTS[i] < 1.0) { 1.0 } else { 0.0 };
        }
        let part = |from: usize, to: usize, value: f64| {
            let width = KNOTS[to] - KNOTS[from];
            if width == 0.0 { 0.0 } else { value / width }
        };
        part(i, i + degree, u - KNOTS[i]) * basis(i, degree - 1, u)
            + part(i + 1, i + degree + 1, KNOTS[i + degree + 1] - u) * basis(i + 1, degree - 1, u)
    }
    points.iter().enumerate().map(|(i, p)| Vector3::from(*p) * basis(i, 3, u)).sum()
}

/// The tip at `u`, by plain numbers.
pub(crate) fn tip(u: f64) -> Vector3<f64> {
    spline(&TIP, u)
}

/// X, Y, Z, A and C at `u`, by plain numbers and matrices as published.
pub(crate) fn joints(u: f64) -> [f64; 5] {
    let (p, top) = (tip(u), spline(&TOP, u));
    let o = (top - p).normalize();
    let (a, c) = ((o.x * o.x + o.y * o.y).sqrt().atan2(o.z), o.x.atan2(o.y));
    let ((sa, ca), (sc, cc)) = (a.sin_cos(), c.sin_cos());
    let x = cc * p.x - sc * p.y;
    let y = ca * sc * p.x + ca * cc * p.y - sa * p.z;
    let z = sa * sc * p.x + sa * cc * p.y + ca * p.z;
    [x, y, z, a, c]
}
