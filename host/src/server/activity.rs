//! State of a connection for the code that decides whether it may go on: its own deadlines, and eviction in
//! favour of a newcomer.
//!
//! All atomics are `Relaxed`: they publish no other memory, and a timer looks at them again.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::task::Waker;
use std::time::{Duration, Instant};

use futures_util::task::AtomicWaker;
use tokio::sync::Notify;

use super::pace::Pace;
use crate::around::transport::HeadFault;

/// Silence after which a lingering connection is closed. By then the client should have read the refusal that
/// it got before it had sent its whole body.
const LINGERING: Duration = Duration::from_secs(2);

/// Time for which work goes on, without a byte of answer, for a client that has closed its sending side. A
/// client that has left and one that has only finished sending look alike until something is written to them.
const HALF_CLOSED: Duration = Duration::from_secs(1);

/// Time for half a head to become a request, once the server drains.
const DRAINING_IDLE: Duration = Duration::from_millis(500);

/// State of one connection.
pub struct Activity {
    began: Instant,
    n_in_flight: AtomicUsize,
    /// Milliseconds after `began` at which a request last ended, or the client last took bytes that waited
    /// for it.
    idle_since: AtomicU64,
    /// Time when the last answer had been sent, so that only the close by the client was awaited.
    /// Milliseconds after `began`, plus one; 0 before.
    lingering_since: AtomicU64,
    /// Time when the client last sent bytes while lingering. Same unit; 0 before.
    lingering_heard: AtomicU64,
    /// Milliseconds after `began`, plus one, at which the client closed its sending side while awaiting an
    /// answer. Moves to the last byte that it took since. 0 before.
    half_closed_since: AtomicU64,
    /// Wakes the connection when a request is over, so that it sees an end of input that was withheld.
    ended: AtomicWaker,
    /// Debt of the client as a reader of its socket.
    pub pace: Pace,
    /// Number of HTTP/2 streams with data for the client to take.
    n_unread: AtomicUsize,
    /// Debt of the client while every request under way has such data.
    streams: Pace,
    /// Signals a decision by other code about this connection: see [`Activity::notice`].
    noticed: Notify,
    is_evicted: AtomicBool,
    is_draining: AtomicBool,
    /// Whether an answer was given up before its end. Nothing must then make it look complete.
    is_broken: AtomicBool,
    /// Whether an answer was given before its request had been read.
    is_answered_early: AtomicBool,
    /// See [`Activity::has_whole_requests`].
    has_whole_requests: AtomicBool,
    fault: AtomicU8,
}

/// Reason why a connection is ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expiry {
    /// No request for too long.
    Idle,
    /// Answers left unread by the client.
    Unread,
}

/// Decision by other code about a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notice {
    /// A newcomer needs its place.
    Evicted,
    /// The server shuts down.
    Draining,
}

impl Activity {
    pub fn new() -> Arc<Self> {
        Arc::new(Self {
            began: Instant::now(),
            n_in_flight: 0.into(),
            idle_since: 0.into(),
            lingering_since: 0.into(),
            lingering_heard: 0.into(),
            half_closed_since: 0.into(),
            ended: AtomicWaker::new(),
            pace: Pace::new(),
            n_unread: 0.into(),
            streams: Pace::new(),
            noticed: Notify::new(),
            is_evicted: false.into(),
            is_draining: false.into(),
            is_broken: false.into(),
            is_answered_early: false.into(),
            has_whole_requests: true.into(),
            fault: 0.into(),
        })
    }

    fn now(&self) -> u64 {
        self.began.elapsed().as_millis() as u64
    }

    /// Records the arrival of a request. It is under way until the guard is dropped, with the body of its
    /// answer.
    pub fn enter(self: &Arc<Self>) -> InFlight {
        self.n_in_flight.fetch_add(1, Relaxed);
        // Pauses the clock and keeps the debt: the client may wait for this answer before it reads others.
        self.streams.took(0);
        // The next head has arrived, so the refused request before it was read to its end.
        self.is_answered_early.store(false, Relaxed);
        InFlight(self.clone())
    }

    /// Restarts the idle time: the client took bytes that waited for it, or a request ended.
    pub fn reset_idle(&self) {
        self.idle_since.store(self.now(), Relaxed);
    }

    /// Records that a stream has data for the client to take.
    pub fn stream_has_data(&self) {
        self.n_unread.fetch_add(1, Relaxed);
        self.wait_if_all_are_unread();
    }

    /// Records that the client took the data of a stream, `n_bytes`, or never will (0).
    pub fn stream_was_read(&self, n_bytes: usize) {
        self.n_unread.fetch_sub(1, Relaxed);
        self.streams.took(n_bytes);
        self.wait_if_all_are_unread();
    }

    fn wait_if_all_are_unread(&self) {
        let n_unread = self.n_unread.load(Relaxed);
        if n_unread > 0 && n_unread >= self.n_in_flight.load(Relaxed) {
            self.streams.wait();
        }
    }

    /// Debt of the client: the time spent waiting for it alone, less the time its bytes take at
    /// [`super::pace::LEAST_RATE`]. `None` while the connection is being evicted. A new request does not
    /// reduce it.
    pub fn owed(&self) -> Option<Duration> {
        (!self.is_evicted.load(Relaxed)).then(|| self.pace.owed().max(self.streams.owed()))
    }

    /// Records that an answer was given up before its end.
    pub fn note_broken_answer(&self) {
        self.is_broken.store(true, Relaxed);
    }

    /// Returns whether an orderly end of the connection would make half an answer look complete.
    pub fn has_unfinished_answer(&self) -> bool {
        self.is_broken.load(Relaxed) || self.n_in_flight.load(Relaxed) > 0 || self.pace.is_waiting()
    }

    /// Records that an answer was given before its request had been read to its end.
    pub fn note_early_answer(&self) {
        self.is_answered_early.store(true, Relaxed);
    }

    /// Records that bytes came from the client. `is_whole` tells whether they end with a complete request.
    pub fn receive(&self, is_whole: bool) {
        self.has_whole_requests.store(is_whole, Relaxed);
    }

    /// Returns whether all requests that have begun were received to their end.
    pub fn has_whole_requests(&self) -> bool {
        self.has_whole_requests.load(Relaxed)
    }

    /// Returns whether the client may still be sending a request that was refused.
    pub fn is_answered_early(&self) -> bool {
        self.is_answered_early.load(Relaxed)
    }

    /// Records that from now on only the close by the client is awaited.
    pub fn linger(&self) {
        if self.lingering_since.compare_exchange(0, self.now() + 1, Relaxed, Relaxed).is_ok() {
            self.note_heard();
        }
    }

    /// Restarts the silence after which lingering ends.
    pub fn note_heard(&self) {
        self.lingering_heard.store(self.now() + 1, Relaxed);
    }

    /// Records that the client has closed its sending side. Returns how long the work goes on before the
    /// client counts as gone.
    ///
    /// Bytes that it takes restart the clock. `None`: no request is under way, or the time is up. `waker` is
    /// woken when a request ends.
    pub fn half_close(&self, waker: &Waker) -> Option<Duration> {
        self.ended.register(waker);
        if self.n_in_flight.load(Relaxed) == 0 {
            return None;
        }
        let _ = self.half_closed_since.compare_exchange(0, self.now() + 1, Relaxed, Relaxed);
        // A client whose socket buffer is full is still there: otherwise the socket would report an error.
        if self.pace.is_waiting() {
            return Some(HALF_CLOSED);
        }
        let waited = self.since(self.half_closed_since.load(Relaxed));
        HALF_CLOSED.checked_sub(waited).filter(|left| !left.is_zero())
    }

    /// Restarts the half-close timer: the client took bytes of an answer, so it is still there.
    pub fn extend_half_close(&self) {
        if self.half_closed_since.load(Relaxed) > 0 {
            self.half_closed_since.store(self.now() + 1, Relaxed);
        }
    }

    /// Time since a moment given in milliseconds after `began`, plus one.
    fn since(&self, moment: u64) -> Duration {
        Duration::from_millis((self.now() + 1).saturating_sub(moment))
    }

    /// Records an untrustworthy head. No later head on this connection can be trusted either.
    pub fn distrust(&self, fault: HeadFault) {
        self.fault.store(fault.into(), Relaxed);
    }

    pub fn fault(&self) -> Option<HeadFault> {
        HeadFault::from_code(self.fault.load(Relaxed))
    }

    /// Time without a request. `None` if there is one, or if the connection is being evicted.
    pub fn idle_for(&self) -> Option<Duration> {
        let is_busy = self.n_in_flight.load(Relaxed) > 0 || self.pace.is_waiting();
        (!is_busy && !self.is_evicted.load(Relaxed))
            .then(|| Duration::from_millis(self.now().saturating_sub(self.idle_since.load(Relaxed))))
    }

    /// Ends the connection at once, in favour of another.
    pub fn evict(&self) {
        self.is_evicted.store(true, Relaxed);
        self.noticed.notify_one();
    }

    /// Ends the connection after the answers under way.
    pub fn drain(&self) {
        self.is_draining.store(true, Relaxed);
        self.noticed.notify_one();
    }

    /// Resolves when the connection is to end: at once, or after the answers under way.
    pub async fn notice(&self) -> Notice {
        self.noticed.notified().await;
        if self.is_evicted.load(Relaxed) { Notice::Evicted } else { Notice::Draining }
    }

    /// Resolves when the connection has had no request for `idle`, or its client owes more than `sending` for
    /// the socket.
    ///
    /// A single HTTP/2 stream that is overdue is reset in connection.rs. Lingering ends here too, as
    /// [`Expiry::Idle`]. One timer polls the counters, so an event on the connection only stores a number.
    pub async fn expired(&self, idle: Duration, sending: Duration) -> Expiry {
        let tick = (idle.min(sending) / 8).clamp(Duration::from_millis(10), Duration::from_millis(500));
        loop {
            tokio::time::sleep(tick).await;
            if self.pace.owed() > sending {
                return Expiry::Unread;
            }
            let idle = if self.is_draining.load(Relaxed) { idle.min(DRAINING_IDLE) } else { idle };
            let lingering_since = self.lingering_since.load(Relaxed);
            let has_lingered = lingering_since > 0
                && (self.since(self.lingering_heard.load(Relaxed)) > LINGERING
                    || self.since(lingering_since) > idle.max(LINGERING));
            if has_lingered || lingering_since == 0 && self.idle_for().is_some_and(|time| time >= idle) {
                return Expiry::Idle;
            }
        }
    }
}

/// A request under way, from its head to the last byte of its answer that hyper takes.
pub struct InFlight(Arc<Activity>);

impl InFlight {
    pub fn activity(&self) -> &Activity {
        &self.0
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        self.0.reset_idle();
        self.0.n_in_flight.fetch_sub(1, Relaxed);
        self.0.wait_if_all_are_unread();
        self.0.ended.wake();
    }
}
