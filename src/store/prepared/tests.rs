use futures_util::future::BoxFuture;
use tokio::sync::oneshot;

use super::*;
use crate::store::key::Merging;
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::model::Recipe;
use gramian_numerics::model::price::system_price;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::System;
use gramian_numerics::regression::sums::regularization::Regularization;

type Store = PreparedStore<&'static str>;

fn store(budget: usize) -> Store {
    Store::new(PreparedBytes { kept: budget, spare: 0 }, Budget::new(budget, 1))
}

fn key(alpha: f64) -> FitKey {
    let cloud = Cloud::new(vec![0.0, 1.0], 1).unwrap();
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let id = CloudId::of(&cloud, None);
    let recipe = Recipe::of_values(SolverKind::Dense, kernel, Regularization::Uniform(alpha));
    FitKey::of(Owner(0), id, &recipe, Merging::Nothing)
}

async fn factorize(n: usize, memory: Reservation) -> Result<PreparedFit, &'static str> {
    let cloud = Arc::new(Cloud::new((0..n).map(|i| i as f64).collect(), 1).unwrap());
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let factor = System::new(cloud, kernel, Regularization::Uniform(1.0))
        .and_then(|system| Solver::dense(system, &Unobserved))
        .unwrap();
    Ok(PreparedFit::new(Model::System(Arc::new(factor)), Duration::ZERO, Duration::ZERO, memory))
}

async fn outcome_of(store: &Store, alpha: f64, n: usize) -> CacheOutcome {
    let memory =
        store.reserve(Owner(0), system_price(n, 3).expected.n_bytes, || true).await.unwrap().unwrap();
    let found = store.get_or_prepare(key(alpha), Some(memory), |memory| factorize(n, memory)).await;
    found.unwrap().unwrap().1
}

#[tokio::test]
async fn the_second_request_is_a_hit_until_the_cloud_is_forgotten() {
    let store = store(1 << 20);
    assert_eq!(outcome_of(&store, 1.0, 10).await, CacheOutcome::Stored);
    assert_eq!(outcome_of(&store, 1.0, 10).await, CacheOutcome::Hit);
    assert!(store.n_reserved() > 0);
    store.forget_cloud(Owner(0), key(1.0).cloud_id);
    assert_eq!(store.n_reserved(), 0);
    assert_eq!(outcome_of(&store, 1.0, 10).await, CacheOutcome::Stored);
}

#[tokio::test]
async fn a_failure_does_not_poison_the_key_and_gives_its_memory_back() {
    let store = store(1 << 20);
    let memory = store.reserve(Owner(0), 1000, || true).await.unwrap().unwrap();
    let failing = |memory: Reservation| async move {
        drop(memory);
        Err("no")
    };
    let failed = store.get_or_prepare(key(1.0), Some(memory), failing).await;
    assert_eq!((failed.err(), store.n_reserved()), (Some("no"), 0));
    assert_eq!(outcome_of(&store, 1.0, 10).await, CacheOutcome::Stored);
}

#[tokio::test]
async fn without_memory_nothing_is_begun() {
    let store = store(1 << 20);
    let found = store.get_or_prepare(key(1.0), None, |memory| factorize(10, memory)).await;
    assert!(found.unwrap().is_none());
    assert_eq!(store.missing(key(1.0), false), Missing { solver: true, surface: false });
}

#[tokio::test]
async fn factors_beyond_the_budget_are_computed_each_time() {
    // 100 points take half of 100² numbers, 40 KB, and the budget of factors keeps 15 parts of 16.
    let store = Store::new(PreparedBytes { kept: 32 << 10, spare: 0 }, Budget::new(1 << 20, 1));
    assert_eq!(outcome_of(&store, 1.0, 100).await, CacheOutcome::NotStored);
    assert_eq!(outcome_of(&store, 1.0, 100).await, CacheOutcome::NotStored);
    assert_eq!((store.n_bytes(), store.n_reserved()), (0, 0));
}

#[tokio::test]
async fn what_is_kept_makes_room_for_work_unless_it_is_in_use() {
    let store = store(400 << 10);
    for alpha in [1.0, 2.0, 3.0] {
        outcome_of(&store, alpha, 100).await;
    }
    let in_use = store.get_or_prepare(key(1.0), None, |memory| factorize(100, memory)).await;
    let in_use = in_use.unwrap().unwrap().0;
    // A factor takes 40 KB and what the allocator adds: there is room for one beside the work, not for three.
    let work = store.reserve(Owner(0), 280 << 10, || true).await.unwrap().unwrap();
    let is_missing = |alpha| store.missing(key(alpha), false).solver;
    assert_eq!([1.0, 2.0].map(is_missing), [false, true]);
    drop(in_use);
    drop(work);
}

/// Returns work that runs elsewhere, as on a pool: it is told to stop, but takes its time.
fn working<V>(
    ended: oneshot::Receiver<()>,
) -> impl FnOnce(Reservation) -> BoxFuture<'static, Result<V, &'static str>> {
    |memory| {
        let work = tokio::spawn(async move {
            ended.await.ok();
            drop(memory);
        });
        Box::pin(async move {
            work.await.ok();
            Err("cancelled")
        })
    }
}

#[tokio::test]
async fn a_flight_is_paid_for_until_its_work_has_ended_whoever_has_left() {
    let store = store(1 << 20);
    let (end, ended) = oneshot::channel::<()>();
    let memory = store.reserve(Owner(0), 4000, || true).await.unwrap().unwrap();
    let mut beginner = Box::pin(store.get_or_prepare(key(1.0), Some(memory), working(ended)));
    assert!(futures_util::poll!(&mut beginner).is_pending());
    let mut joined = Box::pin(store.get_or_prepare(key(1.0), None, |memory| factorize(10, memory)));
    assert!(futures_util::poll!(&mut joined).is_pending());
    drop(beginner);
    assert_eq!(store.n_reserved(), 4000);
    assert!(futures_util::poll!(&mut joined).is_pending());
    drop(joined);
    assert_eq!((store.n_reserved(), store.missing(key(1.0), false).solver), (4000, true));
    end.send(()).unwrap();
    while store.n_reserved() > 0 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn a_surface_is_paid_for_until_its_work_has_ended() {
    let store = store(1 << 20);
    let memory = store.reserve(Owner(0), 4000, || true).await.unwrap().unwrap();
    let found = store.get_or_prepare(key(1.0), Some(memory), |memory| factorize(10, memory)).await;
    let stored = found.unwrap().unwrap().0;
    let before = store.n_reserved();
    let (end, ended) = oneshot::channel::<()>();
    let memory = store.reserve(Owner(0), 5000, || true).await.unwrap().unwrap();
    let mut waiting = Box::pin(store.get_or_make_surface(key(1.0), &stored, Some(memory), working(ended)));
    assert!(futures_util::poll!(&mut waiting).is_pending());
    drop(waiting);
    assert_eq!(store.n_reserved(), before + 5000);
    end.send(()).unwrap();
    while store.n_reserved() > before {
        tokio::task::yield_now().await;
    }
}
