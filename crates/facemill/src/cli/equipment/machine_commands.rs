//! Commands for machine files.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Subcommand;
use facemill::inverse_kinematics::Machine;
use facemill::inverse_kinematics::import::import_autodesk_machine;
use facemill::inverse_kinematics::machine_file::MachineFile;
use facemill::machines::{describe_heads, describe_hulls, read_machine};
use facemill::{Failure, files};

use crate::cli::equipment::machine_new::{self, NewMachineArguments};
use crate::cli::output::say;

#[derive(Subcommand)]
pub(crate) enum MachineCommand {
    /// Describes a machine's chain, axes, family, reach and assumed values, head by head, and tries
    /// poses there and back
    Check {
        /// Machine file
        file: PathBuf,
    },
    /// Writes the file of a machine of a common family from measured values, and says which values
    /// are defaults
    New(Box<NewMachineArguments>),
    /// Converts an Autodesk machine file to our format, on standard output or in a file
    Import {
        /// Autodesk machine file (XML)
        machine: PathBuf,
        /// Output file
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Write the lines of the axes in place of rows
        #[arg(long)]
        lines: bool,
    },
}

pub(crate) fn run(command: MachineCommand) -> Result<ExitCode, Failure> {
    match command {
        MachineCommand::Check { file } => check(&file),
        MachineCommand::New(arguments) => machine_new::run(&arguments),
        MachineCommand::Import { machine, out, lines } => import(&machine, out.as_deref(), lines),
    }
}

fn check(path: &Path) -> Result<ExitCode, Failure> {
    let read = read_machine(path)?;
    let checked = describe_heads(&read.heads).map_err(|e| Failure::input(path, e))?;
    let lines = chains_of_lines(path)?.into_iter().chain(checked.lines).chain(describe_hulls(&read.hulls));
    let lines: Vec<String> = lines.collect();
    say(&format!("{}\n", lines.join("\n")))?;
    match checked.fault {
        Some(fault) => Err(Failure::input(path, fault)),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// Returns a line that names the chains of a file that are given by lines, if there are any.
fn chains_of_lines(path: &Path) -> Result<Option<String>, Failure> {
    let file: MachineFile =
        facemill::file_format::from_json(&files::read(path)?).map_err(|e| Failure::input(path, e))?;
    let table = ("workpiece_chain".to_owned(), &file.workpiece_chain.lines);
    let heads = file.tool_chains.iter().enumerate().map(|(k, chain)| (format!("tool_chains[{k}]"), &chain.lines));
    let named = std::iter::once(table).chain(heads).filter_map(|(name, lines)| {
        let axes: Vec<&str> = lines.as_ref()?.axes.iter().map(|line| line.joint.axis()).collect();
        Some(if axes.is_empty() { name } else { format!("{name} ({})", axes.join(" ")) })
    });
    let named: Vec<String> = named.collect();
    let text = || format!("given by axis lines, from which the rows below are made: {}", named.join(", "));
    Ok((!named.is_empty()).then(text))
}

fn import(path: &Path, out: Option<&Path>, lines: bool) -> Result<ExitCode, Failure> {
    let text = String::from_utf8(files::read(path)?).map_err(|_| Failure::input(path, "is not text in UTF-8"))?;
    let file = import_autodesk_machine(&text).map_err(|e| Failure::input(path, e))?;
    let file = if lines { file.by_lines() } else { file };
    let json = facemill::file_format::to_json(&file);
    // Ensures that the output can be read and solved.
    let machine = Machine::from_file(file).map_err(|e| Failure::input(path, format!("the machine in it: {e}")))?;
    let Some(out) = out else {
        say(&json)?;
        return Ok(ExitCode::SUCCESS);
    };
    files::write_one(out, json.into_bytes())?;
    say(&format!("{}: {}\n", out.display(), machine.family()))?;
    say(&format!("it has no bodies, and some values are assumed; see: facemill machine check {}\n", out.display()))?;
    Ok(ExitCode::SUCCESS)
}
