//! Jobs as objects: what was asked, who is at it, and what came of it.
//!
//! NAMES. `<owner>/jobs/<id>/request` is what was asked; `lease-<attempt>` says who is at it, and is written again while they are; `result` is what
//! came of it. A job without a result whose last lease is not written any more is anybody's: who makes the next lease has it. Making one is
//! exclusive, so one attempt has one process; a process that was only asleep may still end what another has begun again, and writes the same.
//!
//! OBJECTS are a line of JSON, a body, and the BLAKE3 of both: 32 bytes. What is read is what was written, or an error.

use std::time::SystemTime;

use bytes::{Bytes, BytesMut};
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt, TryStreamExt};
use object_store::buffered::BufWriter;
use object_store::path::Path;
use object_store::{Error, ObjectMeta, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::{Damaged, Objects, OwnerName, Unavailable, Verb};

const FOLDER: &str = "jobs";
const REQUEST: &str = "request";
const RESULT: &str = "result";
const LEASE: &str = "lease-";
const HASH_BYTES: usize = 32;

/// Bytes that the first line of an object may have.
const MAX_LINE: usize = 64 << 10;

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

/// The result of a job: its first line, and its body as it is read.
pub struct FoundResult {
    pub head: JobResult,
    pub ended_at: SystemTime,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// Why a body ends before its end.
#[derive(Debug, thiserror::Error)]
#[error("a result cannot be read to its end: {0}")]
pub struct BrokenOff(String);

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

    /// Bytes of what was asked, if it is there.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn job_bytes(&self, owner: &OwnerName, id: JobId) -> Result<Option<u64>, Unavailable> {
        let name = self.job(owner, id, REQUEST);
        let found = self.counted(Verb::Find, &name, self.store.head(&name).await)?;
        Ok(found.map(|found| found.size))
    }

    /// What was asked, if it is there, and as it was written.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn get_job(
        &self,
        owner: &OwnerName,
        id: JobId,
    ) -> Result<Option<Result<(JobRequest, Bytes), Damaged>>, Unavailable> {
        let name = self.job(owner, id, REQUEST);
        let found = async { self.store.get(&name).await?.bytes().await };
        let found = self.counted(Verb::Read, &name, found.await)?;
        Ok(found.map(|bytes| read_request(&bytes)))
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
        let name = self.lease(owner, id, attempt);
        let created = PutOptions::from(PutMode::Create);
        match self.store.put_opts(&name, line_of(lease).into(), created).await {
            Ok(_) => {
                self.tally.add(Verb::Write, true);
                Ok(true)
            }
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.failed(Verb::Write, &name, error)),
        }
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

    /// Writes what came of a job, as its body comes. Nothing is there until all of it is.
    ///
    /// # Errors
    /// [`Unavailable`], also if the body breaks off.
    pub async fn put_result<E: std::fmt::Display>(
        &self,
        owner: &OwnerName,
        id: JobId,
        head: &JobResult,
        body: impl Stream<Item = Result<Bytes, E>>,
    ) -> Result<(), Unavailable> {
        let name = self.job(owner, id, RESULT);
        let mut writer = BufWriter::new(self.store.clone(), name.clone());
        match write(&mut writer, line_of(head), body).await {
            Ok(()) => {
                self.tally.add(Verb::Write, true);
                Ok(())
            }
            Err(reason) => {
                // What was begun takes room in the store.
                let _ = writer.abort().await;
                self.tally.add(Verb::Write, false);
                Err(Unavailable { verb: Verb::Write, name: name.to_string(), reason })
            }
        }
    }

    /// Ends a job without a result, unless it has one; says whether it had none.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn cancel_job(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let name = self.job(owner, id, RESULT);
        let line = line_of(&JobResult { outcome: Outcome::Cancelled, status: 0, headers: Vec::new() });
        let hash = Bytes::copy_from_slice(blake3::hash(&line).as_bytes());
        let created = PutOptions::from(PutMode::Create);
        let written = self.store.put_opts(&name, [line, hash].into_iter().collect(), created).await;
        match written {
            Ok(_) => {
                self.tally.add(Verb::Write, true);
                Ok(true)
            }
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.failed(Verb::Write, &name, error)),
        }
    }

    /// Whether a job has ended.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn has_result(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let name = self.job(owner, id, RESULT);
        Ok(self.counted(Verb::Find, &name, self.store.head(&name).await)?.is_some())
    }

    /// What came of a job, if it has ended.
    ///
    /// # Errors
    /// [`Unavailable`], also where the first line is not what was written.
    pub async fn get_result(&self, owner: &OwnerName, id: JobId) -> Result<Option<FoundResult>, Unavailable> {
        let name = self.job(owner, id, RESULT);
        let found = self.counted(Verb::Read, &name, self.store.get(&name).await)?;
        let Some(found) = found else { return Ok(None) };
        let (n_bytes, ended_at) = (found.meta.size, SystemTime::from(found.meta.last_modified));
        let mut bytes = found.into_stream();
        let failed = |reason: String| Unavailable { verb: Verb::Read, name: name.to_string(), reason };
        let mut first = BytesMut::new();
        let end = loop {
            if let Some(end) = first.iter().position(|&byte| byte == b'\n') {
                break end + 1;
            }
            match bytes.try_next().await.map_err(|error| failed(error.to_string()))? {
                Some(more) if first.len() <= MAX_LINE => first.extend_from_slice(&more),
                _ => return Err(failed("it has no first line".to_owned())),
            }
        };
        let line = first.split_to(end);
        let head = serde_json::from_slice(&line).map_err(|error| failed(error.to_string()))?;
        let n_body_bytes = n_bytes.saturating_sub((line.len() + HASH_BYTES) as u64);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        let rest = bytes.map_err(|error| error.to_string()).boxed();
        let body = checked(hasher, first.freeze(), rest).boxed();
        Ok(Some(FoundResult { head, ended_at, n_body_bytes, body }))
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
        for attempt in 0..=job.lease.map_or(0, |(attempt, _)| attempt) {
            self.delete(&self.lease(owner, *id, attempt)).await?;
        }
        self.delete(&self.job(owner, *id, RESULT)).await?;
        Ok(())
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

/// What was asked, from its object.
///
/// # Errors
/// [`Damaged`] unless it is as it was written.
pub fn read_request(bytes: &Bytes) -> Result<(JobRequest, Bytes), Damaged> {
    let end = bytes.len().checked_sub(HASH_BYTES).ok_or(Damaged("it ends too early"))?;
    if blake3::hash(&bytes[..end]).as_bytes() != &bytes[end..] {
        return Err(Damaged("its bytes are not those that were written"));
    }
    let line = bytes.iter().position(|&byte| byte == b'\n').filter(|&line| line < end);
    let line = line.ok_or(Damaged("it has no first line"))? + 1;
    let head = serde_json::from_slice(&bytes[..line]).map_err(|_| Damaged("its first line is no request"))?;
    Ok((head, bytes.slice(line..end)))
}

async fn write<E: std::fmt::Display>(
    writer: &mut BufWriter,
    line: Bytes,
    body: impl Stream<Item = Result<Bytes, E>>,
) -> Result<(), String> {
    use tokio::io::AsyncWriteExt;
    let failed = |error: Error| error.to_string();
    let mut hasher = blake3::Hasher::new();
    hasher.update(&line);
    writer.put(line).await.map_err(failed)?;
    let mut body = std::pin::pin!(body);
    while let Some(piece) = body.next().await {
        let piece = piece.map_err(|error| error.to_string())?;
        hasher.update(&piece);
        writer.put(piece).await.map_err(failed)?;
    }
    writer.put(Bytes::copy_from_slice(hasher.finalize().as_bytes())).await.map_err(failed)?;
    writer.shutdown().await.map_err(|error| error.to_string())
}

/// The body in front of the hash behind it. The last bytes come only once the hash is right: who reads a body that is not what was written finds
/// it broken off, and never whole.
fn checked(
    hasher: blake3::Hasher,
    first: Bytes,
    rest: BoxStream<'static, Result<Bytes, String>>,
) -> impl Stream<Item = Result<Bytes, BrokenOff>> {
    let first = futures_util::stream::once(std::future::ready(Ok(first)));
    let state = Some((hasher, BytesMut::new(), first.chain(rest).boxed()));
    futures_util::stream::unfold(state, |state| async move {
        let (mut hasher, mut held, mut bytes) = state?;
        loop {
            match bytes.next().await {
                Some(Err(error)) => return Some((Err(BrokenOff(error)), None)),
                Some(Ok(more)) => {
                    held.extend_from_slice(&more);
                    // A byte of the body is held back as well, so that there is something to break off.
                    let n_free = held.len().saturating_sub(HASH_BYTES + 1);
                    if n_free > 0 {
                        let free = held.split_to(n_free).freeze();
                        hasher.update(&free);
                        return Some((Ok(free), Some((hasher, held, bytes))));
                    }
                }
                None => {
                    let body = held.split_to(held.len().saturating_sub(HASH_BYTES)).freeze();
                    hasher.update(&body);
                    let is_whole = hasher.finalize().as_bytes()[..] == held[..];
                    let wrong = || BrokenOff("its bytes are not those that were written".to_owned());
                    return Some((if is_whole { Ok(body) } else { Err(wrong()) }, None));
                }
            }
        }
    })
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

    async fn read(objects: &Objects, id: JobId) -> Result<Vec<u8>, BrokenOff> {
        let found = objects.get_result(&owner(), id).await.unwrap().unwrap();
        let (n_bytes, pieces) = (found.n_body_bytes, found.body.try_collect::<Vec<_>>().await?);
        let whole = pieces.concat();
        assert_eq!(whole.len() as u64, n_bytes);
        Ok(whole)
    }

    #[tokio::test]
    async fn what_is_asked_and_what_comes_of_it_is_read_as_it_was_written() {
        let (objects, id) = (Objects::in_memory(), JobId::new());
        assert_eq!(JobId::parse(&id.to_string()), Some(id));
        assert_eq!(JobId::parse(&id.to_string().to_uppercase()), None);
        assert_eq!(objects.find_job(&owner(), id).await.unwrap(), None);
        let headers = vec![("accept".to_owned(), "*/*".to_owned())];
        let request = JobRequest { path: "/v1/normals".to_owned(), headers };
        let points = Bytes::from_static(b"{}\n");
        objects.put_job(&owner(), id, &request, points.clone()).await.unwrap();
        let found = objects.get_job(&owner(), id).await.unwrap().unwrap();
        assert_eq!(found, Ok((request, points)));
        let bodies: [&[&'static [u8]]; 3] = [&[], &[b"x"], &[b"12345678", &[7; 100], b"", b"9"]];
        for pieces in bodies {
            objects.put_result(&owner(), id, &head(), body(pieces)).await.unwrap();
            assert_eq!(read(&objects, id).await.unwrap(), pieces.concat());
        }
        let found = objects.find_job(&owner(), id).await.unwrap().unwrap();
        assert!(found.has_request && found.ended_at.is_some() && found.lease.is_none());
        assert!(!objects.cancel_job(&owner(), id).await.unwrap(), "it has ended");
        objects.delete_job(&found).await.unwrap();
        assert_eq!(objects.find_job(&owner(), id).await.unwrap(), None);
        assert_eq!(objects.jobs(&owner()).await.unwrap(), []);
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
    async fn a_result_that_is_not_what_was_written_is_never_whole() {
        let (objects, id) = (Objects::in_memory(), JobId::new());
        objects.put_result(&owner(), id, &head(), body(&[b"0123456789"])).await.unwrap();
        let name = objects.job(&owner(), id, RESULT);
        let bytes = objects.store.get(&name).await.unwrap().bytes().await.unwrap();
        let line = bytes.iter().position(|&byte| byte == b'\n').unwrap() + 1;
        for at in line..bytes.len() {
            let mut other = bytes.to_vec();
            other[at] ^= 1;
            objects.put(&name, other.into()).await.unwrap();
            assert!(read(&objects, id).await.is_err(), "byte {at}");
            objects.put(&name, bytes.slice(..at).into()).await.unwrap();
            assert!(read(&objects, id).await.is_err(), "the first {at}");
        }
    }

    #[tokio::test]
    async fn a_request_that_is_not_what_was_written_is_refused() {
        let (objects, id) = (Objects::in_memory(), JobId::new());
        let request = JobRequest { path: "/v1/normals".to_owned(), headers: Vec::new() };
        objects.put_job(&owner(), id, &request, Bytes::from_static(b"abc")).await.unwrap();
        let name = objects.job(&owner(), id, REQUEST);
        let bytes = objects.store.get(&name).await.unwrap().bytes().await.unwrap();
        for at in 0..bytes.len() {
            let mut other = bytes.to_vec();
            other[at] ^= 1;
            objects.put(&name, other.into()).await.unwrap();
            assert!(objects.get_job(&owner(), id).await.unwrap().unwrap().is_err(), "byte {at}");
        }
    }
}
