//! Memory that requests take. `tests/parsing.rs` checks that of bodies to the byte.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::{Value, json};

use crate::running::Process;
use crate::support::{fibonacci_sphere, receive, unpooled};

/// Memory budget in bytes, half a gigabyte, and the flags that set it.
const BUDGET: usize = 512 << 20;
const SMALL: [&str; 4] = ["--threads", "2", "--memory-bytes", "536870912"];

/// Limit of resident memory in bytes: the budget, plus a tenth for what the allocator keeps.
const LIMIT: u64 = (BUDGET + BUDGET / 10) as u64;

/// Sends a request as raw bytes, and leaves its answer unread.
fn send(process: &Process, path: &str, head: &str, body: &[u8]) -> TcpStream {
    let mut stream = TcpStream::connect(process.address()).unwrap();
    write!(stream, "POST {path} HTTP/1.1\r\nHost: test\r\nContent-Type: application/json\r\n{head}\r\n\r\n")
        .unwrap();
    stream.write_all(body).unwrap();
    stream
}

async fn expect_alive(process: &Process) {
    let body = request(60);
    let answer = receive(unpooled().post(process.url("/v1/normals")).json(&body)).await;
    assert_eq!(answer.status, 200);
}

#[tokio::test]
async fn answers_that_nobody_reads_are_within_the_budget() {
    let process = Process::start(&SMALL);
    let cloud = request(1500);
    let registered = unpooled().post(process.url("/v1/clouds")).json(&cloud["cloud"]);
    let id = receive(registered).await.json().unwrap()["cloud_id"].clone();
    let body = json!({"cloud": {"id": id}, "kernel": cloud["kernel"], "alpha": 1e-8}).to_string();
    // Each answer takes 18 or 54 MB, together more than the budget. Some requests are refused, or wait.
    let mut streams = Vec::new();
    for k in 0..24 {
        let path = ["/v1/laplace-beltrami/matrix", "/v1/surface-gradient/matrix"][k % 2];
        let head = format!("Accept: application/x-safetensors\r\nContent-Length: {}", body.len());
        streams.push(send(&process, path, &head, body.as_bytes()));
    }
    // The first bytes show that the answer was computed and waits for its reader. Answers come in any order,
    // and a request that finds no memory until its deadline is refused.
    let is_computed = |stream: &mut TcpStream| {
        let mut first = [0; 12];
        stream.read_exact(&mut first).unwrap();
        &first == b"HTTP/1.1 200"
    };
    assert!(streams.iter_mut().any(is_computed));
    for _ in 0..5 {
        expect_alive(&process).await;
    }
    drop(streams);
    expect_alive(&process).await;
    let peak = process.peak_resident_bytes();
    assert!(peak <= LIMIT, "{peak} bytes at the peak, {LIMIT} allowed");
}

#[tokio::test]
async fn bodies_that_never_end_are_within_the_budget() {
    let process = Process::start(&[&SMALL[..], &["--body-seconds", "60"]].concat());
    let piece = vec![b' '; 7 << 20];
    // Twenty bodies of 8 MB without their last bytes: twice the part of the budget for bodies.
    let streams: Vec<_> = (0..20).filter_map(|_| {
        let mut stream = TcpStream::connect(process.address()).unwrap();
        stream.set_write_timeout(Some(std::time::Duration::from_secs(5))).unwrap();
        let head = "POST /v1/normals HTTP/1.1\r\nHost: test\r\nContent-Type: application/json\r\nContent-Length: 8000000\r\n\r\n";
        stream.write_all(head.as_bytes()).unwrap();
        // A refused connection is closed while the body is sent.
        stream.write_all(&piece).ok().map(|()| stream)
    }).collect();
    assert!(!streams.is_empty());
    let peak = process.peak_resident_bytes();
    assert!(peak <= LIMIT / 2, "{peak} bytes at the peak, {} allowed", LIMIT / 2);
    drop(streams);
    expect_alive(&process).await;
}

#[tokio::test]
async fn what_takes_more_than_the_budget_is_refused_before_it_is_begun() {
    let process = Process::start(&SMALL);
    let mut body = request(12_000);
    body["queries"] = json!([[0.5, 0.5, 0.5]]);
    let answer = receive(unpooled().post(process.url("/v1/interpolation")).json(&{
        body["values"] = json!(vec![1.0; 12_000]);
        body
    }))
    .await;
    let problem = answer.json().unwrap();
    assert_eq!((answer.status, &problem["type"]), (413, &json!("/problems/problem-too-large")));
    let required = problem["required"].as_u64().unwrap();
    assert!(required >= 4 * 12_000 * 12_000 && problem["limit"].as_u64().unwrap() < BUDGET as u64);
    assert!(problem["detail"].as_str().unwrap().contains("GRAMIAN_MEMORY_BYTES"));
    assert!(process.peak_resident_bytes() < 100 << 20);
}

#[tokio::test]
async fn each_factor_and_the_fallback_have_their_memory() {
    // 6,000 points fit once, with 144 MB of some 220. Beside them, neither a second factor nor the full
    // matrix fits.
    let n = 6000;
    let process = Process::start(&SMALL);
    let post = async |body: &Value| receive(unpooled().post(process.url("/v1/curvatures")).json(body)).await;
    assert_eq!(post(&request(n)).await.status, 200);
    let expect_refused = |answer: crate::document::contract::AnswerParts| {
        let problem = answer.json().unwrap();
        assert_eq!((answer.status, &problem["type"]), (413, &json!("/problems/problem-too-large")));
        let (required, limit) = (&problem["required"], &problem["limit"]);
        assert!(required.as_u64().unwrap() > limit.as_u64().unwrap());
        required.as_u64().unwrap()
    };
    let mut two = request(n);
    two["values"] = json!(vec![1.0; n]);
    two["surface"] = json!({"kernel": {"family": "matern", "length_scale": 0.4}});
    let two = receive(unpooled().post(process.url("/v1/surface-gradient")).json(&two)).await;
    // The first factor is cached, so it requires nothing.
    assert!(expect_refused(two) >= 4 * (n * n) as u64);
    // Pairs of points that the kernel cannot tell apart: Cholesky fails, and the fallback is refused.
    let mut pairs = request(n / 2);
    let points = fibonacci_sphere(n / 2);
    let moved = points.iter().map(|x| [x[0] + 1e-10, x[1], x[2]]);
    pairs["cloud"]["points"] =
        points.iter().map(|x| [x[0], x[1], x[2]]).chain(moved).map(|x| json!(x)).collect();
    pairs["alpha"] = json!(0);
    assert!(expect_refused(post(&pairs).await) >= 8 * (n * n) as u64);
    expect_alive(&process).await;
    let peak = process.peak_resident_bytes();
    assert!(peak <= LIMIT, "{peak} bytes at the peak, {LIMIT} allowed");
}

#[tokio::test]
async fn packed_bodies_are_served_whoever_shares_a_small_budget() {
    let process = Process::start(&[&SMALL[..], &["--api-keys", "one,two"]].concat());
    let body = zstd::encode_all(request(20).to_string().as_bytes(), 3).unwrap();
    let post = unpooled().post(process.url("/v1/normals")).bearer_auth("one").body(body);
    let post = post.header("content-type", "application/json").header("content-encoding", "zstd");
    assert_eq!(receive(post).await.status, 200);
}

#[tokio::test]
async fn equal_requests_wait_for_one_factor_and_not_for_memory_for_their_own() {
    // There is memory for one factor of 6,000 points, while another factor is cached.
    let process = Process::start(&SMALL);
    let post = |body: &Value| unpooled().post(process.url("/v1/normals")).json(body);
    assert_eq!(receive(post(&request(5900))).await.status, 200);
    let mut equal = request(6000);
    equal["queries"] = json!([[0, 0, 1]]);
    let answers = futures_util::future::join_all((0..4).map(|_| receive(post(&equal)))).await;
    assert!(answers.iter().all(|answer| answer.status == 200));
    let made = answers.iter().filter(|answer| answer.header("cache-status") == "gramian; fwd=miss; stored");
    assert_eq!(made.count(), 1);
}

fn request(n: usize) -> Value {
    let points = fibonacci_sphere(n);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-8})
}

fn posterior(n: usize) -> Value {
    let mut request = request(n);
    request["values"] = json!(vec![1.0; n]);
    request["queries"] = json!(fibonacci_sphere(100));
    request["include"] = json!(["variances"]);
    request
}

/// Returns the bytes that a cold request adds to the idle process at its peak.
///
/// On two threads 34 to 80 MB of them do not depend on its size. These are packing buffers of matrix
/// products, which each thread of both lanes has, and pages that the allocator has begun.
async fn peak(path: &str, request: &Value) -> f64 {
    // Every thread has its own buffers.
    let server = Process::start(&["--threads", "2"]);
    let idle = server.peak_resident_bytes();
    let answer = receive(unpooled().post(server.url(path)).json(request)).await;
    assert_eq!(answer.status, 200);
    (server.peak_resident_bytes() - idle) as f64
}

#[tokio::test]
async fn a_cold_factorization_takes_half_its_matrix_and_little_more() {
    let (small, large) = (4000, 8000);
    let matrix = |n: usize| 8.0 * (n * n) as f64;
    for (path, of) in [("/v1/curvatures", request as fn(usize) -> Value), ("/v1/posterior", posterior)] {
        let at_small = peak(path, &of(small)).await;
        // Beside other tests a thread may begin pages that it otherwise shares. So the smaller of two runs
        // counts.
        let at_large = peak(path, &of(large)).await.min(peak(path, &of(large)).await);
        // One-time costs cancel in the difference, which is the cost of the points: half the matrix, plus 18
        // MB of surface for 4,000 more points.
        let (grown, limit) = (at_large - at_small, 0.6 * (matrix(large) - matrix(small)));
        assert!(grown <= limit, "{path}: {grown} more bytes from {small} to {large} points, {limit} allowed");
        let limit = 0.75 * matrix(large);
        assert!(at_large <= limit, "{path}: {at_large} bytes at the peak, {limit} allowed");
    }
}

#[tokio::test]
async fn a_refused_body_takes_little_more_than_itself() {
    const N_BYTES: usize = 24 << 20;
    let repeated = |head: &str, text: &str, tail: &str| {
        format!("{head}{}{tail}", text.repeat(N_BYTES / text.len())).into_bytes()
    };
    let in_metadata = |text: &str| {
        let header = format!(r#"{{"__metadata__":{{"request":"{}"}}}}"#, text.repeat(N_BYTES / text.len()));
        [&(header.len() as u64).to_le_bytes(), header.as_bytes()].concat()
    };
    let (json, safetensors) = ("application/json", "application/x-safetensors");
    for (media_type, body, status) in [
        (json, repeated(r#"{"cloud":{"points":[[0]]},"values":[0"#, ",1", "]}"), 413),
        (json, repeated(r#"{"cloud":{"points":[[0]"#, ",[1]", r#"]},"values":[]}"#), 413),
        (json, repeated(r#"{"cloud":{"points":[[0]"#, " ", r#","x"]},"values":[]}"#), 422),
        (safetensors, in_metadata("[[[["), 413),
        (safetensors, in_metadata("[1,1,1,1],"), 413),
    ] {
        let server = Process::start(&["--threads", "2"]);
        let idle = server.peak_resident_bytes();
        let request = unpooled().post(server.url("/v1/interpolation"));
        let answer = receive(request.header("content-type", media_type).body(body)).await;
        assert_eq!(answer.status, status, "{}", answer.text());
        let peak = server.peak_resident_bytes() - idle;
        // The limit includes the growing buffer, what the allocator keeps of it, and what any request takes.
        assert!(peak <= 5 * N_BYTES as u64, "{peak} bytes at the peak for {N_BYTES} of {media_type}");
    }
}

#[tokio::test]
async fn names_of_tensors_are_not_read_one_by_one() {
    let tensor = |name: usize| format!(r#""x.{name}":{{"dtype":"F64","shape":[0],"data_offsets":[0,0]}}"#);
    let header = format!("{{{}}}", (0..200_000).map(tensor).collect::<Vec<_>>().join(","));
    let body = [&(header.len() as u64).to_le_bytes(), header.as_bytes()].concat();
    let server = Process::start(&["--threads", "1", "--deadline-seconds", "60"]);
    let request = unpooled().post(server.url("/v1/interpolation"));
    let request =
        request.header("content-type", "application/x-safetensors").header("content-encoding", "zstd");
    let answer = receive(request.body(zstd::encode_all(&body[..], 3).unwrap())).await;
    assert_eq!(answer.status, 413, "{}", answer.text());
}
