//! Tools in files that the user names: libraries, tool files, and folders of both.

use std::path::{Path, PathBuf};

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

/// Returns one tool of a file: that of a tool file, or that of a library with this number.
///
/// # Errors
/// As [`read_tools`], and where no tool or several are meant, or the one has faults.
pub(crate) fn read_one(path: &Path, number: Option<u32>) -> Result<ToolOfFile, Failure> {
    let tools = match (read_tools(path)?, number) {
        (ToolsOfFile::Tool(tool), number) => {
            if let Some(other) = number.filter(|number| *number != tool.number()) {
                return Err(Failure::input(path, format!("has tool {}, not {other}", tool.number())));
            }
            return Ok(ToolOfFile { tool: *tool, library_tool: None });
        }
        (ToolsOfFile::Library(tools), Some(number)) => with_number(path, &tools, number)?,
        (ToolsOfFile::Library(tools), None) => tools,
    };
    if let [one] = &tools[..] {
        let file = one.import.as_ref().map(|tool| tool.file.clone());
        let file = file.map_err(|why| Failure::input(path, fault_of(one, why)))?;
        let tool = ToolAssembly::new(file).map_err(|e| Failure::input(path, e))?;
        return Ok(ToolOfFile { tool, library_tool: tools.into_iter().next() });
    }
    let why = match number {
        Some(number) => format!("has {} tools with number {number}; give them different numbers", tools.len()),
        None => format!("has {} tools; choose one with --number", tools.len()),
    };
    Err(Failure::input(path, why))
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
    let more = if there.len() > 20 { ", …" } else { "" };
    let list: Vec<String> = there.iter().take(20).map(u32::to_string).collect();
    let known =
        if list.is_empty() { "no numbers".to_owned() } else { format!("the numbers {}{more}", list.join(", ")) };
    Err(Failure::input(path, format!("has no tool with number {number}; it has {known}")))
}

/// Returns why a tool of a library was not read, with the tool's name.
pub(crate) fn fault_of(tool: &LibraryTool, why: &ToolRefusal) -> String {
    format!("{}: {why}", tool.label())
}

/// Returns the files that a path names: itself, or the tool files and libraries of a folder by
/// name, and the number of the folder's other files.
///
/// # Errors
/// [`Failure::Read`] if a folder or a file in it cannot be read.
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
        let has_tools = is_named && {
            let bytes = files::read_text(&file)?;
            is_tool_file(&bytes) || is_library(&bytes)
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
