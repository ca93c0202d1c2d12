//! Pages of the list of clouds: objects of the store, and clouds that are in memory alone.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::SystemTime;

use super::{CloudStore, Holder, RegisteredCloud};
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::CloudHead;
use crate::store::objects::{CloudObjects, CloudPlace, ListWindow};
use gramian_host::memory::Owner;
use gramian_host::store::Unavailable;

/// A cloud in a list: in full if memory has it, otherwise its head in the store.
pub enum ListedCloud {
    InMemory(Arc<RegisteredCloud>),
    InStore(CloudId, CloudHead),
}

/// A page of the list.
pub struct CloudPage {
    pub clouds: Vec<ListedCloud>,
    /// The place after which the next page begins. `None` on the last page.
    pub next: Option<CloudPlace>,
}

impl ListedCloud {
    pub fn id(&self) -> CloudId {
        match self {
            Self::InMemory(cloud) => cloud.id,
            Self::InStore(id, _) => *id,
        }
    }

    fn created_at(&self) -> SystemTime {
        match self {
            Self::InMemory(cloud) => cloud.created_at(),
            Self::InStore(_, head) => head.created_at,
        }
    }
}

impl<E: Clone + Send + Sync + 'static> CloudStore<E> {
    /// Places of [`CloudStore::unstored`] clouds in the list, by id.
    pub fn unstored_places(&self, owner: Owner) -> HashMap<CloudId, CloudPlace> {
        let place = |cloud: &RegisteredCloud| CloudPlace { since: cloud.created_at(), id: cloud.id };
        self.unstored(owner).iter().map(|cloud| (cloud.id, place(cloud))).collect()
    }

    /// Returns the first clouds of the list within a window. `unstored` are the clouds in memory alone.
    ///
    /// A page other than the last has at least one cloud. It has fewer than the window if some were deleted
    /// while the page was made.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn page(
        &self,
        objects: Option<&CloudObjects>,
        holder: &Holder,
        mut window: ListWindow,
        unstored: HashMap<CloudId, CloudPlace>,
    ) -> Result<CloudPage, Unavailable> {
        loop {
            let (places, is_last) = match objects {
                None => window.first_of(unstored.values().copied()),
                Some(objects) => objects.list_first(&holder.name, window, unstored.clone()).await?,
            };
            let next = places.last().copied().filter(|_| !is_last);
            let mut clouds = self.described(objects, holder, &places).await?;
            if next.is_none() || !clouds.is_empty() {
                clouds.sort_by_key(|cloud| (cloud.created_at(), cloud.id()));
                return Ok(CloudPage { clouds, next });
            }
            window.after = next;
        }
    }

    /// Returns the clouds at some places, without those that are gone or damaged.
    async fn described(
        &self,
        objects: Option<&CloudObjects>,
        holder: &Holder,
        places: &[CloudPlace],
    ) -> Result<Vec<ListedCloud>, Unavailable> {
        let (mut found, mut elsewhere) = (Vec::new(), Vec::new());
        // A cloud that was deleted and posted again during the listing appears twice in a directory.
        let mut ids = HashSet::new();
        for place in places.iter().filter(|place| ids.insert(place.id)) {
            match self.clouds.peek(holder.owner, &place.id) {
                Some(cloud) => found.push(ListedCloud::InMemory(cloud)),
                None => elsewhere.push(place.id),
            }
        }
        let Some(objects) = objects else { return Ok(found) };
        for (id, head) in objects.heads(&holder.name, elsewhere).await? {
            match head {
                Ok(head) => found.push(ListedCloud::InStore(id, head)),
                Err(damaged) => self.put_aside(objects, holder, id, damaged).await,
            }
        }
        Ok(found)
    }
}
