use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{ObjectStoreExt, PutPayload};

use super::cloud_object::TRUNCATED;
use super::factors::{FactorHead, FactorName};
use super::*;
use crate::store::clouds::{CloudStore, RegisteredCloud};
use crate::store::key::CloudId;
use gramian_host::memory::Owner;
use gramian_host::store::{OwnerName, Place, Verb};
use gramian_numerics::points::cloud::Cloud;

fn objects() -> CloudObjects {
    CloudObjects(Arc::new(Objects::over(Arc::new(InMemory::new()), Path::from("some/prefix"))))
}

fn owner(name: &str) -> OwnerName {
    OwnerName(name.to_owned())
}

fn registered(first: f64, dimension: usize) -> Arc<RegisteredCloud> {
    let cloud = Cloud::new((0..2 * dimension).map(|i| first + i as f64).collect(), dimension).unwrap();
    CloudStore::<()>::new(1 << 20).register(Owner(0), cloud, None).0
}

async fn put(objects: &CloudObjects, owner: &OwnerName, cloud: &Arc<RegisteredCloud>) -> Written {
    let pieces = cloud_object::encode(cloud.stored());
    objects.put_cloud(owner, cloud.id, pieces).await.unwrap()
}

/// Lists at most `n` ids after a place, and returns the place of the last.
async fn listed(
    objects: &CloudObjects,
    owner: &OwnerName,
    window: ListWindow,
) -> (Vec<CloudId>, Option<CloudPlace>) {
    let (places, _) = objects.list_first(owner, window, HashMap::new()).await.unwrap();
    (places.iter().map(|place| place.id).collect(), places.last().copied())
}

async fn all_listed(objects: &CloudObjects, owner: &OwnerName) -> Vec<CloudId> {
    listed(objects, owner, ListWindow { after: None, n: 99 }).await.0
}

/// CloudObjects in a temporary directory, whose times can be set.
struct DatedObjects {
    directory: PathBuf,
    objects: CloudObjects,
}

impl DatedObjects {
    async fn new(name: &str) -> Self {
        let directory = std::env::temp_dir().join(format!("gramian-{name}-{}", std::process::id()));
        let objects = Objects::open(&Place::Directory(directory.clone()), []).await.unwrap();
        let objects = CloudObjects(Arc::new(objects));
        Self { directory, objects }
    }

    async fn put_at(&self, owner: &OwnerName, cloud: &Arc<RegisteredCloud>, time: SystemTime) {
        put(&self.objects, owner, cloud).await;
        let path = self.directory.join(self.objects.cloud(owner, cloud.id).as_ref());
        std::fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
    }
}

impl Drop for DatedObjects {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.directory).ok();
    }
}

#[tokio::test]
async fn clouds_are_written_once_read_listed_and_deleted() {
    let (objects, owner) = (objects(), owner("one"));
    let clouds: Vec<_> = (0..5).map(|k| registered(f64::from(k), 3)).collect();
    for cloud in &clouds {
        assert_eq!(put(&objects, &owner, cloud).await, Written::Now);
    }
    // The same points posted again are the cloud that exists already.
    let again = registered(2.0, 3);
    assert_eq!(put(&objects, &owner, &again).await, Written::Before(clouds[2].created_at()));
    let ids: Vec<_> = clouds.iter().map(|cloud| cloud.id).collect();
    assert_eq!(all_listed(&objects, &owner).await, ids);
    let (first, second) = listed(&objects, &owner, ListWindow { after: None, n: 2 }).await;
    assert_eq!(first, ids[..2]);
    assert_eq!(listed(&objects, &owner, ListWindow { after: second, n: 2 }).await.0, ids[2..4]);
    assert_eq!(listed(&objects, &owner, ListWindow { after: second, n: 9 }).await.0, ids[2..]);
    // A cloud that was taken to be in memory alone keeps its place in the store. A cloud in memory alone has
    // a place of its own.
    let alone = registered(9.0, 3).id;
    let since = SystemTime::UNIX_EPOCH;
    let unstored = [ids[4], alone].map(|id| (id, CloudPlace { since, id }));
    let window = ListWindow { after: None, n: 9 };
    let (places, is_last) = objects.list_first(&owner, window, HashMap::from(unstored)).await.unwrap();
    let found: Vec<_> = places.iter().map(|place| place.id).collect();
    assert_eq!((found, is_last), ([&[alone], &ids[..]].concat(), true));
    let bytes = objects.get_cloud(&owner, clouds[3].id).await.unwrap().unwrap();
    assert_eq!(objects.cloud_bytes(&owner, clouds[3].id).await.unwrap(), Some(bytes.len() as u64));
    let read = cloud_object::decode(clouds[3].id, &bytes).unwrap();
    assert_eq!(read.points.coordinates(), clouds[3].cloud.coordinates());
    assert!(objects.delete_cloud(&owner, clouds[3].id).await.unwrap());
    assert!(!objects.delete_cloud(&owner, clouds[3].id).await.unwrap());
    assert_eq!(objects.get_cloud(&owner, clouds[3].id).await.unwrap(), None);
    assert_eq!(all_listed(&objects, &owner).await.len(), 4);
    assert_eq!(objects.heads(&owner, ids).await.unwrap().len(), 4);
    assert_eq!(objects.n_damaged(), 0);
    assert!(Verb::ALL.into_iter().all(|verb| objects.tally().of(verb)[1] == 0));
    // Six lists of clouds, and one of factors with each deletion.
    assert_eq!(objects.tally().of(Verb::List), [8, 0]);
}

#[tokio::test]
async fn owners_see_nothing_of_each_other() {
    let objects = objects();
    let cloud = registered(0.0, 2);
    put(&objects, &owner("one"), &cloud).await;
    let other = owner("two");
    assert_eq!(objects.get_cloud(&other, cloud.id).await.unwrap(), None);
    assert!(all_listed(&objects, &other).await.is_empty());
    assert!(!objects.delete_cloud(&other, cloud.id).await.unwrap());
    assert!(objects.head(&owner("one"), cloud.id).await.unwrap().unwrap().is_ok());
}

#[tokio::test]
async fn heads_of_many_coordinates_are_read_whole() {
    let (objects, owner) = (objects(), owner("one"));
    let cloud = registered(0.5, 300);
    put(&objects, &owner, &cloud).await;
    let head = objects.head(&owner, cloud.id).await.unwrap().unwrap().unwrap();
    assert_eq!((head.dimension, head.n_points), (300, 2));
    assert_eq!(head.bounding_box, cloud.bounding_box);
}

#[tokio::test]
async fn what_is_damaged_is_put_aside_and_can_be_written_again() {
    let (objects, owner) = (objects(), owner("one"));
    let cloud = registered(0.0, 2);
    put(&objects, &owner, &cloud).await;
    let name = objects.cloud(&owner, cloud.id);
    objects
        .backend()
        .put(&name, PutPayload::from_static(b"gramian cloud 1\nand nothing else"))
        .await
        .unwrap();
    let damaged = objects.head(&owner, cloud.id).await.unwrap().unwrap().unwrap_err();
    objects.put_aside(&owner, cloud.id, damaged).await;
    assert_eq!((objects.n_damaged(), objects.get_cloud(&owner, cloud.id).await.unwrap()), (1, None));
    assert_eq!(put(&objects, &owner, &cloud).await, Written::Now);
    // Damage is also found when the cloud is written again.
    objects.backend().put(&name, PutPayload::from_static(b"something else")).await.unwrap();
    assert_eq!(put(&objects, &owner, &cloud).await, Written::Now);
    let bytes = objects.get_cloud(&owner, cloud.id).await.unwrap().unwrap();
    assert!(cloud_object::decode(cloud.id, &bytes).is_ok() && objects.n_damaged() == 2);
    // An empty object is found too, although no store returns a range of it.
    objects.backend().put(&name, PutPayload::new()).await.unwrap();
    assert!(objects.heads(&owner, vec![cloud.id]).await.unwrap()[0].1.is_err());
    assert_eq!(put(&objects, &owner, &cloud).await, Written::Now);
    objects.backend().put(&name, PutPayload::new()).await.unwrap();
    assert!(objects.delete_cloud(&owner, cloud.id).await.unwrap());
    assert_eq!((put(&objects, &owner, &cloud).await, objects.n_damaged()), (Written::Now, 3));
    // Damage in the points alone, or behind them, is found too.
    for at in [bytes.len() - 1, bytes.len() - 40] {
        let mut other = bytes.to_vec();
        other[at] ^= 1;
        objects.backend().put(&name, other.into()).await.unwrap();
        assert_eq!(put(&objects, &owner, &cloud).await, Written::Now);
    }
    assert_eq!(put(&objects, &owner, &cloud).await, Written::Before(cloud.created_at()));
    assert_eq!((objects.n_damaged(), all_listed(&objects, &owner).await.len()), (5, 1));
    // A cloud that is intact again stays in place. Its damaged copy is deleted with it.
    objects.put_aside(&owner, cloud.id, TRUNCATED).await;
    assert_eq!(objects.n_damaged(), 5);
    assert!(objects.delete_cloud(&owner, cloud.id).await.unwrap());
    let left = objects.objects_in(&owner, &[]).await.unwrap();
    assert!(left.is_empty(), "{left:?}");
}

#[tokio::test]
async fn factors_go_with_their_clouds_whoever_wrote_them_last() {
    let (objects, owner) = (objects(), owner("one"));
    let (kept, gone) = (registered(0.0, 2), registered(1.0, 2));
    put(&objects, &owner, &kept).await;
    let name_of =
        |cloud: &RegisteredCloud| FactorName { owner: owner.clone(), cloud: cloud.id, fit: "ab".to_owned() };
    for cloud in [&kept, &gone] {
        let pieces = [Bytes::from_static(b"numbers")].into_iter();
        objects.put_factor(&name_of(cloud), &FactorHead::new(2, 1.0, 1.0), pieces).await.unwrap();
    }
    // An empty object is no factor, and can be written.
    objects.backend().put(&objects.factor(&name_of(&kept)), PutPayload::new()).await.unwrap();
    assert!(objects.find_factor(&name_of(&kept)).await.unwrap().is_none());
    let pieces = [Bytes::from_static(b"numbers")].into_iter();
    objects.put_factor(&name_of(&kept), &FactorHead::new(2, 1.0, 1.0), pieces).await.unwrap();
    let limits = Retention { n_factor_bytes: 1 << 20, ..Retention::default() };
    // At first its writer may still be at work, and its cloud may still be written.
    for (seconds, is_there) in [(0, true), (7200, false)] {
        let now = SystemTime::now() + Duration::from_secs(seconds);
        objects.sweep(limits, now).await.unwrap();
        assert_eq!(objects.find_factor(&name_of(&gone)).await.unwrap().is_some(), is_there);
        assert!(objects.find_factor(&name_of(&kept)).await.unwrap().is_some());
    }
}

#[tokio::test]
async fn files_that_were_never_whole_go_after_an_hour() {
    let directory = std::env::temp_dir().join(format!("gramian-half-written-{}", std::process::id()));
    let objects = Objects::open(&Place::Directory(directory.clone()), []).await.unwrap();
    let objects = CloudObjects(Arc::new(objects));
    let folder = directory.join("one/clouds");
    std::fs::create_dir_all(&folder).unwrap();
    for name in ["ab#1", "ab#x", "ab"] {
        std::fs::write(folder.join(name), b"").unwrap();
    }
    for (seconds, is_there) in [(0, true), (7200, false)] {
        let now = SystemTime::now() + Duration::from_secs(seconds);
        objects.sweep(Retention::default(), now).await.unwrap();
        assert_eq!(folder.join("ab#1").exists(), is_there);
    }
    assert!(folder.join("ab").exists() && folder.join("ab#x").exists());
    std::fs::remove_dir_all(directory).unwrap();
}

#[tokio::test]
async fn the_oldest_clouds_go_by_age_and_by_bytes() {
    let (dated, one, two) = (DatedObjects::new("oldest").await, owner("one"), owner("two"));
    let (objects, now) = (&dated.objects, SystemTime::now());
    let clouds: Vec<_> = (0..6).map(|k| registered(f64::from(k), 3)).collect();
    let mut n_bytes = 0;
    for (k, cloud) in clouds.iter().enumerate() {
        // Ages differ by a day, owners alternate, and the last cloud is of today.
        let since = now - Duration::from_secs(86400 * (5 - k as u64));
        n_bytes = cloud_object::encode(cloud.stored()).iter().map(|piece| piece.len() as u64).sum();
        dated.put_at([&one, &two][k % 2], cloud, since).await;
    }
    let none = Retention::default();
    let all = objects.sweep(none, now).await.unwrap();
    assert_eq!(all, Swept { n_clouds: 6, n_bytes: 6 * n_bytes, n_factor_bytes: 0, gone: Vec::new() });
    let days =
        Retention { age: Some(Duration::from_secs(86400 * 4 + 3600)), n_bytes: None, n_factor_bytes: 0 };
    let swept = objects.sweep(days, now).await.unwrap();
    assert_eq!(swept.gone, [(one.clone(), clouds[0].id)]);
    let bytes = Retention { age: None, n_bytes: Some(3 * n_bytes), n_factor_bytes: 0 };
    let swept = objects.sweep(bytes, now).await.unwrap();
    assert_eq!(swept.gone, [(two.clone(), clouds[1].id), (one.clone(), clouds[2].id)]);
    assert_eq!((swept.n_clouds, swept.n_bytes), (3, 3 * n_bytes));
    assert!(objects.get_cloud(&one, clouds[2].id).await.unwrap().is_none());
    assert_eq!(all_listed(objects, &one).await.len(), 1);
    assert_eq!(all_listed(objects, &two).await.len(), 2);
}

#[tokio::test]
async fn who_has_most_makes_room() {
    let (dated, modest, greedy) = (DatedObjects::new("most").await, owner("modest"), owner("greedy"));
    let objects = &dated.objects;
    let clouds: Vec<_> = (0..5).map(|k| registered(f64::from(k), 3)).collect();
    let now = SystemTime::now();
    for (k, cloud) in clouds.iter().enumerate() {
        let since = now - Duration::from_secs(60 * (10 - k as u64));
        dated.put_at(if k == 0 { &modest } else { &greedy }, cloud, since).await;
    }
    let n_bytes = objects.cloud_bytes(&modest, clouds[0].id).await.unwrap().unwrap();
    let limits = Retention { age: None, n_bytes: Some(2 * n_bytes), n_factor_bytes: 0 };
    let gone = objects.sweep(limits, now).await.unwrap().gone;
    assert_eq!(gone, [1, 2, 3].map(|k| (greedy.clone(), clouds[k].id)));
    // If all owners hold as much, the oldest cloud of all is deleted.
    let limits = Retention { n_bytes: Some(n_bytes), ..limits };
    assert_eq!(objects.sweep(limits, now).await.unwrap().gone, [(modest, clouds[0].id)]);
}

#[tokio::test]
async fn a_cloud_that_was_posted_again_during_a_sweep_stays() {
    let (dated, owner) = (DatedObjects::new("again").await, owner("one"));
    let cloud = registered(0.0, 2);
    let hour_ago = SystemTime::now() - Duration::from_secs(3600);
    dated.put_at(&owner, &cloud, hour_ago).await;
    let window = ListWindow { after: None, n: 1 };
    let place = listed(&dated.objects, &owner, window).await.1.unwrap();
    assert!(dated.objects.delete_cloud(&owner, cloud.id).await.unwrap());
    put(&dated.objects, &owner, &cloud).await;
    assert!(!dated.objects.let_go(&owner, place).await.unwrap());
    let place = listed(&dated.objects, &owner, window).await.1.unwrap();
    assert!(dated.objects.let_go(&owner, place).await.unwrap());
}

/// Drafts before 0.1.0 listed clouds by empty objects.
#[tokio::test]
async fn lists_of_former_drafts_go_and_their_clouds_stay() {
    let (objects, owner) = (objects(), owner("one"));
    let cloud = registered(0.0, 2);
    put(&objects, &owner, &cloud).await;
    let since = "01700000000000000000";
    for id in [cloud.id, registered(1.0, 2).id] {
        let name = objects.path(&["one", "listed", &format!("{since}-{id}")]);
        objects.put(&name, PutPayload::default()).await.unwrap();
    }
    assert_eq!(all_listed(&objects, &owner).await, [cloud.id]);
    objects.sweep(Retention::default(), SystemTime::now()).await.unwrap();
    assert_eq!(objects.objects_in(&owner, &[]).await.unwrap().len(), 1);
    assert_eq!(all_listed(&objects, &owner).await, [cloud.id]);
}

#[tokio::test]
async fn what_was_damaged_goes_after_a_week() {
    let (objects, owner, now) = (objects(), owner("one"), SystemTime::now());
    let gone = registered(1.0, 2);
    objects.put(&objects.cloud(&owner, gone.id), PutPayload::from_static(b"else")).await.unwrap();
    objects.put_aside(&owner, gone.id, TRUNCATED).await;
    let aside = objects.path(&["one", "damaged", &gone.id.to_string()]);
    for (days, is_there) in [(6, true), (8, false)] {
        objects.sweep(Retention::default(), now + Duration::from_secs(86400 * days)).await.unwrap();
        assert_eq!(objects.backend().head(&aside).await.is_ok(), is_there);
    }
}
