//! Jobs: work requested with `Prefer: respond-async`.

use serde_json::{Value, json};

use crate::all_routes::{ROUTES, route_of};
use crate::running::Process;
use crate::store::durable::Folder;
use crate::support::{Answer, Server, fibonacci_sphere, pause, receive, unpooled};
use crate::wire::limits::slow_request;

/// Asks for a job and returns its path. The answer is not checked against the document, which has no 202,
/// since that status depends on a header of the request.
pub async fn ask(url: String, body: &Value, headers: &[(&str, &str)]) -> String {
    let mut request = unpooled().post(url).header("prefer", "wait=5, respond-async").json(body);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let answer = request.send().await.unwrap();
    assert_eq!(answer.status(), 202);
    assert_eq!(answer.headers()["preference-applied"], "respond-async");
    let path = answer.headers()["location"].to_str().unwrap().to_owned();
    let job: Value = answer.json().await.unwrap();
    assert_eq!(path, format!("/v1/jobs/{}", job["job_id"].as_str().unwrap()));
    assert!(["queued", "running"].contains(&job["status"].as_str().unwrap()), "{job}");
    path
}

pub async fn result(server: &Server, path: &str) -> Answer {
    server.get(&format!("{path}/result")).await
}

pub async fn delete(server: &Server, path: &str) -> u16 {
    server.send(server.client.delete(server.url(path))).await.status
}

/// Returns the events of a stream: names with their data.
fn events(text: &str) -> Vec<(String, Value)> {
    let blocks = text.split("\n\n").filter(|block| block.starts_with("event: "));
    let parsed = blocks.map(|block| {
        let (name, data) = block.strip_prefix("event: ").unwrap().split_once("\ndata: ").unwrap();
        (name.to_owned(), serde_json::from_str(data).unwrap())
    });
    parsed.collect()
}

/// Returns the complete events of a text that may end within one.
fn whole_events(text: &str) -> Vec<(String, Value)> {
    text.rfind("\n\n").map_or_else(Vec::new, |end| events(&text[..end]))
}

/// Returns an answer without what depends on the moment.
fn numbers_of(mut answer: Value) -> Value {
    answer["diagnostics"]["relative_residual"] = Value::Null;
    answer
}

#[tokio::test]
async fn a_job_is_answered_as_the_request_itself() {
    let server = Server::start().await;
    for route in &ROUTES {
        let request = route.request();
        let path = ask(server.url(route.path), &request, &[]).await;
        let found = result(&server, &path).await;
        assert_eq!(found.header("cache-status"), "gramian; fwd=miss; stored", "{}", route.path);
        assert!(found.header("server-timing").contains("factor;dur="));
        let expected = server.post(route.path, &request).await;
        assert_eq!(found.header("gramian-cloud"), expected.header("gramian-cloud"));
        assert_eq!(numbers_of(found.expect_ok()), numbers_of(expected.expect_ok()), "{}", route.path);
        let job = server.get(&path).await.expect_ok();
        assert_eq!(
            (&job["status"], &job["progress"]["fraction"]),
            (&json!("succeeded"), &json!(1.0)),
            "{job}"
        );
        assert!(
            job["ended_at"].as_str() >= job["created_at"].as_str()
                && job["expires_at"].as_str() > job["ended_at"].as_str()
        );
        // Deleted, so that the next route computes again.
        let cloud = format!("/v1/clouds/{}", expected_cloud(&server).await);
        assert_eq!(delete(&server, &cloud).await, 204);
        assert_eq!(delete(&server, &path).await, 204);
        server.get(&path).await.expect_problem(404, "unknown-job");
        result(&server, &path).await.expect_problem(404, "unknown-job");
        assert_eq!(delete(&server, &path).await, 404);
    }
}

async fn expected_cloud(server: &Server) -> String {
    let list = server.get("/v1/clouds").await.expect_ok();
    list["clouds"][0]["cloud_id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_result_has_the_form_that_its_request_accepted() {
    let server = Server::start().await;
    let request = route_of("/v1/normals").request();
    let safetensors = [("accept", "application/x-safetensors")];
    let path = ask(server.url("/v1/normals"), &request, &safetensors).await;
    let found = receive(server.client.get(server.url(&format!("{path}/result")))).await;
    assert_eq!((found.status, found.media_type()), (200, "application/x-safetensors".to_owned()));
    let expected = receive(
        server.client.post(server.url("/v1/normals")).json(&request).header("accept", safetensors[0].1),
    );
    let expected = expected.await;
    assert_eq!(found.bytes.len(), expected.bytes.len());
}

#[tokio::test]
async fn what_is_refused_fails_with_its_problem() {
    let server = Server::start().await;
    for route in &ROUTES {
        let bad = route.with("/alpha", &json!(-1.0));
        let path = ask(server.url(route.path), &bad, &[]).await;
        let expected = server.post(route.path, &bad).await.expect_problem(422, "invalid-request");
        let found = result(&server, &path).await.expect_problem(422, "invalid-request");
        assert_eq!(found["errors"], expected["errors"]);
        let job = server.get(&path).await.expect_ok();
        assert_eq!((&job["status"], &job["problem"]["errors"]), (&json!("failed"), &expected["errors"]));
    }
    let path = ask(server.url("/v1/normals"), &json!({}), &[("accept", "text/html")]).await;
    result(&server, &path).await.expect_problem(406, "not-acceptable");
    // A request that cannot be a job is refused at once. One that takes no time is answered at once.
    let prefer = |path: &str| server.client.post(server.url(path)).header("prefer", "respond-async");
    server.send(prefer("/v1/nothing").json(&json!({}))).await.expect_problem(404, "not-found");
    let cloud = json!({"points": fibonacci_sphere(5)});
    assert_eq!(server.send(prefer("/v1/clouds").json(&cloud)).await.status, 201);
    for bad in ["/v1/jobs/none", "/v1/jobs/0193A5E7-8C1D-7B22-9F0E-5D3C6F1A2B4C"] {
        server.get(bad).await.expect_problem(404, "unknown-job");
    }
}

#[tokio::test]
async fn whoever_follows_is_told_how_far_it_is_and_when_it_is_done() {
    let server = Server::start().await;
    let points = fibonacci_sphere(5000);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6});
    let path = ask(server.url("/v1/curvatures"), &request, &[]).await;
    let text = server.get(&format!("{path}/events")).await.text;
    let events = events(&text);
    let (last, progress) = events.split_last().unwrap();
    assert_eq!((last.0.as_str(), &last.1["status"]), ("done", &json!("succeeded")), "{text}");
    assert!(!progress.is_empty() && progress.iter().all(|(name, _)| name == "progress"), "{text}");
    let fractions: Vec<f64> =
        progress.iter().map(|(_, job)| job["progress"]["fraction"].as_f64().unwrap()).collect();
    assert!(
        fractions.is_sorted() && fractions.iter().all(|fraction| (0.0..1.0).contains(fraction)),
        "{text}"
    );
    // A later follower receives only the end.
    let text = server.get(&format!("{path}/events")).await.text;
    assert_eq!(crate::store::jobs::events(&text).len(), 1, "{text}");
    // The remaining time is sent while a job runs, however fast the machine. This job is deleted once it was
    // sent.
    let path = ask(server.url("/v1/normals"), &slow_request(), &[]).await;
    let mut told = server.client.get(server.url(&format!("{path}/events"))).send().await.unwrap();
    let mut text = String::new();
    let seconds_left = |(_, job): &(String, Value)| {
        (job["status"] == "running").then(|| job["progress"]["seconds_left"].as_f64()).flatten()
    };
    while !whole_events(&text).iter().any(|event| seconds_left(event) > Some(0.0)) {
        let chunk =
            told.chunk().await.unwrap().expect("a job that runs for seconds says how long it still takes");
        text.push_str(std::str::from_utf8(&chunk).unwrap());
    }
    assert_eq!(delete(&server, &path).await, 204);
}

#[tokio::test]
async fn a_job_has_no_deadline_and_stops_when_it_is_deleted() {
    let server = Server::with_flags(&["--deadline-seconds", "0.2"]).await;
    server.post("/v1/normals", &slow_request()).await.expect_problem(504, "deadline-exceeded");
    let path = ask(server.url("/v1/normals"), &slow_request(), &[]).await;
    let stages = |job: &Value| job["progress"]["stage"].as_str().unwrap().to_owned();
    while stages(&server.get(&path).await.expect_ok()) != "factor" {
        pause().await;
    }
    result(&server, &path).await.expect_problem(504, "deadline-exceeded");
    assert_eq!(delete(&server, &path).await, 204);
    assert_eq!(server.get(&path).await.expect_ok()["status"], "cancelled");
    result(&server, &path).await.expect_problem(404, "unknown-job");
    // Its threads are free again, so the next job ends, although it takes longer than requests may.
    let points = fibonacci_sphere(1500);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6});
    let next = ask(server.url("/v1/curvatures"), &request, &[]).await;
    while result(&server, &next).await.status == 504 {
        pause().await;
    }
    result(&server, &next).await.expect_ok();
    assert_eq!(delete(&server, &path).await, 204);
    server.get(&path).await.expect_problem(404, "unknown-job");
}

#[tokio::test]
async fn jobs_of_one_key_are_unknown_to_the_others() {
    let server = Server::with_flags(&["--api-keys", "one,other"]).await;
    let as_key = |method: &str, path: &str, key: &str| {
        let request = server.client.request(method.parse().unwrap(), server.url(path));
        server.send(request.bearer_auth(key))
    };
    let request = route_of("/v1/normals").request();
    let path = ask(server.url("/v1/normals"), &request, &[("authorization", "Bearer one")]).await;
    for end in ["", "/events", "/result"] {
        let path = format!("{path}{end}");
        as_key("GET", &path, "other").await.expect_problem(404, "unknown-job");
        assert_eq!(as_key("GET", &path, "one").await.status, 200);
    }
    as_key("DELETE", &path, "other").await.expect_problem(404, "unknown-job");
    let unknown = server.client.post(server.url("/v1/normals")).header("prefer", "respond-async");
    server.send(unknown.json(&request)).await.expect_problem(401, "unauthorized");
}

#[tokio::test(flavor = "multi_thread")]
async fn equal_jobs_at_once_share_one_factorization() {
    let server = Server::start().await;
    let points = fibonacci_sphere(1200);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6});
    let asked = (0..8).map(|_| ask(server.url("/v1/normals"), &request, &[]));
    let paths = futures_util::future::join_all(asked).await;
    for path in &paths {
        result(&server, path).await.expect_ok();
    }
    let metrics = server.get("/metrics").await.text;
    for line in [
        "gramian_solvers_prepared_total{kind=\"dense\",of=\"both\"} 1\n",
        "gramian_jobs_ended_total{outcome=\"succeeded\"} 8\n",
        "gramian_jobs{status=\"running\"} 0\n",
        "gramian_jobs{status=\"queued\"} 0\n",
    ] {
        assert!(metrics.contains(line), "{metrics}");
    }
}

#[tokio::test]
async fn without_a_store_results_take_no_more_memory_than_there_is_for_them() {
    // Results may take a 32nd of the memory for requests: a few megabytes.
    let server = Server::with_flags(&["--memory-bytes", "268435456"]).await;
    let points = fibonacci_sphere(600);
    let kernel = json!({"family": "matern", "length_scale": 0.5});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6});
    let path = ask(server.url("/v1/laplace-beltrami/matrix"), &request, &[]).await;
    let problem = result(&server, &path).await.expect_problem(413, "problem-too-large");
    assert!(problem["detail"].as_str().unwrap().contains("results"), "{problem}");
    // Deleted results free their memory for the next ones.
    for _ in 0..20 {
        let path = ask(server.url("/v1/normals"), &request, &[]).await;
        result(&server, &path).await.expect_ok();
        assert_eq!(delete(&server, &path).await, 204);
    }
    let metrics = server.get("/metrics").await.text;
    let held =
        metrics.lines().find(|line| line.starts_with("gramian_memory_used_bytes{part=\"jobs\"}")).unwrap();
    let held: f64 = held.rsplit_once(' ').unwrap().1.parse().unwrap();
    assert!(held < 65536.0, "{held}");
}

#[tokio::test]
async fn results_are_forgotten_after_their_time() {
    let server = Server::with_flags(&["--job-result-seconds", "0.5"]).await;
    let path = ask(server.url("/v1/normals"), &route_of("/v1/normals").request(), &[]).await;
    result(&server, &path).await.expect_ok();
    while server.get(&path).await.status == 200 {
        pause().await;
    }
    server.get(&path).await.expect_problem(404, "unknown-job");
}

async fn get(process: &Process, path: &str) -> Value {
    let answer = receive(unpooled().get(process.url(path))).await;
    assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.bytes));
    serde_json::from_slice(&answer.bytes).unwrap()
}

/// Returns a request whose job takes some seconds.
fn long_request() -> Value {
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    json!({"cloud": {"points": fibonacci_sphere(4000)}, "kernel": kernel, "alpha": 1e-6})
}

async fn wait_for(process: &Process, path: &str, status: &str) {
    while get(process, path).await["status"] != status {
        pause().await;
    }
}

#[tokio::test]
async fn a_job_survives_the_end_of_its_process() {
    let folder = Folder::new("jobs-killed");
    let mut process = Process::start(&folder.flags());
    let path = ask(process.url("/v1/normals"), &long_request(), &[]).await;
    wait_for(&process, &path, "running").await;
    process.child.kill().unwrap();
    process.child.wait().unwrap();
    let process = Process::start(&folder.flags());
    // The new process cannot know yet whether the previous one is only slow.
    assert_eq!(get(&process, &path).await["status"], "running");
    let found = get(&process, &format!("{path}/result")).await;
    let answer = receive(unpooled().post(process.url("/v1/normals")).json(&long_request())).await;
    let expected: Value = serde_json::from_slice(&answer.bytes).unwrap();
    assert_eq!(numbers_of(found), numbers_of(expected));
    assert_eq!(get(&process, &path).await["status"], "succeeded");
}

#[tokio::test]
async fn a_job_goes_on_elsewhere_when_its_process_is_told_to_end() {
    let folder = Folder::new("jobs-released");
    let [one, two] = [Process::start(&folder.flags()), Process::start(&folder.flags())];
    let path = ask(one.url("/v1/normals"), &long_request(), &[]).await;
    wait_for(&one, &path, "running").await;
    // The other process sees the job as well, with its progress.
    wait_for(&two, &path, "running").await;
    // A client that waits for the result at the first process is turned away with 503.
    let waiting = unpooled().get(one.url(&format!("{path}/result"))).send();
    let waiting = tokio::spawn(waiting);
    let is_there = async || {
        let metrics = receive(unpooled().get(one.url("/metrics"))).await;
        String::from_utf8(metrics.bytes).unwrap().contains("gramian_http_requests_in_flight 2\n")
    };
    while !is_there().await {
        pause().await;
    }
    one.terminate();
    assert!(one.finish().0.success());
    assert_eq!(waiting.await.unwrap().unwrap().status(), 503);
    assert_eq!(get(&two, &path).await["status"], "queued");
    wait_for(&two, &path, "succeeded").await;
}

#[tokio::test]
async fn a_job_is_cancelled_by_another_process() {
    let folder = Folder::new("jobs-cancelled");
    let [one, two] = [Process::start(&folder.flags()), Process::start(&folder.flags())];
    let path = ask(one.url("/v1/normals"), &slow_request(), &[]).await;
    wait_for(&two, &path, "running").await;
    assert_eq!(receive(unpooled().delete(two.url(&path))).await.status, 204);
    wait_for(&one, &path, "cancelled").await;
    let is_idle = async || {
        let metrics = receive(unpooled().get(one.url("/metrics"))).await;
        String::from_utf8(metrics.bytes).unwrap().contains("gramian_jobs{status=\"running\"} 0\n")
    };
    while !is_idle().await {
        pause().await;
    }
}

#[tokio::test]
async fn a_job_that_waits_is_begun_by_whoever_has_a_turn_and_once() {
    let folder = Folder::new("jobs-waiting");
    let flags = [&folder.flags()[..], &["--threads", "1"]].concat();
    let one = Process::start(&flags);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let minutes = json!({"cloud": {"points": fibonacci_sphere(18_000)}, "kernel": kernel, "alpha": 1e-6});
    let slow = ask(one.url("/v1/normals"), &minutes, &[]).await;
    wait_for(&one, &slow, "running").await;
    let path = ask(one.url("/v1/normals"), &long_request(), &[]).await;
    let two = Process::start(&flags);
    // The first process, where the job waits, learns that the other one has begun it.
    wait_for(&one, &path, "running").await;
    get(&one, &format!("{path}/result")).await;
    assert_eq!(get(&one, &path).await["status"], "succeeded");
    assert_eq!(get(&one, &slow).await["status"], "running");
    let waits_for_nothing = async || {
        let metrics = receive(unpooled().get(one.url("/metrics"))).await;
        String::from_utf8(metrics.bytes).unwrap().contains("gramian_jobs{status=\"queued\"} 0\n")
    };
    while !waits_for_nothing().await {
        pause().await;
    }
    for path in [&slow, &path] {
        assert_eq!(receive(unpooled().delete(two.url(path))).await.status, 204);
    }
    let (_, log) = {
        two.terminate();
        two.finish()
    };
    let n_taken_up = log.iter().filter(|line| line.contains("an abandoned job is resumed")).count();
    assert_eq!(n_taken_up, 1, "{log:?}");
}

#[tokio::test]
async fn a_request_does_not_wait_for_a_job() {
    let server = Server::with_flags(&["--threads", "1"]).await;
    let path = ask(server.url("/v1/normals"), &slow_request(), &[]).await;
    while server.get(&path).await.expect_ok()["progress"]["stage"] != "factor" {
        pause().await;
    }
    // Enough work to make other requests wait for it.
    let points = fibonacci_sphere(3200);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6});
    server.post("/v1/normals", &request).await.expect_ok();
    assert_eq!(server.get(&path).await.expect_ok()["status"], "running");
    assert_eq!(delete(&server, &path).await, 204);
}

#[tokio::test]
async fn jobs_of_one_key_leave_places_to_another() {
    // Four jobs may wait or run here, two for each of two keys.
    let flags = ["--threads", "1", "--max-queue", "3", "--api-keys", "greedy,modest"];
    let server = Server::with_flags(&flags).await;
    let asking = |key: &'static str| {
        let request = server.client.post(server.url("/v1/normals")).bearer_auth(key);
        request.header("prefer", "respond-async").json(&slow_request()).send()
    };
    for (key, status) in [("greedy", 202), ("greedy", 202), ("greedy", 503), ("modest", 202)] {
        assert_eq!(asking(key).await.unwrap().status(), status, "{key}");
    }
    // One job of each key runs, although there is one thread. So no key waits for the other key's job to end.
    // The queue depth, by which a fleet scales, counts the waiting job, which no lane knows yet.
    let is_so = |metrics: &str| {
        ["queue_depth", "jobs{status=\"queued\"}"]
            .iter()
            .all(|name| metrics.contains(&format!("\ngramian_{name} 1\n")))
            && metrics.contains("\ngramian_jobs{status=\"running\"} 2\n")
    };
    while !is_so(&server.get("/metrics").await.text) {
        pause().await;
    }
}

#[tokio::test]
async fn as_many_may_follow_jobs_as_half_of_the_connections() {
    let server = Server::with_flags(&["--threads", "1", "--max-connections", "8"]).await;
    let path = ask(server.url("/v1/normals"), &slow_request(), &[]).await;
    let follow = || unpooled().get(server.url(&format!("{path}/events"))).send();
    let mut following = Vec::new();
    for _ in 0..4 {
        let events = follow().await.unwrap();
        assert_eq!(events.status(), 200);
        following.push(events);
    }
    assert_eq!(follow().await.unwrap().status(), 503);
    // A client that waits for a result occupies a connection as well.
    result(&server, &path).await.expect_problem(503, "overloaded");
    drop(following);
    while follow().await.unwrap().status() == 503 {
        pause().await;
    }
    assert_eq!(delete(&server, &path).await, 204);
}
