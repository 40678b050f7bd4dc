//! `facemill lengths`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::file_format::to_json;
use facemill::job_file::STOCK_TOLERANCE;
use facemill::lengths::{AlsoProgram, LengthsRequest, lengths_of_program};
use facemill::nc_program::{Dialect, read_program};
use facemill::tool_model::HolderLibrary;
use facemill::z_map::DexelMap;
use facemill::{CutRequest, Failure, Job, files, read_rest, replan_with_shorter_tools};

use crate::cli::arguments::called_files::expand_in_place;
use crate::cli::arguments::option_lengths::{above_zero, from_zero, stock_tolerance};
use crate::cli::arguments::program::{OtherProgram, ProgramArguments, ProgramOfJob};
use crate::cli::equipment::tool_files::is_tool_file;
use crate::cli::output::say;
use crate::cli::progress::Progress;

#[derive(Args)]
#[command(mut_arg("job", |argument| argument.required(true)))]
pub(crate) struct LengthsArguments {
    #[command(flatten)]
    program: ProgramArguments,
    /// Another program of the same tool, as the name or number of its setup and the file: the
    /// lengths suit all of them
    #[arg(long, value_name = "SETUP=FILE", conflicts_with_all = ["rest", "replan"])]
    also: Vec<String>,
    /// Tool whose programs are taken, where PROGRAM is the folder of a plan with several tools
    #[arg(long, value_name = "NAME", conflicts_with_all = ["also", "rest", "replan"])]
    tool: Option<String>,
    /// Margin of every forced length above the least free one
    #[arg(long, value_name = "MM", default_value_t = 0.5, allow_negative_numbers = true, value_parser = from_zero)]
    margin_mm: f64,
    /// Upper limit of all lengths
    #[arg(long, value_name = "MM", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = from_zero)]
    longest_mm: f64,
    /// Cut the stock on lines so far apart, and test the tool assembly against the stock of every
    /// moment
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    stock_cell_mm: Option<f64>,
    /// Tolerance of the cut stock
    #[arg(long, value_name = "MM", default_value_t = STOCK_TOLERANCE, allow_negative_numbers = true, value_parser = stock_tolerance)]
    stock_tolerance_mm: f64,
    /// Begin with the rest that another program left (facemill verify --rest-out) in place of the
    /// job's stock
    #[arg(long, value_name = "FILE", conflicts_with = "stock_cell_mm")]
    rest: Option<PathBuf>,
    /// Prove the motion of every block between its ends with the lengths found
    #[arg(long, conflicts_with = "replan")]
    certificates: bool,
    /// Holders to choose from: the one with the shortest stick-out that works is used, unchanged
    #[arg(long, value_name = "FILE")]
    holders: Option<PathBuf>,
    /// Plan the job again with shorter assemblies of the holders: tilting may let them pass
    #[arg(long, requires = "holders")]
    replan: bool,
    /// Output file for the results, as JSON
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Output file for the tool with these lengths, or in the chosen holder
    #[arg(long, value_name = "FILE")]
    tool_out: Option<PathBuf>,
    /// Output file for the program of the new plan
    #[arg(long, value_name = "FILE", requires = "replan")]
    program_out: Option<PathBuf>,
}

/// Returns the options on stock.
fn cut_of(arguments: &LengthsArguments, rest: Option<DexelMap>) -> Option<CutRequest> {
    let of = |cell: f64, rest: Option<DexelMap>| {
        let tolerance = arguments.stock_tolerance_mm;
        CutRequest { rest, ..CutRequest::on_lines(cell, tolerance) }
    };
    match rest {
        Some(rest) => Some(of(rest.grid().cell(), Some(rest))),
        None => arguments.stock_cell_mm.map(|cell| of(cell, None)),
    }
}

/// Programs of one tool, the first of the report first.
struct Programs {
    job: Job,
    dialect: Dialect,
    programs: Vec<OtherProgram>,
}

/// Reads the programs that the arguments name; each runs before the setups behind its own.
fn programs_of(arguments: &LengthsArguments) -> Result<Programs, Failure> {
    let named = &arguments.program;
    if named.program.is_dir() {
        if !arguments.also.is_empty() || arguments.rest.is_some() || arguments.replan {
            let why = "is a folder with all programs of the tool: leave out --also, --rest and --replan";
            return Err(Failure::input(&named.program, why));
        }
        let (job, dialect, programs) = named.read_plan(arguments.tool.as_deref())?;
        say_called(&programs)?;
        return Ok(Programs { job, dialect, programs });
    }
    if arguments.tool.is_some() {
        return Err(Failure::input(&named.program, "is one program: --tool chooses those of a plan's folder"));
    }
    let mut read = named.read()?.of_one_tool()?;
    let called = expand_in_place(&mut read, &named.program)?;
    let ProgramOfJob { mut job, setup, dialect, text, .. } = read;
    let mut programs = vec![OtherProgram { setup, path: named.program.clone(), text, called }];
    for also in &arguments.also {
        programs.push(named.other_program(&job, "also", also)?);
    }
    say_called(&programs[1..])?;
    if programs.len() > 1 {
        for program in &programs {
            job.programs.add(program.setup, Some((program.path.clone(), program.text.clone())), dialect);
        }
    }
    Ok(Programs { job, dialect, programs })
}

/// Prints where the lines of called files begin.
fn say_called(programs: &[OtherProgram]) -> Result<(), Failure> {
    programs.iter().filter_map(|program| program.called.as_ref()).try_for_each(|called| say(&called.summary_line()))
}

pub(crate) fn run(arguments: &LengthsArguments) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let library = match &arguments.holders {
        Some(path) => Some(HolderLibrary::from_json(&files::read(path)?).map_err(|e| Failure::input(path, e))?),
        None => None,
    };
    let Programs { job, dialect, programs } = programs_of(arguments)?;
    let first = &programs[0];
    let rest = arguments.rest.as_ref().map(|path| read_rest(&job, first.setup, path)).transpose()?;
    let also = programs[1..].iter().map(|p| AlsoProgram { program: &p.path, text: &p.text, setup: p.setup });
    let request = LengthsRequest {
        program: &first.path,
        dialect,
        setup: first.setup,
        margin: arguments.margin_mm,
        longest: arguments.longest_mm,
        cut: cut_of(arguments, rest),
        certificates: arguments.certificates,
        holders: library.as_ref(),
        also: also.collect(),
    };
    let outputs = [&arguments.out, &arguments.tool_out, &arguments.program_out];
    files::check_outputs(outputs.into_iter().flatten().map(PathBuf::as_path))?;
    look_at_earlier(arguments, dialect)?;
    let mut found = lengths_of_program(&job, &first.text, &request, &Progress::new(false))?;
    for (k, called) in programs.iter().enumerate().filter_map(|(k, p)| Some((k, p.called.as_ref()?))) {
        found.file.map_lines(k, |line| called.written(line));
        let (stamp, files) = (called.stamp(), called.called_files());
        match k.checked_sub(1) {
            None => (found.file.program, found.file.called_files) = (stamp, files),
            Some(k) => (found.file.others[k].program, found.file.others[k].called_files) = (stamp, files),
        }
    }
    if let (true, Some(library)) = (arguments.replan, &library) {
        replan_with_shorter_tools(&job, first.setup, library, &mut found, &Progress::new(false))?;
    }
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    let mut outputs: Vec<(&Path, Vec<u8>)> = Vec::new();
    outputs.extend(arguments.out.iter().map(|out| (out.as_path(), to_json(&found.file).into_bytes())));
    outputs.extend(
        arguments.tool_out.iter().zip(&found.tool).map(|(out, tool)| (out.as_path(), to_json(tool).into_bytes())),
    );
    let program = arguments.program_out.iter().zip(&found.replanned);
    outputs.extend(program.map(|(out, (_, text))| (out.as_path(), text.clone())));
    files::write_each(&outputs)?;
    let why_no_program =
        if found.tool.is_some() { "no shorter assembly passes with other postures" } else { NOTHING_WORKS };
    let missing = [
        (&arguments.tool_out, found.tool.is_none(), NOTHING_WORKS),
        (&arguments.program_out, found.replanned.is_none(), why_no_program),
    ];
    let missing = missing.into_iter().filter(|(_, is_missing, _)| *is_missing);
    let notes: Result<Vec<String>, Failure> =
        missing.filter_map(|(out, _, why)| Some(leave_out(out.as_deref()?, why))).collect();
    let notes = notes?;
    say(&found.file.table())?;
    notes.iter().for_each(|line| eprintln!("facemill: {line}"));
    let clean = found.tool.is_some() && found.file.is_clean();
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

const NOTHING_WORKS: &str = "no tool works";

/// Refuses outputs whose files exist but are not from an earlier run: they would be overwritten, or
/// removed if no length is found.
fn look_at_earlier(arguments: &LengthsArguments, dialect: Dialect) -> Result<(), Failure> {
    let is_program = |text: &[u8]| read_program(text, dialect).is_ok();
    refuse_other(arguments.tool_out.as_deref(), "tool file (\"format\": \"facemill-tool/1\")", is_tool_file)?;
    refuse_other(arguments.program_out.as_deref(), "program of this control", is_program)
}

/// Refuses an existing file that is not `what` it should be; an empty one counts as missing.
fn refuse_other(out: Option<&Path>, what: &str, is_ours: impl Fn(&[u8]) -> bool) -> Result<(), Failure> {
    // The write reports an unreadable file. The file is inspected for replacement: it is no input.
    let read = |out: &Path| out.metadata().is_ok_and(|m| m.is_file()).then(|| std::fs::read(out).ok()).flatten();
    let Some((out, bytes)) = out.and_then(|out| Some((out, read(out)?))) else { return Ok(()) };
    if bytes.is_empty() || is_ours(&bytes) {
        return Ok(());
    }
    let message =
        format!("exists and is not a {what}, so it is not from an earlier run: name another file, or remove it");
    Err(Failure::input(out, message))
}

/// Removes the output of an earlier run under the name of a file that is not written, and says so.
fn leave_out(out: &Path, why: &str) -> Result<String, Failure> {
    let removed = if files::remove_earlier(out)? { "; the file of an earlier run was removed" } else { "" };
    Ok(format!("{why}: {} is not written{removed}", out.display()))
}
