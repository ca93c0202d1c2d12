//! `Idempotency-Key` with `Prefer: respond-async`: repeated requests become one job.

use serde_json::{Value, json};

use crate::all_routes::route_of;
use crate::running::Process;
use crate::store::durable::Folder;
use crate::store::jobs::{delete, result};
use crate::support::{Answer, Server, pause, unpooled};
use crate::wire::limits::slow_request;

const NORMALS: &str = "/v1/normals";

/// Returns a request that asks for a job, with further headers.
fn job_request(url: String, body: &Value, headers: &[(&str, &str)]) -> reqwest::RequestBuilder {
    let request = unpooled().post(url).header("prefer", "respond-async").json(body);
    headers.iter().fold(request, |request, (name, value)| request.header(*name, *value))
}

/// Sends a request for a job. Returns the status and the path of the job, empty if there is none.
async fn submit(url: String, body: &Value, headers: &[(&str, &str)]) -> (u16, String) {
    let answer = job_request(url, body, headers).send().await.unwrap();
    let location = answer.headers().get("location").map(|value| value.to_str().unwrap().to_owned());
    let status = answer.status().as_u16();
    let document: Value = answer.json().await.unwrap();
    if status == 202 {
        let id = document["job_id"].as_str().unwrap();
        assert_eq!(location, Some(format!("/v1/jobs/{id}")), "{document}");
    }
    (status, location.unwrap_or_default())
}

#[tokio::test(flavor = "multi_thread")]
async fn equal_requests_with_one_key_are_one_job() {
    let folder = Folder::new("keys-equal");
    // In memory, then in a store.
    for flags in [&[][..], &folder.flags()] {
        let server = Server::with_flags(flags).await;
        let request = route_of(NORMALS).request();
        for round in 0..10 {
            let key = format!("round-{round}");
            let headers = [("idempotency-key", key.as_str())];
            let asked = (0..8).map(|_| submit(server.url(NORMALS), &request, &headers));
            let answers = futures_util::future::join_all(asked).await;
            let path = answers[0].1.clone();
            assert!(answers.iter().all(|answer| *answer == (202, path.clone())), "{answers:?}");
            result(&server, &path).await.expect_ok();
            // Also after the job has ended.
            assert_eq!(submit(server.url(NORMALS), &request, &headers).await, (202, path));
        }
        let metrics = server.get("/metrics").await.text;
        assert!(metrics.contains("gramian_jobs_ended_total{outcome=\"succeeded\"} 10\n"), "{metrics}");
    }
}

#[tokio::test]
async fn equal_requests_to_several_processes_are_one_job() {
    let folder = Folder::new("keys-processes");
    let processes = [Process::start(&folder.flags()), Process::start(&folder.flags())];
    let request = slow_request();
    for round in 0..5 {
        let key = format!("round-{round}");
        let headers = [("idempotency-key", key.as_str())];
        let asked = (0..8).map(|k| submit(processes[k % 2].url(NORMALS), &request, &headers));
        let answers = futures_util::future::join_all(asked).await;
        let path = answers[0].1.clone();
        assert!(answers.iter().all(|answer| *answer == (202, path.clone())), "{answers:?}");
        // The first DELETE cancels the job, the second forgets it.
        for process in &processes {
            let deleted = unpooled().delete(process.url(&path)).send().await.unwrap();
            assert_eq!(deleted.status(), 204);
        }
    }
    // A lease that was being written when its job was deleted remains until it expires.
    let left: Vec<_> = folder.files();
    let is_of_job = |path: &std::path::PathBuf| {
        let path = path.to_string_lossy();
        ["/open/", "/request"].iter().any(|part| path.contains(part))
    };
    assert!(!left.iter().any(is_of_job), "{left:?}");
    // The last generation of each register of claims stays.
    let n_claims = left.iter().filter(|path| path.to_string_lossy().contains("/claims/")).count();
    assert!((1..=5).contains(&n_claims), "{left:?}");
}

#[tokio::test]
async fn a_key_belongs_to_one_request_and_one_owner() {
    let server = Server::with_flags(&["--api-keys", "one,other"]).await;
    let request = route_of(NORMALS).request();
    // A string of structured fields, as the draft of the header wants. The quotes are part of the key.
    let as_one = [("idempotency-key", "\"k-1\""), ("authorization", "Bearer one")];
    let (status, path) = submit(server.url(NORMALS), &request, &as_one).await;
    assert_eq!(status, 202);
    // Another body, route or answer format makes a different request.
    let mut other = request.clone();
    other["alpha"] = json!(0.25);
    let safetensors = [&as_one[..], &[("accept", "application/x-safetensors")]].concat();
    for (route, body, headers) in [
        (NORMALS, &other, &as_one[..]),
        ("/v1/curvatures", &request, &as_one[..]),
        (NORMALS, &request, &safetensors),
    ] {
        let refused = server.send(job_request(server.url(route), body, headers)).await;
        let problem = refused.expect_problem(422, "invalid-request");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("Idempotency-Key"), "{detail}");
    }
    // Headers that only route the request are not part of it.
    let routed = [&as_one[..], &[("gramian-cloud", "none"), ("x-request-id", "again")]].concat();
    assert_eq!(submit(server.url(NORMALS), &request, &routed).await, (202, path.clone()));
    // An equal key of another owner is a different key. A request without a key is another job: `as_one[1..]`
    // has no key.
    let as_other = [("idempotency-key", "\"k-1\""), ("authorization", "Bearer other")];
    for headers in [&as_other[..], &as_one[1..]] {
        let (status, another) = submit(server.url(NORMALS), &request, headers).await;
        assert!(status == 202 && another != path);
    }
}

#[tokio::test]
async fn a_key_is_forgotten_with_its_job() {
    let folder = Folder::new("keys-forgotten");
    for store in [&[][..], &folder.flags()] {
        let server = Server::with_flags(store).await;
        let (request, headers) = (route_of(NORMALS).request(), [("idempotency-key", "again")]);
        let (_, first) = submit(server.url(NORMALS), &request, &headers).await;
        result(&server, &first).await.expect_ok();
        assert_eq!(submit(server.url(NORMALS), &request, &headers).await, (202, first.clone()));
        assert_eq!(delete(&server, &first).await, 204);
        let mut other = request.clone();
        other["alpha"] = json!(0.25);
        let (status, second) = submit(server.url(NORMALS), &other, &headers).await;
        assert!(status == 202 && second != first, "{status}");
    }
}

#[tokio::test]
async fn a_key_expires_with_its_result() {
    let folder = Folder::new("keys-expired");
    for store in [&[][..], &folder.flags()] {
        let flags = [store, &["--job-result-seconds", "0.5"]].concat();
        let server = Server::with_flags(&flags).await;
        let (request, headers) = (route_of(NORMALS).request(), [("idempotency-key", "short")]);
        let mut other = request.clone();
        other["alpha"] = json!(0.25);
        let (_, first) = submit(server.url(NORMALS), &request, &headers).await;
        while server.get(&first).await.status == 200 {
            pause().await;
        }
        let (status, second) = submit(server.url(NORMALS), &other, &headers).await;
        assert!(status == 202 && second != first, "{status}");
    }
}

#[tokio::test]
async fn malformed_keys_are_refused() {
    let server = Server::start().await;
    let request = route_of(NORMALS).request();
    let refuse = |answer: Answer| {
        let problem = answer.expect_problem(422, "invalid-request");
        assert!(problem["detail"].as_str().unwrap().contains("Idempotency-Key"), "{problem}");
    };
    let long = "k".repeat(256);
    for bad in ["", "a b", "a\tb", &long] {
        refuse(server.send(job_request(server.url(NORMALS), &request, &[("idempotency-key", bad)])).await);
    }
    let two = [("idempotency-key", "one"), ("idempotency-key", "two")];
    refuse(server.send(job_request(server.url(NORMALS), &request, &two)).await);
    let longest = "k".repeat(255);
    let (status, _) = submit(server.url(NORMALS), &request, &[("idempotency-key", &longest)]).await;
    assert_eq!(status, 202);
    // Without `Prefer`, the header is not even read: no job is begun that a repetition could find.
    let request = server.client.post(server.url(NORMALS)).json(&request).header("idempotency-key", "a b");
    assert_eq!(server.send(request).await.status, 200);
}
