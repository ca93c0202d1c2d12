//! The solvers `landmark` and `iterative` over HTTP: the answers of the dense one, what they say of
//! themselves, and their refusals.

use std::time::Duration;

use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::support::{Server, fibonacci_sphere, numbers};

/// A request over 600 points of the sphere that several solvers take, with a kernel that suits them.
fn body(solver: &str, kernel: &Value, more: &Value) -> Value {
    let points = fibonacci_sphere(600);
    let values: Vec<f64> = points.iter().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect();
    let mut body = json!({"cloud": {"points": points}, "solver": solver, "alpha": 1e-4, "kernel": kernel});
    if more.get("values").is_some() {
        body["values"] = json!(values);
    }
    for (name, value) in more.as_object().unwrap().iter().filter(|(name, _)| *name != "values") {
        body[name] = value.clone();
    }
    body
}

/// A kernel for landmarks.
fn smooth() -> Value {
    json!({"family": "gauss", "length_scale": 1.0})
}

/// A kernel for conjugate gradients.
fn rough() -> Value {
    json!({"family": "matern", "nu": 2.5, "length_scale": 0.5})
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

/// The path of an operation, its request, and the members of its answer with their relative difference from
/// the dense one.
type Asked = (&'static str, Value, Vec<(&'static str, f64)>);

/// Operations of all solvers over all points. Derivatives lose more than values.
fn operations() -> Vec<Asked> {
    let queries = [[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [-0.48, 0.64, 0.6]];
    let on_signature = json!({"model": "signature"});
    vec![
        (
            "/v1/interpolation",
            json!({"values": true, "queries": queries, "derivatives": 1}),
            vec![("values", 1e-8), ("gradients", 1e-5)],
        ),
        (
            "/v1/posterior",
            json!({"values": true, "queries": queries, "include": ["variances", "covariance", "gradient_variances"],
                "mean": "constant"}),
            vec![("means", 1e-8), ("variances", 1e-5), ("covariance", 1e-5), ("gradient_variances", 1e-5)],
        ),
        ("/v1/normals", json!({"queries": queries, "surface_model": "signature"}), vec![("normals", 1e-5)]),
        (
            "/v1/curvatures",
            json!({"queries": queries, "surface_model": "signature"}),
            vec![("mean_curvatures", 1e-3)],
        ),
        (
            "/v1/surface-gradient",
            json!({"values": true, "queries": queries, "surface": on_signature}),
            vec![("gradients", 1e-5)],
        ),
        (
            "/v1/laplace-beltrami",
            json!({"values": true, "queries": queries, "surface": on_signature}),
            vec![("laplacians", 1e-3)],
        ),
    ]
}

#[tokio::test]
async fn every_operation_answers_as_with_the_dense_solver() {
    let server = Server::start().await;
    for (solver, factorization, kernel) in
        [("landmark", "landmark", smooth()), ("iterative", "conjugate_gradients", rough())]
    {
        for (path, more, members) in operations() {
            let dense = server.post(path, &body("dense", &kernel, &more)).await.expect_ok();
            let found = server.post(path, &body(solver, &kernel, &more)).await.expect_ok();
            for (member, tolerance) in members {
                check_near(&found[member], &dense[member], tolerance);
            }
            let diagnostics = &found["diagnostics"];
            assert_eq!(
                (&diagnostics["solver"], &diagnostics["factorization"]),
                (&json!(solver), &json!(factorization))
            );
        }
    }
}

#[tokio::test]
async fn landmarks_have_matrices_and_conjugate_gradients_have_none() {
    let server = Server::start().await;
    let more = json!({"queries": [[0.6, 0.8, 0.0]], "surface": {"model": "signature"}});
    let path = "/v1/laplace-beltrami/matrix";
    let dense = server.post(path, &body("dense", &smooth(), &more)).await.expect_ok();
    let found = server.post(path, &body("landmark", &smooth(), &more)).await.expect_ok();
    check_near(&found["matrix"], &dense["matrix"], 1e-3);
    let of_matrix = server.post(path, &body("iterative", &rough(), &more)).await;
    of_matrix.expect_problem(422, "unsupported-by-solver");
    let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]], "include": ["log_marginal_likelihood"]});
    let of_likelihood = server.post("/v1/posterior", &body("iterative", &rough(), &more)).await;
    let problem = of_likelihood.expect_problem(422, "unsupported-by-solver");
    assert_eq!(problem["errors"][0]["pointer"], "/include", "{problem}");
}

#[tokio::test]
async fn an_iteration_ends_within_the_tolerance_or_is_refused() {
    let server = Server::start().await;
    let asked = |tolerance: f64, alpha: f64| {
        let more =
            json!({"values": true, "queries": [[0.6, 0.8, 0.0]], "tolerance": tolerance, "alpha": alpha});
        body("iterative", &rough(), &more)
    };
    let mut iterations = Vec::new();
    for tolerance in [1e-6, 1e-11] {
        // No solution of another request may help.
        let server = Server::start().await;
        let answer = server.post("/v1/interpolation", &asked(tolerance, 1e-4)).await.expect_ok();
        let diagnostics = &answer["diagnostics"];
        assert_eq!(diagnostics["tolerance"], tolerance);
        assert!(diagnostics["relative_residual"].as_f64().unwrap() <= tolerance, "{diagnostics}");
        iterations.push(diagnostics["iterations"].as_u64().unwrap());
    }
    assert!(iterations[0] < iterations[1], "{iterations:?}");
    // The matrix is singular to rounding, so no iteration comes so near.
    let mut hopeless = asked(1e-14, 0.0);
    hopeless["kernel"] = smooth();
    let refused = server.post("/v1/interpolation", &hopeless).await;
    let problem = refused.expect_problem(422, "not-converged");
    assert_eq!(problem["errors"][0]["pointer"], "/tolerance", "{problem}");
}

#[tokio::test]
async fn tighter_tolerances_and_values_that_hardly_change_start_from_earlier_solutions() {
    let tight = 1e-10;
    let asked = |tolerance: f64, time: f64| {
        let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]], "tolerance": tolerance});
        let mut body = body("iterative", &rough(), &more);
        let now = |value: f64| value * (1.0 + 0.1 * time) + time.sin();
        body["values"] = numbers(&body["values"]).into_iter().map(now).collect();
        body
    };
    let iterations = |answer: &Value| {
        let diagnostics = &answer["diagnostics"];
        assert!(
            diagnostics["relative_residual"].as_f64().unwrap() <= diagnostics["tolerance"].as_f64().unwrap()
        );
        diagnostics["iterations"].as_u64().unwrap()
    };
    let alone = Server::start().await;
    let cold = alone.post("/v1/interpolation", &asked(tight, 0.0)).await.expect_ok();
    let server = Server::start().await;
    server.post("/v1/interpolation", &asked(1e-6, 0.0)).await.expect_ok();
    let tightened = server.post("/v1/interpolation", &asked(tight, 0.0)).await.expect_ok();
    assert!(2 * iterations(&tightened) <= iterations(&cold) + 1, "{tightened}");
    check_near(&tightened["values"], &cold["values"], 1e-8);
    // Values that move with the time, as those of sensors do.
    for time in [1e-3, 2e-3, 3e-3] {
        let moved = server.post("/v1/interpolation", &asked(tight, time)).await.expect_ok();
        assert!(iterations(&moved) < iterations(&cold), "{moved}");
        let expected = alone.post("/v1/interpolation", &asked(tight, time)).await.expect_ok();
        check_near(&moved["values"], &expected["values"], 1e-8);
    }
}

#[tokio::test]
async fn a_tolerance_that_means_nothing_is_refused() {
    let server = Server::start().await;
    for (solver, tolerance) in [("dense", 1e-8), ("landmark", 1e-8), ("iterative", 0.0), ("iterative", 0.1)] {
        let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]], "tolerance": tolerance});
        let refused = server.post("/v1/interpolation", &body(solver, &rough(), &more)).await;
        let problem = refused.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], "/tolerance", "{problem}");
    }
}

#[tokio::test]
async fn the_answer_says_how_many_landmarks_there_are_and_what_they_leave() {
    let server = Server::start().await;
    let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]]});
    let answer = server.post("/v1/interpolation", &body("landmark", &smooth(), &more)).await.expect_ok();
    let diagnostics = &answer["diagnostics"];
    assert!((50..500).contains(&diagnostics["rank"].as_u64().unwrap()), "{diagnostics}");
    let [remaining, tolerance, residual] = ["remaining_diagonal", "diagonal_tolerance", "relative_residual"]
        .map(|member| diagnostics[member].as_f64().unwrap());
    assert!(tolerance <= 1e-10 && remaining <= 4.0 * tolerance && residual < 1e-8, "{diagnostics}");
}

#[tokio::test]
async fn beyond_what_is_factorized_auto_takes_landmarks_where_few_are_enough_and_keeps_tolerances() {
    let server = Server::with_flags(&["--max-dense-points", "1000"]).await;
    let points = fibonacci_sphere(3000);
    let values: Vec<f64> = points.iter().map(|x| (2.0 * x[0]).sin()).collect();
    let narrow = json!({"family": "gauss", "length_scale": 0.05});
    for (kernel, tolerance, expected, word) in [
        (smooth(), None, "landmark", "few landmarks"),
        (smooth(), Some(1e-7), "landmark", "few landmarks"),
        (rough(), None, "local", "more points"),
        (rough(), Some(1e-7), "iterative", "tolerance"),
        (narrow, None, "local", "more points"),
        (json!({"family": "gauss"}), None, "local", "more points"),
    ] {
        let mut body = json!({"cloud": {"points": points}, "values": values, "queries": [[0.0, 0.0, 1.0]],
            "alpha": 1e-4, "kernel": kernel, "include": ["variances"]});
        if let Some(tolerance) = tolerance {
            body["tolerance"] = json!(tolerance);
        }
        let answer = server.post("/v1/posterior", &body).await.expect_ok();
        let [solver, reason] =
            ["solver", "solver_reason"].map(|member| answer["diagnostics"][member].as_str().unwrap());
        assert!(solver == expected && reason.contains(word), "{kernel}: {solver}: {reason}");
    }
}

#[tokio::test]
async fn auto_takes_landmarks_where_they_are_faster_than_all_points_and_have_their_digits() {
    let server = Server::start().await;
    for (n, kernel, alpha, expected) in [
        (2000, smooth(), Some(1e-4), "landmark"),
        (2000, smooth(), Some(1e-8), "dense"),
        (2000, smooth(), None, "dense"),
        (2000, rough(), Some(1e-4), "dense"),
        (999, smooth(), Some(1e-4), "dense"),
    ] {
        let points = fibonacci_sphere(n);
        let values: Vec<f64> = points.iter().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect();
        let mut body = json!({"cloud": {"points": points}, "values": values, "kernel": kernel,
            "queries": [[0.6, 0.8, 0.0], [0.0, 0.0, 0.9]], "include": ["variances"]});
        if let Some(alpha) = alpha {
            body["alpha"] = json!(alpha);
        }
        let answer = server.post("/v1/posterior", &body).await.expect_ok();
        let diagnostics = &answer["diagnostics"];
        assert_eq!(diagnostics["solver"], expected, "n = {n}, {kernel}, {alpha:?}: {diagnostics}");
        if expected == "dense" {
            continue;
        }
        assert!(diagnostics["solver_reason"].as_str().unwrap().contains("few landmarks"), "{diagnostics}");
        // By its id, the cloud has the same factor.
        let mut again = body.clone();
        again["cloud"] = json!({"id": diagnostics["cloud_id"]});
        assert_eq!(server.post("/v1/posterior", &again).await.expect_ok()["means"], answer["means"]);
        body["solver"] = json!("dense");
        let dense = server.post("/v1/posterior", &body).await.expect_ok();
        check_near(&answer["means"], &dense["means"], 1e-10);
        check_near(&answer["variances"], &dense["variances"], 1e-6);
    }
}

/// A request for which `auto` looks for landmarks: values on the sphere, in other units and places.
fn probed(unit: f64, offset: f64) -> Value {
    let sphere = fibonacci_sphere(2000);
    let values: Vec<f64> = sphere.iter().map(|x| unit * (2.0 * x[0]).sin()).collect();
    let moved = |x: &[f64; 3]| x.map(|x| unit * (x + offset));
    let points: Vec<[f64; 3]> = sphere.iter().map(moved).collect();
    json!({"cloud": {"points": points}, "values": values, "queries": [moved(&[0.6, 0.8, 0.0])],
        "alpha": 1e-4 * unit * unit,
        "kernel": {"family": "gauss", "length_scale": unit, "variance": unit * unit}})
}

#[tokio::test]
async fn eight_equal_requests_find_the_same_landmarks_and_one_that_leaves_spoils_nothing() {
    let server = Server::start().await;
    let body = probed(1.0, 0.0);
    let leaving = async {
        let left = tokio::time::timeout(Duration::from_millis(30), server.post("/v1/interpolation", &body));
        left.await.is_err()
    };
    let staying = join_all((0..8).map(|_| server.post("/v1/interpolation", &body)));
    let (_, answers) = tokio::join!(leaving, staying);
    let answers: Vec<Value> = answers.into_iter().map(|answer| answer.expect_ok()).collect();
    for answer in &answers {
        assert_eq!(answer["diagnostics"]["solver"], "landmark");
        assert_eq!(answer["values"], answers[0]["values"]);
    }
}

#[tokio::test]
async fn landmarks_are_found_whatever_the_units_and_the_place() {
    let server = Server::start().await;
    let expected = server.post("/v1/interpolation", &probed(1.0, 0.0)).await.expect_ok();
    for (unit, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e4)] {
        let answer = server.post("/v1/interpolation", &probed(unit, offset)).await.expect_ok();
        assert_eq!(answer["diagnostics"]["solver"], "landmark", "{unit}, {offset}");
        let [found, expected] = [&answer, &expected].map(|answer| numbers(&answer["values"])[0]);
        // Coordinates of 1e4 have lost four of sixteen digits.
        assert!((found / unit - expected).abs() < 1e-8, "{unit}, {offset}: {found}, {expected}");
    }
}

#[tokio::test]
async fn points_of_a_request_that_is_probed_are_refused_at_their_place() {
    let server = Server::start().await;
    let mut points: Vec<Vec<f64>> = fibonacci_sphere(1500).iter().map(|x| x.to_vec()).collect();
    let body = |points: &[Vec<f64>], kernel: Value| {
        json!({"cloud": {"points": points}, "values": vec![1.0; points.len()], "kernel": kernel, "alpha": 1e-4,
            "queries": [[0.6, 0.8]]})
    };
    // The probe has registered the points, and the queries have another dimension.
    let refused = server.post("/v1/interpolation", &body(&points, smooth())).await;
    assert_eq!(refused.expect_problem(422, "dimension-mismatch")["errors"][0]["pointer"], "/queries");
    let wrong = json!({"family": "gauss", "length_scale": -1.0});
    let refused = server.post("/v1/interpolation", &body(&points, wrong)).await;
    let problem = refused.expect_problem(422, "invalid-request");
    assert_eq!(problem["errors"][0]["pointer"], "/kernel/length_scale", "{problem}");
    points[17].pop();
    let problem = server.post("/v1/interpolation", &body(&points, smooth())).await;
    let problem = problem.expect_problem(422, "invalid-cloud");
    assert_eq!(problem["errors"][0]["pointer"], "/cloud/points/17", "{problem}");
}

#[tokio::test]
async fn landmarks_warn_of_a_condition_as_the_dense_solver_does() {
    let server = Server::start().await;
    for (alpha, warns) in [(1e-4, false), (1e-12, true)] {
        for solver in ["dense", "landmark"] {
            let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]], "alpha": alpha});
            let answer = server.post("/v1/interpolation", &body(solver, &smooth(), &more)).await.expect_ok();
            let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
            let found = warnings.iter().any(|warning| warning["code"] == "ill_conditioned");
            assert_eq!(found, warns, "{solver}, α = {alpha}: {}", answer["diagnostics"]);
        }
    }
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
async fn eight_equal_requests_are_answered_alike() {
    let server = Server::start().await;
    let more = json!({"values": true, "queries": [[0.6, 0.8, 0.0]]});
    for body in [body("landmark", &smooth(), &more), body("iterative", &rough(), &more)] {
        let asked = (0..8).map(|_| server.post("/v1/interpolation", &body));
        let answers = futures_util::future::join_all(asked).await;
        let values: Vec<Value> = answers.into_iter().map(|of| of.expect_ok()["values"].clone()).collect();
        assert!(values.iter().all(|value| *value == values[0]));
    }
}
