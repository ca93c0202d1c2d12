//! Values by the local solver, from the points nearest to each query.

use serde_json::{Value, json};

use crate::support::{Server, fibonacci_sphere, numbers};

const ROUTES: [&str; 2] = ["/v1/interpolation", "/v1/posterior"];

/// Returns a request with 200 points, more than a neighbourhood has, with values and queries.
fn request(solver: &str) -> Value {
    let points = fibonacci_sphere(200);
    json!({
        "values": points.iter().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect::<Vec<_>>(),
        "cloud": {"points": points},
        "kernel": {"family": "matern", "nu": 1.5, "length_scale": 0.5},
        "alpha": 1e-4,
        "queries": [[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [0.48, 0.64, -0.6]],
        "solver": solver,
    })
}

fn with(mut request: Value, name: &str, value: Value) -> Value {
    request[name] = value;
    request
}

fn assert_close(found: &Value, expected: &Value, tolerance: f64) {
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() < tolerance, "{a} and {b}");
    }
}

#[tokio::test]
async fn the_local_solver_answers_nearly_as_the_dense_one() {
    let server = Server::start().await;
    for derivatives in 0..=2 {
        let body = |solver| with(request(solver), "derivatives", json!(derivatives));
        let local = server.post("/v1/interpolation", &body("local")).await.expect_ok();
        let dense = server.post("/v1/interpolation", &body("dense")).await.expect_ok();
        assert_close(&local["values"], &dense["values"], 1e-2);
        assert_eq!(local.get("gradients").is_some(), derivatives >= 1);
        assert_eq!(local.get("hessians").is_some(), derivatives >= 2);
        if derivatives >= 1 {
            assert_close(&local["gradients"], &dense["gradients"], 5e-2);
        }
    }
    let body =
        |solver| with(request(solver), "include", json!(["variances", "observation_variances", "gradients"]));
    let local = server.post("/v1/posterior", &body("local")).await.expect_ok();
    let dense = server.post("/v1/posterior", &body("dense")).await.expect_ok();
    for name in ["means", "variances", "observation_variances"] {
        assert_close(&local[name], &dense[name], 1e-2);
    }
    assert_eq!(numbers(&local["gradients"]).len(), 9);
    let noise = numbers(&local["observation_variances"])[0] - numbers(&local["variances"])[0];
    assert!((noise - 1e-4).abs() < 1e-12);
}

#[tokio::test]
async fn a_cloud_of_one_neighbourhood_has_the_dense_answers() {
    let server = Server::start().await;
    let small = |solver: &str| {
        let mut body = request(solver);
        body["cloud"] = json!({"points": fibonacci_sphere(100)});
        body["values"] = json!(numbers(&body["values"])[..100]);
        body["include"] = json!(["variances"]);
        body
    };
    let local = server.post("/v1/posterior", &small("local")).await.expect_ok();
    let dense = server.post("/v1/posterior", &small("dense")).await.expect_ok();
    assert_close(&local["means"], &dense["means"], 1e-11);
    assert_close(&local["variances"], &dense["variances"], 1e-11);
}

#[tokio::test]
async fn the_answer_says_what_the_local_solver_knows_and_no_more() {
    let server = Server::start().await;
    for path in ROUTES {
        let answer = server.post(path, &request("local")).await;
        assert!(answer.header("cache-status").starts_with("gramian"));
        let diagnostics = &answer.expect_ok()["diagnostics"];
        assert_eq!(
            (&diagnostics["solver"], &diagnostics["factorization"]),
            (&json!("local"), &json!("local"))
        );
        assert_eq!(
            diagnostics["kernel"],
            json!({"family": "matern", "nu": 1.5, "length_scale": 0.5, "variance": 1.0})
        );
        assert_eq!((&diagnostics["alpha"], &diagnostics["n_queries"]), (&json!(1e-4), &json!(3)));
        for name in [
            "rank",
            "reciprocal_condition",
            "relative_residual",
            "native_norm_squared",
            "misfit",
            "solver_reason",
        ] {
            assert!(diagnostics.get(name).is_none(), "{name}");
        }
        assert_eq!(server.post(path, &request("local")).await.header("cache-status"), "gramian; hit");
    }
}

#[tokio::test]
async fn beyond_what_is_factorized_the_local_solver_is_chosen_and_says_why() {
    let server = Server::with_flags(&["--max-dense-points", "150"]).await;
    for path in ROUTES {
        let mut body = request("auto");
        for kernel in [body["kernel"].clone(), Value::Null] {
            match kernel {
                Value::Null => {
                    body.as_object_mut().unwrap().remove("kernel");
                    body.as_object_mut().unwrap().remove("alpha");
                }
                given => body["kernel"] = given,
            }
            let chosen = server.post(path, &body).await.expect_ok();
            let diagnostics = &chosen["diagnostics"];
            assert_eq!(diagnostics["solver"], "local");
            assert!(diagnostics["solver_reason"].as_str().unwrap().contains("more points"), "{diagnostics}");
            let asked = server.post(path, &with(body.clone(), "solver", json!("local"))).await.expect_ok();
            let name = if path == ROUTES[0] { "values" } else { "means" };
            assert_eq!(
                (&asked[name], &asked["diagnostics"]["kernel"]),
                (&chosen[name], &diagnostics["kernel"])
            );
        }
        server.post(path, &request("dense")).await.expect_problem(413, "problem-too-large");
    }
    let body = with(request("auto"), "include", json!(["variances", "covariance"]));
    let problem = server.post(ROUTES[1], &body).await.expect_problem(413, "problem-too-large");
    assert!(problem["detail"].as_str().unwrap().contains("leave out covariance"), "{problem}");
    assert_eq!(problem["errors"][0]["pointer"], "/cloud/points");
}

#[tokio::test]
async fn what_needs_all_points_at_once_is_refused_where_it_is_asked_for() {
    let server = Server::start().await;
    for quantity in ["covariance", "log_marginal_likelihood"] {
        let body = with(request("local"), "include", json!(["variances", quantity]));
        let problem = server.post(ROUTES[1], &body).await.expect_problem(422, "unsupported-by-solver");
        assert_eq!(problem["errors"][0]["pointer"], "/include");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains(quantity) && detail.contains(r#""solver": "dense""#), "{detail}");
    }
    for path in ["/v1/laplace-beltrami/matrix", "/v1/surface-gradient/matrix"] {
        let mut body = request("local");
        body.as_object_mut().unwrap().remove("values");
        let problem = server.post(path, &body).await.expect_problem(422, "unsupported-by-solver");
        assert_eq!(problem["errors"][0]["pointer"], "/solver", "{path}");
    }
}

#[tokio::test]
async fn duplicates_and_noise_are_taken_as_by_the_dense_solver() {
    let server = Server::start().await;
    let twins = |solver: &str| {
        let mut body = request(solver);
        body["cloud"]["points"][7] = body["cloud"]["points"][3].clone();
        body
    };
    let without = |solver: &str| with(twins(solver), "alpha", json!(0));
    let problem = server.post(ROUTES[0], &without("local")).await.expect_problem(422, "duplicate-points");
    assert_eq!(problem["point_indices"], json!([3, 7]));
    let merging = |solver: &str| with(without(solver), "duplicates", json!("merge"));
    let local = server.post(ROUTES[0], &merging("local")).await.expect_ok();
    let dense = server.post(ROUTES[0], &merging("dense")).await.expect_ok();
    assert_close(&local["values"], &dense["values"], 2e-2);
    assert_eq!(local["diagnostics"]["n_merged_duplicates"], 1);
    assert_eq!(local["diagnostics"]["warnings"][0]["code"], "duplicates_merged");
    // With noise, coinciding points are two observations. Noise may differ from point to point.
    let variances: Vec<f64> = (0..200).map(|i| 1e-3 + 1e-2 * f64::from(i % 3)).collect();
    for path in ROUTES {
        let noisy = |solver: &str| {
            let mut body = with(twins(solver), "noise_variances", json!(variances));
            body.as_object_mut().unwrap().remove("alpha");
            body
        };
        let local = server.post(path, &noisy("local")).await.expect_ok();
        let dense = server.post(path, &noisy("dense")).await.expect_ok();
        let name = if path == ROUTES[0] { "values" } else { "means" };
        assert_close(&local[name], &dense[name], 2e-2);
        assert!(local["diagnostics"].get("alpha").is_none());
    }
}

#[tokio::test]
async fn without_queries_the_points_are_asked() {
    let server = Server::start().await;
    let mut body = with(request("local"), "alpha", json!(0));
    body.as_object_mut().unwrap().remove("queries");
    let answer = server.post(ROUTES[0], &body).await.expect_ok();
    assert_close(&answer["values"], &body["values"], 1e-10);
    let kinked = with(body, "kernel", json!({"family": "laplace", "length_scale": 0.5}));
    let kinked = with(kinked, "derivatives", json!(1));
    let problem = server.post(ROUTES[0], &kinked).await.expect_problem(422, "kernel-not-smooth");
    assert!(problem["errors"][0]["pointer"].as_str().unwrap().starts_with("/cloud/points/"), "{problem}");
}
