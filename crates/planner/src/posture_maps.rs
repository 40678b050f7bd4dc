//! Maps of the feasible postures where each pass has the narrowest choice.

use facemill_cl_data::{CcPoint, Posture, Silent};
use facemill_cutter_location::search::map::{CellState, MapRange, SolutionMap, map};
use facemill_cutter_location::{Hints, Infeasible, PoseTest, SearchCurve, SearchSettings, Workcell, search};
use facemill_inverse_kinematics::{Branch, BranchPreference};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::solution_space_file::{POSTURE_MAPS_FORMAT, PostureMap, PostureMapsFile};
use facemill_job::load::job::Job;
use facemill_job::setup::cell::{search_settings, workcell};
use facemill_tool_path::segments::{Cut, PassSegment};
use rayon::prelude::*;

use crate::passes::operation::mapped_range;
use crate::plan::ReadSetup;
use crate::planned::{Planned, PosedPass};

/// Most passes that are mapped: a map takes some 25 ms.
const MOST_MAPS: usize = 100;

/// CC points of a pass among which the narrowest is sought.
const CANDIDATES: usize = 8;

/// Accuracy of the smallest feasible postures that are compared, as a share of the search curve.
const COARSE: f64 = 0.02;

/// Finest cells, rad; coarser where a range has more than [`MOST_CELLS`] of them.
const RESOLUTION: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Most cells along tilt and along rotate, before their number is rounded up to a power of two.
const MOST_CELLS: f64 = 64.0;

/// Points of a search curve.
const CURVE_POINTS: u32 = 24;

/// Maps tilt and rotate at the narrowest of some points of each pass: the first whose smallest
/// feasible posture has the largest tilt. Of passes in several places of a pattern maps those in
/// the first place, and of more than 100 some.
///
/// # Errors
/// If a range of postures cannot be mapped.
pub fn posture_maps(job: &Job, read: &ReadSetup<'_>, planned: &Planned) -> Result<PostureMapsFile, Failure> {
    let is_first = |pass: &&PosedPass| pass.piece.copy == 0;
    let n_first = planned.posed.iter().filter(is_first).count();
    let step = n_first.div_ceil(MOST_MAPS).max(1);
    let some: Vec<&PosedPass> = planned.posed.iter().filter(is_first).step_by(step).collect();
    let ReadSetup { setup, map: z_map } = read;
    let job = &job.for_setup(setup.index);
    let operations: Vec<&OperationFile> = job.operations_of(setup.file).map(|(_, operation)| operation).collect();
    // A cell and its test take longer to prepare than a map to make.
    let cell = |operation: &OperationFile, branch: BranchPreference| Workcell {
        preferred_branch: branch,
        ..workcell(job, setup, operation, z_map)
    };
    let branches = [BranchPreference::Positive, BranchPreference::Negative];
    let cells: Vec<[Workcell<'_>; 2]> = operations.iter().map(|o| branches.map(|branch| cell(o, branch))).collect();
    let tests: Vec<[PoseTest<'_>; 2]> = cells.iter().map(|of| of.each_ref().map(PoseTest::new)).collect();
    let of_pass = |pass: &&PosedPass| {
        let Some(k) = operations.iter().position(|o| o.name == pass.operation) else { return Ok(None) };
        map_of_pass((operations[k], &tests[k]), pass)
    };
    let maps = some.par_iter().map(of_pass).collect::<Result<Vec<_>, Failure>>()?;
    let mut curves_deg: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut place = |curve: &SearchCurve| {
        let points: Vec<[f64; 2]> = curve_points(curve).map(|p| degrees([p.tilt, p.rotate])).collect();
        curves_deg.iter().position(|known| *known == points).unwrap_or_else(|| {
            curves_deg.push(points);
            curves_deg.len() - 1
        })
    };
    let with_curve =
        |(map, pass): (Option<PostureMap>, &&PosedPass)| Some(PostureMap { curve: place(&pass.piece.curve), ..map? });
    let maps = maps.into_iter().zip(&some).filter_map(with_curve).collect();
    Ok(PostureMapsFile {
        format: POSTURE_MAPS_FORMAT,
        programs: planned.report.programs.clone(),
        n_passes: planned.posed.len(),
        curves_deg,
        maps,
    })
}

/// Returns the map of a pass of an operation, with the tests of both branches; `None` without
/// points of the path.
fn map_of_pass(
    (operation, [positive, negative]): (&OperationFile, &[PoseTest<'_>; 2]),
    pass: &PosedPass,
) -> Result<Option<PostureMap>, Failure> {
    let PassSegment { cuts, curve, .. } = &pass.piece;
    let is_negative = cuts.first().is_some_and(|cut| cut.pose.configuration.branch == Branch::Negative);
    let test = if is_negative { negative } else { positive };
    // Only a choice among points: nothing is proven by it.
    let settings = SearchSettings { u_tolerance: COARSE, certified: None, ..search_settings(operation) };
    let smallest = |cc: &CcPoint| {
        let found = search(test, cc, curve, &settings, 0.0, None, &mut Hints::default());
        found.map_or(f64::INFINITY, |f| f.pose.posture.tilt)
    };
    let points: Vec<&Cut> = cuts.iter().filter(|cut| !cut.inserted).collect();
    let some = points.iter().step_by(points.len().div_ceil(CANDIDATES).max(1));
    let narrowest = some.map(|cut| (cut, smallest(&cut.cc))).reduce(|a, b| if b.1 > a.1 { b } else { a });
    let Some((cut, _)) = narrowest else { return Ok(None) };
    let range = mapped_range(curve);
    let widths = [range.tilt, range.rotate].map(|[from, to]| to - from);
    let resolution = widths.iter().fold(RESOLUTION, |finest, width| finest.max(width / MOST_CELLS));
    let found = map(test, &cut.cc, range, resolution, &Silent);
    let found = found.map_err(|e| Failure::Internal(format!("map of postures: {e}")))?;
    Ok(Some(file_of_map(&pass.operation, &pass.piece, cut, &found)))
}

fn file_of_map(operation: &str, piece: &PassSegment, cut: &Cut, map: &SolutionMap) -> PostureMap {
    let (n_cells, cells) = raster(map);
    let area = map.fractions();
    PostureMap {
        operation: operation.to_owned(),
        pass: piece.pass + 1,
        place: piece.copy as usize + 1,
        tip_mm: cut.pose.cl.tip.coords.map(|x| rounded(x, 1e6)).into(),
        axis: cut.pose.cl.axis.into_inner().map(|x| rounded(x, 1e9)).into(),
        tilt_deg: degrees(map.range.tilt),
        rotate_deg: degrees(map.range.rotate),
        taken_deg: degrees([cut.pose.posture.tilt, cut.pose.posture.rotate]),
        curve: 0,
        n_cells,
        proven: [area.free, area.blocked].map(|share| rounded(share, 1e6)),
        cells,
    }
}

/// Returns angles in degrees, rounded for a picture.
fn degrees(angles: [f64; 2]) -> [f64; 2] {
    angles.map(|angle| rounded(angle.to_degrees(), 1e4))
}

fn curve_points(curve: &SearchCurve) -> impl Iterator<Item = Posture> + '_ {
    (0..=CURVE_POINTS).map(|k| curve.at(f64::from(k) / f64::from(CURVE_POINTS)))
}

/// Returns a map on a grid of its finest cells, in rows along tilt, with their numbers.
fn raster(map: &SolutionMap) -> ([usize; 2], String) {
    let sides = |of: fn(&MapRange) -> [f64; 2]| {
        let whole = of(&map.range);
        let finest = map.cells.iter().map(|cell| of(&cell.range)).map(|[a, b]| b - a).fold(f64::INFINITY, f64::min);
        (whole, ((whole[1] - whole[0]) / finest).round().max(1.0) as usize)
    };
    let ((tilt, n), (rotate, m)) = (sides(|r| r.tilt), sides(|r| r.rotate));
    let mut letters = vec![b'f'; n * m];
    let places = |[from, to]: [f64; 2], [low, high]: [f64; 2], n: usize| {
        let place = |x: f64| (((x - low) / (high - low) * n as f64).round() as usize).min(n);
        place(from)..place(to)
    };
    for cell in &map.cells {
        let letter = letter(&cell.state);
        for row in places(cell.range.rotate, rotate, m) {
            for column in places(cell.range.tilt, tilt, n) {
                letters[row * n + column] = letter;
            }
        }
    }
    ([n, m], letters.into_iter().map(char::from).collect())
}

fn letter(state: &CellState) -> u8 {
    let of = |why: &Infeasible| match why {
        Infeasible::Gouge { .. } => b'g',
        Infeasible::Collision { .. } => b'c',
        Infeasible::OutsideCone { .. } | Infeasible::Singular { .. } => b'a',
        // The machine has no axis values; others are reasons of links.
        _ => b'l',
    };
    match state {
        CellState::Free => b'F',
        CellState::Blocked(why) => of(why).to_ascii_uppercase(),
        CellState::Uncertain(middle) => middle.as_ref().map_or(b'f', of),
    }
}

/// Returns a number rounded to a share of 1, without a negative zero.
fn rounded(x: f64, per_unit: f64) -> f64 {
    (x * per_unit).round() / per_unit + 0.0
}
