//! `facemill rapids`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::called_program::CalledProgram;
use facemill::job_file::STOCK_TOLERANCE;
use facemill::rapids::{RapidsRequest, faster_rapids};
use facemill::z_map::DexelMap;
use facemill::{CutRequest, Failure, files, read_rest};

use crate::cli::arguments::called_files::{CALLS_IN_PLACE, expand_in_place};
use crate::cli::arguments::option_lengths::{above_zero, from_zero, stock_tolerance};
use crate::cli::arguments::program::{ProgramArguments, ProgramOfJob};
use crate::cli::output::say;
use crate::cli::progress::Progress;

#[derive(Args)]
#[command(mut_arg("job", |argument| argument.required(true)))]
pub(crate) struct RapidsArguments {
    #[command(flatten)]
    program: ProgramArguments,
    /// Depth of the cutter that is a finding; default: the smallest that the setup's operations
    /// permit
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = from_zero)]
    gouge_mm: Option<f64>,
    /// Cut the stock on lines so far apart
    #[arg(long, value_name = "MM", default_value_t = 1.0, allow_negative_numbers = true, value_parser = above_zero)]
    stock_cell_mm: f64,
    /// Tolerance of the cut stock
    #[arg(long, value_name = "MM", default_value_t = STOCK_TOLERANCE, allow_negative_numbers = true, value_parser = stock_tolerance)]
    stock_tolerance_mm: f64,
    /// Begin with the rest that another program left (facemill verify --rest-out) in place of the
    /// job's stock
    #[arg(long, value_name = "FILE", conflicts_with = "stock_cell_mm")]
    rest: Option<PathBuf>,
    /// Distance to keep from stock and fixtures; default: the setup's for rapids
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = from_zero)]
    clearance_mm: Option<f64>,
    /// Output file for the program
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Output file for the times of all links, as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// Returns the options on stock.
fn cut_of(arguments: &RapidsArguments, rest: Option<DexelMap>) -> CutRequest {
    let cell = rest.as_ref().map_or(arguments.stock_cell_mm, |rest| rest.grid().cell());
    let tolerance = arguments.stock_tolerance_mm;
    CutRequest { rest, ..CutRequest::on_lines(cell, tolerance) }
}

pub(crate) fn run(arguments: &RapidsArguments) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let program = &arguments.program.program;
    let mut read = arguments.program.read()?.of_one_tool()?;
    let called = expand_in_place(&mut read, program)?;
    let ProgramOfJob { job, setup, dialect, mut text, .. } = read;
    if called.is_some() {
        text = CalledProgram::numbered(text, dialect);
    }
    let rest = arguments.rest.as_ref().map(|path| read_rest(&job, setup, path)).transpose()?;
    let request = RapidsRequest {
        program,
        dialect,
        setup,
        gouge_limit: arguments.gouge_mm,
        cut: cut_of(arguments, rest),
        clearance: arguments.clearance_mm,
    };
    files::check_outputs([&arguments.out].into_iter().chain(&arguments.report).map(PathBuf::as_path))?;
    let mut made = faster_rapids(&job, &text, &request, &Progress::new(false))?;
    if let Some(called) = &called {
        made.file.map_lines(|line| called.written(line));
        made.file.program = called.stamp();
        made.file.called_files = called.called_files();
    }
    let clean = made.verification.verification.faults().next().is_none();
    let mut outputs: Vec<(&Path, Vec<u8>)> = vec![(&arguments.out, made.text)];
    if let Some(report) = &arguments.report {
        outputs.push((report, facemill::file_format::to_json(&made.file).into_bytes()));
    }
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_each(&outputs)?;
    say(&made.file.table())?;
    if called.is_some() {
        say(CALLS_IN_PLACE)?;
    }
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
