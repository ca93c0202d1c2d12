//! Rounds through all jobs: those that nobody works on are taken up, and results that have been kept long enough are forgotten.

use std::collections::HashMap;
use std::time::{Duration, Instant, SystemTime};

use super::Runner;
use super::run::EXPIRING;
use crate::store::Owner;
use crate::store::objects::jobs::{JobId, JobObjects};
use crate::store::objects::{OwnerName, Unavailable};

/// How often.
const ROUNDS: Duration = Duration::from_secs(5);

/// The leases that were seen, and since when as they are. Times of the store and of this process are not compared.
type Seen = HashMap<JobId, (Option<(u32, SystemTime)>, Instant)>;

impl Runner {
    /// Goes round for as long as the process takes requests.
    pub async fn go_round(self) {
        let mut ticks = tokio::time::interval(ROUNDS);
        let mut seen = Seen::new();
        loop {
            tokio::select! {
                _ = ticks.tick() => {}
                () = self.app.draining.cancelled() => return,
            }
            let mut next = Seen::new();
            for owner in self.app.keys.owners() {
                if let Err(error) = self.look_after(owner, &seen, &mut next).await {
                    tracing::warn!(%error, "jobs are not looked after");
                }
            }
            seen = next;
        }
    }

    async fn look_after(&self, owner: Owner, seen: &Seen, next: &mut Seen) -> Result<(), Unavailable> {
        let jobs = &self.app.jobs;
        let name = self.app.keys.name_of(owner);
        let now = SystemTime::now();
        for job in jobs.objects.jobs(&name).await? {
            let is_over = job.ended_at.is_some() || !job.has_request;
            let since = job.ended_at.unwrap_or_else(|| job.id.created_at());
            let age = now.duration_since(since).unwrap_or_default();
            if is_over && age > self.app.config.job_result() {
                jobs.forget(&job).await?;
            } else if let Some(here) = jobs.find(job.id) {
                // It waited here, and another process had a turn for it before.
                if !here.is_running() && (is_over || job.lease != here.last) {
                    here.cancelled.cancel();
                }
            } else if !is_over {
                let last = seen.get(&job.id).filter(|(lease, _)| *lease == job.lease);
                let since = last.map_or_else(Instant::now, |&(_, since)| since);
                next.insert(job.id, (job.lease, since));
                if jobs.has_turn(owner)
                    && (since.elapsed() >= EXPIRING || self.is_released(&name, &job).await?)
                {
                    self.take_up(&job, owner);
                }
            }
        }
        Ok(())
    }

    /// Whether its process left it in order.
    async fn is_released(&self, name: &OwnerName, job: &JobObjects) -> Result<bool, Unavailable> {
        let Some((attempt, _)) = job.lease else { return Ok(false) };
        let lease = self.app.jobs.objects.get_lease(name, job.id, attempt).await?;
        Ok(lease.is_some_and(|lease| lease.is_released))
    }

    fn take_up(&self, job: &JobObjects, owner: Owner) {
        if let Some(here) = self.app.jobs.add(job.id, owner, job.lease) {
            tracing::info!(job = %job.id, "a job that nobody works on is taken up");
            tokio::spawn(self.clone().run(here));
        }
    }
}
