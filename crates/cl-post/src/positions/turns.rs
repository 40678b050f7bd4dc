//! Turns of rotary axes that the motion of the tool does not ask for, and the tool lifted for them.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::AxisValues;
use facemill_inverse_kinematics::motion::deviation_bound;
use nalgebra::Point3;

use crate::positions::ways::{MotionRules, near};
use crate::scene::MAX_BETWEEN;

/// Returns the positions between two in which all rotary axes turn evenly and the tip goes
/// straight, within `tolerance` mm.
///
/// # Errors
/// If the linear axes cannot hold the tip, an axis meets a limit, or too many positions are needed.
pub(crate) fn turned(
    ways: &MotionRules<'_>,
    [from, to]: [&AxisValues; 2],
    tolerance: f64,
) -> Result<Vec<AxisValues>, String> {
    let tip = |q: &AxisValues| ways.machine.cl_point(q, ways.tool_length).tip;
    let (start, end) = (tip(from), tip(to));
    let at = |t: f64| {
        let on_line = start + (end - start) * t;
        let held = ways.machine.with_tip_at(&from.lerp(to, t), &on_line, ways.tool_length);
        let held = held.ok_or("the linear axes cannot hold the tip while rotary axes turn")?;
        match ways.machine.first_beyond_limit(&held) {
            None => Ok(held),
            Some(axis) => Err(format!(
                "axis {} meets its limit while rotary axes turn with the tip held",
                ways.machine.axes()[axis].letter
            )),
        }
    };
    let mut parts = 1;
    while parts <= MAX_BETWEEN {
        let inner: Vec<AxisValues> = (1..parts).map(|k| at(k as f64 / parts as f64)).collect::<Result<_, String>>()?;
        let all: Vec<&AxisValues> = std::iter::once(from).chain(&inner).chain([to]).collect();
        let law = if ways.has_bent_rapids { ways.cutting.into() } else { ways.rapid };
        let holds = |pair: &[&AxisValues]| {
            deviation_bound(ways.machine, law, pair[0], pair[1], ways.tool_length).tip <= tolerance
        };
        if all.windows(2).all(holds) {
            return Ok(inner);
        }
        parts *= 2;
    }
    Err(format!("more than {MAX_BETWEEN} positions hold the tip while rotary axes turn"))
}

/// Returns the position with the tool lifted along its axis.
///
/// # Errors
/// If an axis meets its limit.
pub(crate) fn lifted(ways: &MotionRules<'_>, from: &AxisValues, by: f64) -> Result<AxisValues, String> {
    let cl = ways.machine.cl_point(from, ways.tool_length);
    let tip = cl.tip + cl.axis.into_inner() * by;
    let up = with_tip(ways, from, &tip);
    up.map_err(|why| format!("{why}, lifted by {by} mm along the tool axis"))
}

/// Returns the position with these rotary axes and the tip at a point of the table frame.
///
/// # Errors
/// If an axis meets its limit.
pub(crate) fn with_tip(ways: &MotionRules<'_>, rotary: &AxisValues, tip: &Point3<f64>) -> Result<AxisValues, String> {
    let held = ways.machine.with_tip_at(rotary, tip, ways.tool_length);
    let held = held.ok_or("the linear axes cannot hold the tip")?;
    match ways.machine.first_beyond_limit(&held) {
        None => Ok(held),
        Some(axis) => Err(format!("axis {} meets its limit", ways.machine.axes()[axis].letter)),
    }
}

/// Returns the position at a pose from which the next position continues.
///
/// # Errors
/// If there is none within the limits.
pub(crate) fn other_solution(ways: &MotionRules<'_>, pose: &ClPoint, next: &AxisValues) -> Result<AxisValues, String> {
    near(ways, pose, next).ok_or_else(|| {
        "the pose before it is not reached by the solution that goes on from it: the cut has to be split there"
            .to_owned()
    })
}
