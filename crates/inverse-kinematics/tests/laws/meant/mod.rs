//! Ideal motion of two positions, and the deviation of the real motion from it, by dense sampling
//! and matrices.
#![allow(dead_code, unreachable_pub, reason = "every test program uses a part of it")]

use crate::common::cl_by_matrices;
use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::motion::{Deviation, Linearised, PoseFraction};
use facemill_inverse_kinematics::*;
use nalgebra::{Unit, Vector3};

/// Angle between two unit vectors.
pub fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// Returns the ideal pose at a fraction of the way: the vector between its ends by sines.
pub fn meant(a: &ClPoint, b: &ClPoint, t: f64) -> ClPoint {
    let (u, v) = (a.axis.into_inner(), b.axis.into_inner());
    let whole = angle(&u, &v);
    let axis = if whole < 1e-9 { u } else { u * ((1.0 - t) * whole).sin() + v * (t * whole).sin() };
    ClPoint { tip: a.tip + (b.tip - a.tip) * t, axis: Unit::new_normalize(axis) }
}

pub fn apart(a: &ClPoint, b: &ClPoint) -> Deviation {
    Deviation { tip: (a.tip - b.tip).norm(), axis: angle(&a.axis, &b.axis) }
}

/// Returns the largest deviations of tip, axis and rim (tip + R·δ at one time) at points of a dense
/// sampling, all axes moving linearly.
pub fn sampled(machine: &Machine, tool: f64, radius: f64, [a, b]: [&AxisValues; 2], n: u32) -> [f64; 3] {
    let [p0, p1] = [a, b].map(|q| cl_by_matrices(machine, q, tool));
    let at = |k| f64::from(k) / f64::from(n);
    let deviations = (1..n).map(|k| apart(&cl_by_matrices(machine, &a.lerp(b, at(k)), tool), &meant(&p0, &p1, at(k))));
    deviations.fold([0.0; 3], |[tip, axis, rim], d| [tip.max(d.tip), axis.max(d.axis), rim.max(d.rim(radius))])
}

/// Returns axis values when every axis has run for a time at its own speed.
pub fn own_speeds(machine: &Machine, a: &AxisValues, b: &AxisValues, time: f64) -> AxisValues {
    AxisValues::from_fn(a.len(), |k| {
        let done = machine.axes()[k].max_velocity * time;
        a[k] + (b[k] - a[k]).clamp(-done, done)
    })
}

/// Checks that every pose is at its place, every position within the limits and on the ideal way.
pub fn check_places(machine: &Machine, tool: f64, poses: &[ClPoint], way: &Linearised) {
    assert_eq!(way.positions.len(), way.source.len());
    let kept: Vec<usize> = way.source.iter().filter(|s| s.fraction == 0.0).map(|s| s.pose).collect();
    assert_eq!(kept, (0..poses.len()).collect::<Vec<_>>());
    for pair in way.source.windows(2) {
        let at = |s: &PoseFraction| s.pose as f64 + s.fraction;
        assert!(at(&pair[0]) < at(&pair[1]), "{pair:?}");
    }
    for (q, s) in way.positions.iter().zip(&way.source) {
        assert_eq!(machine.first_beyond_limit(q), None);
        let wanted =
            if s.fraction == 0.0 { poses[s.pose] } else { meant(&poses[s.pose], &poses[s.pose + 1], s.fraction) };
        let off = apart(&cl_by_matrices(machine, q, tool), &wanted);
        assert!(off.tip < 1e-8 && off.axis < 1e-9, "{off:?} at {s}");
    }
}
