//! The durable store of clouds, and how far it lags behind the acknowledged registrations.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::Notify;

use crate::store::objects::{CloudObjects, Retention};
use gramian_host::store::{Objects, Place};

/// The durable store, with counters of its backlog and size.
pub struct Durable {
    pub objects: CloudObjects,
    /// Number of clouds that the store refused, and how many of these have been offered again since.
    pub n_refused: AtomicU64,
    pub n_offered_again: AtomicU64,
    /// Size of the store: the result of the last sweep, plus what was written since.
    pub n_clouds: AtomicU64,
    pub n_bytes: AtomicU64,
    pub n_factor_bytes: AtomicU64,
    /// Wakes the sweep when clouds or factors exceed their limit in bytes.
    pub is_full: Notify,
    /// Held while a factor is written.
    pub writing_factor: tokio::sync::Mutex<()>,
}

impl Durable {
    /// Opens the store.
    ///
    /// # Errors
    /// Tells what is wrong with the place.
    pub async fn open(place: &Place) -> Result<Self, String> {
        let variables = std::env::vars_os();
        let variables =
            variables.filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)));
        let objects = Objects::open(place, variables).await?;
        Ok(Self {
            objects: CloudObjects(Arc::new(objects)),
            n_refused: AtomicU64::new(0),
            n_offered_again: AtomicU64::new(0),
            n_clouds: AtomicU64::new(0),
            n_bytes: AtomicU64::new(0),
            n_factor_bytes: AtomicU64::new(0),
            is_full: Notify::new(),
            writing_factor: tokio::sync::Mutex::default(),
        })
    }

    /// Whether everything acknowledged outlives the process.
    pub fn is_up_to_date(&self) -> bool {
        self.n_offered_again.load(Ordering::Acquire) == self.n_refused.load(Ordering::Acquire)
    }

    /// Approximate bytes of factors in the store.
    pub fn factor_bytes(&self) -> u64 {
        self.n_factor_bytes.load(Ordering::Relaxed)
    }

    /// Approximate number of clouds in the store, and their bytes.
    pub fn size(&self) -> (u64, u64) {
        (self.n_clouds.load(Ordering::Relaxed), self.n_bytes.load(Ordering::Relaxed))
    }

    pub fn grew_by(&self, n_bytes: u64, limits: Retention) {
        self.n_clouds.fetch_add(1, Ordering::Relaxed);
        let n_bytes = n_bytes + self.n_bytes.fetch_add(n_bytes, Ordering::Relaxed);
        if limits.n_bytes.is_some_and(|most| n_bytes > most) {
            self.is_full.notify_one();
        }
    }

    pub fn fell_behind(&self, reason: &dyn std::fmt::Display) {
        let was_up_to_date = self.is_up_to_date();
        self.n_refused.fetch_add(1, Ordering::AcqRel);
        if was_up_to_date {
            tracing::error!(%reason, "clouds are kept in memory only until the store accepts them");
        }
    }
}
