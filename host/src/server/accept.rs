//! Acceptance of new connections, and eviction of old ones to make room.
//!
//! ROOM. A newcomer beyond the limit takes the place of the connection that has been without a request for
//! longest. HTTP allows a server to close such a connection at any time. So connections that are opened and
//! left idle keep nobody out.
//!
//! If all connections have requests, the server closes the one whose client has delayed its answers longest.
//! If all requests are being computed, the newcomer is refused at once (503).
//!
//! ALTERNATIVE. Accepting nobody while all places are taken would leave clients and probes in the backlog
//! without an answer, for as long as others please.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::to_bytes;
use axum::http::HeaderValue;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::{Id, JoinSet};

use super::activity::Activity;
use crate::problem::Problem;

/// Pause after a failure to accept, such as too many open files: it would fail again at once.
const BACK_OFF: Duration = Duration::from_millis(200);

/// Least time between two log lines about failures to accept.
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// Time that a client may owe as a reader ([`Activity::owed`]) and still keep its place.
const UNREAD: Duration = Duration::from_secs(2);

/// Most newcomers that are being refused at once. More are dropped without an answer.
const TURNED_AWAY_AT_ONCE: usize = 64;

/// Time for a refused newcomer to read the answer.
const TURNING_AWAY: Duration = Duration::from_secs(1);

/// Seconds after which a refused newcomer should try again.
const RETRY_AFTER_SECONDS: u64 = 1;

/// Accepts connections, and reports failures without filling the log.
#[derive(Default)]
pub struct Acceptor {
    n_failures: u64,
    last_log: Option<Instant>,
}

impl Acceptor {
    /// Waits for the next connection. Returns `None` after a failure and its pause.
    pub async fn accept(&mut self, listener: &TcpListener) -> Option<TcpStream> {
        loop {
            match listener.accept().await {
                Ok((socket, _)) => return Some(socket),
                // The client left before it was accepted.
                Err(error) if is_of_client(&error) => {}
                Err(error) => {
                    self.report(&error);
                    tokio::time::sleep(BACK_OFF).await;
                    return None;
                }
            }
        }
    }

    fn report(&mut self, error: &io::Error) {
        self.n_failures += 1;
        if self.last_log.is_none_or(|last| last.elapsed() >= LOG_INTERVAL) {
            self.last_log = Some(Instant::now());
            tracing::error!(%error, n_failures = self.n_failures, "cannot accept connections");
            self.n_failures = 0;
        }
    }
}

fn is_of_client(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset, Interrupted};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset | Interrupted)
}

/// The connections being served.
#[derive(Default)]
pub struct Connections {
    tasks: JoinSet<()>,
    activities: HashMap<Id, Arc<Activity>>,
}

impl Connections {
    pub fn len(&self) -> usize {
        self.activities.len()
    }

    pub fn add(&mut self, activity: Arc<Activity>, connection: impl Future<Output = ()> + Send + 'static) {
        let id = self.tasks.spawn(connection).id();
        self.activities.insert(id, activity);
    }

    /// Waits for the next connection to end. Never resolves if there is none.
    pub async fn ended(&mut self) {
        match self.tasks.join_next_with_id().await {
            Some(Ok((id, ()))) => self.activities.remove(&id),
            Some(Err(error)) => self.activities.remove(&error.id()),
            None => std::future::pending().await,
        };
    }

    /// Waits for all connections to end.
    pub async fn all_ended(&mut self) {
        while self.len() > 0 {
            self.ended().await;
        }
    }

    /// Ends the connection that has been without a request for longest, or else the one whose client owes
    /// most as a reader. Returns false if all connections have requests that are still being answered.
    pub async fn evict(&mut self) -> bool {
        let longest = |time: fn(&Activity) -> Option<Duration>| {
            let times = self.activities.values().filter_map(|activity| Some((time(activity)?, activity)));
            times.max_by_key(|(time, _)| *time)
        };
        let unread = || longest(Activity::owed).filter(|(owed, _)| *owed > UNREAD);
        let Some((_, activity)) = longest(Activity::idle_for).or_else(unread) else { return false };
        activity.evict();
        // The connection ends as soon as a thread polls it. A hanging one must not keep others out.
        let _ = tokio::time::timeout(Duration::from_secs(1), self.ended()).await;
        true
    }

    /// Lets each connection end after the answers under way.
    pub fn drain(&self) {
        self.activities.values().for_each(|activity| activity.drain());
    }

    /// Aborts all connections.
    pub async fn cut(&mut self) {
        self.tasks.shutdown().await;
        self.activities.clear();
    }
}

/// Refuses connections for which there is no room.
pub struct Door(Arc<Semaphore>);

impl Door {
    pub fn new() -> Self {
        Self(Arc::new(Semaphore::new(TURNED_AWAY_AT_ONCE)))
    }

    /// Answers 503 to any request and closes the connection, in a task of its own.
    pub fn turn_away(&self, socket: TcpStream) {
        let Ok(place) = self.0.clone().try_acquire_owned() else { return };
        tokio::spawn(async move {
            // A client that has left needs no answer.
            let _ = tokio::time::timeout(TURNING_AWAY, refuse(socket)).await;
            drop(place);
        });
    }
}

async fn refuse(mut socket: TcpStream) -> io::Result<()> {
    socket.write_all(&refusal().await).await?;
    socket.shutdown().await?;
    // Closing a socket with unread bytes would reset it, and take the answer away again.
    let mut scratch = [0; 4096];
    while socket.read(&mut scratch).await? > 0 {}
    Ok(())
}

/// Formats the problem as a complete HTTP answer. hyper takes no part, because no head of a request was read.
async fn refusal() -> Vec<u8> {
    let id = uuid::Uuid::now_v7().to_string();
    let problem =
        Problem::unavailable("all connections that the server takes are in use", RETRY_AFTER_SECONDS);
    let (mut parts, body) = problem.to_response(&id).into_parts();
    let body = to_bytes(body, usize::MAX).await.unwrap_or_default();
    let fixed =
        [("x-request-id", id), ("content-length", body.len().to_string()), ("connection", "close".into())];
    for (name, value) in fixed {
        if let Ok(value) = HeaderValue::try_from(value) {
            parts.headers.insert(name, value);
        }
    }
    let mut answer = format!("HTTP/1.1 {}\r\n", parts.status).into_bytes();
    for (name, value) in &parts.headers {
        answer.extend([name.as_str().as_bytes(), b": ", value.as_bytes(), b"\r\n"].concat());
    }
    answer.extend_from_slice(b"\r\n");
    answer.extend_from_slice(&body);
    answer
}
