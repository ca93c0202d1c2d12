use std::sync::Arc;

use futures_util::{Stream, TryStreamExt};
use object_store::{ObjectStoreExt, PutPayload};

use super::super::pieces::BrokenOff;
use super::super::room::Room;
use super::*;

fn owner() -> OwnerName {
    OwnerName("a".to_owned())
}

fn body(pieces: &[&'static [u8]]) -> impl Stream<Item = Result<Bytes, String>> + use<> {
    let pieces: Vec<_> = pieces.iter().map(|&piece| Ok(Bytes::from_static(piece))).collect();
    futures_util::stream::iter(pieces)
}

fn head() -> JobResult {
    let headers = vec![("content-type".to_owned(), "application/json".to_owned())];
    JobResult { outcome: Outcome::Succeeded, status: 200, headers }
}

async fn put(
    objects: &Objects,
    id: JobId,
    attempt: u32,
    body: impl Stream<Item = Result<Bytes, String>>,
) -> Result<bool, Unavailable> {
    let answer = Answer { attempt, head: head(), body };
    objects.put_result(&owner(), id, answer, &mut Room::unlimited()).await
}

async fn read(objects: &Arc<Objects>, id: JobId) -> Option<Result<Vec<u8>, BrokenOff>> {
    let found = objects.get_result(&owner(), id).await.unwrap()?;
    let n_bytes = found.n_body_bytes;
    let pieces = found.body.try_collect::<Vec<_>>().await;
    Some(pieces.map(|pieces| {
        let whole = pieces.concat();
        assert_eq!(whole.len() as u64, n_bytes);
        whole
    }))
}

async fn asked(objects: &Objects, body: &'static [u8]) -> JobId {
    let id = JobId::new();
    let request = JobRequest { path: "/v1/normals".to_owned(), headers: Vec::new() };
    let room = &mut Room::unlimited();
    objects
        .put_job(&owner(), NewJob { id, request: &request, body: Bytes::from_static(body) }, room)
        .await
        .unwrap();
    id
}

async fn bytes_of(objects: &Objects, name: &Path) -> Bytes {
    objects.store.get(name).await.unwrap().bytes().await.unwrap()
}

#[tokio::test]
async fn what_is_asked_and_what_comes_of_it_is_read_as_it_was_written() {
    let (objects, id) = (Arc::new(Objects::in_memory()), JobId::new());
    assert_eq!(JobId::parse(&id.to_string()), Some(id));
    assert_eq!(JobId::parse(&id.to_string().to_uppercase()), None);
    assert_eq!(objects.find_job(&owner(), id).await.unwrap(), None);
    let headers = vec![("accept".to_owned(), "*/*".to_owned())];
    let request = JobRequest { path: "/v1/normals".to_owned(), headers };
    let points = Bytes::from_static(b"{}\n");
    let room = &mut Room::unlimited();
    objects.put_job(&owner(), NewJob { id, request: &request, body: points.clone() }, room).await.unwrap();
    let found = objects.open_job(&owner(), id).await.unwrap().unwrap().unwrap();
    assert_eq!((found.request, found.n_body_bytes), (request, 3));
    assert_eq!(found.body.try_collect::<Vec<_>>().await.unwrap().concat(), points);
    let bodies: [&[&'static [u8]]; 4] = [
        &[],
        &[b"x"],
        &[b"12345678", &[7; 100], b"", b"9"],
        &[&[5; 12 << 20], b"more than is written at once"],
    ];
    for pieces in bodies {
        let id = asked(&objects, b"").await;
        assert!(put(&objects, id, 0, body(pieces)).await.unwrap());
        assert_eq!(read(&objects, id).await.unwrap().unwrap(), pieces.concat());
    }
    assert!(put(&objects, id, 0, body(&[])).await.unwrap());
    let found = objects.find_job(&owner(), id).await.unwrap().unwrap();
    assert!(found.has_request && found.ended_at.is_some() && found.lease.is_none());
    assert!(!objects.cancel_job(&owner(), id).await.unwrap(), "it has ended");
    assert!(objects.delete_job(&owner(), id).await.unwrap());
    assert_eq!(objects.find_job(&owner(), id).await.unwrap(), None);
}

#[tokio::test]
async fn a_job_ends_once() {
    let objects = Arc::new(Objects::in_memory());
    let id = asked(&objects, b"").await;
    assert!(put(&objects, id, 1, body(&[b"first"])).await.unwrap());
    assert!(!put(&objects, id, 0, body(&[b"late"])).await.unwrap());
    assert_eq!(read(&objects, id).await.unwrap().unwrap(), b"first");
    let cancelled = asked(&objects, b"").await;
    assert!(objects.cancel_job(&owner(), cancelled).await.unwrap());
    assert!(!put(&objects, cancelled, 0, body(&[b"late"])).await.unwrap());
    let found = objects.get_result(&owner(), cancelled).await.unwrap().unwrap();
    assert_eq!((found.head.outcome, found.n_body_bytes), (Outcome::Cancelled, 0));
    // A late result does not bring back a deleted job either.
    for id in [id, cancelled] {
        assert!(objects.delete_job(&owner(), id).await.unwrap());
        assert!(!objects.delete_job(&owner(), id).await.unwrap());
        assert!(!put(&objects, id, 2, body(&[b"late"])).await.unwrap());
    }
    assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
}

#[tokio::test]
async fn a_result_that_breaks_off_is_none() {
    let objects = Arc::new(Objects::in_memory());
    let id = asked(&objects, b"").await;
    for n_pieces in [1, 12] {
        let piece = Bytes::from(vec![1; 1 << 20]);
        let pieces = std::iter::repeat_n(Ok(piece), n_pieces).chain([Err("gone".to_owned())]);
        let put = put(&objects, id, 0, futures_util::stream::iter(pieces)).await;
        assert!(put.is_err() && read(&objects, id).await.is_none());
    }
}

#[tokio::test]
async fn one_attempt_has_one_process() {
    let (objects, id) = (Objects::in_memory(), JobId::new());
    let lease = Lease { fraction: 0.25, ..Lease::default() };
    assert!(objects.claim_job(&owner(), id, 0, &lease).await.unwrap());
    assert!(!objects.claim_job(&owner(), id, 0, &lease).await.unwrap());
    assert_eq!(objects.get_lease(&owner(), id, 0).await.unwrap(), Some(lease.clone()));
    let released = Lease { is_released: true, ..lease };
    objects.renew_lease(&owner(), id, 0, &released).await.unwrap();
    assert_eq!(objects.get_lease(&owner(), id, 0).await.unwrap(), Some(released));
    for attempt in 1..12 {
        assert!(objects.claim_job(&owner(), id, attempt, &Lease::default()).await.unwrap());
    }
    let found = objects.find_job(&owner(), id).await.unwrap().unwrap();
    assert_eq!(found.lease.map(|(attempt, _)| attempt), Some(11));
    assert!(!objects.delete_job(&owner(), id).await.unwrap(), "it has no request");
    assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
}

#[tokio::test]
async fn a_result_that_is_not_what_was_written_is_never_whole_and_made_again() {
    let objects = Arc::new(Objects::in_memory());
    let id = asked(&objects, b"").await;
    put(&objects, id, 0, body(&[b"0123456789"])).await.unwrap();
    let (answer, result) = (objects.answer(&owner(), id, 0), objects.job(&owner(), id, RESULT));
    let (of_answer, of_result) = (bytes_of(&objects, &answer).await, bytes_of(&objects, &result).await);
    for (name, bytes, first) in [(&answer, &of_answer, 0), (&result, &of_result, 0)] {
        for at in first..bytes.len() {
            let mut other = bytes.to_vec();
            other[at] ^= 1;
            for wrong in [other.into(), bytes.slice(..at)] {
                objects.put(name, wrong.into()).await.unwrap();
                let n_before = objects.n_damaged();
                assert!(read(&objects, id).await.is_none_or(|body| body.is_err()), "{name}, {at}");
                assert_eq!(objects.n_damaged(), n_before + 1);
                let job = objects.find_job(&owner(), id).await.unwrap().unwrap();
                assert!(job.has_request && job.ended_at.is_none(), "it is anybody's");
                objects.put(&answer, of_answer.clone().into()).await.unwrap();
                objects.put(&result, of_result.clone().into()).await.unwrap();
            }
        }
    }
    assert_eq!(read(&objects, id).await.unwrap().unwrap(), b"0123456789");
}

#[tokio::test]
async fn a_request_that_is_not_what_was_written_is_refused() {
    let objects = Objects::in_memory();
    let id = asked(&objects, b"abc").await;
    let name = objects.job(&owner(), id, REQUEST);
    let bytes = bytes_of(&objects, &name).await;
    for at in 0..bytes.len() {
        let mut other = bytes.to_vec();
        other[at] ^= 1;
        objects.put(&name, other.into()).await.unwrap();
        let is_refused = match objects.open_job(&owner(), id).await.unwrap().unwrap() {
            Ok(found) => found.body.try_collect::<Vec<_>>().await.is_err(),
            Err(_) => true,
        };
        assert!(is_refused, "byte {at}");
    }
}

#[tokio::test]
async fn jobs_of_owners_that_are_gone_go_with_their_time() {
    let objects = Arc::new(Objects::in_memory());
    let (ended, open) = (asked(&objects, b"body").await, asked(&objects, b"body").await);
    assert!(put(&objects, ended, 0, body(&[b"text"])).await.unwrap());
    let (kept, longest) = (Duration::from_secs(60), Duration::from_secs(600));
    let sweep = async |knows: bool, seconds| {
        let now = SystemTime::now() + Duration::from_secs(seconds);
        objects.sweep_jobs(|name| knows && *name == owner(), kept, longest, now).await.unwrap();
        let there = objects.jobs(&owner()).await.unwrap();
        there.into_iter().map(|job| job.id).collect::<Vec<_>>()
    };
    assert_eq!(sweep(true, 86400).await, [ended, open]);
    assert_eq!(sweep(false, 30).await, [ended, open]);
    assert_eq!(sweep(false, 90).await, [open]);
    // Creating a lease counts as work on the job.
    assert!(objects.claim_job(&owner(), open, 0, &super::Lease::default()).await.unwrap());
    assert_eq!(sweep(false, 500).await, [open]);
    assert_eq!(sweep(false, 700).await, []);
}

#[tokio::test]
async fn of_all_who_delete_a_job_at_once_one_does() {
    let objects = Arc::new(Objects::in_memory());
    for _ in 0..20 {
        let id = asked(&objects, b"body").await;
        assert!(put(&objects, id, 0, body(&[b"text"])).await.unwrap());
        let deleting = futures_util::future::join_all((0..8).map(|_| {
            let objects = objects.clone();
            async move { objects.delete_job(&owner(), id).await.unwrap() }
        }));
        assert_eq!(deleting.await.into_iter().filter(|&is_deleted| is_deleted).count(), 1);
        assert!(objects.get_result(&owner(), id).await.unwrap().is_none());
    }
    // A process that deletes a job may end halfway: the job is unknown, and its left-overs are no damage.
    let id = asked(&objects, b"body").await;
    assert!(put(&objects, id, 0, body(&[b"text"])).await.unwrap());
    objects.put(&objects.job(&owner(), id, DELETED), PutPayload::default()).await.unwrap();
    objects.delete(&objects.answer(&owner(), id, 0)).await.unwrap();
    assert!(objects.get_result(&owner(), id).await.unwrap().is_none());
    assert!(!objects.find_job(&owner(), id).await.unwrap().unwrap().is_known());
    assert!(!objects.delete_job(&owner(), id).await.unwrap());
    assert_eq!(objects.n_damaged(), 0);
    objects.clear_job(&owner(), id).await.unwrap();
    assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
}

#[tokio::test]
async fn a_late_result_leaves_the_rest_to_the_deletion_that_is_under_way() {
    let objects = Objects::in_memory();
    let id = asked(&objects, b"body").await;
    objects.put(&objects.job(&owner(), id, DELETED), PutPayload::default()).await.unwrap();
    assert!(!objects.cancel_job(&owner(), id).await.unwrap());
    // The deletion goes on, and the job was there.
    assert!(objects.clear_job(&owner(), id).await.unwrap());
    assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
}

#[tokio::test]
async fn a_key_is_claimed_once_for_each_state_of_its_register() {
    let objects = Objects::in_memory();
    let (key, name) = (KeyHash::of(b"key"), owner());
    let claim_of = |id| Claim::new(key.clone(), id, "print".to_owned());
    let (first, late) = (asked(&objects, b"").await, asked(&objects, b"").await);
    let empty = objects.register(&name, &key).await.unwrap();
    assert_eq!(empty.claim(&key), None);
    assert!(objects.claim_key(&name, empty.clone(), claim_of(first)).await.unwrap());
    assert!(!objects.claim_key(&name, empty.clone(), claim_of(late)).await.unwrap());
    let after_first = objects.register(&name, &key).await.unwrap();
    assert_eq!(after_first.claim(&key), Some(&claim_of(first)));
    // A deletion leaves the claim. Whoever looked before another claim was made makes none.
    assert!(objects.delete_job(&name, first).await.unwrap());
    assert!(objects.claim_key(&name, after_first.clone(), claim_of(late)).await.unwrap());
    for stale in [after_first, empty] {
        assert!(!objects.claim_key(&name, stale, claim_of(first)).await.unwrap());
    }
    let after_late = objects.register(&name, &key).await.unwrap();
    assert_eq!(after_late.claim(&key), Some(&claim_of(late)));
}

#[tokio::test]
async fn a_sweep_leaves_the_last_generation_of_each_register() {
    let objects = Objects::in_memory();
    let (key, name) = (KeyHash::of(b"key"), owner());
    let id = asked(&objects, b"").await;
    let claim = Claim::new(key.clone(), id, "print".to_owned());
    for _ in 0..2 {
        let register = objects.register(&name, &key).await.unwrap();
        assert!(objects.claim_key(&name, register, claim.clone()).await.unwrap());
    }
    // A replaced generation that was not deleted, and a claim of an earlier version.
    let hash = blake3::hash(b"key").to_hex();
    let register = &hash[..3];
    for left in [&["claims", register, "0"][..], &["claims", &"0".repeat(64), "0"]] {
        let left = objects.path(&[&[&*name.0], left].concat());
        objects.put(&left, Bytes::from_static(b"{}").into()).await.unwrap();
        objects.sweep_claims(&name).await.unwrap();
        assert!(objects.store.head(&left).await.is_err());
    }
    assert_eq!(objects.register(&name, &key).await.unwrap().claim(&key), Some(&claim));
}

#[tokio::test]
async fn a_long_register_loses_the_claims_of_deleted_jobs() {
    let objects = Objects::in_memory();
    let name = owner();
    let of_register = |key: &KeyHash| serde_json::to_string(key).unwrap()[1..4].to_owned();
    let first = KeyHash::of(b"0");
    // Keys of one register, by trial.
    let mut keys = (0..).map(|k: u64| KeyHash::of(k.to_string().as_bytes()));
    let keys: Vec<_> =
        std::iter::from_fn(|| keys.find(|key| of_register(key) == of_register(&first))).take(12).collect();
    let mut ids = Vec::new();
    for key in &keys {
        let id = asked(&objects, b"").await;
        let register = objects.register(&name, key).await.unwrap();
        assert!(
            objects.claim_key(&name, register, Claim::new(key.clone(), id, String::new())).await.unwrap()
        );
        ids.push(id);
        if ids.len() == 6 {
            for &id in &ids[..5] {
                assert!(objects.delete_job(&name, id).await.unwrap());
            }
        }
    }
    let register = objects.register(&name, &first).await.unwrap();
    let is_claimed: Vec<bool> = keys.iter().map(|key| register.claim(key).is_some()).collect();
    assert_eq!(is_claimed, [vec![false; 5], vec![true; 7]].concat());
}

#[tokio::test]
async fn what_is_read_in_memory_is_there_once_and_paid_for_until_it_is_read() {
    use crate::memory::Owner;
    use crate::memory::budget::Budget;

    const N_BYTES: usize = 1 << 20;
    let (objects, budget) = (Arc::new(Objects::in_memory()), Budget::new(16 << 20, 1));
    let id = asked(&objects, b"").await;
    let mut room = Room::of(&budget, Owner(0), 0).unwrap();
    let piece = || Ok::<_, String>(Bytes::from(vec![7; N_BYTES]));
    let answer = Answer { attempt: 0, head: head(), body: futures_util::stream::iter([piece(), piece()]) };
    assert!(objects.put_result(&owner(), id, answer, &mut room).await.unwrap());
    assert!(!room.is_exceeded() && room.into_reservation().is_none());
    let held = budget.n_held();
    assert!((2 * N_BYTES..2 * N_BYTES + 8192).contains(&held), "{held}");
    let reading = (0..50).map(|_| async {
        let found = objects.get_result(&owner(), id).await.unwrap().unwrap();
        found.body.try_collect::<Vec<_>>().await.unwrap()
    });
    let pieces = futures_util::future::join_all(reading).await;
    let places = |pieces: &[Bytes]| pieces.iter().map(|piece| piece.as_ptr()).collect::<Vec<_>>();
    // The last byte is excepted: it is held back until the hash is checked.
    let n = pieces[0].len() - 1;
    assert!(pieces.iter().all(|other| places(&other[..n]) == places(&pieces[0][..n])), "they are copies");
    assert!(objects.delete_job(&owner(), id).await.unwrap());
    assert_eq!(budget.n_held(), held, "they are held still");
    drop(pieces);
    assert_eq!(budget.n_held(), 0);
    // An answer beyond its room is not published.
    let mut room = Room::of(&Budget::new(3 * N_BYTES, 1), Owner(0), 0).unwrap();
    let id = asked(&objects, b"").await;
    let answer = Answer { attempt: 0, head: head(), body: futures_util::stream::iter([piece(), piece()]) };
    assert!(objects.put_result(&owner(), id, answer, &mut room).await.is_err() && room.is_exceeded());
    assert!(objects.get_result(&owner(), id).await.unwrap().is_none());
}
