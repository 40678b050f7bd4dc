//! Contact of a cutter at a pose with a surface.

use facemill_cl_data::ClPoint;
use facemill_surface_model::{Surface, SurfacePoint};
use facemill_tool_model::Cutter;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

use crate::cutter_distance::{cutter_distance, faces, nearest_to_cutter};

/// Which of the two places of a contact is the CC point: they are the stand-off apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactKind {
    /// That of the cutter, less the allowance: the posture of the file's axis there gives the
    /// file's pose.
    OfTool,
    /// That of the surface.
    OfSurface,
}

/// Contact of a cutter with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Place of the contact.
    pub position: Point3<f64>,
    /// Normal out of the material.
    pub normal: Unit<Vector3<f64>>,
    /// Distance of the cutter from the surface with its allowance, mm; negative where it cuts too
    /// deep.
    pub stand_off: f64,
    /// Whether the bottom lies flat on the surface, so that it touches everywhere.
    pub is_flat: bool,
}

/// Angle of axis and normal below which the bottom lies flat on the surface, rad. Larger: the place
/// of contact is off by more than a hundredth of a millimetre at a radius of 30 mm. Smaller:
/// rounding of a file's axis turns the place of contact about the rim.
const FLAT: f64 = 3.5e-4;

/// Refinements of the normal by smooth normals of the surface; each squares its error.
const ROUNDS: usize = 8;

/// Largest step of the normal in a refinement, rad: curvature holds near its place alone.
const LARGEST_TURN: f64 = 0.2;

/// Largest difference of both normals after refinement, rad: above, the nearest place counts.
const SAME_NORMAL: f64 = 0.01;

/// Returns the contact of a cutter at a pose, moving along `feed`, with the facets of a surface
/// that face it; `None` if none is within `limit` mm of touching.
///
/// `feed` decides where the bottom lies flat on the surface: the contact is the leading place of
/// its rim.
pub fn contact(
    surface: &Surface,
    cutter: &Cutter,
    (cl, feed): (&ClPoint, &Vector3<f64>),
    (allowance, limit): (f64, f64),
    kind: ContactKind,
) -> Option<Contact> {
    let facing = |t: u32| faces(surface, t, &cl.axis);
    let nearest = nearest_to_cutter(surface, cutter, cl, limit + allowance, facing)?;
    let (least, reach) = (nearest.distance, 2.0 * cutter.radius() + nearest.distance.abs());
    let touch = Touch { surface, cutter, cl, feed, least, reach };
    let first = surface.normal_at(&nearest.at);
    let stand_off = nearest.distance - allowance;
    let (normal, on_surface) = touch.refined(first, &nearest.at);
    let is_flat = touch.across(&normal).is_none();
    let position = match kind {
        ContactKind::OfTool => touch.on_tool(&normal) - normal.into_inner() * allowance,
        ContactKind::OfSurface => on_surface.position,
    };
    let normal = if kind == ContactKind::OfSurface { surface.normal_at(&on_surface) } else { normal };
    Some(Contact { position, normal, stand_off, is_flat })
}

/// Places from the axis to the leading rim that are tried for a contact of the bottom.
const AHEAD: u32 = 4;

struct Touch<'t> {
    surface: &'t Surface,
    cutter: &'t Cutter,
    cl: &'t ClPoint,
    feed: &'t Vector3<f64>,
    /// Distance of the place of the surface that is nearest to the cutter, mm.
    least: f64,
    /// Farthest that the surface is sought from a place of the tool, mm.
    reach: f64,
}

impl Touch<'_> {
    /// Returns the place of the cutter that touches a surface of this normal.
    fn on_tool(&self, normal: &Unit<Vector3<f64>>) -> Point3<f64> {
        let (axis, corner) = (self.cl.axis.into_inner(), self.cutter.corner_radius());
        let out = match self.across(normal) {
            Some(across) => across.into_inner(),
            None => -self.leading(),
        };
        self.cl.tip - (normal.into_inner() - axis) * corner - out * self.cutter.rim_radius()
    }

    /// Returns the direction of a normal across the axis; `None` where the bottom lies flat.
    fn across(&self, normal: &Unit<Vector3<f64>>) -> Option<Unit<Vector3<f64>>> {
        let axis = self.cl.axis.into_inner();
        let (across, length) = Unit::try_new_and_get(normal.into_inner() - axis * normal.dot(&axis), FLAT)?;
        (length >= FLAT).then_some(across)
    }

    /// Returns the direction of feed across the axis; zero for a feed along it.
    fn leading(&self) -> Vector3<f64> {
        let axis = self.cl.axis.into_inner();
        let across = self.feed - axis * self.feed.dot(&axis);
        across.try_normalize(1e-9 * self.feed.norm()).unwrap_or_else(Vector3::zeros)
    }

    fn nearest(&self, p: &Point3<f64>) -> Option<SurfacePoint> {
        self.surface.closest_point_where(p, self.reach, |t| faces(self.surface, t, &self.cl.axis))
    }

    /// Returns a place of the surface that touches a bottom lying flat on it: below the leading
    /// rim, or else as far ahead as the surface touches.
    fn below_bottom(&self) -> Option<SurfacePoint> {
        let ahead = self.leading() * self.cutter.rim_radius();
        let most = self.least + 2.0 * FLAT * self.cutter.radius();
        (0..=AHEAD).rev().find_map(|k| {
            let at = self.nearest(&(self.cl.tip + ahead * (f64::from(k) / f64::from(AHEAD))))?;
            (cutter_distance(self.cutter, self.cl, &at.position) <= most).then_some(at)
        })
    }

    /// Returns the normal at which cutter and smooth surface touch, and the place of the surface;
    /// the first ones where refinement leads elsewhere.
    fn refined(&self, first: Unit<Vector3<f64>>, nearest: &SurfacePoint) -> (Unit<Vector3<f64>>, SurfacePoint) {
        let mut normal = first;
        let mut best: Option<(f64, Unit<Vector3<f64>>, SurfacePoint)> = None;
        for _ in 0..ROUNDS {
            let Some(out) = self.across(&normal) else {
                return (self.cl.axis, self.below_bottom().unwrap_or(*nearest));
            };
            let Some(at) = self.nearest(&self.on_tool(&normal)) else { break };
            let off = self.surface.normal_at(&at).into_inner() - normal.into_inner();
            if best.is_none_or(|b| off.norm() < b.0) {
                best = Some((off.norm(), normal, at));
            }
            if off.norm() < 1e-12 {
                break;
            }
            let Some(turned) = self.turned(&normal, &out, &at, &off) else { break };
            normal = turned;
        }
        let is_same = |at: &SurfacePoint| at.distance <= self.least.abs() + SAME_NORMAL * self.cutter.radius();
        match best {
            Some((off, normal, at)) if off <= SAME_NORMAL && is_same(&at) => (normal, at),
            _ => (first, *nearest),
        }
    }

    /// Returns the normal after a step of Newton's method: a turn of it moves the place on the
    /// cutter by the cutter's radii of curvature, and the surface turns by its curvature there.
    fn turned(
        &self,
        normal: &Unit<Vector3<f64>>,
        out: &Unit<Vector3<f64>>,
        at: &SurfacePoint,
        off: &Vector3<f64>,
    ) -> Option<Unit<Vector3<f64>>> {
        let bend = self.surface.curvature_at(at).map_or_else(Matrix3::zeros, |c| c.tensor);
        let sin = normal.cross(&self.cl.axis).norm();
        let beside = self.cl.axis.cross(out);
        let radii = Matrix3::identity() * self.cutter.corner_radius()
            + beside * beside.transpose() * (self.cutter.rim_radius() / sin.max(FLAT));
        let step = (Matrix3::identity() + bend * radii).lu().solve(off)?;
        let length = step.norm();
        let step = if length > LARGEST_TURN { step * (LARGEST_TURN / length) } else { step };
        Unit::try_new(normal.into_inner() + step, 0.5)
    }
}
