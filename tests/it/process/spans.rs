//! Spans, as a collector receives them.

use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

use crate::running::{Process, gramian, logged};
use crate::support::{fibonacci_sphere, http_client, unpooled};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";

/// Returns the request that a collector of spans receives.
async fn collected(listener: TcpListener) -> Vec<u8> {
    let (mut socket, _) = listener.accept().await.unwrap();
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    let is_whole = |bytes: &[u8]| {
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n")?;
        let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
        let length = head.split("content-length: ").nth(1)?.split("\r\n").next()?.parse::<usize>().ok()?;
        (bytes.len() >= end + 4 + length).then_some(())
    };
    while is_whole(&bytes).is_none() {
        let n = socket.read(&mut piece).await.unwrap();
        assert!(n > 0);
        bytes.extend_from_slice(&piece[..n]);
    }
    socket.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n").await.unwrap();
    bytes
}

/// Starts a process that sends its spans to the listener, all of them at its end.
async fn traced() -> (Process, TcpListener) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    let mut command = gramian();
    command.args(["--bind", "127.0.0.1:0"]).env("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint);
    (Process::of(command.env("OTEL_BSP_SCHEDULE_DELAY", "3600000")), listener)
}

/// Ends the process, and returns the spans that it sent and its log.
async fn ended(process: Process, listener: TcpListener) -> (Vec<u8>, Vec<String>) {
    let sent = tokio::spawn(collected(listener));
    process.terminate();
    (sent.await.unwrap(), process.finish().1)
}

fn count(sent: &[u8], bytes: &[u8]) -> usize {
    sent.windows(bytes.len()).filter(|window| *window == bytes).count()
}

fn trace_bytes() -> Vec<u8> {
    (0..16).map(|i| u8::from_str_radix(&TRACE[2 * i..2 * i + 2], 16).unwrap()).collect()
}

#[tokio::test]
async fn requests_are_spans_in_the_traces_of_their_clients() {
    let (process, listener) = traced().await;
    let request = unpooled().get(process.url("/v1/kernels"));
    let request = request.header("traceparent", format!("00-{TRACE}-00f067aa0ba902b7-01"));
    assert_eq!(request.header("x-request-id", "traced-1").send().await.unwrap().status(), 200);
    // Unsent spans are sent when the process ends.
    let (sent, lines) = ended(process, listener).await;
    assert_eq!(logged(&lines, "GET /v1/kernels 200")["trace_id"], TRACE);
    for bytes in [&b"POST /v1/traces "[..], b"GET /v1/kernels", &trace_bytes(), b"traced-1"] {
        assert!(count(&sent, bytes) > 0, "{sent:?}");
    }
}

/// Runs a job to its end, and returns its id.
async fn job(process: &Process, headers: &[(&str, &str)]) -> String {
    let client = http_client().build().unwrap();
    let mut request = client.post(process.url("/v1/normals")).header("prefer", "respond-async");
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let body = json!({"cloud": {"points": fibonacci_sphere(30)}});
    let answer = request.json(&body).send().await.unwrap();
    assert_eq!(answer.status(), 202);
    let id = answer.headers()["location"].to_str().unwrap().rsplit('/').next().unwrap().to_owned();
    process.has_logged(&format!("job {id} 200")).await;
    id
}

#[tokio::test]
async fn work_on_a_job_is_a_span_in_the_trace_of_who_asked_for_it() {
    let (process, listener) = traced().await;
    let id = job(&process, &[("traceparent", &format!("00-{TRACE}-00f067aa0ba902b7-01"))]).await;
    let (sent, lines) = ended(process, listener).await;
    assert_eq!(logged(&lines, &format!("job {id} 200"))["trace_id"], TRACE);
    assert_eq!(logged(&lines, "POST /v1/normals 202")["trace_id"], TRACE);
    // One span of the request and one of the work, each with a name and the id of its trace.
    assert_eq!(count(&sent, &trace_bytes()), 2, "{sent:?}");
    assert_eq!(count(&sent, b"job /v1/normals"), 1);
    assert!(count(&sent, id.as_bytes()) > 0);
}

#[tokio::test]
async fn a_job_has_the_trace_of_its_request_where_nobody_collects() {
    let process = Process::start(&[]);
    let id = job(&process, &[]).await;
    process.terminate();
    let lines = process.finish().1;
    let done = logged(&lines, &format!("job {id} 200"));
    assert_eq!(done["trace_id"], logged(&lines, "POST /v1/normals 202")["trace_id"]);
    assert_eq!(done["trace_id"].as_str().map(str::len), Some(32));
}
