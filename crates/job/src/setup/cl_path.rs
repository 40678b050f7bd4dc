//! Passes of an operation from a CL file.

use facemill_cc_path::MAX_POINTS;
use facemill_cl_data::{CcPoint, Pass};
use facemill_cl_file::{is_cl_file, read_apt_in};
use facemill_cl_path::{
    ClPass, ClPasses, ClPathFault, ContactKind, CutSettings, FileContact, LaySettings, lay_cuts, read_cuts,
};

use crate::failure::Failure;
use crate::format::job_file::{ClAxesFile, OperationFile, PathFromCl, UncutSideFile};
use crate::load::job::{Job, Setup};
use crate::setup::cell::wanted_uncut_left;

/// Passes of a CL file on the drive surface, with the file's poses.
#[derive(Clone, Debug)]
pub struct ClLaid {
    /// Number of the tool (LOADTL); `None` in a file without.
    pub tool: Option<u32>,
    /// Number of cuts of the file: motion at feed between rapids.
    pub n_cuts: usize,
    /// Number of points of these cuts.
    pub n_points: usize,
    /// Passes in cutting order, on the surface without its allowance, and distances of the file's
    /// cutter from the surface.
    pub laid: ClPasses,
    /// Remarks on the file.
    pub notes: Vec<String>,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
}

/// Returns the passes of a CL file. Reverses the file's order of points if the required side of the
/// uncut stock demands it, where axes are searched.
///
/// # Errors
/// If the file is none, its cuts are not on the drive surface, or there are too many points in
/// `n_places` places; with file and line.
pub fn passes_of_cl_file(
    job: &Job,
    setup: &Setup<'_>,
    (operation, file): (&OperationFile, &PathFromCl),
    n_places: usize,
) -> Result<ClLaid, Failure> {
    let path = job.beside(&file.file);
    let bytes = job.files.bytes(&path)?;
    if !is_cl_file(&bytes) {
        let why = "this is no CL file (APT): none of its first lines begins with a word such as PARTNO, GOTO or FEDRAT";
        return Err(Failure::input(&path, why));
    }
    let wrong = |fault: ClPathFault| Failure::input(&path, fault);
    let read = read_apt_in(&bytes, file.unit.map(Into::into)).map_err(|e| Failure::input(&path, e))?;
    let tolerances = &operation.tolerances;
    let (cutter, max_points) = (job.tool.cutter(), (MAX_POINTS / n_places).max(1));
    let settings = CutSettings { cutter, tool: file.tool, chord: tolerances.path_chord_mm, max_points };
    let cuts = read_cuts(&read, &settings).map_err(wrong)?;
    let kind = match file.axes {
        ClAxesFile::Kept => ContactKind::OfTool,
        ClAxesFile::Searched => ContactKind::OfSurface,
    };
    let settings = LaySettings {
        kind,
        max_distance: file.max_distance_mm,
        allowance: setup.drive_allowance,
        max_step: tolerances.max_step_mm,
        max_points,
    };
    let mut laid = lay_cuts(&setup.drive, cutter, &cuts, &settings).map_err(wrong)?;
    let uncut_left = file.uncut_side == UncutSideFile::Left;
    if wanted_uncut_left(job, operation.direction).is_some_and(|wanted| wanted != uncut_left) {
        laid.passes.iter_mut().for_each(reverse);
    }
    let (n_cuts, n_points) = (cuts.cuts.len(), cuts.cuts.iter().map(Vec::len).sum());
    let notes = cuts.notes.into_iter().chain(remarks(&laid)).collect();
    Ok(ClLaid { tool: cuts.tool, n_cuts, n_points, laid, notes, uncut_left })
}

/// Remarks on parts of the file that are in no pass.
fn remarks(laid: &ClPasses) -> Vec<String> {
    let at = |line: Option<u32>| line.map_or_else(String::new, |line| format!("; the first in line {line}"));
    let mut notes = Vec::new();
    if laid.without_direction > 0 {
        let n = laid.without_direction;
        notes.push(format!(
            "{n} points have no direction along the surface, and are left out{}",
            at(laid.first_without)
        ));
    }
    if laid.jumps > 0 {
        let n = laid.jumps;
        notes.push(format!(
            "the contact jumps on the cutter in {n} places, where passes are divided{}",
            at(laid.first_jump)
        ));
    }
    notes
}

impl ClLaid {
    /// Returns the CC points of a pass.
    pub fn pass(pass: &ClPass) -> Pass<CcPoint> {
        Pass::new(pass.points.iter().map(|p| p.cc).collect())
    }
}

/// Turns a pass to be cut in the opposite direction.
fn reverse(pass: &mut ClPass) {
    pass.points.reverse();
    for FileContact { cc, posture, cl, .. } in &mut pass.points {
        cc.feed = -cc.feed;
        *posture = cc.posture_of(&cl.axis);
    }
}
