//! Clouds behind memory: what becomes of a cloud when it is posted, used, read, offered again or deleted.
//!
//! TRUTH. A cloud is there when its object is in the store (objects/clouds.rs), or when it is pending:
//! acknowledged, and in memory alone because the store failed to take it. Everything else in memory is a
//! cache of the store.
//!
//! TURNS. Every change of a cloud, in the store and in memory, happens in its turn, so that this process
//! makes one at a time. What other processes change, the store decides: an object is created by one of them,
//! and deleting it is one step.
//!
//! ```text
//!              written, or found in the store              not in the store any more
//!  Unwritten ────────────────────────────────→ Stored ────────────────────────────────→ gone
//!      │ the store fails                          ↑ offered again, and written
//!      └────────────────→ Pending ────────────────┘          DELETE: from each of them
//!
//!  Unwritten, by DELETE → Deleted: it is not written any more
//! ```

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;

use super::registered::Standing;
use super::{CloudStore, RegisteredCloud};
use crate::store::Owner;
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::StoredCloud;
use crate::store::objects::{Damaged, Objects, OwnerName, Unavailable, Written};

/// An owner of clouds, by its number in this process and by its name in the store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    pub owner: Owner,
    pub name: OwnerName,
}

/// What came of keeping a cloud.
#[derive(Debug)]
pub enum Kept {
    /// It is new to the store, where it takes so many bytes.
    Written(u64),
    /// It was there.
    Known,
    /// It was registered, and deleted before it was written.
    Deleted,
    /// The store failed to take it, for this reason: memory keeps it until the store does.
    Pending(String),
    /// The store failed to take it, and memory does not have it either.
    Nowhere(String),
}

/// What memory knows of a cloud, once the store was asked where that was due.
pub enum Recalled {
    Here(Arc<RegisteredCloud>),
    /// Memory had it, and the store does not any more.
    Gone,
    Unknown,
}

impl<E: Clone + Send + Sync + 'static> CloudStore<E> {
    /// Sees to it that a cloud outlives the process, encoded by `encode` if it has to be written.
    pub async fn keep<F>(
        &self,
        objects: &Objects,
        holder: &Holder,
        cloud: &Arc<RegisteredCloud>,
        encode: impl FnOnce() -> F,
    ) -> Kept
    where
        F: Future<Output = Result<Vec<Bytes>, String>>,
    {
        let _turn = self.turns.take((holder.owner, cloud.id)).await;
        let is_known = match cloud.standing() {
            Standing::Deleted => return Kept::Deleted,
            Standing::Unwritten => false,
            Standing::Pending => self.has(holder.owner, cloud),
            // Another process may have deleted it.
            Standing::Stored { .. } => is_still_stored(objects, holder, cloud).await,
        };
        if is_known {
            return Kept::Known;
        }
        if cloud.is_stored() {
            cloud.set_unwritten();
        }
        match write(objects, holder, cloud, encode).await {
            Ok(kept) => kept,
            Err(reason) => {
                // First, because memory does not let go of what is pending.
                cloud.set_pending();
                match self.has(holder.owner, cloud) {
                    true => Kept::Pending(reason),
                    false => Kept::Nowhere(reason),
                }
            }
        }
    }

    /// Offers a pending cloud to the store again. Answers `None` if it is not pending any more, or was
    /// deleted.
    pub async fn offer<F>(
        &self,
        objects: &Objects,
        holder: &Holder,
        cloud: &Arc<RegisteredCloud>,
        encode: impl FnOnce() -> F,
    ) -> Option<Kept>
    where
        F: Future<Output = Result<Vec<Bytes>, String>>,
    {
        let _turn = self.turns.take((holder.owner, cloud.id)).await;
        if !cloud.is_pending() || !self.has(holder.owner, cloud) {
            return None;
        }
        Some(write(objects, holder, cloud, encode).await.unwrap_or_else(Kept::Pending))
    }

    /// Finds a cloud in memory. The store is asked for it first if it was last seen there `trust` ago or
    /// earlier. While the store does not answer, memory is believed.
    pub async fn recall(&self, objects: &Objects, holder: &Holder, id: CloudId, trust: Duration) -> Recalled {
        let Some(cloud) = self.get(holder.owner, id) else { return Recalled::Unknown };
        if cloud.is_trusted(trust) {
            return Recalled::Here(cloud);
        }
        let _turn = self.turns.take((holder.owner, id)).await;
        // Others may have asked, or changed it, before this turn.
        let Some(cloud) = self.get(holder.owner, id) else { return Recalled::Unknown };
        if cloud.is_trusted(trust) || is_still_stored(objects, holder, &cloud).await {
            return Recalled::Here(cloud);
        }
        self.clouds.remove(holder.owner, &id);
        Recalled::Gone
    }

    /// Takes a cloud that was read from the store into memory, unless it was deleted meanwhile. A damaged one
    /// is put aside.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn take_in(
        &self,
        objects: &Objects,
        holder: &Holder,
        id: CloudId,
        read: Result<StoredCloud, Damaged>,
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

    /// Puts a damaged cloud aside in its turn, so that nobody in this process writes it meanwhile.
    pub(super) async fn put_aside(&self, objects: &Objects, holder: &Holder, id: CloudId, damaged: Damaged) {
        let _turn = self.turns.take((holder.owner, id)).await;
        objects.put_aside(&holder.name, id, damaged).await;
    }

    /// Deletes a cloud from store and memory; says whether it was there. Of several that delete it at once in
    /// this process, one finds it there.
    ///
    /// # Errors
    /// [`Unavailable`]: nothing is deleted, as far as the store tells.
    pub async fn forget(
        &self,
        objects: Option<&Objects>,
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

    /// Lets go of a cloud that is not written, because it could not be read again.
    pub fn drop_unreadable(&self, owner: Owner, cloud: &Arc<RegisteredCloud>) {
        if self.has(owner, cloud) {
            self.clouds.remove(owner, &cloud.id);
        }
    }

    /// Has the store asked before a cloud is used again: it may have been let go there.
    pub fn distrust(&self, owner: Owner, id: CloudId) {
        if let Some(cloud) = self.clouds.peek(owner, &id) {
            cloud.set_seen(false);
        }
    }
}

/// Whether the store has a cloud still, or does not say.
async fn is_still_stored(objects: &Objects, holder: &Holder, cloud: &RegisteredCloud) -> bool {
    let is_missing = matches!(objects.cloud_bytes(&holder.name, cloud.id).await, Ok(None));
    cloud.set_seen(!is_missing);
    !is_missing
}

/// Writes a cloud unless the store has it.
async fn write<F>(
    objects: &Objects,
    holder: &Holder,
    cloud: &RegisteredCloud,
    encode: impl FnOnce() -> F,
) -> Result<Kept, String>
where
    F: Future<Output = Result<Vec<Bytes>, String>>,
{
    let pieces = encode().await?;
    let n_bytes = pieces.iter().map(|piece| piece.len() as u64).sum();
    let written = objects.put_cloud(&holder.name, cloud.id, pieces).await;
    match written.map_err(|error| error.to_string())? {
        Written::Now => {
            cloud.set_stored(cloud.created_at());
            Ok(Kept::Written(n_bytes))
        }
        Written::Before(since) => {
            cloud.set_stored(since);
            Ok(Kept::Known)
        }
    }
}
