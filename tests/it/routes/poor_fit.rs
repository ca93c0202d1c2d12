//! Warnings of a poor fit: values that contradict kernel and noise.

use std::f64::consts::TAU;

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers, warnings_of};

/// Returns a request with x₃ on the unit sphere, noise of 1 %, and one value off by `shift`.
fn measured(n: usize, shift: f64) -> Value {
    let (points, mut random) = (fibonacci_sphere(n), Random(5));
    let mut values: Vec<f64> = points.iter().map(|x| x[2] + 0.01 * random.normal()).collect();
    values[n / 3] += shift;
    json!({"cloud": {"points": points}, "values": values, "queries": [[1.0, 0.0, 0.0]]})
}

fn with(body: &Value, more: Value) -> Value {
    let mut body = body.clone();
    let members = more.as_object().unwrap().clone();
    body.as_object_mut().unwrap().extend(members);
    body
}

fn poor_fits(answer: &Value) -> Vec<String> {
    warnings_of(answer, "poor_fit")
}

#[tokio::test]
async fn values_that_are_explained_have_no_warning() {
    let server = Server::start().await;
    let body = with(&measured(300, 0.0), json!({"include": ["variances"]}));
    for more in [json!({}), json!({"solver": "local"}), json!({"mean": "linear"})] {
        let answer = server.post("/v1/posterior", &with(&body, more.clone())).await.expect_ok();
        assert_eq!(poor_fits(&answer), Vec::<String>::new(), "{more}");
    }
}

#[tokio::test]
async fn one_wrong_value_is_named_whichever_solver_answers() {
    let server = Server::start().await;
    let body = measured(600, 1.0);
    for route in ["/v1/posterior", "/v1/interpolation"] {
        for solver in ["dense", "local"] {
            let answer = server.post(route, &with(&body, json!({"solver": solver}))).await.expect_ok();
            let found = poor_fits(&answer);
            assert_eq!(found.len(), 1, "{route}, {solver}: {answer}");
            assert!(found[0].contains("point 200 "), "{route}, {solver}: {}", found[0]);
        }
    }
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    assert!(poor_fits(&answer)[0].contains("point 200 "));
}

#[tokio::test]
async fn a_place_that_no_kernel_explains_is_named_whichever_solver_answers() {
    let server = Server::start().await;
    let points = fibonacci_sphere(1000);
    // Noise of 1 % from cosines of large angles, and a step along a great circle. No single value is an
    // outlier.
    let noise = |i: usize| 0.01 * 2f64.sqrt() * (12.9898 * (i as f64 + 2.0).powi(2)).cos();
    let across = |x: &[f64; 3]| x[0] + 0.3 * x[1];
    for height in [0.0, 1.0] {
        let step = |x: &[f64; 3]| if across(x) > 0.0 { height } else { 0.0 };
        let values: Vec<f64> = points.iter().enumerate().map(|(i, x)| x[2] + noise(i) + step(x)).collect();
        let body = json!({"cloud": {"points": points}, "values": values, "queries": [[1.0, 0.0, 0.0]]});
        for solver in ["dense", "local"] {
            let answer = server.post("/v1/posterior", &with(&body, json!({"solver": solver}))).await;
            let found = poor_fits(&answer.expect_ok());
            assert_eq!(found.len(), height as usize, "{solver}: {found:?}");
            assert!(found.iter().all(|detail| detail.contains("values around point")), "{found:?}");
        }
    }
}

#[tokio::test]
async fn a_given_kernel_is_told_where_deviations_are_asked_for() {
    let server = Server::start().await;
    let given = json!({"kernel": {"family": "gauss", "length_scale": 1.0}, "alpha": 1e-8});
    let body = with(&measured(300, 0.0), given);
    // The noise of the values is a hundred times the deviation that alpha implies.
    let means = server.post("/v1/interpolation", &body).await.expect_ok();
    assert_eq!(poor_fits(&means), Vec::<String>::new());
    let answer = server.post("/v1/posterior", &with(&body, json!({"include": ["variances"]}))).await;
    assert!(poor_fits(&answer.expect_ok())[0].contains("leave out kernel and alpha"));
    let fitting = with(&body, json!({"alpha": 1e-4, "include": ["variances"]}));
    let answer = server.post("/v1/posterior", &fitting).await.expect_ok();
    assert_eq!(poor_fits(&answer), Vec::<String>::new());
    // A batch of two lists, of which one is contradicted.
    let (wrong, right) = (&measured(300, 1.0)["values"], &body["values"]);
    let lists = with(&fitting, json!({"values": [right, wrong]}));
    let answer = server.post("/v1/posterior/batch", &lists).await.expect_ok();
    assert_eq!(poor_fits(&answer).len(), 1);
}

#[tokio::test]
async fn detail_that_is_taken_for_noise_is_named_whichever_solver_answers() {
    // A series of even spacing: a long wave, and a ripple of a tenth of it with 3.7 points a wave. The ripple
    // alone differs from noise by its correlation, which is least between neighbours and greatest between
    // the next but one.
    let server = Server::start().await;
    let points: Vec<[f64; 1]> = (0..500).map(|i| [0.002 * f64::from(i)]).collect();
    let series = |ripple: f64, noise: f64| {
        let mut random = Random(4);
        let long = |x: f64| (6.0 * x).sin() + ripple * (TAU * x / 0.0074).sin();
        let values: Vec<f64> = points.iter().map(|x| long(x[0]) + noise * random.normal()).collect();
        json!({"cloud": {"points": points}, "values": values, "queries": [[0.5]]})
    };
    for solver in ["dense", "local"] {
        for route in ["/v1/posterior", "/v1/interpolation"] {
            let with_solver = |body: Value| with(&body, json!({"solver": solver}));
            let answer = server.post(route, &with_solver(series(0.1, 0.01))).await.expect_ok();
            let found = poor_fits(&answer);
            assert_eq!(found.len(), 1, "{route}, {solver}: {answer}");
            assert!(found[0].starts_with("residuals of near points are correlated"), "{}", found[0]);
            let answer = server.post(route, &with_solver(series(0.0, 0.07))).await.expect_ok();
            assert_eq!(poor_fits(&answer), Vec::<String>::new(), "{route}, {solver}");
        }
    }
}

#[tokio::test]
async fn values_whose_squares_leave_float64_have_longer_bars_and_a_warning() {
    let server = Server::start().await;
    let posterior = async |factor: f64| {
        let mut body = with(&measured(100, 0.0), json!({"include": ["variances"]}));
        let values: Vec<f64> = numbers(&body["values"]).iter().map(|value| factor * value).collect();
        body["values"] = json!(values);
        server.post("/v1/posterior", &body).await.expect_ok()
    };
    let deviation = |answer: &Value| numbers(&answer["variances"])[0].sqrt();
    let ordinary = posterior(1.0).await;
    for (factor, is_clamped) in [(1e-100, false), (1e-140, false), (1e-150, true), (1e-200, true)] {
        let answer = posterior(factor).await;
        let codes: Vec<&Value> =
            answer["diagnostics"]["warnings"].as_array().unwrap().iter().map(|w| &w["code"]).collect();
        assert_eq!(codes.contains(&&json!("variance_clamped")), is_clamped, "{factor}: {answer}");
        let ratio = deviation(&answer) / factor / deviation(&ordinary);
        assert!(if is_clamped { ratio > 1.0 } else { (ratio - 1.0).abs() < 1e-6 }, "{factor}: {ratio}");
        let mean = numbers(&answer["means"])[0] / factor;
        assert!((mean - numbers(&ordinary["means"])[0]).abs() < 0.1, "{factor}: {mean}");
    }
}
