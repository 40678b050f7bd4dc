//! Tools in files that the user names: libraries, tool files, and folders of both.

use std::path::{Path, PathBuf};

use clap::Args;
use facemill::tool_library::{LibraryError, LibraryTool, ToolRefusal, is_library, read_library};
use facemill::tool_model::ToolAssembly;
use facemill::{Failure, files};
use serde::Deserialize;

/// Tools of a file.
pub(crate) enum ToolsOfFile {
    /// A library.
    Library(Vec<LibraryTool>),
    /// A tool file.
    Tool(Box<ToolAssembly>),
}

/// Reads a library of tools or a tool file.
///
/// # Errors
/// [`Failure::Read`] and [`Failure::Input`], naming the file; tools of a library with faults are no
/// error.
pub(crate) fn read_tools(path: &Path) -> Result<ToolsOfFile, Failure> {
    let bytes = files::read_text(path)?;
    if is_tool_file(&bytes) {
        let tool = ToolAssembly::from_json(&bytes).map_err(|e| Failure::input(path, e))?;
        return Ok(ToolsOfFile::Tool(Box::new(tool)));
    }
    read_library(&bytes).map(ToolsOfFile::Library).map_err(|why| {
        let hint = match why {
            LibraryError::NoTools => ", or give a tool file (\"format\": \"facemill-tool/1\")",
            _ => "",
        };
        Failure::input(path, format!("{why}{hint}"))
    })
}

/// Reads the tools of a library.
///
/// # Errors
/// As [`read_tools`], and of a tool file.
pub(crate) fn read_library_file(path: &Path) -> Result<Vec<LibraryTool>, Failure> {
    match read_tools(path)? {
        ToolsOfFile::Library(tools) => Ok(tools),
        ToolsOfFile::Tool(_) => Err(Failure::input(path, "is a tool file already; give a tool library of Fusion")),
    }
}

/// Choice of a tool of a library.
#[derive(Args)]
pub(crate) struct ToolChoice {
    /// Number of the tool in a library
    #[arg(long, value_name = "N")]
    number: Option<u32>,
    /// Position of the tool in a library, as `tool list` prints it
    #[arg(long, value_name = "N", conflicts_with = "number")]
    position: Option<usize>,
}

/// Returns one tool of a file: that of a tool file, or that of a library with this number or at
/// this position.
///
/// # Errors
/// As [`read_tools`], and where the choice leaves no tool or several, or the one has faults.
pub(crate) fn read_one(path: &Path, choice: &ToolChoice) -> Result<ToolOfFile, Failure> {
    let tools = match read_tools(path)? {
        ToolsOfFile::Tool(tool) => {
            if let Some(other) = choice.number.filter(|number| *number != tool.number()) {
                return Err(Failure::input(path, format!("has tool {}, not {other}", tool.number())));
            }
            if choice.position.is_some_and(|position| position != 1) {
                return Err(Failure::input(path, "is a tool file, which has one tool; leave out --position"));
            }
            return Ok(ToolOfFile { tool: *tool, library_tool: None });
        }
        ToolsOfFile::Library(tools) => match (choice.number, choice.position) {
            (Some(number), _) => with_number(path, &tools, number)?,
            (None, Some(position)) => vec![at_position(path, &tools, position)?],
            (None, None) => tools,
        },
    };
    if let [one] = &tools[..] {
        let file = one.import.as_ref().map(|tool| tool.file.clone());
        let file = file.map_err(|why| Failure::input(path, fault_of(one, why)))?;
        let tool = ToolAssembly::new(file).map_err(|e| Failure::input(path, e))?;
        return Ok(ToolOfFile { tool, library_tool: tools.into_iter().next() });
    }
    let why = match choice.number {
        Some(number) => format!(
            "has {} tools with number {number}, at positions {}; choose one with --position",
            tools.len(),
            first_of(tools.iter().map(|tool| tool.position))
        ),
        None => format!("has {} tools; choose one with --number or --position", tools.len()),
    };
    Err(Failure::input(path, why))
}

/// Most numbers in a list of a message.
const MOST_LISTED: usize = 20;

/// Returns the first of these numbers as a list.
pub(crate) fn first_of<T: ToString>(all: impl ExactSizeIterator<Item = T>) -> String {
    let more = if all.len() > MOST_LISTED { ", …" } else { "" };
    let first: Vec<String> = all.take(MOST_LISTED).map(|one| one.to_string()).collect();
    format!("{}{more}", first.join(", "))
}

/// A tool, and what its library says of it besides.
pub(crate) struct ToolOfFile {
    pub(crate) tool: ToolAssembly,
    pub(crate) library_tool: Option<LibraryTool>,
}

/// Returns the tools of a library that have this number.
///
/// # Errors
/// Without one, naming the numbers that there are.
pub(crate) fn with_number(path: &Path, tools: &[LibraryTool], number: u32) -> Result<Vec<LibraryTool>, Failure> {
    let mut there: Vec<u32> = tools.iter().filter_map(|tool| tool.number).collect();
    let found: Vec<LibraryTool> = tools.iter().filter(|tool| tool.number == Some(number)).cloned().collect();
    if !found.is_empty() {
        return Ok(found);
    }
    there.sort_unstable();
    there.dedup();
    let known =
        if there.is_empty() { "no numbers".to_owned() } else { format!("the numbers {}", first_of(there.iter())) };
    Err(Failure::input(path, format!("has no tool with number {number}; it has {known}")))
}

/// Returns the tool of a library at a position, from 1.
///
/// # Errors
/// Without one, with the number of tools.
pub(crate) fn at_position(path: &Path, tools: &[LibraryTool], position: usize) -> Result<LibraryTool, Failure> {
    let found = position.checked_sub(1).and_then(|k| tools.get(k)).cloned();
    found.ok_or_else(|| {
        Failure::input(path, format!("has no tool at position {position}; it has {} tools, from 1", tools.len()))
    })
}

/// Refuses to replace a file that exists, unless that is permitted.
///
/// # Errors
/// [`Failure::Input`], naming the file.
pub(crate) fn check_new(path: &Path, force: bool) -> Result<(), Failure> {
    if !force && path.symlink_metadata().is_ok() {
        return Err(Failure::input(path, "exists; --force replaces it"));
    }
    Ok(())
}

/// Returns why a tool of a library was not read, with the tool's name.
pub(crate) fn fault_of(tool: &LibraryTool, why: &ToolRefusal) -> String {
    format!("{}: {why}", tool.label())
}

/// Returns the files that a path names: itself, or the tool files and libraries of a folder by
/// name, and the number of the folder's other files. Files of a folder that cannot be read, such as
/// too large ones, are among them: reading them gives the reason.
///
/// # Errors
/// [`Failure::Read`] if a folder cannot be read.
pub(crate) fn files_at(path: &Path) -> Result<(Vec<PathBuf>, usize), Failure> {
    if !path.is_dir() {
        return Ok((vec![path.to_owned()], 0));
    }
    let unread = |source| Failure::Read { file: path.to_owned(), source };
    let entries = std::fs::read_dir(path).map_err(unread)?;
    let mut all = entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<PathBuf>>>().map_err(unread)?;
    all.retain(|file| file.is_file());
    all.sort();
    let (mut found, mut others) = (Vec::new(), 0);
    for file in all {
        let is_named = file.extension().is_some_and(|end| end == "json" || end == "tools");
        let has_tools = is_named
            && match files::read_text(&file) {
                Ok(bytes) => is_tool_file(&bytes) || is_library(&bytes),
                Err(_) => true,
            };
        if has_tools { found.push(file) } else { others += 1 }
    }
    Ok((found, others))
}

/// Head of a tool file; all else in it is passed over.
#[derive(Deserialize)]
struct FormatKey {
    format: String,
}

/// Returns whether bytes are a tool file of this program, regardless of its content.
pub(crate) fn is_tool_file(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    serde_json::from_slice(text).is_ok_and(|key: FormatKey| key.format.starts_with("facemill-tool/"))
}
