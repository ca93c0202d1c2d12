//! Loops with checkpoints, at which an [`Observer`] may cancel them.

use std::cmp::Ordering;

use super::error::Result;
pub use gramian_observer::{Cancelled, Observer, Stage, Unobserved, WithoutStages};

/// Items between two checkpoints of a loop that takes up to a microsecond for each.
const AT_ONCE: usize = 1 << 13;

/// Calls a function with each item, with checkpoints in between.
///
/// # Errors
/// [`NumericsError::Cancelled`](super::error::NumericsError::Cancelled).
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
/// [`NumericsError::Cancelled`](super::error::NumericsError::Cancelled).
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
    use crate::error::NumericsError;
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
