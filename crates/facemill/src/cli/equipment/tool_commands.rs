//! Commands for tools.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Subcommand, ValueEnum};
use facemill::drawing::assembly_svg::assembly_svg;
use facemill::tool_library::{
    G10Control, TableUnit, g10_tool_lengths, heidenhain_tool_table, linuxcnc_table, siemens_tool_data,
};
use facemill::tool_model::ToolAssembly;
use facemill::{Failure, files};

use crate::cli::equipment::tool_files::{ToolChoice, ToolsOfFile, check_new, fault_of, files_at, read_one, read_tools};
use crate::cli::equipment::tool_import::{self, ImportArguments};
use crate::cli::equipment::tool_text::{measures, remarks, row, table};
use crate::cli::output::say;

#[derive(Subcommand)]
pub(crate) enum ToolCommand {
    /// Writes tools of a Fusion library as tool files, one each
    Import(ImportArguments),
    /// Prints a table of tools, with the cutting data of libraries and the tools not read
    List {
        /// Tool libraries of Fusion (.json, .tools), tool files, or folders of them
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Prints all measures of a tool, and what is assumed of it
    Show {
        /// Tool file, or tool library of Fusion (.json, .tools)
        file: PathBuf,
        #[command(flatten)]
        choice: ToolChoice,
    },
    /// Draws a tool assembly with its dimensions (SVG)
    Draw {
        /// Tool file, or tool library of Fusion (.json, .tools)
        file: PathBuf,
        #[command(flatten)]
        choice: ToolChoice,
        /// Output file
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
        /// Replace an output file that exists
        #[arg(long)]
        force: bool,
    },
    /// Writes the tool table of a control
    Table {
        /// Tool files
        #[arg(required = true, value_name = "TOOL")]
        tools: Vec<PathBuf>,
        /// Control
        #[arg(long, value_name = "NAME")]
        dialect: TableDialect,
        /// Unit of the control's configuration
        #[arg(long, value_name = "UNIT", default_value = "mm")]
        unit: UnitName,
        /// Output file; default: standard output
        #[arg(short, long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Replace an output file that exists
        #[arg(long, requires = "out")]
        force: bool,
    },
}

/// Controls that have tool tables here.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum TableDialect {
    /// Tool table (tool.tbl)
    #[value(name = "linuxcnc")]
    LinuxCnc,
    /// Program that sets tool data ($TC_DP…)
    #[value(name = "siemens_840d", alias = "siemens")]
    Siemens,
    /// Program that sets length registers (G10)
    Fanuc,
    /// Program that sets length registers (G10)
    Haas,
    /// Program that sets length registers (G10)
    Mazak,
    /// Tool table (TOOL.T)
    Heidenhain,
}

/// Number of a program that sets length registers.
const TABLE_PROGRAM: u32 = 9001;

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum UnitName {
    Mm,
    Inch,
}

pub(crate) fn run(command: ToolCommand) -> Result<ExitCode, Failure> {
    match command {
        ToolCommand::Import(arguments) => tool_import::run(&arguments),
        ToolCommand::List { files } => list(&files),
        ToolCommand::Show { file, choice } => show(&file, &choice),
        ToolCommand::Draw { file, choice, out, force } => draw(&file, &choice, &out, force),
        ToolCommand::Table { tools, dialect, unit, out, force } => {
            write_table(&tools, dialect, unit, out.as_deref(), force)
        }
    }
}

fn list(paths: &[PathBuf]) -> Result<ExitCode, Failure> {
    let (mut rows, mut below, mut others) = (Vec::new(), String::new(), 0);
    for path in paths {
        let (found, n) = files_at(path)?;
        others += n;
        let is_folder = path.is_dir();
        for file in found {
            let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            match read_tools(&file) {
                Ok(ToolsOfFile::Tool(tool)) => rows.push(row(&tool.to_file(), None, None, &name)),
                Ok(ToolsOfFile::Library(tools)) => {
                    for tool in &tools {
                        match &tool.import {
                            Ok(read) => {
                                rows.push(row(&read.file, Some(read.kind), Some(tool.position), &name));
                                let remarks = remarks(tool);
                                if !remarks.is_empty() {
                                    below.push_str(&format!("{}:\n{remarks}", tool.label()));
                                }
                            }
                            Err(why) => below.push_str(&format!("not read: {name}: {}\n", fault_of(tool, why))),
                        }
                    }
                }
                // A folder's other tools are listed all the same.
                Err(failure) if is_folder => below.push_str(&format!("not read: {failure}\n")),
                Err(failure) => return Err(failure),
            }
        }
    }
    let mut text = if rows.is_empty() { "no tool was read\n".to_owned() } else { table(&rows) };
    text.push_str(&below);
    if others > 0 {
        text.push_str(&format!("{others} other file(s)\n"));
    }
    say(&text)?;
    Ok(ExitCode::SUCCESS)
}

fn show(path: &Path, choice: &ToolChoice) -> Result<ExitCode, Failure> {
    let one = read_one(path, choice)?;
    let kind = one.library_tool.as_ref().and_then(|tool| Some(tool.import.as_ref().ok()?.kind));
    say(&measures(&one.tool, kind))?;
    say(&one.library_tool.as_ref().map(remarks).unwrap_or_default())?;
    Ok(ExitCode::SUCCESS)
}

fn draw(path: &Path, choice: &ToolChoice, out: &Path, force: bool) -> Result<ExitCode, Failure> {
    let one = read_one(path, choice)?;
    check_new(out, force)?;
    files::write_one(out, assembly_svg(&one.tool).into_bytes())?;
    say(&format!("{}: tool {} \"{}\"\n", out.display(), one.tool.number(), one.tool.name()))?;
    Ok(ExitCode::SUCCESS)
}

fn write_table(
    paths: &[PathBuf],
    dialect: TableDialect,
    unit: UnitName,
    out: Option<&Path>,
    force: bool,
) -> Result<ExitCode, Failure> {
    let one = |path: &PathBuf| match read_tools(path)? {
        ToolsOfFile::Tool(tool) => Ok(*tool),
        ToolsOfFile::Library(_) => {
            Err(Failure::input(path, "is a tool library: write its tools with `facemill tool import` first"))
        }
    };
    let tools = paths.iter().map(one).collect::<Result<Vec<ToolAssembly>, Failure>>()?;
    let unit = match unit {
        UnitName::Mm => TableUnit::Millimetre,
        UnitName::Inch => TableUnit::Inch,
    };
    let text = match dialect {
        TableDialect::LinuxCnc => linuxcnc_table(&tools, unit),
        TableDialect::Siemens => siemens_tool_data(&tools, unit),
        TableDialect::Fanuc => g10_tool_lengths(&tools, unit, G10Control::Fanuc, TABLE_PROGRAM),
        TableDialect::Haas => g10_tool_lengths(&tools, unit, G10Control::Haas, TABLE_PROGRAM),
        TableDialect::Mazak => g10_tool_lengths(&tools, unit, G10Control::Mazak, TABLE_PROGRAM),
        TableDialect::Heidenhain => heidenhain_tool_table(&tools, unit),
    };
    let text = text.map_err(|e| {
        let at_fault = tools.iter().rposition(|tool| Some(tool.number()) == e.number());
        Failure::input(&paths[at_fault.unwrap_or(0)], e)
    })?;
    let Some(out) = out else {
        say(&text)?;
        return Ok(ExitCode::SUCCESS);
    };
    // A shop's own table has tools and offsets that no file of ours has.
    if !force && out.symlink_metadata().is_ok() {
        return Err(Failure::input(out, "exists; --force replaces it, with all tools in it"));
    }
    files::write_one(out, text.into_bytes())?;
    say(&format!("{}: {} tool(s)\n", out.display(), tools.len()))?;
    Ok(ExitCode::SUCCESS)
}
