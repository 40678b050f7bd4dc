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
