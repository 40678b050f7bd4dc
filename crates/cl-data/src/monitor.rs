//! Progress and cancellation of long computations.

/// Progress and cancellation of a long computation, passed as an argument by the user interface.
///
/// Results never depend on it, except that a cancelled computation has none.
pub trait Monitor: Sync {
    /// Reports that `steps` more steps are done; the called function defines a step.
    fn advance(&self, steps: usize);
    /// Returns whether to stop as soon as possible. Queried at least once a step.
    fn is_cancelled(&self) -> bool;

    /// Returns `Err(Cancelled)` when [`Monitor::is_cancelled`], for use with `?`.
    ///
    /// # Errors
    /// When the computation has been cancelled.
    fn checkpoint(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// A [`Monitor`] that shows nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Monitor for Silent {
    fn advance(&self, _steps: usize) {}
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// The computation was stopped by its [`Monitor`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;
