//! Connections: timeouts, limits, refusals before any handler runs, and hostile clients.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::all_routes::route_of;
use crate::document::contract::{self, AnswerParts};
use crate::support::{Server, fibonacci_sphere, pause};

/// Timeout of a wait. Longer than anything here should take, even on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(20);

async fn connect(server: &Server) -> TcpStream {
    TcpStream::connect(server.address).await.unwrap()
}

/// Opens a connection and sends `bytes`.
async fn sent(server: &Server, bytes: impl AsRef<[u8]>) -> TcpStream {
    let mut stream = connect(server).await;
    stream.write_all(bytes.as_ref()).await.unwrap();
    stream
}

/// Reads until the server ends the connection, by close or reset.
async fn rest_of(stream: &mut TcpStream) -> String {
    let mut received = Vec::new();
    let read = async { while stream.read_buf(&mut received).await.is_ok_and(|n| n > 0) {} };
    tokio::time::timeout(TIMEOUT, read).await.expect("the connection stays open");
    String::from_utf8_lossy(&received).into_owned()
}

/// Reads one answer of known length. The connection stays open.
async fn answer(stream: &mut TcpStream) -> AnswerParts {
    let mut received = String::new();
    let read = async {
        let mut byte = [0];
        while !received.ends_with("\r\n\r\n") {
            stream.read_exact(&mut byte).await.unwrap();
            received.push(byte[0].into());
        }
        let length = AnswerParts::parse(&received).header("content-length").parse().unwrap_or(0);
        let mut body = vec![0; length];
        stream.read_exact(&mut body).await.unwrap();
        received.push_str(str::from_utf8(&body).unwrap());
    };
    tokio::time::timeout(TIMEOUT, read).await.expect("no answer");
    AnswerParts::parse(&received)
}

/// Returns status and type of the problem in an answer. Checks that the answer announces the end of its
/// connection.
fn closing_problem(method: &str, path: &str, text: &str) -> (u16, String) {
    let answer = AnswerParts::parse(text);
    contract::check(method, path, &answer);
    assert_eq!(answer.header("connection"), "close", "{text}");
    (answer.status, answer.json().unwrap()["type"].as_str().unwrap().to_owned())
}

const LIVE: &str = "GET /health/live HTTP/1.1\r\nHost: x\r\n\r\n";

const MALFORMED: (u16, &str) = (400, "/problems/malformed-request");

fn same(found: &(u16, String), expected: (u16, &str), what: &str) {
    assert_eq!((found.0, &*found.1), expected, "{what}");
}

/// Returns a request whose answer of 3 MB exceeds every socket buffer.
fn large_request() -> String {
    let points = fibonacci_sphere(400);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let body = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6}).to_string();
    format!(
        "POST /v1/laplace-beltrami/matrix HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_of_a_known_length_end_in_order() {
    let server = Server::start().await;
    let cloud =
        json!({"cloud": {"points": fibonacci_sphere(300)}, "kernel": {"family": "gauss"}, "alpha": 1e-3});
    let body = cloud.to_string();
    // An answer of a few hundred bytes, and one larger than the socket's buffer.
    for (path, least) in [("/v1/normals", 1000), ("/v1/laplace-beltrami/matrix", 700_000)] {
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Type: application/json\r\n\
             Accept: application/x-safetensors\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        let mut stream = sent(&server, head + &body).await;
        stream.readable().await.unwrap();
        let mut received = Vec::new();
        // A reset would be an error here, and would have discarded unread bytes.
        let read = stream.read_to_end(&mut received);
        tokio::time::timeout(TIMEOUT, read).await.expect("the connection stays open").unwrap();
        let head = received.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap() + 4;
        let answer = AnswerParts::parse(str::from_utf8(&received[..head]).unwrap());
        assert_eq!(received.len() - head, answer.header("content-length").parse::<usize>().unwrap());
        assert!(received.len() > least, "{}", received.len());
    }
}

#[tokio::test]
async fn connections_without_a_request_are_ended() {
    let server = Server::with_flags(&["--idle-seconds", "0.4"]).await;
    for half in [
        "",
        "G",
        "GET /health/live HTTP/1.1\r\nHost: x\r\n",
        "PRI * HTTP/2.0\r\n",
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ] {
        let began = Instant::now();
        let mut stream = sent(&server, half).await;
        let received = rest_of(&mut stream).await;
        assert!(!received.contains("200"), "{half:?}: {received}");
        assert!(began.elapsed() >= Duration::from_millis(390), "{half:?} was ended early");
    }
    // The idle time starts again with each answer.
    let mut stream = connect(&server).await;
    for _ in 0..4 {
        stream.write_all(LIVE.as_bytes()).await.unwrap();
        assert_eq!(answer(&mut stream).await.status, 200);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    assert_eq!(rest_of(&mut stream).await, "");
}

#[tokio::test]
async fn a_head_that_comes_byte_by_byte_is_not_waited_for() {
    let server = Server::with_flags(&["--idle-seconds", "0.4"]).await;
    let mut stream = connect(&server).await;
    let began = Instant::now();
    for byte in format!("GET /health/live HTTP/1.1\r\nHost: x\r\nX: {}", "y".repeat(60_000)).bytes() {
        if stream.write_all(&[byte]).await.is_err() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        assert!(began.elapsed() < TIMEOUT, "it is still waited for");
    }
}

#[tokio::test]
async fn a_connection_of_http_2_that_only_answers_pings_is_ended() {
    let server = Server::with_flags(&["--idle-seconds", "0.4"]).await;
    let (client, connection) = http_2(server.address).await;
    let mut client = client.ready().await.unwrap();
    let request = hyper_request(server.address, "/health/live");
    assert_eq!(client.send_request(request, true).unwrap().0.await.unwrap().status(), 200);
    // `client` keeps the connection open. It sends no requests, but answers every ping.
    tokio::time::timeout(TIMEOUT, connection).await.expect("it stays open").unwrap().ok();
    drop(client);
}

pub async fn http_2(
    address: SocketAddr,
) -> (h2::client::SendRequest<bytes::Bytes>, tokio::task::JoinHandle<Result<(), h2::Error>>) {
    let stream = TcpStream::connect(address).await.unwrap();
    let (client, connection) = h2::client::handshake(stream).await.unwrap();
    (client, tokio::spawn(connection))
}

fn hyper_request(address: SocketAddr, path: &str) -> axum::http::Request<()> {
    axum::http::Request::get(format!("http://{address}{path}")).body(()).unwrap()
}

#[tokio::test]
async fn answers_that_are_not_read_are_cut() {
    let server = Server::with_flags(&["--send-seconds", "0.5"]).await;
    // Once, and a hundred times on one connection: the first answers fill the socket, and the others never
    // begin.
    for requests in [
        large_request(),
        large_request().repeat(100),
        "GET /openapi.json HTTP/1.1\r\nHost: x\r\n\r\n".repeat(100),
    ] {
        let mut stream = sent(&server, &requests).await;
        let mut beginning = [0; 12];
        stream.read_exact(&mut beginning).await.unwrap();
        assert_eq!(&beginning, b"HTTP/1.1 200");
        let began = Instant::now();
        // A reset connection is noticed without reading from it.
        while stream.take_error().unwrap().is_none() {
            assert!(began.elapsed() < TIMEOUT, "it is not cut: {:.60} {}", requests, requests.len());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let received = rest_of(&mut stream).await;
        assert!(!received.ends_with("\r\n0\r\n\r\n"), "it is complete");
        assert!(received.matches("HTTP/1.1 200").count() < 20);
        server.get("/health/ready").await.expect_ok();
    }
    // A client that reads receives the same answer whole, however long it takes.
    let mut stream = sent(&server, large_request().replace("Host: x", "Host: x\r\nConnection: close")).await;
    let mut received = Vec::new();
    while stream.read_buf(&mut received).await.unwrap() > 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    assert!(received.len() > 2_000_000 && received.ends_with(b"\r\n0\r\n\r\n"), "{} bytes", received.len());
}

#[tokio::test]
async fn idle_connections_make_room_for_newcomers() {
    let server = Server::with_flags(&["--max-connections", "20"]).await;
    let mut idle = Vec::new();
    for i in 0..200 {
        idle.push(sent(&server, if i % 2 == 0 { "" } else { "GET / HT" }).await);
        if i % 20 == 0 {
            // A client that has just connected, and keeps its connection.
            server.get("/health/live").await.expect_ok();
        }
    }
    let mut n_open = 0;
    for mut stream in idle {
        let mut byte = [0];
        let closed = tokio::time::timeout(Duration::from_millis(20), stream.read(&mut byte)).await;
        n_open += usize::from(closed.is_err());
    }
    assert!((1..=20).contains(&n_open), "{n_open}");
}

#[tokio::test]
async fn newcomers_are_told_if_every_connection_has_a_request() {
    let server = Server::with_flags(&["--max-connections", "3"]).await;
    let half = "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{";
    let mut busy = Vec::new();
    for _ in 0..3 {
        let mut stream = connect(&server).await;
        // The answer shows that the connection is served, before it sends a request that never ends.
        stream.write_all(LIVE.as_bytes()).await.unwrap();
        assert_eq!(answer(&mut stream).await.status, 200);
        stream.write_all(half.as_bytes()).await.unwrap();
        busy.push(stream);
    }
    let began = Instant::now();
    loop {
        let mut newcomer = sent(&server, LIVE).await;
        let text = rest_of(&mut newcomer).await;
        if text.is_empty() || text.starts_with("HTTP/1.1 200") {
            // The server had not yet read from one of the three, so that one had to make room.
            assert!(began.elapsed() < TIMEOUT);
            continue;
        }
        same(&closing_problem("GET", "/health/live", &text), (503, "/problems/overloaded"), &text);
        assert_eq!(AnswerParts::parse(&text).header("retry-after"), "1");
        break;
    }
    drop(busy);
    let began = Instant::now();
    while !rest_of(&mut sent(&server, LIVE.replace("Host", "Connection: close\r\nHost")).await)
        .await
        .contains(" 200 ")
    {
        assert!(began.elapsed() < TIMEOUT, "the places are not given back");
    }
}

#[tokio::test]
async fn heads_that_two_programs_may_read_differently_are_refused() {
    let server = Server::start().await;
    let chunks = "\r\n2\r\n{}\r\n0\r\n\r\n";
    for (method, path, rest) in [
        (
            "POST",
            "/v1/clouds",
            format!("Host: x\r\nContent-Length: 12\r\nTransfer-Encoding: chunked\r\n{chunks}"),
        ),
        (
            "POST",
            "/v1/clouds",
            format!("Host: x\r\nTransfer-Encoding: chunked\r\ncontent-length: 12\r\n{chunks}"),
        ),
        ("POST", "/v1/clouds", format!("Host: x\r\nTransfer-Encoding: gzip, chunked\r\n{chunks}")),
        ("POST", "/v1/clouds", "Host: x\r\nContent-Length: 2\r\nContent-Length: 2\r\n\r\n{}".to_owned()),
        ("GET", "/health/live", "Host: x\nX: y\r\n\r\n".to_owned()),
        ("GET", "/health/live", "\r\n".to_owned()),
        ("GET", "/health/live", "Host: x\r\nHost: x\r\n\r\n".to_owned()),
        ("GET", "/health/live", "Host: x y\r\n\r\n".to_owned()),
        ("GET", "/health/live", "Host: me:pw@x\r\n\r\n".to_owned()),
        ("GET", "/health/live", "Host: x\r\nExpect: 200-ok\r\n\r\n".to_owned()),
        (
            "GET",
            "/v1/kernels",
            "Host: x\r\nAuthorization: Bearer a\r\nAuthorization: Bearer a\r\n\r\n".to_owned(),
        ),
    ] {
        let request = format!("{method} {path} HTTP/1.1\r\n{rest}");
        // Also after well-formed requests with bodies of every framing, sent at once and one by one.
        let before = [
            String::new(),
            LIVE.repeat(2),
            "POST /v1/clouds HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\n{}".to_owned(),
            // Chunks left unread would end the connection.
            format!(
                "POST /v1/clouds HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n{chunks}"
            ),
        ];
        for before in before {
            let mut stream = connect(&server).await;
            if !before.is_empty() {
                stream.write_all(before.as_bytes()).await.unwrap();
                for _ in 0..before.matches(" HTTP/1.1").count() {
                    assert!([200, 415, 422].contains(&answer(&mut stream).await.status));
                }
            }
            // The bytes after the refused head must not be read as a request.
            stream.write_all(format!("{request}{LIVE}").as_bytes()).await.unwrap();
            let text = rest_of(&mut stream).await;
            assert_eq!(text.matches("HTTP/1.1 ").count(), 1, "{request}: {text}");
            same(&closing_problem(method, path, &text), MALFORMED, &request);
        }
    }
    for (user, host) in [("", "other".to_owned()), ("me:pw@", server.address.to_string())] {
        let address = server.address;
        let absolute = format!("GET http://{user}{address}/health/live HTTP/1.1\r\nHost: {host}\r\n\r\n");
        let text = rest_of(&mut sent(&server, &absolute).await).await;
        same(&closing_problem("GET", "/health/live", &text), MALFORMED, &absolute);
    }
    // In HTTP/2 the target names the host, and a malformed request ends only its own stream.
    let (client, connection) = http_2(server.address).await;
    let mut client = client.ready().await.unwrap();
    let request = axum::http::Request::get(format!("http://me:pw@{}/health/live", server.address));
    let refused = client.send_request(request.body(()).unwrap(), true).unwrap().0.await.unwrap();
    assert_eq!(refused.status(), 400);
    connection.abort();
    // HTTP/1.0 has no Host header.
    let text = rest_of(&mut sent(&server, "GET /health/live HTTP/1.0\r\n\r\n").await).await;
    assert!(text.contains(" 200 "), "{text}");
}

#[tokio::test]
async fn chunked_requests_keep_their_connection() {
    let server = Server::start().await;
    let route = route_of("/v1/normals");
    let body = route.request().to_string();
    let (first, second) = body.split_at(body.len() / 2);
    let head = format!("POST {} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n", route.path);
    let chunked = format!(
        "{head}Transfer-Encoding: chunked\r\n\r\n{:x}\r\n{first}\r\n{:X};a=b\r\n{second}\r\n0\r\n\r\n",
        first.len(),
        second.len()
    );
    let mut stream = connect(&server).await;
    for _ in 0..3 {
        stream.write_all(chunked.as_bytes()).await.unwrap();
        let answer = answer(&mut stream).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
    }
}

#[tokio::test]
async fn heads_beyond_the_limits_are_refused() {
    let server = Server::start().await;
    let many: String = (0..101).map(|i| format!("X-{i}: y\r\n")).collect();
    for (fields, status) in [
        (many, 431),
        (format!("X: {}\r\n", "y".repeat(70_000)), 431),
        (format!("X: {}\r\n", "y".repeat(30_000)), 200),
    ] {
        let request = format!("GET /health/live HTTP/1.1\r\nHost: x\r\nConnection: close\r\n{fields}\r\n");
        let text = rest_of(&mut sent(&server, request).await).await;
        assert!(text.starts_with(&format!("HTTP/1.1 {status} ")), "{text}");
    }
}

#[tokio::test]
async fn an_answer_that_comes_before_the_request_has_ended_arrives() {
    let server = Server::with_flags(&["--api-keys", "alpha-key"]).await;
    let n_bytes = 8 << 20;
    let head = format!(
        "POST /v1/clouds HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {n_bytes}\r\n\r\n"
    );
    let mut stream = sent(&server, head).await;
    // This client reads only after it has sent everything.
    let chunk = vec![b' '; 1 << 16];
    for _ in 0..n_bytes / chunk.len() {
        stream.write_all(&chunk).await.expect("the connection was reset before the answer could be read");
    }
    let text = rest_of(&mut stream).await;
    assert!(text.starts_with("HTTP/1.1 401 "), "{text}");
}

#[tokio::test]
async fn a_body_that_is_announced_as_too_large_is_refused_before_it_is_read() {
    let server = Server::with_flags(&["--max-body-bytes", "100000", "--body-seconds", "3600"]).await;
    for expectation in ["", "Expect: 100-continue\r\n"] {
        for path in ["/v1/clouds", "/v1/normals", "/v1/estimate"] {
            let head = format!(
                "POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n{expectation}Content-Length: 1000000000\r\n\r\n"
            );
            // The body does not follow: this client waits for the answer first.
            let mut stream = sent(&server, head).await;
            let refused = answer(&mut stream).await;
            assert_eq!(refused.status, 413, "{path}");
            // Without this header, a client that reuses connections would send its next request into one that
            // is ending.
            assert_eq!(refused.headers["connection"], "close");
            contract::check("POST", path, &refused);
        }
    }
    // A client that slowly sends everything before it reads still receives its answer.
    let (n_bytes, chunk) = (4 << 20, vec![b' '; 1 << 16]);
    let head = format!(
        "POST /v1/clouds HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {n_bytes}\r\n\r\n"
    );
    let mut stream = sent(&server, head).await;
    for _ in 0..n_bytes / chunk.len() {
        stream.write_all(&chunk).await.expect("the connection was reset before the answer could be read");
        tokio::task::yield_now().await;
    }
    let text = rest_of(&mut stream).await;
    assert!(text.starts_with("HTTP/1.1 413 "), "{text}");
}

#[tokio::test]
async fn an_answer_before_its_body_is_read_ends_the_connection_only_if_it_says_so() {
    let server = Server::start().await;
    // No request has a media type of the service, so the head is enough to refuse it.
    let head = "POST /v1/clouds HTTP/1.1\r\nHost: x\r\nContent-Type: text/plain\r\n";
    let spaces = " ".repeat(3000);
    let known = format!("{head}Content-Length: 3000\r\n\r\n");
    let chunk = format!("bb8\r\n{spaces}\r\n");
    let chunked = |n: usize| format!("{head}Transfer-Encoding: chunked\r\n\r\n{}0\r\n\r\n", chunk.repeat(n));
    for (request, may_go_on) in [
        (format!("{known}{spaces}"), true),
        (known.clone(), false),
        (format!("{known}{}", &spaces[..1000]), false),
        (chunked(1), false),
        (chunked(2), false),
        (chunked(50), false),
    ] {
        for _ in 0..20 {
            let mut stream = sent(&server, &request).await;
            let refused = answer(&mut stream).await;
            assert_eq!(refused.status, 415);
            let ends = refused.headers.get("connection").is_some_and(|value| value == "close");
            assert!(ends || may_go_on, "{request}");
            if !ends {
                stream.write_all(LIVE.as_bytes()).await.unwrap();
                assert_eq!(answer(&mut stream).await.status, 200);
            }
        }
    }
}

/// Sends a request and closes the sending side right after it.
async fn half_closed(server: &Server, request: &str) -> TcpStream {
    let mut stream = sent(server, request).await;
    stream.shutdown().await.unwrap();
    stream
}

#[tokio::test]
async fn a_client_that_only_sends_no_more_gets_its_answers() {
    let server = Server::start().await;
    let body = route_of("/v1/normals").request().to_string();
    let normals = format!(
        "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    for (request, n_answers) in
        [(LIVE.to_owned(), 1), (LIVE.repeat(3), 3), (normals.clone(), 1), (format!("{normals}{LIVE}"), 2)]
    {
        for _ in 0..20 {
            let text = rest_of(&mut half_closed(&server, &request).await).await;
            assert_eq!(text.matches("HTTP/1.1 200 OK\r\n").count(), n_answers, "{request}: {text}");
        }
    }
    // An answer of megabytes is sent for as long as the client keeps reading.
    let text = rest_of(&mut half_closed(&server, &large_request()).await).await;
    assert!(text.starts_with("HTTP/1.1 200 ") && text.len() > 1 << 20, "{} bytes", text.len());
    // Half a body is not a request.
    let half = &normals[..normals.len() - 10];
    let text = rest_of(&mut half_closed(&server, half).await).await;
    assert!(!text.contains(" 200 "), "{text}");
}

/// Half-closing may mean that the client has left, so long computations stop.
#[tokio::test]
async fn long_work_ends_with_a_client_that_may_have_left() {
    let server = Server::start().await;
    let points: Vec<_> =
        (0..9000).map(|i| [f64::from(i).sin(), f64::from(i).cos(), f64::from(i) * 1e-3]).collect();
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let body = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-3}).to_string();
    let request = format!(
        "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    let is_busy = async || {
        let text = server.get("/metrics").await.text;
        text.lines().any(|line| line.starts_with("gramian_http_requests_in_flight") && !line.ends_with(" 1"))
    };
    let mut stream = half_closed(&server, &request).await;
    let began = Instant::now();
    let text = rest_of(&mut stream).await;
    assert!(text.is_empty(), "{text}");
    while is_busy().await {
        assert!(began.elapsed() < TIMEOUT, "the work goes on");
        pause().await;
    }
}

#[tokio::test]
async fn a_client_that_opens_and_resets_streams_is_shown_out() {
    let server = Server::start().await;
    let (client, connection) = http_2(server.address).await;
    let mut client = client.ready().await.unwrap();
    for _ in 0..100_000 {
        let Ok((answer, mut stream)) =
            client.send_request(hyper_request(server.address, "/openapi.json"), false)
        else {
            break;
        };
        stream.send_reset(h2::Reason::CANCEL);
        drop(answer);
        match tokio::time::timeout(TIMEOUT, client.ready()).await.expect("it hangs") {
            Ok(ready) => client = ready,
            Err(_) => break,
        }
    }
    // Whether the client is disconnected or served, other clients are served at once and nothing is left
    // behind.
    server.get("/health/live").await.expect_ok();
    connection.abort();
    server.get("/health/ready").await.expect_ok();
}

#[tokio::test]
async fn a_flood_of_pings_keeps_nobody_from_being_served() {
    let server = Server::with_flags(&["--send-seconds", "0.5"]).await;
    let mut stream = sent(&server, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0").await;
    let pings = [0, 0, 8, 6, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8].repeat(1000);
    // Reads nothing that comes back, until the server closes the connection.
    let flood = async { while stream.write_all(&pings).await.is_ok() {} };
    let others = async {
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(1) {
            server.get("/health/live").await.expect_ok();
        }
    };
    tokio::join!(async { tokio::time::timeout(TIMEOUT, flood).await.expect("it goes on for ever") }, others);
}

#[tokio::test]
async fn browsers_are_told_what_pages_may_do() {
    let server = Server::start().await;
    for path in ["/docs/", "/problems/internal", "/docs/index.html"] {
        let page = server.get(path).await;
        assert!(page.header("content-type").starts_with("text/html"), "{path}");
        let policy = page.header("content-security-policy");
        for part in ["default-src 'none'", "base-uri 'none'", "frame-ancestors 'none'"] {
            assert!(policy.contains(part), "{path}: {policy}");
        }
        // Pages of text run nothing.
        let has_scripts = policy.contains("script-src 'self';") && policy.contains("connect-src 'self'");
        assert_eq!(has_scripts, path.starts_with("/docs/"), "{path}: {policy}");
        assert_eq!((page.header("x-frame-options"), page.header("referrer-policy")), ("DENY", "no-referrer"));
        // The policy forbids inline scripts.
        for script in page.text.split("<script").skip(1) {
            let (attributes, rest) = script.split_once('>').unwrap();
            assert!(
                attributes.contains("src=") && rest.trim_start().starts_with("</script>"),
                "{path}: {script}"
            );
        }
    }
    for path in
        ["/docs/", "/docs/vendor/swagger-ui.css", "/openapi.json", "/v1/kernels", "/health/live", "/nowhere"]
    {
        assert_eq!(server.get(path).await.header("x-content-type-options"), "nosniff", "{path}");
    }
    let answer = server.post("/v1/clouds", &Value::Null).await;
    assert_eq!(answer.header("x-content-type-options"), "nosniff");
    assert_eq!(answer.header("content-security-policy"), "");
}
