//! Deduplication of concurrent computations: all callers with the same key share one future.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures_util::FutureExt;
use futures_util::future::{BoxFuture, Shared, WeakShared};

type Outcome<V, E> = Result<V, E>;
type Flight<V, E> = Shared<BoxFuture<'static, Outcome<V, E>>>;
type WeakFlight<V, E> = WeakShared<BoxFuture<'static, Outcome<V, E>>>;

/// Futures under way, by key.
///
/// Every waiter polls the shared future, so it survives the client that began it. The map holds it weakly.
/// When the last waiter leaves, the future is dropped and the work with it.
pub struct SingleFlight<K, V, E> {
    flights: Arc<Mutex<HashMap<K, WeakFlight<V, E>>>>,
}

/// Tells whether a caller began the flight or joined one under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boarding {
    Began,
    Joined,
}

impl<K, V, E> Default for SingleFlight<K, V, E> {
    fn default() -> Self {
        Self { flights: Arc::default() }
    }
}

impl<K, V, E> SingleFlight<K, V, E>
where
    K: Hash + Eq + Copy + Send + 'static,
    V: Clone + Send + Sync + 'static,
    E: Clone + Send + Sync + 'static,
{
    #[expect(clippy::disallowed_methods, reason = "a table, for a look-up: a flight is only awaited outside")]
    fn flights(&self) -> MutexGuard<'_, HashMap<K, WeakFlight<V, E>>> {
        self.flights.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether a flight of `key` is under way.
    pub fn is_under_way(&self, key: &K) -> bool {
        self.flights().get(key).and_then(under_way).is_some()
    }

    /// Joins the flight of `key`, if there is one.
    pub async fn join_if_under_way(&self, key: &K) -> Option<Outcome<V, E>> {
        let flight = self.flights().get(key).and_then(under_way);
        match flight {
            Some(flight) => Some(flight.await),
            None => None,
        }
    }

    /// Joins the flight of `key`, or begins it with `compute`.
    pub async fn join<F>(&self, key: K, compute: impl FnOnce() -> F) -> (Boarding, Outcome<V, E>)
    where
        F: Future<Output = Outcome<V, E>> + Send + 'static,
    {
        let (boarding, flight) = self.board(key, compute);
        (boarding, flight.await)
    }

    /// Finds or begins a flight. If one is under way, `compute` and its captures are dropped before any wait.
    fn board<F>(&self, key: K, compute: impl FnOnce() -> F) -> (Boarding, Flight<V, E>)
    where
        F: Future<Output = Outcome<V, E>> + Send + 'static,
    {
        let mut flights = self.flights();
        if let Some(flight) = flights.get(&key).and_then(under_way) {
            drop(flights);
            return (Boarding::Joined, flight);
        }
        let flight = compute().boxed().shared();
        // Entries of abandoned flights are swept here, so the map stays as small as the traffic.
        flights.retain(|_, weak| weak.upgrade().is_some());
        if let Some(weak) = flight.downgrade() {
            flights.insert(key, weak);
        }
        (Boarding::Began, flight)
    }
}

/// Returns the flight unless it has landed. A landed flight may still be held by waiters that have not read
/// its outcome yet. A caller that comes now must not get that outcome.
fn under_way<V: Clone, E: Clone>(weak: &WeakFlight<V, E>) -> Option<Flight<V, E>> {
    weak.upgrade().filter(|flight| flight.peek().is_none())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    use tokio::sync::oneshot;

    use super::*;

    type Numbers = SingleFlight<u8, u32, &'static str>;

    #[tokio::test]
    async fn concurrent_callers_share_one_computation_which_survives_its_beginner() {
        let (flights, runs) = (Arc::new(Numbers::default()), Arc::new(AtomicUsize::new(0)));
        let (release, released) = oneshot::channel::<()>();
        let beginner = {
            let (flights, runs) = (flights.clone(), runs.clone());
            tokio::spawn(async move {
                let compute = async move {
                    runs.fetch_add(1, SeqCst);
                    released.await.ok();
                    Ok(7)
                };
                flights.join(1, || compute).await
            })
        };
        while runs.load(SeqCst) == 0 {
            tokio::task::yield_now().await;
        }
        let mut waiter = Box::pin(flights.join(1, || async { Err("a second computation") }));
        assert!(futures_util::poll!(&mut waiter).is_pending());
        assert!(flights.is_under_way(&1) && !flights.is_under_way(&2));
        beginner.abort();
        assert!(beginner.await.is_err());
        release.send(()).unwrap();
        assert_eq!(waiter.await, (Boarding::Joined, Ok(7)));
        assert_eq!(runs.load(SeqCst), 1);
    }

    #[tokio::test]
    async fn a_failure_is_shared_but_not_kept() {
        let flights = Numbers::default();
        assert_eq!(flights.join(1, || async { Err("no") }).await, (Boarding::Began, Err("no")));
        assert_eq!(flights.join(1, || async { Ok(2) }).await, (Boarding::Began, Ok(2)));
    }

    #[tokio::test]
    async fn a_flight_that_has_landed_is_not_under_way_whoever_has_not_looked_yet() {
        let flights = Numbers::default();
        let (release, released) = oneshot::channel::<()>();
        let compute = async move {
            released.await.ok();
            Err("no")
        };
        let (mut first, mut second) =
            (Box::pin(flights.join(1, || compute)), Box::pin(flights.join_if_under_way(&1)));
        assert!(
            futures_util::poll!(&mut first).is_pending() && futures_util::poll!(&mut second).is_pending()
        );
        release.send(()).unwrap();
        assert_eq!(first.await.1, Err("no"));
        assert!(!flights.is_under_way(&1) && flights.join_if_under_way(&1).await.is_none());
        assert_eq!(flights.join(1, || async { Ok(2) }).await, (Boarding::Began, Ok(2)));
        assert_eq!(second.await, Some(Err("no")));
    }

    #[tokio::test]
    async fn who_joins_lets_go_of_what_beginning_would_have_taken() {
        let flights = Numbers::default();
        let mut first = Box::pin(flights.join(1, std::future::pending));
        assert!(futures_util::poll!(&mut first).is_pending());
        let (held, is_held) = oneshot::channel::<()>();
        let mut second = Box::pin(flights.join(1, || async move {
            drop(held);
            Ok(1)
        }));
        assert!(futures_util::poll!(&mut second).is_pending());
        assert!(is_held.await.is_err());
    }

    #[tokio::test]
    async fn when_the_last_waiter_leaves_the_computation_is_dropped() {
        let flights = Numbers::default();
        let (sender, receiver) = oneshot::channel::<()>();
        let compute = async move {
            let _held = sender;
            std::future::pending().await
        };
        let mut only = Box::pin(flights.join(1, || compute));
        assert!(futures_util::poll!(&mut only).is_pending());
        drop(only);
        assert!(receiver.await.is_err());
        assert_eq!(flights.join(1, || async { Ok(3) }).await, (Boarding::Began, Ok(3)));
    }
}
