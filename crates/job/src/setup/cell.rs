//! Workcell of an operation: the settings and bodies that its poses are judged by.

use facemill_cl_data::{ErrorBudget, Posture};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    AxisCone, AxisTarget, Obstacle, PassSettings, PostureMode, SearchCurve, SearchOrder, SearchSettings,
    SmoothSettings, Workcell,
};
use facemill_inverse_kinematics::BranchPreference;
use facemill_tool_model::SpindleRotation;
use facemill_z_map::{ZMap, ZMapSettings};
use nalgebra::{Isometry3, Point3};

use crate::failure::Failure;
use crate::format::job_file::{
    AxisTargetFile, BranchFile, DirectionFile, OperationFile, OrderFile, PathFile, PostureModeFile,
};
use crate::frames::direction;
use crate::load::job::{Job, Setup};
use crate::load::obstacle_meshes::ObstacleRole;
use crate::planning_stock::PlanningStock;

/// Least step-over as a fraction of the largest that the user allows: a surface that needs less
/// needs another tool.
pub const LEAST_STEP: f64 = 0.01;

/// Cells along the longer side of the Z-map: fine enough to follow a part, coarse enough to cost
/// nothing.
const Z_MAP_CELLS: f64 = 200.0;

/// Distance that planned bodies keep from a bound of what is left, besides their clearance, mm:
/// the text, which is tested against it between its blocks, too, is rounded.
const BOUND_MARGIN: f64 = 0.05;

/// Returns the Z-map of everything on the table, seen along +Z of the workpiece frame.
///
/// # Errors
/// If the map cannot be built.
pub fn z_map(setup: &Setup<'_>) -> Result<ZMap, Failure> {
    let all = setup.obstacles.iter().fold(facemill_surface_model::TriMesh::default(), |all, o| all.joined(&o.mesh));
    let size = setup.aabb().half_extents() * 2.0;
    let cell = size.x.max(size.y).max(1.0) / Z_MAP_CELLS;
    let settings = ZMapSettings { cell, margin: 0.0 };
    ZMap::build(&all, &Isometry3::identity(), &settings).map_err(|e| Failure::Internal(e.to_string()))
}

/// Returns the workcell of an operation.
pub fn workcell<'a>(job: &'a Job, setup: &'a Setup<'_>, operation: &OperationFile, z_map: &'a ZMap) -> Workcell<'a> {
    let is_own = matches!(setup.planning_stock, PlanningStock::Own { .. });
    // Between planned poses the text leaves their path by the tolerance of linearisation.
    let margin = operation.tolerances.linearisation_mm + if is_own { 0.0 } else { BOUND_MARGIN };
    let obstacles = setup
        .obstacles
        .iter()
        .map(|o| Obstacle {
            name: o.name.clone(),
            mesh: o.tree().into(),
            gouge_allowance: match o.role {
                ObstacleRole::Part | ObstacleRole::Check | ObstacleRole::Fixture | ObstacleRole::Table => {
                    Some(o.allowance)
                }
                ObstacleRole::Stock => None,
            },
            collision_allowance: match o.role {
                ObstacleRole::Part | ObstacleRole::Check => setup.stock_thickness.max(o.allowance),
                ObstacleRole::Stock => o.allowance + margin,
                ObstacleRole::Fixture | ObstacleRole::Table => o.allowance,
            },
            machine_body: o.machine_body,
            pieces: Some(o),
        })
        .collect();
    let tolerances = &operation.tolerances;
    Workcell {
        machine: &job.planned_machine,
        table_from_work: setup.table_from_work,
        tool: &job.tool,
        obstacles,
        preferred_branch: match operation.search.preferred_branch {
            BranchFile::NearestHome => BranchPreference::Nearest,
            BranchFile::Positive => BranchPreference::Positive,
            BranchFile::Negative => BranchPreference::Negative,
        },
        axis_cone: operation
            .search
            .tool_axis_cone
            .as_ref()
            .map(|c| AxisCone { axis: direction(&c.axis), half_angle: c.half_angle_deg.to_radians() }),
        gouge_tolerance: tolerances.gouge_mm,
        max_lift: tolerances.max_lift_mm,
        // A tenth of the smallest excess that anyone measures on such parts; seating costs one test
        // per halving.
        lift_resolution: (tolerances.max_lift_mm / 32.0).max(1e-3),
        z_map: Some((z_map, Isometry3::identity())),
    }
}

/// Returns the error budget of an operation.
pub fn budget(job: &Job, operation: &OperationFile) -> ErrorBudget {
    let t = &operation.tolerances;
    ErrorBudget {
        mesh_chord: t.mesh_chord_mm,
        path_chord: t.path_chord_mm,
        linearisation: t.linearisation_mm,
        control: job.machine.motion_law().control_tolerance.charge(job.tool.cutter().radius()),
        gouge_tolerance: t.gouge_mm,
    }
}

/// Returns the largest permitted height of a finished surface above the operation's, mm: the cusp
/// between passes, and the deviation of the written program from the planned one. Plans,
/// verifications and maps of deviations use this one.
pub fn largest_left(job: &Job, operation: &OperationFile) -> f64 {
    operation.tolerances.cusp_mm + budget(job, operation).simulated()
}

/// Returns the radius of the corner that rolls along roots on the drive surface, mm: a ball larger
/// by the allowance rolls on the surfaces without it as the corner on those with it.
pub fn corner_on_drive(job: &Job, setup: &Setup<'_>) -> f64 {
    job.tool.cutter().corner_radius() + setup.drive_allowance.max(0.0)
}

/// Returns the search curve for passes with the uncut stock on this side of the feed: rotate turns
/// toward it.
///
/// # Errors
/// If the ranges make no curve.
pub fn search_curve(job: &Job, operation: &OperationFile, uncut_left: bool) -> Result<SearchCurve, Failure> {
    let s = &operation.search;
    // Right-handed about the outward normal: turning left is positive.
    let sign = if uncut_left { 1.0 } else { -1.0 };
    let posture = |k: usize| facemill_cl_data::Posture {
        tilt: s.tilt_deg[k].to_radians(),
        rotate: sign * s.rotate_deg[k].to_radians(),
    };
    let order = match s.order {
        OrderFile::TiltFirst => SearchOrder::TiltFirst,
        OrderFile::RotateFirst => SearchOrder::RotateFirst,
    };
    SearchCurve::new(posture(0), posture(1), order, s.weight).map_err(|e| job.wrong(format!("search: {e}")))
}

/// Returns how the postures of the operation's passes are chosen.
pub fn pass_settings(operation: &OperationFile) -> PassSettings {
    let tolerances = &operation.tolerances;
    let mode = match &operation.search.mode {
        _ if operation.keeps_axes() => PostureMode::Given,
        PostureModeFile::Smallest => PostureMode::Smallest,
        PostureModeFile::Smooth => PostureMode::Smooth(SmoothSettings {
            feed: operation.feeds.cutting_mm_min / 60.0,
            cusp: tolerances.cusp_mm,
            strip: Strip::on_plane(tolerances.max_step_over_mm),
            widest: match operation.path {
                PathFile::Strategy(_) => tolerances.max_step_over_mm,
                PathFile::File(_) | PathFile::Cl(_) => f64::INFINITY,
            },
        }),
        PostureModeFile::Fixed(f) => {
            PostureMode::Fixed(Posture::from_lead_lean(f.lead_deg.to_radians(), f.lean_deg.to_radians()))
        }
        PostureModeFile::Toward(AxisTargetFile::Point(p)) => {
            PostureMode::Toward(AxisTarget::Point(Point3::from(p.position_mm)))
        }
        PostureModeFile::Toward(AxisTargetFile::Line(l)) => PostureMode::Toward(AxisTarget::Line {
            origin: Point3::from(l.origin_mm),
            direction: direction(&l.direction),
        }),
    };
    PassSettings {
        search: search_settings(operation),
        mode,
        max_turn_per_mm: operation.search.max_turn_deg_per_mm.to_radians(),
    }
}

/// Returns how the curve is searched.
pub fn search_settings(operation: &OperationFile) -> SearchSettings {
    let s = &operation.search;
    SearchSettings { u_step: s.u_step, u_tolerance: s.u_tolerance, certified: s.certified_u_width }
}

/// Returns the required side of the uncut stock relative to the feed, `None` if either is
/// permitted.
///
/// A spindle that turns clockwise, seen from the spindle, moves its teeth against the feed on the
/// right of the feed: climb milling has the uncut stock there.
pub fn wanted_uncut_left(job: &Job, direction: DirectionFile) -> Option<bool> {
    let clockwise = job.tool.spindle_rotation() == SpindleRotation::Clockwise;
    match direction {
        DirectionFile::Climb => Some(!clockwise),
        DirectionFile::Conventional => Some(clockwise),
        DirectionFile::Either => None,
    }
}
