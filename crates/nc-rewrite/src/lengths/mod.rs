//! The shortest tool assembly for a program that exists, or of a holder library, and postures that
//! let a shorter one pass.

mod holders;
mod stage;

use std::path::Path;

use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::load::job::{Job, Setup};
use facemill_job::stages::Stages;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_tool_model::{HolderLibrary, OpenAssembly, ToolFile};
use facemill_verification::stock_run::CutRequest;

use crate::lengths::stage::Stage;

pub use facemill_job::format::lengths_file::{
    HolderReport, LENGTHS_FORMAT, LengthName, LengthReport, LengthsFile, NoLength, Posting, ReplanTry,
};

/// How the lengths of a program's tool are looked at.
#[derive(Clone, Debug)]
pub struct LengthsRequest<'a> {
    /// What errors call the program.
    pub program: &'a Path,
    /// Control that it is for.
    pub dialect: Dialect,
    /// Index of the job's setup.
    pub setup: usize,
    /// What a length has above the least that is free, mm.
    pub margin: f64,
    /// Length that none goes beyond, mm.
    pub longest: f64,
    /// Cut the stock as the program goes, and hold the assembly against it as it then is.
    pub cut: Option<CutRequest>,
    /// Prove what every block does between its ends with what is returned.
    pub certificates: bool,
    /// Holders to choose from; without them the four lengths are open.
    pub holders: Option<&'a HolderLibrary>,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct FoundLengths {
    /// As it is written.
    pub file: LengthsFile,
    /// The tool with the lengths that were found, or in the holder that was chosen; `None` where
    /// none is free.
    pub tool: Option<ToolFile>,
    /// Name and content of the program that was planned again for it.
    pub replanned: Option<(String, Vec<u8>)>,
}

/// The shortest lengths L1 to L4 (VMT fig. 2) of the job's tool with which a program collides with
/// nothing and keeps a margin, with the block that forces each; with a library the holder whose
/// stick-out is the shortest that does.
///
/// What [`clear_lengths`](facemill_virtual_machine::clear_lengths) guarantees holds. What is
/// returned has besides been run by [`verify`](facemill_virtual_machine::verify), and where the
/// stock is cut by [`run_stock`](facemill_virtual_machine::run_stock), with the program as it is
/// posted for it: the file has all that they found.
///
/// # Errors
/// When a file of the job is wrong, the program is not understood, the machine has two heads or no
/// three linear axes that hold the tip, or the stages are cancelled.
pub fn lengths_of_program(
    job: &Job,
    text: &[u8],
    request: &LengthsRequest<'_>,
    stages: &dyn Stages,
) -> Result<FoundLengths, Failure> {
    if job.second.is_some() {
        return Err(job.wrong("lengths of machines with two heads are not looked for"));
    }
    for (what, value) in [("margin", request.margin), ("longest length", request.longest)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(job.wrong(format!("the {what} must be a length of at least 0 mm, is {value}")));
        }
    }
    let program: ReadProgram =
        job.read_program(text, request.dialect).map_err(|e| Failure::input(request.program, e))?;
    let setup = Setup::read(job, request.setup)?;
    let stage = Stage::new(job, &setup, (&program, ProgramStamp::new(request.program, text)), request, stages)?;
    let Some(library) = request.holders else {
        let open = OpenAssembly::open(&job.tool);
        let found = stage.lengths(&open, request.longest)?;
        return stage.lengths_report(&found, &open);
    };
    holders::choose(&stage, library)
}
