//! Clouds as objects: written, found, listed and deleted.
//!
//! ONE OBJECT is one cloud: `<owner>/clouds/<cloud id>`. The cloud exists in every answer if and only if the
//! object does. The list consists of the objects of that folder in the order in which the store took them. So
//! no second record could disagree.

use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::{StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStoreExt, PutPayload};

use super::CloudObjects;
use super::cloud_object::{self, CloudHead};
use crate::store::key::CloudId;
use gramian_host::store::{DamagedObject, OwnerName, Unavailable, Verb};

/// Number of heads read concurrently.
const HEADS_AT_ONCE: usize = 32;

/// Bytes read first, which contain the head of most clouds.
const FIRST_BYTES: u64 = 1024;
/// Most bytes of any head.
const MAX_HEAD_BYTES: u64 = 1 << 20;

/// The folder of an owner's clouds.
pub(super) const FOLDER: &str = "clouds";

/// A place in a list of clouds. Places are ordered by time, ties by id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CloudPlace {
    /// Time at which the store took the cloud, to the precision of the store. For a cloud in memory alone:
    /// its time of registration.
    pub since: SystemTime,
    pub id: CloudId,
}

/// A window of a list: at most `n` places, after a given one if any.
#[derive(Debug, Clone, Copy)]
pub struct ListWindow {
    pub after: Option<CloudPlace>,
    pub n: usize,
}

/// The first places of a window, collected from places in any order. No more than these are in memory,
/// however long the list is.
struct FirstPlaces {
    window: ListWindow,
    /// Up to `n + 1` places. The extra one tells that the window is not the last.
    first: BTreeSet<CloudPlace>,
}

impl FirstPlaces {
    fn add(&mut self, place: CloudPlace) {
        if self.window.after.is_none_or(|last| place > last) {
            self.first.insert(place);
        }
        if self.first.len() > self.window.n + 1 {
            self.first.pop_last();
        }
    }

    fn into_places(self) -> (Vec<CloudPlace>, bool) {
        let is_last = self.first.len() <= self.window.n;
        (self.first.into_iter().take(self.window.n).collect(), is_last)
    }
}

impl ListWindow {
    fn begin(self) -> FirstPlaces {
        FirstPlaces { window: self, first: BTreeSet::new() }
    }

    /// Returns the places of this window among some, in order, and whether they are the last.
    pub fn first_of(self, places: impl Iterator<Item = CloudPlace>) -> (Vec<CloudPlace>, bool) {
        let mut first = self.begin();
        places.for_each(|place| first.add(place));
        first.into_places()
    }
}

/// Outcome of writing a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    Now,
    /// The cloud existed, with this time of registration.
    Before(SystemTime),
}

impl CloudObjects {
    /// Writes the object of a cloud, made by [`cloud_object::encode`], unless it exists.
    ///
    /// # Errors
    /// [`Unavailable`]. The object may exist nevertheless, if the store took it and its answer was lost.
    pub async fn put_cloud(
        &self,
        owner: &OwnerName,
        id: CloudId,
        pieces: Vec<Bytes>,
    ) -> Result<Written, Unavailable> {
        let name = self.cloud(owner, id);
        let payload: PutPayload = pieces.into_iter().collect();
        if self.create(&name, payload.clone()).await? {
            return Ok(Written::Now);
        }
        match self.whole_head(owner, id).await? {
            Some(head) => Ok(Written::Before(head.created_at)),
            // The object was damaged, or was deleted meanwhile. If another process writes it again at once,
            // it writes the same points.
            None => {
                self.put(&name, payload).await?;
                Ok(Written::Now)
            }
        }
    }

    /// Size of the object of a cloud in bytes, if it exists.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn cloud_bytes(&self, owner: &OwnerName, id: CloudId) -> Result<Option<u64>, Unavailable> {
        let name = self.cloud(owner, id);
        let found = self.counted(Verb::Find, &name, self.backend().head(&name).await)?;
        Ok(found.map(|found| found.size))
    }

    /// Reads the object of a cloud, if it exists, for [`cloud_object::decode`].
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_cloud(&self, owner: &OwnerName, id: CloudId) -> Result<Option<Bytes>, Unavailable> {
        let name = self.cloud(owner, id);
        let found = async { self.backend().get(&name).await?.bytes().await };
        self.counted(Verb::Read, &name, found.await)
    }

    /// Reads the head of a cloud, if it exists. The inner error tells why the head cannot be read.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn head(
        &self,
        owner: &OwnerName,
        id: CloudId,
    ) -> Result<Option<Result<CloudHead, DamagedObject>>, Unavailable> {
        let first = self.first_bytes(&self.cloud(owner, id)).await?;
        Ok(first.map(|bytes| CloudHead::decode(&bytes)))
    }

    /// Reads the head of an intact cloud. The points are read to check them. A damaged cloud is moved aside.
    async fn whole_head(&self, owner: &OwnerName, id: CloudId) -> Result<Option<CloudHead>, Unavailable> {
        match self.check(owner, id).await? {
            None => Ok(None),
            Some(Ok(head)) => Ok(Some(head)),
            Some(Err(damaged)) => {
                self.put_aside(owner, id, damaged).await;
                Ok(None)
            }
        }
    }

    /// Checks all bytes of a cloud, if it exists. Returns its head, or the damage.
    async fn check(
        &self,
        owner: &OwnerName,
        id: CloudId,
    ) -> Result<Option<Result<CloudHead, DamagedObject>>, Unavailable> {
        let head = match self.head(owner, id).await? {
            None => return Ok(None),
            Some(Err(damaged)) => return Ok(Some(Err(damaged))),
            Some(Ok(head)) => head,
        };
        let name = self.cloud(owner, id);
        let found = self.counted(Verb::Read, &name, self.backend().get(&name).await)?;
        let Some(found) = found else { return Ok(None) };
        let mut check = cloud_object::Check::new(&head, found.meta.size);
        let mut bytes = found.into_stream();
        while let Some(more) =
            bytes.try_next().await.map_err(|error| self.failed(Verb::Read, &name, error))?
        {
            check.read(&more);
        }
        Ok(Some(check.end().map(|()| head)))
    }

    /// Reads the heads of some clouds, without those that are gone.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn heads(
        &self,
        owner: &OwnerName,
        ids: Vec<CloudId>,
    ) -> Result<Vec<(CloudId, Result<CloudHead, DamagedObject>)>, Unavailable> {
        let heads = futures_util::stream::iter(ids)
            .map(|id| async move { Ok(self.head(owner, id).await?.map(|head| (id, head))) })
            .buffered(HEADS_AT_ONCE);
        heads.try_filter_map(|found| async move { Ok(found) }).try_collect().await
    }

    /// Returns the first places of a window, in order, and whether they are the last.
    ///
    /// The list has the objects of an owner and the `unstored` clouds. A cloud has one place, even if it was
    /// stored after it was taken to be unstored. Some stores list in no order, so all names of the folder are
    /// read.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn list_first(
        &self,
        owner: &OwnerName,
        window: ListWindow,
        mut unstored: HashMap<CloudId, CloudPlace>,
    ) -> Result<(Vec<CloudPlace>, bool), Unavailable> {
        let folder = self.path(&[&owner.0, FOLDER]);
        let (mut first, mut names) = (window.begin(), self.backend().list(Some(&folder)));
        while let Some(object) = self.counted_item(&folder, names.next().await)? {
            let Some(place) = CloudPlace::of(&object) else { continue };
            unstored.remove(&place.id);
            first.add(place);
        }
        self.tally().add(Verb::List, true);
        unstored.into_values().for_each(|place| first.add(place));
        Ok(first.into_places())
    }

    /// Counts a failed item of a list. `None` marks the end.
    fn counted_item(
        &self,
        folder: &Path,
        item: Option<object_store::Result<ObjectMeta>>,
    ) -> Result<Option<ObjectMeta>, Unavailable> {
        item.transpose().map_err(|error| self.failed(Verb::List, folder, error))
    }

    /// Deletes a cloud, its factors and its damaged copy. Returns whether the cloud existed.
    ///
    /// Of concurrent deletions in a directory, exactly one returns true. A bucket does not tell what it
    /// deleted. So there several processes that delete the cloud at once may all return true.
    ///
    /// # Errors
    /// [`Unavailable`]: the cloud may exist, or not.
    pub async fn delete_cloud(&self, owner: &OwnerName, id: CloudId) -> Result<bool, Unavailable> {
        let is_there = self.cloud_bytes(owner, id).await?.is_some();
        let was_there = is_there && self.delete(&self.cloud(owner, id)).await?;
        // The cloud is gone now. If deleting the rest fails, a sweep deletes it later.
        if let Err(error) = self.delete_remains(owner, id).await {
            tracing::warn!(%error, cloud = %id, "factors of a deleted cloud are left to the next sweep");
        }
        Ok(was_there)
    }

    async fn delete_remains(&self, owner: &OwnerName, id: CloudId) -> Result<(), Unavailable> {
        self.delete_factors(owner, id).await?;
        let aside = self.aside(owner, id);
        if self.counted(Verb::Find, &aside, self.backend().head(&aside).await)?.is_some() {
            self.delete(&aside).await?;
        }
        Ok(())
    }

    /// Deletes the cloud at a place of the list, unless it was written again since. Returns whether it did.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub(super) async fn let_go(&self, owner: &OwnerName, place: CloudPlace) -> Result<bool, Unavailable> {
        let name = self.cloud(owner, place.id);
        let found = self.counted(Verb::Find, &name, self.backend().head(&name).await)?;
        // Buckets tell the time of one object by the second, and that of objects in a list more precisely.
        let most = place.since + Duration::from_secs(1);
        let is_same = found.is_some_and(|found| SystemTime::from(found.last_modified) <= most);
        Ok(is_same && self.delete_cloud(owner, place.id).await?)
    }

    /// Moves a damaged cloud aside, unless it has been written again meanwhile.
    pub async fn put_aside(&self, owner: &OwnerName, id: CloudId, damaged: DamagedObject) {
        if cloud_object::is_of_bytes(damaged) && matches!(self.check(owner, id).await, Ok(Some(Ok(_)))) {
            return;
        }
        let (name, aside) = (self.cloud(owner, id), self.aside(owner, id));
        self.report(&name, damaged);
        let is_aside = self.backend().rename(&name, &aside).await.is_ok();
        tracing::error!(object = %name, %aside, is_aside, "a damaged cloud is set aside");
    }

    /// Reads the first bytes of an object, as many as its head has.
    async fn first_bytes(&self, name: &Path) -> Result<Option<Bytes>, Unavailable> {
        let mut n_bytes = FIRST_BYTES;
        loop {
            let options = GetOptions { range: Some(GetRange::Bounded(0..n_bytes)), ..GetOptions::default() };
            let found = async { self.backend().get_opts(name, options).await?.bytes().await }.await;
            // No store returns a range of an empty object.
            if found.is_err() && self.backend().head(name).await.is_ok_and(|empty| empty.size == 0) {
                return Ok(Some(Bytes::new()));
            }
            let Some(bytes) = self.counted(Verb::Read, name, found)? else { return Ok(None) };
            // Points of many coordinates have a long head.
            let n_needed = cloud_object::head_bytes_of(&bytes).min(MAX_HEAD_BYTES);
            if n_needed <= n_bytes {
                return Ok(Some(bytes));
            }
            n_bytes = n_needed;
        }
    }

    pub(super) fn cloud(&self, owner: &OwnerName, id: CloudId) -> Path {
        self.path(&[&owner.0, FOLDER, &id.to_string()])
    }

    /// Path to which a damaged cloud is moved.
    fn aside(&self, owner: &OwnerName, id: CloudId) -> Path {
        self.path(&[&owner.0, "damaged", &id.to_string()])
    }
}

impl CloudPlace {
    /// Returns the place of an object in the list, if it is a cloud.
    pub(super) fn of(object: &ObjectMeta) -> Option<Self> {
        let id = CloudId::parse(object.location.filename()?)?;
        Some(Self { since: object.last_modified.into(), id })
    }
}
