//! Signs of life of a lane.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The last signs of life of a lane.
pub(super) struct Pulse {
    began: Instant,
    /// Milliseconds at which a job last came to a checkpoint, or a probe through.
    last: AtomicU64,
    /// A probe is under way.
    pub(super) is_probed: AtomicBool,
}

impl Pulse {
    pub(super) fn new() -> Arc<Self> {
        Arc::new(Self { began: Instant::now(), last: AtomicU64::new(0), is_probed: AtomicBool::new(false) })
    }

    /// A sign of life.
    pub(super) fn beat(&self) {
        self.last.store(self.began.elapsed().as_millis() as u64, Ordering::Relaxed);
    }

    /// How long ago the last one was.
    pub(super) fn silence(&self) -> Duration {
        self.began.elapsed().saturating_sub(Duration::from_millis(self.last.load(Ordering::Relaxed)))
    }
}
