//! A single connection, from its first byte to its last.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use hyper::body::{Body as _, Incoming};
use hyper::header::{CONNECTION, CONTENT_LENGTH, HeaderValue};
use hyper::rt::Executor;
use hyper::service::service_fn;
use hyper::{Method, Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use socket2::SockRef;
use tokio::net::TcpStream;
use tower::ServiceExt;

use super::activity::{Activity, Expiry, InFlight, Notice};
use super::body::{Receiving, Sending};
use super::pace::Pace;
use super::socket::{Socket, Wire};
use super::tls::Tls;
use crate::around::transport::Arrival;

/// Bytes of a head of HTTP/1, and of data read ahead or not yet sent. A larger head is answered 431. hyper
/// takes 100 headers at most.
const BUFFER: usize = 64 << 10;

/// Bytes of a head of HTTP/2.
const HTTP_2_HEAD: u32 = 16 << 10;

/// Bytes of an answer that a stream of HTTP/2 holds beyond those its client has room for.
const SEND_BUFFER: usize = 32 << 10;

/// Concurrent requests on a connection of HTTP/2.
const STREAMS: u32 = 64;

/// Bytes that a client of HTTP/2 may send before a handler reads them: for one request, and for all of its
/// connection.
const STREAM_WINDOW: u32 = 256 << 10;
const CONNECTION_WINDOW: u32 = 512 << 10;

/// Limits on reset streams: those the client has reset and the server has not looked at yet, and those the
/// server had to reset. Beyond them the connection is ended (CVE-2023-44487, CVE-2025-8671).
const PENDING_RESETS: usize = 16;
const LOCAL_RESETS: usize = 64;

/// Ping of HTTP/2. A client that does not answer in time is gone.
const PING_INTERVAL: Duration = Duration::from_secs(20);
const PING_TIMEOUT: Duration = Duration::from_secs(10);

/// Time for a client whose connection ends to take its last frames, or to close its side.
const LEAVE: Duration = Duration::from_secs(1);

/// Bytes of each connection's answers that the kernel takes, half of what it then reserves.
///
/// Without this limit the kernel's buffers grow to megabytes. A slow reader then makes no room for so long
/// that it looks like one that does not read. Many such readers hold memory that nothing counts. The limit
/// bounds the speed of one answer to 512 KiB per round trip.
const SOCKET_BUFFER: usize = 256 << 10;

/// Time limits for clients.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionTimeouts {
    /// Time without a request: between two, or until the head of one is complete.
    pub idle: Duration,
    /// Reading of an answer, beyond the time that its bytes take at [`super::pace::LEAST_RATE`].
    pub sending: Duration,
}

tokio::task_local! {
    /// Pace of the client on the HTTP/2 stream that this task serves.
    static STREAM: Arc<Pace>;
}

/// Serves a connection until it ends or expires ([`Activity::expired`]). When the server drains, the
/// connection ends after the answers under way.
pub async fn serve(
    socket: TcpStream,
    tls: Option<Arc<Tls>>,
    router: Router,
    timeouts: ConnectionTimeouts,
    activity: Arc<Activity>,
) {
    // Both fail if the client has gone already. Set on the listener, the buffer size would miss connections
    // that came before.
    let _ = socket.set_nodelay(true);
    let _ = SockRef::from(&socket).set_send_buffer_size(SOCKET_BUFFER);
    let Some(socket) = shaken(socket, tls, timeouts, &activity).await else { return };
    let exchanges = activity.clone();
    // The request is under way from here on, before the connection is read any further.
    let service = service_fn(move |request| exchange(request, router.clone(), exchanges.enter()));
    let io = TokioIo::new(Socket::new(socket, activity.clone()));
    let builder = builder(timeouts.sending);
    let mut connection = std::pin::pin!(builder.serve_connection(io, service));
    let mut expired = std::pin::pin!(activity.expired(timeouts.idle, timeouts.sending));
    let expiry = loop {
        tokio::select! {
            outcome = connection.as_mut() => {
                if let Err(error) = outcome {
                    tracing::debug!(%error, "connection ended");
                }
                return;
            }
            expiry = expired.as_mut() => break expiry,
            notice = activity.notice() => match notice {
                Notice::Evicted => return,
                Notice::Draining => connection.as_mut().graceful_shutdown(),
            },
        }
    };
    tracing::debug!(?expiry, "connection is ended");
    if expiry == Expiry::Idle {
        connection.as_mut().graceful_shutdown();
        // A client that does not answer gets no farewell.
        let _ = tokio::time::timeout(LEAVE, connection).await;
    }
}

/// Returns the stream of a new connection, after the handshake if there is TLS. The handshake may take as
/// long as a head, and gives way when another connection needs the place.
async fn shaken(
    socket: TcpStream,
    tls: Option<Arc<Tls>>,
    timeouts: ConnectionTimeouts,
    activity: &Activity,
) -> Option<Wire> {
    let Some(tls) = tls else { return Some(Wire::Plain(socket)) };
    tokio::select! {
        outcome = tls.accept(socket) => match outcome {
            Ok(stream) => Some(Wire::Tls(Box::new(stream))),
            Err(error) => {
                tracing::debug!(%error, "no handshake");
                None
            }
        },
        _ = activity.expired(timeouts.idle, timeouts.sending) => None,
        _ = activity.notice() => None,
    }
}

/// Configures hyper. Its timer for heads is not used: [`Activity::expired`] ends an incomplete head like any
/// other idle connection. That also works before the HTTP version is known, and needs no timer per request.
fn builder(sending: Duration) -> auto::Builder<Streams> {
    let mut builder = auto::Builder::new(Streams { sending });
    builder.http1().max_buf_size(BUFFER);
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(PING_INTERVAL)
        .keep_alive_timeout(PING_TIMEOUT)
        .max_header_list_size(HTTP_2_HEAD)
        .max_concurrent_streams(STREAMS)
        .initial_stream_window_size(STREAM_WINDOW)
        .initial_connection_window_size(CONNECTION_WINDOW)
        .max_send_buf_size(SEND_BUFFER)
        .max_pending_accept_reset_streams(PENDING_RESETS)
        .max_local_error_reset_streams(LOCAL_RESETS);
    builder
}

/// Serves one request.
async fn exchange(
    request: Request<Incoming>,
    router: Router,
    in_flight: InFlight,
) -> Result<Response<Sending<Body>>, Infallible> {
    let arrival = Arrival::new(in_flight.activity().fault());
    if request.body().is_end_stream() {
        arrival.set_read();
    }
    let has_length = request.body().size_hint().exact().is_some();
    let is_sent = request.method() != Method::HEAD;
    let received = arrival.clone();
    let mut request = request.map(|body| Body::new(Receiving { body, arrival: received }));
    request.extensions_mut().insert(arrival.clone());
    let mut response = router.oneshot(request).await?;
    let pace = STREAM.try_with(Arc::clone).ok();
    if pace.is_none() && !arrival.is_read() {
        let activity = in_flight.activity();
        activity.note_early_answer();
        // hyper closes the connection unless it can read the body to its end in one step. The client must
        // then not send another request. Chunks take a step each. A body of known length takes one step if
        // all of it was received.
        if !(has_length && activity.has_whole_requests()) {
            response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
        }
    }
    let length = response.headers().get(CONTENT_LENGTH);
    let n_announced = length.and_then(|length| length.to_str().ok()?.parse().ok());
    Ok(response.map(|body| Sending::new(body, in_flight, pace, is_sent, n_announced)))
}

/// Runs HTTP/2 streams, each for as long as its client takes its answer. The end of the task resets the
/// stream and frees handler and body, even if the client leaves no room to send. Other streams go on.
#[derive(Clone)]
struct Streams {
    sending: Duration,
}

impl<F: Future<Output: Send> + Send + 'static> Executor<F> for Streams {
    fn execute(&self, stream: F) {
        let (pace, allowed) = (Arc::new(Pace::new()), self.sending);
        let watched = pace.clone();
        tokio::spawn(STREAM.scope(pace, async move {
            tokio::select! {
                _ = stream => {}
                () = watched.is_overdue(allowed) => tracing::debug!("stream is reset, its answer is not read"),
            }
        }));
    }
}
