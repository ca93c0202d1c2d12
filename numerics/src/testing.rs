//! Clouds, kernels and observers for the unit tests of this layer. Clouds and kernels are those of the
//! integration tests.

#[path = "../tests/common/clouds.rs"]
mod clouds;
#[path = "../tests/common/kernels.rs"]
mod kernels;
#[path = "../tests/common/random.rs"]
mod random;

pub(crate) use clouds::{circle, fibonacci_sphere};
pub(crate) use kernels::all_families;
pub(crate) use random::Random;

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::observer::{Observer, Stage};

/// An observer that cancels from the checkpoint of this number on, and counts checkpoints.
pub(crate) struct StopAt {
    checkpoint: usize,
    n_checkpoints: AtomicUsize,
}

impl StopAt {
    pub(crate) fn checkpoint(checkpoint: usize) -> Self {
        Self { checkpoint, n_checkpoints: AtomicUsize::new(0) }
    }

    /// An observer that only counts.
    pub(crate) fn never() -> Self {
        Self::checkpoint(usize::MAX)
    }

    pub(crate) fn n_checkpoints(&self) -> usize {
        self.n_checkpoints.load(Ordering::Relaxed)
    }
}

impl Observer for StopAt {
    fn enter(&self, _stage: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.n_checkpoints.fetch_add(1, Ordering::Relaxed) >= self.checkpoint
    }
}
