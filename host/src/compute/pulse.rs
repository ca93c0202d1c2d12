//! Signs of life of a lane.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time of the last sign of life of a lane.
pub(super) struct Pulse {
    began: Instant,
    /// Milliseconds since `began` at the last checkpoint of a job or the last probe.
    last: AtomicU64,
    /// Whether a probe is pending.
    pub(super) is_probed: AtomicBool,
}

impl Pulse {
    pub(super) fn new() -> Arc<Self> {
        Arc::new(Self { began: Instant::now(), last: AtomicU64::new(0), is_probed: AtomicBool::new(false) })
    }

    /// Records a sign of life.
    pub(super) fn beat(&self) {
        self.last.store(self.began.elapsed().as_millis() as u64, Ordering::Relaxed);
    }

    /// Time since the last sign of life.
    pub(super) fn silence(&self) -> Duration {
        self.began.elapsed().saturating_sub(Duration::from_millis(self.last.load(Ordering::Relaxed)))
    }
}
