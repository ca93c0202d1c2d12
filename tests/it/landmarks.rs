//! The solver `landmark` over HTTP: the answers of the dense one, what it says of itself, and its refusal.

use serde_json::{Value, json};

use crate::support::{Server, fibonacci_sphere, numbers};

/// A request over 600 points of the sphere that the solvers `dense` and `landmark` take.
fn body(solver: &str, more: &Value) -> Value {
    let points = fibonacci_sphere(600);
    let values: Vec<f64> = points.iter().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect();
    let mut body = json!({"cloud": {"points": points}, "solver": solver, "alpha": 1e-4,
        "kernel": {"family": "gauss", "length_scale": 1.0}});
    if more.get("values").is_some() {
        body["values"] = json!(values);
    }
    for (name, value) in more.as_object().unwrap().iter().filter(|(name, _)| *name != "values") {
        body[name] = value.clone();
    }
    body
}

/// Checks that numbers agree, relative to the largest of them.
fn check_near(found: &Value, expected: &Value, tolerance: f64) {
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= tolerance * largest, "{a} and {b}");
    }
}

#[tokio::test]
async fn every_operation_answers_as_with_the_dense_solver() {
    let server = Server::start().await;
    let queries = [[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [-0.48, 0.64, 0.6]];
    let values = json!(true);
    // A millionth of the noise, or less, remains of the diagonal. Derivatives lose more of it than values.
    for (path, more, members) in [
        (
            "/v1/interpolation",
            json!({"values": values, "queries": queries, "derivatives": 1}),
            vec![("values", 1e-8), ("gradients", 1e-5)],
        ),
        (
            "/v1/posterior",
            json!({"values": values, "queries": queries, "include": ["variance", "covariance"]}),
            vec![("means", 1e-8), ("variances", 1e-5), ("covariance", 1e-5)],
        ),
        ("/v1/normals", json!({"queries": queries, "surface": "signature"}), vec![("normals", 1e-5)]),
        (
            "/v1/curvatures",
            json!({"queries": queries, "surface": "signature"}),
            vec![("mean_curvatures", 1e-3)],
        ),
        (
            "/v1/surface-gradient",
            json!({"values": values, "queries": queries, "geometry": {"surface": "signature"}}),
            vec![("gradients", 1e-5)],
        ),
        (
            "/v1/laplace-beltrami",
            json!({"values": values, "queries": queries, "geometry": {"surface": "signature"}}),
            vec![("values", 1e-3)],
        ),
        (
            "/v1/laplace-beltrami/matrix",
            json!({"queries": queries, "geometry": {"surface": "signature"}}),
            vec![("matrix", 1e-3)],
        ),
    ] {
        let dense = server.post(path, &body("dense", &more)).await.expect_ok();
        let found = server.post(path, &body("landmark", &more)).await.expect_ok();
        for (member, tolerance) in members {
            check_near(&found[member], &dense[member], tolerance);
        }
        let diagnostics = &found["diagnostics"];
        assert_eq!(
            (&diagnostics["solver"], &diagnostics["factorization"]),
            (&json!("landmark"), &json!("landmark"))
        );
    }
}

#[tokio::test]
async fn the_answer_says_how_many_landmarks_there_are_and_what_they_leave() {
    let server = Server::start().await;
    let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]]});
    let answer = server.post("/v1/interpolation", &body("landmark", &more)).await.expect_ok();
    let diagnostics = &answer["diagnostics"];
    assert!((50..500).contains(&diagnostics["rank"].as_u64().unwrap()), "{diagnostics}");
    let [remaining, tolerance, residual] = ["remaining_diagonal", "tolerance", "relative_residual"]
        .map(|member| diagnostics[member].as_f64().unwrap());
    assert!(tolerance <= 1e-10 && remaining <= 4.0 * tolerance && residual < 1e-8, "{diagnostics}");
}

#[tokio::test]
async fn kernels_that_need_too_many_landmarks_are_refused_with_a_remedy() {
    let server = Server::start().await;
    let points = fibonacci_sphere(3000);
    let values: Vec<f64> = points.iter().map(|x| x[0]).collect();
    let body = json!({"cloud": {"points": points}, "values": values, "queries": [[0.0, 0.0, 1.0]],
        "solver": "landmark", "alpha": 1e-6, "kernel": {"family": "laplace", "length_scale": 1.0, "epsilon": 0.0}});
    let problem = server.post("/v1/interpolation", &body).await.expect_problem(422, "unsupported-by-solver");
    assert!(problem["detail"].as_str().unwrap().contains("longer length scale"), "{problem}");
}

#[tokio::test]
async fn eight_equal_requests_choose_landmarks_once() {
    let server = Server::start().await;
    let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]]});
    let body = body("landmark", &more);
    let asked = (0..8).map(|_| server.post("/v1/interpolation", &body));
    let answers = futures_util::future::join_all(asked).await;
    let values: Vec<Value> = answers.into_iter().map(|answer| answer.expect_ok()["values"].clone()).collect();
    assert!(values.iter().all(|value| *value == values[0]));
}
