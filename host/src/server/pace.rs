//! Time for which a client delays an answer: the measure behind the deadline for sending.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// Bytes per second that a client must take of its answers to be waited for without end.
pub const LEAST_RATE: u64 = 64 << 10;

/// Value of `waiting_since` while no client is waited for.
const NOBODY: u64 = u64::MAX;

/// Debt of a client as a reader: the time it was waited for, less the time its bytes take at [`LEAST_RATE`].
///
/// A client that takes nothing owes all the time it was waited for. A client slower than the rate owes a part
/// of it. A faster one owes nothing, however long its answer is. Time in which the answer itself was not
/// ready never counts.
///
/// The counters belong to one task. They are atomic so that its parts can share them.
pub struct Pace {
    began: Instant,
    /// Microseconds after `began`, or [`NOBODY`].
    waiting_since: AtomicU64,
    debt_micros: AtomicU64,
}

impl Pace {
    pub fn new() -> Self {
        Self { began: Instant::now(), waiting_since: NOBODY.into(), debt_micros: 0.into() }
    }

    fn now(&self) -> u64 {
        self.began.elapsed().as_micros() as u64
    }

    /// Starts waiting for the client, unless it is waited for already.
    pub fn wait(&self) {
        if !self.is_waiting() {
            self.waiting_since.store(self.now(), Relaxed);
        }
    }

    pub fn is_waiting(&self) -> bool {
        self.waiting_since.load(Relaxed) != NOBODY
    }

    /// Records that the client took `n_bytes`, and that nothing is left for it to take.
    pub fn took(&self, n_bytes: usize) {
        let since = self.waiting_since.swap(NOBODY, Relaxed);
        let mut debt = self.debt_micros.load(Relaxed);
        if since == NOBODY && debt == 0 {
            return;
        }
        if since != NOBODY {
            debt += self.now().saturating_sub(since);
        }
        let worth = (n_bytes as u64).saturating_mul(1_000_000) / LEAST_RATE;
        self.debt_micros.store(debt.saturating_sub(worth), Relaxed);
    }

    /// Debt of the client now.
    pub fn owed(&self) -> Duration {
        let waiting = match self.waiting_since.load(Relaxed) {
            NOBODY => 0,
            since => self.now().saturating_sub(since),
        };
        Duration::from_micros(self.debt_micros.load(Relaxed) + waiting)
    }

    /// Resolves once the debt exceeds `allowed`.
    pub async fn is_overdue(&self, allowed: Duration) {
        loop {
            let owed = self.owed();
            if owed > allowed {
                return;
            }
            // The debt cannot exceed it earlier. The extra 5 ms avoid another round due to rounding.
            tokio::time::sleep(allowed - owed + Duration::from_millis(5)).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn who_takes_nothing_owes_all_the_time_and_who_keeps_up_owes_nothing() {
        let pace = Pace::new();
        assert_eq!(pace.owed(), Duration::ZERO);
        pace.wait();
        tokio::time::sleep(Duration::from_millis(30)).await;
        assert!(pace.owed() >= Duration::from_millis(30));
        // A byte at a time does not pay.
        pace.took(1);
        assert!(pace.owed() >= Duration::from_millis(29) && !pace.is_waiting());
        pace.wait();
        pace.took(1 << 20);
        assert_eq!(pace.owed(), Duration::ZERO);
        // Nobody is waited for: an answer that is not ready costs the client nothing.
        tokio::time::sleep(Duration::from_millis(10)).await;
        pace.took(0);
        assert_eq!(pace.owed(), Duration::ZERO);
    }

    #[tokio::test]
    async fn what_is_overdue_is_known_without_being_asked_again() {
        let pace = Pace::new();
        pace.wait();
        let began = Instant::now();
        pace.is_overdue(Duration::from_millis(40)).await;
        assert!(began.elapsed() >= Duration::from_millis(40));
    }
}
