//! Overload: large requests do not hold up small ones, and one key does not hold up another.

use std::time::Instant;

use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::all_routes::{lattice, route_of};
use crate::process::metrics::samples;
use crate::support::{Answer, Server, fibonacci_sphere, pause};

/// Returns a request with a cloud of `n` points, a different one for each `k`.
fn request_of(n: usize, k: usize) -> Value {
    let mut points = fibonacci_sphere(n);
    points[0][0] += 1e-6 * (k + 1) as f64;
    json!({"cloud": {"points": points}, "kernel": {"family": "matern", "length_scale": 0.5}, "alpha": 1e-6})
}

#[tokio::test(flavor = "multi_thread")]
async fn small_requests_are_answered_while_large_ones_compute_and_wait_for_memory() {
    // Some 300 MB of the budget are for computations. One factorization of 5,000 points takes 200 MB while it
    // runs.
    let server = Server::with_flags(&["--threads", "2", "--memory-bytes", "536870912"]).await;
    let large: Vec<_> = (0..3)
        .map(|k| {
            let request = server.client.post(server.url("/v1/normals")).json(&request_of(5000, k));
            tokio::spawn(request.send())
        })
        .collect();
    // Once their clouds are registered, the first of them computes and the others wait behind it.
    while server.get("/v1/clouds").await.expect_ok()["clouds"].as_array().unwrap().len() < 3 {
        pause().await;
    }
    for k in 0..20 {
        server.post("/v1/normals", &request_of(100, k)).await.expect_ok();
    }
    let n_waiting = large.iter().filter(|large| !large.is_finished()).count();
    assert!(n_waiting >= 2, "only {n_waiting} of 3 were still waiting");
    for answer in join_all(large).await {
        assert_eq!(answer.unwrap().unwrap().status(), 200);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn looking_at_a_cloud_ends_with_its_deadline_and_lists_look_at_none() {
    let server = Server::with_flags(&["--threads", "2", "--deadline-seconds", "1"]).await;
    // In 16 dimensions the search compares every point with most others.
    let body = json!({"points": lattice(40_000, 16)});
    server.post("/v1/clouds", &body).await.expect_problem(504, "deadline-exceeded");
    let list = server.get("/v1/clouds").await.expect_ok();
    let cloud = &list["clouds"][0];
    assert_eq!((&cloud["n_points"], &cloud["n_duplicates"]), (&json!(40_000), &json!(0)));
    assert!(cloud.get("spacing").is_none() && cloud["bounding_box"]["min"].is_array());
    // The threads are free again. Otherwise this small request would be late as well.
    let small = server.post("/v1/clouds", &json!({"points": lattice(50, 16)})).await;
    assert!(small.json()["spacing"]["median"].as_f64().unwrap() > 0.0);
    let list = server.get("/v1/clouds").await.expect_ok();
    assert!(list["clouds"][1]["spacing"].is_object());
}

async fn post_as(server: &Server, key: &str, path: &str, body: &Value) -> Answer {
    server.send(server.client.post(server.url(path)).bearer_auth(key).json(body)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn one_key_leaves_places_turns_and_memory_to_another() {
    let flags = ["--threads", "1", "--max-queue", "5", "--api-keys", "greedy,modest"];
    let server = Server::with_flags(&flags).await;
    let slow: Vec<_> = (0..3)
        .map(|k| {
            let request = server.client.post(server.url("/v1/normals")).bearer_auth("greedy");
            let request = request.json(&request_of(6000, k));
            tokio::spawn(request.send())
        })
        .collect();
    while samples(&server).await["gramian_compute_admitted"] < 3.0 {
        assert!(slow.iter().any(|slow| !slow.is_finished()), "the slow ones were over too soon");
    }
    let small = route_of("/v1/normals").request();
    let refused = post_as(&server, "greedy", "/v1/normals", &small).await;
    refused.expect_problem(503, "overloaded");
    for k in 0..5 {
        post_as(&server, "modest", "/v1/normals", &request_of(60, k)).await.expect_ok();
    }
    // Nor does it wait for everything that the other key has begun: the next turn belongs to it.
    post_as(&server, "modest", "/v1/normals", &request_of(2500, 0)).await.expect_ok();
    assert!(slow.iter().any(|slow| !slow.is_finished()), "the slow ones were over too soon");
    slow.iter().for_each(tokio::task::JoinHandle::abort);
}

#[tokio::test(flavor = "multi_thread")]
async fn retry_after_is_when_there_is_a_place() {
    let server = Server::with_flags(&["--threads", "1", "--max-queue", "0"]).await;
    // The first request calibrates the speed of this machine.
    server.post("/v1/normals", &request_of(2500, 100)).await.expect_ok();
    let mut ratios = Vec::new();
    for k in 0..3 {
        let slow = server.client.post(server.url("/v1/normals")).json(&request_of(7000, k));
        let slow = tokio::spawn(slow.send());
        // The slow request holds the only place once the server is not ready. The probe itself takes none.
        while server.get("/health/ready").await.status == 200 && !slow.is_finished() {
            pause().await;
        }
        let refused = loop {
            let answer = server.post("/v1/normals", &request_of(30, k)).await;
            // A moment later the slow request has begun, and its end can be predicted.
            if answer.status == 503 && answer.header("retry-after") != "1" || slow.is_finished() {
                break answer;
            }
        };
        let refused_at = Instant::now();
        assert_eq!(slow.await.unwrap().unwrap().status(), 200);
        // A value of 1 may have been sent at any moment of the last second.
        if refused.status == 503 && refused.header("retry-after") != "1" {
            let seconds: f64 = refused.header("retry-after").parse().unwrap();
            ratios.push(seconds / refused_at.elapsed().as_secs_f64());
        }
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied();
    // If the slow request takes no more than a second, `Retry-After` can only be 1.
    assert!(median.is_none_or(|median| (0.5..=2.0).contains(&median)), "{ratios:?}");
}
