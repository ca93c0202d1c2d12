//! Tests of interleaved requests for one cloud against its guarantees: all interleavings of a few requests,
//! and random interleavings of many.
//!
//! DURING A RUN. After an acknowledged POST, and without a DELETE since, the cloud is found and listed. After
//! an acknowledged DELETE, and without a POST since, it is not. Each DELETE that finds the cloud has a POST
//! of its own that created it.
//!
//! AT REST. Each process finds the cloud and lists it once exactly if its object is in the store. Nothing
//! else is left in the store.

mod requests;

use std::sync::Arc;

use super::CloudStore;
use crate::store::key::CloudId;
use crate::store::objects::CloudObjects;
use crate::store::testing::choose::{Choose, Odometer};
use crate::store::testing::random::Random;
use crate::store::testing::stepped::{Gate, SteppedStore, Stops};
use gramian_host::store::Objects;
use gramian_numerics::points::cloud::Cloud;
use object_store::path::Path;
use requests::{Answer, Process, Request};
use tokio::task::JoinHandle;

/// A store, its processes, and the outcome of each request.
struct World {
    gate: Arc<Gate>,
    store: SteppedStore,
    processes: Vec<Process>,
    under_way: Vec<(usize, JoinHandle<Answer>)>,
    history: Vec<Event>,
    now: usize,
}

/// A request, the steps at which it began and ended, and its answer.
#[derive(Debug, Clone)]
struct Event {
    request: Request,
    #[expect(dead_code, reason = "shown when a check fails")]
    process: usize,
    began: usize,
    ended: usize,
    answer: Option<Answer>,
}

#[derive(Clone, Copy)]
struct Setting {
    n_processes: usize,
    tells_absence: bool,
    /// Bytes of memory for clouds. At 0, each request asks the store.
    n_bytes: usize,
}

/// The cloud that all requests post and delete.
fn cloud() -> Cloud {
    Cloud::new(vec![0.0, 1.0, 2.0], 1).unwrap()
}

fn id() -> CloudId {
    CloudId::of(&cloud(), None)
}

impl World {
    fn new(setting: Setting) -> Self {
        let (store, gate) = SteppedStore::new(setting.tells_absence, Stops::default());
        let process = |_| {
            let objects = Objects::over(Arc::new(store.clone()), Path::default());
            let objects = CloudObjects(Arc::new(objects));
            Process { clouds: Arc::new(CloudStore::new(setting.n_bytes)), objects }
        };
        let processes = (0..setting.n_processes).map(process).collect();
        Self { gate, store, processes, under_way: Vec::new(), history: Vec::new(), now: 0 }
    }

    /// Runs one request without stops.
    async fn at_once(&mut self, request: Request, process: usize) -> Answer {
        self.gate.set_open(true);
        self.begin(request, process);
        self.settle().await;
        self.gate.set_open(false);
        self.history.last().and_then(|event| event.answer.clone()).expect("it ended")
    }

    fn begin(&mut self, request: Request, process: usize) {
        self.now += 1;
        let event = Event { request, process, began: self.now, ended: usize::MAX, answer: None };
        self.under_way.push((self.history.len(), tokio::spawn(self.processes[process].clone().run(request))));
        self.history.push(event);
    }

    /// Runs all tasks until every call of the store is parked.
    async fn settle(&mut self) {
        self.gate.settle().await;
        self.now += 1;
        let (done, under_way): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.under_way).into_iter().partition(|(_, task)| task.is_finished());
        self.under_way = under_way;
        for (at, task) in done {
            let answer = task.await.unwrap();
            self.history[at].ended = self.now;
            self.history[at].answer = Some(answer);
            self.check(at);
        }
    }

    /// Begins the requests when the choice says so, and releases one parked call after the other until all
    /// are answered.
    async fn run(&mut self, choose: &mut impl Choose, requests: &[(Request, usize)], most_at_once: usize) {
        let mut rest = requests.iter();
        while !self.under_way.is_empty() || rest.len() > 0 {
            let n_parked = self.gate.n_parked();
            let may_begin = rest.len() > 0 && self.under_way.len() < most_at_once;
            let way = choose.below(n_parked + usize::from(may_begin));
            match rest.as_slice().first().filter(|_| way == n_parked) {
                Some(&(request, process)) => {
                    rest.next();
                    self.begin(request, process);
                }
                None => self.gate.release(way),
            }
            self.settle().await;
        }
    }

    fn check(&self, at: usize) {
        let event = &self.history[at];
        let answer = event.answer.as_ref().unwrap();
        let is_there = match answer {
            Answer::Found(is_there) => *is_there,
            Answer::Listed(ids) => {
                let n_listed = ids.iter().filter(|listed| **listed == id()).count();
                assert!(n_listed <= 1, "listed {n_listed} times: {:#?}", self.history);
                n_listed == 1
            }
            _ => return,
        };
        let (posts, deletes) = (self.all(Request::Post), self.all(Request::Delete));
        let was_posted = posts.iter().any(|post| {
            let may_be_deleted = |delete: &Event| delete.ended > post.began && delete.began < event.ended;
            post.answer.is_some() && post.ended < event.began && !deletes.iter().any(may_be_deleted)
        });
        assert!(is_there || !was_posted, "an acknowledged cloud is lost: {:#?}", self.history);
        let was_deleted = deletes.iter().any(|delete| {
            let may_be_posted = |post: &Event| post.ended > delete.began && post.began < event.ended;
            let is_acknowledged = matches!(delete.answer, Some(Answer::Deleted(_)));
            is_acknowledged && delete.ended < event.began && !posts.iter().any(may_be_posted)
        });
        assert!(!is_there || !was_deleted, "a deleted cloud is back: {:#?}", self.history);
    }

    fn all(&self, request: Request) -> Vec<Event> {
        self.history.iter().filter(|event| event.request == request).cloned().collect()
    }

    /// Checks the guarantees at rest, after each process has offered its pending clouds again.
    async fn check_at_rest(&mut self, tells_absence: bool) {
        self.gate.set_broken(false);
        for process in 0..self.processes.len() {
            self.at_once(Request::Offer, process).await;
        }
        let names = self.store.names().await;
        let expected = format!("o/clouds/{}", id());
        let is_stored = names == [expected];
        assert!(is_stored || names.is_empty(), "{names:?} are left: {:#?}", self.history);
        for process in 0..self.processes.len() {
            let (found, listed) =
                (self.at_once(Request::Get, process).await, self.at_once(Request::List, process).await);
            let ids = if is_stored { vec![id()] } else { Vec::new() };
            assert_eq!(
                (found, listed),
                (Answer::Found(is_stored), Answer::Listed(ids)),
                "{:#?}",
                self.history
            );
        }
        let n_created =
            self.all(Request::Post).iter().filter(|e| e.answer == Some(Answer::Posted(true))).count();
        let n_deleted =
            self.all(Request::Delete).iter().filter(|e| e.answer == Some(Answer::Deleted(true))).count();
        let is_counted = n_created >= n_deleted + usize::from(is_stored);
        assert!(
            is_counted || !tells_absence,
            "{n_created} created, {n_deleted} deleted: {:#?}",
            self.history
        );
    }
}

/// Runs every interleaving of some requests, once on an empty store and once on a store with the cloud.
/// Returns their number.
async fn exhaust(setting: Setting, requests: &[(Request, usize)]) -> usize {
    let mut n_ways = 0;
    for is_there in [false, true] {
        let mut odometer = Odometer::default();
        loop {
            let mut world = World::new(setting);
            if is_there {
                world.at_once(Request::Post, 0).await;
            }
            world.run(&mut odometer, requests, requests.len()).await;
            world.check_at_rest(setting.tells_absence).await;
            n_ways += 1;
            if !odometer.turn() {
                break;
            }
        }
    }
    n_ways
}

const DIRECTORY: Setting = Setting { n_processes: 1, tells_absence: true, n_bytes: 1 << 20 };

const TWO_PROCESSES: Setting = Setting { n_processes: 2, ..DIRECTORY };

/// Runs every pair of requests, the second of them by the last process. Fewer interleavings than there were
/// once mean that the store has fewer steps, or that the test no longer stops at them.
async fn exhaust_pairs(setting: Setting, at_least: usize) {
    use Request::{Delete, Get, List, Post};
    let mut n_ways = 0;
    for pair in [[Post, Post], [Post, Delete], [Delete, Delete], [Get, Delete], [List, Delete], [List, Post]]
    {
        n_ways += exhaust(setting, &[(pair[0], 0), (pair[1], setting.n_processes - 1)]).await;
    }
    println!("{n_ways} interleavings");
    assert!(n_ways >= at_least, "{n_ways}");
}

#[tokio::test]
async fn every_interleaving_of_two_requests_leaves_one_truth() {
    exhaust_pairs(DIRECTORY, 150).await;
}

#[tokio::test]
async fn every_interleaving_of_two_requests_leaves_one_truth_where_memory_keeps_nothing() {
    exhaust_pairs(Setting { n_bytes: 0, ..DIRECTORY }, 2_500).await;
}

#[tokio::test]
async fn every_interleaving_of_requests_of_two_processes_leaves_one_truth() {
    exhaust_pairs(TWO_PROCESSES, 20_000).await;
}

#[tokio::test]
async fn every_interleaving_of_requests_of_two_processes_leaves_one_truth_where_memory_keeps_nothing() {
    exhaust_pairs(Setting { n_bytes: 0, ..TWO_PROCESSES }, 40_000).await;
}

#[tokio::test]
async fn a_sweep_and_a_post_of_another_process_leave_one_truth() {
    let n_ways = exhaust(TWO_PROCESSES, &[(Request::Sweep, 0), (Request::Post, 1)]).await;
    assert!(n_ways > 1, "{n_ways}");
}

/// Runs random requests of `n_processes` processes at random moments. With `may_fail`, the store refuses
/// writes now and then.
async fn random_runs(setting: Setting, seeds: std::ops::Range<u64>, may_fail: bool) {
    let mut n_there = 0;
    for seed in seeds {
        let mut random = Random(seed);
        let mut world = World::new(setting);
        for _ in 0..4 {
            let requests: Vec<_> = (0..6)
                .map(|_| (Request::some(random.below(10)), random.below(setting.n_processes)))
                .collect();
            world.gate.set_broken(may_fail && random.below(3) == 0);
            world.run(&mut random, &requests, 4).await;
        }
        world.check_at_rest(setting.tells_absence).await;
        n_there += usize::from(!world.store.names().await.is_empty());
    }
    println!("{n_there} runs left the cloud there");
}

#[tokio::test]
async fn random_requests_of_one_process_leave_one_truth() {
    for tells_absence in [true, false] {
        for n_bytes in [0, 1 << 20] {
            random_runs(Setting { tells_absence, n_bytes, ..DIRECTORY }, 0..100, false).await;
        }
    }
}

#[tokio::test]
async fn random_requests_of_two_processes_leave_one_truth() {
    for tells_absence in [true, false] {
        for n_bytes in [0, 1 << 20] {
            let setting = Setting { n_processes: 2, tells_absence, n_bytes };
            random_runs(setting, 1000..1100, false).await;
        }
    }
}

#[tokio::test]
async fn random_requests_leave_one_truth_though_the_store_takes_nothing_for_a_while() {
    random_runs(DIRECTORY, 2000..2200, true).await;
}
