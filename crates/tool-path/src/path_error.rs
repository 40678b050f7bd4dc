//! Failures of moves.

use facemill_cl_data::Cancelled;

/// Reason why poses do not become moves.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// There is no free way to the tool's target; the text gives the start and the obstacle.
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
