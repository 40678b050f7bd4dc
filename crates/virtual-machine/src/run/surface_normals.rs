//! Blocks that name the normal of the surface: whether the tool can touch the part there, and
//! whether it is the part's.

use facemill_cl_data::{ClPoint, RoundFrustum, Solid};
use facemill_nc_program::read::Compensation;
use facemill_nc_program::{Dialect, ReadProgram};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::finding::episodes::{Contact, Episodes, Key};
use crate::finding::{FindingKind, Measure};
use crate::motion::moves::Move;
use crate::motion::setup::ObstacleKind;
use crate::run::scene::{Role, RunScene, SceneObstacle};

/// Permitted angle between a normal and the part's, rad: the turn of facets and curved surfaces
/// within a lift and a probe. Larger: wrong normals pass; smaller: right ones on coarse meshes are
/// reported.
const LIMIT: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// Cosine between normal and tool axis from which on a normal points away from the tool: the
/// rounding of vectors, and a little more for walls that are cut with the side of the cutter.
const AWAY: f64 = -0.02;

/// Sine between normal and tool axis up to which one stands for the other: blocks that cut no
/// surface say the axis.
const ALONG_AXIS: f64 = 1e-3;

/// How far the cutter is lifted along its axis before its nearest place is looked for, and how far
/// from a contact point the distance has to grow, mm. Larger: other surfaces are nearer; smaller:
/// facets and the depth of cuts turn directions.
const LIFT: f64 = 1.0;

/// How far above allowance and stock a cutter still cuts the part, mm.
const REACH: f64 = 0.5;

/// Holds the normals of a program against the parts of a scene.
pub(crate) struct SurfaceNormals<'a> {
    pub(crate) scene: &'a RunScene<'a>,
    pub(crate) program: &'a ReadProgram,
}

/// Where the lifted cutter is nearest to a mesh.
struct Nearest {
    /// From the cutter's core, mm.
    distance: f64,
    /// From the mesh to the core.
    direction: Vector3<f64>,
    /// On the mesh, workpiece frame.
    place: Point3<f64>,
}

impl SurfaceNormals<'_> {
    /// Tests the normal of a block at the end of its move. Where there is none, nothing is done.
    ///
    /// A normal that points away from the tool is a fault everywhere. One toward it is a fault
    /// where the cutter is near a part and no part has such a normal where the cutter touches it.
    pub(crate) fn test(&self, index: usize, m: &Move, episodes: &mut Episodes) {
        let Some(normal) = self.normal(m) else { return };
        let scene = self.scene;
        let work_from_tool = scene.work_from_table * scene.setup.machine.forward(&m.end, scene.tool_length);
        let axis = Unit::new_unchecked(work_from_tool.rotation * Vector3::z());
        let (key, off, place) = if normal.dot(&axis) <= AWAY {
            (Key::of_axis(FindingKind::OtherNormal, None), angle(&normal, &axis), None)
        } else {
            let Some((obstacle, off, place)) = self.off_the_parts(m, &normal, &work_from_tool) else { return };
            (Key::of_cutter(FindingKind::OtherNormal, obstacle), off, Some(place))
        };
        let cl = ClPoint { tip: work_from_tool.translation.vector.into(), axis };
        let measure = Some(Measure::AngleDeg(off.to_degrees()));
        episodes.record(index, Contact { key, measure, place, axes: m.end, cl, at: 1.0 });
    }

    /// The normal at the end of a cutting move under RTCP, workpiece frame; `None` where there is
    /// none, or one without a direction. Of other controls than Heidenhain's a normal changes the
    /// way of the tool, or nothing.
    fn normal(&self, m: &Move) -> Option<Unit<Vector3<f64>>> {
        let motion = self.program.blocks[m.block].motion.as_ref()?;
        let is_cut = !m.is_rapid && m.moves_tool && matches!(motion.compensation, Compensation::Rtcp(_));
        let normal = motion.tool.as_ref()?.normal.filter(|_| is_cut && self.program.dialect == Dialect::Heidenhain)?;
        let in_work = self.scene.work_from_table * (self.scene.setup.table_from_rtcp_words? * Vector3::from(normal));
        Unit::try_new(in_work, f64::MIN_POSITIVE).filter(|n| n.iter().all(|c| c.is_finite()))
    }

    /// The part that the cutter is near to, by how much the normal is turned from its own (rad),
    /// and where; `None` where the cutter is near to none, or the normal is that of one. Of several
    /// it is the one with the least turn.
    fn off_the_parts(
        &self,
        m: &Move,
        normal: &Unit<Vector3<f64>>,
        work_from_tool: &Isometry3<f64>,
    ) -> Option<(usize, f64, Point3<f64>)> {
        let across = self.across(normal, work_from_tool)?;
        let mut least: Option<(usize, f64, Point3<f64>)> = None;
        for (k, part) in self.scene.obstacles.iter().enumerate() {
            if part.role != Role::Work(ObstacleKind::Part) {
                continue;
            }
            let Some(nearest) = self.nearest(part, work_from_tool) else { continue };
            let off = angle(&nearest.direction, normal);
            let explained = LIMIT + self.beside(&nearest, part, work_from_tool);
            if off <= explained || self.touches(m, part, normal, &across, work_from_tool) {
                return None;
            }
            if least.is_none_or(|(_, before, _)| off < before) {
                least = Some((k, off, nearest.place));
            }
        }
        least
    }

    /// Unit direction of a normal across the tool axis; `None` where it is along the axis.
    fn across(&self, normal: &Unit<Vector3<f64>>, work_from_tool: &Isometry3<f64>) -> Option<Unit<Vector3<f64>>> {
        let axis = work_from_tool.rotation * Vector3::z();
        Unit::try_new(normal.into_inner() - axis * axis.dot(normal), ALONG_AXIS)
    }

    /// The nearest place of a part to the cutter, lifted along its axis so that it has a direction
    /// where they touch. `None` where the cutter is not near, or is so deep that it has none: that
    /// is a gouge.
    fn nearest(&self, part: &SceneObstacle<'_>, work_from_tool: &Isometry3<f64>) -> Option<Nearest> {
        let cutter = self.scene.setup.tool.cutter();
        let core = cutter.core();
        let lifted = work_from_tool * Isometry3::translation(0.0, 0.0, LIFT);
        let near = cutter.corner_radius() + part.allowance + part.stock + LIFT + REACH;
        let found = part.mesh().core_distance(&Solid::Frustum(core), &lifted, near, None)?;
        let of_core = lifted * nearest_of(&core, &lifted.inverse_transform_point(&found.point));
        (found.distance > 0.0).then(|| Nearest {
            distance: found.distance,
            direction: of_core - found.point,
            place: found.point,
        })
    }

    /// By how much the direction from the nearest place may differ from the part's normal, rad. The
    /// core of a cutter that touches the part is at least so high above its tangent plane when it
    /// is lifted; where the cutter reaches beyond the part's border or is higher, the nearest place
    /// may be beside it.
    fn beside(&self, nearest: &Nearest, part: &SceneObstacle<'_>, work_from_tool: &Isometry3<f64>) -> f64 {
        let axis = work_from_tool.rotation * Vector3::z();
        let lifted = LIFT * (nearest.direction.dot(&axis) / nearest.distance).max(0.0);
        let height = self.scene.setup.tool.cutter().corner_radius() + part.allowance + lifted;
        (height / nearest.distance).min(1.0).acos()
    }

    /// Whether the point of the cutter that has this normal is near a part, and the part has it
    /// there: along it the distance grows like the way, but for the limit and for a point below the
    /// surface by no more than a gouge. Of a cutter that is near in two places, the other one may
    /// be the programmed one.
    ///
    /// The point is the tip less `r·N + (R − r)·d − r·a`, with d the direction of the normal N
    /// across the axis a: what [`facemill_tool_model::cl_from_cc`] adds.
    fn touches(
        &self,
        m: &Move,
        part: &SceneObstacle<'_>,
        normal: &Unit<Vector3<f64>>,
        across: &Unit<Vector3<f64>>,
        work_from_tool: &Isometry3<f64>,
    ) -> bool {
        let cutter = self.scene.setup.tool.cutter();
        let axis = work_from_tool.rotation * Vector3::z();
        let on_tip = (normal.into_inner() - axis) * cutter.corner_radius() + across.into_inner() * cutter.rim_radius();
        let cc = Point3::from(work_from_tool.translation.vector - on_tip);
        let near = part.allowance + part.stock + REACH;
        let Some(at) = distance(part, &cc, near) else { return false };
        // Farther away than that it has grown by all of the lift.
        let behind = distance(part, &(cc + normal.into_inner() * LIFT), at + LIFT).unwrap_or(at + LIFT);
        let below = at.min(self.scene.settings.gouge_limit_in(m.section));
        behind - at + 2.0 * below >= LIFT * LIMIT.cos()
    }
}

/// Returns the note of a finding of this key besides its angle; `None` for other kinds.
pub(crate) fn note(key: &Key) -> Option<&'static str> {
    match (key.kind, key.obstacle) {
        (FindingKind::OtherNormal, None) => Some("NX NY NZ point away from the tool's axis"),
        (FindingKind::OtherNormal, Some(_)) => Some("NX NY NZ are turned from the surface that the cutter is at"),
        _ => None,
    }
}

/// Distance of a point from a part, mm; `None` beyond `at_most`.
fn distance(part: &SceneObstacle<'_>, point: &Point3<f64>, at_most: f64) -> Option<f64> {
    const POINT: RoundFrustum =
        RoundFrustum { z_low: 0.0, z_high: 0.0, radius_low: 0.0, radius_high: 0.0, rounding: 0.0 };
    let place = Isometry3::translation(point.x, point.y, point.z);
    part.mesh().core_distance(&Solid::Frustum(POINT), &place, at_most, None).map(|found| found.distance)
}

/// The point of a cutter's core, a cylinder, that is nearest to a point, both in its frame.
fn nearest_of(core: &RoundFrustum, p: &Point3<f64>) -> Point3<f64> {
    let radial = p.x.hypot(p.y);
    let share = if radial > core.radius_low { core.radius_low / radial } else { 1.0 };
    Point3::new(p.x * share, p.y * share, p.z.clamp(core.z_low, core.z_high))
}

/// Angle between two vectors, rad.
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
