//! A fair semaphore, whose permits (turns) rotate among the owners.
//!
//! A plain semaphore hands its permits out in the order of arrival, so a hundred requests of one key would
//! precede the one request of another. Here every owner has a queue, and the queues are served in turn. Where
//! a turn may last for hours and there are several owners, none may hold more than half of the turns, whoever
//! else waits.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use crate::memory::{Owner, share_of_one};

/// A fixed number of turns, with a queue per owner.
pub struct FairSemaphore {
    n: usize,
    /// Most turns that one owner may hold.
    most: usize,
    state: Mutex<State>,
}

struct State {
    n_free: usize,
    taken: HashMap<Owner, usize>,
    /// Owners with waiting requests. The next owner to be served is first.
    waiting: VecDeque<(Owner, VecDeque<oneshot::Sender<Turn>>)>,
}

/// A turn. When dropped, it passes to the next waiting request.
pub struct Turn {
    of: Option<(Arc<FairSemaphore>, Owner)>,
}

impl FairSemaphore {
    /// Creates `n` turns, all of which one owner may hold.
    pub fn new(n: usize) -> Arc<Self> {
        Self::with_most(n, n)
    }

    /// Creates turns that may last for hours. With several owners there are at least two turns, and each
    /// owner may hold half.
    pub fn of_owners(n: usize, n_owners: usize) -> Arc<Self> {
        let n = if n_owners > 1 { n.max(2) } else { n };
        Self::with_most(n, share_of_one(n, n_owners))
    }

    fn with_most(n: usize, most: usize) -> Arc<Self> {
        let state = State { n_free: n, taken: HashMap::new(), waiting: VecDeque::new() };
        Arc::new(Self { n, most, state: Mutex::new(state) })
    }

    /// Waits for a turn.
    pub async fn take(self: &Arc<Self>, owner: Owner) -> Turn {
        let receiver = {
            let mut state = self.state();
            if state.n_free > 0 && state.n_taken_by(owner) < self.most {
                state.n_free -= 1;
                *state.taken.entry(owner).or_default() += 1;
                return Turn { of: Some((self.clone(), owner)) };
            }
            let (sender, receiver) = oneshot::channel();
            match state.waiting.iter_mut().find(|(waiting, _)| *waiting == owner) {
                Some((_, queue)) => queue.push_back(sender),
                None => state.waiting.push_back((owner, VecDeque::from([sender]))),
            }
            receiver
        };
        // A sender is dropped without sending only when the semaphore itself is dropped. From then on turns
        // are not counted.
        receiver.await.unwrap_or(Turn { of: None })
    }

    /// Takes a turn back and returns the next request to receive it. If there is none, the turn becomes free.
    ///
    /// The owner of that request moves to the end of the line. Owners that already hold as many turns as they
    /// may are skipped.
    fn next(&self, last: Owner) -> Option<(Owner, oneshot::Sender<Turn>)> {
        let mut state = self.state();
        state.give_back(last);
        let mut passed_over = VecDeque::new();
        let next = loop {
            let Some((owner, mut queue)) = state.waiting.pop_front() else { break None };
            // A request whose client has left costs its owner no turn.
            while queue.front().is_some_and(oneshot::Sender::is_closed) {
                queue.pop_front();
            }
            if queue.is_empty() {
                continue;
            }
            if state.n_taken_by(owner) >= self.most {
                passed_over.push_back((owner, queue));
                continue;
            }
            let Some(next) = queue.pop_front() else { continue };
            if !queue.is_empty() {
                state.waiting.push_back((owner, queue));
            }
            break Some((owner, next));
        };
        // Owners that were skipped keep their places in front.
        passed_over.append(&mut state.waiting);
        state.waiting = passed_over;
        match &next {
            Some((owner, _)) => *state.taken.entry(*owner).or_default() += 1,
            None => state.n_free += 1,
        }
        next
    }

    /// Returns the number of taken turns and the number of waiting requests.
    pub fn load(&self) -> (usize, usize) {
        let state = self.state();
        let is_here = |sender: &&oneshot::Sender<Turn>| !sender.is_closed();
        let n_waiting = state.waiting.iter().flat_map(|(_, queue)| queue).filter(is_here).count();
        (self.n.saturating_sub(state.n_free), n_waiting)
    }

    /// Whether an owner could take a turn at once.
    pub fn has_one_for(&self, owner: Owner) -> bool {
        let state = self.state();
        state.n_free > 0 && state.n_taken_by(owner) < self.most
    }

    #[expect(clippy::disallowed_methods, reason = "a queue, for as long as it takes to look through it")]
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn n_taken_by(&self, owner: Owner) -> usize {
        self.taken.get(&owner).copied().unwrap_or(0)
    }

    fn give_back(&mut self, owner: Owner) {
        if let Some(n) = self.taken.get_mut(&owner) {
            *n -= 1;
            if *n == 0 {
                self.taken.remove(&owner);
            }
        }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let Some((turns, mut last)) = self.of.take() else { return };
        while let Some((owner, next)) = turns.next(last) {
            match next.send(Turn { of: Some((turns.clone(), owner)) }) {
                Ok(()) => return,
                // The client of the waiting request has left, so the turn passes on.
                Err(mut returned) => returned.of = None,
            }
            last = owner;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Owner = Owner(0);
    const B: Owner = Owner(1);

    #[tokio::test]
    async fn owners_take_turns_and_those_who_left_are_passed_over() {
        let turns = FairSemaphore::new(1);
        let first = turns.take(A).await;
        let mut of_a: Vec<_> = (0..3).map(|_| Box::pin(turns.take(A))).collect();
        let mut of_b = Box::pin(turns.take(B));
        for waiting in &mut of_a {
            assert!(futures_util::poll!(waiting).is_pending());
        }
        assert!(futures_util::poll!(&mut of_b).is_pending());
        drop(of_a.remove(0));
        drop(first);
        // The second request of A takes over the turn of the first. Then B precedes the third of A.
        let second = of_a.remove(0).await;
        drop(second);
        let of_b = of_b.await;
        assert!(futures_util::poll!(&mut of_a[0]).is_pending());
        drop(of_b);
        drop(of_a.remove(0).await);
        assert_eq!(turns.state().n_free, 1);
    }

    #[tokio::test]
    async fn no_owner_of_several_has_more_than_half() {
        let turns = FairSemaphore::of_owners(1, 2);
        let first = turns.take(A).await;
        let mut second = Box::pin(turns.take(A));
        let mut third = Box::pin(turns.take(A));
        assert!(
            futures_util::poll!(&mut second).is_pending() && futures_util::poll!(&mut third).is_pending()
        );
        assert!(!turns.has_one_for(A) && turns.has_one_for(B) && turns.load() == (1, 2));
        let of_b = turns.take(B).await;
        let mut next_of_b = Box::pin(turns.take(B));
        assert!(futures_util::poll!(&mut next_of_b).is_pending());
        // A has waited longer, but already holds its half.
        drop(of_b);
        let next_of_b = next_of_b.await;
        assert!(futures_util::poll!(&mut second).is_pending());
        drop(first);
        drop(second.await);
        drop(third.await);
        drop(next_of_b);
        assert_eq!((turns.load(), turns.state().taken.len()), ((0, 0), 0));
    }

    #[tokio::test]
    async fn one_owner_alone_has_all() {
        let turns = FairSemaphore::of_owners(3, 1);
        let taken = [turns.take(A).await, turns.take(A).await, turns.take(A).await];
        assert_eq!((turns.load(), turns.has_one_for(A)), ((3, 0), false));
        drop(taken);
        assert_eq!((turns.load(), turns.has_one_for(A)), ((0, 0), true));
    }

    #[tokio::test]
    async fn a_turn_that_all_who_waited_left_is_free() {
        let turns = FairSemaphore::new(1);
        let first = turns.take(A).await;
        let mut leaving = [Box::pin(turns.take(A)), Box::pin(turns.take(B)), Box::pin(turns.take(B))];
        for waiting in &mut leaving {
            assert!(futures_util::poll!(waiting).is_pending());
        }
        drop(leaving);
        drop(first);
        assert_eq!(turns.state().n_free, 1);
        assert!(turns.state().waiting.is_empty());
    }

    #[tokio::test]
    async fn a_turn_that_was_handed_to_somebody_who_leaves_goes_on() {
        let turns = FairSemaphore::new(1);
        let first = turns.take(A).await;
        let mut leaving = Box::pin(turns.take(A));
        assert!(futures_util::poll!(&mut leaving).is_pending());
        drop(first);
        drop(leaving);
        assert_eq!(turns.state().n_free, 1);
    }
}
