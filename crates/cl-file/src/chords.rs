//! Arcs as chords.

use std::f64::consts::{FRAC_PI_2, TAU};

use facemill_cl_data::ClPoint;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::apt_file::AptArc;

/// Largest difference of the distances of both ends from the axis, mm. Larger would take a wrong
/// centre for an arc; smaller refuses files in inches with three decimals.
const RADIUS_DIFFERENCE: f64 = 0.05;

/// Distance of the ends below which the arc is a full circle, mm: rounding of the same decimals.
const CLOSED: f64 = 1e-6;

/// Distance of the ends below which the angle has to say whether the arc is a full circle or next
/// to none, mm: rounding of three decimals in a file.
const NEARLY_CLOSED: f64 = 1e-3;

/// Largest difference of the angle of the turn from that of the statement, rad.
const ANGLE_DIFFERENCE: f64 = 0.01;

/// Most chords of an arc.
const MAX_CHORDS: f64 = 100_000.0;

/// Returns the poses on an arc behind its start, the last one its end: the tip between two of them
/// leaves the arc by at most `tolerance` mm. Height along the axis and tool axis change evenly.
///
/// # Errors
/// If the ends are not on one circle about the axis, the given angle is not that of the turn, or
/// the arc needs too many chords.
pub fn arc_chords(from: &ClPoint, to: &ClPoint, arc: &AptArc, tolerance: f64) -> Result<Vec<ClPoint>, String> {
    let [(start, low), (end, high)] = [from, to].map(|cl| across(&cl.tip, arc));
    let radii = [start.norm(), end.norm()];
    if (radii[0] - radii[1]).abs() > RADIUS_DIFFERENCE || radii[0] < NEARLY_CLOSED {
        return Err(format!(
            "the arc begins {:.4} mm from its axis and ends {:.4} mm from it: centre, axis or end are wrong",
            radii[0], radii[1]
        ));
    }
    if let Some(radius) = arc.radius.filter(|radius| (radius - radii[0]).abs() > RADIUS_DIFFERENCE) {
        return Err(format!("the arc is {:.4} mm from its axis, and its radius is given as {radius:.4} mm", radii[0]));
    }
    let turn = turn(arc, &start, &end)?;
    let radius = radii[0].max(radii[1]);
    let step = if tolerance >= radius { FRAC_PI_2 } else { (2.0 * (1.0 - tolerance / radius).acos()).min(FRAC_PI_2) };
    let n = (turn.abs() / step).ceil().max(1.0);
    if n.is_nan() || n > MAX_CHORDS {
        return Err(format!("the arc needs {n} chords within {tolerance} mm, more than {MAX_CHORDS}"));
    }
    let on_arc = |k: usize| {
        let t = k as f64 / n;
        let rotation = UnitQuaternion::from_axis_angle(&arc.axis, turn * t);
        let out = rotation * start * (1.0 + (radii[1] / radii[0] - 1.0) * t);
        let tip = arc.center + out + arc.axis.into_inner() * (low + (high - low) * t);
        let axis = from.axis.try_slerp(&to.axis, t, 1e-12).unwrap_or(from.axis);
        ClPoint { tip, axis }
    };
    let n = n as usize;
    Ok((1..n).map(on_arc).chain([*to]).collect())
}

/// The way from the axis to a point, and the point's height along it.
fn across(tip: &Point3<f64>, arc: &AptArc) -> (Vector3<f64>, f64) {
    let from_center = tip - arc.center;
    let height = from_center.dot(&arc.axis);
    (from_center - arc.axis.into_inner() * height, height)
}

/// The turn about the axis from start to end, rad: by the right-hand rule, unless the given angle
/// says the other way round.
fn turn(arc: &AptArc, start: &Vector3<f64>, end: &Vector3<f64>) -> Result<f64, String> {
    let angle = arc.axis.dot(&start.cross(end)).atan2(start.dot(end)).rem_euclid(TAU);
    let apart = (start - end).norm();
    let turn = if apart < CLOSED { TAU } else { angle };
    let Some(given) = arc.angle else {
        if (CLOSED..NEARLY_CLOSED).contains(&apart) {
            return Err(format!(
                "the ends of the arc are {apart:.6} mm apart: it may be a full circle or none; give ANGLE, or the same \
                 point twice"
            ));
        }
        return Ok(turn);
    };
    if apart < NEARLY_CLOSED && (TAU - given.abs()).abs() <= ANGLE_DIFFERENCE {
        // Rounding puts the end of a full circle before or behind its start.
        return Ok(if turn > 0.5 * TAU { turn } else { turn + TAU });
    }
    if (given.abs() - turn).abs() <= ANGLE_DIFFERENCE {
        Ok(turn)
    } else if (TAU - turn - given.abs()).abs() <= ANGLE_DIFFERENCE {
        Ok(turn - TAU)
    } else {
        let [given, turn] = [given, turn].map(f64::to_degrees);
        Err(format!("the arc's ANGLE is {given:.3} deg, and its ends are {turn:.3} deg apart about its axis"))
    }
}

impl AptArc {
    /// Returns the same arc after tool and part have moved by `to_from`.
    #[must_use]
    pub fn transformed(&self, to_from: &Isometry3<f64>) -> Self {
        let axis = Unit::new_normalize(to_from.rotation * self.axis.into_inner());
        Self { center: to_from * self.center, axis, ..*self }
    }
}
