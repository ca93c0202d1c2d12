//! Jobs as objects: what was asked, who is at it, and what came of it.
//!
//! NAMES. `<owner>/jobs/<id>/request` is what was asked; `lease-<attempt>` says who is at it, and is written again while they are;
//! `answer-<attempt>` is what an attempt came to, and `result` which of them is that of the job. A job without a result whose last lease is not
//! written any more is anybody's: who makes the next lease has it. Making a lease is exclusive, so one attempt has one process; so is making the
//! result, so that a job ends once, whoever was only asleep.
//!
//! OBJECTS are a line of JSON, a body if they have one, and the BLAKE3 of both (pieces.rs), but for leases, which are a line.

mod asked;
mod leases;
mod results;
#[cfg(test)]
mod tests;

use std::time::{Duration, SystemTime};

use bytes::Bytes;
use object_store::ObjectMeta;
use object_store::path::Path;
use serde::Serialize;
use uuid::Uuid;

use super::{Objects, OwnerName, Unavailable};
pub use asked::{FoundRequest, JobRequest};
pub use leases::Lease;
pub use results::{FoundResult, JobResult, Outcome};

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

impl JobObjects {
    /// Whether this attempt is the last one, of a job that is still to be done.
    pub fn is_that_of(&self, attempt: u32) -> bool {
        self.has_request && self.ended_at.is_none() && self.lease.is_none_or(|(last, _)| last <= attempt)
    }
}

impl Objects {
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

    /// Bytes of all jobs. Those of owners that nobody `knows` any more, a key of theirs having been taken away, are forgotten once they ended
    /// longer than `kept` ago, or nobody has worked on them for `longest`.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn sweep_jobs(
        &self,
        knows: impl Fn(&OwnerName) -> bool,
        (kept, longest): (Duration, Duration),
        now: SystemTime,
    ) -> Result<u64, Unavailable> {
        let mut n_bytes = 0;
        for owner in self.owners().await? {
            let found = self.objects_in(&owner, &[FOLDER]).await?;
            n_bytes += found.iter().map(|object| object.size).sum::<u64>();
            if knows(&owner) {
                continue;
            }
            for job in collected(&owner, found) {
                let written_at = job.lease.map_or(job.id.created_at(), |(_, written_at)| written_at);
                let (since, most) = job.ended_at.map_or((written_at, longest), |ended_at| (ended_at, kept));
                if now.duration_since(since).is_ok_and(|age| age > most) {
                    self.delete_job(&job).await?;
                }
            }
        }
        Ok(n_bytes)
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
