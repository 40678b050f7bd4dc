//! Angle between tool and surface where the cutter touches it.

use facemill_cl_data::ClPoint;
use facemill_surface_model::Surface;
use facemill_tool_model::ToolAssembly;
use nalgebra::{Unit, Vector3};

/// Distance of the cutter from the surface up to which it touches it, mm: passes keep within their
/// tolerances, entries and exits are farther off.
pub(crate) const TOUCHES_WITHIN: f64 = 0.15;

/// Most steps in which the point of contact is sought.
const STEPS: usize = 10;

/// Turn about the tool axis below which the point is found, rad: a thousandth of a cutter's radius.
const SAME_PLACE: f64 = 1e-3;

/// Largest turn about the tool axis in a step, rad.
const MAX_STEP: f64 = 0.5;

/// Returns the angle between tool axis and the surface's normal at the point that the cutter
/// touches, deg; `None` if it touches nothing. The surface is raised by `allowance`, mm.
///
/// The point is where the circle in the middle of the edge's torus is nearest to the surface, as
/// far as steps about the axis find it: one of several on a surface that bends back.
pub(crate) fn tilt_to_surface(pose: &ClPoint, tool: &ToolAssembly, surface: &Surface, allowance: f64) -> Option<f64> {
    let cutter = tool.cutter();
    let (across, r) = (cutter.radius() - cutter.corner_radius(), cutter.corner_radius());
    let axis = pose.axis.into_inner();
    let within = 2.0 * cutter.radius();
    let (normal, distance) = normal_near(surface, &(pose.tip + axis * r), within)?;
    let touches = |distance: f64| (distance - r - allowance).abs() <= TOUCHES_WITHIN;
    let tilt = |normal: &Unit<Vector3<f64>>| normal.angle(&axis).to_degrees();
    let beside = normal.into_inner() - axis * normal.dot(&axis);
    // A flat bottom on a plane touches it everywhere.
    let Some(first) = beside.try_normalize(1e-9) else { return touches(distance).then(|| tilt(&normal)) };
    let second = axis.cross(&first);
    let at = |turn: f64| {
        let (outward, along) = (first * turn.cos() + second * turn.sin(), second * turn.cos() - first * turn.sin());
        let (normal, distance) = normal_near(surface, &(pose.tip + axis * r - outward * across), within)?;
        // Where the normal leans along the circle, the surface is nearer on one side.
        Some((normal, distance, normal.dot(&along)))
    };
    let (mut turn, mut step, mut before) = (0.0, f64::NAN, None);
    for _ in 0..STEPS {
        let (normal, distance, lean) = at(turn)?;
        let by_secant = before.map(|before: f64| -lean * step / (lean - before)).filter(|s: &f64| s.is_finite());
        // The first step follows the normal.
        let follow = || lean.atan2(normal.into_inner().cross(&axis).norm().max(1e-6));
        step = by_secant.unwrap_or_else(follow).clamp(-MAX_STEP, MAX_STEP);
        if step.abs() < SAME_PLACE {
            return touches(distance).then(|| tilt(&normal));
        }
        before = Some(lean);
        turn += step;
    }
    None
}

/// Returns the normal at the point of a surface nearest to a point, and its distance, mm.
fn normal_near(surface: &Surface, p: &nalgebra::Point3<f64>, within: f64) -> Option<(Unit<Vector3<f64>>, f64)> {
    let foot = surface.closest_point(p, within)?;
    Some((surface.normal_at(&foot), foot.distance))
}

#[cfg(test)]
#[path = "../tests/unit/contact.rs"]
mod tests;
