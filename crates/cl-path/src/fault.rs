//! Reasons why a file makes no passes.

use facemill_cl_file::ClFault;

/// Reason why a CL file makes no passes on a surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClPathFault {
    /// A statement of the file, with its line.
    #[error(transparent)]
    Statement(#[from] ClFault),
    /// A fault of the whole file.
    #[error("{0}")]
    Whole(String),
}

impl ClPathFault {
    pub(crate) fn at(line: u32, why: impl Into<String>) -> Self {
        Self::Statement(ClFault::at(line, why))
    }
}
