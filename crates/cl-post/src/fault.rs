//! Reasons why a CL file cannot be posted.

use facemill_cl_data::Cancelled;
use facemill_cl_file::ClFault;
use facemill_job::failure::Failure;
use facemill_nc_program::WriteError;

/// Reason why a CL file cannot be posted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PostFault {
    /// A statement of the file that cannot be written, or that the machine cannot follow.
    #[error("line {line}: {why}")]
    Statement {
        /// Its first line, from 1.
        line: u32,
        /// Fault and remedy.
        why: String,
    },
    /// A fault of the whole file, or of machine, tools and settings.
    #[error("{0}")]
    Whole(String),
    /// The dialect or its template has no words for the program.
    #[error("{0}")]
    Write(#[from] WriteError),
    /// The monitor stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl PostFault {
    pub(crate) fn at(line: u32, why: impl Into<String>) -> Self {
        Self::Statement { line, why: why.into() }
    }
}

impl From<Failure> for PostFault {
    fn from(failure: Failure) -> Self {
        Self::Whole(failure.to_string())
    }
}

impl From<ClFault> for PostFault {
    fn from(ClFault { line, why }: ClFault) -> Self {
        Self::Statement { line, why }
    }
}
