//! Bytes of memory shared by many: reserved before use, given back when whatever they pay for is dropped.
//!
//! WHY NOT A SEMAPHORE. A semaphore serves its waiters in order, so a request for a kilobyte waits behind one
//! for a gigabyte. Here small reservations never wait behind large ones: a part of the budget is closed to
//! large reservations. Among the large ones, the owner holding least comes first; ties go by arrival. With
//! several owners, none may hold more than half: a reservation beyond that is skipped until its owner gives
//! bytes back. Any other large reservation is overtaken by a later one only if the owner of the later one
//! holds less.
//!
//! NO WAITING WHILE HOLDING. A caller that waits here must hold nothing that other waiters need. Callers
//! therefore reserve all their bytes at once and split the reservation afterwards.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;

use super::{Owner, share_of_one};

/// Large reservations leave `total / KEPT_FREE_DIVISOR` bytes free for small ones.
const KEPT_FREE_DIVISOR: usize = 8;

/// A reservation of at most 1/16 of these bytes is small, so several fit into them.
const SMALL_DIVISOR: usize = 16;

/// Interval at which a waiting reservation looks again without being woken: a cache may be able to give up
/// entries, and a turn that passes on is not announced.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// A limit on bytes held, with the bytes of each owner. Clones share it.
#[derive(Clone)]
pub struct Budget {
    ledger: Arc<Ledger>,
}

struct Ledger {
    total: usize,
    /// Most bytes that one owner may hold. Unlimited when there is only one owner.
    share: usize,
    state: Mutex<State>,
    released: Notify,
}

#[derive(Default)]
struct State {
    held: usize,
    by_owner: HashMap<Owner, usize>,
    /// Large reservations that wait, in order of arrival.
    waiting: Vec<Waiting>,
    n_arrived: u64,
}

#[derive(Clone, Copy)]
struct Waiting {
    arrival: u64,
    owner: Owner,
    n_bytes: usize,
}

/// A refused reservation: it exceeds `limit`, the largest that can ever succeed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BeyondBudget {
    pub limit: usize,
}

impl Budget {
    /// Creates a budget of `total` bytes. With several owners, each may hold at most half.
    pub fn new(total: usize, n_owners: usize) -> Self {
        let ledger = Ledger {
            total,
            share: share_of_one(total, n_owners),
            state: Mutex::default(),
            released: Notify::new(),
        };
        Self { ledger: Arc::new(ledger) }
    }

    /// The largest reservation that can ever succeed, in bytes.
    pub fn largest(&self) -> usize {
        self.ledger.largest()
    }

    /// Bytes held now.
    pub fn n_held(&self) -> usize {
        self.ledger.state().held
    }

    /// Reserves `n_bytes` if they are free now, ahead of any waiters.
    pub fn try_reserve(&self, owner: Owner, n_bytes: usize) -> Option<Reservation> {
        let mut state = self.ledger.state();
        self.ledger.has_room(&state, owner, n_bytes).then(|| self.take(&mut state, owner, n_bytes))
    }

    /// Reserves `n_bytes` that are in use already, even beyond the budget. New reservations fail until they
    /// fit again.
    pub fn reserve_beyond(&self, owner: Owner, n_bytes: usize) -> Reservation {
        self.take(&mut self.ledger.state(), owner, n_bytes)
    }

    /// Waits for the turn of this reservation and for `n_bytes` to be free, and reserves them.
    ///
    /// Whenever they are not free, `look` is called with the missing bytes, `None` if only the turn is
    /// missing. It should release what can be spared. `ControlFlow::Break` gives up, and the result is
    /// `None`.
    ///
    /// # Errors
    /// [`BeyondBudget`] if `n_bytes` exceeds [`Budget::largest`].
    pub async fn reserve(
        &self,
        owner: Owner,
        n_bytes: usize,
        look: impl Fn(Option<Shortage>) -> ControlFlow<()>,
    ) -> Result<Option<Reservation>, BeyondBudget> {
        if n_bytes > self.largest() {
            return Err(BeyondBudget { limit: self.largest() });
        }
        let place = self.queue(owner, n_bytes);
        loop {
            let released = self.ledger.released.notified();
            tokio::pin!(released);
            // Registered before the check, so that a release in between is not missed.
            released.as_mut().enable();
            if let Some(reservation) = self.take_turn(&place) {
                return Ok(Some(reservation));
            }
            if look(self.shortage(owner, n_bytes)).is_break() {
                return Ok(None);
            }
            if let Some(reservation) = self.take_turn(&place) {
                return Ok(Some(reservation));
            }
            // Woken or timed out, it looks again.
            let _ = tokio::time::timeout(LOOK_AGAIN, released).await;
        }
    }

    /// Grows a reservation within `timeout`. Returns whether it succeeded. It waits while holding bytes that
    /// others may wait for, so `timeout` must be short.
    pub async fn grow(&self, reservation: &mut Reservation, n_bytes: usize, timeout: Duration) -> bool {
        let growing = async {
            loop {
                let released = self.ledger.released.notified();
                tokio::pin!(released);
                // Registered before the check, as in `reserve`.
                released.as_mut().enable();
                if reservation.try_grow(n_bytes) {
                    return;
                }
                let _ = tokio::time::timeout(LOOK_AGAIN, released).await;
            }
        };
        tokio::time::timeout(timeout, growing).await.is_ok()
    }

    /// Returns the bytes missing for a reservation, its turn aside, or `None` if it fits.
    pub fn shortage(&self, owner: Owner, n_bytes: usize) -> Option<Shortage> {
        let state = self.ledger.state();
        let of_owner = state.of(owner).saturating_add(n_bytes).saturating_sub(self.ledger.share);
        let free = self.ledger.total.saturating_sub(state.held);
        let of_all = n_bytes.saturating_add(self.ledger.must_leave_free(n_bytes)).saturating_sub(free);
        (of_owner > 0 || of_all > 0).then_some(Shortage { owner, of_owner, of_all })
    }

    fn queue(&self, owner: Owner, n_bytes: usize) -> Place<'_> {
        let mut state = self.ledger.state();
        let waiting = Waiting { arrival: state.n_arrived, owner, n_bytes };
        state.n_arrived += 1;
        if self.ledger.is_large(n_bytes) {
            state.waiting.push(waiting);
        }
        Place { ledger: &self.ledger, waiting }
    }

    fn take_turn(&self, place: &Place<'_>) -> Option<Reservation> {
        let Waiting { arrival, owner, n_bytes } = place.waiting;
        let mut state = self.ledger.state();
        if !self.ledger.has_room(&state, owner, n_bytes) || !self.ledger.is_next(&state, place.waiting) {
            return None;
        }
        state.waiting.retain(|waiting| waiting.arrival != arrival);
        Some(self.take(&mut state, owner, n_bytes))
    }

    fn take(&self, state: &mut State, owner: Owner, n_bytes: usize) -> Reservation {
        state.held += n_bytes;
        *state.by_owner.entry(owner).or_default() += n_bytes;
        Reservation { ledger: self.ledger.clone(), owner, n_bytes }
    }
}

impl Ledger {
    #[expect(clippy::disallowed_methods, reason = "counters, for as long as it takes to count")]
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn largest(&self) -> usize {
        self.share.min(self.total - self.total / KEPT_FREE_DIVISOR)
    }

    fn is_large(&self, n_bytes: usize) -> bool {
        n_bytes > self.total / KEPT_FREE_DIVISOR / SMALL_DIVISOR
    }

    /// Bytes that a reservation of this size must leave free.
    fn must_leave_free(&self, n_bytes: usize) -> usize {
        if self.is_large(n_bytes) { self.total / KEPT_FREE_DIVISOR } else { 0 }
    }

    fn may_hold(&self, state: &State, owner: Owner, n_bytes: usize) -> bool {
        state.of(owner).saturating_add(n_bytes) <= self.share
    }

    fn has_room(&self, state: &State, owner: Owner, n_bytes: usize) -> bool {
        let free = self.total.saturating_sub(state.held);
        self.may_hold(state, owner, n_bytes) && n_bytes.saturating_add(self.must_leave_free(n_bytes)) <= free
    }

    fn is_next(&self, state: &State, candidate: Waiting) -> bool {
        let rank = |waiting: &Waiting| (state.of(waiting.owner), waiting.arrival);
        let eligible = state.waiting.iter().filter(|w| self.may_hold(state, w.owner, w.n_bytes));
        !self.is_large(candidate.n_bytes)
            || eligible.min_by_key(|w| rank(w)).is_none_or(|first| first.arrival == candidate.arrival)
    }
}

impl State {
    fn of(&self, owner: Owner) -> usize {
        self.by_owner.get(&owner).copied().unwrap_or(0)
    }
}

/// Bytes to release before a reservation fits: by its owner, and by all owners together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortage {
    pub owner: Owner,
    pub of_owner: usize,
    pub of_all: usize,
}

/// A place in the queue, given up when dropped.
struct Place<'a> {
    ledger: &'a Ledger,
    waiting: Waiting,
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        if self.ledger.is_large(self.waiting.n_bytes) {
            let mut state = self.ledger.state();
            let n_before = state.waiting.len();
            state.waiting.retain(|waiting| waiting.arrival != self.waiting.arrival);
            if state.waiting.len() < n_before {
                drop(state);
                self.ledger.released.notify_waiters();
            }
        }
    }
}

/// Bytes in use until this value is dropped. It travels with the data that they pay for.
pub struct Reservation {
    ledger: Arc<Ledger>,
    owner: Owner,
    n_bytes: usize,
}

impl Reservation {
    pub fn n_bytes(&self) -> usize {
        self.n_bytes
    }

    pub fn owner(&self) -> Owner {
        self.owner
    }

    /// Splits off `n_bytes`, or all bytes if there are fewer.
    pub fn split(&mut self, n_bytes: usize) -> Reservation {
        let n_bytes = n_bytes.min(self.n_bytes);
        self.n_bytes -= n_bytes;
        Reservation { ledger: self.ledger.clone(), owner: self.owner, n_bytes }
    }

    /// Gives back all but `n_bytes`.
    pub fn shrink_to(&mut self, n_bytes: usize) {
        drop(self.split(self.n_bytes.saturating_sub(n_bytes)));
    }

    /// Adds the bytes of another reservation of the same budget and owner.
    pub fn merge(&mut self, mut other: Reservation) {
        self.n_bytes += std::mem::take(&mut other.n_bytes);
    }

    /// Reserves `n_bytes` more if they are free now. Returns whether they were.
    pub fn try_grow(&mut self, n_bytes: usize) -> bool {
        let mut state = self.ledger.state();
        if !self.ledger.has_room(&state, self.owner, n_bytes) {
            return false;
        }
        state.held += n_bytes;
        *state.by_owner.entry(self.owner).or_default() += n_bytes;
        self.n_bytes += n_bytes;
        true
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        if self.n_bytes == 0 {
            return;
        }
        let mut state = self.ledger.state();
        state.held -= self.n_bytes;
        if let Some(held) = state.by_owner.get_mut(&self.owner) {
            *held -= self.n_bytes;
            if *held == 0 {
                state.by_owner.remove(&self.owner);
            }
        }
        drop(state);
        self.ledger.released.notify_waiters();
    }
}

#[cfg(test)]
mod tests;
