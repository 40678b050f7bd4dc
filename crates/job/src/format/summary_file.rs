//! Format of a plan's summary, `"format": "facemill-summary/1"`, for programs that start facemill.

use facemill_virtual_machine::WindUp;
use schemars::JsonSchema;
use serde::Serialize;

use crate::duration_text::clock;
use crate::format::incomplete::incomplete_because;
use crate::format::program_times::ProgramTimes;
use crate::format::report::efficiency::EfficiencyReport;
use crate::format::report::outcome::Outcome;
use crate::format::report::remaining::RemainingReport;
use crate::format::report::{CuspsKeptReport, InfeasibleReport, Report, Totals, Worst};

/// Value of the key `format` in a summary.
pub const SUMMARY_FORMAT: &str = "facemill-summary/1";

/// Outcome of a plan.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SummaryFile {
    /// Always `"facemill-summary/1"`.
    pub format: &'static str,
    /// Outcome; of several setups the worst, where limits that later programs keep are kept.
    pub outcome: Outcome,
    /// Exit code of the command.
    pub exit_code: u8,
    /// Reasons why all programs together do less than the job requires, in words; empty if they
    /// meet it.
    pub incomplete_because: Vec<String>,
    /// Output folder.
    pub out: String,
    /// Files in it.
    pub files: Vec<String>,
    /// The setups, in the order of the job.
    pub setups: Vec<SetupSummary>,
    /// Programs that change tools: one for each setup of the job file with several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joined_programs: Vec<JoinedProgramSummary>,
}

/// Program that changes tools, with the programs of all tools of a setup of the job file.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct JoinedProgramSummary {
    /// Name of the setup in the job file.
    pub setup: String,
    /// Its file; absent if it is not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Reason why it is not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_written_because: Option<String>,
    /// Machine time of all programs, s; tool changes are not counted.
    pub total_time_s: f64,
    /// Setups with nothing to cut, and no part in it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// The programs of the tools in it, in their order.
    pub sections: Vec<JoinedSectionSummary>,
}

/// Part of a program that changes tools.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct JoinedSectionSummary {
    /// Name of the setup with this tool, as in `setups`.
    pub setup: String,
    /// File of the program of this tool alone, whose blocks these are.
    pub program: String,
    /// Number of the tool.
    pub tool: u32,
    /// Line of the tool change.
    pub first_line: u32,
}

impl JoinedProgramSummary {
    /// Returns the lines of the summary for a reader.
    pub fn lines(&self) -> Vec<String> {
        let clock = clock(self.total_time_s);
        let changes = self.sections.windows(2).filter(|pair| pair[0].tool != pair[1].tool).count();
        let mut lines = vec![
            format!("{}: all tools", self.setup),
            format!("  machine time      {clock} in all programs, {changes} change(s) to another tool not counted"),
        ];
        match (&self.file, &self.not_written_because) {
            (Some(file), _) => {
                lines.push(format!("  one program       {file}"));
                let of =
                    |s: &JoinedSectionSummary| format!("    from line {:<8} T{}: {}", s.first_line, s.tool, s.program);
                lines.extend(self.sections.iter().map(of));
                let without = |name: &String| format!("    nothing to cut    {name}: verify with --without \"{name}\"");
                lines.extend(self.without.iter().map(without));
            }
            (None, why) => {
                lines.push(format!("  one program       not written: {}", why.as_deref().unwrap_or("unknown")));
            }
        }
        lines
    }
}

/// Outcome of a setup: its report without the lists of passes and findings.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SetupSummary {
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// Whether the program was run on the virtual machine after it was written.
    pub verified: bool,
    /// Sums over the program.
    pub totals: Totals,
    /// Time that it takes.
    pub times: ProgramTimes,
    /// Extreme values, each with its place.
    pub worst: Worst,
    /// Number of findings.
    pub findings: usize,
    /// Number of them that are faults.
    pub faults: usize,
    /// Number of assumptions.
    pub assumptions: usize,
    /// Reasons why the program by itself does less than the job requires, in words, also where
    /// later programs do the rest. With `faults` it must not be run at all.
    pub incomplete_because: Vec<String>,
    /// Material that the written program leaves on the regions of its operations; `null` if the
    /// setup has none.
    pub remaining: Option<RemainingReport>,
    /// Length of each operation's passes over the least that the cusp permits in their postures.
    pub efficiency: Vec<EfficiencyReport>,
    /// Whether each operation's passes keep the permitted cusp, and reasons if they do not.
    pub cusps: Vec<CuspsKeptReport>,
    /// How far each rotary axis without stops winds in the written program; empty if this was not
    /// verified.
    pub wind_up: Vec<WindUp>,
    /// CC points left out, by reason.
    pub infeasible: Vec<InfeasibleReport>,
}

impl SetupSummary {
    /// Returns the summary of a report.
    pub fn of(report: &Report) -> Self {
        Self {
            job: report.job.clone(),
            setup: report.setup.clone(),
            verified: report.verified,
            totals: report.totals.clone(),
            times: report.times.clone(),
            worst: report.worst.clone(),
            findings: report.findings.len(),
            faults: report.findings.iter().filter(|f| f.kind.is_fault()).count(),
            assumptions: report.assumptions.len(),
            incomplete_because: incomplete_because(report),
            remaining: report.remaining.clone(),
            efficiency: report.efficiency.clone(),
            cusps: report.cusps.clone(),
            wind_up: report.wind_up.clone(),
            infeasible: report.infeasible.clone(),
        }
    }
}
