//! Inputs and version that a program was made from: they distinguish its report from that of other
//! files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Inputs and version that a program was made from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct MadeFrom {
    /// Version of facemill.
    pub facemill: &'static str,
    /// Name of the tool; with two heads, of the first head's.
    pub tool: String,
    /// Name of the second head's tool; `null` if there is none.
    pub second_tool: Option<String>,
    /// Name of the machine.
    pub machine: String,
    /// Control that the program is for.
    pub dialect: String,
    /// Input files, by name.
    pub inputs: Vec<InputFile>,
}

/// An input file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct InputFile {
    /// Its name, relative to the job file, as the job or another input names it.
    pub file: String,
    /// BLAKE3 checksum of its bytes when planning began, 64 hexadecimal digits.
    pub blake3: String,
}
