//! Identity of the program that a file describes.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

/// Program that a file describes, by name and content: the file describes another program only if
/// both are the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ProgramStamp {
    /// Name of its file, without the folder.
    pub file: String,
    /// BLAKE3 checksum of the file's bytes, 64 hexadecimal digits.
    pub blake3: String,
}

impl ProgramStamp {
    /// Returns the stamp of a program with this file name (without its folders) and these bytes.
    pub fn new(file: &Path, bytes: &[u8]) -> Self {
        let name = file.file_name().unwrap_or(file.as_os_str());
        Self { file: name.to_string_lossy().into_owned(), blake3: checksum(bytes) }
    }

    /// Returns the stamp as text for files that are not JSON: `program.nc blake3 6f…`.
    pub fn text(&self) -> String {
        format!("{} blake3 {}", self.file, self.blake3)
    }
}

/// Returns the BLAKE3 checksum of bytes, 64 hexadecimal digits: files identify the content of
/// others by it.
pub fn checksum(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Adds comments to the end of a picture that name the programs it describes.
pub fn stamped_svg(svg: String, programs: &[ProgramStamp]) -> String {
    // A comment ends with two hyphens, which file names may hold.
    let comment = |program: &ProgramStamp| format!("<!-- {} -->\n", program.text().replace("--", "- -"));
    svg + &programs.iter().map(comment).collect::<String>()
}

/// Names the programs in the APT files of a plan, in comments behind their first line.
pub fn stamp_apt(files: &mut [(String, Vec<u8>)], programs: &[ProgramStamp]) {
    let comments: String = programs.iter().map(|program| format!("$$ {}\n", program.text())).collect();
    for (_, bytes) in files.iter_mut().filter(|(name, _)| name.ends_with(".apt")) {
        let first = bytes.iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| end + 1);
        bytes.splice(first..first, comments.bytes());
    }
}

/// Returns the stamps of the NC programs among the files of a plan, without the APT files.
pub fn programs_among(files: &[(String, Vec<u8>)]) -> Vec<ProgramStamp> {
    let is_program = |name: &str| name.starts_with("program") && !name.ends_with(".apt");
    files
        .iter()
        .filter(|(name, _)| is_program(name))
        .map(|(name, bytes)| ProgramStamp::new(Path::new(name), bytes))
        .collect()
}
