//! How far a point is outside a cutter, and where a line enters it.

use facemill_cl_data::{Aabb, ClPoint};
use facemill_tool_model::Cutter;
use nalgebra::{Point3, Vector3};

use crate::left::place::SurfacePlace;

/// A cutter as a convex solid of revolution.
pub(super) struct Gauge {
    radius: f64,
    corner: f64,
    rim: f64,
    height: f64,
}

/// Newton steps to the entry of a line, after which it counts as missing the cutter: near a tangent
/// they halve the rest only.
const MAX_STEPS: usize = 60;

/// Depth to which the entry of a line into the cutter is found, mm.
pub(super) const ENTRY: f64 = 1e-6;

/// Halvings of the way to where a line is nearest: from a meter to a millionth of a millimetre.
const HALVINGS: usize = 32;

/// Where the way along a line has ended: at its entry, or where it comes no nearer.
pub(super) struct Approach {
    /// Way along the line where it enters; `None` where it does not.
    pub entry: Option<f64>,
    /// Nearest point of the cutter to the end of the way, and the direction from there out of the
    /// cutter.
    pub nearest: Point3<f64>,
    pub outward: Vector3<f64>,
    /// Cosine between line and `outward`.
    pub slope: f64,
}

/// Length of a vector of the plane. `hypot` takes five times as long, to be right also where a
/// square overflows or vanishes, which no distance on a machine does.
fn norm(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

impl Gauge {
    pub(super) fn of(cutter: &Cutter) -> Self {
        Self {
            radius: cutter.radius(),
            corner: cutter.corner_radius(),
            rim: cutter.rim_radius(),
            height: cutter.flute_length(),
        }
    }

    /// Distance of the farthest point from the tip, mm.
    pub(super) fn reach(&self) -> f64 {
        self.radius.hypot(self.height)
    }

    /// Distance of a point from the cutter at a pose, 0 inside, and the unit direction in which it
    /// grows. The distance from a convex solid is convex. The direction inside is that of the
    /// nearest part of the outline.
    pub(super) fn beyond(&self, pose: &ClPoint, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let from_tip = point - pose.tip;
        let axis = pose.axis.into_inner();
        let z = from_tip.dot(&axis);
        let across = from_tip - axis * z;
        let radial = across.norm();
        let out = if radial > 0.0 { across / radial } else { Vector3::zeros() };
        if z > self.height {
            let (side, up) = ((radial - self.radius).max(0.0), z - self.height);
            let distance = norm(side, up);
            return (distance, (out * side + axis * up) / distance);
        }
        if z >= self.corner {
            return ((radial - self.radius).max(0.0), out);
        }
        let (side, down) = ((radial - self.rim).max(0.0), self.corner - z);
        let from_core = norm(side, down);
        // Under the flat of a sharp cutter by less than a square can say.
        if from_core == 0.0 {
            return (0.0, -axis);
        }
        ((from_core - self.corner).max(0.0), (out * side - axis * down) / from_core)
    }

    /// Follows the line from a place along its normal to its entry into the cutter at a pose:
    /// Newton's steps on a convex function, which never go beyond it. Of a line that misses the
    /// cutter, to where it is nearest.
    pub(super) fn approach(&self, pose: &ClPoint, place: &SurfacePlace) -> Approach {
        let mut way = 0.0;
        let mut before: Option<(f64, Vector3<f64>)> = None;
        for _ in 0..MAX_STEPS {
            let at = place.position + place.normal.into_inner() * way;
            let (distance, direction) = self.beyond(pose, &at);
            // A step that lands on the outline of a sharp cutter is on its inside, where the
            // direction is that of another side.
            let outward = before.filter(|_| distance == 0.0).map_or(direction, |(_, outward)| outward);
            let slope = outward.dot(&place.normal);
            if distance <= ENTRY {
                return Approach { entry: Some(way), nearest: at - outward * distance, outward, slope };
            }
            if slope >= 0.0 {
                let low = before.map_or(way, |(low, _)| low);
                return self.nearest_of_line(pose, place, [low, way]);
            }
            before = Some((way, outward));
            way -= distance / slope;
        }
        self.nearest_of_line(pose, place, [before.map_or(way, |(low, _)| low), way])
    }

    /// Returns the place at which a line that misses the cutter is nearest to it, between two ways
    /// along it: only there does the sign of the distance's rate of change give the side in time on
    /// which the line may meet the cutter.
    fn nearest_of_line(&self, pose: &ClPoint, place: &SurfacePlace, [mut low, mut high]: [f64; 2]) -> Approach {
        let at = |way: f64| {
            let at = place.position + place.normal.into_inner() * way;
            let (distance, outward) = self.beyond(pose, &at);
            let slope = outward.dot(&place.normal);
            Approach { entry: None, nearest: at - outward * distance, outward, slope }
        };
        for _ in 0..HALVINGS {
            if high - low <= ENTRY {
                break;
            }
            let middle = 0.5 * (low + high);
            if at(middle).slope < 0.0 { low = middle } else { high = middle }
        }
        at(high)
    }

    /// Smallest box around the cutter at a pose.
    pub(super) fn aabb(&self, pose: &ClPoint) -> Aabb {
        let axis = pose.axis;
        let ends = [pose.tip, pose.tip + axis.into_inner() * self.height];
        let wide = Vector3::from_fn(|k, _| self.radius * (1.0 - axis[k] * axis[k]).max(0.0).sqrt());
        let Aabb { min, max } = Aabb::of_points(&ends);
        Aabb { min: min - wide, max: max + wide }
    }
}
