//! Model selection over HTTP.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// Returns a request with a noisy field on the unit sphere, plus an offset of 3.
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
    // 150 values less about ten functions determine a deviation to 6 %.
    assert!((0.08..0.125).contains(&noise), "{noise}");
    assert_eq!(answer["converged"], true);
    assert_eq!(answer["score_gradient"].as_array().unwrap().len(), 3);
    // The score is the likelihood of the posterior, and no other noise has a higher one.
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
    let path = answer["alpha_path"].as_array().unwrap();
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
            "kernel": asked["kernel"], "alpha": 0.05, "mean": "linear", "include": ["observation_variances"]});
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
        {"parameter": "length_scale", "min": 0.1, "max": 5.0},
        {"parameter": "nu", "min": 0.5, "max": 2.5},
        {"parameter": "alpha", "min": 1e-6, "max": 1.0},
    ]);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let families = answer["families"].as_array().unwrap();
    assert_eq!(families.len(), 4);
    assert_eq!(answer["score_gradient"].as_array().unwrap().len(), 3);
    assert!(answer["score_gradient"][1].is_null());
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
    assert!(answer.get("alpha").is_none() && answer["alpha_path"].as_array().unwrap().is_empty());
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

#[tokio::test]
async fn what_no_kernel_explains_has_an_answer_or_a_reason() {
    let server = Server::start().await;
    let with = |values: &dyn Fn(usize) -> f64, more: Value| {
        let mut body = json!({"cloud": {"points": fibonacci_sphere(30)}, "values": (0..30).map(values).collect::<Vec<f64>>()});
        body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        body
    };
    // Constant values, also such whose squares underflow.
    for size in [0.0, 5.0, 1e-165] {
        for criterion in ["generalized_cross_validation", "marginal_likelihood", "leave_one_out"] {
            let kernel = json!({"family": "gauss", "length_scale": 1.0});
            let more = json!({"criterion": criterion, "kernel": kernel, "alpha": 0.1, "mean": "constant"});
            server.post("/v1/model-selection", &with(&|_| size, more)).await.expect_ok();
        }
    }
    let constant = with(&|_| 5.0, json!({"criterion": "generalized_cross_validation"}));
    server.post("/v1/model-selection", &constant).await.expect_ok();
    // Variances at the bounds that kernels accept, and beyond.
    for size in [3e69, 3e-69] {
        let body = with(&|i| size * (i as f64).sin(), json!({}));
        server.post("/v1/model-selection", &body).await.expect_ok();
    }
    let body = with(&|i| 1e100 * (i as f64).sin(), json!({}));
    let refused = server.post("/v1/model-selection", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(refused["errors"][0]["pointer"], "/values");
}

#[tokio::test]
async fn a_point_that_the_mean_hangs_on_is_predicted_by_nothing() {
    let server = Server::start().await;
    let points = [[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [0, 1]];
    let mut body = json!({"cloud": {"points": points}, "values": [1, 3, 2, 4, 3, 9], "mean": "linear",
        "kernel": {"family": "matern", "length_scale": 1.0}, "alpha": 0.05});
    for criterion in ["marginal_likelihood", "generalized_cross_validation"] {
        body["criterion"] = json!(criterion);
        let answer = server.post("/v1/model-selection", &body).await.expect_ok();
        for name in ["means", "variances", "log_predictive_densities"] {
            let entries = answer["leave_one_out"][name].as_array().unwrap();
            let is_null: Vec<bool> = entries.iter().map(Value::is_null).collect();
            assert_eq!(is_null, [false, false, false, false, false, true], "{criterion} {name}");
        }
    }
    body["criterion"] = json!("leave_one_out");
    let refused = server.post("/v1/model-selection", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(refused["errors"][0]["pointer"], "/mean");
}

#[tokio::test]
async fn bounds_that_meet_are_no_slope_and_noise_is_found_from_a_start_without() {
    let server = Server::start().await;
    let mut body = measured(100, 0.3);
    body["kernel"] = json!({"family": "matern", "nu": 4.5, "length_scale": 1.0});
    body["mean"] = json!("constant");
    // With a given kernel the default α is 1e-10.
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let noise = answer["alpha"].as_f64().unwrap().sqrt();
    assert!((0.22..0.38).contains(&noise), "{noise}");
    body["vary"] = json!([{"parameter": "length_scale", "min": 0.1, "max": 10},
        {"parameter": "variance", "min": 0.01, "max": 100}, {"parameter": "alpha", "min": 0.01, "max": 0.01}]);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    assert_eq!(answer["converged"], true, "{}", answer["score_gradient"]);
    assert!(answer["score_gradient"][2].as_f64().unwrap() > 1.0);
}

#[tokio::test]
async fn too_many_points_and_too_much_that_is_free_are_refused_beforehand() {
    let server = Server::start().await;
    let free = |parameter: &str| json!({"parameter": parameter, "min": 0.1, "max": 1});
    let line: Vec<[f64; 1]> = (0..30).map(|i| [f64::from(i)]).collect();
    let body = json!({"cloud": {"points": line}, "values": (0..30).map(|i| f64::from(i).sin()).collect::<Vec<f64>>()});
    for (vary, families, pointer) in [
        (json!([free("length_scale"), free("length_scales")]), json!(["gauss"]), "/vary/0"),
        (json!(vec![free("length_scales"); 65]), json!(["gauss"]), "/vary"),
        (json!([free("variance"), free("nu")]), json!(["gauss"]), "/vary/1"),
        (
            json!([{"parameter": "length_scales", "axis": 1, "min": 0.1, "max": 1}]),
            json!(["gauss"]),
            "/vary/0/axis",
        ),
    ] {
        let mut body = body.clone();
        (body["vary"], body["families"]) = (vary, families);
        let refused = server.post("/v1/model-selection", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(refused["errors"][0]["pointer"], pointer);
    }
    // When nu varies, Matérn is searched, whatever the starting kernel.
    let mut varied = body.clone();
    varied["kernel"] = json!({"family": "gauss", "length_scale": 2.0});
    varied["vary"] = json!([{"parameter": "nu", "min": 0.5, "max": 2.5}]);
    let answer = server.post("/v1/model-selection", &varied).await.expect_ok();
    assert_eq!(answer["families"].as_array().unwrap().len(), 4);
    let many = json!({"cloud": {"points": fibonacci_sphere(5001)}, "values": vec![1.0; 5001]});
    let refused = server.post("/v1/model-selection", &many).await.expect_problem(413, "problem-too-large");
    assert_eq!((&refused["limit"], &refused["required"]), (&json!(5000), &json!(5001)));
}

/// Selects kernels for smooth values without noise, whose best matrices are singular to rounding.
#[tokio::test]
async fn what_is_selected_is_served_when_it_is_sent_back() {
    let server = Server::start().await;
    for (n, dimension) in [(30, 1), (120, 2), (300, 3)] {
        let mut random = Random(n as u64);
        let points: Vec<Vec<f64>> =
            (0..n).map(|_| (0..dimension).map(|_| random.uniform()).collect()).collect();
        let value = |x: &Vec<f64>| (3.0 * x[0]).sin() + x.last().unwrap_or(&0.0) * x[0];
        let values: Vec<f64> = points.iter().map(value).collect();
        for criterion in ["marginal_likelihood", "leave_one_out", "generalized_cross_validation"] {
            let asked = json!({
                "cloud": {"points": points}, "values": values, "criterion": criterion, "mean": "constant",
                "kernel": {"family": "gauss", "length_scale": 0.1}, "alpha": 1e-3, "families": ["gauss", "matern"],
                "vary": [
                    {"parameter": "length_scale", "min": 0.01, "max": 100.0},
                    {"parameter": "variance", "min": 1e-3, "max": 1e3},
                    {"parameter": "alpha", "min": 1e-20, "max": 1.0},
                ],
            });
            let selected = server.post("/v1/model-selection", &asked).await.expect_ok();
            let sent_back = json!({
                "cloud": {"points": points}, "values": values, "mean": "constant",
                "include": ["variances", "log_marginal_likelihood"],
                "kernel": selected["kernel"], "alpha": selected["alpha"], "queries": [points[0]],
            });
            server.post("/v1/posterior", &sent_back).await.expect_ok();
        }
    }
}

/// Rows of three columns in different units, of which the third does not matter.
fn table(n: usize) -> Value {
    let mut random = Random(n as u64 + 7);
    let rows: Vec<[f64; 3]> = (0..n).map(|_| [0, 1, 2].map(|_| random.uniform())).collect();
    let values: Vec<f64> =
        rows.iter().map(|x| (6.0 * x[0]).sin() + 2.0 * x[1] + 0.1 * random.normal()).collect();
    let points: Vec<[f64; 3]> = rows.iter().map(|x| [1e-3 * x[0], 1e3 * x[1], x[2]]).collect();
    json!({"cloud": {"points": points}, "values": values, "restarts": 0})
}

#[tokio::test]
async fn the_columns_of_a_table_start_with_length_scales_of_their_own() {
    let server = Server::start().await;
    let mut body = table(120);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let scales = numbers(&answer["kernel"]["length_scales"]);
    assert!(scales[0] < 0.01 && scales[1] > 100.0 && scales[2] > 0.5, "{scales:?}");
    assert_eq!(answer["score_gradient"].as_array().unwrap().len(), 5);
    let noise = answer["alpha"].as_f64().unwrap().sqrt();
    assert!((0.07..0.14).contains(&noise), "{noise}");
    // One length scale for all may be asked for all the same.
    body["vary"] = json!([{"parameter": "length_scale", "min": 1e-3, "max": 1e3}]);
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    assert!(answer["kernel"]["length_scale"].as_f64().unwrap() > 0.0);
}

#[tokio::test]
async fn rows_that_repeat_count_once_where_noise_is_searched_for() {
    let server = Server::start().await;
    let kernel = json!({"family": "matern", "length_scale": 1.0});
    let mut body = measured(120, 0.2);
    (body["kernel"], body["alpha"], body["mean"]) = (kernel, json!(0.1), json!("constant"));
    let plain = server.post("/v1/model-selection", &body).await.expect_ok();
    for name in ["points", "values"] {
        let rows = if name == "points" { &mut body["cloud"][name] } else { &mut body[name] };
        let rows = rows.as_array_mut().unwrap();
        rows.extend_from_within(10..50);
    }
    let answer = server.post("/v1/model-selection", &body).await.expect_ok();
    let (a, b) = (plain["alpha"].as_f64().unwrap(), answer["alpha"].as_f64().unwrap());
    assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    let predictions = numbers(&answer["leave_one_out"]["means"]);
    assert_eq!((predictions.len(), &predictions[120..]), (160, &predictions[10..50]));
    let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
    let repeated = warnings.iter().find(|warning| warning["code"] == "repeated_rows").unwrap();
    assert!(repeated["detail"].as_str().unwrap().contains(": 40;"), "{repeated}");
    // Without a kernel, rows that repeat are left out before the search.
    body.as_object_mut().unwrap().retain(|name, _| name != "kernel" && name != "alpha");
    let learned = server.post("/v1/model-selection", &body).await.expect_ok();
    let noise = learned["alpha"].as_f64().unwrap().sqrt();
    assert!((0.16..0.25).contains(&noise), "{noise}");
    assert_eq!(numbers(&learned["leave_one_out"]["means"]).len(), 160);
    // Noise that is given is that of measurements, which all count.
    (body["alpha"], body["vary"]) = (json!(0.04), json!([]));
    let given = server.post("/v1/model-selection", &body).await.expect_ok();
    assert_eq!(given["diagnostics"]["warnings"], json!([]));
}
