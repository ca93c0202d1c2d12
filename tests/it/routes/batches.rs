//! Batches of value lists on one cloud, and the optional parts of a posterior besides means and variances.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// Returns `n` points of the unit sphere and `k` lists of noisy values at them, each with its own mean.
fn lists(n: usize, k: usize) -> (Vec<[f64; 3]>, Vec<Vec<f64>>) {
    let (points, mut random) = (fibonacci_sphere(n), Random(11));
    let mut list = |at: usize| {
        let shift = at as f64;
        points.iter().map(|x| 5.0 * shift + (2.0 * x[0] + shift).sin() + 0.05 * random.normal()).collect()
    };
    let values = (0..k).map(&mut list).collect();
    (points, values)
}

const QUERIES: [[f64; 3]; 3] = [[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [3.0, 0.0, 0.0]];

fn assert_close(found: &Value, expected: &Value, tolerance: f64) {
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(1.0f64, |a, x| a.max(x.abs()));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= tolerance * scale, "{a} {b}");
    }
}

fn with(body: &Value, member: &str, value: Value) -> Value {
    let mut body = body.clone();
    body[member] = value;
    body
}

#[tokio::test]
async fn lists_share_a_fit_and_are_answered_as_each_alone() {
    let server = Server::start().await;
    let (points, values) = lists(120, 4);
    let posterior = [
        "variances",
        "observation_variances",
        "covariance",
        "gradients",
        "gradient_variances",
        "log_marginal_likelihood",
    ];
    for mean in ["constant", "linear", "zero"] {
        for (route, extra) in [
            ("/v1/interpolation", json!({"derivatives": 2, "include": ["std"]})),
            ("/v1/posterior", json!({"include": posterior, "quantiles": [0.1, 0.5], "threshold": 3.0})),
        ] {
            let mut body =
                json!({"cloud": {"points": points}, "values": values, "queries": QUERIES, "mean": mean});
            body.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
            let batch = server.post(&format!("{route}/batch"), &body).await.expect_ok();
            body["kernel"] = batch["diagnostics"]["kernel"].clone();
            body["alpha"] = batch["diagnostics"]["alpha"].clone();
            for (at, list) in values.iter().enumerate() {
                body["values"] = json!(list);
                let alone = server.post(route, &body).await.expect_ok();
                for (name, found) in batch.as_object().unwrap() {
                    let of_alone = match name.as_str() {
                        "diagnostics" => continue,
                        "log_marginal_likelihoods" => &alone["log_marginal_likelihood"],
                        "mean_coefficients" => &alone["diagnostics"][name],
                        name => &alone[name],
                    };
                    let is_shared = name.contains("varianc") || name.contains("std");
                    let found = if is_shared { found } else { &found[at] };
                    // The order of solves and sums differs.
                    assert_close(found, of_alone, 1e-9);
                }
            }
        }
    }
}

#[tokio::test]
async fn a_kernel_that_is_not_given_is_learned_from_all_lists() {
    let server = Server::start().await;
    let (points, values) = lists(200, 40);
    let mut body = json!({"cloud": {"points": points}, "values": values});
    let answer = server.post("/v1/interpolation/batch", &body).await.expect_ok();
    let noise = answer["diagnostics"]["alpha"].as_f64().unwrap().sqrt();
    // Sixteen lists of 200 values determine the noise to 2 %. The grid has steps of 15 %.
    assert!((0.042..0.058).contains(&noise), "{noise}");
    assert!(answer["mean_coefficients"].as_array().unwrap().len() == 40);
    body["values"] = json!(values[..1]);
    let of_one = server.post("/v1/interpolation/batch", &body).await.expect_ok();
    body["values"] = json!(values[0]);
    let alone = server.post("/v1/interpolation", &body).await.expect_ok();
    assert_eq!(of_one["diagnostics"]["kernel"], alone["diagnostics"]["kernel"]);
    assert_close(&of_one["values"][0], &alone["values"], 1e-9);
}

#[tokio::test]
async fn samples_are_those_of_the_seed_and_of_the_posterior() {
    let server = Server::start().await;
    let (points, values) = lists(60, 2);
    let kernel = json!({"family": "matern", "length_scale": 1.0, "variance": 2.0});
    let mut body = json!({"cloud": {"points": points}, "values": values[0], "queries": QUERIES, "kernel": kernel, "alpha": 0.01,
        "include": ["covariance"], "samples": {"count": 4000, "seed": 5}});
    let answer = server.post("/v1/posterior", &body).await.expect_ok();
    assert_eq!(server.post("/v1/posterior", &body).await.expect_ok(), answer);
    let (samples, means) = (numbers(&answer["samples"]), numbers(&answer["means"]));
    let covariance = numbers(&answer["covariance"]);
    for i in 0..3 {
        for j in 0..3 {
            let of_draw = |draw: &[f64]| (draw[i] - means[i]) * (draw[j] - means[j]);
            let found = samples.chunks_exact(3).map(of_draw).sum::<f64>() / 4000.0;
            let spread = (covariance[4 * i] * covariance[4 * j]).sqrt();
            // Five standard errors.
            assert!((found - covariance[3 * i + j]).abs() < 5.0 * spread * (2.0f64 / 4000.0).sqrt());
        }
    }
    body["samples"]["count"] = json!(2);
    let fewer = server.post("/v1/posterior", &body).await.expect_ok();
    // Products of different shapes may differ in the last bit.
    assert_close(&fewer["samples"], &json!(answer["samples"].as_array().unwrap()[..2]), 1e-13);
    body["samples"]["seed"] = json!(6);
    let other = server.post("/v1/posterior", &body).await.expect_ok();
    assert_ne!(other["samples"], fewer["samples"]);
    body["values"] = json!([values[0], values[0]]);
    let batch = server.post("/v1/posterior/batch", &body).await.expect_ok();
    assert_ne!(batch["samples"][0], batch["samples"][1], "lists are drawn for independently");
    assert_close(&batch["samples"][0], &other["samples"], 1e-9);
}

#[tokio::test]
async fn quantiles_and_exceedances_are_those_of_normal_distributions() {
    let server = Server::start().await;
    let (points, values) = lists(60, 1);
    let kernel = json!({"family": "gauss", "length_scale": 0.8});
    let mut body = json!({"cloud": {"points": points}, "values": values[0], "queries": QUERIES, "kernel": kernel, "alpha": 0.04,
        "include": ["variances", "observation_variances", "gradient_variances"], "quantiles": [0.025, 0.5, 0.975], "threshold": 0.25});
    let answer = server.post("/v1/posterior", &body).await.expect_ok();
    let (means, variances) = (numbers(&answer["means"]), numbers(&answer["variances"]));
    for (query, (mean, variance)) in means.iter().zip(&variances).enumerate() {
        for (row, z) in [-1.959963984540054, 0.0, 1.959963984540054].into_iter().enumerate() {
            let expected = mean + z * variance.sqrt();
            assert!((answer["quantiles"][row][query].as_f64().unwrap() - expected).abs() < 1e-13);
        }
    }
    // Far away the function is normal with variance 1 and mean 0: Φ(−0.25), by scipy.stats.norm. The variance
    // of an observation is 1.04.
    let observed = server.post("/v1/posterior", &with(&body, "of", json!("observation"))).await.expect_ok();
    for (answer, expected) in [(&answer, 0.40129367), (&observed, 0.40317086)] {
        let probabilities = numbers(&answer["exceedance_probabilities"]);
        assert!((probabilities[2] - expected).abs() < 1e-3, "{probabilities:?}");
        assert!(probabilities.iter().all(|p| (0.0..=1.0).contains(p)));
    }
    for (query, variance) in numbers(&observed["observation_variances"]).iter().enumerate() {
        let expected = means[query] + 1.959963984540054 * variance.sqrt();
        assert!((observed["quantiles"][2][query].as_f64().unwrap() - expected).abs() < 1e-13);
    }
    let deviations = json!({"cloud": {"points": points}, "values": values[0], "queries": QUERIES, "kernel": kernel, "alpha": 0.04,
        "derivatives": 1, "include": ["std"]});
    let deviations = server.post("/v1/interpolation", &deviations).await.expect_ok();
    let squares: Vec<f64> = numbers(&deviations["gradient_std"]).iter().map(|s| s * s).collect();
    assert_close(&answer["gradient_variances"], &json!(squares), 1e-14);
    // The variance is 0 at a point that is interpolated exactly.
    body["alpha"] = json!(0.0);
    body["queries"] = json!([points[0]]);
    for (threshold, expected) in [(values[0][0] - 1e-3, 1.0), (values[0][0] + 1e-3, 0.0)] {
        body["threshold"] = json!(threshold);
        let answer = server.post("/v1/posterior", &body).await.expect_ok();
        assert!((numbers(&answer["exceedance_probabilities"])[0] - expected).abs() < 1e-9);
    }
}

/// Draws of an observation are those of the function with noise of variance α on top.
#[tokio::test]
async fn draws_of_an_observation_have_the_noise() {
    let server = Server::start().await;
    let (points, values) = lists(60, 1);
    let body = json!({"cloud": {"points": points}, "values": values[0], "queries": QUERIES,
        "kernel": {"family": "gauss", "length_scale": 0.8}, "alpha": 0.04, "samples": {"count": 4000, "seed": 5}});
    let of_function = server.post("/v1/posterior", &body).await.expect_ok();
    let observed = server.post("/v1/posterior", &with(&body, "of", json!("observation"))).await.expect_ok();
    let [function, observed] = [&of_function, &observed].map(|answer| numbers(&answer["samples"]));
    let noise: Vec<f64> = observed.iter().zip(&function).map(|(a, b)| a - b).collect();
    let n = noise.len() as f64;
    let (mean, square) = (noise.iter().sum::<f64>() / n, noise.iter().map(|x| x * x).sum::<f64>() / n);
    // Five standard errors: of 12,000 draws of variance 0.04.
    assert!(mean.abs() < 5.0 * 0.2 / n.sqrt(), "{mean}");
    assert!((square - 0.04).abs() < 5.0 * 0.04 * (2.0 / n).sqrt(), "{square}");
}

#[tokio::test]
async fn the_local_solver_has_quantiles_and_exceedances_but_nothing_joint() {
    let server = Server::start().await;
    let (points, values) = lists(300, 1);
    let mut body = json!({"cloud": {"points": points}, "values": values[0], "queries": QUERIES, "solver": "local",
        "include": ["variances"], "quantiles": [0.5], "threshold": 0.0});
    let answer = server.post("/v1/posterior", &body).await.expect_ok();
    assert_close(&answer["quantiles"][0], &answer["means"], 1e-15);
    assert_eq!(answer["exceedance_probabilities"].as_array().unwrap().len(), 3);
    body["samples"] = json!({"count": 1});
    let problem = server.post("/v1/posterior", &body).await.expect_problem(422, "unsupported-by-solver");
    assert_eq!(problem["errors"][0]["pointer"], "/samples");
    body["values"] = json!(values);
    for route in ["/v1/posterior/batch", "/v1/interpolation/batch"] {
        let mut body = json!({"cloud": {"points": points}, "values": values, "solver": "local"});
        server.post(route, &body).await.expect_problem(422, "unsupported-by-solver");
        body["solver"] = json!("dense");
        server.post(route, &body).await.expect_ok();
    }
}

#[tokio::test]
async fn what_is_no_batch_or_no_probability_is_refused() {
    let server = Server::start().await;
    let (points, values) = lists(20, 2);
    let batch = json!({"cloud": {"points": points}, "values": values});
    let short = vec![1.0; 19];
    for (values, slug, pointer) in [
        (json!([values[0], short]), "length-mismatch", "/values/1"),
        (json!([short, short]), "length-mismatch", "/values/0"),
        (json!([]), "invalid-request", "/values"),
        (json!(values[0]), "invalid-request", "/values/0"),
        (json!([values[0], [null]]), "invalid-request", "/values/1/0"),
    ] {
        let mut body = batch.clone();
        body["values"] = values;
        for route in ["/v1/posterior/batch", "/v1/interpolation/batch"] {
            let problem = server.post(route, &body).await.expect_problem(422, slug);
            assert_eq!(problem["errors"][0]["pointer"], pointer, "{route} {problem}");
        }
    }
    let posterior = json!({"cloud": {"points": points}, "values": values[0]});
    let noisy = json!(vec![0.1; 20]);
    for (member, value, pointer) in [
        ("quantiles", json!([0.5, 1.0]), "/quantiles/1"),
        ("quantiles", json!([0.0]), "/quantiles/0"),
        ("samples", json!({"count": 0}), "/samples/count"),
        ("samples", json!({"count": 1, "seed": -1}), "/samples/seed"),
        ("samples", json!({"count": 1, "seed": 1u64 << 53}), "/samples/seed"),
        ("samples", json!({"seed": 1}), "/samples"),
        ("threshold", json!(null), "/threshold"),
    ] {
        let mut body = posterior.clone();
        body[member] = value;
        let problem = server.post("/v1/posterior", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
    let mut body = posterior.clone();
    body["threshold"] = json!(1.0);
    body["noise_variances"] = noisy;
    server.post("/v1/posterior", &body).await.expect_ok();
    body["of"] = json!("observation");
    let problem = server.post("/v1/posterior", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(problem["errors"][0]["pointer"], "/of");
    // A request for more draws than an answer may hold is refused before any is drawn.
    let mut body = posterior;
    body["samples"] = json!({"count": 1_000_000_000u64});
    server.post("/v1/posterior", &body).await.expect_problem(413, "problem-too-large");
}

#[tokio::test]
async fn where_nothing_varies_samples_are_the_means_and_zeros_are_told() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": [[0.0], [1000.0]]}, "values": [1, 2], "alpha": 0, "samples": {"count": 3},
        "kernel": {"family": "gauss", "length_scale": 1.0}});
    let answer = server.post("/v1/posterior", &body).await.expect_ok();
    assert_eq!(answer["samples"], json!([[1.0, 2.0], [1.0, 2.0], [1.0, 2.0]]));
    // At points without noise the variances are 0 up to rounding, which makes some of them negative.
    let (points, values) = lists(150, 1);
    let mut body = json!({"cloud": {"points": points}, "values": values[0], "alpha": 0, "include": ["std"],
        "kernel": {"family": "gauss", "length_scale": 0.3}});
    for solver in ["dense", "local"] {
        body["solver"] = json!(solver);
        let answer = server.post("/v1/interpolation", &body).await.expect_ok();
        let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
        // The local solver leaves points out before only rounding is left of a variance.
        let is_told = warnings.iter().any(|warning| warning["code"] == "variance_clamped");
        assert!(is_told || solver == "local", "{warnings:?}");
        assert!(numbers(&answer["value_std"]).iter().all(|deviation| *deviation >= 0.0));
    }
}

#[tokio::test]
async fn deviations_have_digits_in_every_unit() {
    let server = Server::start().await;
    for (unit, variance) in [(1e90_f64, 1.0_f64), (1e-80, 1.0), (1e99, 1e-130), (1e-60, 1e100)] {
        let points: Vec<[f64; 1]> = [0.0, 0.7, 1.9].map(|x| [x * unit]).to_vec();
        let body = |solver: &str| {
            json!({"cloud": {"points": points}, "values": [1, 2, 0], "queries": [[0.4 * unit], [3.0 * unit]],
                "kernel": {"family": "gauss", "length_scale": unit, "variance": variance}, "alpha": 1e-3 * variance,
                "derivatives": 2, "include": ["std"], "solver": solver})
        };
        let dense = server.post("/v1/interpolation", &body("dense")).await.expect_ok();
        let local = server.post("/v1/interpolation", &body("local")).await.expect_ok();
        for (name, order) in [("value_std", 0), ("gradient_std", 1), ("hessian_std", 2)] {
            for (a, b) in numbers(&dense[name]).iter().zip(numbers(&local[name])) {
                let unit = variance.sqrt() / unit.powi(order);
                assert!(
                    (a / b - 1.0).abs() < 1e-9 && (0.01..10.0).contains(&(a / unit)),
                    "{unit} {name}: {a} {b}"
                );
            }
        }
    }
}
