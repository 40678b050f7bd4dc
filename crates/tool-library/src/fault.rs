//! Faults of libraries and of their tools, each with its remedy.

use facemill_file_format::FormatError;

/// Why bytes are not a tool library.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// The bytes are neither JSON nor a zip archive.
    #[error("is neither JSON nor a zip archive; export the tool library in Fusion as .json or .tools")]
    OtherFile,
    /// The archive has no library that can be read.
    #[error("{0}")]
    Archive(#[from] ArchiveFault),
    /// The JSON text has a fault.
    #[error("{0}")]
    Format(#[from] FormatError),
    /// There is no list of tools.
    #[error("has no list \"data\" of tools at its top; export the tool library in Fusion")]
    NoTools,
    /// There are more tools than are read.
    #[error("has {0} tools, more than {MAX_TOOLS}; export a part of the library")]
    TooManyTools(usize),
}

/// Most tools of a library. A shop has some hundreds, a vendor's catalogue some thousands.
pub const MAX_TOOLS: usize = 10_000;

/// Why a zip archive is refused. Nothing of it is unpacked before all of its names are checked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArchiveFault {
    /// The directory of the archive is missing, or leads out of the file.
    #[error("is no whole zip archive ({0}); export the library again")]
    Broken(String),
    /// A form of archives that no tool library needs.
    #[error("is a zip archive {0}; export the library again, as .json")]
    Unsupported(&'static str),
    /// There are too many entries.
    #[error("is a zip archive of more than 64 entries; a tool library has one, tools.json")]
    TooManyEntries,
    /// A name that leads out of a folder.
    #[error("has the entry {0:?}, whose name leads out of the archive; nothing of it was unpacked")]
    OutsideName(String),
    /// No entry is a library.
    #[error("has no entry tools.json; export the library in Fusion as .tools")]
    NoLibrary,
    /// Several entries may be the library.
    #[error("has the entries {0}; leave only one file of tools, tools.json")]
    SeveralLibraries(String),
    /// The entry is larger than is read.
    #[error("holds {0} MB of tools, more than 64 MB; export a part of the library")]
    TooLarge(u64),
    /// The entry unpacks to something else than the directory states.
    #[error("has a damaged entry tools.json ({0}); export the library again")]
    Damaged(String),
}

/// Fault of one tool of a library, by the key that it is at. Displayed as a sentence without its
/// subject's tool: `geometry.DC is missing; …`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} {fault}")]
pub struct ToolFault {
    /// Key in the library, such as `geometry.DC` or `holder.segments[2].height`.
    pub key: String,
    /// The fault and its remedy.
    pub fault: String,
}

impl ToolFault {
    pub(crate) fn new(key: impl Into<String>, fault: impl Into<String>) -> Self {
        Self { key: key.into(), fault: fault.into() }
    }
}
