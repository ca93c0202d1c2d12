//! What goes by itself: clouds beyond an age or a number of bytes, oldest first, and what was damaged.

use std::collections::{HashMap, HashSet};
use std::time::{Duration, SystemTime};

use futures_util::TryStreamExt;
use object_store::ObjectMeta;

use super::tally::Verb;
use super::{CloudId, Listed, Objects, OwnerName, Unavailable};

/// How long what is damaged is kept, for whoever wants to know why.
const DAMAGED: Duration = Duration::from_secs(7 * 24 * 3600);

/// How long clouds are kept, and how much of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Retention {
    pub age: Option<Duration>,
    pub n_bytes: Option<u64>,
    /// Bytes of factors, which can be made again.
    pub n_factor_bytes: u64,
}

/// What is there, and what is not any more.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Swept {
    pub n_clouds: u64,
    pub n_bytes: u64,
    pub n_factor_bytes: u64,
    pub gone: Vec<(OwnerName, CloudId)>,
}

struct Kept {
    listed: Listed,
    owner: OwnerName,
    n_bytes: u64,
}

impl Objects {
    /// Deletes what is beyond the limits at a moment, and counts the rest.
    ///
    /// # Errors
    /// [`Unavailable`]: what was to go is gone in part then.
    pub async fn sweep(&self, limits: Retention, now: SystemTime) -> Result<Swept, Unavailable> {
        let mut kept = Vec::new();
        let owners = self.owners().await?;
        for owner in &owners {
            kept.extend(self.kept(owner).await?);
            self.forget_damaged(owner, now).await?;
        }
        kept.sort_by_key(|cloud| cloud.listed);
        let mut swept = Swept::default();
        let mut n_bytes: u64 = kept.iter().map(|cloud| cloud.n_bytes).sum();
        for cloud in kept {
            let age = now.duration_since(cloud.listed.created_at).unwrap_or_default();
            let is_too_old = limits.age.is_some_and(|most| age > most);
            if is_too_old || limits.n_bytes.is_some_and(|most| n_bytes > most) {
                self.delete_listed(&cloud.owner, cloud.listed).await?;
                n_bytes -= cloud.n_bytes;
                swept.gone.push((cloud.owner, cloud.listed.id));
            } else {
                swept.n_clouds += 1;
            }
        }
        swept.n_bytes = n_bytes;
        swept.n_factor_bytes = self.sweep_factors(&owners, limits.n_factor_bytes).await?;
        Ok(swept)
    }

    /// All whose clouds there are.
    async fn owners(&self) -> Result<Vec<OwnerName>, Unavailable> {
        let found = self.store.list_with_delimiter(Some(&self.root)).await;
        let found = self.counted(Verb::List, &self.root, found)?;
        let folders = found.into_iter().flat_map(|found| found.common_prefixes);
        let name = |folder: object_store::path::Path| Some(OwnerName(folder.filename()?.to_owned()));
        Ok(folders.filter_map(name).filter(|owner| owner.0 != "probe").collect())
    }

    /// The clouds of an owner with their sizes. One that is there and not listed was not acknowledged: its writer may be at it, or has
    /// ended before it was; its time is that of its object.
    async fn kept(&self, owner: &OwnerName) -> Result<Vec<Kept>, Unavailable> {
        let listed: HashMap<CloudId, Listed> =
            self.list(owner, None).await?.into_iter().map(|listed| (listed.id, listed)).collect();
        let found = self.objects_in(owner, &["clouds"]).await?;
        let kept = found.into_iter().filter_map(|object| {
            let id = CloudId::parse(object.location.filename()?)?;
            let unlisted = Listed { created_at: object.last_modified.into(), id };
            let listed = listed.get(&id).copied().unwrap_or(unlisted);
            Some(Kept { listed, owner: owner.clone(), n_bytes: object.size })
        });
        let kept: Vec<Kept> = kept.collect();
        let there: HashSet<CloudId> = kept.iter().map(|cloud| cloud.listed.id).collect();
        // Somebody was about to delete it, and ended.
        for listed in listed.into_values().filter(|listed| !there.contains(&listed.id)) {
            self.delete(&self.listed(owner, listed)).await?;
        }
        Ok(kept)
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

    pub(super) async fn objects_in(
        &self,
        owner: &OwnerName,
        folder: &[&str],
    ) -> Result<Vec<ObjectMeta>, Unavailable> {
        let folder = self.path(&[&[&*owner.0], folder].concat());
        let found = self.store.list(Some(&folder)).try_collect().await;
        Ok(self.counted(Verb::List, &folder, found)?.unwrap_or_default())
    }

    async fn delete_listed(&self, owner: &OwnerName, listed: Listed) -> Result<(), Unavailable> {
        self.delete(&self.listed(owner, listed)).await?;
        self.delete(&self.cloud(owner, listed.id)).await?;
        self.delete_factors(owner, listed.id).await?;
        Ok(())
    }
}
