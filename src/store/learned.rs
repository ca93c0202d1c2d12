//! What was learned from values, so that they are looked at once.

use std::sync::Arc;

use super::Owner;
use super::fair_cache::FairCache;
use super::key::{CloudId, ValuesKey};
use super::single_flight::SingleFlight;
use gramian_numerics::machine::heap::{arc_payload, block_bytes};
use gramian_numerics::selection::Learned;

/// Bytes of everything that is kept here: thousands of entries, a part of what the process takes by itself.
const MAX_BYTES: usize = 1 << 20;

/// Values at the points of a cloud, with what was said of their mean and noise.
pub type LearnedKey = (Owner, CloudId, ValuesKey);

/// What was learned lately. `E` is what a computation may fail with.
pub struct LearnedStore<E> {
    kept: Arc<FairCache<LearnedKey, Arc<Learned>>>,
    flights: SingleFlight<LearnedKey, Arc<Learned>, E>,
}

impl<E: Clone + Send + Sync + 'static> Default for LearnedStore<E> {
    fn default() -> Self {
        Self { kept: Arc::new(FairCache::new(MAX_BYTES)), flights: SingleFlight::new() }
    }
}

impl<E: Clone + Send + Sync + 'static> LearnedStore<E> {
    /// What was learned from these values, if it is kept.
    pub fn get(&self, key: LearnedKey) -> Option<Arc<Learned>> {
        self.kept.get(key.0, &key)
    }

    /// What is learned from these values, by `compute` at most once however many ask.
    ///
    /// # Errors
    /// Those of `compute`; they are not kept.
    pub async fn get_or_learn<F>(
        &self,
        key: LearnedKey,
        compute: impl FnOnce() -> F,
    ) -> Result<Arc<Learned>, E>
    where
        F: Future<Output = Result<Learned, E>> + Send + 'static,
    {
        if let Some(found) = self.get(key) {
            return Ok(found);
        }
        let kept = self.kept.clone();
        let begin = || {
            let learning = compute();
            async move {
                // A flight may have landed between the look-up and this one's beginning.
                if let Some(found) = kept.get(key.0, &key) {
                    return Ok(found);
                }
                let learned = Arc::new(learning.await?);
                let n_bytes = block_bytes(arc_payload::<Learned>()) + learned.n_bytes();
                kept.insert(key.0, key, learned.clone(), n_bytes);
                Ok(learned)
            }
        };
        self.flights.join(key, begin).await.1
    }

    /// Forgets what was learned from values on a cloud.
    pub fn forget_cloud(&self, owner: Owner, id: CloudId) {
        self.kept.remove_if(owner, |(_, of, _)| *of == id);
    }
}
