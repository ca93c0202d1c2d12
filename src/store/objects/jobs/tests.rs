use std::sync::Arc;

use futures_util::{Stream, TryStreamExt};
use object_store::ObjectStoreExt;

use super::super::pieces::BrokenOff;
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
    objects.put_job(&owner(), id, &request, Bytes::from_static(body)).await.unwrap();
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
    objects.put_job(&owner(), id, &request, points.clone()).await.unwrap();
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
        assert!(objects.put_result((&owner(), id), 0, head(), body(pieces)).await.unwrap());
        assert_eq!(read(&objects, id).await.unwrap().unwrap(), pieces.concat());
    }
    assert!(objects.put_result((&owner(), id), 0, head(), body(&[])).await.unwrap());
    let found = objects.find_job(&owner(), id).await.unwrap().unwrap();
    assert!(found.has_request && found.ended_at.is_some() && found.lease.is_none());
    assert!(!objects.cancel_job(&owner(), id).await.unwrap(), "it has ended");
    objects.delete_job(&found).await.unwrap();
    assert_eq!(objects.find_job(&owner(), id).await.unwrap(), None);
}

#[tokio::test]
async fn a_job_ends_once() {
    let objects = Arc::new(Objects::in_memory());
    let id = asked(&objects, b"").await;
    assert!(objects.put_result((&owner(), id), 1, head(), body(&[b"first"])).await.unwrap());
    assert!(!objects.put_result((&owner(), id), 0, head(), body(&[b"late"])).await.unwrap());
    assert_eq!(read(&objects, id).await.unwrap().unwrap(), b"first");
    let cancelled = asked(&objects, b"").await;
    assert!(objects.cancel_job(&owner(), cancelled).await.unwrap());
    assert!(!objects.put_result((&owner(), cancelled), 0, head(), body(&[b"late"])).await.unwrap());
    let found = objects.get_result(&owner(), cancelled).await.unwrap().unwrap();
    assert_eq!((found.head.outcome, found.n_body_bytes), (Outcome::Cancelled, 0));
    // Nor does one come back that was forgotten.
    for id in [id, cancelled] {
        let job = objects.find_job(&owner(), id).await.unwrap().unwrap();
        objects.delete_job(&job).await.unwrap();
        assert!(!objects.put_result((&owner(), id), 2, head(), body(&[b"late"])).await.unwrap());
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
        let put = objects.put_result((&owner(), id), 0, head(), futures_util::stream::iter(pieces)).await;
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
    objects.delete_job(&found).await.unwrap();
    assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
}

#[tokio::test]
async fn a_result_that_is_not_what_was_written_is_never_whole_and_made_again() {
    let objects = Arc::new(Objects::in_memory());
    let id = asked(&objects, b"").await;
    objects.put_result((&owner(), id), 0, head(), body(&[b"0123456789"])).await.unwrap();
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
    assert!(objects.put_result((&owner(), ended), 0, head(), body(&[b"text"])).await.unwrap());
    let times = (Duration::from_secs(60), Duration::from_secs(600));
    let sweep = async |knows: bool, seconds| {
        let now = SystemTime::now() + Duration::from_secs(seconds);
        let n_bytes = objects.sweep_jobs(|name| knows && *name == owner(), times, now).await.unwrap();
        let there = objects.jobs(&owner()).await.unwrap();
        (n_bytes, there.into_iter().map(|job| job.id).collect::<Vec<_>>())
    };
    let (n_bytes, there) = sweep(true, 86400).await;
    assert!(n_bytes > 12 && there == [ended, open]);
    assert_eq!(sweep(false, 30).await, (n_bytes, vec![ended, open]));
    assert_eq!(sweep(false, 90).await, (n_bytes, vec![open]));
    // Somebody is at it.
    assert!(objects.claim_job(&owner(), open, 0, &super::Lease::default()).await.unwrap());
    assert_eq!(sweep(false, 500).await.1, [open]);
    assert_eq!(sweep(false, 700).await.1, []);
    assert_eq!(sweep(false, 0).await.0, 0);
}
