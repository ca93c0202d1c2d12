//! Stored jobs: memory of results while they are sent, limits on their number and size, and deletion.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::{Value, json};

use crate::all_routes::route_of;
use crate::process::connections::http_2;
use crate::running::Process;
use crate::store::durable::Folder;
use crate::store::jobs::{ask, delete, result};
use crate::support::{Server, fibonacci_sphere, pause, receive, unpooled};
use crate::wire::limits::slow_request;

/// Returns a request for a matrix of n² numbers.
fn matrix(n: usize) -> Value {
    let kernel = json!({"family": "matern", "length_scale": 0.5});
    json!({"cloud": {"points": fibonacci_sphere(n)}, "kernel": kernel, "alpha": 1e-6})
}

const MATRIX: &str = "/v1/laplace-beltrami/matrix";
const SAFETENSORS: (&str, &str) = ("accept", "application/x-safetensors");

/// Sends `GET` and reads nothing.
fn get_unread(process: &Process, path: &str) -> TcpStream {
    let mut stream = TcpStream::connect(process.address()).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: test\r\n\r\n").unwrap();
    stream
}

/// Requests a path on 64 streams of one HTTP/2 connection, and returns the unread bodies.
async fn get_streams_unread(process: &Process, path: &str) -> Vec<h2::RecvStream> {
    let (client, _connection) = http_2(process.address().parse().unwrap()).await;
    let mut client = client.ready().await.unwrap();
    let url = process.url(path);
    let answers = (0..64).map(|_| {
        let request = axum::http::Request::get(&url).body(()).unwrap();
        client.send_request(request, true).unwrap().0
    });
    let answers = futures_util::future::join_all(answers.collect::<Vec<_>>()).await;
    answers.into_iter().map(|answer| answer.unwrap().into_body()).collect()
}

#[tokio::test]
async fn results_that_nobody_reads_are_within_the_budget() {
    const BUDGET: u64 = 384 << 20;
    let process = Process::start(&["--threads", "2", "--memory-bytes", "402653184"]);
    let path = ask(process.url(MATRIX), &matrix(560), &[SAFETENSORS]).await;
    let path = format!("{path}/result");
    let answer = receive(unpooled().get(process.url(&path))).await;
    assert!(answer.status == 200 && answer.bytes.len() > 2_500_000, "{}", answer.bytes.len());
    let mut streams: Vec<_> = (0..250).map(|_| get_unread(&process, &path)).collect();
    for stream in &mut streams {
        let mut first = [0; 12];
        stream.read_exact(&mut first).unwrap();
        assert!([b"HTTP/1.1 200", b"HTTP/1.1 503"].contains(&&first), "{first:?}");
    }
    let mut bodies = Vec::new();
    for _ in 0..6 {
        bodies.push(get_streams_unread(&process, &path).await);
    }
    let peak = process.peak_resident_bytes();
    assert!(peak <= BUDGET, "{peak} bytes at the peak, {BUDGET} allowed");
    // Unread results are not lost: a client that reads receives the whole result, even after the job was
    // deleted.
    assert_eq!(receive(unpooled().delete(process.url(&path[..path.len() - 7]))).await.status, 204);
    let mut text = Vec::new();
    let mut first = streams.swap_remove(0);
    first.set_read_timeout(Some(std::time::Duration::from_secs(2))).unwrap();
    // The connection stays open after the answer.
    first.read_to_end(&mut text).ok();
    assert!(text.ends_with(&answer.bytes), "{} bytes of {}", text.len(), answer.bytes.len());
}

/// Returns the bytes of a part of the memory that a process has reserved.
async fn reserved(process: &Process, part: &str) -> u64 {
    let metrics = receive(unpooled().get(process.url("/metrics"))).await.text().to_owned();
    let name = format!("gramian_memory_used_bytes{{part=\"{part}\"}} ");
    let line = metrics.lines().find(|line| line.starts_with(&name)).unwrap();
    line[name.len()..].parse::<f64>().unwrap() as u64
}

#[tokio::test]
async fn unread_results_of_a_directory_take_no_more_than_they_reserve() {
    let folder = Folder::new("jobs-unread");
    let flags = [&folder.flags()[..], &["--threads", "2", "--memory-bytes", "402653184"]].concat();
    let process = Process::start(&flags);
    let path = format!("{}/result", ask(process.url(MATRIX), &matrix(560), &[]).await);
    let answer = receive(unpooled().get(process.url(&path))).await;
    assert!(answer.status == 200 && answer.bytes.len() > 6_000_000, "{}", answer.bytes.len());
    let (resident, work) = (process.peak_resident_bytes(), reserved(&process, "work").await);
    // All are read from the directory at once.
    let mut streams: Vec<_> = (0..150).map(|_| TcpStream::connect(process.address()).unwrap()).collect();
    for stream in &mut streams {
        write!(stream, "GET {path} HTTP/1.1\r\nHost: test\r\n\r\n").unwrap();
    }
    for stream in &mut streams {
        let mut first = [0; 12];
        stream.read_exact(&mut first).unwrap();
        assert_eq!(&first, b"HTTP/1.1 200");
    }
    let held = reserved(&process, "work").await - work;
    let grown = process.peak_resident_bytes() - resident;
    println!("150 unread results: {grown} bytes more at the peak, {held} reserved");
    assert!(grown <= held, "{grown} bytes more at the peak, {held} reserved");
}

/// Returns the value of a metric.
async fn metric(server: &Server, name: &str) -> f64 {
    let metrics = server.get("/metrics").await.text;
    let line = metrics.lines().find(|line| line.starts_with(&format!("{name} "))).unwrap();
    line.rsplit_once(' ').unwrap().1.parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_deleted_once_and_its_result_is_whole_or_unknown() {
    let folder = Folder::new("jobs-deleted");
    for flags in [&[][..], &folder.flags()] {
        let server = Server::with_flags(flags).await;
        for _ in 0..40 {
            let path = ask(server.url("/v1/normals"), &route_of("/v1/normals").request(), &[]).await;
            result(&server, &path).await.expect_ok();
            let deleting = futures_util::future::join_all((0..4).map(|_| delete(&server, &path)));
            let reading = futures_util::future::join_all((0..6).map(|_| result(&server, &path)));
            let looking = futures_util::future::join_all((0..4).map(|_| server.get(&path)));
            let (deleted, read, looked) = futures_util::future::join3(deleting, reading, looking).await;
            let n_deleted = deleted.iter().filter(|&&status| status == 204).count();
            assert!(
                n_deleted == 1 && deleted.iter().all(|status| [204, 404].contains(status)),
                "{deleted:?}"
            );
            for answer in read.into_iter().chain(looked) {
                if answer.status != 200 {
                    answer.expect_problem(404, "unknown-job");
                } else if let Some(status) = answer.json().get("status") {
                    assert_eq!(*status, "succeeded");
                }
            }
            assert_eq!(delete(&server, &path).await, 404);
        }
        assert_eq!(metric(&server, "gramian_store_damaged_total").await, 0.0);
    }
    let left: Vec<_> = folder.files().into_iter().filter(|path| !path.ends_with("probe")).collect();
    assert!(left.iter().all(|path| path.to_string_lossy().contains("/clouds/") || listed(path)), "{left:?}");
}

fn listed(path: &std::path::Path) -> bool {
    path.to_string_lossy().contains("/listed/")
}

#[tokio::test]
async fn a_result_that_is_waited_for_is_unknown_once_its_job_is_deleted() {
    let folder = Folder::new("jobs-waited");
    for flags in [&[][..], &folder.flags()] {
        let server = Server::with_flags(flags).await;
        let path = ask(server.url("/v1/normals"), &slow_request(), &[]).await;
        let waiting = result(&server, &path);
        let deleting = async {
            while metric(&server, "gramian_http_requests_in_flight").await < 2.0 {
                pause().await;
            }
            (delete(&server, &path).await, delete(&server, &path).await)
        };
        let (waited, deleted) = futures_util::future::join(waiting, deleting).await;
        assert_eq!(deleted, (204, 204), "cancelled, then forgotten");
        waited.expect_problem(404, "unknown-job");
        assert_eq!(delete(&server, &path).await, 404);
    }
}

#[tokio::test]
async fn a_result_without_room_is_refused_with_a_remedy() {
    let folder = Folder::new("jobs-room");
    let in_store = [&folder.flags()[..], &["--store-job-bytes", "4194304"]].concat();
    for flags in [&["--memory-bytes", "268435456"][..], &in_store] {
        let server = Server::with_flags(flags).await;
        let path = ask(server.url(MATRIX), &matrix(800), &[SAFETENSORS]).await;
        let problem = result(&server, &path).await.expect_problem(413, "problem-too-large");
        let detail = problem["detail"].as_str().unwrap();
        let limit = problem["limit"].as_u64().unwrap();
        assert_eq!(
            detail,
            format!(
                "at most {limit} bytes of jobs and results are stored per key, and this result does not fit; fetch results and delete their jobs, or ask for less"
            )
        );
        assert!(limit < 8 << 20, "{limit}");
    }
}

/// Asks for a job with a key.
async fn ask_with_key(server: &Server, key: &str, path: &str, request: &Value) -> reqwest::Response {
    let request = server.client.post(server.url(path)).bearer_auth(key).json(request);
    request.header("prefer", "respond-async").header(SAFETENSORS.0, SAFETENSORS.1).send().await.unwrap()
}

async fn result_with_key(server: &Server, key: &str, path: &str) -> u16 {
    let path = server.url(&format!("{path}/result"));
    receive(server.client.get(path).bearer_auth(key)).await.status
}

fn location(answer: &reqwest::Response) -> String {
    assert_eq!(answer.status(), 202);
    answer.headers()["location"].to_str().unwrap().to_owned()
}

#[tokio::test]
async fn bytes_of_results_in_the_store_are_bounded_and_one_key_has_half() {
    let folder = Folder::new("jobs-bytes");
    let flags = [&folder.flags()[..], &["--store-job-bytes", "16777216", "--api-keys", "greedy,modest"]];
    let server = Server::with_flags(&flags.concat()).await;
    let request = matrix(560);
    let mut paths = Vec::new();
    let mut statuses = Vec::new();
    for _ in 0..4 {
        let path = location(&ask_with_key(&server, "greedy", MATRIX, &request).await);
        statuses.push(result_with_key(&server, "greedy", &path).await);
        paths.push(path);
    }
    // One key may fill half of 16 MiB, which holds three results of 2.5 MB.
    assert_eq!(statuses, [200, 200, 200, 413]);
    // Stored results stay available, and another key has room.
    assert_eq!(result_with_key(&server, "greedy", &paths[0]).await, 200);
    let path = location(&ask_with_key(&server, "modest", MATRIX, &request).await);
    assert_eq!(result_with_key(&server, "modest", &path).await, 200);
    // The bound is the store's: a new process counts the bytes already there.
    drop(server);
    let server = Server::with_flags(&flags.concat()).await;
    while metric(&server, "gramian_store_job_bytes").await < 9e6 {
        pause().await;
    }
    let path = location(&ask_with_key(&server, "greedy", MATRIX, &request).await);
    assert_eq!(result_with_key(&server, "greedy", &path).await, 413);
    let deleted = server.client.delete(server.url(&paths[1])).bearer_auth("greedy");
    assert_eq!(receive(deleted).await.status, 204);
    let path = location(&ask_with_key(&server, "greedy", MATRIX, &request).await);
    assert_eq!(result_with_key(&server, "greedy", &path).await, 200);
}

#[tokio::test]
async fn as_many_jobs_are_kept_as_may_be_and_one_key_has_half() {
    let folder = Folder::new("jobs-number");
    for store in [&[][..], &folder.flags()] {
        let flags = [store, &["--max-jobs", "4", "--api-keys", "greedy,modest"]].concat();
        let server = Server::with_flags(&flags).await;
        let request = route_of("/v1/normals").request();
        let mut kept = Vec::new();
        for _ in 0..2 {
            let path = location(&ask_with_key(&server, "greedy", "/v1/normals", &request).await);
            assert_eq!(result_with_key(&server, "greedy", &path).await, 200);
            kept.push(path);
        }
        let refused = ask_with_key(&server, "greedy", "/v1/normals", &request).await;
        assert!(refused.status() == 503 && refused.headers().contains_key("retry-after"));
        let problem: Value = refused.json().await.unwrap();
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("2 jobs") && detail.contains("delete"), "{detail}");
        assert_eq!(result_with_key(&server, "greedy", &kept[0]).await, 200);
        location(&ask_with_key(&server, "modest", "/v1/normals", &request).await);
        let deleted = server.client.delete(server.url(&kept[0])).bearer_auth("greedy");
        assert_eq!(receive(deleted).await.status, 204);
        location(&ask_with_key(&server, "greedy", "/v1/normals", &request).await);
    }
}

#[tokio::test]
async fn jobs_that_another_process_deleted_make_room_here() {
    let folder = Folder::new("jobs-elsewhere");
    let flags = [&folder.flags()[..], &["--max-jobs", "1"]].concat();
    let [one, two] = [Server::with_flags(&flags).await, Server::with_flags(&flags).await];
    let request = route_of("/v1/normals").request();
    let path = ask(one.url("/v1/normals"), &request, &[]).await;
    result(&two, &path).await.expect_ok();
    assert_eq!(delete(&two, &path).await, 204);
    let asking = || one.client.post(one.url("/v1/normals")).header("prefer", "respond-async").json(&request);
    while asking().send().await.unwrap().status() == 503 {
        pause().await;
    }
}
