//! Turns on a lane: as many at once as it has, handed from owner to owner.
//!
//! A semaphore hands its permits out in the order of arrival, so that a hundred requests of one key would go before the one
//! of another. Here every owner has a queue, and the queues have their turns one after the other.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use crate::store::Owner;

/// Turns that are free, and who waits for one.
pub struct Turns {
    state: Mutex<State>,
}

struct State {
    n_free: usize,
    /// Owners with somebody waiting, the next one first.
    waiting: VecDeque<(Owner, VecDeque<oneshot::Sender<Turn>>)>,
}

/// A turn, handed on when dropped.
pub struct Turn {
    turns: Option<Arc<Turns>>,
}

impl Turns {
    pub fn new(n: usize) -> Arc<Self> {
        Arc::new(Self { state: Mutex::new(State { n_free: n, waiting: VecDeque::new() }) })
    }

    /// Waits for a turn.
    pub async fn take(self: &Arc<Self>, owner: Owner) -> Turn {
        let receiver = {
            let mut state = self.state();
            if state.n_free > 0 {
                state.n_free -= 1;
                return Turn { turns: Some(self.clone()) };
            }
            let (sender, receiver) = oneshot::channel();
            match state.waiting.iter_mut().find(|(waiting, _)| *waiting == owner) {
                Some((_, queue)) => queue.push_back(sender),
                None => state.waiting.push_back((owner, VecDeque::from([sender]))),
            }
            receiver
        };
        // The sender is only dropped unsent with the lane itself: then nobody counts turns any more.
        receiver.await.unwrap_or(Turn { turns: None })
    }

    /// The next who waits, whose owner goes to the end of the line. If there is none, the turn is counted as free.
    fn next(&self) -> Option<oneshot::Sender<Turn>> {
        let mut state = self.state();
        while let Some((owner, mut queue)) = state.waiting.pop_front() {
            // Who has left costs its owner no turn.
            while queue.front().is_some_and(oneshot::Sender::is_closed) {
                queue.pop_front();
            }
            let Some(next) = queue.pop_front() else { continue };
            if !queue.is_empty() {
                state.waiting.push_back((owner, queue));
            }
            return Some(next);
        }
        state.n_free += 1;
        None
    }

    /// Turns that are taken, and who waits for one.
    pub fn load(&self, n_turns: usize) -> (usize, usize) {
        let state = self.state();
        let is_here = |sender: &&oneshot::Sender<Turn>| !sender.is_closed();
        let n_waiting = state.waiting.iter().flat_map(|(_, queue)| queue).filter(is_here).count();
        (n_turns.saturating_sub(state.n_free), n_waiting)
    }

    #[expect(clippy::disallowed_methods, reason = "a queue, for as long as it takes to look at its ends")]
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let Some(turns) = self.turns.take() else { return };
        let mut turn = Turn { turns: Some(turns.clone()) };
        while let Some(next) = turns.next() {
            match next.send(turn) {
                Ok(()) => return,
                // Who waited has left.
                Err(returned) => turn = returned,
            }
        }
        // It was counted as free.
        turn.turns = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Owner = Owner(0);
    const B: Owner = Owner(1);

    #[tokio::test]
    async fn owners_take_turns_and_those_who_left_are_passed_over() {
        let turns = Turns::new(1);
        let first = turns.take(A).await;
        let mut of_a: Vec<_> = (0..3).map(|_| Box::pin(turns.take(A))).collect();
        let mut of_b = Box::pin(turns.take(B));
        for waiting in &mut of_a {
            assert!(futures_util::poll!(waiting).is_pending());
        }
        assert!(futures_util::poll!(&mut of_b).is_pending());
        drop(of_a.remove(0));
        drop(first);
        // The second of A has the turn that the first one left; then comes B before the third of A.
        let second = of_a.remove(0).await;
        drop(second);
        let of_b = of_b.await;
        assert!(futures_util::poll!(&mut of_a[0]).is_pending());
        drop(of_b);
        drop(of_a.remove(0).await);
        assert_eq!(turns.state().n_free, 1);
    }

    #[tokio::test]
    async fn a_turn_that_all_who_waited_left_is_free() {
        let turns = Turns::new(1);
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
        let turns = Turns::new(1);
        let first = turns.take(A).await;
        let mut leaving = Box::pin(turns.take(A));
        assert!(futures_util::poll!(&mut leaving).is_pending());
        drop(first);
        drop(leaving);
        assert_eq!(turns.state().n_free, 1);
    }
}
