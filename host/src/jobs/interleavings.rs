//! Tests of interleaved requests with one `Idempotency-Key` and deletions of their job: all interleavings of
//! three requests, and random ones of many, of one process and of two on one store.
//!
//! AT REST. At most one job of the key is known. A request with the key is answered with it. Each job that
//! was acknowledged, and not deleted, is that one. A deleted job is unknown. Nothing else of a job is left.

use std::any::Any;
use std::collections::HashSet;
use std::sync::Arc;

use crate::problem::catalogue;
use axum::body::Body;
use axum::extract::Request;
use axum::{Router, body};
use bytes::Bytes;
use futures_util::stream;
use object_store::path::Path as Name;
use tokio::task::JoinHandle;

use super::accept::accept;
use super::{IDEMPOTENCY_KEY, Runner, requests};
use crate::memory::Owner;
use crate::problem::slug::Slug;
use crate::state::host::Host;
use crate::store::jobs::{Answer, JobId, JobResult, Outcome};
use crate::store::room::Room;
use crate::store::testing::choose::{Choose, Odometer};
use crate::store::testing::random::Random;
use crate::store::testing::stepped::{Call, Gate, SteppedStore, Stops};
use crate::store::{Objects, OwnerName};
use crate::testing::host_on;

const OWNER: Owner = Owner(0);

/// A request to one of the processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JobCall {
    Post,
    /// Deletes the job that the last POST that has ended was answered with.
    Delete,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reply {
    Accepted(JobId),
    /// The job is unknown from now on, or was cancelled and is known as such.
    Deleted(JobId),
    Unknown,
    Refused(Slug),
}

/// Calls for claims, and the first write of a deletion: all that requests with one key and deletions of their
/// job can see of each other.
fn of_claims(call: Call, name: &Name) -> bool {
    let name: &str = name.as_ref();
    name.contains("/claims") || (call == Call::Put && name.ends_with("/deleted"))
}

fn everywhere(_: Call, _: &Name) -> bool {
    true
}

/// Processes on one store, and the outcome of each request.
struct World {
    gate: Arc<Gate>,
    store: SteppedStore,
    processes: Vec<Runner>,
    /// All turns of all processes, so that no job begins.
    _turns: Vec<Box<dyn Any>>,
    under_way: Vec<(JobCall, JoinHandle<Reply>)>,
    told: Vec<(JobCall, Reply)>,
    /// The last job that a POST was answered with.
    last: Option<JobId>,
}

impl World {
    async fn new(n_processes: usize, at: fn(Call, &Name) -> bool) -> Self {
        let (store, gate) = SteppedStore::new(true, Stops { at, before_answers: false });
        let (mut processes, mut turns) = (Vec::new(), Vec::<Box<dyn Any>>::new());
        for _ in 0..n_processes {
            let objects = Arc::new(Objects::over(Arc::new(store.clone()), Name::default()));
            let host = host_on(&["--max-queue", "1000"], Some(objects));
            turns.push(Box::new(host.jobs.turns.take(OWNER).await));
            processes.push(Runner { host, routes: Router::new() });
        }
        let (under_way, told) = (Vec::new(), Vec::new());
        Self { gate, store, processes, _turns: turns, under_way, told, last: None }
    }

    fn name(&self) -> OwnerName {
        self.processes[0].host.keys.name_of(OWNER)
    }

    fn begin(&mut self, asked: JobCall, process: usize) {
        let (runner, last) = (self.processes[process].clone(), self.last);
        let task = tokio::spawn(async move {
            match asked {
                JobCall::Post => post(runner).await,
                JobCall::Delete => delete(runner.host, last).await,
            }
        });
        self.under_way.push((asked, task));
    }

    async fn settle(&mut self) {
        self.gate.settle().await;
        let (done, under_way): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.under_way).into_iter().partition(|(_, task)| task.is_finished());
        self.under_way = under_way;
        for (asked, task) in done {
            let told = task.await.unwrap();
            if let Reply::Accepted(id) = told {
                self.last = Some(id);
            }
            self.told.push((asked, told));
        }
    }

    /// Runs one request without stops.
    async fn at_once(&mut self, asked: JobCall, process: usize) -> Reply {
        self.gate.set_open(true);
        self.begin(asked, process);
        self.settle().await;
        self.gate.set_open(false);
        assert!(self.under_way.is_empty());
        self.told.last().unwrap().1
    }

    /// Begins the requests when the choice says so, and releases one parked call after the other until all
    /// are answered.
    async fn run(&mut self, choose: &mut impl Choose, asked: &[(JobCall, usize)]) {
        let mut rest = asked.iter();
        while !self.under_way.is_empty() || rest.len() > 0 {
            let n_parked = self.gate.n_parked();
            let way = choose.below(n_parked + usize::from(rest.len() > 0));
            if way < n_parked {
                self.gate.release(way);
            } else if let Some(&(asked, process)) = rest.next() {
                self.begin(asked, process);
            }
            self.settle().await;
        }
    }

    /// Ends a job, unless it has ended, as the process does that works on it.
    async fn end(&self, id: JobId) {
        self.gate.set_open(true);
        let objects = &self.processes[0].host.jobs.objects;
        let head = JobResult { outcome: Outcome::Succeeded, status: 200, headers: Vec::new() };
        let body = stream::iter([Ok::<_, String>(Bytes::from_static(b"{}"))]);
        let answer = Answer { attempt: 0, head, body };
        objects.put_result(&self.name(), id, answer, &mut Room::unlimited()).await.unwrap();
        self.leave(id).await;
        self.gate.set_open(false);
    }

    /// Takes a job out of the tables of all processes.
    async fn leave(&self, id: JobId) {
        for Runner { host, .. } in &self.processes {
            if let Some(here) = host.jobs.find(id) {
                here.cancelled.cancel();
            }
            host.jobs.kept.remove(id);
        }
        self.gate.settle().await;
    }

    async fn known(&self) -> Vec<JobId> {
        self.gate.set_open(true);
        let found = self.processes[0].host.jobs.objects.jobs(&self.name()).await.unwrap();
        self.gate.set_open(false);
        found.into_iter().filter(|job| job.is_known()).map(|job| job.id).collect()
    }

    /// Checks what holds at rest, then deletes everything of the key.
    async fn check(&mut self) {
        let history = self.told.clone();
        let known = self.known().await;
        assert!(known.len() <= 1, "{known:?} live: {history:#?}");
        let of = |wanted: fn(&Reply) -> Option<JobId>| {
            history.iter().filter_map(|(_, told)| wanted(told)).collect::<HashSet<_>>()
        };
        let accepted = of(|told| if let Reply::Accepted(id) = told { Some(*id) } else { None });
        let deleted = of(|told| if let Reply::Deleted(id) = told { Some(*id) } else { None });
        assert!(!history.iter().any(|(_, told)| matches!(told, Reply::Refused(_))), "{history:#?}");
        for id in &accepted {
            assert!(deleted.contains(id) || known == [*id], "{id} is lost, {known:?} live: {history:#?}");
        }
        for process in 0..self.processes.len() {
            let Reply::Accepted(found) = self.at_once(JobCall::Post, process).await else {
                panic!("{history:#?}")
            };
            if process == 0 && known.is_empty() {
                assert!(!accepted.contains(&found), "{found} is back: {history:#?}");
            } else {
                assert_eq!(known.first().copied().unwrap_or(found), found, "{history:#?}");
                assert_eq!(self.known().await, [found], "{history:#?}");
            }
        }
        let last = self.known().await;
        for id in last.into_iter().chain(accepted) {
            self.leave(id).await;
            self.gate.set_open(true);
            self.processes[0].host.jobs.objects.delete_job(&self.name(), id).await.unwrap();
            self.gate.set_open(false);
        }
        let left = self.store.names().await;
        assert!(left.iter().all(|name| name.contains("/claims/")), "{left:?} are left: {history:#?}");
        self.store.clear().await;
        self.last = None;
        self.told.clear();
    }
}

async fn post(runner: Runner) -> Reply {
    let request = Request::post("/v1/normals").header(IDEMPOTENCY_KEY, "key").extension(OWNER);
    let answer = accept(runner, request.body(Body::from("{}")).unwrap()).await;
    let answer = match answer {
        Ok(answer) => answer,
        Err(problem) => return Reply::Refused(problem.slug()),
    };
    let text = body::to_bytes(answer.into_body(), 1 << 20).await.unwrap();
    let view: serde_json::Value = serde_json::from_slice(&text).unwrap();
    Reply::Accepted(JobId::parse(view["job_id"].as_str().unwrap()).unwrap())
}

async fn delete(host: Arc<Host>, id: Option<JobId>) -> Reply {
    let Some(id) = id else { return Reply::Unknown };
    match requests::delete(&host, OWNER, id).await {
        Ok(_) => Reply::Deleted(id),
        Err(problem) if problem.slug() == catalogue::UNKNOWN_JOB => Reply::Unknown,
        Err(problem) => Reply::Refused(problem.slug()),
    }
}

/// Runs every interleaving of some requests for a key: without a job, and with one that has ended. Returns
/// their number.
async fn exhaust(world: &mut World, asked: &[(JobCall, usize)]) -> usize {
    let mut n_ways = 0;
    for has_job in [false, true] {
        let mut odometer = Odometer::default();
        loop {
            if has_job {
                let Reply::Accepted(id) = world.at_once(JobCall::Post, 0).await else { panic!() };
                world.end(id).await;
            }
            // Nothing is shared before the first stop, so all requests may begin at once.
            for &(asked, process) in asked {
                world.begin(asked, process);
                world.settle().await;
            }
            world.run(&mut odometer, &[]).await;
            world.check().await;
            n_ways += 1;
            if !odometer.turn() {
                break;
            }
        }
    }
    n_ways
}

#[tokio::test]
async fn every_interleaving_of_requests_with_one_key_and_a_deletion_leaves_one_job() {
    use JobCall::{Delete, Post};
    let mut n_ways = 0;
    for n_processes in [1, 2] {
        let last = n_processes - 1;
        let mut world = World::new(n_processes, of_claims).await;
        n_ways += exhaust(&mut world, &[(Delete, 0), (Post, 0), (Post, last)]).await;
        n_ways += exhaust(&mut world, &[(Post, 0), (Delete, last), (Post, last)]).await;
        n_ways += exhaust(&mut world, &[(Delete, 0), (Delete, last), (Post, 0)]).await;
    }
    println!("{n_ways} interleavings");
    assert!(n_ways > 1000, "{n_ways}");
}

#[tokio::test]
async fn random_requests_with_one_key_leave_one_job() {
    for n_processes in [1, 2] {
        let mut world = World::new(n_processes, everywhere).await;
        for seed in 0..300 {
            let mut random = Random(seed);
            for _ in 0..3 {
                let some = |random: &mut Random| {
                    let asked = if random.below(3) == 0 { JobCall::Delete } else { JobCall::Post };
                    (asked, random.below(n_processes))
                };
                let asked: Vec<_> = (0..4).map(|_| some(&mut random)).collect();
                world.run(&mut random, &asked).await;
                if let Some(id) = world.known().await.first().copied().filter(|_| random.below(2) == 0) {
                    world.end(id).await;
                }
            }
            world.check().await;
        }
    }
}
