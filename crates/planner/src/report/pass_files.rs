//! Files of the passes of a plan: path files, and pictures of how they use their strips.

use facemill_cc_path::files::{PathFile, write_path_file};
use facemill_cl_data::{CcPoint, Pass};
use facemill_cutter_location::cusp::strips::strip_width;
use facemill_job::format::report::Report;
use facemill_job::frames::places;
use facemill_job::load::job::{Job, Setup};
use facemill_tool_model::FeedCurvature;
use facemill_tool_path::moves::PieceMoves;
use nalgebra::Isometry3;

use crate::passes::operation::PlannedOperation;
use facemill_drawing::passes_svg::{DrawnPoint, passes_svg};

/// Path file and picture of an operation, by the ends of their names.
pub(crate) struct PassFiles {
    /// Number of the operation in a setup of several: `-1`.
    pub number: String,
    /// `passes.json`: a path file.
    pub path: String,
    /// `passes.svg`.
    pub picture: String,
}

/// Returns the files of each operation with a pass; `jobs` are the job as each operation's head
/// sees it, `report` has the figures of the pictures.
pub(crate) fn pass_files(
    jobs: &[&Job],
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
    report: &Report,
) -> Vec<PassFiles> {
    let several = operations.len() > 1;
    let of = |(k, (o, job)): (usize, (&PlannedOperation<'_>, &&Job))| {
        let drawn = Drawn::of(o)?;
        let number = if several { format!("-{}", k + 1) } else { String::new() };
        let title = format!("{}, {}: {}", report.job, report.setup, o.operation.name);
        let picture = passes_svg(&title, &figures(report, &o.operation.name), &drawn.points(job, o));
        Some(PassFiles { number, path: drawn.path(setup.drive_allowance), picture })
    };
    operations.iter().zip(jobs).enumerate().filter_map(of).collect()
}

/// Returns the figures of an operation in words.
fn figures(report: &Report, operation: &str) -> String {
    let n_passes = report.passes.iter().filter(|p| p.operation == operation).count();
    let mut text = format!("{n_passes} passes");
    if let Some(e) = report.efficiency.iter().find(|e| e.operation == operation) {
        text += &format!(
            " of {:.2} m, {:.3} times their floor of {:.2} m",
            e.passes_length_mm / 1000.0,
            e.efficiency,
            e.floor_mm / 1000.0
        );
    }
    let remaining = report.remaining.iter().flat_map(|r| &r.operations);
    if let Some(left) = remaining.clone().find(|r| r.operation == operation) {
        let largest = left.largest.map_or(0.0, |place| place.height_mm);
        text += &format!("; left: 99 % at most {:.3} mm, largest {largest:.3} mm", left.p99_mm);
    }
    text
}

/// Passes of an operation in the first place of the pattern that has any, with their ridges.
struct Drawn<'o> {
    /// Piece by piece, with its index.
    pieces: Vec<(usize, &'o PieceMoves)>,
    /// From that place back to the first.
    first_from_place: Isometry3<f64>,
}

impl<'o> Drawn<'o> {
    /// Returns the passes; `None` without any.
    fn of(o: &'o PlannedOperation<'_>) -> Option<Self> {
        let all = || o.moves.pieces.iter().enumerate();
        let copy = all().map(|(_, p)| p.piece.copy).min()?;
        let place = places(o.operation.pattern.as_ref()).get(copy as usize).copied().unwrap_or_default();
        let pieces = all().filter(|(_, p)| p.piece.copy == copy).collect();
        Some(Self { pieces, first_from_place: place.inverse() })
    }

    /// Returns the path file of the passes.
    fn path(&self, allowance: f64) -> String {
        let pass = |(_, moves): &(usize, &PieceMoves)| {
            let places = moves.piece.places().map(|cut| cut.cc.transformed(&self.first_from_place));
            Pass::new(places.collect::<Vec<_>>())
        };
        path_text(&self.pieces.iter().map(pass).collect::<Vec<_>>(), allowance)
    }

    /// Returns the points with their use of the strip.
    fn points(&self, job: &Job, o: &PlannedOperation<'_>) -> Vec<Vec<DrawnPoint>> {
        let (cutter, tolerances) = (job.tool.cutter(), &o.operation.tolerances);
        let of_piece = |(k, moves): &(usize, &PieceMoves)| {
            let along = o.along.get(*k).into_iter().flatten().filter(|a| a.is_point).map(|a| a.ridge);
            let points = moves.piece.cuts.iter().filter(|cut| !cut.inserted);
            let drawn = points.zip(along.chain(std::iter::repeat(None))).map(|(cut, ridge)| {
                let allowed = |curvature: &FeedCurvature| {
                    let (cusp, largest) = (tolerances.cusp_mm, tolerances.max_step_over_mm);
                    strip_width(cutter, cut.pose.posture, curvature, cusp, largest)
                };
                let strip_use = ridge.map(|r| r.step_over / allowed(&r.curvature).max(f64::MIN_POSITIVE));
                let cc = cut.cc.transformed(&self.first_from_place);
                DrawnPoint { position: cc.position, normal: cc.normal, strip_use }
            });
            drawn.collect()
        };
        self.pieces.iter().map(of_piece).collect()
    }
}

/// Returns a path file that a job can read back: points on the surface, without the allowance.
/// Coordinates are rounded to a nanometre.
pub fn path_text(passes: &[Pass<CcPoint>], allowance: f64) -> String {
    let on_surface = |cc: &CcPoint| CcPoint { position: cc.position - cc.normal.into_inner() * allowance, ..*cc };
    let passes: Vec<Pass<CcPoint>> = passes.iter().map(|pass| pass.map(on_surface)).collect();
    let mut file = PathFile::from_passes(&passes);
    for pass in &mut file.passes {
        let normals = pass.normals.iter_mut().flatten();
        pass.points_mm.iter_mut().chain(normals).flatten().for_each(|c| *c = rounded(*c));
    }
    write_path_file(&file)
}

/// Returns a coordinate to 1e-6.
fn rounded(coordinate: f64) -> f64 {
    // Adding 0 turns -0 into 0.
    (coordinate * 1e6).round() / 1e6 + 0.0
}
