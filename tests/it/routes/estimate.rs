//! Estimates: the cost of a request before it is sent.

use std::time::Instant;

use serde_json::{Value, json};

use crate::all_routes::{ROUTES, route_of};
use crate::common::random::Random;
use crate::process::metrics::samples;
use crate::support::{Answer, Server, document, fibonacci_sphere, pause};

async fn estimate(server: &Server, operation: &str, request: &Value) -> Answer {
    let mut body = request.clone();
    body["operation"] = json!(operation);
    server.post("/v1/estimate", &body).await
}

/// Returns id and path of each operation that computes from a body.
fn operations() -> Vec<(String, String)> {
    let document = document();
    let named = |(path, item): (&String, &Value)| {
        let operation = item.get("post")?;
        let id = operation["operationId"].as_str()?;
        let needs_none = ["create_cloud", "estimate", "choose_coarse_cloud", "choose_sides"];
        (operation.get("requestBody").is_some() && !needs_none.contains(&id))
            .then(|| (id.to_owned(), path.clone()))
    };
    document["paths"].as_object().unwrap().iter().filter_map(named).collect()
}

/// Returns a request of an operation over a sphere of `n` points. Each `shift` gives a different cloud.
fn request(path: &str, n: usize, shift: f64) -> Value {
    let points: Vec<_> = fibonacci_sphere(n).iter().map(|x| [x[0] + shift, x[1], x[2]]).collect();
    if path.ends_with("regions") {
        let cloud = json!({"points": points, "normals": fibonacci_sphere(n)});
        return json!({"cloud": cloud, "own": (0..n).collect::<Vec<_>>()});
    }
    let queries = points[..n / 4].to_vec();
    let values: Vec<f64> = points.iter().map(|x| (2.0 * x[1]).sin() + x[2]).collect();
    let mut request = json!({"cloud": {"points": points}, "queries": queries});
    let is_sparse = path.ends_with("sparse-matrix");
    if path.ends_with("/batch") {
        request["values"] = json!([values, values.iter().map(|y| y * y).collect::<Vec<_>>()]);
    } else if !path.ends_with("matrix") && !path.contains("normals") && !path.contains("curvatures") {
        request["values"] = json!(values);
    }
    if is_sparse {
        request["surface"] = json!({"model": "regression"});
    } else {
        request["kernel"] = json!({"family": "matern", "length_scale": 0.5});
        request["alpha"] = json!(1e-6);
    }
    if path.ends_with("level-set") {
        // Kernels for values say little of a surface.
        request.as_object_mut().unwrap().retain(|name, _| name == "cloud");
    }
    if path.ends_with("model-selection") {
        request.as_object_mut().unwrap().remove("queries");
        request["vary"] = json!([{"parameter": "length_scale", "min": 0.1, "max": 2.0}]);
        request["restarts"] = json!(0);
    }
    request
}

#[tokio::test]
async fn an_estimate_says_what_is_missing_and_makes_none_of_it() {
    let server = Server::start().await;
    let document = document();
    let names = &document["components"]["schemas"]["OperationName"]["enum"];
    let mut known: Vec<_> =
        names.as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect();
    let mut expected: Vec<_> = operations().into_iter().map(|(id, _)| id).collect();
    known.sort();
    expected.sort();
    assert_eq!(known, expected);
    for (index, (id, path)) in operations().iter().enumerate() {
        let request = request(path, 120, index as f64);
        let before = estimate(&server, id, &request).await.expect_ok();
        assert_eq!((&before["operation"], &before["admissible"]), (&json!(id), &json!(true)), "{before}");
        assert_eq!(before["cached"], json!(false), "{id}: {before}");
        assert_eq!(estimate(&server, id, &request).await.expect_ok()["cached"], json!(false));
        let answer = server.post(path, &request).await;
        assert_eq!(answer.status, 200, "{id}: {}", answer.text);
        assert_eq!(answer.json()["diagnostics"]["solver"], before["solver"], "{id}");
        let after = estimate(&server, id, &request).await.expect_ok();
        assert_eq!(after["cached"], true, "{id}: {after}");
        // Model selection computes everything itself, whatever the caches hold.
        let is_found = path.ends_with("model-selection");
        let smaller = |name: &str| after[name].as_f64().unwrap() < before[name].as_f64().unwrap();
        assert!(is_found || smaller("flops") && smaller("bytes"), "{id}: {before} {after}");
        assert!(after["seconds"].as_f64().unwrap() > 0.0);
    }
}

#[tokio::test]
async fn what_would_be_refused_is_refused_with_the_same_problem() {
    let server = Server::start().await;
    let operation = |path: &str| operations().into_iter().find(|(_, of)| of == path).unwrap().0;
    for route in &ROUTES {
        for (pointer, value) in
            [("/alpha", json!(-1.0)), ("/nothing", json!(1)), ("/cloud/points/3/1", json!("x"))]
        {
            let bad = route.with(pointer, &value);
            let expected = server.post(route.path, &bad).await;
            let found = estimate(&server, &operation(route.path), &bad).await;
            let [expected, found] =
                [&expected, &found].map(|answer| answer.expect_problem(422, "invalid-request"));
            assert_eq!(found["errors"][0]["pointer"], expected["errors"][0]["pointer"], "{}", route.path);
        }
    }
    let good = route_of("/v1/normals").request();
    for (bad, pointer) in [
        (json!("no_such_operation"), "/operation"),
        (json!(3), "/operation"),
        (json!("estimate"), "/operation"),
    ] {
        let mut body = good.clone();
        body["operation"] = bad;
        let problem = server.post("/v1/estimate", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
    let problem = server.post("/v1/estimate", &good).await.expect_problem(422, "invalid-request");
    assert_eq!(problem["errors"][0]["pointer"], "/operation");
    // The request is checked as one of the named operation.
    estimate(&server, "compute_interpolation", &good).await.expect_problem(422, "invalid-request");
    estimate(&server, "compute_normals", &json!({"cloud": {"id": "0".repeat(64)}}))
        .await
        .expect_problem(404, "unknown-cloud");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_takes_too_long_is_told_and_not_begun_unless_the_server_is_idle() {
    let server = Server::with_flags(&["--deadline-seconds", "1"]).await;
    let request = request("/v1/normals", 12_000, 0.0);
    let estimated = estimate(&server, "compute_normals", &request).await.expect_ok();
    assert_eq!(estimated["admissible"], false, "{estimated}");
    // 12,000³/3 flops at 20 Gflop/s, before any measurement.
    assert!(estimated["seconds"].as_f64().unwrap() > 20.0, "{estimated}");
    let detail = |answer: &Answer| {
        let problem = answer.expect_problem(504, "deadline-exceeded");
        problem["detail"].as_str().unwrap().to_owned()
    };
    // Nobody waits for an idle server, so it tries, and the deadline ends what takes too long.
    assert!(detail(&server.post("/v1/normals", &request).await).contains("no answer within 1 s"));
    let slow = server.client.post(server.url("/v1/normals")).json(&request);
    let slow = tokio::spawn(slow.send());
    while samples(&server).await["gramian_compute_running{lane=\"exclusive\"}"] < 1.0 && !slow.is_finished() {
        pause().await;
    }
    let refused = detail(&server.post("/v1/normals", &request).await);
    assert!(slow.is_finished() || refused.contains("nothing was computed"), "{refused}");
    assert_eq!(slow.await.unwrap().unwrap().status(), 504);
}

/// Sends a request with a key.
async fn post_as(server: &Server, key: &str, path: &str, body: &Value) -> Answer {
    server.send(server.client.post(server.url(path)).bearer_auth(key).json(body)).await
}

/// Returns the estimated seconds of an interpolation for a key.
async fn seconds_as(server: &Server, key: &str, request: &Value) -> f64 {
    let mut body = request.clone();
    body["operation"] = json!("compute_interpolation");
    let estimated = post_as(server, key, "/v1/estimate", &body).await.expect_ok();
    estimated["seconds"].as_f64().unwrap()
}

/// Returns a request whose values take conjugate gradients no iteration if `scale` is 0.
fn iterated(scale: f64) -> Value {
    let points = fibonacci_sphere(2500);
    let values: Vec<f64> = points.iter().map(|x| scale * (3.0 * x[0]).sin() + scale * x[1]).collect();
    json!({
        "cloud": {"points": points}, "values": values, "queries": points[..1], "solver": "iterative",
        "kernel": {"family": "matern", "nu": 0.5, "length_scale": 0.5}, "alpha": 1e-6, "mean": "zero",
    })
}

#[tokio::test]
async fn what_one_key_sends_changes_the_estimates_of_another_by_at_most_a_factor_of_two() {
    let server = Server::with_flags(&["--api-keys", "greedy,modest"]).await;
    let known = |scale: f64| iterated(1.0 + scale);
    post_as(&server, "modest", "/v1/interpolation", &known(0.0)).await.expect_ok();
    post_as(&server, "greedy", "/v1/interpolation", &known(0.0)).await.expect_ok();
    // Large enough that each request counts.
    let mut body = known(0.5);
    body["operation"] = json!("compute_interpolation");
    let estimated = post_as(&server, "modest", "/v1/estimate", &body).await.expect_ok();
    assert!(estimated["flops"].as_f64().unwrap() > 2e8, "{estimated}");
    let (of_modest, of_greedy) =
        (seconds_as(&server, "modest", &known(0.5)).await, seconds_as(&server, "greedy", &known(0.5)).await);
    for _ in 0..12 {
        post_as(&server, "greedy", "/v1/interpolation", &iterated(0.0)).await.expect_ok();
    }
    let after = seconds_as(&server, "modest", &known(0.5)).await;
    assert!((0.499..=2.001).contains(&(after / of_modest)), "{of_modest} s before, {after} s after");
    // Values that need no iteration do not affect the price of others, not even for the same key.
    let after = seconds_as(&server, "greedy", &known(0.5)).await;
    assert!((0.999..=1.001).contains(&(after / of_greedy)), "{of_greedy} s before, {after} s after");
}

/// Dimensions in which estimated times are compared with measured ones.
const DIMENSIONS: [usize; 7] = [2, 3, 4, 6, 8, 12, 16];

/// Seconds from which on a request counts: shorter times say little about its estimate.
const LEAST_SECONDS: f64 = 1e-3;

/// Returns `n` random points on the unit sphere in `d` dimensions.
fn sphere(n: usize, d: usize) -> Vec<Vec<f64>> {
    let mut random = Random(d as u64);
    let point = |_| {
        let x: Vec<f64> = (0..d).map(|_| random.normal()).collect();
        let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
        x.iter().map(|c| c / length).collect()
    };
    (0..n).map(point).collect()
}

/// Returns a request of an operation in `d` dimensions, with parameters that suit every dimension.
fn request_in(path: &str, n: usize, d: usize) -> Value {
    let points = sphere(n, d);
    let outside = |x: &Vec<f64>| x.iter().map(|c| 1.01 * c).collect::<Vec<_>>();
    let mut request = request(path, n, 0.0);
    request["cloud"] = json!({"points": points});
    if path.ends_with("regions") {
        request["cloud"]["normals"] = json!(points);
    }
    if request.get("queries").is_some() {
        request["queries"] = json!(points[..n / 4].iter().map(outside).collect::<Vec<_>>());
    }
    if request.get("kernel").is_some() {
        request["kernel"]["length_scale"] = json!(2.0);
    }
    request
}

/// Returns the optional parts of an operation's request, as the document lists them. Each name of `include`
/// comes alone. Orders of derivatives, the local solver, surfaces and samples follow.
fn variants(document: &Value, path: &str) -> Vec<Value> {
    let resolve = |schema: &Value| match schema["$ref"].as_str() {
        Some(name) => document.pointer(name.trim_start_matches('#')).unwrap().clone(),
        None => schema.clone(),
    };
    let body = &document["paths"][path]["post"]["requestBody"]["content"]["application/json"]["schema"];
    let properties = resolve(body)["properties"].clone();
    let include = resolve(&properties["include"]["items"]);
    let names = include["enum"].as_array().cloned().unwrap_or_default();
    let mut all: Vec<Value> = names.iter().map(|name| json!({"include": [name]})).collect();
    if properties.get("derivatives").is_some() {
        all.extend((1..=2).flat_map(|order| {
            [json!({"derivatives": order}), json!({"derivatives": order, "include": ["std"]})]
        }));
    }
    if path == "/v1/interpolation" || path == "/v1/posterior" {
        let local = all.clone().into_iter().map(|mut extra| {
            extra["solver"] = json!("local");
            extra
        });
        all.extend(local.collect::<Vec<_>>());
    }
    if properties.get("surface_model").is_some() {
        all.extend(
            ["signature", "local"].map(|surface| json!({"surface_model": surface, "include": ["std"]})),
        );
    }
    if properties.get("samples").is_some() {
        all.push(json!({"samples": {"count": 50}, "quantiles": [0.1, 0.9], "threshold": 0.5}));
    }
    all
}

/// Compares estimates with times, for every operation in every dimension, plain and with each optional part.
/// All optional parts are estimated before any is computed in that dimension. So each time measures its
/// estimate, not the calibration by itself.
#[tokio::test]
async fn seconds_are_within_a_factor_of_two_in_the_median_over_routes_dimensions_and_inclusions() {
    let server = Server::with_flags(&["--deadline-seconds", "300"]).await;
    let document = document();
    let mut ratios = Vec::new();
    // The first round only calibrates the speed of the machine.
    for (round, d) in [3].into_iter().chain(DIMENSIONS).enumerate() {
        let most = |path: &str| match path {
            "/v1/level-set" => 3,
            _ if path.ends_with("sparse-matrix") || path.ends_with("regions") => 4,
            _ => usize::MAX,
        };
        for (id, path) in operations().iter().filter(|(_, path)| d <= most(path)) {
            let plain = request_in(path, 240 - usize::from(round == 0), d);
            let extended = variants(&document, path).into_iter().map(|extra| {
                let mut request = plain.clone();
                request.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
                request
            });
            // First with everything missing from the caches, then with everything present.
            let mut found = ratios_of(&server, id, path, std::slice::from_ref(&plain)).await;
            let extended: Vec<Value> = extended.chain([plain.clone()]).collect();
            found.extend(ratios_of(&server, id, path, &extended).await);
            if round > 0 {
                ratios.extend(found);
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[(share * ratios.len() as f64) as usize];
    println!("factors of {} requests: median {:.2}, nine tenths {:.2}", ratios.len(), at(0.5), at(0.9));
    assert!(ratios.len() > 200 && at(0.5) <= 2.0, "{ratios:?}");
    // A cost that the estimate omits would cause larger errors.
    assert!(at(0.9) <= 6.0, "{ratios:?}");
}

/// Returns the factors by which estimates missed the times of requests. All are estimated before any is
/// answered. Requests with a refused estimate are skipped.
async fn ratios_of(server: &Server, id: &str, path: &str, requests: &[Value]) -> Vec<f64> {
    let mut expected = Vec::new();
    for request in requests {
        let estimated = estimate(server, id, request).await;
        let seconds = (estimated.status == 200).then(|| estimated.json()["seconds"].as_f64().unwrap());
        expected.extend(seconds.map(|seconds| (request, seconds)));
    }
    assert!(!expected.is_empty(), "{id}");
    let mut ratios = Vec::new();
    for (request, expected) in expected {
        let began = Instant::now();
        let answer = server.post(path, request).await;
        assert_eq!(answer.status, 200, "{id}: {}", answer.text);
        let took = began.elapsed().as_secs_f64() - parsing_seconds(&answer);
        let included =
            ["include", "derivatives", "solver", "surface_model"].map(|name| request[name].to_string());
        let d = request["cloud"]["points"][0].as_array().unwrap().len();
        println!("{id} d = {d} {}: expected {expected:.4} s, took {took:.4} s", included.join(" "));
        if expected.max(took) >= LEAST_SECONDS {
            ratios.push((expected / took).max(took / expected));
        }
    }
    ratios
}

/// Returns the seconds spent on parsing the body, which no estimate includes.
fn parsing_seconds(answer: &Answer) -> f64 {
    let stages = answer.header("server-timing").split(", ");
    let duration = |stage: &str| stage.split_once(";dur=").unwrap().1.parse::<f64>().unwrap() * 1e-3;
    stages.filter(|stage| stage.starts_with("parse")).map(duration).sum()
}
