//! Warnings about uncertain results: operators on values that do not support what is computed from them.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

const N: usize = 300;

/// Returns a request with x₃ + offset on the unit sphere, plus noise. Its Laplace–Beltrami is −2 x₃.
fn request(kernel: Value, noise: f64, offset: f64) -> Value {
    let (points, mut random) = (fibonacci_sphere(N), Random(5));
    let values: Vec<f64> = points.iter().map(|x| offset + x[2] + noise * random.normal()).collect();
    let mut body = json!({"cloud": {"points": points}, "values": values});
    if !kernel.is_null() {
        body["kernel"] = kernel;
    }
    body
}

fn uncertain(answer: &Value) -> Vec<usize> {
    let entries = answer["flags"].as_array().unwrap().iter();
    let of_values = entries.filter(|entry| entry["reason"] == "uncertain");
    of_values.map(|entry| entry["query"].as_u64().unwrap() as usize).collect()
}

/// Counts the queries without a flag, and those among them with an error above half of the root mean square.
fn unflagged_and_off(answer: &Value) -> (usize, usize) {
    let mut is_flagged = [false; N];
    for entry in answer["flags"].as_array().unwrap() {
        is_flagged[entry["query"].as_u64().unwrap() as usize] = true;
    }
    let found = numbers(&answer["laplacians"]);
    let unflagged: Vec<usize> = (0..N).filter(|&query| !is_flagged[query]).collect();
    let points = fibonacci_sphere(N);
    let is_off =
        |query: &&usize| (found[**query] + 2.0 * points[**query][2]).abs() > 0.5 * (4.0f64 / 3.0).sqrt();
    (unflagged.len(), unflagged.iter().filter(is_off).count())
}

#[tokio::test]
async fn noise_that_nobody_told_and_offsets_are_seen_whatever_the_kernel() {
    let server = Server::start().await;
    let kernels = [
        json!(null),
        json!({"family": "gauss"}),
        json!({"family": "matern", "nu": 4.5}),
        json!({"family": "laplace", "epsilon": 1, "length_scale": 0.8}),
        json!({"family": "gauss", "length_scale": 0.05}),
        json!({"family": "gauss", "length_scales": [0.5, 0.6, 0.4]}),
    ];
    for (noise, offset) in [(0.0, 0.0), (0.0, 1e4), (0.05, 0.0), (0.05, 1e4)] {
        for kernel in &kernels {
            let body = request(kernel.clone(), noise, offset);
            let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
            let (n_unflagged, n_off) = unflagged_and_off(&answer);
            assert!(n_off * 50 <= n_unflagged, "{kernel}, {noise}, {offset}: {n_off} of {n_unflagged}");
            // Exact values without offset are mostly served unflagged, by every kernel that resolves them.
            let resolves = kernel["length_scale"] != 0.05;
            assert!(noise + offset > 0.0 || !resolves || n_unflagged > N / 2, "{kernel}: {n_unflagged}");
            if noise > 0.0 && !kernel.is_null() {
                assert!(uncertain(&answer).len() > N / 2, "{kernel}, {offset}: {n_unflagged}");
            }
        }
    }
}

#[tokio::test]
async fn what_is_asked_for_its_deviations_is_judged_by_the_values_as_well() {
    let server = Server::start().await;
    for path in ["/v1/laplace-beltrami", "/v1/surface-gradient"] {
        let mut body = request(json!({"family": "gauss"}), 0.2, 0.0);
        let plain = server.post(path, &body).await.expect_ok();
        assert!(uncertain(&plain).len() > N / 2, "{path}");
        // This kernel takes the values as exact, so its own deviations notice nothing.
        body["include"] = json!(["std"]);
        let answer = server.post(path, &body).await.expect_ok();
        assert!(uncertain(&answer).len() >= uncertain(&plain).len(), "{path}");
    }
}

#[tokio::test]
async fn a_process_without_second_derivatives_has_no_sure_laplacian() {
    let server = Server::start().await;
    for kernel in [json!({"family": "matern", "nu": 1.5}), json!({"family": "wendland", "smoothness": 2})] {
        let mut body = request(kernel.clone(), 0.0, 0.0);
        body["surface"] = json!({"kernel": {"family": "laplace", "epsilon": 1, "length_scale": 1}});
        let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
        assert_eq!(uncertain(&answer).len(), N, "{kernel}");
        let answer = server.post("/v1/surface-gradient", &body).await.expect_ok();
        assert!(uncertain(&answer).len() < N / 2, "{kernel}");
    }
}

/// Checks that uncertainty never leads to a refusal.
#[tokio::test]
async fn values_that_say_nothing_are_answered() {
    let server = Server::start().await;
    let kernel = json!({"family": "gauss", "length_scale": 0.5});
    for size in [0.0, 1e-200, 1e-150, 1.0, 1e100, 1e145, 1e150] {
        let mut body = request(kernel.clone(), 0.0, 0.0);
        body["values"] = json!(vec![size; N]);
        for path in ["/v1/laplace-beltrami", "/v1/surface-gradient"] {
            server.post(path, &body).await.expect_ok();
        }
    }
    // Too few values to decide anything, one query where the truth is 0, and one far from all points.
    let mut body = request(kernel, 0.0, 0.0);
    body["queries"] = json!([[1.0, 0.0, 0.0]]);
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    assert_eq!(uncertain(&answer), [0usize; 0]);
    body["queries"] = json!([[1e50, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    let six = json!([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]);
    let few = json!({"cloud": {"points": six}, "values": [1, 1, 2, 2, 3, 4],
        "kernel": {"family": "gauss", "length_scale": 1.5}, "queries": [[0.6, 0.8, 0.0]]});
    server.post("/v1/laplace-beltrami", &few).await.expect_ok();
}

#[tokio::test]
async fn equal_requests_at_once_have_equal_doubts() {
    let server = Server::start().await;
    let body = request(json!({"family": "matern", "nu": 4.5}), 0.05, 0.0);
    let answers =
        futures_util::future::join_all((0..8).map(|_| server.post("/v1/laplace-beltrami", &body))).await;
    let found: Vec<Vec<usize>> = answers.into_iter().map(|answer| uncertain(&answer.expect_ok())).collect();
    assert!(found.iter().all(|queries| *queries == found[0] && !queries.is_empty()));
}
