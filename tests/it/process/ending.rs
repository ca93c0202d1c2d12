//! Readiness and shutdown of the process.

use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::document::contract::{self, AnswerParts};
use crate::running::{Process, curvatures, get, gramian, logged};
use crate::support::{LOOK_EVERY, pause, receive, unpooled};

fn spawn_post(process: &Process, path: &str, body: &Value) -> tokio::task::JoinHandle<(u16, Value)> {
    let request = unpooled().post(process.url(path)).json(body);
    tokio::spawn(async move {
        let answer = receive(request).await;
        (answer.status, answer.json().unwrap())
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn the_probe_of_the_container_says_whether_the_server_is_ready() {
    let process = Process::start(&["--threads", "1", "--max-queue", "0"]);
    assert_eq!(process.health().code(), Some(0));
    let slow = spawn_post(&process, "/v1/curvatures", &curvatures(12_000));
    while get(&process, "/health/ready").await.0 == 200 {
        pause().await;
    }
    assert!(!process.health().success());
    slow.abort();
    while get(&process, "/health/ready").await.0 != 200 {
        pause().await;
    }
    assert_eq!(process.health().code(), Some(0));
    let address = process.address().to_owned();
    process.terminate();
    assert_eq!(process.finish().0.code(), Some(0));
    // Nothing listens any longer.
    let health = gramian().args(["--bind", &address, "health"]).output().unwrap();
    assert!(health.status.code().is_some_and(|code| code != 0));
    assert!(!health.stderr.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_under_way_is_finished_before_the_process_ends() {
    let process = Process::start(&[]);
    let slow = spawn_post(&process, "/v1/curvatures", &curvatures(5000));
    // The request is under way once its cloud is registered.
    while get(&process, "/v1/clouds").await.1["clouds"][0].is_null() {
        pause().await;
    }
    process.terminate();
    let (status, answer) = slow.await.unwrap();
    assert_eq!(status, 200);
    assert!((answer["mean_curvatures"][0].as_f64().unwrap() - 1.0).abs() < 0.05, "{answer}");
    let (status, lines) = process.finish();
    assert_eq!(status.code(), Some(0));
    let position = |text: &str| lines.iter().position(|line| line.contains(text)).unwrap();
    assert!(position("draining") < position("POST /v1/curvatures 200"), "{lines:#?}");
}

#[tokio::test]
async fn the_process_ends_in_order_when_its_standard_input_is_closed() {
    let mut process =
        Process::of(gramian().args(["--bind", "127.0.0.1:0", "--while-stdin"]).stdin(Stdio::piped()));
    let mut stdin = process.child.stdin.take().unwrap();
    stdin.write_all(b"ignored").unwrap();
    let slow = spawn_post(&process, "/v1/curvatures", &curvatures(5000));
    while get(&process, "/v1/clouds").await.1["clouds"][0].is_null() {}
    drop(stdin);
    assert_eq!(slow.await.unwrap().0, 200);
    let (status, lines) = process.finish();
    assert_eq!((status.code(), logged(&lines, "draining")["message"].as_str()), (Some(0), Some("draining")));
}

#[tokio::test]
async fn an_open_standard_input_does_not_keep_a_process_that_is_told_to_end() {
    for flags in [&["--while-stdin"][..], &[]] {
        let mut process =
            Process::of(gramian().args(["--bind", "127.0.0.1:0"]).args(flags).stdin(Stdio::piped()));
        let _open = process.child.stdin.take();
        process.terminate();
        assert_eq!(process.finish().0.code(), Some(0));
    }
}

#[tokio::test]
async fn standard_input_means_nothing_without_the_flag() {
    let process = Process::of(gramian().args(["--bind", "127.0.0.1:0"]).stdin(Stdio::null()));
    assert_eq!(get(&process, "/health/live").await.0, 200);
    process.terminate();
    let (status, lines) = process.finish();
    assert_eq!(status.code(), Some(0));
    assert!(lines.iter().any(|line| line.contains("GET /health/live 200")), "{lines:#?}");
}

#[tokio::test]
async fn a_client_that_never_finishes_its_request_does_not_hold_the_process() {
    for stalled in [
        "GET /health/live HT",
        "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{",
    ] {
        let mut process = Process::start(&["--deadline-seconds", "1"]);
        let mut connection = std::net::TcpStream::connect(process.address()).unwrap();
        connection.write_all(stalled.as_bytes()).unwrap();
        // Connections are accepted in order: the stalled one has been accepted once this request is answered.
        assert_eq!(get(&process, "/health/live").await.0, 200);
        process.terminate();
        let began = Instant::now();
        while process.child.try_wait().unwrap().is_none() {
            assert!(began.elapsed() < Duration::from_secs(10), "still running after {stalled:?}");
            std::thread::sleep(LOOK_EVERY);
        }
        assert_eq!(process.finish().0.code(), Some(0));
    }
}

/// Requests an answer of some 10 MB, and reads its beginning.
fn begin_large_answer(process: &Process) -> std::net::TcpStream {
    let mut body = curvatures(700);
    body.as_object_mut().unwrap().remove("queries");
    let body = body.to_string();
    let mut stream = std::net::TcpStream::connect(process.address()).unwrap();
    write!(
        stream,
        "POST /v1/laplace-beltrami/matrix HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
    .unwrap();
    let mut beginning = [0; 12];
    stream.read_exact(&mut beginning).unwrap();
    assert_eq!(&beginning, b"HTTP/1.1 200");
    stream
}

#[tokio::test]
async fn readers_are_waited_for_and_then_cut_without_an_end() {
    let process = Process::start(&["--drain-seconds", "2"]);
    let (mut reader, mut sleeper) = (begin_large_answer(&process), begin_large_answer(&process));
    process.terminate();
    let mut received = Vec::new();
    reader.read_to_end(&mut received).unwrap();
    assert!(received.ends_with(b"\r\n0\r\n\r\n"), "{} bytes", received.len());
    let began = Instant::now();
    let (status, lines) = process.finish();
    assert!(began.elapsed() < Duration::from_secs(20));
    assert_eq!(status.code(), Some(0));
    assert_eq!(logged(&lines, "are closed")["n_connections"], 1);
    received.clear();
    let outcome = sleeper.read_to_end(&mut received);
    assert!(outcome.is_err() || !received.ends_with(b"0\r\n\r\n"));
    assert!(received.len() < 8 << 20, "{} bytes", received.len());
}

#[tokio::test]
async fn what_has_not_been_read_is_refused_while_the_server_drains() {
    let process = Process::start(&["--drain-seconds", "60"]);
    // The unread answer keeps the process alive.
    let reader = begin_large_answer(&process);
    let head = "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n";
    let mut uploads = [head.to_owned(), format!("{head}{{")].map(|text| {
        let mut stream = std::net::TcpStream::connect(process.address()).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        stream
    });
    let mut kept = std::net::TcpStream::connect(process.address()).unwrap();
    kept.write_all(b"GET /health/live HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
    kept.read_exact(&mut [0; 12]).unwrap();
    process.terminate();
    for upload in &mut uploads {
        let mut text = String::new();
        upload.read_to_string(&mut text).unwrap();
        let answer = AnswerParts::parse(&text);
        contract::check("POST", "/v1/normals", &answer);
        assert_eq!((answer.status, answer.header("connection")), (503, "close"), "{text}");
        assert_eq!(answer.json().unwrap()["type"], "/problems/overloaded");
    }
    // Idle connections are closed, and no new ones are accepted. Under load one was closed by a reset.
    if let Err(error) = kept.read_to_end(&mut Vec::new()) {
        assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset);
    }
    assert!(std::net::TcpStream::connect(process.address()).is_err());
    drop(reader);
    assert_eq!(process.finish().0.code(), Some(0));
}

#[tokio::test]
async fn a_second_signal_ends_the_process_at_once() {
    for second in ["-TERM", "-INT"] {
        let mut process = Process::start(&["--drain-seconds", "3600", "--send-seconds", "3600"]);
        let _unread = begin_large_answer(&process);
        process.terminate();
        let has_begun = || process.lines.lock().unwrap().iter().any(|line| line.contains("draining"));
        while !has_begun() {
            std::thread::sleep(LOOK_EVERY);
        }
        assert!(process.child.try_wait().unwrap().is_none());
        let pid = process.child.id().to_string();
        assert!(Command::new("kill").args([second, &pid]).status().unwrap().success());
        let began = Instant::now();
        let (status, _) = process.finish();
        assert!(began.elapsed() < Duration::from_secs(20));
        assert_eq!(status.code(), Some(130));
    }
}
