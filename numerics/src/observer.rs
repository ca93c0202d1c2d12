//! Progress reports to the caller of a computation, and cancellation when nobody waits for it any more.

use std::cmp::Ordering;

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

    /// Called when work ended long before its price was spent, so that its duration does not predict that of
    /// similar work: an iteration that converged at once, or weights that were known.
    fn ended_early(&self) {}

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

/// Items between two checkpoints of a loop that takes up to a microsecond for each.
const AT_ONCE: usize = 1 << 13;

/// Calls a function with each item, with checkpoints in between.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn for_each<T>(
    items: impl IntoIterator<Item = T>,
    observer: &dyn Observer,
    mut call: impl FnMut(T),
) -> Result<()> {
    for (at, item) in items.into_iter().enumerate() {
        if at % AT_ONCE == 0 {
            observer.checkpoint()?;
        }
        call(item);
    }
    Ok(())
}

/// Sorts a list of any length as `sort_by` does, with checkpoints in between.
///
/// Runs are sorted, and then twice as long ones. Each of these is two sorted runs, which a stable sort merges
/// in linear time.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn sort_by<T>(
    items: &mut [T],
    observer: &dyn Observer,
    compare: impl Fn(&T, &T) -> Ordering,
) -> Result<()> {
    let mut n_sorted = AT_ONCE;
    loop {
        for run in items.chunks_mut(n_sorted) {
            observer.checkpoint()?;
            run.sort_by(&compare);
        }
        if n_sorted >= items.len() {
            return Ok(());
        }
        n_sorted *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, StopAt};

    #[test]
    fn lists_are_sorted_as_by_the_standard_library_with_checkpoints_as_they_are_long() {
        let mut random = Random(0);
        for n in [0, 1, AT_ONCE, AT_ONCE + 1, 5 * AT_ONCE + 3] {
            let mut items: Vec<(u32, usize)> =
                (0..n).map(|i| ((random.uniform() * 50.0) as u32, i)).collect();
            let mut expected = items.clone();
            expected.sort_by_key(|item| item.0);
            let observer = StopAt::never();
            sort_by(&mut items, &observer, |a, b| a.0.cmp(&b.0)).unwrap();
            assert_eq!(items, expected);
            assert!(observer.n_checkpoints() >= n / AT_ONCE, "{n}");
        }
    }

    #[test]
    fn loops_stop_at_a_checkpoint() {
        let mut n_called = 0;
        let observer = StopAt::checkpoint(2);
        let outcome = for_each(0..10 * AT_ONCE, &observer, |_| n_called += 1);
        assert_eq!((outcome, n_called), (Err(NumericsError::Cancelled), 2 * AT_ONCE));
    }
}
