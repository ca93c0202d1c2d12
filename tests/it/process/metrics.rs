//! Metrics of the service.

use std::collections::BTreeMap;

use serde_json::json;

use crate::all_routes::route_of;
use crate::support::{Server, pause};

/// Returns the samples by name and labels, as they are written.
pub async fn samples(server: &Server) -> BTreeMap<String, f64> {
    let answer = server.get("/metrics").await;
    assert_eq!(
        (answer.status, answer.header("content-type")),
        (200, "text/plain; version=0.0.4; charset=utf-8")
    );
    parse(&answer.text)
}

fn parse(text: &str) -> BTreeMap<String, f64> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| line.rsplit_once(' ').unwrap())
        .map(|(name, x)| (name.to_owned(), x.parse().unwrap()))
        .collect()
}

#[tokio::test]
async fn requests_are_counted_by_route_and_never_by_what_clients_send() {
    let server = Server::start().await;
    let route = route_of("/v1/interpolation");
    let first = server.post(route.path, &route.request()).await;
    assert_eq!(first.header("cache-status"), "gramian; fwd=miss; stored");
    for _ in 0..3 {
        server.post(route.path, &route.request()).await.expect_ok();
    }
    server.post(route.path, &json!({"nothing": 1})).await.expect_problem(422, "invalid-request");
    let secret = "0123456789abcdef".repeat(4);
    server.get(&format!("/v1/clouds/{secret}")).await.expect_problem(404, "unknown-cloud");
    server.get(&format!("/no/{secret}")).await.expect_problem(404, "not-found");
    let brew = server.client.request("BREW".parse().unwrap(), server.url("/v1/kernels"));
    assert_eq!(server.send(brew).await.status, 405);
    let samples = samples(&server).await;
    let of = |name: &str| *samples.get(name).unwrap_or_else(|| panic!("no {name} in {samples:#?}"));
    let requests = |labels: &str| of(&format!("gramian_http_requests_total{{{labels}}}"));
    assert_eq!(requests(r#"method="POST",route="/v1/interpolation",status="200""#), 4.0);
    assert_eq!(requests(r#"method="POST",route="/v1/interpolation",status="422""#), 1.0);
    assert_eq!(requests(r#"method="GET",route="/v1/clouds/{cloud_id}",status="404""#), 1.0);
    assert_eq!(requests(r#"method="GET",route="other",status="404""#), 1.0);
    assert_eq!(requests(r#"method="other",route="/v1/kernels",status="405""#), 1.0);
    let seconds = r#"method="POST",route="/v1/interpolation""#;
    assert_eq!(of(&format!("gramian_http_request_duration_seconds_count{{{seconds}}}")), 5.0);
    assert!(of(&format!("gramian_http_request_duration_seconds_sum{{{seconds}}}")) > 0.0);
    assert_eq!(of(r#"gramian_problems_total{type="unknown-cloud"}"#), 1.0);
    assert_eq!(of(r#"gramian_problems_total{type="overloaded"}"#), 0.0);
    assert_eq!(of(r#"gramian_cache_requests_total{outcome="miss"}"#), 1.0);
    assert_eq!(of(r#"gramian_cache_requests_total{outcome="hit"}"#), 3.0);
    assert_eq!(of(r#"gramian_solvers_prepared_total{kind="dense",of="both"}"#), 1.0);
    assert_eq!(of(r#"gramian_cache_entries{part="clouds"}"#), 1.0);
    assert_eq!(of(r#"gramian_cache_evictions_total{part="clouds"}"#), 0.0);
    assert!(of(r#"gramian_memory_used_bytes{part="cache"}"#) > 0.0);
    // The request for the metrics is itself in flight.
    assert_eq!((of("gramian_http_requests_in_flight"), of("gramian_compute_admitted")), (1.0, 0.0));
    assert_eq!((of("gramian_queue_depth"), of("gramian_store_up_to_date")), (0.0, 1.0));
    assert!(of("process_resident_memory_bytes") > 1e6 && of("process_open_fds") > 3.0);
    assert!(!samples.keys().any(|name| name.contains(&secret[..16])));
}

#[tokio::test]
async fn who_leaves_is_counted_as_well() {
    let server = Server::start().await;
    let points: Vec<_> = crate::support::fibonacci_sphere(8000);
    let body = json!({"cloud": {"points": points}, "values": vec![1.0; 8000], "kernel": {"family": "gauss", "length_scale": 0.1}});
    let request = server.client.post(server.url("/v1/interpolation")).json(&body).send();
    let mut request = Box::pin(request);
    let in_flight = "gramian_http_requests_in_flight";
    // Polled until the request has arrived. Its answer takes longer.
    while samples(&server).await[in_flight] < 2.0 {
        assert!(futures_util::poll!(&mut request).is_pending());
    }
    drop(request);
    let abandoned = r#"gramian_http_requests_total{method="POST",route="/v1/interpolation",status="499"}"#;
    while samples(&server).await.get(abandoned) != Some(&1.0) {
        pause().await;
    }
    assert_eq!(samples(&server).await[in_flight], 1.0);
}

#[tokio::test]
async fn many_who_read_at_once_count_nothing_twice() {
    let server = Server::with_flags(&["--cloud-bytes", "65536"]).await;
    for shift in 0..40 {
        let points: Vec<[f64; 2]> = (0..500).map(|i| [f64::from(i), f64::from(shift)]).collect();
        assert_eq!(server.post("/v1/clouds", &json!({"points": points})).await.status, 201);
    }
    let all = futures_util::future::join_all((0..16).map(|_| samples(&server))).await;
    let evictions = all.iter().map(|samples| samples[r#"gramian_cache_evictions_total{part="clouds"}"#]);
    let last = samples(&server).await;
    let n_evicted = last[r#"gramian_cache_evictions_total{part="clouds"}"#];
    assert!(n_evicted > 30.0 && evictions.into_iter().all(|n| n == n_evicted));
    assert_eq!(n_evicted + last[r#"gramian_cache_entries{part="clouds"}"#], 40.0);
}

#[tokio::test]
async fn every_answer_about_a_cloud_names_it() {
    let server = Server::start().await;
    let cloud = server.post("/v1/clouds", &json!({"points": [[0.0, 1.0], [1.0, 0.0], [0.5, 0.7]]})).await;
    let id = cloud.json()["cloud_id"].as_str().unwrap().to_owned();
    let path = format!("/v1/clouds/{id}");
    assert_eq!(cloud.header("gramian-cloud"), id);
    assert_eq!(server.get(&path).await.header("gramian-cloud"), id);
    let kernel = json!({"family": "gauss", "length_scale": 1.0});
    let ask = |cloud: serde_json::Value| json!({"cloud": cloud, "values": [1, 2, 3], "kernel": kernel});
    let by_id = server.post("/v1/interpolation", &ask(json!({"id": id}))).await;
    let inline =
        server.post("/v1/interpolation", &ask(json!({"points": [[0.0, 1.0], [1.0, 0.0], [0.5, 0.7]]}))).await;
    assert_eq!((by_id.header("gramian-cloud"), inline.header("gramian-cloud")), (&*id, &*id));
    // Refusals also return the cloud that a client names for proxies, unless it is not an id.
    for (sent, expected) in [(&*id, Some(&*id)), ("<script>", None)] {
        let request = server.client.post(server.url("/v1/interpolation")).header("gramian-cloud", sent);
        let request = request.header("content-type", "application/json").body("{");
        let refused = server.send(request).await;
        refused.expect_problem(400, "malformed-json");
        assert_eq!(refused.headers.get("gramian-cloud").map(|value| value.to_str().unwrap()), expected);
    }
}
