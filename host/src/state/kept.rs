//! A table of kept jobs: how many there are, whose they are, and when they ended.
//!
//! The table has the jobs that this process accepted or ended, and those that it found when it last listed
//! the store. Other processes add and delete jobs meanwhile. So a refusal makes the next round list the jobs
//! of the refused owner again.

use std::collections::{HashMap, HashSet};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use crate::memory::budget::Reservation;
use crate::memory::{Owner, share_of_one};
use crate::problem::Problem;
use crate::store::jobs::JobId;

/// Seconds after which a refused client may try again. By then the jobs of its owner have been listed anew.
pub const SECONDS_UNTIL_COUNTED: u64 = 5;

/// Kept jobs by their ids, with the most that all owners and one owner may have.
pub struct KeptJobs {
    most: usize,
    most_of_owner: usize,
    table: Mutex<Table>,
}

#[derive(Default)]
struct Table {
    jobs: HashMap<JobId, KeptJob>,
    /// Owners that were refused. Other processes may have deleted jobs of theirs.
    refused: HashSet<Owner>,
}

/// A kept job.
pub struct KeptJob {
    pub owner: Owner,
    pub ended_at: Option<SystemTime>,
    /// Reserved bytes of the store. Objects in memory hold their reservation themselves.
    pub bytes: Option<Reservation>,
}

impl KeptJob {
    fn pay(&mut self, bytes: Option<Reservation>) {
        match (&mut self.bytes, bytes) {
            (Some(held), Some(more)) => held.merge(more),
            (held, more) => *held = held.take().or(more),
        }
    }
}

impl KeptJobs {
    pub fn new(most: usize, n_owners: usize) -> Self {
        Self { most, most_of_owner: share_of_one(most, n_owners), table: Mutex::default() }
    }

    /// Adds a job of an owner.
    ///
    /// # Errors
    /// 503 if all owners, or this one, have as many jobs as they may.
    pub fn add(&self, id: JobId, owner: Owner) -> Result<(), Problem> {
        let mut table = self.table();
        let n_of_owner = table.jobs.values().filter(|job| job.owner == owner).count();
        let (n, whose) = match (n_of_owner >= self.most_of_owner, table.jobs.len() >= self.most) {
            (true, _) => (n_of_owner, "this key"),
            (false, true) => (table.jobs.len(), "all keys"),
            (false, false) => {
                table.jobs.insert(id, KeptJob { owner, ended_at: None, bytes: None });
                return Ok(());
            }
        };
        drop(table);
        let reason = format!("{n} jobs of {whose} are kept, and no more may be");
        Err(self.refused(owner, &reason))
    }

    /// Refuses a job with 503 and the remedy, and notes that the owner's jobs are to be listed again.
    pub fn refused(&self, owner: Owner, reason: &str) -> Problem {
        self.table().refused.insert(owner);
        let remedy = format!("{reason}: fetch results and delete their jobs");
        Problem::unavailable(&remedy, SECONDS_UNTIL_COUNTED)
    }

    /// Takes the owners that were refused since the last call.
    pub fn take_refused(&self) -> HashSet<Owner> {
        std::mem::take(&mut self.table().refused)
    }

    /// Adds a reservation to that of a job.
    pub fn pay(&self, id: JobId, bytes: Option<Reservation>) {
        if let Some(job) = self.table().jobs.get_mut(&id) {
            job.pay(bytes);
        }
    }

    /// Notes that a job ended now, and adds the reservation of its result.
    pub fn end(&self, id: JobId, owner: Owner, bytes: Option<Reservation>) {
        let mut table = self.table();
        let job = table.jobs.entry(id).or_insert(KeptJob { owner, ended_at: None, bytes: None });
        job.ended_at = Some(SystemTime::now());
        job.pay(bytes);
    }

    /// Replaces the entry of a job by what was found in the store.
    pub fn put(&self, id: JobId, job: KeptJob) {
        self.table().jobs.insert(id, job);
    }

    pub fn remove(&self, id: JobId) {
        self.table().jobs.remove(&id);
    }

    /// Ids of the jobs of an owner.
    pub fn of(&self, owner: Owner) -> HashSet<JobId> {
        let table = self.table();
        table.jobs.iter().filter(|(_, job)| job.owner == owner).map(|(&id, _)| id).collect()
    }

    /// Ids and owners of the jobs that ended longer than `kept` ago.
    pub fn older_than(&self, kept: Duration) -> Vec<(JobId, Owner)> {
        let now = SystemTime::now();
        let is_old = |job: &KeptJob| is_older(job.ended_at, kept, now);
        let table = self.table();
        table.jobs.iter().filter(|(_, job)| is_old(job)).map(|(&id, job)| (id, job.owner)).collect()
    }

    #[expect(clippy::disallowed_methods, reason = "a table, for as long as it takes to look into it")]
    fn table(&self) -> MutexGuard<'_, Table> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns whether `ended_at` is longer than `kept` before `now`.
pub fn is_older(ended_at: Option<SystemTime>, kept: Duration, now: SystemTime) -> bool {
    ended_at.is_some_and(|ended_at| now.duration_since(ended_at).is_ok_and(|age| age > kept))
}
