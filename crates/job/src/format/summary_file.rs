//! Format of a plan's summary, `"format": "facemill-summary/1"`, for programs that start facemill.

use facemill_virtual_machine::WindUp;
use schemars::JsonSchema;
use serde::Serialize;

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
    /// Outcome; of several setups the worst.
    pub outcome: Outcome,
    /// Exit code of the command.
    pub exit_code: u8,
    /// Output folder.
    pub out: String,
    /// Files in it.
    pub files: Vec<String>,
    /// The setups, in the order of the job.
    pub setups: Vec<SetupSummary>,
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
    /// Reasons why the program does less than the job requires, in words; empty if it meets the
    /// job. With `faults` it must not be run at all.
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
