//! Shortest tool assembly for an existing program, or of a holder library, and postures that let a
//! shorter one pass.

mod holders;
mod lengths_file;
mod lengths_run;

use std::path::Path;

use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::load::job::{Job, Setup};
use facemill_job::stages::Stages;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_tool_model::{HolderLibrary, OpenAssembly, ToolFile};
use facemill_verification::stock_run::CutRequest;

use crate::lengths::lengths_run::LengthsRun;

pub use crate::lengths::lengths_file::{
    HolderReport, LENGTHS_FORMAT, LengthName, LengthReport, LengthsFile, NoLength, Posting, ReplanTry,
};

/// Options of the search for lengths of a program's tool.
#[derive(Clone, Debug)]
pub struct LengthsRequest<'a> {
    /// Name of the program in errors.
    pub program: &'a Path,
    /// Control that it is for.
    pub dialect: Dialect,
    /// Index of the job's setup.
    pub setup: usize,
    /// Margin of a length above the least free one, mm.
    pub margin: f64,
    /// Upper limit of every length, mm.
    pub longest: f64,
    /// Cut the stock as the program goes, and test the assembly against it as it then is.
    pub cut: Option<CutRequest>,
    /// Prove the motion of every block between its ends with the resulting lengths.
    pub certificates: bool,
    /// Holders to choose from; without them the four lengths are open.
    pub holders: Option<&'a HolderLibrary>,
}

/// Result of the search for lengths.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FoundLengths {
    /// Content of the file.
    pub file: LengthsFile,
    /// The tool with the lengths found, or in the chosen holder; `None` if none is free.
    pub tool: Option<ToolFile>,
    /// Name and content of the program that was planned again for it.
    pub replanned: Option<(String, Vec<u8>)>,
}

/// Finds the shortest lengths L1 to L4 (VMT fig. 2) of the job's tool with which a program has no
/// collision and keeps a margin, with the block that forces each; with a library, the holder with
/// the shortest stick-out that does so.
///
/// Guarantees the same as [`clear_lengths`](facemill_virtual_machine::clear_lengths). In addition,
/// the result has been run by [`verify`](facemill_virtual_machine::verify), and if the stock is cut
/// by [`run_stock`](facemill_virtual_machine::run_stock), with the program as posted for it: the
/// file has all their findings.
///
/// # Errors
/// If a file of the job is wrong, the program is not understood, the machine has two heads or lacks
/// three linear axes that hold the tip, or the stages are cancelled.
pub fn lengths_of_program(
    job: &Job,
    text: &[u8],
    request: &LengthsRequest<'_>,
    stages: &dyn Stages,
) -> Result<FoundLengths, Failure> {
    if job.second.is_some() {
        return Err(job.wrong("lengths for machines with two heads are not supported"));
    }
    for (what, value) in [("margin", request.margin), ("longest length", request.longest)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(job.wrong(format!("the {what} must be a length of at least 0 mm, is {value}")));
        }
    }
    let job = &job.for_setup(request.setup);
    let program: ReadProgram =
        job.read_program(text, request.dialect).map_err(|e| Failure::input(request.program, e))?;
    let setup = Setup::read(job, request.setup)?;
    let run = LengthsRun::new(job, &setup, (&program, ProgramStamp::new(request.program, text)), request, stages)?;
    let Some(library) = request.holders else {
        let open = OpenAssembly::open(&job.tool);
        let found = run.lengths(&open, request.longest)?;
        return run.lengths_report(&found, &open);
    };
    holders::choose(&run, library)
}
