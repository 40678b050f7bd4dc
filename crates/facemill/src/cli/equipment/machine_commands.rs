//! Commands for machine files.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};
use facemill::drawing::machine_svg::machine_svg;
use facemill::inverse_kinematics::Machine;
use facemill::inverse_kinematics::import::import_autodesk_machine;
use facemill::inverse_kinematics::machine_file::MachineFile;
use facemill::inverse_kinematics::measured::{Readings, TouchCheck, TouchError, Touches, check_touches};
use facemill::machines::{describe_heads, describe_hulls, read_machine};
use facemill::{Failure, files};

use crate::cli::equipment::machine_new::{self, NewMachineArguments, finite, numbers};
use crate::cli::output::say;

#[derive(Subcommand)]
pub(crate) enum MachineCommand {
    /// Describes a machine's chain, axes, family, reach and assumed values, head by head, tries
    /// poses there and back, and compares the file with measured poses
    Check {
        /// Machine file
        file: PathBuf,
        #[command(flatten)]
        touches: TouchArguments,
    },
    /// Writes the file of a machine of a common family from measured values with a drawing, and
    /// says which values are defaults
    New(Box<NewMachineArguments>),
    /// Draws axes, senses and pivots of a machine to scale (SVG)
    Draw {
        /// Machine file
        file: PathBuf,
        /// Output file
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
        /// Replace an output file that exists
        #[arg(long)]
        force: bool,
    },
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
        MachineCommand::Check { file, touches } => check(&file, &touches),
        MachineCommand::New(arguments) => machine_new::run(*arguments),
        MachineCommand::Draw { file, out, force } => draw(&file, &out, force),
        MachineCommand::Import { machine, out, lines } => import(&machine, out.as_deref(), lines),
    }
}

/// Measured poses of `machine check`.
#[derive(Args)]
pub(crate) struct TouchArguments {
    /// Readings of all axes with the tip on one point of the table, the same for all of them, as
    /// X=-12.5,Y=40,Z=-310,B=30,C=90, mm and deg, RTCP off: for at least two poses with other
    /// rotary readings. Signs of the file whose swap would explain a difference are named
    #[arg(long, value_name = "READINGS", value_parser = readings, requires = "tool_length_mm", allow_hyphen_values = true)]
    touch: Vec<Readings>,
    /// Distance from the gauge line to the tip in these poses
    #[arg(long, value_name = "MM", value_parser = finite, requires = "touch", allow_hyphen_values = true)]
    tool_length_mm: Option<f64>,
    /// Place of the point in the table frame, if it is known: also tests the senses of linear axes
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, requires = "touch", allow_hyphen_values = true)]
    touch_point: Option<[f64; 3]>,
    /// Distance of the tips that counts as none: the error of the readings
    #[arg(long, value_name = "MM", value_parser = finite, default_value_t = 0.1, requires = "touch", allow_hyphen_values = true)]
    touch_tolerance_mm: f64,
}

fn check(path: &Path, touches: &TouchArguments) -> Result<ExitCode, Failure> {
    let read = read_machine(path)?;
    let checked = describe_heads(&read.heads).map_err(|e| Failure::input(path, e))?;
    let touched = touched(path, touches)?;
    let lines = chains_of_lines(path)?.into_iter().chain(checked.lines).chain(describe_hulls(&read.hulls));
    let lines: Vec<String> = lines.chain(touched.iter().flat_map(TouchCheck::lines)).collect();
    say(&format!("{}\n", lines.join("\n")))?;
    match checked.fault.or_else(|| touched.and_then(|touched| touched.fault())) {
        Some(fault) => Err(Failure::input(path, fault)),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// Compares the file with the measured poses; `None` without any.
fn touched(path: &Path, arguments: &TouchArguments) -> Result<Option<TouchCheck>, Failure> {
    let Some(tool_length) = arguments.tool_length_mm else { return Ok(None) };
    let touches = Touches {
        poses: arguments.touch.clone(),
        tool_length,
        point: arguments.touch_point,
        tolerance: arguments.touch_tolerance_mm,
    };
    let failure = |error: TouchError| match error {
        TouchError::Machine(error) => Failure::input(path, error),
        TouchError::Heads { .. } => Failure::input(path, error),
        TouchError::Number { .. } => {
            Failure::input(Path::new("--touch, --touch-point, --tool-length-mm, --touch-tolerance-mm"), error)
        }
        other => Failure::input(Path::new("--touch"), other),
    };
    check_touches(&machine_file(path)?, &touches).map(Some).map_err(failure)
}

fn readings(text: &str) -> Result<Readings, String> {
    let one = |part: &str| -> Result<(String, f64), String> {
        let (axis, value) = part.split_once('=').ok_or_else(|| format!("\"{part}\" is not of the form X=-12.5"))?;
        Ok((axis.trim().to_uppercase(), finite(value)?))
    };
    text.split(',').map(one).collect()
}

fn draw(path: &Path, out: &Path, force: bool) -> Result<ExitCode, Failure> {
    let read = read_machine(path)?;
    if !force && out.symlink_metadata().is_ok() {
        return Err(Failure::input(out, "exists; --force replaces it"));
    }
    files::write_one(out, machine_svg(&read.heads).into_bytes())?;
    say(&format!("{}: machine \"{}\"\n", out.display(), read.heads[0].name()))?;
    Ok(ExitCode::SUCCESS)
}

fn machine_file(path: &Path) -> Result<MachineFile, Failure> {
    facemill::file_format::from_json(&files::read(path)?).map_err(|e| Failure::input(path, e))
}

/// Returns a line that names the chains of a file that are given by lines, if there are any.
fn chains_of_lines(path: &Path) -> Result<Option<String>, Failure> {
    let file = machine_file(path)?;
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
