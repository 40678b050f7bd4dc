//! What a program was made from, and by what: so that a report can be told from one of other files.

use schemars::JsonSchema;
use serde::Serialize;

/// What a program was made from, and by what.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct MadeFrom {
    /// Version of facemill.
    pub facemill: &'static str,
    /// Name of the tool; of the first head's, where there are two.
    pub tool: String,
    /// Name of the second head's tool; `null` where there is none.
    pub second_tool: Option<String>,
    /// Name of the machine.
    pub machine: String,
    /// Control that the program is for.
    pub dialect: String,
    /// The files that were read, by name.
    pub inputs: Vec<InputFile>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct InputFile {
    /// Its name, relative to the job file, as the job or another input names it.
    pub file: String,
    /// BLAKE3 checksum of its bytes when planning began, 64 hexadecimal digits.
    pub blake3: String,
}
