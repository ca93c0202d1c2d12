//! Requests to a process as handlers make them, without waits for memory or compute threads.

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use super::{cloud, id};
use crate::store::clouds::{CloudLookup, CloudStore, Holder, RegisteredCloud, StoreOutcome};
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::{decode, encode};
use crate::store::objects::{CloudObjects, ListWindow, Retention};
use bytes::Bytes;
use gramian_host::memory::Owner;
use gramian_host::store::{OwnerName, Unavailable};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    Post,
    Delete,
    Get,
    List,
    Sweep,
    /// Offers pending clouds to the store again, as the service does every few seconds.
    Offer,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// Carries whether the cloud was new.
    Posted(bool),
    /// Carries whether the cloud existed.
    Deleted(bool),
    Found(bool),
    Listed(Vec<CloudId>),
    Done,
    Unavailable,
}

#[derive(Clone)]
pub struct Process {
    pub clouds: Arc<CloudStore<String>>,
    pub objects: CloudObjects,
}

fn holder() -> Holder {
    Holder { owner: Owner(0), name: OwnerName("o".to_owned()) }
}

async fn encoded(cloud: Arc<RegisteredCloud>) -> Result<Vec<Bytes>, String> {
    Ok(encode(cloud.stored()))
}

impl Request {
    /// Returns the request for `n` of 0 to 9. Requests that change something are more frequent.
    pub fn some(n: usize) -> Self {
        match n {
            0..4 => Self::Post,
            4..7 => Self::Delete,
            7 => Self::Get,
            8 => Self::List,
            _ => Self::Sweep,
        }
    }
}

impl Process {
    pub async fn run(self, request: Request) -> Answer {
        let answer = match request {
            Request::Post => Ok(self.post().await),
            Request::Delete => {
                self.clouds.forget(Some(&self.objects), &holder(), id()).await.map(Answer::Deleted)
            }
            Request::Get => Ok(self.get().await),
            Request::List => self.list().await,
            Request::Sweep => {
                let swept = self.objects.sweep(Retention::default(), SystemTime::now()).await;
                swept.map(|_| Answer::Done)
            }
            Request::Offer => Ok(self.offer().await),
        };
        answer.unwrap_or(Answer::Unavailable)
    }

    async fn post(&self) -> Answer {
        let (registered, _) = self.clouds.register(Owner(0), cloud(), None);
        let encode = || encoded(registered.clone());
        match self.clouds.keep(&self.objects, &holder(), &registered, encode).await {
            StoreOutcome::Known => Answer::Posted(false),
            StoreOutcome::Written(_) | StoreOutcome::Pending(_) | StoreOutcome::Deleted => {
                Answer::Posted(true)
            }
            StoreOutcome::Nowhere(_) => Answer::Unavailable,
        }
    }

    async fn get(&self) -> Answer {
        match self.clouds.recall(&self.objects, &holder(), id(), Duration::ZERO).await {
            CloudLookup::InMemory(_) => return Answer::Found(true),
            CloudLookup::Gone => return Answer::Found(false),
            CloudLookup::Unknown => {}
        }
        let read = || self.clone().read();
        let found = self.clouds.get_or_read(Owner(0), id(), read).await;
        found.map_or(Answer::Unavailable, |found| Answer::Found(found.is_some()))
    }

    async fn read(self) -> Result<Option<Arc<RegisteredCloud>>, String> {
        let refused = |error: Unavailable| error.to_string();
        let Some(bytes) = self.objects.get_cloud(&holder().name, id()).await.map_err(refused)? else {
            return Ok(None);
        };
        let read = decode(id(), &bytes);
        self.clouds.take_in(&self.objects, &holder(), id(), read).await.map_err(refused)
    }

    async fn list(&self) -> Result<Answer, Unavailable> {
        let unstored = self.clouds.unstored_places(Owner(0));
        let window = ListWindow { after: None, n: 9 };
        let page = self.clouds.page(Some(&self.objects), &holder(), window, unstored).await?;
        Ok(Answer::Listed(page.clouds.iter().map(|cloud| cloud.id()).collect()))
    }

    async fn offer(&self) -> Answer {
        for cloud in self.clouds.unstored(Owner(0)) {
            self.clouds.offer(&self.objects, &holder(), &cloud, || encoded(cloud.clone())).await;
        }
        Answer::Done
    }
}
