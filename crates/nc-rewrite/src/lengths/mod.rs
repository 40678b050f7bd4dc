//! Shortest tool assembly for an existing program, or of a holder library, and postures that let a
//! shorter one pass.

mod holders;
mod joint;
mod lengths_file;
mod lengths_run;

use std::path::Path;

use facemill_cl_data::Silent;
use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::load::job::{Job, Setup};
use facemill_job::stages::Stages;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_tool_model::{HolderLibrary, OpenAssembly, ToolFile};
use facemill_verification::stock_run::CutRequest;

use crate::lengths::joint::Joint;
use crate::lengths::lengths_run::LengthsRun;

pub use crate::lengths::lengths_file::{
    HolderReport, LENGTHS_FORMAT, LengthName, LengthReport, LengthsFile, NoLength, OtherLengthsProgram, Posting,
    ReplanTry,
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
    /// Other programs of the same tool; the lengths suit all of them.
    pub also: Vec<AlsoProgram<'a>>,
}

/// Another program that the tool of a search for lengths runs.
#[derive(Clone, Copy, Debug)]
pub struct AlsoProgram<'a> {
    /// Its name in errors.
    pub program: &'a Path,
    /// Its text.
    pub text: &'a [u8],
    /// Index of its setup in the job: another one than those of the other programs.
    pub setup: usize,
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
/// Each program begins with the stock of its setup, as the known programs before it leave it
/// ([`Job::programs`]). With other programs of the tool, the lengths are the least with which all
/// of them have no collision, and the margin: each program is searched from the lengths that the
/// others need, until none needs more, first without the margin and then with it.
///
/// # Errors
/// If a file of the job is wrong, a program is not understood, programs are of one setup or of
/// different tools, the machine has two heads or lacks three linear axes that hold the tip, or the
/// stages are cancelled.
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
    let first = AlsoProgram { program: request.program, text, setup: request.setup };
    let all: Vec<AlsoProgram<'_>> = std::iter::once(first).chain(request.also.iter().copied()).collect();
    let views: Vec<Job> = all.iter().map(|at| job.for_setup(at.setup)).collect();
    check_programs(job, &all, &views)?;
    let _shared = job.share_meshes();
    let read = |(at, view): (&AlsoProgram<'_>, &Job)| -> Result<ReadProgram, Failure> {
        view.read_program(at.text, request.dialect).map_err(|e| Failure::input(at.program, e))
    };
    let programs = all.iter().zip(&views).map(read).collect::<Result<Vec<_>, _>>()?;
    let mut setups = Vec::new();
    for (at, view) in all.iter().zip(&views) {
        setups.push(Setup::read(view, at.setup)?.after_programs(view, &Silent)?);
    }
    let mut runs = Vec::new();
    for (((at, view), setup), program) in all.iter().zip(&views).zip(&setups).zip(&programs) {
        let stamp = ProgramStamp::new(at.program, at.text);
        runs.push(LengthsRun::new((view, setup, at), (program, stamp), request, stages)?);
    }
    let runs = Joint { runs: &runs };
    let Some(library) = request.holders else {
        let open = OpenAssembly::open(&views[0].tool);
        let found = runs.lengths(&open, request.longest)?;
        return runs.report(&found, &open);
    };
    holders::choose(&runs, library)
}

/// Refuses programs of one setup, or of different tools.
fn check_programs(job: &Job, all: &[AlsoProgram<'_>], views: &[Job]) -> Result<(), Failure> {
    for (k, (at, view)) in all.iter().zip(views).enumerate() {
        let name = &job.file.setups[at.setup].name;
        if all[..k].iter().any(|other| other.setup == at.setup) {
            return Err(job.wrong(format!("setup \"{name}\" has two programs; give one")));
        }
        if view.tool.to_file() != views[0].tool.to_file() {
            let (own, first) = (view.tool.name(), views[0].tool.name());
            return Err(
                job.wrong(format!("setup \"{name}\" has the tool \"{own}\", not \"{first}\" as the first program"))
            );
        }
    }
    Ok(())
}
