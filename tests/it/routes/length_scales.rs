//! Length scales for each axis of the points.

use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// Returns random points of the unit cube divided by `length_scales`, and the points themselves.
fn stretched_apart(n: usize, seed: u64, length_scales: [f64; 3]) -> [Vec<[f64; 3]>; 2] {
    let mut random = Random(seed);
    let points: Vec<[f64; 3]> = (0..n).map(|_| [(); 3].map(|()| random.uniform())).collect();
    let divided = points.iter().map(|x| std::array::from_fn(|c| x[c] / length_scales[c]));
    [divided.collect(), points].map(|points: Vec<[f64; 3]>| points)
}

fn assert_close(found: &Value, expected: &[f64], what: &str) {
    let found = numbers(found);
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    for (a, b) in found.iter().zip(expected) {
        // Coordinates are rounded differently, and the condition number is some thousands.
        assert!((a - b).abs() <= 1e-10 * scale, "{what}: {a} {b}");
    }
}

#[tokio::test]
async fn values_are_those_of_coordinates_in_units_of_their_length_scales() {
    let server = Server::start().await;
    let length_scales = [0.4, 1.3, 0.7];
    let [divided, points] = stretched_apart(150, 1, length_scales);
    let [far_queries, queries] = stretched_apart(7, 2, length_scales);
    let values: Vec<f64> = points.iter().map(|x| (5.0 * x[0]).sin() + x[1] * x[2]).collect();
    for solver in ["dense", "local"] {
        for family in ["gauss", "matern", "inverse_multiquadric", "laplace", "wendland"] {
            let ours = json!({"family": family, "length_scales": length_scales, "variance": 2.0});
            let theirs = json!({"family": family, "length_scale": 1.0, "variance": 2.0});
            let body = |kernel: &Value, points: &[[f64; 3]], queries: &[[f64; 3]]| {
                json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 0.01, "values": values,
                    "queries": queries, "solver": solver})
            };
            for (path, include) in
                [("/v1/interpolation", json!([])), ("/v1/posterior", json!(["variances", "gradients"]))]
            {
                let [mut a, mut b] = [body(&ours, &points, &queries), body(&theirs, &divided, &far_queries)];
                for body in [&mut a, &mut b] {
                    match path {
                        "/v1/posterior" if solver == "dense" => body["include"] = include.clone(),
                        "/v1/posterior" => body["include"] = json!(["variances"]),
                        _ => body["derivatives"] = json!(2),
                    }
                }
                let a = server.post(path, &a).await.expect_ok();
                let b = server.post(path, &b).await.expect_ok();
                for (name, entry) in a.as_object().unwrap() {
                    let powers = match name.as_str() {
                        "diagnostics" => continue,
                        "gradients" => 1,
                        "hessians" => 2,
                        _ => 0,
                    };
                    let factor = |at: usize| match powers {
                        0 => 1.0,
                        1 => 1.0 / length_scales[at % 3],
                        _ => 1.0 / length_scales[at % 3] / length_scales[at / 3 % 3],
                    };
                    let expected: Vec<f64> =
                        numbers(&b[name]).iter().enumerate().map(|(at, x)| x * factor(at)).collect();
                    assert_close(entry, &expected, &format!("{path}, {solver}, {family}: {name}"));
                }
                assert_eq!(a["diagnostics"]["kernel"]["length_scales"], json!(length_scales));
                assert_eq!(a["diagnostics"]["kernel"].get("length_scale"), None);
            }
        }
    }
}

#[tokio::test]
async fn every_route_takes_them_and_repeats_what_it_took() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut body = route.request();
        body["kernel"] = json!({"family": "matern", "length_scales": [1.5, 1.2, 1.0]});
        body["alpha"] = json!(1e-6);
        let answer = server.post(route.path, &body).await.expect_ok();
        let kernel = &answer["diagnostics"]["kernel"];
        assert_eq!(kernel["length_scales"], json!([1.5, 1.2, 1.0]), "{}", route.path);
        body["kernel"] = kernel.clone();
        let mut again = server.post(route.path, &body).await.expect_ok();
        let mut answer = answer;
        for answer in [&mut answer, &mut again] {
            answer["diagnostics"] = json!(null);
        }
        assert_eq!(answer, again, "{}", route.path);
        for (kernel, status, slug, pointer) in [
            (
                json!({"family": "gauss", "length_scales": [1, 2]}),
                422,
                "invalid-request",
                "/kernel/length_scales",
            ),
            (
                json!({"family": "gauss", "length_scales": [1, 0, 1]}),
                422,
                "invalid-request",
                "/kernel/length_scales/1",
            ),
            (
                json!({"family": "gauss", "length_scale": 1, "length_scales": [1, 1, 1]}),
                422,
                "invalid-request",
                "/kernel/length_scales",
            ),
            (
                json!({"family": "gauss", "length_scales": vec![1; 17]}),
                413,
                "problem-too-large",
                "/kernel/length_scales",
            ),
        ] {
            body["kernel"] = kernel;
            let problem = server.post(route.path, &body).await.expect_problem(status, slug);
            assert_eq!(problem["errors"][0]["pointer"], pointer, "{}: {problem}", route.path);
        }
    }
}

#[tokio::test]
async fn selection_finds_the_axes_that_do_not_matter() {
    let server = Server::start().await;
    let (points, mut random) = (fibonacci_sphere(200), Random(9));
    let values: Vec<f64> =
        points.iter().map(|x| (4.0 * x[0]).sin() + 0.5 * x[1] + 0.05 * random.normal()).collect();
    let mut body = json!({
        "cloud": {"points": points}, "values": values, "kernel": {"family": "gauss", "length_scale": 1.0}, "alpha": 0.01,
        "vary": [
            {"parameter": "length_scales", "min": 0.05, "max": 50.0},
            {"parameter": "variance", "min": 0.01, "max": 100.0},
            {"parameter": "alpha", "min": 1e-6, "max": 1.0},
        ],
    });
    let all = server.post("/v1/model-selection", &body).await.expect_ok();
    let found = numbers(&all["kernel"]["length_scales"]);
    assert!(found[0] < 1.0 && found[2] > 5.0, "{found:?}");
    assert_eq!(all["score_gradient"].as_array().unwrap().len(), 3);
    // The selected kernel is accepted by other routes, and its likelihood is the score.
    let mut posterior = body.clone();
    posterior.as_object_mut().unwrap().remove("vary");
    posterior["kernel"] = all["kernel"].clone();
    posterior["alpha"] = all["alpha"].clone();
    posterior["include"] = json!(["log_marginal_likelihood"]);
    let likelihood =
        server.post("/v1/posterior", &posterior).await.expect_ok()["log_marginal_likelihood"].as_f64();
    let score = all["score"].as_f64().unwrap();
    assert!((likelihood.unwrap() - score).abs() < 1e-8 * score.abs());
    // The search axis by axis is the same, with a slope for each.
    body["vary"] = json!([
        {"parameter": "length_scales", "axis": 0, "min": 0.05, "max": 50.0},
        {"parameter": "length_scales", "axis": 1, "min": 0.05, "max": 50.0},
        {"parameter": "length_scales", "axis": 2, "min": 0.05, "max": 50.0},
        {"parameter": "variance", "min": 0.01, "max": 100.0},
        {"parameter": "alpha", "min": 1e-6, "max": 1.0},
    ]);
    let each = server.post("/v1/model-selection", &body).await.expect_ok();
    assert!((each["score"].as_f64().unwrap() - score).abs() < 1e-6 * score.abs());
    assert_eq!(each["score_gradient"].as_array().unwrap().len(), 5);
    // Without `vary`, the parameters of the starting kernel are searched.
    body.as_object_mut().unwrap().remove("vary");
    body["kernel"] = all["kernel"].clone();
    let on = server.post("/v1/model-selection", &body).await.expect_ok();
    assert!(on["score"].as_f64().unwrap() >= score - 1e-6 * score.abs());
    assert_eq!(on["score_gradient"].as_array().unwrap().len(), 5);
    for (entry, pointer) in [
        (json!({"parameter": "variance", "axis": 0, "min": 1, "max": 2}), "/vary/0/axis"),
        (json!({"parameter": "length_scales", "axis": 3, "min": 1, "max": 2}), "/vary/0/axis"),
        (json!({"parameter": "length_scale", "min": 1, "max": 2}), "/vary/0"),
    ] {
        body["vary"] = json!([entry]);
        let problem = server.post("/v1/model-selection", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
}
