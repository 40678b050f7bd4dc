//! Deviation of planned poses from the CL files of their paths.

use facemill_cl_data::CcPoint;
use facemill_cl_path::{FileContact, StandOff};
use facemill_cutter_location::angle_between;
use facemill_job::format::job_file::PathFile;
use facemill_job::format::report::cl_paths::{ClPathReport, FileAngleReport, FileDistanceReport};
use facemill_job::frames::places;
use facemill_job::setup::cl_path::ClLaid;
use facemill_tool_path::segments::{Cut, PassSegment};
use nalgebra::{Isometry3, Point3};

use crate::passes::operation::PlannedOperation;

/// Returns the deviation of an operation from its CL file; `None` for another path.
pub(crate) fn cl_path(planned: &PlannedOperation<'_>) -> Option<ClPathReport> {
    let (operation, laid) = (planned.operation, planned.cl.as_deref()?);
    let PathFile::Cl(file) = &operation.path else { return None };
    let places = places(operation.pattern.as_ref());
    let mut found = Deviation::default();
    for piece in planned.moves.pieces.iter().map(|p| &p.piece) {
        let to_first = places.get(piece.copy as usize).map_or_else(Isometry3::identity, Isometry3::inverse);
        found.add(laid, piece, &to_first);
    }
    let turns = &laid.laid.turns;
    Some(ClPathReport {
        operation: operation.name.clone(),
        file: file.file.clone(),
        axes: file.axes,
        tool: laid.tool,
        cuts: laid.n_cuts,
        points: laid.n_points,
        points_off_surface: laid.laid.off_surface,
        first_line_off_surface: laid.laid.first_off,
        points_without_direction: laid.laid.without_direction,
        first_line_without_direction: laid.laid.first_without,
        contact_jumps: laid.laid.jumps,
        first_line_contact_jump: laid.laid.first_jump,
        passes: laid.laid.passes.len(),
        length_mm: laid.laid.length,
        in_passes_mm: laid.laid.length_in_passes,
        planned_mm: found.planned,
        largest_turn: FileAngleReport { deg: turns.largest.to_degrees(), line: turns.line },
        axis_jumps: turns.jumps,
        first_line_axis_jump: turns.first_jump,
        above: distance(&laid.laid.above),
        below: distance(&laid.laid.below),
        tip: operation.keeps_axes().then_some(found.tip),
        axis: found.axis,
        notes: laid.notes.clone(),
    })
}

fn distance(of: &StandOff) -> FileDistanceReport {
    FileDistanceReport { mm: of.mm, line: (of.mm > 0.0).then_some(of.line) }
}

/// Largest deviations so far.
#[derive(Default)]
struct Deviation {
    /// Way of the file's tip in planned parts of passes, mm.
    planned: f64,
    tip: FileDistanceReport,
    axis: FileAngleReport,
}

impl Deviation {
    /// Adds the poses of a piece, moved to the first place of the pattern.
    fn add(&mut self, laid: &ClLaid, piece: &PassSegment, to_first: &Isometry3<f64>) {
        let Some(pass) = laid.laid.passes.get(piece.pass).filter(|pass| !pass.points.is_empty()) else { return };
        let points = pass.points.as_slice();
        let mut from = 0;
        let mut cuts = piece.cuts.iter().peekable();
        let mut waiting: Vec<&Cut> = Vec::new();
        let mut last: Option<usize> = None;
        let mut first: Option<usize> = None;
        while let Some(cut) = cuts.next() {
            if cut.inserted && cuts.peek().is_some() {
                waiting.push(cut);
                continue;
            }
            let index = index_of(&cut.cc.transformed(to_first), points, from);
            let (low, high) = (last.unwrap_or(index.saturating_sub(1)), index);
            for between in waiting.drain(..) {
                self.add_cut(between, &points[low..=high.max(low)], to_first);
            }
            let around = if cut.inserted { &points[low..=high.max(low)] } else { &points[index..=index] };
            self.add_cut(cut, around, to_first);
            (from, last) = (index, Some(index));
            first = first.or(last);
        }
        if let (Some(first), Some(last)) = (first, last) {
            let way = points[first..=last.max(first)].windows(2);
            self.planned += way.map(|ends| (ends[1].cl.tip - ends[0].cl.tip).norm()).sum::<f64>();
        }
    }

    /// Adds a pose between the file's poses `around`.
    fn add_cut(&mut self, cut: &Cut, around: &[FileContact], to_first: &Isometry3<f64>) {
        let cl = cut.pose.cl.transformed(to_first);
        let (first, mut tip) = (around[0], (around[0].cl.tip - cl.tip).norm());
        let mut angle = angle_between(&first.cl.axis, &cl.axis);
        for ends in around.windows(2) {
            let (share, apart) = to_segment(&cl.tip, [&ends[0].cl.tip, &ends[1].cl.tip]);
            if apart <= tip {
                tip = apart;
                let axis = ends[0].cl.axis.try_slerp(&ends[1].cl.axis, share, 1e-12).unwrap_or(ends[0].cl.axis);
                angle = angle_between(&axis, &cl.axis);
            }
        }
        let line = Some(around.last().map_or(first.line, |last| last.line));
        if tip > self.tip.mm.max(ROUNDING) {
            self.tip = FileDistanceReport { mm: tip, line };
        }
        if angle.to_degrees() > self.axis.deg.max(ROUNDING) {
            self.axis = FileAngleReport { deg: angle.to_degrees(), line };
        }
    }
}

/// Deviation below which there is none, mm and deg: rounding of the computation.
const ROUNDING: f64 = 1e-9;

/// Returns the number of the file's point at a CC point, from `from` on; heights above the surface
/// do not count.
fn index_of(cc: &CcPoint, points: &[FileContact], from: usize) -> usize {
    let apart = |p: &FileContact| {
        let way = cc.position - p.cc.position;
        (way - cc.normal.into_inner() * way.dot(&cc.normal)).norm()
    };
    let near = |k: &usize| apart(&points[*k]);
    let found = (from..points.len()).find(|k| near(k) < SAME_PLACE);
    found.or_else(|| (from..points.len()).min_by(|a, b| near(a).total_cmp(&near(b)))).unwrap_or(0)
}

/// Distance below which two CC points are one, mm.
const SAME_PLACE: f64 = 1e-6;

/// Returns the place on a segment nearest to a point, from 0 to 1, and its distance.
fn to_segment(p: &Point3<f64>, [from, to]: [&Point3<f64>; 2]) -> (f64, f64) {
    let way = to - from;
    let length_sq = way.norm_squared();
    let share = if length_sq > 0.0 { ((p - from).dot(&way) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (share, (from + way * share - p).norm())
}
