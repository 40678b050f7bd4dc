//! File of a verification.

use facemill_virtual_machine::{Assumption, Certificates, Verification};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::program_stamp::ProgramStamp;
use crate::format::program_times::ProgramTimes;
use crate::format::report::deviation::DeviationReport;
use crate::format::report::remaining::RemainingReport;
use crate::format::report::stock::StockReport;

/// Value of the key `format` in the file of a verification.
pub const VERIFICATION_FORMAT: &str = "facemill-verification/1";

/// What a program does on a job's setup, as it is written.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct VerificationFile {
    /// Always "facemill-verification/1".
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// The program that this speaks of.
    pub program: ProgramStamp,
    /// Control that the program was read for.
    pub dialect: String,
    /// Depth of the cutter beyond which it is a finding, mm.
    pub gouge_limit_mm: f64,
    /// How long it takes, as a plan tells it.
    pub times: ProgramTimes,
    /// What the run showed.
    #[serde(flatten)]
    pub verification: Verification,
    /// What the run rests on because neither the program nor the command line says it, what its
    /// feeds are held against where cuts are not told from other feed moves, and that the program
    /// reaches no stock.
    pub assumptions: Vec<Assumption>,
    /// Material that the program leaves on the regions of the setup's operations; absent where no
    /// operation is known, and of an estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining: Option<RemainingReport>,
    /// What was cut; absent where the stock was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock: Option<StockReport>,
    /// How far the cut stock is from the part; absent where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<DeviationReport>,
    /// What is proven of each block; absent where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificates: Option<Certificates>,
}
