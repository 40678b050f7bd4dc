//! Check that a mounting lets an operation reach some of its region.

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_inverse_kinematics::{AxisKind, Unreachable};
use facemill_surface_model::{Surface, SurfaceSettings};
use facemill_tool_model::cl_from_cc;
use facemill_tool_path::segments::LaidTask;

use facemill_job::format::job_file::OperationFile;
use facemill_job::frames::places;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::obstacle_meshes::ObstacleRole;
use facemill_job::load::part_size::unit_advice;

/// CC points and directions of tilt to try, and steps of tilt, deg. More than any operation
/// searches, so that no plannable mounting is refused.
const POINTS: usize = 48;

const TURNS: u32 = 12;

const TILTS_DEG: [f64; 10] = [0.0, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 89.0];

/// Least excess of a linear (mm) or rotary axis (rad) over its limits, at the best try, that counts
/// as out of reach: a posture between two tries may be a little better.
const SURE: [f64; 2] = [2.0, 0.035];

/// Reason why a position cannot be reached.
enum Barrier {
    /// An axis at its limit, exceeded by so much, mm or rad.
    Axis(Unreachable, f64),
    /// The position lies in a body of the table.
    Table(String),
}

/// Refuses a mounting in which no posture reaches any of the points tried, in any place of the
/// pattern.
///
/// # Errors
/// A message with operation, axis and limit, or the body of the table that the region lies in.
pub fn check_reach(job: &Job, setup: &Setup<'_>, operation: &OperationFile, tasks: &[LaidTask]) -> Result<(), String> {
    let points: Vec<&CcPoint> = tasks.iter().flat_map(|t| &t.pass.points).collect();
    let points: Vec<&CcPoint> = points.iter().step_by(points.len().div_ceil(POINTS).max(1)).copied().collect();
    let table = table(setup);
    let mut least: Option<Barrier> = None;
    for place in places(operation.pattern.as_ref()) {
        for cc in &points {
            match barrier(job, setup, &table, &cc.transformed(&place)) {
                None => return Ok(()),
                Some(found) => least = Some(lesser(least, found)),
            }
        }
    }
    let Some(barrier) = least else { return Ok(()) };
    if matches!(&barrier, Barrier::Axis(why, by) if *by < sure(why)) {
        return Ok(());
    }
    Err(message(job, setup, operation, points.len(), &barrier))
}

/// Returns the bodies of the table that are still relative to the workpiece, workpiece frame.
fn table(setup: &Setup<'_>) -> Vec<(String, Surface)> {
    let bodies = setup.obstacles.iter().filter(|o| o.role == ObstacleRole::Table && !o.mesh.triangles().is_empty());
    bodies.map(|o| (o.name.clone(), Surface::new(o.mesh.clone(), SurfaceSettings::default()))).collect()
}

/// Returns the least barrier between the tool and a CC point; `None` if a posture reaches it.
fn barrier(job: &Job, setup: &Setup<'_>, table: &[(String, Surface)], cc: &CcPoint) -> Option<Barrier> {
    if let Some((name, _)) = table.iter().find(|(_, body)| body.is_inside(&cc.position)) {
        return Some(Barrier::Table(name.clone()));
    }
    let mut least = None;
    for tilt in TILTS_DEG {
        for turn in 0..TURNS {
            let rotate = std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS);
            let cl = cl_from_cc(job.tool.cutter(), cc, Posture { tilt: tilt.to_radians(), rotate });
            let on_table = ClPoint { tip: setup.table_from_work * cl.tip, axis: setup.table_from_work * cl.axis };
            match job.machine.inverse(&on_table, job.tool.gauge_length()) {
                Ok(_) => return None,
                Err(why) => match excess(&why) {
                    None => return None,
                    Some(by) => least = Some(lesser(least, Barrier::Axis(why, by))),
                },
            }
        }
    }
    least
}

/// Returns by how much limits are exceeded, mm or rad; `None` if the mounting has no influence.
fn excess(why: &Unreachable) -> Option<f64> {
    match why {
        Unreachable::AxisLimit { value, min, max, .. } => Some((min - value).max(value - max)),
        Unreachable::Direction { by, .. } => Some(*by),
        _ => None,
    }
}

fn is_linear(why: &Unreachable) -> bool {
    matches!(why, Unreachable::AxisLimit { kind: AxisKind::Linear, .. })
}

fn sure(why: &Unreachable) -> f64 {
    if is_linear(why) { SURE[0] } else { SURE[1] }
}

/// Returns the barrier that says more: a linear axis before a rotary one, a rotary one before the
/// table; of two alike the smaller excess.
fn lesser(known: Option<Barrier>, new: Barrier) -> Barrier {
    let rank = |b: &Barrier| match b {
        Barrier::Axis(why, by) => (u8::from(!is_linear(why)), *by),
        Barrier::Table(_) => (2, 0.0),
    };
    match known {
        Some(known) if rank(&known) <= rank(&new) => known,
        _ => new,
    }
}

fn message(job: &Job, setup: &Setup<'_>, operation: &OperationFile, n: usize, barrier: &Barrier) -> String {
    let at = job.setup_key(setup.index);
    let why = match barrier {
        Barrier::Axis(why @ Unreachable::AxisLimit { axis, kind, .. }, by) => {
            let by = match kind {
                AxisKind::Linear => format!("{by:.1} mm"),
                AxisKind::Rotary => format!("{:.1} deg", by.to_degrees()),
            };
            format!("at best, {why}; move or turn the part on the table so that {axis} has {by} less to travel")
        }
        Barrier::Axis(why, _) => format!("at best, {why}; turn the part on the table"),
        Barrier::Table(body) => format!("all of them lie inside {body}, a body of the machine's table; raise the part"),
    };
    let unit = unit_advice(job, setup).map_or_else(String::new, |advice| format!("; {advice}"));
    format!(
        "{at}.table_from_work: operation \"{}\" reaches none of {n} points of its region in any posture: {why} \
         (table_from_work){unit}",
        operation.name
    )
}
