//! What a request would take, before it is sent.

use std::time::Instant;

use serde_json::{Value, json};

use crate::routes::{ROUTES, route_of};
use crate::support::{Answer, Server, document, fibonacci_sphere};

async fn estimate(server: &Server, operation: &str, request: &Value) -> Answer {
    let mut body = request.clone();
    body["operation"] = json!(operation);
    server.post("/v1/estimate", &body).await
}

/// Operations with a body that compute, by name, with their paths.
fn operations() -> Vec<(String, String)> {
    let document = document();
    let named = |(path, item): (&String, &Value)| {
        let operation = item.get("post")?;
        let id = operation["operationId"].as_str()?;
        (operation.get("requestBody").is_some() && !["create_cloud", "estimate"].contains(&id))
            .then(|| (id.to_owned(), path.clone()))
    };
    document["paths"].as_object().unwrap().iter().filter_map(named).collect()
}

/// A request of an operation over a sphere of n points, which is another cloud for every `shift`.
fn request(path: &str, n: usize, shift: f64) -> Value {
    let points: Vec<_> = fibonacci_sphere(n).iter().map(|x| [x[0] + shift, x[1], x[2]]).collect();
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
        request["geometry"] = json!({"surface": "local"});
    } else {
        request["kernel"] = json!({"family": "matern", "length_scale": 0.5});
        request["alpha"] = json!(1e-6);
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
        // Searches make what they look at themselves, whatever is there.
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
    // What is estimated is a request of that operation and no other.
    estimate(&server, "compute_interpolation", &good).await.expect_problem(422, "invalid-request");
    estimate(&server, "compute_normals", &json!({"cloud": {"id": "0".repeat(64)}}))
        .await
        .expect_problem(404, "unknown-cloud");
}

#[tokio::test]
async fn what_takes_too_long_is_told_and_not_begun() {
    let server = Server::with_flags(&["--deadline-seconds", "0.5"]).await;
    let request = request("/v1/normals", 6000, 0.0);
    let estimated = estimate(&server, "compute_normals", &request).await.expect_ok();
    assert_eq!(estimated["admissible"], false, "{estimated}");
    // 6000³/3 flops at 20 Gflop/s, before anything ran.
    assert!(estimated["seconds"].as_f64().unwrap() > 3.0, "{estimated}");
    let problem = server.post("/v1/normals", &request).await.expect_problem(504, "deadline-exceeded");
    assert!(problem["detail"].as_str().unwrap().contains("nothing was computed"), "{problem}");
}

/// Requests over clouds of three sizes; times of the last are compared with what was expected of them after the others.
#[tokio::test]
async fn seconds_are_within_a_factor_of_two_in_the_median_over_all_routes() {
    let server = Server::start().await;
    let mut ratios = Vec::new();
    for (index, (id, path)) in operations().iter().enumerate() {
        for (size, n) in [400, 500, 600].into_iter().enumerate() {
            let request = request(path, n, (3 * index + size) as f64);
            // What is missing first, and then with everything there.
            for state in ["cold", "warm"] {
                let expected = estimate(&server, id, &request).await.expect_ok()["seconds"].as_f64().unwrap();
                let began = Instant::now();
                let answer = server.post(path, &request).await;
                assert_eq!(answer.status, 200, "{id}: {}", answer.text);
                if size == 2 {
                    let computed = computed_seconds(&answer).min(began.elapsed().as_secs_f64());
                    println!("{id} {state}: expected {expected:.4} s, took {computed:.4} s");
                    ratios.push((expected / computed).max(computed / expected));
                }
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!("median factor {median:.2}, largest {:.2}", ratios.last().unwrap());
    assert!(median <= 2.0, "{ratios:?}");
}

/// All stages but the parsing of the body, which is known before anything is estimated.
fn computed_seconds(answer: &Answer) -> f64 {
    let stages = answer.header("server-timing").split(", ");
    let duration = |stage: &str| stage.split_once(";dur=").unwrap().1.parse::<f64>().unwrap() * 1e-3;
    stages.filter(|stage| !stage.starts_with("parse")).map(duration).sum()
}
