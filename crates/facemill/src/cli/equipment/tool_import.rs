//! `facemill tool import`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::file_format::to_json;
use facemill::tool_library::{LibraryTool, ToolRefusal};
use facemill::tool_model::{ToolAssembly, ToolFile};
use facemill::{Failure, files};

use crate::cli::equipment::tool_files::{fault_of, is_tool_file, read_library_file, with_number};
use crate::cli::equipment::tool_text::{measures, remarks};
use crate::cli::output::say;

#[derive(Args)]
pub(crate) struct ImportArguments {
    /// Tool library that Fusion exported (.json, .tools)
    library: PathBuf,
    /// Number of a tool; can be given several times
    #[arg(long, value_name = "N", required_unless_present = "all", conflicts_with = "all")]
    number: Vec<u32>,
    /// All tools of types that are read
    #[arg(long)]
    all: bool,
    /// Leave out tools with faults, too
    #[arg(long, requires = "all")]
    skip_faulty: bool,
    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace tool files that exist
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
            format!("has no tool that is read:\n  {}", report.trim_end().replace('\n', "\n  ")),
        ));
    }
    outputs.iter().try_for_each(|(name, _)| check_replaced(&arguments.out.join(name), arguments.force))?;
    files::check_outputs(arguments.report.as_deref())?;
    files::check_folder(&arguments.out)?;
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

/// Returns the tools that are meant.
fn wanted(arguments: &ImportArguments, tools: Vec<LibraryTool>) -> Result<Vec<LibraryTool>, Failure> {
    if arguments.all {
        return Ok(tools);
    }
    let mut wanted = Vec::new();
    for &number in &arguments.number {
        wanted.extend(with_number(&arguments.library, &tools, number)?);
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
    if !force {
        return Err(Failure::input(path, "exists; --force replaces it"));
    }
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
