//! Connections over real sockets, with answers that record when they are dropped.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::task::{Context, Poll};
use std::time::Instant;

use axum::body::Body;
use axum::routing::get;
use bytes::Bytes;
use http_body::{Body as HttpBody, Frame};
use http_body_util::BodyExt;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::*;

const SENDING: Duration = Duration::from_millis(400);

/// Waits until a condition holds. The limit is so long that only an event that never comes fails.
async fn eventually(what: &str, is_so: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < Duration::from_secs(20), "never: {what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Numbers of answers made and dropped.
#[derive(Default)]
struct Count {
    made: AtomicUsize,
    dropped: AtomicUsize,
}

/// An answer of `n` pieces, each after a pause.
struct WatchedBody {
    count: Arc<Count>,
    n: usize,
    piece: usize,
    pause: Duration,
    pausing: Option<Pin<Box<tokio::time::Sleep>>>,
}

impl WatchedBody {
    fn body(count: &Arc<Count>, n: usize, piece: usize, pause: Duration) -> Body {
        count.made.fetch_add(1, SeqCst);
        Body::new(Self { count: count.clone(), n, piece, pause, pausing: None })
    }
}

impl HttpBody for WatchedBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if self.n == 0 {
            return Poll::Ready(None);
        }
        let pause = self.pause;
        let pausing = self.pausing.get_or_insert_with(|| Box::pin(tokio::time::sleep(pause)));
        if !pause.is_zero() {
            std::task::ready!(pausing.as_mut().poll(cx));
        }
        self.pausing = None;
        self.n -= 1;
        Poll::Ready(Some(Ok(Frame::data(vec![b'x'; self.piece].into()))))
    }
}

impl Drop for WatchedBody {
    fn drop(&mut self) {
        self.count.dropped.fetch_add(1, SeqCst);
    }
}

async fn start(sending: Duration) -> (SocketAddr, Arc<Count>) {
    start_with_limit(sending, 100).await
}

/// Starts a server with answers of several kinds.
async fn start_with_limit(sending: Duration, limit: usize) -> (SocketAddr, Arc<Count>) {
    let count = Arc::new(Count::default());
    let [huge, small, paused, whole] = [(); 4].map(|()| count.clone());
    let none = Duration::ZERO;
    let router = Router::new()
        .route("/ok", get(|| async { "ok" }))
        .route("/huge", get(async move || WatchedBody::body(&huge, 4096, 64 << 10, none)))
        .route("/small", get(async move || WatchedBody::body(&small, 1, 1000, none)))
        .route("/paused", get(async move || WatchedBody::body(&paused, 4, 100, 2 * SENDING)))
        .route("/whole", get(async move || WatchedBody::body(&whole, 1, 8 << 20, none)));
    let timeouts = ConnectionTimeouts { idle: Duration::from_secs(30), sending };
    let listening = Listening { router, tls: None, timeouts, limit };
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move { listening.until(listener, std::future::pending()).await });
    (address, count)
}

async fn ask(address: SocketAddr, path: &str, version: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let head = format!("GET {path} HTTP/{version}\r\nHost: x\r\nConnection: close\r\n\r\n");
    stream.write_all(head.as_bytes()).await.unwrap();
    stream
}

#[tokio::test]
async fn an_answer_that_is_never_read_is_let_go_and_ends_in_a_reset() {
    let (address, count) = start(SENDING).await;
    for (n_before, version) in ["1.1", "1.0"].into_iter().enumerate() {
        let mut stream = ask(address, "/huge", version).await;
        eventually("made", || count.made.load(SeqCst) > n_before).await;
        eventually("dropped", || count.dropped.load(SeqCst) > n_before).await;
        // An orderly end would make the received part look complete in HTTP/1.0.
        let mut received = Vec::new();
        assert!(stream.read_to_end(&mut received).await.is_err(), "HTTP/{version}: {} bytes", received.len());
    }
}

#[tokio::test]
async fn a_slow_reader_is_served_to_the_end() {
    let (address, _) = start(SENDING).await;
    let mut stream = ask(address, "/whole", "1.1").await;
    let began = Instant::now();
    let (mut n_received, mut buffer) = (0, vec![0; 128 << 10]);
    loop {
        let n = stream.read(&mut buffer).await.unwrap();
        n_received += n;
        if n == 0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(n_received > 8 << 20);
    assert!(began.elapsed() > 2 * SENDING, "it was not slow: {:?}", began.elapsed());
}

#[tokio::test]
async fn time_that_an_answer_takes_to_come_about_is_not_the_readers() {
    let (address, count) = start(SENDING).await;
    let mut text = String::new();
    ask(address, "/paused", "1.1").await.read_to_string(&mut text).await.unwrap();
    assert!(text.ends_with("0\r\n\r\n") && text.contains("xxx"), "{text}");
    let (mut client, _) = http_2(address, 1 << 20).await;
    let answer = client.send_request(request(address, "/paused"), true).unwrap().0.await.unwrap();
    let mut body = answer.into_body();
    let mut n_received = 0;
    while let Some(data) = body.data().await {
        n_received += data.unwrap().len();
    }
    assert_eq!((n_received, count.dropped.load(SeqCst)), (400, 2));
}

type Client = h2::client::SendRequest<Bytes>;

/// Connects a client of HTTP/2 whose window for each answer is `window` bytes.
async fn http_2(
    address: SocketAddr,
    window: u32,
) -> (Client, tokio::task::JoinHandle<Result<(), h2::Error>>) {
    let stream = TcpStream::connect(address).await.unwrap();
    let mut builder = h2::client::Builder::new();
    let (client, connection) = builder.initial_window_size(window).handshake(stream).await.unwrap();
    let connection = tokio::spawn(connection);
    (client.ready().await.unwrap(), connection)
}

fn request(address: SocketAddr, path: &str) -> hyper::Request<()> {
    hyper::Request::get(format!("http://{address}{path}")).body(()).unwrap()
}

#[tokio::test]
async fn a_stream_that_leaves_no_room_is_reset_and_the_others_go_on() {
    for (window, path) in [(0, "/huge"), (0, "/small"), (1, "/small"), (999, "/small"), (70_000, "/huge")] {
        let (address, count) = start(SENDING).await;
        let (mut client, _connection) = http_2(address, window).await;
        let answer = client.send_request(request(address, path), true).unwrap().0.await.unwrap();
        eventually("dropped", || count.dropped.load(SeqCst) == 1).await;
        let mut body = answer.into_body();
        let outcome = loop {
            match body.data().await.unwrap() {
                Ok(_) => {}
                Err(error) => break error,
            }
        };
        assert_eq!(outcome.reason(), Some(h2::Reason::CANCEL), "{window} {path}: {outcome}");
        let mut other = client.ready().await.unwrap();
        let answer = other.send_request(request(address, "/ok"), true).unwrap().0.await.unwrap();
        assert_eq!(answer.status(), 200);
    }
}

#[tokio::test]
async fn who_reads_nothing_of_what_it_asks_for_again_and_again_gives_way_to_a_newcomer() {
    // No stream is unread for long enough to be reset.
    let (address, _) = start_with_limit(Duration::from_secs(600), 3).await;
    let mut clients = Vec::new();
    for _ in 0..3 {
        clients.push(http_2(address, 0).await);
    }
    let mut unread = Vec::new();
    let began = Instant::now();
    loop {
        for (client, _) in &mut clients {
            // An evicted client asks no more.
            let Ok(mut ready) = client.clone().ready().await else { continue };
            let Ok((answer, _)) = ready.send_request(request(address, "/small"), true) else { continue };
            let Ok(answer) = answer.await else { continue };
            unread.push(answer);
            if unread.len() > 6 {
                unread.remove(0);
            }
        }
        let mut newcomer = ask(address, "/ok", "1.1").await;
        let mut received = String::new();
        newcomer.read_to_string(&mut received).await.ok();
        if received.starts_with("HTTP/1.1 200") {
            break;
        }
        assert!(received.is_empty() || received.starts_with("HTTP/1.1 503"), "{received}");
        assert!(began.elapsed() < Duration::from_secs(20), "nobody gives way");
    }
}

#[tokio::test]
async fn a_client_of_http_2_that_reads_gets_all_of_it() {
    let (address, count) = start(SENDING).await;
    // The first window equals the answer to the byte: nothing waits for room that is never needed.
    for (window, path, expected) in [(1000, "/small", 1000), (65_535, "/whole", 8 << 20)] {
        let (mut client, _connection) = http_2(address, window).await;
        let answer = client.send_request(request(address, path), true).unwrap().0.await.unwrap();
        let mut body = answer.into_body();
        let mut n_received = 0;
        while let Some(data) = body.data().await {
            n_received += data.unwrap().len();
            if window < expected {
                body.flow_control().release_capacity(n_received.min(window as usize)).ok();
            }
        }
        assert_eq!(n_received, expected as usize, "{path}");
    }
    assert_eq!(count.dropped.load(SeqCst), 2);
}

#[tokio::test]
async fn pieces_still_to_be_sent_do_not_keep_a_whole_answer() {
    struct Owner(Vec<u8>, Arc<Count>);
    impl AsRef<[u8]> for Owner {
        fn as_ref(&self) -> &[u8] {
            &self.0
        }
    }
    impl Drop for Owner {
        fn drop(&mut self) {
            self.1.dropped.fetch_add(1, SeqCst);
        }
    }
    let count = Arc::new(Count::default());
    for pace in [None, Some(Arc::new(pace::Pace::new()))] {
        let frame: Vec<u8> = (0..3_000_001).map(|i| (i % 251) as u8).collect();
        let owned = Bytes::from_owner(Owner(frame.clone(), count.clone()));
        let mut body = body::Sending::new(Body::from(owned), Activity::new().enter(), pace, true, None);
        assert_eq!(body.size_hint().exact(), Some(frame.len() as u64));
        let (mut unsent, mut received) = (std::collections::VecDeque::new(), Vec::new());
        let before = count.dropped.load(SeqCst);
        while let Some(piece) = body.frame().await {
            let piece = piece.unwrap().into_data().unwrap();
            received.extend_from_slice(&piece);
            unsent.push_back(piece);
            // The queue stands for the bytes that hyper has not sent yet, in any buffer.
            while unsent.iter().map(Bytes::len).sum::<usize>() > 192 << 10 {
                unsent.pop_front();
            }
        }
        drop(body);
        assert!(received == frame);
        assert!(!unsent.is_empty());
        assert_eq!(count.dropped.load(SeqCst), before + 1);
    }
}
