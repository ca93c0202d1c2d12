//! Learning without parameters: kernel, noise and mean from the values alone, and error bars that cover the
//! truth.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// Returns points and values: x₃ on the unit sphere plus noise of deviation `noise`, times `factor`, plus
/// `offset`.
fn measured(n: usize, noise: f64, factor: f64, offset: f64) -> (Vec<[f64; 3]>, Vec<f64>) {
    let (points, mut random) = (fibonacci_sphere(n), Random(n as u64));
    let values = points.iter().map(|x| offset + factor * (x[2] + noise * random.normal())).collect();
    (points, values)
}

/// Returns the share of errors within 1.96 deviations.
fn coverage(found: &[f64], deviations: &[f64], truth: &[f64]) -> f64 {
    let errors = found.iter().zip(truth).map(|(a, b)| (a - b).abs());
    let within = errors.zip(deviations).filter(|(error, deviation)| *error <= 1.96 * *deviation).count();
    within as f64 / truth.len() as f64
}

fn root_mean_square(of: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = of.map(|x| x * x).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[tokio::test]
async fn measured_values_need_no_parameters_whatever_their_unit_and_offset() {
    let server = Server::start().await;
    for (factor, offset) in [(1.0, 0.0), (1e-6, 3e-6), (1e6, 1e6), (1.0, 1e6)] {
        let (points, values) = measured(400, 0.05, factor, offset);
        let truth: Vec<f64> = points.iter().map(|x| offset + factor * x[2]).collect();
        let body = json!({"cloud": {"points": points}, "values": values, "include": ["variances"]});
        let answer = server.post("/v1/posterior", &body).await.expect_ok();
        let (means, variances) = (numbers(&answer["means"]), numbers(&answer["variances"]));
        let deviations: Vec<f64> = variances.iter().map(|variance| variance.sqrt()).collect();
        let error = root_mean_square(means.iter().zip(&truth).map(|(a, b)| (a - b) / factor));
        // About ten functions are fitted in place of one linear function, so the error is √(10/400) of the
        // noise.
        assert!(error < 0.05 * 0.3, "{factor} {offset}: {error}");
        assert!(coverage(&means, &deviations, &truth) > 0.85, "{factor} {offset}");
        let diagnostics = &answer["diagnostics"];
        let noise = diagnostics["alpha"].as_f64().unwrap().sqrt() / factor;
        assert!((0.04..0.063).contains(&noise), "{noise}");
        assert_eq!(diagnostics["mean_coefficients"].as_array().unwrap().len(), 1);
        assert_eq!(diagnostics["warnings"], json!([]));
    }
}

#[tokio::test]
async fn what_was_learned_can_be_pinned() {
    let server = Server::start().await;
    let (points, values) = measured(150, 0.1, 3.0, 20.0);
    let queries = [[0.3, 0.4, 0.5], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
    for mean in ["constant", "linear", "zero"] {
        let mut body = json!({"cloud": {"points": points}, "values": values, "queries": queries, "mean": mean,
            "include": ["variances", "observation_variances", "covariance", "gradients", "log_marginal_likelihood"]});
        let learned = server.post("/v1/posterior", &body).await.expect_ok();
        body["kernel"] = learned["diagnostics"]["kernel"].clone();
        body["alpha"] = learned["diagnostics"]["alpha"].clone();
        let pinned = server.post("/v1/posterior", &body).await;
        assert_eq!(pinned.header("cache-status"), "gramian; hit", "{mean}");
        // Equal to the last bit.
        assert_eq!(pinned.expect_ok(), learned, "{mean}");
        assert_eq!(learned["diagnostics"].get("mean_coefficients").is_some(), mean != "zero");
    }
}

#[tokio::test]
async fn one_factor_serves_kernels_of_every_variance() {
    let server = Server::start().await;
    let (points, values) = measured(60, 0.1, 1.0, 0.0);
    let posterior = async |variance: f64| {
        let kernel = json!({"family": "matern", "length_scale": 1.0, "variance": variance});
        let include = ["variances", "log_marginal_likelihood"];
        let body = json!({"cloud": {"points": points}, "values": values, "queries": [[0.2, 0.3, 0.4]], "kernel": kernel,
            "alpha": 0.01 * variance, "include": include});
        server.post("/v1/posterior", &body).await
    };
    let one = posterior(1.0).await.expect_ok();
    let four = posterior(4.0).await;
    assert_eq!(four.header("cache-status"), "gramian; hit");
    let four = four.expect_ok();
    assert_eq!(one["means"], four["means"]);
    assert_eq!(4.0 * numbers(&one["variances"])[0], numbers(&four["variances"])[0]);
    assert_eq!(four["diagnostics"]["kernel"]["variance"], 4.0);
    assert_eq!(four["diagnostics"]["alpha"], 0.04);
    let of = |answer: &Value, member: &str| answer["diagnostics"][member].as_f64().unwrap();
    assert!((of(&one, "native_norm_squared") / of(&four, "native_norm_squared") - 4.0).abs() < 1e-12);
    // ln N(Y; 0, 4C) = ln N(Y; 0, C) + ⅜ YᵀC⁻¹Y − ½ n ln 4. The energy YᵀC⁻¹Y follows from both likelihoods.
    let of = |answer: &Value| answer["log_marginal_likelihood"].as_f64().unwrap();
    let energy = (of(&four) - of(&one) + 30.0 * 4f64.ln()) / 0.375;
    assert!(energy > 0.0);
    let ninth = posterior(9.0).await.expect_ok();
    assert!((of(&ninth) - of(&one) + 30.0 * 9f64.ln() - energy * 4.0 / 9.0).abs() < 1e-8);
}

#[tokio::test]
async fn far_away_the_mean_is_served_with_all_of_the_variance() {
    let server = Server::start().await;
    let (points, values) = measured(100, 0.01, 1.0, 7.0);
    let body = json!({"cloud": {"points": points}, "values": values, "queries": [[300.0, 0.0, 0.0]], "include": ["variances"]});
    let answer = server.post("/v1/posterior", &body).await.expect_ok();
    let mean = numbers(&answer["diagnostics"]["mean_coefficients"])[0];
    assert!((numbers(&answer["means"])[0] - mean).abs() < 1e-9);
    let variance = answer["diagnostics"]["kernel"]["variance"].as_f64().unwrap();
    assert!(numbers(&answer["variances"])[0] >= variance, "that of the mean on top");
}

#[tokio::test]
async fn operators_of_measured_values_have_bars_that_cover() {
    let server = Server::start().await;
    let (points, values) = measured(500, 0.01, 1.0, 0.0);
    let mut body = json!({"cloud": {"points": points}, "values": values, "include": ["std"]});
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    let truth: Vec<f64> = points.iter().map(|x| -2.0 * x[2]).collect();
    let (found, bars) = (numbers(&answer["laplacians"]), numbers(&answer["laplacian_std"]));
    let error = root_mean_square(found.iter().zip(&truth).map(|(a, b)| a - b));
    // If the values were taken as exact, noise would exceed the signal: the Laplacian of noise is 7σ/h².
    assert!(error < 0.1, "{error}");
    assert!(coverage(&found, &bars, &truth) > 0.88);
    let answer = server.post("/v1/surface-gradient", &body).await.expect_ok();
    let truth: Vec<f64> =
        points.iter().flat_map(|x| [-x[2] * x[0], -x[2] * x[1], 1.0 - x[2] * x[2]]).collect();
    let (found, bars) = (numbers(&answer["gradients"]), numbers(&answer["gradient_std"]));
    assert!(coverage(&found, &bars, &truth) > 0.88);
    assert_eq!(answer["flags"], json!([]));

    // A kernel that is far too narrow has wide bars, and all queries are flagged.
    body["kernel"] = json!({"family": "gauss", "length_scale": 0.05});
    body["alpha"] = json!(1e-4);
    body["surface"] = json!({"model": "regression"});
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    let flags = answer["flags"].as_array().unwrap();
    assert_eq!(flags.len(), 500);
    assert!(flags.iter().all(|entry| entry["reason"] == "uncertain"));
}

#[tokio::test]
async fn interpolants_have_deviations_of_all_that_is_asked_for() {
    let server = Server::start().await;
    let (points, values) = measured(80, 0.02, 1.0, 0.0);
    let queries = [[0.3, 0.4, 0.5], [1.0, 0.0, 0.0]];
    let kernel = json!({"family": "matern", "nu": 3.5, "length_scale": 1.0, "variance": 2.0});
    let mut body = json!({"cloud": {"points": points}, "values": values, "queries": queries, "kernel": kernel, "alpha": 4e-4,
        "derivatives": 2, "include": ["std"]});
    let answer = server.post("/v1/interpolation", &body).await.expect_ok();
    assert_eq!(numbers(&answer["gradient_std"]).len(), 6);
    assert_eq!(numbers(&answer["hessian_std"]).len(), 18);
    let mut asked = body.clone();
    asked.as_object_mut().unwrap().remove("derivatives");
    asked["include"] = json!(["variances"]);
    let posterior = server.post("/v1/posterior", &asked).await.expect_ok();
    for (deviation, variance) in numbers(&answer["value_std"]).iter().zip(numbers(&posterior["variances"])) {
        assert!((deviation * deviation - variance).abs() < 1e-12);
    }
    // The local solver agrees, since its neighbourhoods hold all points.
    asked["include"] = json!(["std"]);
    asked["solver"] = json!("local");
    let local = server.post("/v1/interpolation", &asked).await.expect_ok();
    for (a, b) in numbers(&local["value_std"]).iter().zip(numbers(&answer["value_std"])) {
        assert!((a - b).abs() < 1e-9);
    }
    assert!(local.get("gradient_std").is_none());
    body["solver"] = json!("local");
    let local = server.post("/v1/interpolation", &body).await.expect_ok();
    for name in ["value_std", "gradient_std", "hessian_std"] {
        for (a, b) in numbers(&local[name]).iter().zip(numbers(&answer[name])) {
            assert!((a - b).abs() < 1e-6 * b, "{name}: {a} and {b}");
        }
    }
    asked["include"] = json!(["gradient_variances"]);
    let posterior = server.post("/v1/posterior", &asked).await.expect_ok();
    assert!(posterior.get("gradients").is_none() && posterior.get("variances").is_none());
    let variances = numbers(&posterior["gradient_variances"]);
    assert!(!variances.is_empty());
    for (variance, deviation) in variances.iter().zip(numbers(&local["gradient_std"])) {
        assert!((variance - deviation * deviation).abs() < 1e-12 * variance);
    }
    for solver in ["dense", "local"] {
        body["solver"] = json!(solver);
        body["kernel"] = json!({"family": "matern", "nu": 1.5, "length_scale": 1.0});
        let refused = server.post("/v1/interpolation", &body).await.expect_problem(422, "kernel-not-smooth");
        assert_eq!(refused["errors"][0]["pointer"], "/kernel/family");
    }
}

#[tokio::test]
async fn means_are_refused_where_there_are_none() {
    let server = Server::start().await;
    let flat: Vec<[f64; 3]> = fibonacci_sphere(60).iter().map(|x| [x[0], x[1], 0.0]).collect();
    let values: Vec<f64> = flat.iter().map(|x| x[0]).collect();
    let body = json!({"cloud": {"points": flat}, "values": values, "mean": "linear"});
    let refused = server.post("/v1/interpolation", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(refused["errors"][0]["pointer"], "/mean");
    let (points, _) = measured(300, 0.0, 1.0, 0.0);
    let body = json!({"cloud": {"points": points}, "mean": "constant"});
    let refused = server.post("/v1/normals", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(refused["errors"][0]["pointer"], "/mean");
}

#[tokio::test]
async fn the_local_solver_learns_as_well() {
    let server = Server::start().await;
    let (points, values) = measured(600, 0.05, 10.0, 1e3);
    let mut body =
        json!({"cloud": {"points": points}, "values": values, "include": ["variances"], "solver": "local"});
    let local = server.post("/v1/posterior", &body).await.expect_ok();
    body["solver"] = json!("dense");
    let dense = server.post("/v1/posterior", &body).await.expect_ok();
    assert_eq!(local["diagnostics"]["kernel"], dense["diagnostics"]["kernel"]);
    assert_eq!(local["diagnostics"]["alpha"], dense["diagnostics"]["alpha"]);
    let truth: Vec<f64> = points.iter().map(|x| 1e3 + 10.0 * x[2]).collect();
    let bars: Vec<f64> = numbers(&local["variances"]).iter().map(|variance| variance.sqrt()).collect();
    assert!(coverage(&numbers(&local["means"]), &bars, &truth) > 0.85);
    let mean = |answer: &Value| numbers(&answer["diagnostics"]["mean_coefficients"])[0];
    // The local solver estimates the mean from a sample, the dense one from all points. They agree within the
    // deviation of the process.
    let deviation = dense["diagnostics"]["kernel"]["variance"].as_f64().unwrap().sqrt();
    assert!((mean(&local) - mean(&dense)).abs() < deviation);
    // The mean is estimated from a sample also when the kernel is given.
    body["kernel"] = dense["diagnostics"]["kernel"].clone();
    body["alpha"] = dense["diagnostics"]["alpha"].clone();
    body["mean"] = json!("constant");
    body["solver"] = json!("local");
    let pinned = server.post("/v1/posterior", &body).await.expect_ok();
    assert!((mean(&pinned) - mean(&local)).abs() < 1e-6 * deviation);
}

#[tokio::test]
async fn equal_requests_at_once_learn_once() {
    let server = Server::start().await;
    let (points, values) = measured(300, 0.05, 1.0, 0.0);
    let body = json!({"cloud": {"points": points}, "values": values, "include": ["variances"]});
    let asked = (0..8).map(|_| server.post("/v1/posterior", &body));
    let answers = futures_util::future::join_all(asked).await;
    let answers: Vec<Value> = answers.into_iter().map(|answer| answer.expect_ok()).collect();
    let first = answers[0].clone();
    assert!(answers.iter().all(|answer| *answer == first));
    let again = server.post("/v1/posterior", &body).await;
    assert_eq!(again.header("cache-status"), "gramian; hit");
    assert_eq!(again.expect_ok(), first);
}
