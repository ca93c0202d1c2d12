//! Work on a job: turn, lease and attempt.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::Runner;
use super::look::name_of;
use crate::state::jobs::{Jobs, LocalJob};
use crate::store::jobs::{JobObjects, Lease};
use crate::store::{OwnerName, Unavailable};

/// Interval at which a lease is renewed, and the time after which it expires.
pub(super) const RENEW_EVERY: Duration = Duration::from_secs(2);
pub(super) const EXPIRES_AFTER: Duration = Duration::from_secs(10);

/// The end of work on a job.
enum JobEnd {
    /// The job has a result, written by any process, or is no longer wanted.
    Done,
    /// The process shuts down, or the store does not accept the result. Any process may continue.
    Released,
}

/// An attempt at a job, claimed by this process alone.
pub(super) struct Attempt {
    pub(super) number: u32,
    pub(super) lease: Lease,
}

/// A guard that removes the job from this process when dropped, also if its work panics.
struct Registration<'a> {
    jobs: &'a Jobs,
    local: Arc<LocalJob>,
}

impl Drop for Registration<'_> {
    fn drop(&mut self) {
        self.jobs.remove(&self.local);
    }
}

impl Runner {
    /// Works on a job of this process once its turn has come.
    pub(super) async fn run(self, local: Arc<LocalJob>) {
        let jobs = &self.host.jobs;
        let registration = Registration { jobs, local };
        let local = &*registration.local;
        let name = self.host.keys.name_of(local.owner);
        let _turn = tokio::select! {
            turn = jobs.turns.take(local.owner) => turn,
            () = local.cancelled.cancelled() => return,
            () = self.host.draining.cancelled() => return,
        };
        // From here on, the job is run by this process or is not in this process at all.
        local.is_running.store(true, Ordering::Relaxed);
        let attempt = match self.claim(local, &name).await {
            Ok(Some(attempt)) => attempt,
            Ok(None) => return,
            Err(error) => return tracing::error!(job = %local.id, %error, "a job is postponed"),
        };
        // From here on, other processes also see that the job is running.
        local.has_lease.store(true, Ordering::Relaxed);
        let ended = tokio::select! {
            () = local.cancelled.cancelled() => Ok(JobEnd::Done),
            () = self.host.draining.cancelled() => Ok(JobEnd::Released),
            () = self.hold_lease(local, &name, &attempt) => Ok(JobEnd::Done),
            answered = self.answer(local, &name, &attempt) => answered.map(|()| JobEnd::Done),
        };
        match ended {
            Ok(JobEnd::Done) => {}
            Ok(JobEnd::Released) => self.release(local, &name, attempt).await,
            Err(error) => {
                tracing::error!(job = %local.id, %error, "a job is postponed");
                self.release(local, &name, attempt).await;
            }
        }
    }

    /// Claims the next attempt for this process. Returns `None` if the job is not open, or another process
    /// has begun it.
    async fn claim(&self, local: &LocalJob, name: &OwnerName) -> Result<Option<Attempt>, Unavailable> {
        let objects = &self.host.jobs.objects;
        let found = objects.find_job(name, local.id).await?;
        // Another process may have begun the job while it waited in this process. If the other process
        // abandons the job, the periodic rounds pick it up again.
        let is_to_do = |job: &JobObjects| job.is_open() && job.lease == local.last;
        let Some(job) = found.filter(is_to_do) else { return Ok(None) };
        let attempt = match job.lease {
            None => Attempt { number: 0, lease: Lease::default() },
            Some((last, _)) => {
                let before = objects.get_lease(name, local.id, last).await?.unwrap_or_default();
                let n_crashes = before.n_crashes + u32::from(!before.is_released);
                Attempt { number: last + 1, lease: Lease { n_crashes, ..Lease::default() } }
            }
        };
        let is_claimed = objects.claim_job(name, local.id, attempt.number, &attempt.lease).await?;
        Ok(is_claimed.then_some(attempt))
    }

    /// Releases the lease, so that any process may continue at once. Retries until the store accepts, or the
    /// process drains.
    async fn release(&self, local: &LocalJob, name: &OwnerName, attempt: Attempt) {
        let lease = Lease { is_released: true, ..attempt.lease };
        while let Err(error) =
            self.host.jobs.objects.renew_lease(name, local.id, attempt.number, &lease).await
        {
            tracing::warn!(job = %local.id, %error, "a job is left until its lease has expired");
            tokio::select! {
                () = tokio::time::sleep(RENEW_EVERY) => {}
                () = local.cancelled.cancelled() => return,
                () = self.host.draining.cancelled() => return,
            }
        }
    }

    /// Renews the lease until that is pointless: the job has a result, another process has begun it, or it is
    /// forgotten.
    async fn hold_lease(&self, local: &LocalJob, name: &OwnerName, attempt: &Attempt) {
        let objects = &self.host.jobs.objects;
        let mut ticks = tokio::time::interval(RENEW_EVERY);
        loop {
            ticks.tick().await;
            let now = local.progress.now();
            let lease = Lease {
                stage: Some(name_of(now.stage).to_owned()),
                fraction: now.fraction,
                residual: now.residual,
                seconds_left: now.seconds_left,
                ..attempt.lease.clone()
            };
            let renewed = match objects.find_job(name, local.id).await {
                Ok(Some(job)) if job.is_that_of(attempt.number) => {
                    objects.renew_lease(name, local.id, attempt.number, &lease).await
                }
                Ok(_) => return,
                Err(error) => Err(error),
            };
            if let Err(error) = renewed {
                // Another process may claim the job meanwhile. Whichever of the two finishes first ends it.
                tracing::warn!(job = %local.id, %error, "the lease of a job is not written");
            }
        }
    }
}
