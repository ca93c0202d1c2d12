//! Jobs as objects: request, leases, answers and result.
//!
//! NAMES. `<owner>/jobs/<id>/request` is the request. `lease-<attempt>` tells which process works on the job,
//! and is rewritten while it does. `answer-<attempt>` is the answer of an attempt. `result` tells which
//! answer is that of the job.
//!
//! EXCLUSIVE WRITES. A job is free if it has no result and its last lease is no longer rewritten. The process
//! that creates the next lease has it. Creating a lease is exclusive, so one attempt belongs to one process.
//! Creating the result is exclusive too. So a job ends once, even if a process that seemed dead was only
//! asleep.
//!
//! OPEN JOBS have a mark, the empty object `<owner>/open/<id>`, so that they are found without a list of all
//! jobs. The mark is written after the request and removed after the result. So a job that has ended may
//! still have one, which the next round removes.
//!
//! DELETION begins with the object `deleted`. Creating it is exclusive, so one of several concurrent
//! deletions deletes the job. From then on the job is unknown, whatever is left of it.
//!
//! IDEMPOTENCY KEYS of requests are under `<owner>/claims/` (claims.rs).
//!
//! OBJECTS are a line of JSON, a body if they have one, and the BLAKE3 of both (pieces.rs). Leases are a line
//! alone.

mod asked;
mod claims;
mod leases;
mod results;
#[cfg(test)]
mod tests;

use std::time::{Duration, SystemTime};

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectMeta, PutPayload};
use serde::Serialize;
use uuid::Uuid;

use super::{Objects, OwnerName, Unavailable};
pub use asked::{FoundRequest, JobRequest, NewJob};
pub use claims::{Claim, KeyHash, Register};
pub use leases::Lease;
pub use results::{Answer, FoundResult, JobResult, Outcome};

const FOLDER: &str = "jobs";
const OPEN: &str = "open";
const REQUEST: &str = "request";
const RESULT: &str = "result";
const DELETED: &str = "deleted";
const LEASE: &str = "lease-";
const ANSWER: &str = "answer-";

/// Name of a job: a UUID of version 7, which tells when it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct JobId(Uuid);

impl JobId {
    /// Creates a name that no other job has.
    pub fn new() -> Self {
        Self(Uuid::now_v7())
    }

    /// Parses 32 hexadecimal digits with four hyphens, exactly as a name is written.
    pub fn parse(text: &str) -> Option<Self> {
        let id = Uuid::parse_str(text).ok()?;
        (id.get_version_num() == 7 && id.hyphenated().to_string() == text).then_some(Self(id))
    }

    /// Time at which the name was made.
    pub fn created_at(self) -> SystemTime {
        let (seconds, nanoseconds) = self.0.get_timestamp().map_or((0, 0), |time| time.to_unix());
        SystemTime::UNIX_EPOCH + Duration::new(seconds, nanoseconds)
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

/// Summary of the objects of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobObjects {
    pub id: JobId,
    pub has_request: bool,
    /// Whether its deletion has begun.
    is_deleted: bool,
    /// Time of the result, if there is one.
    pub ended_at: Option<SystemTime>,
    /// The last attempt, and the time at which its lease was written.
    pub lease: Option<(u32, SystemTime)>,
    pub n_bytes: u64,
}

impl JobObjects {
    /// Returns whether the job exists: it was written, and is not being deleted.
    pub fn is_known(&self) -> bool {
        self.has_request && !self.is_deleted
    }

    /// Returns whether the job exists and has not ended.
    pub fn is_open(&self) -> bool {
        self.is_known() && self.ended_at.is_none()
    }

    /// Returns whether the job is open and has no attempt later than `attempt`.
    pub fn is_that_of(&self, attempt: u32) -> bool {
        self.is_open() && self.lease.is_none_or(|(last, _)| last <= attempt)
    }
}

impl Objects {
    /// Finds the objects of one job, if there are any.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn find_job(&self, owner: &OwnerName, id: JobId) -> Result<Option<JobObjects>, Unavailable> {
        let found = self.objects_in(owner, &[FOLDER, &id.to_string()]).await?;
        Ok(collected(found).pop())
    }

    /// Finds the objects of all jobs of an owner. The list is as long as there are jobs, so it is rarely
    /// requested.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn jobs(&self, owner: &OwnerName) -> Result<Vec<JobObjects>, Unavailable> {
        Ok(collected(self.objects_in(owner, &[FOLDER]).await?))
    }

    /// Lists the jobs of an owner that are marked as open. Some may have ended or be gone.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn open_jobs(&self, owner: &OwnerName) -> Result<Vec<JobId>, Unavailable> {
        let found = self.objects_in(owner, &[OPEN]).await?;
        Ok(found.iter().filter_map(|object| JobId::parse(object.location.filename()?)).collect())
    }

    /// Marks a job as open.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn mark_open(&self, owner: &OwnerName, id: JobId) -> Result<(), Unavailable> {
        self.put(&self.open_mark(owner, id), PutPayload::default()).await
    }

    /// Removes the mark of an open job.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn unmark_open(&self, owner: &OwnerName, id: JobId) -> Result<(), Unavailable> {
        self.delete(&self.open_mark(owner, id)).await.map(|_| ())
    }

    /// Deletes a job. Returns whether it was known and this call deleted it.
    ///
    /// # Errors
    /// [`Unavailable`]. The job is unknown then, or as it was.
    pub async fn delete_job(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        if !self.create(&self.job(owner, id, DELETED), PutPayload::default()).await? {
            return Ok(false);
        }
        self.clear_job(owner, id).await
    }

    /// Removes what is left of a job. Returns whether its request was among it.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn clear_job(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let found = self.objects_in(owner, &[FOLDER, &id.to_string()]).await?;
        let deleted = self.job(owner, id, DELETED);
        for object in found.iter().filter(|object| object.location != deleted) {
            self.delete(&object.location).await?;
        }
        self.unmark_open(owner, id).await?;
        let Some(job) = collected(found).pop() else { return Ok(false) };
        self.delete(&deleted).await?;
        Ok(job.has_request)
    }

    /// Deletes jobs of owners that `knows` rejects, because their API key was removed, and then their claims.
    /// A job is deleted `kept` after its end, or after `longest` without work on it.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn sweep_jobs(
        &self,
        knows: impl Fn(&OwnerName) -> bool,
        kept: Duration,
        longest: Duration,
        now: SystemTime,
    ) -> Result<(), Unavailable> {
        for owner in self.owners().await?.into_iter().filter(|owner| !knows(owner)) {
            let jobs = self.jobs(&owner).await?;
            if jobs.is_empty() {
                self.forget_claims(&owner, now).await?;
            }
            for job in jobs {
                let written_at = job.lease.map_or(job.id.created_at(), |(_, written_at)| written_at);
                let (since, most) = job.ended_at.map_or((written_at, longest), |ended_at| (ended_at, kept));
                if now.duration_since(since).is_ok_and(|age| age > most) {
                    self.clear_job(&owner, job.id).await?;
                }
            }
        }
        Ok(())
    }

    fn answer(&self, owner: &OwnerName, id: JobId, attempt: u32) -> Path {
        self.job(owner, id, &format!("{ANSWER}{attempt}"))
    }

    fn job(&self, owner: &OwnerName, id: JobId, part: &str) -> Path {
        self.path(&[&owner.0, FOLDER, &id.to_string(), part])
    }

    fn open_mark(&self, owner: &OwnerName, id: JobId) -> Path {
        self.path(&[&owner.0, OPEN, &id.to_string()])
    }

    fn lease(&self, owner: &OwnerName, id: JobId, attempt: u32) -> Path {
        self.job(owner, id, &format!("{LEASE}{attempt}"))
    }
}

fn line_of(head: &impl Serialize) -> Bytes {
    // All callers pass types of this module, which always serialize.
    let mut line = serde_json::to_vec(head).unwrap_or_default();
    line.push(b'\n');
    line.into()
}

/// Groups objects by job.
fn collected(found: Vec<ObjectMeta>) -> Vec<JobObjects> {
    let mut jobs = std::collections::BTreeMap::new();
    for object in found {
        let mut parts: Vec<_> = object.location.parts().collect();
        let (Some(part), Some(id)) = (parts.pop(), parts.pop()) else { continue };
        let Some(id) = JobId::parse(id.as_ref()) else { continue };
        let job = jobs.entry(id).or_insert_with(|| JobObjects {
            id,
            has_request: false,
            is_deleted: false,
            ended_at: None,
            lease: None,
            n_bytes: 0,
        });
        job.n_bytes += object.size;
        let written_at = SystemTime::from(object.last_modified);
        match part.as_ref() {
            REQUEST => job.has_request = true,
            RESULT => job.ended_at = Some(written_at),
            DELETED => job.is_deleted = true,
            other => {
                if let Some(attempt) = other.strip_prefix(LEASE).and_then(|text| text.parse().ok()) {
                    job.lease = job.lease.max(Some((attempt, written_at)));
                }
            }
        }
    }
    jobs.into_values().collect()
}
