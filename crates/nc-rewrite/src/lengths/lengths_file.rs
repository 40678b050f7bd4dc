//! Report on lengths.

use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::report::InfeasibleReport;
use facemill_job::format::verification_file::CalledFile;
use facemill_tool_model::AssemblyLength;
use facemill_virtual_machine::{Certificates, Finding, ForcedBy};
use schemars::JsonSchema;
use serde::Serialize;

/// Value of the key `format` in the file.
pub const LENGTHS_FORMAT: &str = "facemill-lengths/1";

/// Lengths that a program needs.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LengthsFile {
    /// Always "facemill-lengths/1".
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// The program that was run; lengths with which the job was planned again belong to another
    /// one.
    pub program: ProgramStamp,
    /// Files of subprograms whose calls were expanded, in the order of their first calls; empty
    /// without. Lines count on from file to file, the program first: each says where it begins.
    pub called_files: Vec<CalledFile>,
    /// Other programs of the tool that the lengths suit, in the order of the request; empty
    /// without.
    pub others: Vec<OtherLengthsProgram>,
    /// BLAKE3 checksum of the program of the new plan; absent if the job was not planned again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replanned_blake3: Option<String>,
    /// Control that the program was read for.
    pub dialect: String,
    /// Name of the tool.
    pub tool: String,
    /// Margin of a forced length above the least free one.
    pub margin_mm: f64,
    /// Distance of the lines of the stock; absent if it was not cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
    /// Effect of the new length on the program's words.
    pub posting: Posting,
    /// L1 to L4; without L3 if the holder has one section.
    pub lengths: Vec<LengthReport>,
    /// The length that is free with no value up to the longest; absent if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub none_is_free: Option<NoLength>,
    /// Name of the chosen holder; absent without a library, and if none of its holders works.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub holder: Option<String>,
    /// Every holder of the library, in its order; empty without one.
    pub holders: Vec<HolderReport>,
    /// Shorter assemblies with which the job was planned again, in the order of the tries; empty if
    /// that was not requested.
    pub replans: Vec<ReplanTry>,
    /// All findings of the ordinary run with these lengths, or with the chosen holder.
    pub findings: Vec<Finding>,
    /// Proofs for each block with these lengths; absent if not requested, or if no length is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificates: Option<Certificates>,
}

/// Another program of the tool, run with the lengths found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct OtherLengthsProgram {
    /// Name of its setup.
    pub setup: String,
    /// The program that was run.
    pub program: ProgramStamp,
    /// Files of subprograms whose calls were expanded, as those of the first program.
    pub called_files: Vec<CalledFile>,
    /// Effect of the new length on its words.
    pub posting: Posting,
    /// All findings of the ordinary run with these lengths, or with the chosen holder.
    pub findings: Vec<Finding>,
    /// Proofs for each block with these lengths; absent if not requested, or if no length is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificates: Option<Certificates>,
}

/// Effect of another tool length on a program's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Posting {
    /// They stay: the control adds the length from the tool's register.
    AsItIs,
    /// The head turns, and the words include the length: the program must be posted again.
    Again,
}

impl Posting {
    fn text(self) -> &'static str {
        match self {
            Self::AsItIs => "as it is, with the new length in the tool's register",
            Self::Again => "to be posted again: the head turns",
        }
    }
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
    /// Returns the name of a length of the assembly.
    pub fn of(length: AssemblyLength) -> Self {
        [Self::L1, Self::L2, Self::L3, Self::L4][length.index()]
    }

    /// Returns its meaning in words.
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
    /// Name of the length.
    pub name: LengthName,
    /// Its meaning in words.
    pub meaning: &'static str,
    /// Length of the job's tool.
    pub now_mm: f64,
    /// Shortest length, with the margin if it is forced.
    pub length_mm: f64,
    /// Setup whose program forces it, where that is one of `others`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// Place that forces it; absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forced_by: Option<ForcedBy>,
    /// Reason why it is not shorter, if no place forces it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rests_on: Option<&'static str>,
}

/// A length that is free with no value up to the longest.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NoLength {
    /// Name of the length.
    pub name: LengthName,
    /// Longest permitted length.
    pub longest_mm: f64,
    /// Setup whose program it is blocked in, where that is one of `others`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// Place that blocks it.
    pub by: ForcedBy,
}

/// A holder of the library.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HolderReport {
    /// Its name.
    pub name: String,
    /// Shortest stick-out that works; absent if none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick_out_mm: Option<f64>,
    /// Setup whose program `forced_by` or `finding` is of, where that is one of `others`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// Place that forces it; absent if it is the holder's shortest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forced_by: Option<ForcedBy>,
    /// Finding of the run with the stick-out of `why_not`, if that is why it does not work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finding: Option<Finding>,
    /// Reason why it does not work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

/// Largest number of findings in the table; the file has them all.
const TOLD: usize = 30;

impl LengthsFile {
    /// Replaces every line of a program, 0 for the first and from 1 on for `others`, for one that
    /// was run with its calls expanded.
    pub fn map_lines(&mut self, program: usize, line_of: impl Fn(u32) -> u32) {
        let map = |line: &mut u32| *line = line_of(*line);
        let named = program.checked_sub(1).map(|k| self.others[k].setup.clone());
        let of_lengths = self.lengths.iter_mut().filter(|length| length.setup == named);
        let of_lengths = of_lengths.filter_map(|length| length.forced_by.as_mut());
        let none = self.none_is_free.iter_mut().filter(|none| none.setup == named).map(|none| &mut none.by);
        let holders = self.holders.iter_mut().filter(|holder| holder.setup == named);
        let (by, mut findings): (Vec<_>, Vec<_>) =
            holders.map(|holder| (holder.forced_by.as_mut(), holder.finding.as_mut())).unzip();
        of_lengths.chain(none).chain(by.into_iter().flatten()).map(|by| &mut by.line).for_each(map);
        let (own, certificates) = match program.checked_sub(1).map(|k| &mut self.others[k]) {
            None => (&mut self.findings, &mut self.certificates),
            Some(other) => (&mut other.findings, &mut other.certificates),
        };
        let findings = own.iter_mut().chain(findings.iter_mut().flatten().map(|finding| &mut **finding));
        findings.flat_map(|f| [&mut f.first_line, &mut f.last_line, &mut f.worst_line]).for_each(map);
        let proofs = certificates.iter_mut().flat_map(|c| &mut c.certificates);
        proofs.flat_map(|c| [Some(&mut c.line), c.doubted_since_line.as_mut()]).flatten().for_each(map);
    }

    /// Returns whether a tool works, and no program has a fault with it.
    pub fn is_clean(&self) -> bool {
        let of_others = self.others.iter().flat_map(|other| &other.findings);
        self.none_is_free.is_none() && !self.findings.iter().chain(of_others).any(|f| f.kind.is_fault())
    }

    /// Returns the file as a table to read.
    #[must_use]
    pub fn table(&self) -> String {
        let posting = self.posting.text();
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
                place(none.setup.as_deref(), &none.by)
            ));
        }
        out.push_str(&run_lines(self.certificates.as_ref(), &self.findings));
        for other in self.others.iter().filter(|_| self.none_is_free.is_none()) {
            out.push_str(&format!("{}\n", other.setup));
            if other.posting != self.posting {
                out.push_str(&format!("  program           {}\n", other.posting.text()));
            }
            out.push_str(&run_lines(other.certificates.as_ref(), &other.findings));
        }
        out
    }
}

/// Returns the lines on a program's run with the lengths found.
fn run_lines(certificates: Option<&Certificates>, findings: &[Finding]) -> String {
    let mut out = String::new();
    if let Some(c) = certificates {
        out.push_str(&format!("  certified blocks  {} of {}\n", c.certified, c.blocks));
    }
    out.push_str(&format!("  findings          {}\n", findings.len()));
    out.extend(findings.iter().take(TOLD).map(|f| format!("    {f}\n")));
    if findings.len() > TOLD {
        out.push_str(&format!("    and {} more; --out writes them all\n", findings.len() - TOLD));
    }
    out
}

fn length_line(length: &LengthReport) -> String {
    let LengthReport { name, meaning, now_mm, length_mm, setup, forced_by, rests_on } = length;
    let why = match (forced_by, rests_on) {
        (Some(by), _) => place(setup.as_deref(), by),
        (None, Some(on)) => format!("not forced: rests on {on}"),
        (None, None) => "not forced".to_owned(),
    };
    format!("  {name:?} {now_mm:>9.2} {length_mm:>12.2}  {meaning}; {why}\n")
}

fn holder_line(holder: &HolderReport, is_chosen: bool) -> String {
    let mark = if is_chosen { "*" } else { " " };
    let what = match (&holder.stick_out_mm, &holder.forced_by, &holder.why_not) {
        (_, by, Some(why)) => match (&holder.finding, by) {
            (Some(finding), _) => {
                let of = holder.setup.as_ref().map_or_else(String::new, |setup| format!("{setup}, "));
                format!("{why}: {of}{finding}")
            }
            (None, Some(by)) => format!("{why}; {}", place(holder.setup.as_deref(), by)),
            (None, None) => why.clone(),
        },
        (Some(at), Some(by), _) => format!("stick-out {at:.2} mm, {}", place(holder.setup.as_deref(), by)),
        (Some(at), None, _) => format!("stick-out {at:.2} mm, its shortest"),
        (None, ..) => String::new(),
    };
    format!("  {mark} {}: {what}\n", holder.name)
}

fn place(setup: Option<&str>, by: &ForcedBy) -> String {
    let [x, y, z] = by.place_work_mm;
    let of = setup.map_or_else(String::new, |setup| format!("{setup}, "));
    format!("{of}line {} ({}): {} and {} at ({x:.2}, {y:.2}, {z:.2})", by.line, by.block_text, by.body, by.obstacle)
}

/// A shorter assembly with which the job was planned again.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ReplanTry {
    /// Name of the holder.
    pub holder: String,
    /// Stick-out of the plan.
    pub stick_out_mm: f64,
    /// CC points with a pose in its program.
    pub planned_points: usize,
    /// Number of CC points fewer than with the assembly that works with the unchanged program.
    pub lost_points: usize,
    /// All points that its plan leaves out, by reason, with the first place of each.
    pub left_out: Vec<InfeasibleReport>,
    /// Number of faults found in its program.
    pub faults: usize,
    /// Whether it was chosen.
    pub taken: bool,
    /// Reason why it could not be planned at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

impl ReplanTry {
    /// Returns a line to read.
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
