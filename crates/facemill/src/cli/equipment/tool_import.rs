//! `facemill tool import`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::file_format::to_json;
use facemill::tool_library::{LibraryTool, ToolRefusal};
use facemill::tool_model::{ToolAssembly, ToolFile};
use facemill::{Failure, files};

use crate::cli::equipment::tool_files::{
    at_position, check_new, fault_of, first_of, is_tool_file, read_library_file, with_number,
};
use crate::cli::equipment::tool_text::{measures, remarks};
use crate::cli::output::say;

#[derive(Args)]
pub(crate) struct ImportArguments {
    /// Tool library that Fusion exported (.json, .tools)
    library: PathBuf,
    /// Number of a tool; can be given several times
    #[arg(long, value_name = "N", required_unless_present_any = ["all", "position"], conflicts_with = "all")]
    number: Vec<u32>,
    /// Position of a tool in the library, as `tool list` prints it; can be given several times
    #[arg(long, value_name = "N", conflicts_with = "all")]
    position: Vec<usize>,
    /// All tools of types that are read
    #[arg(long)]
    all: bool,
    /// Leave out tools with faults, too
    #[arg(long, requires = "all")]
    skip_faulty: bool,
    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace tool files and a report that exist
    #[arg(long)]
    force: bool,
    /// Write the report to this file, too
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

pub(crate) fn run(arguments: &ImportArguments) -> Result<ExitCode, Failure> {
    let library = &arguments.library;
    let tools = wanted(arguments, read_library_file(library)?)?;
    refuse_faults(arguments, &tools)?;
    let mut names = FileNames::default();
    let mut outputs: Vec<(String, Vec<u8>)> = Vec::new();
    let mut report = String::new();
    for tool in &tools {
        let read = match &tool.import {
            Ok(read) => read,
            Err(why) => {
                report.push_str(&format!("not read: {}\n", fault_of(tool, why)));
                continue;
            }
        };
        let name = names.next(&read.file);
        let path = arguments.out.join(&name);
        let assembly = ToolAssembly::new(read.file.clone()).map_err(|e| Failure::Internal(e.to_string()))?;
        report.push_str(&format!("{}: {}{}", path.display(), measures(&assembly, Some(read.kind)), remarks(tool)));
        outputs.push((name, to_json(&read.file).into_bytes()));
    }
    if outputs.is_empty() {
        return Err(Failure::input(
            library,
            format!("has no sound tool of a supported type:\n  {}", report.trim_end().replace('\n', "\n  ")),
        ));
    }
    outputs.iter().try_for_each(|(name, _)| check_replaced(&arguments.out.join(name), arguments.force))?;
    if let Some(report) = &arguments.report {
        check_report(report, &arguments.out, &outputs, arguments.force)?;
    }
    files::check_folder(&arguments.out)?;
    report.push_str(&equal_numbers(&tools));
    let n = outputs.len();
    report.push_str(&format!(
        "{n} tool(s) written, {} not read; replace what is assumed by the tools' own values\n",
        tools.len() - n
    ));
    files::write_all(&arguments.out, &outputs)?;
    if let Some(path) = &arguments.report {
        files::write_one(path, report.clone().into_bytes())?;
    }
    say(&report)?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses a report in the place of a file that exists or of a tool file of this import.
fn check_report(report: &Path, out: &Path, outputs: &[(String, Vec<u8>)], force: bool) -> Result<(), Failure> {
    files::check_outputs([report])?;
    let named = report.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    // The folder may not exist yet, so its path is compared, too.
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    for (name, _) in outputs.iter().filter(|(name, _)| name.to_lowercase() == named) {
        let tool_file = absolute(&out.join(name));
        if files::check_outputs([tool_file.as_path(), &absolute(report)]).is_err() {
            return Err(Failure::input(report, "is a tool file of this import; give the report a name of its own"));
        }
    }
    check_new(report, force)
}

/// Returns a note for each number that several of the written tools have.
fn equal_numbers(tools: &[LibraryTool]) -> String {
    let mut positions: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for tool in tools.iter().filter(|tool| tool.import.is_ok()) {
        positions.entry(tool.number.unwrap_or_default()).or_default().push(tool.position);
    }
    let note = |(number, positions): (&u32, &Vec<usize>)| {
        let list = first_of(positions.iter());
        format!(
            "note: tools at positions {list} all have number {number}; give them different numbers before one machine \
             holds them\n"
        )
    };
    positions.iter().filter(|(_, positions)| positions.len() > 1).map(note).collect()
}

/// Returns the selected tools in the order of the library.
fn wanted(arguments: &ImportArguments, tools: Vec<LibraryTool>) -> Result<Vec<LibraryTool>, Failure> {
    if arguments.all {
        return Ok(tools);
    }
    let mut wanted = Vec::new();
    for &number in &arguments.number {
        wanted.extend(with_number(&arguments.library, &tools, number)?);
    }
    for &position in &arguments.position {
        wanted.push(at_position(&arguments.library, &tools, position)?);
    }
    wanted.sort_by_key(|tool| tool.position);
    wanted.dedup_by_key(|tool| tool.position);
    Ok(wanted)
}

/// Most faulty tools of a message.
const MOST_NAMED: usize = 50;

/// Refuses tools with faults, and of those that were named also other types.
fn refuse_faults(arguments: &ImportArguments, tools: &[LibraryTool]) -> Result<(), Failure> {
    let fault = |tool: &LibraryTool| {
        let why = tool.import.as_ref().err()?;
        let is_refused = match why {
            ToolRefusal::OtherKind(_) => !arguments.all,
            _ => !arguments.skip_faulty,
        };
        is_refused.then(|| fault_of(tool, why))
    };
    let mut faults: Vec<String> = tools.iter().filter_map(fault).collect();
    if faults.is_empty() {
        return Ok(());
    }
    let more = faults.len().saturating_sub(MOST_NAMED);
    faults.truncate(MOST_NAMED);
    if more > 0 {
        faults.push(format!("and {more} more"));
    }
    let hint = if arguments.all { "\n  nothing was written; --skip-faulty leaves these tools out" } else { "" };
    Err(Failure::input(&arguments.library, format!("{}{hint}", faults.join("\n  "))))
}

/// Refuses to replace a file, unless it is a tool file and replacing is permitted.
fn check_replaced(path: &Path, force: bool) -> Result<(), Failure> {
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    check_new(path, force)?;
    // An unreadable file is reported by the write.
    if path.is_file() && std::fs::read(path).is_ok_and(|bytes| !is_tool_file(&bytes)) {
        return Err(Failure::input(path, "exists and is no tool file; move it, or give another folder"));
    }
    Ok(())
}

/// Names of files that were given already.
#[derive(Default)]
struct FileNames {
    taken: BTreeSet<String>,
    /// Number of tools with each name, before its count.
    counts: BTreeMap<String, usize>,
}

impl FileNames {
    /// Returns the name of a tool's file: number and description in small letters and digits, with
    /// a count where another tool has the same.
    fn next(&mut self, file: &ToolFile) -> String {
        let words = file.name.to_lowercase();
        let words = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        let slug: String = words.collect::<Vec<_>>().join("-").chars().take(48).collect();
        let slug = slug.trim_matches('-');
        let base = if slug.is_empty() { format!("t{}", file.number) } else { format!("t{}-{slug}", file.number) };
        let count = self.counts.entry(base.clone()).or_default();
        loop {
            *count += 1;
            let name = if *count == 1 { format!("{base}.json") } else { format!("{base}-{count}.json") };
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}
