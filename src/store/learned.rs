//! A cache of facts learned from values, so that each set of values is analysed once.

use std::sync::Arc;

use super::key::{CloudId, ValuesKey};
use gramian_host::memory::Owner;
use gramian_host::memory::fair_cache::FairCache;
use gramian_host::memory::single_flight::SingleFlight;
use gramian_numerics::machine::heap::{arc_payload, block_bytes};
use gramian_numerics::regression::selection::LearnedModel;

/// Bytes of the whole cache: thousands of entries, and part of the fixed footprint of the process.
const MAX_BYTES: usize = 1 << 20;

/// Key of a learned entry: owner, cloud, and values with what the request said of their mean and noise.
pub type LearnedKey = (Owner, CloudId, ValuesKey);

/// Recently learned facts by cloud and values. `E` is the error of a computation.
pub struct LearnedStore<E> {
    kept: Arc<FairCache<LearnedKey, Arc<LearnedModel>>>,
    flights: SingleFlight<LearnedKey, Arc<LearnedModel>, E>,
}

impl<E: Clone + Send + Sync + 'static> Default for LearnedStore<E> {
    fn default() -> Self {
        Self { kept: Arc::new(FairCache::new(MAX_BYTES)), flights: SingleFlight::default() }
    }
}

impl<E: Clone + Send + Sync + 'static> LearnedStore<E> {
    /// The facts learned from these values, if they are cached.
    pub fn get(&self, key: LearnedKey) -> Option<Arc<LearnedModel>> {
        self.kept.get(key.0, &key)
    }

    /// Returns the facts learned from these values. Concurrent callers share one run of `compute`.
    ///
    /// # Errors
    /// Returns the errors of `compute`. They are not cached.
    pub async fn get_or_learn<F>(
        &self,
        key: LearnedKey,
        compute: impl FnOnce() -> F,
    ) -> Result<Arc<LearnedModel>, E>
    where
        F: Future<Output = Result<LearnedModel, E>> + Send + 'static,
    {
        if let Some(found) = self.get(key) {
            return Ok(found);
        }
        let kept = self.kept.clone();
        let begin = || {
            let learning = compute();
            async move {
                // Another flight may have landed between the look-up and the start of this one.
                if let Some(found) = kept.get(key.0, &key) {
                    return Ok(found);
                }
                let learned = Arc::new(learning.await?);
                let n_bytes = block_bytes(arc_payload::<LearnedModel>()) + learned.n_bytes();
                kept.insert(key.0, key, learned.clone(), n_bytes);
                Ok(learned)
            }
        };
        self.flights.join(key, begin).await.1
    }

    /// Removes everything learned from values on a cloud.
    pub fn forget_cloud(&self, owner: Owner, id: CloudId) {
        self.kept.remove_if(owner, |(_, of, _)| *of == id);
    }
}
