//! Progress reports to the caller of a computation, and cancellation when nobody waits for it any more.

use super::error::{NumericsError, Result};

/// The stages of an answer, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Assembly of the Gram matrix.
    Gram,
    /// Factorization of the Gram matrix.
    Factor,
    /// Estimate of the condition of the Gram matrix.
    Condition,
    /// Solves with the factor.
    Solve,
    /// Sums over the cloud at the queries, and quantities derived from them.
    Evaluate,
}

/// A receiver of stages that can cancel. It is called between blocks of work, from any thread.
pub trait Observer: Sync {
    /// Called when `stage` begins.
    fn enter(&self, stage: Stage);

    /// Returns whether the work should stop at the next block.
    fn is_cancelled(&self) -> bool;

    /// Called when a system is solved, with the relative residual |Y − (K + αI)Λ|/|Y|.
    fn solved_to(&self, _relative_residual: f64) {}

    /// Fails if the work should stop.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`] once the caller is gone.
    fn checkpoint(&self) -> Result<()> {
        if self.is_cancelled() { Err(NumericsError::Cancelled) } else { Ok(()) }
    }
}

/// An observer for work beside that of a request. It passes cancellation on, but reports no stages.
pub struct WithoutStages<'a>(pub &'a dyn Observer);

impl Observer for WithoutStages<'_> {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

/// An observer that ignores stages and never cancels.
pub struct Unobserved;

impl Observer for Unobserved {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        false
    }
}
