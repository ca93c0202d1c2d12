//! The factor cache: concurrent and repeated requests share one factorization.

use std::time::Instant;

use serde_json::{Value, json};

use crate::support::{Server, fibonacci_sphere, pause, receive};

fn interpolation(n: usize, queries: &[[f64; 3]]) -> Value {
    let points = fibonacci_sphere(n);
    let values: Vec<f64> = points.iter().map(|x| x[0] * x[1] + x[2]).collect();
    json!({
        "cloud": {"points": points},
        "kernel": {"family": "matern", "length_scale": 0.5},
        "alpha": 1e-8,
        "values": values,
        "queries": queries,
    })
}

#[tokio::test]
async fn the_second_request_is_a_hit_and_ten_times_faster() {
    let server = Server::start().await;
    let request = interpolation(2000, &[[1.0, 0.0, 0.0]]).to_string();
    let began = Instant::now();
    let first = server.post_text("/v1/interpolation", request.clone()).await;
    let first_time = began.elapsed();
    assert_eq!(first.header("cache-status"), "gramian; fwd=miss; stored");
    let mut times = Vec::new();
    for _ in 0..5 {
        let began = Instant::now();
        let next = server.post_text("/v1/interpolation", request.clone()).await;
        times.push(began.elapsed());
        assert_eq!(next.header("cache-status"), "gramian; hit");
        assert_eq!(next.json()["values"], first.json()["values"]);
    }
    times.sort();
    // The factor 10 is the requirement of the issue. The median is used because single measurements may be
    // disturbed.
    assert!(times[2] * 10 <= first_time, "{first_time:?} first, then {times:?}");
}

#[tokio::test]
async fn interpolation_geometry_and_posterior_share_one_factorization() {
    let server = Server::start().await;
    let mut request = interpolation(200, &[[1.0, 0.0, 0.0]]);
    let first = server.post("/v1/interpolation", &request).await;
    assert_eq!(first.header("cache-status"), "gramian; fwd=miss; stored");
    for path in ["/v1/posterior", "/v1/surface-gradient", "/v1/laplace-beltrami"] {
        assert_eq!(server.post(path, &request).await.header("cache-status"), "gramian; hit", "{path}");
    }
    request.as_object_mut().unwrap().remove("values");
    let id = first.json()["diagnostics"]["cloud_id"].clone();
    request["cloud"] = json!({"id": id});
    for path in
        ["/v1/normals", "/v1/curvatures", "/v1/surface-gradient/matrix", "/v1/laplace-beltrami/matrix"]
    {
        let answer = server.post(path, &request).await;
        assert_eq!((answer.status, answer.header("cache-status")), (200, "gramian; hit"), "{path}");
        let timing = answer.header("server-timing");
        for stage in
            ["parse;dur=", "gram;dur=0.000", "factor;dur=0.000", "solve;dur=", "evaluate;dur=", "encode;dur="]
        {
            assert!(timing.contains(stage), "{path}: {timing}");
        }
    }
}

#[tokio::test]
async fn with_two_factors_only_two_hits_are_a_hit() {
    let server = Server::start().await;
    let mut request = interpolation(100, &[[1.0, 0.0, 0.0]]);
    server.post("/v1/interpolation", &request).await;
    request["surface"] = json!({"kernel": {"family": "laplace", "epsilon": 1.0, "length_scale": 1.0}});
    let outcome =
        async || server.post("/v1/laplace-beltrami", &request).await.header("cache-status").to_owned();
    assert_eq!(outcome().await, "gramian; fwd=miss; stored");
    assert_eq!(outcome().await, "gramian; hit");
}

/// Counts the answers by cache outcome: (stored, collapsed, hit). A stored one computed the factor.
async fn count_outcomes(requests: Vec<tokio::task::JoinHandle<String>>) -> (usize, usize, usize) {
    let mut outcomes = Vec::new();
    for request in requests {
        outcomes.push(request.await.unwrap());
    }
    let count = |text: &str| outcomes.iter().filter(|outcome| *outcome == text).count();
    (count("gramian; fwd=miss; stored"), count("gramian; fwd=miss; collapsed"), count("gramian; hit"))
}

fn spawn_request(server: &Server, body: &str) -> tokio::task::JoinHandle<String> {
    let request = server.client.post(server.url("/v1/interpolation"));
    let request = request.header("content-type", "application/json").body(body.to_owned());
    tokio::spawn(async move {
        let answer = receive(request).await;
        assert_eq!(answer.status, 200);
        answer.header("cache-status").to_owned()
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn thirty_two_identical_requests_cost_one_factorization() {
    let server = Server::start().await;
    let body = interpolation(1500, &[[1.0, 0.0, 0.0]]).to_string();
    let requests = (0..32).map(|_| spawn_request(&server, &body)).collect();
    let (stored, collapsed, hit) = count_outcomes(requests).await;
    assert_eq!((stored, collapsed + hit), (1, 31));
    assert!(collapsed > 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn they_cost_one_factorization_also_when_the_first_client_disconnects() {
    let server = Server::start().await;
    let body = interpolation(2500, &[[1.0, 0.0, 0.0]]).to_string();
    let first = spawn_request(&server, &body);
    // The first request is under way once its cloud is registered.
    let is_registered =
        async || server.get("/v1/clouds").await.json()["clouds"].as_array().unwrap().len() == 1;
    while !is_registered().await {
        pause().await;
    }
    let others: Vec<_> = (0..31).map(|_| spawn_request(&server, &body)).collect();
    first.abort();
    let (stored, collapsed, hit) = count_outcomes(others).await;
    // Requests that join the first computation collapse on it, and none begins a second one while it runs. If
    // the first client left before any other came, exactly one of the others starts again.
    assert!(stored <= 1, "{stored} factorizations");
    assert_eq!(stored + collapsed + hit, 31);
    let after = server.post_text("/v1/interpolation", body).await;
    assert_eq!(after.header("cache-status"), "gramian; hit");
}

#[tokio::test]
async fn a_failed_factorization_does_not_poison_its_key() {
    let server = Server::start().await;
    let mut request = interpolation(3, &[[1.0, 0.0, 0.0]]);
    request["cloud"] = json!({"points": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]});
    request["alpha"] = json!(0);
    for _ in 0..2 {
        server.post("/v1/interpolation", &request).await.expect_problem(422, "duplicate-points");
    }
    request["duplicates"] = json!("merge");
    server.post("/v1/interpolation", &request).await.expect_ok();
}

#[tokio::test]
async fn deleting_a_cloud_forgets_its_factors() {
    let server = Server::start().await;
    let request = interpolation(50, &[[1.0, 0.0, 0.0]]);
    let first = server.post("/v1/interpolation", &request).await;
    let id = first.json()["diagnostics"]["cloud_id"].as_str().unwrap().to_owned();
    let url = server.url(&format!("/v1/clouds/{id}"));
    assert_eq!(server.send(server.client.delete(&url)).await.status, 204);
    assert_eq!(server.send(server.client.delete(&url)).await.status, 404);
    let again = server.post("/v1/interpolation", &request).await;
    assert_eq!(again.header("cache-status"), "gramian; fwd=miss; stored");
}
