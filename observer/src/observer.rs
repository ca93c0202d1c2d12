//! Progress reports to the caller of a computation, and cancellation when nobody waits for it any more.

/// Reason why a computation ended without a result: nobody waits for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the computation was cancelled")]
pub struct Cancelled;

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

    /// Called when work ended long before its price was spent, so that its duration does not predict that of
    /// similar work: an iteration that converged at once, or weights that were known.
    fn ended_early(&self) {}

    /// Fails if the work should stop.
    ///
    /// # Errors
    /// [`Cancelled`] once the caller is gone.
    fn checkpoint(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// An observer for work beside that of a request. It passes cancellation on, but reports no stages.
pub struct WithoutStages<'a>(pub &'a dyn Observer);

impl Observer for WithoutStages<'_> {
    fn enter(&self, _stage: Stage) {}

    fn ended_early(&self) {
        self.0.ended_early();
    }

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
