//! Passes that the text of a program cuts: where its cutter touches a surface.

use facemill_cl_data::{CcPoint, ClPoint};
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_inverse_kinematics::AxisKind;
use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::{AxisAt, Compensation, MotionKind, ReadMotion};
use facemill_surface_model::Surface;
use facemill_tool_model::Cutter;
use facemill_virtual_machine::VirtualSetup;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

/// Surface that a cutter may touch.
pub(crate) struct TouchedSurface<'a> {
    pub(crate) surface: &'a Surface,
    /// Allowance on each triangle, mm.
    pub(crate) allowances: &'a [f64],
    /// Largest distance of a cutter on a pass from the surface with its allowance, mm.
    pub(crate) tolerance: f64,
}

impl TouchedSurface<'_> {
    /// Returns the point where a pose touches the surface, if it does: the cutter's lowest point
    /// relative to the normal of the nearest part, found by alternating projection.
    fn contact(&self, cutter: &Cutter, pose: ClPoint) -> Option<Contact> {
        let reach = 2.0 * cutter.radius();
        let axis = pose.axis.into_inner();
        let mut lowest = pose.tip;
        for _ in 0..CONTACT_STEPS {
            let foot = self.surface.closest_point(&lowest, reach)?;
            let normal = self.surface.normal_at(&foot);
            let up = normal.dot(&axis);
            let outward = (normal.into_inner() - axis * up).try_normalize(FLAT).filter(|_| up > 0.0)?;
            let (r, rim) = (cutter.corner_radius(), cutter.rim_radius());
            let next = pose.tip + (axis - normal.into_inner()) * r - outward * rim;
            if (next - lowest).norm() < SAME_CONTACT {
                let surface = foot.position + normal.into_inner() * self.allowances[foot.triangle as usize];
                let is_on_it = (next - surface).norm() <= self.tolerance;
                return is_on_it.then_some(Contact { pose, position: foot.position, normal });
            }
            lowest = next;
        }
        None
    }
}

/// Pose on the surface.
struct Contact {
    pose: ClPoint,
    position: Point3<f64>,
    normal: Unit<Vector3<f64>>,
}

/// Number of projections between cutter and surface; on surfaces that the cutter fits, each brings
/// the point much nearer.
const CONTACT_STEPS: usize = 20;

/// Length of a final step, mm.
const SAME_CONTACT: f64 = 1e-4;

/// Sine of the tilt below which a disc lies flat and touches everywhere.
const FLAT: f64 = 1e-6;

/// Returns the passes of a program: consecutive positions in cutting blocks with the cutter on the
/// surface.
pub(crate) fn passes_of_text(
    program: &ReadProgram,
    at: &VirtualSetup<'_>,
    surface: &TouchedSurface<'_>,
) -> Vec<Vec<CutPoint>> {
    let moves: Vec<&ReadMotion> = program.blocks.iter().filter_map(|b| b.motion.as_ref()).collect();
    let cutter = at.tool.cutter();
    let touch = |motion: &&ReadMotion| surface.contact(cutter, pose_at(motion, at)?);
    let touching: Vec<_> = moves.par_iter().map(touch).collect();
    let mut runs = Vec::new();
    let mut run: Vec<Contact> = Vec::new();
    for (motion, found) in moves.iter().zip(touching) {
        if motion.kind != MotionKind::Linear || found.is_none() {
            runs.extend(pass(&std::mem::take(&mut run)));
        }
        run.extend(found);
    }
    runs.extend(pass(&run));
    runs
}

/// Returns the points of a pass with feed and posture; `None` for one point alone.
fn pass(run: &[Contact]) -> Option<Vec<CutPoint>> {
    let point = |k: usize| {
        let Contact { pose, position, normal } = &run[k];
        let feed = run[(k + 1).min(run.len() - 1)].position - run[k.saturating_sub(1)].position;
        let cc = CcPoint::new(*position, normal.into_inner(), feed).ok()?;
        Some(CutPoint { cc, posture: cc.posture_of(&pose.axis) })
    };
    let points: Vec<CutPoint> = (0..run.len()).filter_map(point).collect();
    (points.len() > 1).then_some(points)
}

/// Returns the pose of the tool on the work at the end of a motion; `None` if words alone do not
/// determine it.
fn pose_at(motion: &ReadMotion, at: &VirtualSetup<'_>) -> Option<ClPoint> {
    let (machine, length) = (at.machine, at.tool.gauge_length());
    let mut axes = machine.home();
    let vector = motion.tool.as_ref().and_then(|tool| tool.axis);
    let on_table = if matches!(motion.compensation, Compensation::Rtcp(_)) {
        let mut tip = Point3::origin();
        for (k, axis) in at.words.axes().iter().enumerate() {
            // The axes' positions for a vector do not matter: the tool is along it.
            if vector.is_some() && machine.axes()[k].kind == AxisKind::Rotary {
                continue;
            }
            let AxisAt::Word(word) = motion.position.get(axis.letter)? else { return None };
            match machine.axes()[k].kind {
                AxisKind::Rotary => axes[k] = axis.offset + word.to_radians(),
                AxisKind::Linear => tip["XYZ".find(axis.letter.letter())?] = word,
            }
        }
        let frame = at.table_from_rtcp_words?;
        let axis = match vector {
            Some(vector) => frame * Unit::try_new(Vector3::from(vector), f64::MIN_POSITIVE)?,
            None => machine.cl_point(&axes, length).axis,
        };
        ClPoint { tip: frame * tip, axis }
    } else {
        let joints = at.words.joints_at(motion, axes.as_slice()).ok()?;
        joints.iter().enumerate().for_each(|(k, joint)| axes[k] = *joint);
        machine.cl_point(&axes, length)
    };
    Some(on_table.transformed(&at.table_from_work.inverse()))
}
