//! What is told of lengths.

use facemill_tool_model::AssemblyLength;
use facemill_virtual_machine::{Certificates, Finding, ForcedBy};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::program_stamp::ProgramStamp;
use crate::format::report::InfeasibleReport;

/// Value of the key `format` in the file.
pub const LENGTHS_FORMAT: &str = "facemill-lengths/1";

/// The lengths that a program needs.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LengthsFile {
    /// Always "facemill-lengths/1".
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// The program that was run; lengths for which the job was planned again are of another one.
    pub program: ProgramStamp,
    /// BLAKE3 checksum of the program that the job was planned again to; absent where it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replanned_blake3: Option<String>,
    /// Control that the program was read for.
    pub dialect: String,
    /// Name of the tool.
    pub tool: String,
    /// What a length that is forced has above the least that is free.
    pub margin_mm: f64,
    /// Distance of the lines of the stock; absent where it was not cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
    /// What becomes of the program's words with the new length.
    pub posting: Posting,
    /// L1 to L4; without L3 where the holder has one section.
    pub lengths: Vec<LengthReport>,
    /// The length that nothing up to the longest is free with; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub none_is_free: Option<NoLength>,
    /// Name of the holder that was chosen; absent without a library, and where none of its holders
    /// works.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub holder: Option<String>,
    /// Every holder of the library, in its order; empty without one.
    pub holders: Vec<HolderReport>,
    /// Shorter assemblies that the job was planned again with, in the order in which they were
    /// tried; empty where that was not asked for.
    pub replans: Vec<ReplanTry>,
    /// All that the ordinary run finds with these lengths, or with the holder that was chosen.
    pub findings: Vec<Finding>,
    /// What is proven of each block with them; absent where it was not asked for, or none is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificates: Option<Certificates>,
}

/// What becomes of a program's words when the length of the tool is another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Posting {
    /// They stay: the control adds the length, which stands in the tool's register.
    AsItIs,
    /// The head turns, and the words hold the length: the program is to be posted again.
    Again,
}

/// A length of the assembly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub enum LengthName {
    /// To the end of the flute.
    L1,
    /// To the nose of the holder.
    L2,
    /// To the top of the holder's lowest section.
    L3,
    /// To the spindle face.
    L4,
}

impl LengthName {
    /// Name of a length of the assembly.
    pub fn of(length: AssemblyLength) -> Self {
        [Self::L1, Self::L2, Self::L3, Self::L4][length.index()]
    }

    /// What it is, in words.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::L1 => "tip to end of flute",
            Self::L2 => "tip to nose of holder",
            Self::L3 => "tip to top of lower holder section",
            Self::L4 => "tip to spindle face",
        }
    }
}

/// One length.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LengthReport {
    /// Which.
    pub name: LengthName,
    /// What it is, in words.
    pub meaning: &'static str,
    /// Of the job's tool.
    pub now_mm: f64,
    /// The shortest, with the margin where it is forced.
    pub length_mm: f64,
    /// The place that forces it; absent where nothing does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forced_by: Option<ForcedBy>,
    /// What keeps it from being shorter, where no place does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rests_on: Option<&'static str>,
}

/// A length that no value up to the longest is free with.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NoLength {
    /// Which.
    pub name: LengthName,
    /// The longest that was allowed.
    pub longest_mm: f64,
    /// Where.
    pub by: ForcedBy,
}

/// A holder of the library.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HolderReport {
    /// Its name.
    pub name: String,
    /// The shortest stick-out that works; absent where none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick_out_mm: Option<f64>,
    /// The place that forces it; absent where it is the holder's shortest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forced_by: Option<ForcedBy>,
    /// Why it does not work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

/// Findings that are told; the file has them all.
const TOLD: usize = 30;

impl LengthsFile {
    /// The file as a table to read.
    #[must_use]
    pub fn table(&self) -> String {
        let posting = match self.posting {
            Posting::AsItIs => "as it is, with the new length in the tool's register",
            Posting::Again => "to be posted again: the head turns",
        };
        let mut out = format!(
            "{} - {}, read as {}\n  tool              {}\n  margin            {} mm\n  program           {posting}\n",
            self.job, self.setup, self.dialect, self.tool, self.margin_mm
        );
        for holder in &self.holders {
            out.push_str(&holder_line(holder, self.holder.as_ref() == Some(&holder.name)));
        }
        for tried in &self.replans {
            out.push_str(&tried.line());
        }
        if !self.lengths.is_empty() {
            out.push_str("        now mm  shortest mm\n");
        }
        for length in &self.lengths {
            out.push_str(&length_line(length));
        }
        if let Some(none) = &self.none_is_free {
            out.push_str(&format!(
                "  {:?} is free of {} nowhere up to {} mm: {}\n",
                none.name,
                none.by.obstacle,
                none.longest_mm,
                place(&none.by)
            ));
        }
        if let Some(c) = &self.certificates {
            out.push_str(&format!("  certified blocks  {} of {}\n", c.certified, c.blocks));
        }
        out.push_str(&format!("  findings          {}\n", self.findings.len()));
        out.extend(self.findings.iter().take(TOLD).map(|f| format!("    {f}\n")));
        if self.findings.len() > TOLD {
            out.push_str(&format!("    and {} more; --out writes them all\n", self.findings.len() - TOLD));
        }
        out
    }
}

fn length_line(length: &LengthReport) -> String {
    let LengthReport { name, meaning, now_mm, length_mm, forced_by, rests_on } = length;
    let why = match (forced_by, rests_on) {
        (Some(by), _) => place(by),
        (None, Some(on)) => format!("not forced: rests on {on}"),
        (None, None) => "not forced".to_owned(),
    };
    format!("  {name:?} {now_mm:>9.2} {length_mm:>12.2}  {meaning}; {why}\n")
}

fn holder_line(holder: &HolderReport, is_chosen: bool) -> String {
    let mark = if is_chosen { "*" } else { " " };
    let what = match (&holder.stick_out_mm, &holder.forced_by, &holder.why_not) {
        (_, _, Some(why)) => why.clone(),
        (Some(at), Some(by), _) => format!("stick-out {at:.2} mm, {}", place(by)),
        (Some(at), None, _) => format!("stick-out {at:.2} mm, its shortest"),
        (None, ..) => String::new(),
    };
    format!("  {mark} {}: {what}\n", holder.name)
}

fn place(by: &ForcedBy) -> String {
    let [x, y, z] = by.place_work_mm;
    format!("line {} ({}): {} and {} at ({x:.2}, {y:.2}, {z:.2})", by.line, by.block_text, by.body, by.obstacle)
}

/// A shorter assembly that the job was planned again with.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ReplanTry {
    /// Name of the holder.
    pub holder: String,
    /// Stick-out that it was planned with.
    pub stick_out_mm: f64,
    /// CC points with a pose in its program.
    pub planned_points: usize,
    /// How many CC points fewer that is than with the assembly that works as the program is.
    pub lost_points: usize,
    /// All that its plan leaves out, by reason, with the first place of each.
    pub left_out: Vec<InfeasibleReport>,
    /// Faults that its program was found with.
    pub faults: usize,
    /// Whether it was taken.
    pub taken: bool,
    /// Why it could not be planned at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

impl ReplanTry {
    /// As a line to read.
    pub fn line(&self) -> String {
        let Self { holder, stick_out_mm, planned_points, lost_points, left_out, faults, taken, why_not } = self;
        let mark = if *taken { "*" } else { " " };
        let what = match why_not {
            Some(why) => why.clone(),
            None => format!("{planned_points} CC points planned, {lost_points} lost, {faults} faults"),
        };
        let lost = left_out.first().filter(|_| *lost_points > 0).map_or_else(String::new, |first| {
            let [x, y, z] = first.first_place_mm;
            format!("; first at ({x:.2}, {y:.2}, {z:.2}): {}", first.reason)
        });
        format!("  {mark} planned again with {holder} at {stick_out_mm:.2} mm: {what}{lost}\n")
    }
}
