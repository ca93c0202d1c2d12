//! Sweeps of the store. Clouds beyond an age or a number of bytes are deleted, the oldest first of the owner
//! who holds most. Damaged objects are deleted after a week.

use std::cmp::Reverse;
use std::collections::{HashSet, VecDeque};
use std::time::{Duration, SystemTime};

use object_store::ObjectMeta;

use super::clouds::FOLDER;
use super::{CloudObjects, CloudPlace};
use crate::store::key::CloudId;
use gramian_host::store::{OwnerName, Unavailable};

/// Time for which damaged objects are kept for diagnosis.
const DAMAGED: Duration = Duration::from_secs(7 * 24 * 3600);

/// A folder of drafts of this service before 0.1.0, which listed clouds by empty objects.
const FORMER_LIST: &str = "listed";

/// Limits on the age and the bytes of stored clouds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Retention {
    pub age: Option<Duration>,
    pub n_bytes: Option<u64>,
    /// Most bytes of factors, which can be recomputed.
    pub n_factor_bytes: u64,
}

/// Result of a sweep: what is left, and which clouds were deleted.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Swept {
    pub n_clouds: u64,
    pub n_bytes: u64,
    pub n_factor_bytes: u64,
    pub gone: Vec<(OwnerName, CloudId)>,
}

struct OwnedCloud {
    listed: CloudPlace,
    n_bytes: u64,
}

/// Clouds of an owner, the oldest first.
struct Holding {
    owner: OwnerName,
    clouds: VecDeque<OwnedCloud>,
    n_bytes: u64,
}

impl Holding {
    fn new(owner: OwnerName, mut clouds: Vec<OwnedCloud>) -> Self {
        clouds.sort_by_key(|cloud| cloud.listed);
        let n_bytes = clouds.iter().map(|cloud| cloud.n_bytes).sum();
        Self { owner, clouds: clouds.into(), n_bytes }
    }

    fn pop_oldest(&mut self) -> Option<CloudPlace> {
        let OwnedCloud { listed, n_bytes } = self.clouds.pop_front()?;
        self.n_bytes -= n_bytes;
        Some(listed)
    }

    fn into_ids(self) -> (OwnerName, HashSet<CloudId>) {
        (self.owner, self.clouds.into_iter().map(|cloud| cloud.listed.id).collect())
    }
}

/// Removes and returns the next cloud to delete, if any. First come clouds that are too old. Beyond the byte
/// limit it is the oldest of the owner who holds most. So no owner loses clouds within an equal share to
/// another.
fn next_to_go(
    holdings: &mut [Holding],
    limits: Retention,
    now: SystemTime,
) -> Option<(OwnerName, CloudPlace)> {
    let is_too_old = |cloud: &OwnedCloud| {
        let age = now.duration_since(cloud.listed.since).unwrap_or_default();
        limits.age.is_some_and(|most| age > most)
    };
    let old = holdings.iter().position(|holding| holding.clouds.front().is_some_and(is_too_old));
    let at = match old {
        Some(at) => at,
        None => {
            let n_bytes: u64 = holdings.iter().map(|holding| holding.n_bytes).sum();
            limits.n_bytes.filter(|&most| n_bytes > most)?;
            let oldest = |holding: &Holding| Reverse(holding.clouds.front().map(|cloud| cloud.listed));
            (0..holdings.len()).max_by_key(|&at| (holdings[at].n_bytes, oldest(&holdings[at])))?
        }
    };
    let holding = &mut holdings[at];
    Some((holding.owner.clone(), holding.pop_oldest()?))
}

impl CloudObjects {
    /// Deletes what exceeds the limits at time `now`, and counts the rest.
    ///
    /// # Errors
    /// [`Unavailable`]. Part of the deletions may then be done.
    pub async fn sweep(&self, limits: Retention, now: SystemTime) -> Result<Swept, Unavailable> {
        let mut holdings = Vec::new();
        for owner in self.owners().await? {
            let clouds = self.kept(&owner).await?;
            self.forget_damaged(&owner, now).await?;
            self.forget_former_list(&owner).await?;
            holdings.push(Holding::new(owner, clouds));
        }
        self.remove_half_written(now).await;
        let mut swept = Swept::default();
        while let Some((owner, listed)) = next_to_go(&mut holdings, limits, now) {
            self.let_go(&owner, listed).await?;
            swept.gone.push((owner, listed.id));
        }
        swept.n_bytes = holdings.iter().map(|holding| holding.n_bytes).sum();
        swept.n_clouds = holdings.iter().map(|holding| holding.clouds.len() as u64).sum();
        let there: Vec<_> = holdings.into_iter().map(Holding::into_ids).collect();
        swept.n_factor_bytes = self.sweep_factors(&there, limits.n_factor_bytes, now).await?;
        Ok(swept)
    }

    /// Clouds of an owner with their sizes.
    async fn kept(&self, owner: &OwnerName) -> Result<Vec<OwnedCloud>, Unavailable> {
        let found = self.objects_in(owner, &[FOLDER]).await?;
        let kept =
            |object: &ObjectMeta| Some(OwnedCloud { listed: CloudPlace::of(object)?, n_bytes: object.size });
        Ok(found.iter().filter_map(kept).collect())
    }

    async fn forget_former_list(&self, owner: &OwnerName) -> Result<(), Unavailable> {
        for object in self.objects_in(owner, &[FORMER_LIST]).await? {
            self.delete(&object.location).await?;
        }
        Ok(())
    }

    async fn forget_damaged(&self, owner: &OwnerName, now: SystemTime) -> Result<(), Unavailable> {
        for object in self.objects_in(owner, &["damaged"]).await? {
            let age = now.duration_since(object.last_modified.into()).unwrap_or_default();
            if age > DAMAGED {
                self.delete(&object.location).await?;
            }
        }
        Ok(())
    }
}
