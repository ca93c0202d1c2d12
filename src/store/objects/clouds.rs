//! Clouds as objects: written, found whole, listed and forgotten.

use std::collections::BTreeSet;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{
    Error, GetOptions, GetRange, ObjectMeta, ObjectStoreExt, PutMode, PutOptions, PutPayload,
};

use super::cloud_object::{self, CloudHead};
use super::{CloudId, Damaged, Objects, OwnerName, Unavailable, Verb};

/// Heads that are read at once.
const HEADS_AT_ONCE: usize = 32;

/// Bytes that the head of most clouds is within, and that of any.
const FIRST_BYTES: u64 = 1024;
const MAX_HEAD_BYTES: u64 = 1 << 20;

/// A cloud in a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Listed {
    pub created_at: SystemTime,
    pub id: CloudId,
}

/// What came of writing a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    Now,
    /// It was there, since then.
    Before(SystemTime),
}

impl Objects {
    /// Writes the object of a cloud, made by [`cloud_object::encode`], unless it is there, and lists it.
    ///
    /// # Errors
    /// [`Unavailable`]: then it is not listed, but it may be there.
    pub async fn put_cloud(
        &self,
        owner: &OwnerName,
        (id, created_at): (CloudId, SystemTime),
        pieces: Vec<Bytes>,
    ) -> Result<Written, Unavailable> {
        let name = self.cloud(owner, id);
        let payload: PutPayload = pieces.into_iter().collect();
        let created = PutOptions::from(PutMode::Create);
        let written = match self.store.put_opts(&name, payload.clone(), created).await {
            Ok(_) => Written::Now,
            Err(Error::AlreadyExists { .. }) => match self.whole_head(owner, id).await? {
                Some(head) => Written::Before(head.created_at),
                // It was damaged, or has gone meanwhile.
                None => {
                    self.put(&name, payload).await?;
                    Written::Now
                }
            },
            Err(error) => return Err(self.failed(Verb::Write, &name, error)),
        };
        let since = match written {
            Written::Now => created_at,
            Written::Before(since) => since,
        };
        self.put(&self.listed(owner, Listed { created_at: since, id }), PutPayload::default()).await?;
        Ok(written)
    }

    /// How many bytes the object of a cloud has, if it is there.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn cloud_bytes(&self, owner: &OwnerName, id: CloudId) -> Result<Option<u64>, Unavailable> {
        let name = self.cloud(owner, id);
        let found = self.counted(Verb::Find, &name, self.store.head(&name).await)?;
        Ok(found.map(|found| found.size))
    }

    /// The object of a cloud, if it is there: for [`cloud_object::decode`].
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_cloud(&self, owner: &OwnerName, id: CloudId) -> Result<Option<Bytes>, Unavailable> {
        let name = self.cloud(owner, id);
        let found = async { self.store.get(&name).await?.bytes().await };
        self.counted(Verb::Read, &name, found.await)
    }

    /// What lists say of a cloud, if it is there and whole as far as that.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn head(&self, owner: &OwnerName, id: CloudId) -> Result<Option<CloudHead>, Unavailable> {
        let name = self.cloud(owner, id);
        let Some(bytes) = self.first_bytes(&name).await? else { return Ok(None) };
        match CloudHead::decode(&bytes) {
            Ok(head) => Ok(Some(head)),
            Err(damaged) => {
                self.put_aside(owner, id, damaged).await;
                Ok(None)
            }
        }
    }

    /// The head of a cloud that is there and whole, whose points are read for that. One that is not is put aside.
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

    /// Whether a cloud is there, and whole.
    async fn check(
        &self,
        owner: &OwnerName,
        id: CloudId,
    ) -> Result<Option<Result<CloudHead, Damaged>>, Unavailable> {
        let name = self.cloud(owner, id);
        let Some(first) = self.first_bytes(&name).await? else { return Ok(None) };
        let head = match CloudHead::decode(&first) {
            Ok(head) => head,
            Err(damaged) => return Ok(Some(Err(damaged))),
        };
        let found = self.counted(Verb::Read, &name, self.store.get(&name).await)?;
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

    /// The heads of some clouds, without those that are gone or damaged.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn heads(
        &self,
        owner: &OwnerName,
        ids: Vec<CloudId>,
    ) -> Result<Vec<(CloudId, CloudHead)>, Unavailable> {
        let heads = futures_util::stream::iter(ids)
            .map(|id| async move { Ok(self.head(owner, id).await?.map(|head| (id, head))) })
            .buffered(HEADS_AT_ONCE);
        heads.try_filter_map(|found| async move { Ok(found) }).try_collect().await
    }

    /// The clouds of an owner behind a place of the list, in no order.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn list(&self, owner: &OwnerName, after: Option<Listed>) -> Result<Vec<Listed>, Unavailable> {
        let folder = self.path(&[&owner.0, "listed"]);
        let names = self.names(&folder, owner, after).try_collect::<Vec<_>>().await;
        let names = self.counted(Verb::List, &folder, names)?.unwrap_or_default();
        Ok(names.iter().filter_map(|found| Listed::parse(found.location.filename()?)).collect())
    }

    /// The first `n` clouds of an owner behind a place of the list, in its order: no more than they are in memory, however long the list is.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn list_first(
        &self,
        owner: &OwnerName,
        after: Option<Listed>,
        n: usize,
    ) -> Result<BTreeSet<Listed>, Unavailable> {
        let folder = self.path(&[&owner.0, "listed"]);
        // Not every store lists in an order.
        let smallest =
            self.names(&folder, owner, after).try_fold(BTreeSet::new(), |mut first, found| async move {
                first.extend(found.location.filename().and_then(Listed::parse));
                if first.len() > n {
                    first.pop_last();
                }
                Ok(first)
            });
        Ok(self.counted(Verb::List, &folder, smallest.await)?.unwrap_or_default())
    }

    /// What is in the list of an owner behind a place of it.
    fn names(
        &self,
        folder: &Path,
        owner: &OwnerName,
        after: Option<Listed>,
    ) -> BoxStream<'static, object_store::Result<ObjectMeta>> {
        match after {
            None => self.store.list(Some(folder)),
            Some(last) => self.store.list_with_offset(Some(folder), &self.listed(owner, last)),
        }
    }

    /// Forgets a cloud, and what was put aside of it; says whether there was any of it.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn delete_cloud(&self, owner: &OwnerName, id: CloudId) -> Result<bool, Unavailable> {
        let name = self.cloud(owner, id);
        let head = self.head(owner, id).await?;
        if let Some(CloudHead { created_at, .. }) = head {
            self.delete(&self.listed(owner, Listed { created_at, id })).await?;
        }
        self.delete(&name).await?;
        self.delete_factors(owner, id).await?;
        let aside = self.aside(owner, id);
        let was_aside = self.counted(Verb::Find, &aside, self.store.head(&aside).await)?.is_some();
        if was_aside {
            self.delete(&aside).await?;
        }
        Ok(head.is_some() || was_aside)
    }

    /// Puts aside what is not what was written, unless somebody has written it again meanwhile.
    pub async fn put_aside(&self, owner: &OwnerName, id: CloudId, damaged: Damaged) {
        if cloud_object::is_of_bytes(damaged) && matches!(self.check(owner, id).await, Ok(Some(Ok(_)))) {
            return;
        }
        let (name, aside) = (self.cloud(owner, id), self.aside(owner, id));
        self.report(&name, damaged);
        let is_aside = self.store.rename(&name, &aside).await.is_ok();
        let is_unlisted = self.unlist(owner, id).await.is_ok();
        tracing::error!(object = %name, %aside, is_aside, is_unlisted, "a cloud is put aside");
    }

    /// Takes a cloud off the list, since whenever it is on it.
    async fn unlist(&self, owner: &OwnerName, id: CloudId) -> Result<(), Unavailable> {
        for listed in self.list(owner, None).await?.into_iter().filter(|listed| listed.id == id) {
            self.delete(&self.listed(owner, listed)).await?;
        }
        Ok(())
    }

    /// As many as a head has.
    async fn first_bytes(&self, name: &Path) -> Result<Option<Bytes>, Unavailable> {
        let mut n_bytes = FIRST_BYTES;
        loop {
            let options = GetOptions { range: Some(GetRange::Bounded(0..n_bytes)), ..GetOptions::default() };
            let found = async { self.store.get_opts(name, options).await?.bytes().await }.await;
            // Of an object without bytes no store gives any range.
            if found.is_err() && self.store.head(name).await.is_ok_and(|empty| empty.size == 0) {
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
        self.path(&[&owner.0, "clouds", &id.to_string()])
    }

    /// Where a damaged one goes.
    fn aside(&self, owner: &OwnerName, id: CloudId) -> Path {
        self.path(&[&owner.0, "damaged", &id.to_string()])
    }

    pub(super) fn listed(&self, owner: &OwnerName, listed: Listed) -> Path {
        self.path(&[&owner.0, "listed", &listed.to_string()])
    }
}

impl Listed {
    fn parse(name: &str) -> Option<Self> {
        let (nanoseconds, id) = name.split_once('-')?;
        let since_epoch = Duration::from_nanos(nanoseconds.parse().ok()?);
        Some(Self { created_at: SystemTime::UNIX_EPOCH + since_epoch, id: CloudId::parse(id)? })
    }
}

impl std::fmt::Display for Listed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let since_epoch = self.created_at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        write!(f, "{:020}-{}", since_epoch.as_nanos(), self.id)
    }
}
