//! Jobs as objects: what was asked, who is at it, and what came of it.
//!
//! NAMES. `<owner>/jobs/<id>/request` is what was asked; `lease-<attempt>` says who is at it, and is written again while they are;
//! `answer-<attempt>` is what an attempt came to, and `result` which of them is that of the job. A job without a result whose last lease is not
//! written any more is anybody's: who makes the next lease has it. Making a lease is exclusive, so one attempt has one process; so is making the
//! result, so that a job ends once, whoever was only asleep.
//!
//! OBJECTS are a line of JSON, a body if they have one, and the BLAKE3 of both (pieces.rs), but for leases, which are a line.

use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt};
use object_store::path::Path;
use object_store::{Error, ObjectMeta, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::pieces::{self, BrokenOff, sealed, unsealed};
use super::{Damaged, Objects, OwnerName, Unavailable, Verb};

const FOLDER: &str = "jobs";
const REQUEST: &str = "request";
const RESULT: &str = "result";
const LEASE: &str = "lease-";
const ANSWER: &str = "answer-";

/// The name of a job: a UUID of version 7, which tells when it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct JobId(Uuid);

impl JobId {
    /// A name that no other job has.
    pub fn new() -> Self {
        Self(Uuid::now_v7())
    }

    /// As it is written: 32 digits, hexadecimal, with four hyphens.
    pub fn parse(text: &str) -> Option<Self> {
        let id = Uuid::parse_str(text).ok()?;
        (id.get_version_num() == 7 && id.hyphenated().to_string() == text).then_some(Self(id))
    }

    /// When it was made.
    pub fn created_at(self) -> SystemTime {
        let (seconds, nanoseconds) = self.0.get_timestamp().map_or((0, 0), |time| time.to_unix());
        SystemTime::UNIX_EPOCH + std::time::Duration::new(seconds, nanoseconds)
    }
}

impl Default for JobId {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Display for JobId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0.hyphenated())
    }
}

/// What was asked: a request without what is secret in it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRequest {
    pub path: String,
    pub headers: Vec<(String, String)>,
}

/// What came of it. The headers are those of the answer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobResult {
    pub outcome: Outcome,
    pub status: u16,
    pub headers: Vec<(String, String)>,
}

/// How a job ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Succeeded,
    Failed,
    Cancelled,
}

/// Who is at a job, and how far.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lease {
    /// Attempts before that ended with their process, and not because it was told to end.
    pub n_crashes: u32,
    /// It was left in order: anybody may go on at once.
    pub is_released: bool,
    pub stage: Option<String>,
    pub fraction: f64,
    pub residual: Option<f64>,
    pub seconds_left: Option<f64>,
}

/// What there is of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobObjects {
    pub owner: OwnerName,
    pub id: JobId,
    pub has_request: bool,
    /// When there was a result.
    pub ended_at: Option<SystemTime>,
    /// The last attempt, and when its lease was written.
    pub lease: Option<(u32, SystemTime)>,
}

/// A result as it is written: where its body is, if it has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Published {
    head: JobResult,
    attempt: Option<u32>,
}

impl JobObjects {
    /// Whether this attempt is the last one, of a job that is still to be done.
    pub fn is_that_of(&self, attempt: u32) -> bool {
        self.has_request && self.ended_at.is_none() && self.lease.is_none_or(|(last, _)| last <= attempt)
    }
}

/// The result of a job, and its body as it is read.
pub struct FoundResult {
    pub head: JobResult,
    pub ended_at: SystemTime,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// What was asked, and its body as it is read.
pub struct FoundRequest {
    pub request: JobRequest,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

impl Objects {
    /// Writes what is asked.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn put_job(
        &self,
        owner: &OwnerName,
        id: JobId,
        request: &JobRequest,
        body: Bytes,
    ) -> Result<(), Unavailable> {
        let line = line_of(request);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        hasher.update(&body);
        let hash = Bytes::copy_from_slice(hasher.finalize().as_bytes());
        let payload: PutPayload = [line, body, hash].into_iter().collect();
        self.put(&self.job(owner, id, REQUEST), payload).await
    }

    /// What was asked, if it is there, and as it was written as far as its first line.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn open_job(
        &self,
        owner: &OwnerName,
        id: JobId,
    ) -> Result<Option<Result<FoundRequest, Damaged>>, Unavailable> {
        let found = self.open_pieces(&self.job(owner, id, REQUEST)).await?;
        let read = |found: pieces::Found| {
            let request = serde_json::from_slice(&found.line);
            let request = request.map_err(|_| Damaged("its first line is no request"))?;
            Ok(FoundRequest { request, n_body_bytes: found.n_body_bytes, body: found.body })
        };
        Ok(found.map(|found| found.and_then(read)))
    }

    /// Counts a request that is not what was written: its job fails.
    pub fn report_job(&self, owner: &OwnerName, id: JobId) {
        let name = self.job(owner, id, REQUEST);
        self.report(&name, Damaged("its bytes are not those that were written"));
    }

    /// Makes the lease of an attempt; says whether this process has it.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn claim_job(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
        lease: &Lease,
    ) -> Result<bool, Unavailable> {
        self.create(&self.lease(owner, id, attempt), line_of(lease).into()).await
    }

    /// Writes a lease again: its process is alive, and this far.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn renew_lease(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
        lease: &Lease,
    ) -> Result<(), Unavailable> {
        self.put(&self.lease(owner, id, attempt), line_of(lease).into()).await
    }

    /// The lease of an attempt; one that cannot be read is that of nobody.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_lease(
        &self,
        owner: &OwnerName,
        id: JobId,
        attempt: u32,
    ) -> Result<Option<Lease>, Unavailable> {
        let name = self.lease(owner, id, attempt);
        let found = async { self.store.get(&name).await?.bytes().await };
        let found = self.counted(Verb::Read, &name, found.await)?;
        Ok(found.map(|bytes| serde_json::from_slice(&bytes).unwrap_or_default()))
    }

    /// Writes what an attempt came to, as its body comes, and makes it the result of the job unless it has one, or nobody wants it any more; says
    /// whether it is. Nothing is there until all of it is.
    ///
    /// # Errors
    /// [`Unavailable`], also if the body breaks off.
    pub async fn put_result<E: std::fmt::Display>(
        &self,
        (owner, id): (&OwnerName, JobId),
        attempt: u32,
        head: JobResult,
        body: impl Stream<Item = Result<Bytes, E>>,
    ) -> Result<bool, Unavailable> {
        let answer = self.answer(owner, id, attempt);
        let body = body.map(|piece| piece.map_err(|error| error.to_string()));
        self.put_pieces(&answer, line_of(&head), body).await?;
        let is_wanted = self.find_job(owner, id).await?.is_some_and(|job| job.has_request);
        let is_result = is_wanted && self.publish(owner, id, head, Some(attempt)).await?;
        if !is_result {
            self.delete(&answer).await?;
            return Ok(false);
        }
        // Forgotten meanwhile: it must not come back.
        match self.find_job(owner, id).await?.filter(|job| !job.has_request) {
            Some(forgotten) => self.delete_job(&forgotten).await.map(|()| false),
            None => Ok(true),
        }
    }

    /// Ends a job without an answer, unless it has a result; says whether it had none.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn cancel_job(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let head = JobResult { outcome: Outcome::Cancelled, status: 0, headers: Vec::new() };
        self.publish(owner, id, head, None).await
    }

    /// Makes the result of a job, unless it has one.
    async fn publish(
        &self,
        owner: &OwnerName,
        id: JobId,
        head: JobResult,
        attempt: Option<u32>,
    ) -> Result<bool, Unavailable> {
        let result = sealed(line_of(&Published { head, attempt }));
        self.create(&self.job(owner, id, RESULT), result).await
    }

    /// What came of a job, if it has ended. A result that is not what was written is let go, and reported: the job is anybody's then.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_result(
        self: &Arc<Self>,
        owner: &OwnerName,
        id: JobId,
    ) -> Result<Option<FoundResult>, Unavailable> {
        let name = self.job(owner, id, RESULT);
        let found = async {
            let found = self.store.get(&name).await?;
            Ok((SystemTime::from(found.meta.last_modified), found.bytes().await?))
        };
        let Some((ended_at, bytes)) = self.counted(Verb::Read, &name, found.await)? else { return Ok(None) };
        let read = unsealed(&bytes).and_then(|line| {
            serde_json::from_slice(line).map_err(|_| Damaged("its first line is no result"))
        });
        let damaged = match read {
            Ok(Published { head, attempt: None }) => {
                let body = futures_util::stream::empty().boxed();
                return Ok(Some(FoundResult { head, ended_at, n_body_bytes: 0, body }));
            }
            Ok(Published { head, attempt: Some(attempt) }) => {
                match self.open_pieces(&self.answer(owner, id, attempt)).await? {
                    Some(Ok(found)) => {
                        let body = self.clone().reporting(owner.clone(), id, found.body);
                        return Ok(Some(FoundResult {
                            head,
                            ended_at,
                            n_body_bytes: found.n_body_bytes,
                            body,
                        }));
                    }
                    Some(Err(damaged)) => damaged,
                    None => Damaged("its body is not there"),
                }
            }
            Err(damaged) => damaged,
        };
        self.drop_result(owner, id, damaged).await;
        Ok(None)
    }

    /// A body that lets go of its result if it is not what was written.
    fn reporting(
        self: Arc<Self>,
        owner: OwnerName,
        id: JobId,
        body: BoxStream<'static, Result<Bytes, BrokenOff>>,
    ) -> BoxStream<'static, Result<Bytes, BrokenOff>> {
        let body = body.then(move |piece| {
            let (objects, owner) = (self.clone(), owner.clone());
            async move {
                if let Err(BrokenOff::Damaged) = piece {
                    objects
                        .drop_result(&owner, id, Damaged("its bytes are not those that were written"))
                        .await;
                }
                piece
            }
        });
        body.boxed()
    }

    /// Lets go of a result that is not what was written.
    async fn drop_result(&self, owner: &OwnerName, id: JobId, damaged: Damaged) {
        let name = self.job(owner, id, RESULT);
        self.report(&name, damaged);
        let is_gone = self.delete(&name).await.is_ok();
        tracing::error!(job = %id, is_gone, "the result of a job is damaged, and made again");
    }

    /// What there is of one job, if anything.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn find_job(&self, owner: &OwnerName, id: JobId) -> Result<Option<JobObjects>, Unavailable> {
        let found = self.objects_in(owner, &[FOLDER, &id.to_string()]).await?;
        Ok(collected(owner, found).pop())
    }

    /// What there is of the jobs of an owner.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn jobs(&self, owner: &OwnerName) -> Result<Vec<JobObjects>, Unavailable> {
        Ok(collected(owner, self.objects_in(owner, &[FOLDER]).await?))
    }

    /// Forgets a job: what was asked first, so that nobody begins it again.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn delete_job(&self, job: &JobObjects) -> Result<(), Unavailable> {
        let JobObjects { owner, id, .. } = job;
        self.delete(&self.job(owner, *id, REQUEST)).await?;
        for object in self.objects_in(owner, &[FOLDER, &id.to_string()]).await? {
            self.delete(&object.location).await?;
        }
        Ok(())
    }

    /// Writes an object that is not there; says whether it was not.
    async fn create(&self, name: &Path, payload: PutPayload) -> Result<bool, Unavailable> {
        match self.store.put_opts(name, payload, PutOptions::from(PutMode::Create)).await {
            Ok(_) => {
                self.tally.add(Verb::Write, true);
                Ok(true)
            }
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.failed(Verb::Write, name, error)),
        }
    }

    fn answer(&self, owner: &OwnerName, id: JobId, attempt: u32) -> Path {
        self.job(owner, id, &format!("{ANSWER}{attempt}"))
    }

    fn job(&self, owner: &OwnerName, id: JobId, part: &str) -> Path {
        self.path(&[&owner.0, FOLDER, &id.to_string(), part])
    }

    fn lease(&self, owner: &OwnerName, id: JobId, attempt: u32) -> Path {
        self.job(owner, id, &format!("{LEASE}{attempt}"))
    }
}

fn line_of(head: &impl Serialize) -> Bytes {
    // Types of this file, which can be written.
    let mut line = serde_json::to_vec(head).unwrap_or_default();
    line.push(b'\n');
    line.into()
}

/// Objects by their jobs.
fn collected(owner: &OwnerName, found: Vec<ObjectMeta>) -> Vec<JobObjects> {
    let mut jobs = std::collections::BTreeMap::new();
    for object in found {
        let mut parts: Vec<_> = object.location.parts().collect();
        let (Some(part), Some(id)) = (parts.pop(), parts.pop()) else { continue };
        let Some(id) = JobId::parse(id.as_ref()) else { continue };
        let job = jobs.entry(id).or_insert_with(|| JobObjects {
            owner: owner.clone(),
            id,
            has_request: false,
            ended_at: None,
            lease: None,
        });
        let written_at = SystemTime::from(object.last_modified);
        match part.as_ref() {
            REQUEST => job.has_request = true,
            RESULT => job.ended_at = Some(written_at),
            other => {
                if let Some(attempt) = other.strip_prefix(LEASE).and_then(|text| text.parse().ok()) {
                    job.lease = job.lease.max(Some((attempt, written_at)));
                }
            }
        }
    }
    jobs.into_values().collect()
}

#[cfg(test)]
mod tests {
    use futures_util::TryStreamExt;

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
}
