//! Transitions of a cloud between memory and the store: post, use, read, new offer and deletion.
//!
//! TRUTH. A cloud exists if its object is in the store (objects/clouds.rs), or if it is pending. A pending
//! cloud was acknowledged, but is in memory alone because the store failed to take it. Everything else in
//! memory is a cache of the store.
//!
//! TURNS. Every change of a cloud, in the store or in memory, holds the turn of the cloud: a lock per cloud
//! (turns.rs). So this process makes one change at a time. Between processes the store decides: only one of
//! them creates an object, and a deletion is a single step.
//!
//! ```text
//!              written, or found in the store              not in the store any more
//!  Unwritten ────────────────────────────────→ Stored ────────────────────────────────→ gone
//!      │ the store fails                          ↑ offered again, and written
//!      └────────────────→ Pending ────────────────┘          DELETE: from each of them
//!
//!  Unwritten, by DELETE → Deleted: it is no longer written
//! ```

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;

use super::registered::Standing;
use super::{CloudStore, RegisteredCloud};
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::StoredCloud;
use crate::store::objects::{CloudObjects, Written};
use gramian_host::memory::Owner;
use gramian_host::store::{DamagedObject, OwnerName, Unavailable};

/// An owner of clouds, by its number in this process and by its name in the store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    pub owner: Owner,
    pub name: OwnerName,
}

/// Outcome of an attempt to keep a cloud beyond the process.
#[derive(Debug)]
pub enum StoreOutcome {
    /// The cloud is new to the store and takes this many bytes there.
    Written(u64),
    /// The cloud was kept already.
    Known,
    /// The cloud was registered, and deleted before it was written.
    Deleted,
    /// The store failed to take the cloud, for this reason. Memory keeps it until the store takes it.
    Pending(String),
    /// The store failed to take the cloud, for this reason, and memory does not have it either.
    Nowhere(String),
}

/// Outcome of a look-up in memory, after a check with the store if one was due.
pub enum CloudLookup {
    InMemory(Arc<RegisteredCloud>),
    /// The cloud was in memory but is no longer in the store.
    Gone,
    Unknown,
}

impl<E: Clone + Send + Sync + 'static> CloudStore<E> {
    /// Makes a cloud outlive the process. `encode` is called only if the cloud has to be written.
    pub async fn keep<F>(
        &self,
        objects: &CloudObjects,
        holder: &Holder,
        cloud: &Arc<RegisteredCloud>,
        encode: impl FnOnce() -> F,
    ) -> StoreOutcome
    where
        F: Future<Output = Result<Vec<Bytes>, String>>,
    {
        let _turn = self.turns.take((holder.owner, cloud.id)).await;
        let is_known = match cloud.standing() {
            Standing::Deleted => return StoreOutcome::Deleted,
            Standing::Unwritten => false,
            Standing::Pending => self.has(holder.owner, cloud),
            // Another process may have deleted it.
            Standing::Stored { .. } => is_still_stored(objects, holder, cloud).await,
        };
        if is_known {
            return StoreOutcome::Known;
        }
        if cloud.is_stored() {
            cloud.set_unwritten();
        }
        match write(objects, holder, cloud, encode).await {
            Ok(kept) => kept,
            Err(reason) => {
                // The mark comes before the check, because memory never evicts a pending cloud.
                cloud.set_pending();
                if self.has(holder.owner, cloud) {
                    StoreOutcome::Pending(reason)
                } else {
                    StoreOutcome::Nowhere(reason)
                }
            }
        }
    }

    /// Offers a pending cloud to the store again. Returns `None` if it is no longer pending, or was deleted.
    pub async fn offer<F>(
        &self,
        objects: &CloudObjects,
        holder: &Holder,
        cloud: &Arc<RegisteredCloud>,
        encode: impl FnOnce() -> F,
    ) -> Option<StoreOutcome>
    where
        F: Future<Output = Result<Vec<Bytes>, String>>,
    {
        let _turn = self.turns.take((holder.owner, cloud.id)).await;
        if !cloud.is_pending() || !self.has(holder.owner, cloud) {
            return None;
        }
        Some(write(objects, holder, cloud, encode).await.unwrap_or_else(StoreOutcome::Pending))
    }

    /// Finds a cloud in memory. The store is queried first if the cloud was last seen there `trust` ago or
    /// earlier. While the store does not answer, the cloud in memory is assumed to be still stored.
    pub async fn recall(
        &self,
        objects: &CloudObjects,
        holder: &Holder,
        id: CloudId,
        trust: Duration,
    ) -> CloudLookup {
        let Some(cloud) = self.get(holder.owner, id) else { return CloudLookup::Unknown };
        if cloud.is_trusted(trust) {
            return CloudLookup::InMemory(cloud);
        }
        let _turn = self.turns.take((holder.owner, id)).await;
        // Other tasks may have asked about it, or changed it, before this turn.
        let Some(cloud) = self.get(holder.owner, id) else { return CloudLookup::Unknown };
        if cloud.is_trusted(trust) || is_still_stored(objects, holder, &cloud).await {
            return CloudLookup::InMemory(cloud);
        }
        self.clouds.remove(holder.owner, &id);
        CloudLookup::Gone
    }

    /// Takes a cloud that was read from the store into memory, unless it was deleted meanwhile. A damaged
    /// cloud is moved aside.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn take_in(
        &self,
        objects: &CloudObjects,
        holder: &Holder,
        id: CloudId,
        read: Result<StoredCloud, DamagedObject>,
    ) -> Result<Option<Arc<RegisteredCloud>>, Unavailable> {
        let _turn = self.turns.take((holder.owner, id)).await;
        if let Some(cloud) = self.get(holder.owner, id) {
            return Ok(Some(cloud));
        }
        match read {
            Err(damaged) => {
                objects.put_aside(&holder.name, id, damaged).await;
                Ok(None)
            }
            Ok(_) if objects.cloud_bytes(&holder.name, id).await?.is_none() => Ok(None),
            Ok(stored) => {
                let cloud = Arc::new(RegisteredCloud::restored(id, stored));
                Ok(Some(self.clouds.get_or_insert(holder.owner, id, cloud, |cloud| cloud.n_bytes()).0))
            }
        }
    }

    /// Moves a damaged cloud aside. It holds the turn of the cloud, so this process does not write it
    /// meanwhile.
    pub(super) async fn put_aside(
        &self,
        objects: &CloudObjects,
        holder: &Holder,
        id: CloudId,
        damaged: DamagedObject,
    ) {
        let _turn = self.turns.take((holder.owner, id)).await;
        objects.put_aside(&holder.name, id, damaged).await;
    }

    /// Deletes a cloud from store and memory. Returns whether it existed. Of concurrent deletions in this
    /// process, one returns true.
    ///
    /// # Errors
    /// [`Unavailable`]: nothing is deleted, as far as the store tells.
    pub async fn forget(
        &self,
        objects: Option<&CloudObjects>,
        holder: &Holder,
        id: CloudId,
    ) -> Result<bool, Unavailable> {
        let _turn = self.turns.take((holder.owner, id)).await;
        let was_stored = match objects {
            None => false,
            Some(objects) => objects.delete_cloud(&holder.name, id).await?,
        };
        let was_unstored = self.clouds.remove(holder.owner, &id).is_some_and(|cloud| cloud.set_deleted());
        Ok(was_stored || was_unstored)
    }

    /// Drops from memory a cloud that was not written because it could never be read back.
    pub fn drop_unreadable(&self, owner: Owner, cloud: &Arc<RegisteredCloud>) {
        if self.has(owner, cloud) {
            self.clouds.remove(owner, &cloud.id);
        }
    }

    /// Requires a check with the store before the cloud is used again: it may have been deleted there.
    pub fn distrust(&self, owner: Owner, id: CloudId) {
        if let Some(cloud) = self.clouds.peek(owner, &id) {
            cloud.set_seen(false);
        }
    }
}

/// Returns whether the store still has a cloud. If the store does not answer, it is assumed to.
async fn is_still_stored(objects: &CloudObjects, holder: &Holder, cloud: &RegisteredCloud) -> bool {
    let is_missing = matches!(objects.cloud_bytes(&holder.name, cloud.id).await, Ok(None));
    cloud.set_seen(!is_missing);
    !is_missing
}

/// Writes a cloud unless the store has it.
async fn write<F>(
    objects: &CloudObjects,
    holder: &Holder,
    cloud: &RegisteredCloud,
    encode: impl FnOnce() -> F,
) -> Result<StoreOutcome, String>
where
    F: Future<Output = Result<Vec<Bytes>, String>>,
{
    let pieces = encode().await?;
    let n_bytes = pieces.iter().map(|piece| piece.len() as u64).sum();
    let written = objects.put_cloud(&holder.name, cloud.id, pieces).await;
    match written.map_err(|error| error.to_string())? {
        Written::Now => {
            cloud.set_stored(cloud.created_at());
            Ok(StoreOutcome::Written(n_bytes))
        }
        Written::Before(since) => {
            cloud.set_stored(since);
            Ok(StoreOutcome::Known)
        }
    }
}
