//! How a computation tells its caller where it is, and learns that nobody waits for it any more.

use super::error::NumericsError;

/// The stages of an answer, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Assembly of the Gram matrix.
    Gram,
    /// Its factorization.
    Factor,
    /// The estimate of its condition.
    Condition,
    /// Solves with the factor.
    Solve,
    /// Sums over the cloud at the queries, and what is derived from them.
    Evaluate,
}

/// Receives the stages and answers whether to go on; called between blocks of work, from any thread.
pub trait Observer: Sync {
    /// Called when `stage` begins.
    fn enter(&self, stage: Stage);

    /// Whether the work should stop at the next block.
    fn is_cancelled(&self) -> bool;

    /// Called when a system is solved, with |Y − (K + αI)Λ|/|Y|.
    fn solved_to(&self, _relative_residual: f64) {}

    /// # Errors
    /// [`NumericsError::Cancelled`] once the caller is gone.
    fn checkpoint(&self) -> Result<(), NumericsError> {
        if self.is_cancelled() { Err(NumericsError::Cancelled) } else { Ok(()) }
    }
}

/// Work beside that of a request: it ends when nobody waits any more, and its stages are nobody's.
pub struct Beside<'a>(pub &'a dyn Observer);

impl Observer for Beside<'_> {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

/// Nobody watches and nothing is cancelled.
pub struct Unobserved;

impl Observer for Unobserved {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        false
    }
}
