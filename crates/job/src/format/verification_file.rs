//! File of a verification.

use facemill_virtual_machine::{Assumption, Certificates, Verification};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::program_stamp::ProgramStamp;
use crate::format::program_times::ProgramTimes;
use crate::format::report::deviation::DeviationReport;
use crate::format::report::efficiency::EfficiencyReport;
use crate::format::report::remaining::RemainingReport;
use crate::format::report::stock::StockReport;

/// Value of the key `format` in the file of a verification.
pub const VERIFICATION_FORMAT: &str = "facemill-verification/1";

/// Behaviour of a program on a job's setup, according to its text.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VerificationFile {
    /// Always `"facemill-verification/1"`.
    pub format: &'static str,
    /// Name of the job; of a part without a job that of the part.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// The program described.
    pub program: ProgramStamp,
    /// Files of subprograms whose calls were expanded, in the order of their first calls; empty
    /// without. Lines count on from file to file, the program first: each says where it begins.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub called_files: Vec<CalledFile>,
    /// Control that the program was read for.
    pub dialect: String,
    /// Depth of the cutter beyond which it is a finding (`--gouge-mm`); without the option the
    /// smallest that an operation of the setup allows, 0.02 without a job.
    pub gouge_limit_mm: f64,
    /// Time that it takes, as a plan reports it.
    pub times: ProgramTimes,
    /// Results of the run.
    #[serde(flatten)]
    pub verification: Verification,
    /// Assumptions of the run for want of words in the program or options on the command line, the
    /// limit for feeds if cuts cannot be distinguished from other feed moves, and a note if the
    /// program reaches no stock.
    pub assumptions: Vec<Assumption>,
    /// Material that the program leaves on the regions of the setup's operations; absent if no
    /// operation is known, and from an estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining: Option<RemainingReport>,
    /// Length of the passes on each operation's region over the least that the cusp permits in
    /// their postures (docs/method.md#efficiency). Passes are the cutting blocks at whose ends the
    /// cutter touches the region; empty from an estimate.
    pub efficiency: Vec<EfficiencyReport>,
    /// Result of cutting; absent if the stock was not cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock: Option<StockReport>,
    /// Deviation of the cut stock from the part; absent if not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<DeviationReport>,
    /// Proofs for each block; absent if not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificates: Option<Certificates>,
}

/// File of subprograms that a program calls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CalledFile {
    /// Its name and checksum.
    #[serde(flatten)]
    pub program: ProgramStamp,
    /// Number that its first line has in this file.
    pub first_line: u32,
}

impl VerificationFile {
    /// Replaces every line, for a program that was run with its calls expanded.
    pub fn map_lines(&mut self, line_of: impl Fn(u32) -> u32) {
        let map = |line: &mut u32| *line = line_of(*line);
        let run = &mut self.verification;
        run.findings.iter_mut().flat_map(|f| [&mut f.first_line, &mut f.last_line, &mut f.worst_line]).for_each(map);
        let sections = run.sections.iter_mut();
        let of_sections =
            sections.flat_map(|s| [Some(&mut s.first_line), s.largest_gouge.as_mut().map(|g| &mut g.line)]);
        of_sections.flatten().for_each(map);
        run.largest_gouge.iter_mut().map(|g| &mut g.line).for_each(map);
        run.smallest_clearance.iter_mut().map(|c| &mut c.line).for_each(map);
        run.between.iter_mut().filter_map(|b| b.first_open_line.as_mut()).for_each(map);
        self.assumptions.iter_mut().filter_map(|a| a.line.as_mut()).for_each(map);
        let regions = self.remaining.iter_mut().flat_map(|r| &mut r.operations);
        regions.filter_map(|o| o.largest.as_mut()?.line.as_mut()).for_each(map);
        self.stock.iter_mut().filter_map(|s| s.first_line_not_covered.as_mut()).for_each(map);
        let proofs = self.certificates.iter_mut().flat_map(|c| &mut c.certificates);
        proofs.flat_map(|c| [Some(&mut c.line), c.doubted_since_line.as_mut()]).flatten().for_each(map);
    }
}
