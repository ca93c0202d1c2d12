//! The table of jobs of this process, and its limits. The service of jobs (http/jobs/) works on this table.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use tokio_util::sync::CancellationToken;

use super::kept::KeptJobs;
use crate::compute::{FairSemaphore, Progress};
use crate::memory::budget::{Budget, Reservation};
use crate::memory::{Owner, share_of_one};
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::store::jobs::JobId;
use crate::store::room::Room;
use crate::store::{Objects, OwnerName, Unavailable};

/// The jobs of this process, and the objects of all jobs.
pub struct Jobs {
    pub objects: Arc<Objects>,
    local: Mutex<HashMap<JobId, Arc<LocalJob>>>,
    /// Bytes of kept requests and results. Without a store these are bytes of memory.
    pub bytes: Budget,
    pub kept: KeptJobs,
    pub turns: Arc<FairSemaphore>,
    /// Most jobs that may wait or run in this process, of all owners and of one.
    most: usize,
    most_of_owner: usize,
    /// Clients that follow the progress of jobs, one unit each.
    followers: Budget,
}

/// A job of this process, waiting or running.
pub struct LocalJob {
    pub id: JobId,
    pub owner: Owner,
    /// The last attempt at the job when it was added here. A newer attempt belongs to another process.
    pub last: Option<(u32, SystemTime)>,
    pub progress: Arc<Progress>,
    /// Whether the job has a turn in this process.
    pub is_running: AtomicBool,
    /// Whether the lease of the job is in the store, so that every process reports it as running.
    pub has_lease: AtomicBool,
    pub cancelled: CancellationToken,
    /// Cancelled when the job is removed from this process.
    pub over: CancellationToken,
}

/// Number of waiting jobs and number of running jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    pub n_waiting: usize,
    pub n_running: usize,
}

/// Limits of jobs.
pub struct JobLimits {
    /// Bytes of kept requests and results, in the store or, without one, in memory.
    pub n_bytes: usize,
    pub max_kept: usize,
    pub n_owners: usize,
    pub n_threads: usize,
    pub max_queue: usize,
    pub max_followers: usize,
}

impl Jobs {
    /// Creates the table. Jobs are kept in the store, or in memory if there is none.
    pub fn new(store: Option<Arc<Objects>>, limits: &JobLimits) -> Self {
        let &JobLimits { n_owners, n_threads, .. } = limits;
        let most = n_threads.saturating_add(limits.max_queue);
        Self {
            objects: store.unwrap_or_else(|| Arc::new(Objects::in_memory())),
            local: Mutex::default(),
            bytes: Budget::new(limits.n_bytes, n_owners),
            kept: KeptJobs::new(limits.max_kept, n_owners),
            turns: FairSemaphore::of_owners(n_threads, n_owners),
            most,
            most_of_owner: share_of_one(most, n_owners),
            followers: Budget::new(limits.max_followers, n_owners),
        }
    }

    /// Returns the number of jobs of this process.
    pub fn load(&self) -> Load {
        let local = self.local();
        let n_running = local.values().filter(|job| job.is_running()).count();
        Load { n_waiting: local.len() - n_running, n_running }
    }

    /// Bytes of jobs in memory.
    pub fn n_bytes_in_memory(&self) -> usize {
        if self.objects.in_memory_alone() { self.bytes.n_held() } else { 0 }
    }

    /// Bytes of jobs in the store, as far as this process knows.
    pub fn n_bytes_in_store(&self) -> usize {
        if self.objects.in_memory_alone() { 0 } else { self.bytes.n_held() }
    }

    /// Counts a client that follows a job until the returned value is dropped.
    ///
    /// `None` if too many clients follow jobs, of all owners or of this one.
    pub fn follow(&self, owner: Owner) -> Option<Reservation> {
        self.followers.try_reserve(owner, 1)
    }

    /// Resolves once this process has no jobs.
    pub async fn all_left(&self) {
        loop {
            let Some(job) = self.local().values().next().cloned() else { return };
            job.over.cancelled().await;
        }
    }

    pub fn find(&self, id: JobId) -> Option<Arc<LocalJob>> {
        self.local().get(&id).cloned()
    }

    /// Adds a job to this process. `None` if it is already here, or there are too many, of all owners or of
    /// this one.
    pub fn add(&self, id: JobId, owner: Owner, last: Option<(u32, SystemTime)>) -> Option<Arc<LocalJob>> {
        let mut local = self.local();
        let n_of_owner = local.values().filter(|job| job.owner == owner).count();
        if local.len() >= self.most || n_of_owner >= self.most_of_owner || local.contains_key(&id) {
            return None;
        }
        let job = Arc::new(LocalJob {
            id,
            owner,
            last,
            progress: Arc::default(),
            is_running: AtomicBool::new(false),
            has_lease: AtomicBool::new(false),
            cancelled: CancellationToken::new(),
            over: CancellationToken::new(),
        });
        local.insert(id, job.clone());
        Some(job)
    }

    /// Jobs of an owner that wait for a turn in this process.
    pub fn waiting_of(&self, owner: Owner) -> Vec<JobId> {
        let local = self.local();
        let waiting = local.values().filter(|job| job.owner == owner && !job.is_running());
        waiting.map(|job| job.id).collect()
    }

    /// Removes a job from this process.
    pub fn remove(&self, job: &LocalJob) {
        self.local().remove(&job.id);
        job.over.cancel();
    }

    /// Whether a job of an owner could begin at once.
    pub fn has_turn(&self, owner: Owner) -> bool {
        self.turns.has_one_for(owner)
    }

    /// Reserves room for `n_bytes` of a job, if its owner may have that much.
    pub fn room(&self, owner: Owner, n_bytes: usize) -> Option<Room> {
        Room::of(&self.bytes, owner, n_bytes)
    }

    /// 413 for a result that does not fit.
    pub fn too_large(&self) -> Problem {
        let limit = self.bytes.largest();
        let detail = format!(
            "at most {limit} bytes of jobs and results are stored per key, and this result does not fit"
        );
        Problem::beyond(catalogue::PROBLEM_TOO_LARGE, limit, detail)
            .with_remedy("fetch results and delete their jobs, or ask for less")
    }

    /// Cancels a job, unless it has a result or is unknown. Returns whether it was cancelled.
    ///
    /// If another process works on the job, it notices when it renews its lease.
    ///
    /// # Errors
    /// Fails if the store does not answer.
    pub async fn cancel(&self, owner: Owner, name: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let is_cancelled = self.objects.cancel_job(name, id).await?;
        if is_cancelled {
            self.kept.end(id, owner, None);
        }
        if let Some(local) = self.find(id).filter(|_| is_cancelled) {
            local.cancelled.cancel();
        }
        Ok(is_cancelled)
    }

    /// Resolves when this process stops working on the job. Never resolves for jobs of other processes.
    pub async fn until_over(&self, id: JobId) {
        match self.find(id) {
            Some(local) => local.over.cancelled().await,
            None => std::future::pending().await,
        }
    }

    /// Deletes a job, whichever process works on it. Returns whether it was known.
    ///
    /// # Errors
    /// Fails if the store does not answer.
    pub async fn forget(&self, owner: &OwnerName, id: JobId) -> Result<bool, Unavailable> {
        let was_known = self.objects.delete_job(owner, id).await?;
        self.kept.remove(id);
        Ok(was_known)
    }

    #[expect(clippy::disallowed_methods, reason = "a table, for as long as it takes to look into it")]
    fn local(&self) -> MutexGuard<'_, HashMap<JobId, Arc<LocalJob>>> {
        self.local.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LocalJob {
    pub fn is_running(&self) -> bool {
        self.is_running.load(Ordering::Relaxed)
    }

    pub fn has_lease(&self) -> bool {
        self.has_lease.load(Ordering::Relaxed)
    }
}
