//! What explains values best, over the wire.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// A noisy field on the unit sphere about an offset.
fn measured(n: usize, noise: f64) -> Value {
    let (points, mut random) = (fibonacci_sphere(n), Random(n as u64));
    let values: Vec<f64> =
        points.iter().map(|x| 3.0 + (2.0 * x[0]).sin() + x[2] + noise * random.normal()).collect();
    json!({"cloud": {"points": points}, "values": values})
}

#[tokio::test]
async fn the_likeliest_kernel_is_found_and_used() {
    let server = Server::start().await;
    let mut body = measured(150, 0.1);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let noise = answer["alpha"].as_f64().unwrap().sqrt();
    // 150 values less some ten functions tell a deviation to 6 %.
    assert!((0.08..0.125).contains(&noise), "{noise}");
    assert_eq!(answer["converged"], true);
    assert_eq!(answer["gradient"].as_array().unwrap().len(), 3);
    // The score is the likelihood that the posterior has, and no other noise has more.
    body["kernel"] = answer["kernel"].clone();
    body["mean"] = json!("constant");
    body["include"] = json!(["log_marginal_likelihood"]);
    let score = answer["score"].as_f64().unwrap();
    for factor in [1.0, 0.8, 1.25] {
        body["alpha"] = json!(factor * answer["alpha"].as_f64().unwrap());
        let posterior = server.post("/v1/posterior", &body).await.expect_ok();
        let likelihood = posterior["log_marginal_likelihood"].as_f64().unwrap();
        match factor == 1.0 {
            true => assert!((likelihood - score).abs() < 1e-8 * score.abs(), "{likelihood} {score}"),
            false => assert!(likelihood < score, "{factor}"),
        }
    }
    let path = answer["path"].as_array().unwrap();
    assert_eq!(path.len(), 61);
    assert!(path.iter().filter_map(|entry| entry["score"].as_f64()).all(|other| other <= score + 1e-6));
}

#[tokio::test]
async fn each_value_is_predicted_as_if_it_had_been_left_out() {
    let server = Server::start().await;
    let body = measured(40, 0.2);
    let mut asked = body.clone();
    asked["kernel"] = json!({"family": "matern", "length_scale": 1.0, "variance": 2.0});
    asked["alpha"] = json!(0.05);
    asked["mean"] = json!("linear");
    asked["vary"] = json!([]);
    asked["criterion"] = json!("leave_one_out");
    let answer = server.post("/v1/model-selection", &asked).await.expect_ok();
    let left_out = &answer["leave_one_out"];
    let densities: f64 = numbers(&left_out["log_predictive_densities"]).iter().sum();
    assert!((densities - answer["score"].as_f64().unwrap()).abs() < 1e-9);
    let (points, values) = (body["cloud"]["points"].as_array().unwrap(), body["values"].as_array().unwrap());
    for i in [0, 17, 39] {
        let without = |all: &Vec<Value>| {
            json!(all.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, x)| x).collect::<Vec<_>>())
        };
        let others = json!({"cloud": {"points": without(points)}, "values": without(values), "queries": [points[i]],
            "kernel": asked["kernel"], "alpha": 0.05, "mean": "linear", "include": ["observation_variance"]});
        let alone = server.post("/v1/posterior", &others).await.expect_ok();
        let off = |a: &Value, b: &Value| (a.as_f64().unwrap() - b.as_f64().unwrap()).abs();
        assert!(off(&left_out["means"][i], &alone["means"][0]) < 1e-9);
        assert!(off(&left_out["variances"][i], &alone["observation_variances"][0]) < 1e-9);
    }
}

#[tokio::test]
async fn families_and_smoothness_are_compared() {
    let server = Server::start().await;
    let mut body = measured(60, 0.05);
    body["families"] = json!(["gauss", "matern"]);
    body["vary"] = json!([
        {"parameter": "length_scale", "min": 0.1, "max": 10.0},
        {"parameter": "nu", "min": 0.5, "max": 2.5},
        {"parameter": "alpha", "min": 1e-6, "max": 1.0},
    ]);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let families = answer["families"].as_array().unwrap();
    assert_eq!(families.len(), 4);
    assert_eq!(answer["gradient"].as_array().unwrap().len(), 3);
    assert!(answer["gradient"][1].is_null());
    let best = families.iter().filter_map(|entry| entry["score"].as_f64()).fold(f64::MIN, f64::max);
    assert!((best - answer["score"].as_f64().unwrap()).abs() < 1e-9);
    for criterion in ["leave_one_out", "generalized_cross_validation"] {
        body["criterion"] = json!(criterion);
        let answer = server.post("/v1/model-selection", &body).await.expect_ok();
        let noise = answer["alpha"].as_f64().unwrap();
        assert!(noise > 1e-6 && noise < 1.0, "{criterion} {noise}");
    }
}

#[tokio::test]
async fn what_cannot_be_searched_is_refused() {
    let server = Server::start().await;
    let body = measured(20, 0.1);
    let free = |parameter: &str, min: f64, max: f64| json!({"parameter": parameter, "min": min, "max": max});
    for (member, value, pointer) in [
        ("vary", json!([free("length_scale", 2.0, 1.0)]), "/vary/0"),
        ("vary", json!([free("alpha", 0.0, 1.0)]), "/vary/0"),
        ("vary", json!([free("alpha", 0.1, 1.0), free("alpha", 0.1, 1.0)]), "/vary/1"),
        ("vary", json!([free("nu", 2.6, 3.4)]), "/vary/0"),
        ("vary", json!([free("nu", 0.5, 1.5), free("epsilon", 0.1, 1.0)]), "/vary/1"),
        ("vary", json!([free("smoothness", 2.0, 4.0)]), "/vary/0/parameter"),
        ("families", json!(["gauss", "gauss"]), "/families/1"),
        ("restarts", json!(101), "/restarts"),
        ("duplicates", json!("merge"), "/duplicates"),
    ] {
        let mut body = body.clone();
        body[member] = value;
        let problem = server.post("/v1/model-selection", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
    let mut noisy = body.clone();
    noisy["noise_variances"] = json!(vec![0.01; 20]);
    let answer = server.post("/v1/model-selection", &noisy).await.expect_ok();
    assert!(answer.get("alpha").is_none() && answer["path"].as_array().unwrap().is_empty());
    noisy["vary"] = json!([free("alpha", 0.1, 1.0)]);
    server.post("/v1/model-selection", &noisy).await.expect_problem(422, "invalid-request");
}

#[tokio::test]
async fn equal_searches_at_once_find_the_same() {
    let server = Server::start().await;
    let body = measured(100, 0.1);
    let asked = (0..8).map(|_| server.post("/v1/model-selection", &body));
    let answers: Vec<Value> =
        futures_util::future::join_all(asked).await.into_iter().map(|answer| answer.expect_ok()).collect();
    for answer in &answers[1..] {
        let score = |answer: &Value| answer["score"].as_f64().unwrap();
        assert!((score(answer) - score(&answers[0])).abs() < 1e-6);
    }
}
