//! Deviation of a report's operations from the CL files of their paths.

use schemars::JsonSchema;
use serde::Serialize;

use crate::format::job_file::ClAxesFile;

/// Operation whose path is a CL file: parts of the file that became passes, and how far the plan
/// deviates from it. In all places of a pattern.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ClPathReport {
    /// Name of the operation.
    pub operation: String,
    /// The file, as the job names it.
    pub file: String,
    /// Origin of the axes, of the job.
    pub axes: ClAxesFile,
    /// Number of the tool (LOADTL) whose cuts were taken; `null` in a file without.
    pub tool: Option<u32>,
    /// Number of its cuts: motion at feed between rapids.
    pub cuts: usize,
    /// Number of points of the cuts, with those of arcs.
    pub points: usize,
    /// Number of these points that are in no pass, because they are farther above the drive surface
    /// than `max_distance_mm`: entries, exits and links at feed.
    pub points_off_surface: usize,
    /// Line of the first of them.
    pub first_line_off_surface: Option<u32>,
    /// Number of points, of the file and inserted, that are in no pass because they have no
    /// direction along the surface: the feed is along the normal, or turns back.
    pub points_without_direction: usize,
    /// Line of the first of them.
    pub first_line_without_direction: Option<u32>,
    /// Number of places where the contact jumps on the cutter, and passes are divided; 0 where axes
    /// are kept.
    pub contact_jumps: usize,
    /// Line of the first of them.
    pub first_line_contact_jump: Option<u32>,
    /// Number of passes that the cuts became.
    pub passes: usize,
    /// Length of the tip's way along the cuts of the file.
    pub length_mm: f64,
    /// Length of this way that is in passes.
    pub in_passes_mm: f64,
    /// Length of this way that is planned, in all places of a pattern together: between the first
    /// and the last of the file's points in each planned part of a pass.
    pub planned_mm: f64,
    /// Largest turn of the file's tool axis from one of its points to the next in a pass.
    pub largest_turn: FileAngleReport,
    /// Number of places in passes where this axis jumps: it turns by more than 5 deg, and by more
    /// than 5 deg per mm of the way of the contact. Where axes are kept, the plan has these jumps.
    pub axis_jumps: usize,
    /// Line of the first of them.
    pub first_line_axis_jump: Option<u32>,
    /// Largest distance of the file's cutter in passes above the drive surface with its allowance.
    pub above: FileDistanceReport,
    /// Largest depth of the file's cutter in passes below that surface.
    pub below: FileDistanceReport,
    /// Largest distance of the tip of a planned pose from the file's motion, in passes; `null`
    /// where axes are searched.
    pub tip: Option<FileDistanceReport>,
    /// Largest angle between the tool axis of a planned pose and that of the file at its place.
    pub axis: FileAngleReport,
    /// Remarks on the file.
    pub notes: Vec<String>,
}

/// A distance and its place in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct FileDistanceReport {
    /// Distance, not below 0.
    pub mm: f64,
    /// Line of the CL file; `null` if the distance is 0 everywhere.
    pub line: Option<u32>,
}

/// An angle and its place in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct FileAngleReport {
    /// Angle, not below 0.
    pub deg: f64,
    /// Line of the CL file; `null` if the angle is 0 everywhere.
    pub line: Option<u32>,
}

impl ClPathReport {
    /// Returns the lines for a summary.
    pub fn summary_lines(&self) -> Vec<String> {
        let Self { operation, file, passes, cuts, points, .. } = self;
        let at = |line: Option<u32>| line.map_or_else(String::new, |line| format!(" (line {line})"));
        let axes = match self.axes {
            ClAxesFile::Kept => "axes kept",
            ClAxesFile::Searched => "axes searched",
        };
        let mut lines = vec![format!(
            "  CL file           operation \"{operation}\", {file}, {axes}: {cuts} cuts of {points} points became {passes} passes"
        )];
        lines.push(format!(
            "    file to surface: {:.4} mm above{}, {:.4} mm below{}",
            self.above.mm,
            at(self.above.line),
            self.below.mm,
            at(self.below.line)
        ));
        let tip = self.tip.map_or_else(String::new, |tip| format!("tip {:.6} mm{}, ", tip.mm, at(tip.line)));
        lines.push(format!("    plan to file: {tip}axis {:.4} deg{}", self.axis.deg, at(self.axis.line)));
        if self.points_off_surface > 0 {
            let n = self.points_off_surface;
            lines.push(format!(
                "    not on the surface: {n} points, left out as entries, exits or links{}",
                self.first_line_off_surface.map_or_else(String::new, |line| format!("; the first in line {line}"))
            ));
        }
        lines.push(format!(
            "    way of the tip: {:.1} mm in cuts, {:.1} mm in passes, {:.1} mm planned",
            self.length_mm, self.in_passes_mm, self.planned_mm
        ));
        if self.axis_jumps > 0 {
            lines.push(format!(
                "    THE FILE'S AXIS JUMPS in {} places, first{}; its largest turn is {:.2} deg{}{}",
                self.axis_jumps,
                at(self.first_line_axis_jump),
                self.largest_turn.deg,
                at(self.largest_turn.line),
                if self.axes == ClAxesFile::Kept { ": the plan has these turns" } else { "" }
            ));
        }
        lines.extend(self.notes.iter().map(|note| format!("    note: {note}")));
        lines
    }
}
