//! Angle between tool and surface where the cutter touches it.

use facemill_cl_data::ClPoint;
use facemill_surface_model::Surface;
use facemill_tool_model::ToolAssembly;
use nalgebra::{Unit, Vector3};

/// Distance of the cutter from the surface up to which it touches it, mm: passes keep within their
/// tolerances, entries and exits are farther off.
pub(crate) const TOUCHES_WITHIN: f64 = 0.15;

/// Most steps in which the point of contact is sought.
const STEPS: usize = 8;

/// Turn of the normal below which the point is found, rad.
const SAME_NORMAL: f64 = 1e-4;

/// Returns the angle between tool axis and the surface's normal at the point that the cutter
/// touches, deg; `None` if it touches nothing. The surface is raised by `allowance`, mm.
///
/// The point is where the torus of the cutter's edge, or its flat bottom, is nearest to the surface,
/// as far as following normals finds it.
pub(crate) fn tilt_to_surface(pose: &ClPoint, tool: &ToolAssembly, surface: &Surface, allowance: f64) -> Option<f64> {
    let cutter = tool.cutter();
    let (across, r) = (cutter.radius() - cutter.corner_radius(), cutter.corner_radius());
    let axis = pose.axis.into_inner();
    let within = 2.0 * cutter.radius();
    let mut normal = normal_near(surface, &pose.tip, within)?.0.into_inner();
    for _ in 0..STEPS {
        let beside = normal - axis * normal.dot(&axis);
        // A flat bottom on a plane touches it everywhere: its middle, too.
        let outward = beside.try_normalize(1e-9).map_or(Vector3::zeros(), |u| u * -across);
        let middle = pose.tip + axis * r + outward;
        let (found, distance) = normal_near(surface, &middle, within)?;
        let turn = found.angle(&normal);
        normal = found.into_inner();
        if turn < SAME_NORMAL {
            let touches = (distance - r - allowance).abs() <= TOUCHES_WITHIN;
            return touches.then(|| normal.angle(&axis).to_degrees());
        }
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
