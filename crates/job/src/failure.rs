//! Failures of commands, with their exit codes.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use facemill_tool_path::path_error::PathError;

/// Reason why the planner did not fulfil a request. A plan with findings is no failure: it is a
/// result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// The input is wrong; exit code 2.
    #[error("{file}: {message}", file = file.display())]
    Input {
        /// The file at fault.
        file: PathBuf,
        /// Fault and remedy.
        message: String,
    },
    /// A file could not be read; exit code 2, because the user named it.
    #[error("cannot read {file}: {source}", file = file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A file could not be written; exit code 3.
    #[error("cannot write {file}: {source}", file = file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The job cannot be planned under its own terms; exit code 1.
    #[error("{0}")]
    Infeasible(String),
    /// The regions of all operations are limited to what is left, and nothing is: there is no
    /// program to write; exit code 0.
    #[error("{0}")]
    NothingToCut(String),
    /// A fault of this program; exit code 3.
    #[error("internal failure: {0}")]
    Internal(String),
    /// Stopped by the user; exit code 130.
    #[error("interrupted; nothing was written")]
    Interrupted,
}

impl Failure {
    /// Returns a [`Failure::Input`] about `file`.
    pub fn input(file: &Path, message: impl ToString) -> Self {
        Self::Input { file: file.to_owned(), message: message.to_string() }
    }

    /// Returns the exit code: 0 nothing to cut, 1 infeasible, 2 bad input, 3 input/output or
    /// internal failure, 130 interrupted. Code 4 means a plan whose program has faults
    /// ([`Outcome`](crate::format::report::outcome::Outcome)), which is no failure.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::NothingToCut(_) => 0,
            Self::Infeasible(_) => 1,
            Self::Input { .. } | Self::Read { .. } => 2,
            Self::Write { .. } | Self::Internal(_) => 3,
            Self::Interrupted => 130,
        })
    }
}

impl From<PathError> for Failure {
    fn from(error: PathError) -> Self {
        match error {
            PathError::Blocked(why) => Self::Infeasible(why),
            PathError::Fault(why) => Self::Internal(why),
            PathError::Cancelled => Self::Interrupted,
            other => Self::Internal(other.to_string()),
        }
    }
}

impl From<facemill_cl_data::Cancelled> for Failure {
    fn from(_: facemill_cl_data::Cancelled) -> Self {
        Self::Interrupted
    }
}
