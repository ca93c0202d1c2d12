//! Rounds: a periodic task that takes up jobs without a worker, and deletes results that were kept long
//! enough.
//!
//! A round looks up open jobs one by one, and forgets those whose time is over by the table of kept jobs
//! (kept.rs). Kept results cost it nothing. All jobs are listed at the start, every ten minutes, and for
//! owners that were refused, because other processes end and delete jobs as well.

use std::collections::{HashMap, HashSet};
use std::time::{Duration, Instant, SystemTime};

use super::Runner;
use super::run::EXPIRES_AFTER;
use crate::memory::Owner;
use crate::state::kept::{KeptJob, SECONDS_UNTIL_COUNTED, is_older};
use crate::store::jobs::{JobId, JobObjects};
use crate::store::{OwnerName, Unavailable};

/// Interval between two rounds.
const ROUNDS: Duration = Duration::from_secs(SECONDS_UNTIL_COUNTED);

/// Time between two lists of all jobs.
const COUNTING: Duration = Duration::from_secs(600);

/// The leases seen in the last round, each with the time since which it is unchanged. Times of the store and
/// of this process are never compared.
type Seen = HashMap<JobId, (Option<(u32, SystemTime)>, Instant)>;

impl Runner {
    /// Makes rounds until the process drains.
    pub async fn go_round(self) {
        let mut ticks = tokio::time::interval(ROUNDS);
        let mut seen = Seen::new();
        let mut counted: Option<Instant> = None;
        loop {
            tokio::select! {
                _ = ticks.tick() => {}
                () = self.host.draining.cancelled() => return,
            }
            let all = counted.is_none_or(|counted| counted.elapsed() >= COUNTING);
            if all {
                counted = Some(Instant::now());
            }
            let refused = self.host.jobs.kept.take_refused();
            let mut next = Seen::new();
            for owner in self.host.keys.owners() {
                let name = self.host.keys.name_of(owner);
                let looked = async {
                    if all || refused.contains(&owner) {
                        self.count(owner, &name).await?;
                    }
                    self.look_after(owner, &seen, &mut next).await
                };
                warn_of(looked.await);
            }
            seen = next;
            for (id, owner) in self.host.jobs.kept.older_than(self.host.settings.job_result()) {
                warn_of(self.host.jobs.forget(&self.host.keys.name_of(owner), id).await);
            }
        }
    }

    /// Looks up the open jobs of an owner: takes up those that nobody works on, and lets go of those that
    /// another process began.
    async fn look_after(&self, owner: Owner, seen: &Seen, next: &mut Seen) -> Result<(), Unavailable> {
        let jobs = &self.host.jobs;
        let name = self.host.keys.name_of(owner);
        let mut ids: HashSet<JobId> = jobs.objects.open_jobs(&name).await?.into_iter().collect();
        // A job that waits here and was open a round ago may have ended elsewhere, and is not listed then.
        ids.extend(jobs.waiting_of(owner).into_iter().filter(|id| seen.contains_key(id)));
        for id in ids {
            // The attempt renews its lease, and notices by itself when the job is taken away.
            if jobs.find(id).is_some_and(|here| here.is_running()) {
                continue;
            }
            let here = jobs.find(id);
            let Some(job) = jobs.objects.find_job(&name, id).await?.filter(JobObjects::is_open) else {
                // Another process has ended the job.
                here.inspect(|here| here.cancelled.cancel());
                jobs.objects.unmark_open(&name, id).await?;
                continue;
            };
            let last = seen.get(&id).filter(|(lease, _)| *lease == job.lease);
            let since = last.map_or_else(Instant::now, |&(_, since)| since);
            next.insert(id, (job.lease, since));
            if let Some(here) = here {
                // The job waited here, and another process had a turn for it first.
                if job.lease != here.last {
                    here.cancelled.cancel();
                }
            } else if jobs.has_turn(owner)
                && (since.elapsed() >= EXPIRES_AFTER || self.is_released(&name, &job).await?)
            {
                self.take_up(&job, owner);
            }
        }
        Ok(())
    }

    /// Lists all jobs of an owner. Renews the table of kept jobs, and removes what interrupted deletions and
    /// old results left behind.
    async fn count(&self, owner: Owner, name: &OwnerName) -> Result<(), Unavailable> {
        let (jobs, now) = (&self.host.jobs, SystemTime::now());
        let known = jobs.kept.of(owner);
        let open: HashSet<JobId> = jobs.objects.open_jobs(name).await?.into_iter().collect();
        let found = jobs.objects.jobs(name).await?;
        for job in &found {
            let since = job.ended_at.or((!job.is_known()).then(|| job.id.created_at()));
            if is_older(since, self.host.settings.job_result(), now) {
                // The process that began to delete it may have ended, so this does not wait for it.
                jobs.objects.clear_job(name, job.id).await?;
                jobs.kept.remove(job.id);
                continue;
            }
            if job.is_open() && !open.contains(&job.id) {
                jobs.objects.mark_open(name, job.id).await?;
            }
            if job.is_known() && jobs.find(job.id).is_none() {
                self.keep(owner, job);
            }
        }
        let found_ids: HashSet<JobId> = found.iter().map(|job| job.id).collect();
        for id in known.into_iter().filter(|id| !found_ids.contains(id) && jobs.find(*id).is_none()) {
            jobs.kept.remove(id);
        }
        jobs.objects.sweep_claims(name).await
    }

    /// Puts a job that was found in the store into the table of kept jobs.
    fn keep(&self, owner: Owner, job: &JobObjects) {
        let jobs = &self.host.jobs;
        jobs.kept.remove(job.id);
        let n_bytes = usize::try_from(job.n_bytes).unwrap_or(usize::MAX);
        let bytes = (!jobs.objects.in_memory_alone()).then(|| jobs.bytes.reserve_beyond(owner, n_bytes));
        jobs.kept.put(job.id, KeptJob { owner, ended_at: job.ended_at, bytes });
    }

    /// Whether the process that last worked on the job released it in order.
    async fn is_released(&self, name: &OwnerName, job: &JobObjects) -> Result<bool, Unavailable> {
        let Some((attempt, _)) = job.lease else { return Ok(false) };
        let lease = self.host.jobs.objects.get_lease(name, job.id, attempt).await?;
        Ok(lease.is_some_and(|lease| lease.is_released))
    }

    fn take_up(&self, job: &JobObjects, owner: Owner) {
        if let Some(here) = self.host.jobs.add(job.id, owner, job.lease) {
            tracing::info!(job = %job.id, "an abandoned job is resumed");
            tokio::spawn(self.clone().run(here));
        }
    }
}

fn warn_of<T>(looked: Result<T, Unavailable>) {
    if let Err(error) = looked {
        tracing::warn!(%error, "maintenance of jobs fails");
    }
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use bytes::Bytes;
    use futures_util::stream;

    use super::*;
    use crate::store::Verb;
    use crate::store::jobs::{Answer, JobRequest, JobResult, NewJob, Outcome};
    use crate::store::room::Room;
    use crate::testing::host;

    const OWNER: Owner = Owner(0);

    fn runner() -> Runner {
        Runner { host: host(&[]), routes: Router::new() }
    }

    impl Runner {
        fn name(&self) -> OwnerName {
            self.host.keys.name_of(OWNER)
        }

        async fn put_job(&self) -> JobId {
            let (id, room) = (JobId::new(), &mut Room::unlimited());
            let request = JobRequest { path: "/v1/normals".to_owned(), headers: Vec::new() };
            let job = NewJob { id, request: &request, body: Bytes::new() };
            self.host.jobs.objects.put_job(&self.name(), job, room).await.unwrap();
            id
        }

        async fn end(&self, id: JobId) {
            let head = JobResult { outcome: Outcome::Succeeded, status: 200, headers: Vec::new() };
            let body = stream::iter([Ok::<_, String>(Bytes::from_static(b"{}"))]);
            let answer = Answer { attempt: 0, head, body };
            let objects = &self.host.jobs.objects;
            assert!(objects.put_result(&self.name(), id, answer, &mut Room::unlimited()).await.unwrap());
        }

        /// Lists that a round asks for, and the jobs that it finds open.
        async fn round(&self) -> (u64, Vec<JobId>) {
            let n_lists = || self.host.jobs.objects.tally().of(Verb::List)[0];
            let (before, mut next) = (n_lists(), Seen::new());
            self.look_after(OWNER, &Seen::new(), &mut next).await.unwrap();
            (n_lists() - before, next.into_keys().collect())
        }
    }

    #[tokio::test]
    async fn a_round_looks_at_open_jobs_and_not_at_those_that_are_kept() {
        let runner = runner();
        for _ in 0..100 {
            let id = runner.put_job().await;
            runner.end(id).await;
        }
        assert_eq!(runner.host.jobs.objects.open_jobs(&runner.name()).await.unwrap(), []);
        assert_eq!(runner.round().await, (1, vec![]));
        let open = runner.put_job().await;
        assert_eq!(runner.round().await, (2, vec![open]));
        runner.end(open).await;
        assert_eq!(runner.round().await, (1, vec![]));
    }

    #[tokio::test]
    async fn what_a_process_left_behind_is_found_when_all_jobs_are_counted() {
        let runner = runner();
        let (objects, name) = (runner.host.jobs.objects.clone(), runner.name());
        // A job of an earlier version has no mark that it is open. The other has ended, and its mark was
        // left.
        let (open, ended) = (runner.put_job().await, runner.put_job().await);
        objects.unmark_open(&name, open).await.unwrap();
        runner.end(ended).await;
        objects.mark_open(&name, ended).await.unwrap();
        runner.count(OWNER, &name).await.unwrap();
        assert_eq!(runner.host.jobs.kept.of(OWNER), HashSet::from([open, ended]));
        assert_eq!(runner.round().await.1, [open]);
        assert_eq!(objects.open_jobs(&name).await.unwrap(), [open]);
        // Jobs that another process deleted are not counted.
        assert!(objects.delete_job(&name, ended).await.unwrap());
        runner.count(OWNER, &name).await.unwrap();
        assert_eq!(runner.host.jobs.kept.of(OWNER), HashSet::from([open]));
    }
}
