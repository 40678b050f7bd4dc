//! Failures of moves.

use facemill_cl_data::Cancelled;

/// Why poses do not become moves.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// No free way leads where the tool has to go; the text says from where, and what is in the
    /// way.
    #[error("{0}")]
    Blocked(String),
    /// A fault of this program.
    #[error("internal failure: {0}")]
    Fault(String),
    /// The monitor stopped the computation.
    #[error("cancelled")]
    Cancelled,
}

impl From<Cancelled> for PathError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}
