//! Commands for machine files.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Subcommand;
use facemill::inverse_kinematics::Machine;
use facemill::inverse_kinematics::import::import_autodesk_machine;
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
    },
}

pub(crate) fn run(command: MachineCommand) -> Result<ExitCode, Failure> {
    match command {
        MachineCommand::Check { file } => check(&file),
        MachineCommand::New(arguments) => machine_new::run(&arguments),
        MachineCommand::Import { machine, out } => import(&machine, out.as_deref()),
    }
}

fn check(path: &Path) -> Result<ExitCode, Failure> {
    let read = read_machine(path)?;
    let checked = describe_heads(&read.heads).map_err(|e| Failure::input(path, e))?;
    let lines: Vec<String> = checked.lines.into_iter().chain(describe_hulls(&read.hulls)).collect();
    say(&format!("{}\n", lines.join("\n")))?;
    match checked.fault {
        Some(fault) => Err(Failure::input(path, fault)),
        None => Ok(ExitCode::SUCCESS),
    }
}

fn import(path: &Path, out: Option<&Path>) -> Result<ExitCode, Failure> {
    let text = String::from_utf8(files::read(path)?).map_err(|_| Failure::input(path, "is not text in UTF-8"))?;
    let file = import_autodesk_machine(&text).map_err(|e| Failure::input(path, e))?;
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
