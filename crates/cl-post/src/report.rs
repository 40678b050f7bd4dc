//! Report of a posted file.

use facemill_job::duration_text::clock;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::program_times::ProgramTimes;
use facemill_job::format::verification_file::VerificationFile;
use facemill_nc_program::FeedMode;
use schemars::JsonSchema;
use serde::Serialize;

/// Value of the key `format` in the file.
pub const POST_FORMAT: &str = "facemill-post/1";

/// A CL file posted to a program.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PostReport {
    /// Always "facemill-post/1".
    pub format: &'static str,
    /// The CL file.
    pub cl_file: ProgramStamp,
    /// The program written.
    pub program: ProgramStamp,
    /// Name of the machine.
    pub machine: String,
    /// Control that the program is for.
    pub dialect: String,
    /// Meaning of its F.
    pub feed_mode: FeedMode,
    /// Whether the program was run against a part. If not, nothing is known about collisions and
    /// gouges.
    pub checked_against_part: bool,
    /// Tools in the order of their use.
    pub tools: Vec<PostedTool>,
    /// Comparison of the program, read back from its text, with the file.
    pub deviation: PostDeviation,
    /// Major words of the file by first appearance, with their treatment.
    pub words: Vec<PostedWord>,
    /// Faults: parts of the file that the program lacks, and differences between both.
    pub faults: Vec<PostNote>,
    /// Remarks for the operator.
    pub notes: Vec<PostNote>,
    /// Results of the runs against the part, one for each tool; empty without a part.
    pub verifications: Vec<VerificationFile>,
}

/// Part of a program with one tool.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PostedTool {
    /// Its number.
    pub number: u32,
    /// Its name in the tool file.
    pub name: String,
    /// Line of the CL file at which its part begins.
    pub cl_line: u32,
    /// Line of the program at which its first block is.
    pub program_line: u32,
    /// Points of the file.
    pub points: usize,
    /// Number of them that repeat the position before: they are not written again.
    pub repeated: usize,
    /// Motion blocks written.
    pub blocks: usize,
    /// Number of them that are inserted: chords of arcs, and positions that keep the tolerance.
    pub inserted: usize,
    /// Arcs of the file.
    pub arcs: usize,
    /// Blocks whose feed is lowered to what the axes reach within acceleration and jerk.
    pub lowered_feeds: usize,
    /// Times by the text.
    pub times: ProgramTimes,
}

/// Largest differences between the program, read back from its text, and the file.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct PostDeviation {
    /// Largest distance of the tip from a point of the file, mm.
    pub tip_mm: f64,
    /// Line of the CL file at that point; 0 without any deviation, as for the others.
    pub tip_cl_line: u32,
    /// Largest angle of the tool axis to that of a point, deg.
    pub axis_deg: f64,
    /// Line of the CL file at that point.
    pub axis_cl_line: u32,
    /// Largest distance of any point of the cutter's rim from its place at a point, mm.
    pub rim_mm: f64,
    /// Line of the CL file at that point.
    pub rim_cl_line: u32,
    /// Bound of the deviation of tip and rim of the cutter between two positions of a cut, mm.
    pub between_mm: f64,
    /// Line of the CL file there.
    pub between_cl_line: u32,
    /// The same in rapids, without those in which rotary axes turn anew.
    pub between_rapid_mm: f64,
    /// Limit of tip and rim in cuts, mm; beyond it the program is rejected.
    pub tolerance_mm: f64,
    /// Points and inserted positions compared.
    pub compared: usize,
}

/// A major word of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PostedWord {
    /// The word; `$$` for comments of the file.
    pub word: String,
    /// Line of the first one.
    pub first_line: u32,
    /// Number of statements.
    pub count: usize,
    /// Their treatment.
    pub treatment: Treatment,
}

/// Treatment of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Treatment {
    /// The program has it.
    Written,
    /// The program has its text as a comment.
    AsComment,
    /// It determines others, such as units and frames.
    Applied,
    /// It affects nothing here.
    NoEffect,
    /// The program lacks it.
    NotWritten,
    /// It is not understood, and the program lacks it.
    Unknown,
}

impl Treatment {
    fn text(self) -> &'static str {
        match self {
            Self::Written => "written",
            Self::AsComment => "as comment",
            Self::Applied => "applied",
            Self::NoEffect => "no effect",
            Self::NotWritten => "NOT WRITTEN",
            Self::Unknown => "UNKNOWN, NOT WRITTEN",
        }
    }
}

/// A remark with the line of the CL file that it is about.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PostNote {
    /// Line, from 1; absent if it is about the whole file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// The remark.
    pub text: String,
}

impl PostNote {
    pub(crate) fn at(line: u32, text: impl Into<String>) -> Self {
        Self { line: Some(line), text: text.into() }
    }

    pub(crate) fn whole(text: impl Into<String>) -> Self {
        Self { line: None, text: text.into() }
    }

    fn summary(&self) -> String {
        match self.line {
            Some(line) => format!("line {line}: {}", self.text),
            None => self.text.clone(),
        }
    }
}

/// Remarks that are gathered on the way.
#[derive(Debug, Default)]
pub(crate) struct Remarks {
    /// For the operator.
    pub(crate) notes: Vec<PostNote>,
    /// Motions that are faults unless a run against the part finds nothing.
    pub(crate) unproven: Vec<PostNote>,
    /// Cutters of the file that are not the tool's: faults.
    pub(crate) other_cutters: Vec<PostNote>,
}

/// Largest number of notes in the summary; the file has them all.
const SHOWN: usize = 30;

impl PostReport {
    /// Returns whether the program lacks nothing of the file, is as the file says, and has no fault
    /// in a run against the part.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.faults.is_empty() && self.verifications.iter().all(|v| v.verification.faults().next().is_none())
    }

    /// Returns lines for a person.
    #[must_use]
    pub fn summary(&self) -> String {
        let d = &self.deviation;
        let mut lines = vec![
            format!("{} posted for {}, {}", self.cl_file.file, self.machine, self.dialect),
            format!("  F                 {}", feed_text(self.feed_mode)),
        ];
        for tool in &self.tools {
            lines.push(format!("  T{:<5} {}, from line {} of the CL file", tool.number, tool.name, tool.cl_line));
            lines.push(format!(
                "    {} points, {} blocks, {} inserted, {} arcs, {} repeated points left out, {} feeds lowered",
                tool.points, tool.blocks, tool.inserted, tool.arcs, tool.repeated, tool.lowered_feeds
            ));
            lines.extend(tool.times.summary_lines().into_iter().map(|line| format!("  {line}")));
        }
        lines.push(format!("  time of all       {} at constant speed", clock(self.constant_time())));
        lines.push(format!(
            "  read back         tip within {:.4} mm{}, axis within {:.4} deg{} at {} positions",
            d.tip_mm,
            at_line(d.tip_cl_line),
            d.axis_deg,
            at_line(d.axis_cl_line),
            d.compared
        ));
        lines.push(format!(
            "  between positions cutter within {:.4} mm{} in cuts, {:.4} mm in rapids; allowed {} mm in cuts",
            d.between_mm,
            at_line(d.between_cl_line),
            d.between_rapid_mm,
            d.tolerance_mm
        ));
        lines.push("  words of the file".to_owned());
        let word = |w: &PostedWord| format!("    {:<12} {:>7}  {}", w.word, w.count, w.treatment.text());
        lines.extend(self.words.iter().map(word));
        notes(&mut lines, "faults", &self.faults);
        notes(&mut lines, "notes", &self.notes);
        for (tool, v) in self.tools.iter().zip(&self.verifications) {
            let faults: Vec<_> = v.verification.faults().collect();
            lines.push(format!(
                "  against the part  T{}: {} fault(s), {} finding(s){}",
                tool.number,
                faults.len(),
                v.verification.findings.len(),
                v.certificates
                    .as_ref()
                    .map_or_else(String::new, |c| format!("; {} of {} blocks certified", c.certified, c.blocks))
            ));
            let fault = |f: &&facemill_virtual_machine::Finding| {
                let bodies: Vec<&str> = [&f.body, &f.obstacle].into_iter().flatten().map(String::as_str).collect();
                let size = f.measure.map_or_else(String::new, |m| format!(" {m}"));
                format!("    line {} of the program: {} {}{size} {}", f.worst_line, f.kind, bodies.join(", "), f.note)
            };
            lines.extend(faults.iter().take(SHOWN).map(fault));
        }
        if !self.checked_against_part {
            lines.push(
                "  NOT CHECKED AGAINST A PART: nothing is known about collisions and gouges; give --job or --part"
                    .to_owned(),
            );
        }
        lines.join("\n") + "\n"
    }

    fn constant_time(&self) -> f64 {
        self.tools.iter().map(|t| t.times.constant_cutting_s + t.times.constant_rapid_s).sum()
    }
}

/// Place of a largest deviation; none where nothing deviates.
fn at_line(line: u32) -> String {
    if line == 0 { String::new() } else { format!(" (line {line})") }
}

fn feed_text(mode: FeedMode) -> &'static str {
    match mode {
        FeedMode::G94 => "per minute over all axes, 1 deg as 1 mm; no RTCP",
        FeedMode::G93 => "inverse time; no RTCP",
        FeedMode::Rtcp => "speed of the tip; RTCP",
    }
}

fn notes(lines: &mut Vec<String>, what: &str, notes: &[PostNote]) {
    if notes.is_empty() {
        return;
    }
    lines.push(format!("  {what}"));
    lines.extend(notes.iter().take(SHOWN).map(|note| format!("    {}", note.summary())));
    if notes.len() > SHOWN {
        lines.push(format!("    and {} more; the report has them all", notes.len() - SHOWN));
    }
}
