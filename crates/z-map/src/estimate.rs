//! Estimates of gouges from node heights, as the paper's test.

use std::f64::consts::{FRAC_PI_2, TAU};

use facemill_cl_data::{ClPoint, RoundBox, RoundFrustum};
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3, Rotation3, Vector3};

use crate::map::ZMap;

/// The tested point that is lowest over the Z-map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointClearance {
    /// z of the point less z of the surface there, in the map's frame, mm; negative: below the
    /// surface.
    pub clearance: f64,
    /// The point, workpiece frame.
    pub at: Point3<f64>,
}

/// An edge of a turned body: a circle about the tool axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Radius, mm.
    pub radius: f64,
    /// Height over the tool tip along the axis, mm.
    pub height: f64,
}

impl Ring {
    /// The two edges of the frustum around a dilated one, whose z axis is the tool axis with the
    /// tip at 0.
    pub fn of_frustum(frustum: &RoundFrustum) -> [Self; 2] {
        let by = frustum.rounding;
        [
            Self { radius: frustum.radius_low + by, height: frustum.z_low - by },
            Self { radius: frustum.radius_high + by, height: frustum.z_high + by },
        ]
    }
}

/// CLOPT's gouge test: the lowest of points on the cutter's bottom over the Z-map, the bottom disc
/// and the round corner.
///
/// An estimate: the surface between the map's nodes is interpolated, and between the points nothing
/// is tested. The points are one cell apart, but not closer than R/24; at the CC point itself the
/// clearance is about 0, with the error of the interpolation. `cl` is in the workpiece frame.
/// `None` when no point has the surface below or above it.
pub fn gouge_estimate(zmap: &ZMap, cutter: &Cutter, cl: &ClPoint) -> Option<PointClearance> {
    let (rim, corner) = (cutter.rim_radius(), cutter.corner_radius());
    let spacing = zmap.cell().max(cutter.radius() / 24.0);
    let n_rings = (rim / spacing).ceil() as u32;
    let bottom = (0..=n_rings).map(|k| Ring { radius: rim * f64::from(k) / f64::from(n_rings.max(1)), height: 0.0 });
    let n_arcs = (corner * FRAC_PI_2 / spacing).ceil() as u32;
    let corner_rings = (1..=n_arcs).map(|k| {
        let (sin, cos) = (FRAC_PI_2 * f64::from(k) / f64::from(n_arcs)).sin_cos();
        Ring { radius: rim + corner * sin, height: corner * (1.0 - cos) }
    });
    lowest(zmap, bottom.chain(corner_rings).flat_map(|ring| points_of_ring(ring, cl, spacing)))
}

/// The paper's test of turned bodies (VMT's edges of shank, holder and spindle): the lowest of
/// points on rings about the tool axis.
///
/// An estimate, and a weaker one than [`gouge_estimate`]: nothing is tested between the rings. The
/// points are one cell apart, but not closer than 1/24 of the ring's radius. `cl` is in the
/// workpiece frame. `None` when no point has the surface below or above it.
pub fn ring_estimate(zmap: &ZMap, rings: &[Ring], cl: &ClPoint) -> Option<PointClearance> {
    let points = |&ring: &Ring| points_of_ring(ring, cl, zmap.cell().max(ring.radius / 24.0));
    lowest(zmap, rings.iter().flat_map(points))
}

/// CLOPT's collision test: the lowest of the corners of a majorizing box, its dilation included.
///
/// An estimate: nothing but the eight corners is tested. `None` when no corner has the surface
/// below or above it.
pub fn corners_estimate(
    zmap: &ZMap,
    majorizing_box: &RoundBox,
    work_from_box: &Isometry3<f64>,
) -> Option<PointClearance> {
    let half = majorizing_box.half_extents.add_scalar(majorizing_box.rounding);
    let sides = [-1.0, 1.0];
    let signs = sides.iter().flat_map(|&x| sides.iter().flat_map(move |&y| sides.map(|z| Vector3::new(x, y, z))));
    lowest(zmap, signs.map(|s| work_from_box * Point3::from(half.component_mul(&s))))
}

fn lowest(zmap: &ZMap, points: impl Iterator<Item = Point3<f64>>) -> Option<PointClearance> {
    points
        .filter_map(|at| {
            let p = zmap.map_from_work() * at;
            zmap.height_at(p.x, p.y).map(|z| PointClearance { clearance: p.z - z, at })
        })
        .reduce(|lowest, next| if next.clearance < lowest.clearance { next } else { lowest })
}

/// Points on a ring, workpiece frame, not farther apart than `spacing`; the axis point alone for
/// radius 0.
fn points_of_ring(ring: Ring, cl: &ClPoint, spacing: f64) -> impl Iterator<Item = Point3<f64>> + use<> {
    let n = (TAU * ring.radius / spacing).ceil().max(1.0) as u32;
    let ClPoint { tip, axis } = *cl;
    let center = tip + axis.into_inner() * ring.height;
    let out = across(&axis) * ring.radius;
    (0..n).map(move |k| {
        let turn = Rotation3::from_axis_angle(&axis, TAU * f64::from(k) / f64::from(n));
        center + turn * out
    })
}

/// A unit vector across the axis: across the coordinate direction that is farthest from it.
fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let k = axis.abs().imin();
    let mut farthest = Vector3::zeros();
    farthest[k] = 1.0;
    axis.cross(&farthest).normalize()
}
