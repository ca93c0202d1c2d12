//! What a connection is doing, for those who decide whether it may go on: its own deadlines, and the newcomer that needs its
//! place.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::task::Waker;
use std::time::{Duration, Instant};

use futures_util::task::AtomicWaker;
use tokio::sync::Notify;

use super::pace::Pace;
use crate::http::around::transport::HeadFault;

/// Silence after which a client has read a refusal that came before it had sent its body.
const LINGERING: Duration = Duration::from_secs(2);

/// How long the work for a client that has ended its side of the connection goes on without a byte of answer
/// for it. A client that has left and one that only sends no more look the same until something is written to
/// them.
const HALF_CLOSED: Duration = Duration::from_secs(1);

/// Time for half a head to become a request, once the server drains.
const DRAINING_IDLE: Duration = Duration::from_millis(500);

/// One connection.
pub struct Activity {
    began: Instant,
    n_in_flight: AtomicUsize,
    /// Milliseconds after `began`: when it last had a request or sent a byte that was waited for.
    idle_since: AtomicU64,
    /// Milliseconds after `began`, plus one; 0 unless its last answer is sent and only the client's end is
    /// waited for: since when, and when it last sent something.
    lingering_since: AtomicU64,
    lingering_heard: AtomicU64,
    /// Milliseconds after `began`, plus one; 0 unless the client has ended its side while it waits for an
    /// answer: since when, or since it last took a byte.
    half_closed_since: AtomicU64,
    /// Wakes the connection when a request is over, to see the end that was kept from it.
    ended: AtomicWaker,
    /// The client as a reader of its socket.
    pub pace: Pace,
    /// Streams of HTTP/2 that have something for the client to take, and the client as a reader while there is nothing else.
    n_unread: AtomicUsize,
    streams: Pace,
    /// Somebody else has decided about it: see [`Activity::notice`].
    noticed: Notify,
    is_evicted: AtomicBool,
    is_draining: AtomicBool,
    /// An answer was given up before its end: nothing must make it look complete.
    is_broken: AtomicBool,
    /// An answer was given before its request had been read.
    is_answered_early: AtomicBool,
    /// See [`Activity::has_whole_requests`].
    has_whole_requests: AtomicBool,
    fault: AtomicU8,
}

/// Why a connection is ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expiry {
    /// Without a request for too long.
    Idle,
    /// Its client does not read what it asked for.
    Unread,
}

/// What others have decided about a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notice {
    /// A newcomer needs its place.
    Evicted,
    /// The server ends.
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

    /// A request has arrived; it is under way until the guard is dropped, with the body of its answer.
    pub fn enter(self: &Arc<Self>) -> InFlight {
        self.n_in_flight.fetch_add(1, Relaxed);
        // The client may wait for this one before it reads the others.
        self.streams.took(0);
        self.is_answered_early.store(false, Relaxed);
        InFlight(self.clone())
    }

    /// The client took bytes that waited for it: that is not idle.
    pub fn stir(&self) {
        self.idle_since.store(self.now(), Relaxed);
    }

    /// A stream has something for the client to take.
    pub fn give(&self) {
        self.n_unread.fetch_add(1, Relaxed);
        self.wait_if_all_are_unread();
    }

    /// The client took it, or never will.
    pub fn took(&self, n_bytes: usize) {
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

    /// How long it was only the client that was waited for, beyond what its bytes take; `None` if it is on its way out. What it owes it
    /// owes whatever it asks for next: a new request on a connection whose client reads none pays nothing.
    pub fn owed(&self) -> Option<Duration> {
        (!self.is_evicted.load(Relaxed)).then(|| self.pace.owed().max(self.streams.owed()))
    }

    pub fn break_answer(&self) {
        self.is_broken.store(true, Relaxed);
    }

    /// Whether the client would take half an answer for a whole one if the connection ended in order.
    pub fn has_half_an_answer(&self) -> bool {
        self.is_broken.load(Relaxed) || self.n_in_flight.load(Relaxed) > 0 || self.pace.is_waiting()
    }

    pub fn answer_early(&self) {
        self.is_answered_early.store(true, Relaxed);
    }

    /// Bytes came from the client: up to the end of a request, or not.
    pub fn receive(&self, is_whole: bool) {
        self.has_whole_requests.store(is_whole, Relaxed);
    }

    /// Whether all requests that have begun were received to their end.
    pub fn has_whole_requests(&self) -> bool {
        self.has_whole_requests.load(Relaxed)
    }

    /// Whether the client may still be sending what was refused.
    pub fn is_answered_early(&self) -> bool {
        self.is_answered_early.load(Relaxed)
    }

    /// From now on only the client's end is waited for.
    pub fn linger(&self) {
        if self.lingering_since.compare_exchange(0, self.now() + 1, Relaxed, Relaxed).is_ok() {
            self.hear_out();
        }
    }

    /// The client still sends what was refused.
    pub fn hear_out(&self) {
        self.lingering_heard.store(self.now() + 1, Relaxed);
    }

    /// How long a client that has sent all that it will may still wait for an answer, unless it takes some of
    /// it; `None` if no request is under way, or it has waited so long in vain that it may as well have left.
    /// One that makes no room for more is there: its socket would have said otherwise. `waker` is woken when
    /// a request is over.
    pub fn half_close(&self, waker: &Waker) -> Option<Duration> {
        self.ended.register(waker);
        if self.n_in_flight.load(Relaxed) == 0 {
            return None;
        }
        let _ = self.half_closed_since.compare_exchange(0, self.now() + 1, Relaxed, Relaxed);
        if self.pace.is_waiting() {
            return Some(HALF_CLOSED);
        }
        let waited = self.since(self.half_closed_since.load(Relaxed));
        HALF_CLOSED.checked_sub(waited).filter(|left| !left.is_zero())
    }

    /// The client took bytes of an answer.
    pub fn take(&self) {
        if self.half_closed_since.load(Relaxed) > 0 {
            self.half_closed_since.store(self.now() + 1, Relaxed);
        }
    }

    /// Time since a moment in milliseconds after `began`, plus one.
    fn since(&self, moment: u64) -> Duration {
        Duration::from_millis((self.now() + 1).saturating_sub(moment))
    }

    /// A head on this connection cannot be trusted, so none that follows can.
    pub fn distrust(&self, fault: HeadFault) {
        self.fault.store(fault.into(), Relaxed);
    }

    pub fn fault(&self) -> Option<HeadFault> {
        HeadFault::from_code(self.fault.load(Relaxed))
    }

    /// How long it has had no request; `None` if it has one, or is on its way out.
    pub fn idle_for(&self) -> Option<Duration> {
        let is_busy = self.n_in_flight.load(Relaxed) > 0 || self.pace.is_waiting();
        (!is_busy && !self.is_evicted.load(Relaxed))
            .then(|| Duration::from_millis(self.now().saturating_sub(self.idle_since.load(Relaxed))))
    }

    /// Ends it at once, in favour of another.
    pub fn evict(&self) {
        self.is_evicted.store(true, Relaxed);
        self.noticed.notify_one();
    }

    /// Ends it after the answers under way.
    pub fn drain(&self) {
        self.is_draining.store(true, Relaxed);
        self.noticed.notify_one();
    }

    /// Resolves when it is to end: at once or after the answers under way.
    pub async fn notice(&self) -> Notice {
        self.noticed.notified().await;
        if self.is_evicted.load(Relaxed) { Notice::Evicted } else { Notice::Draining }
    }

    /// Resolves when it has had no request for `idle`, or its client owes more than `sending` as a reader.
    ///
    /// Looked at from time to time, one timer for each connection: what happens on it stays free of timers.
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
        self.0.stir();
        self.0.n_in_flight.fetch_sub(1, Relaxed);
        self.0.wait_if_all_are_unread();
        self.0.ended.wake();
    }
}
