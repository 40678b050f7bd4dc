//! Map of the feasible set at one CC point of a job: picture and file.

use facemill_cl_data::CcPoint;
use facemill_cutter_location::search::map::{CellState, MapCell, MapError, SolutionMap, map, n_steps};
use facemill_cutter_location::{Body, Hints, Infeasible, PoseTest, search};
use facemill_drawing::solution_svg::map_svg;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::solution_space_file::{
    AreaFile, CellFile, PostureFile, ReasonFile, ReasonKind, SolutionSpaceFile, SolutionSpaceFormat, StateFile,
};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::{search_settings, workcell, z_map};
use facemill_job::setup::path::lay_operation;
use facemill_job::stages::Stages;
use facemill_job::validate::setup_names::belongs;
use facemill_tool_path::segments::LaidTask;

use crate::passes::operation::{mapped_range, settle_branch};

/// CC point to map, and the resolution.
#[derive(Clone, Debug)]
pub struct SolutionSpaceRequest {
    /// Name of the operation, or its number from 1.
    pub operation: String,
    /// Pass of the path, from 1 as in the program's comments.
    pub pass: usize,
    /// CC point of the pass, from 1.
    pub point: usize,
    /// Size of the finest cells, deg.
    pub resolution_deg: f64,
}

/// Files of a map.
pub struct SolutionSpace {
    /// Content of `solution-space.json`.
    pub file: SolutionSpaceFile,
    /// Content of `solution-space.svg`.
    pub svg: String,
}

/// Maps tilt and rotate, from 0 to the ends of the operation's search, at one CC point.
///
/// # Errors
/// If the input is wrong, the operation, pass or point does not exist, or the stages are cancelled.
pub fn solution_space(
    job: &Job,
    request: &SolutionSpaceRequest,
    stages: &dyn Stages,
) -> Result<SolutionSpace, Failure> {
    let (index, operation) = operation_of(job, &request.operation)?;
    let setup_index = job.file.setups.iter().position(|s| belongs(operation, s, &job.file));
    let setup_index = setup_index.ok_or_else(|| job.wrong(format!("operations[{index}]: has no setup")))?;
    let job = &job.for_setup(setup_index);
    let setup = Setup::read(job, setup_index)?;
    let z_map = z_map(&setup)?;
    let mut cell = workcell(job, &setup, operation, &z_map);
    let path = lay_operation(job, &setup, index, operation)?;
    settle_branch(&mut cell, &path.tasks);
    let test = PoseTest::new(&cell);
    let (task, cc) = point_of(job, &path.tasks, request)?;
    let range = mapped_range(&task.curve);
    let resolution = request.resolution_deg.to_radians();
    let failed = |e: MapError| match e {
        MapError::Cancelled(cancelled) => cancelled.into(),
        other => job.wrong(format!("--resolution-deg {}: {other}", request.resolution_deg)),
    };
    let monitor = stages.start("solution space", n_steps(&range, resolution).map_err(failed)?);
    let map = map(&test, cc, range, resolution, &*monitor).map_err(failed)?;
    drop(monitor);
    let found = search(&test, cc, &task.curve, &search_settings(operation), 0.0, None, &mut Hints::default()).ok();
    let found = found.map(|f| f.pose.posture);
    let title = format!("{}, pass {}, point {}", operation.name, request.pass, request.point);
    let svg = map_svg(&map, &task.curve, found, &title);
    let file = SolutionSpaceFile {
        format: SolutionSpaceFormat::V1,
        job: job.file.name.clone(),
        setup: setup.file.name.clone(),
        operation: operation.name.clone(),
        pass: request.pass,
        point: request.point,
        position_mm: cc.position.coords.into(),
        normal: cc.normal.into_inner().into(),
        feed: cc.feed.into_inner().into(),
        tilt_deg: degrees(map.range.tilt),
        rotate_deg: degrees(map.range.rotate),
        resolution_deg: request.resolution_deg,
        pose_tests: map.judged,
        area: area(&map),
        found: found.map(|p| PostureFile { tilt_deg: p.tilt.to_degrees(), rotate_deg: p.rotate.to_degrees() + 0.0 }),
        cells: map.cells.iter().map(|c| cell_file(&test, c)).collect(),
    };
    Ok(SolutionSpace { file, svg })
}

/// Returns the operation of a name, or of a number from 1.
fn operation_of<'j>(job: &'j Job, wanted: &str) -> Result<(usize, &'j OperationFile), Failure> {
    let all = &job.file.operations;
    let by_number = || wanted.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).filter(|k| *k < all.len());
    let index = all.iter().position(|o| o.name == wanted).or_else(by_number);
    index.map(|k| (k, &all[k])).ok_or_else(|| {
        let names: Vec<String> = all.iter().enumerate().map(|(k, o)| format!("{} \"{}\"", k + 1, o.name)).collect();
        job.wrong(format!("--operation {wanted}: there is none; by number and name there are {}", names.join(", ")))
    })
}

/// Returns the pass and CC point of a request.
fn point_of<'l>(
    job: &Job,
    tasks: &'l [LaidTask],
    request: &SolutionSpaceRequest,
) -> Result<(&'l LaidTask, &'l CcPoint), Failure> {
    let task = request.pass.checked_sub(1).and_then(|k| tasks.get(k)).ok_or_else(|| {
        job.wrong(format!("--pass {}: the passes of this operation are 1 to {}", request.pass, tasks.len()))
    })?;
    let points = &task.pass.points;
    let cc = request.point.checked_sub(1).and_then(|k| points.get(k)).ok_or_else(|| {
        let (point, pass) = (request.point, request.pass);
        job.wrong(format!("--point {point}: the points of pass {pass} are 1 to {}", points.len()))
    })?;
    Ok((task, cc))
}

fn area(map: &SolutionMap) -> AreaFile {
    let fractions = map.fractions();
    AreaFile { free: fractions.free, blocked: fractions.blocked, uncertain: fractions.uncertain }
}

fn degrees(range: [f64; 2]) -> [f64; 2] {
    range.map(f64::to_degrees)
}

fn cell_file(test: &PoseTest<'_>, cell: &MapCell) -> CellFile {
    let (state, why) = match &cell.state {
        CellState::Free => (StateFile::Free, None),
        CellState::Blocked(why) => (StateFile::Blocked, Some(why)),
        CellState::Uncertain(middle) => (StateFile::Uncertain, middle.as_ref()),
    };
    CellFile {
        tilt_deg: degrees(cell.range.tilt),
        rotate_deg: degrees(cell.range.rotate),
        state,
        reason: why.map(|why| reason(test, why)),
    }
}

fn reason(test: &PoseTest<'_>, why: &Infeasible) -> ReasonFile {
    let (kind, body, met) = match why {
        Infeasible::Gouge { obstacle, place } => (ReasonKind::Gouge, Some(Body::Cutter), Some((*obstacle, place))),
        Infeasible::Collision { body, obstacle, place } => {
            (ReasonKind::Collision, Some(*body), Some((*obstacle, place)))
        }
        Infeasible::OutsideCone { .. } | Infeasible::Singular { .. } => (ReasonKind::Cone, None, None),
        // The machine has no axis values, or none on the way there; others are reasons of links.
        _ => (ReasonKind::AxisLimit, None, None),
    };
    ReasonFile {
        kind,
        text: test.describe(why),
        body: body.map(|b| test.body_name(b).to_owned()),
        obstacle: met.map(|(k, place)| test.obstacle_name(k, place)),
    }
}
