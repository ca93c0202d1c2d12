//! Local regressions over HTTP: surfaces, deviations, sparse operators, and refusals.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers};

/// Checks that each mean curvature is 1 within `tolerance`, with a deviation between 0 and 0.1.
fn check_unit_curvatures(answer: &Value, tolerance: f64) {
    let (found, deviations) = (numbers(&answer["mean_curvatures"]), numbers(&answer["mean_curvature_std"]));
    assert_eq!(found.len(), deviations.len());
    for (curvature, deviation) in found.iter().zip(&deviations) {
        assert!((curvature - 1.0).abs() <= tolerance, "{curvature}");
        assert!(*deviation > 0.0 && *deviation < 0.1, "{deviation}");
    }
}

#[tokio::test]
async fn deviations_are_asked_for_by_name() {
    let server = Server::start().await;
    let points = fibonacci_sphere(500);
    let body = json!({"cloud": {"points": points}, "include": ["std"]});
    let answer = server.post("/v1/curvatures", &body).await.expect_ok();
    // The spacing is 0.16. Quadrics alone would be off by one per cent.
    check_unit_curvatures(&answer, 1e-2);
    assert_eq!(numbers(&answer["principal_curvature_std"]).len(), 1000);
    assert_eq!(numbers(&answer["gaussian_curvature_std"]).len(), 500);
    assert_eq!(answer["diagnostics"]["solver"], "local");
    assert_eq!(answer["surface_models"][0], "regression");
    assert!(answer["diagnostics"]["solver_reason"].as_str().unwrap().contains("deviations"));
    assert!(answer["diagnostics"].get("rank").is_none());
    let without = server.post("/v1/curvatures", &json!({"cloud": {"points": points}})).await.expect_ok();
    assert!(without.get("mean_curvature_std").is_none());
    assert_eq!(without["diagnostics"]["solver"], "dense");
}

#[tokio::test]
async fn a_signature_function_has_deviations_too() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": fibonacci_sphere(400)}, "include": ["std"],
        "kernel": {"family": "laplace", "length_scale": 1.0, "epsilon": 1.0}, "alpha": 0.0});
    for path in ["/v1/normals", "/v1/curvatures"] {
        let answer = server.post(path, &body).await.expect_ok();
        assert_eq!(answer["diagnostics"]["solver"], "dense");
        assert!(numbers(&answer["normal_std"]).iter().all(|deviation| *deviation < 0.05));
    }
}

#[tokio::test]
async fn local_normals_point_outward_also_away_from_the_points() {
    let server = Server::start().await;
    let queries = [[0.0, 0.0, 1.01], [0.6, 0.8, 0.0], [0.0, -0.99, 0.0], [9.0, 0.0, 0.0]];
    let body = json!({"cloud": {"points": fibonacci_sphere(400)}, "surface_model": "regression", "queries": queries});
    let answer = server.post("/v1/normals", &body).await.expect_ok();
    for (query, normal) in queries.iter().zip(answer["normals"].as_array().unwrap()).take(3) {
        let cosine: f64 = query.iter().zip(numbers(normal)).map(|(a, b)| a * b).sum();
        assert!(cosine > 0.985, "{normal}");
    }
    assert_eq!(answer["flags"][0]["reason"], "far_from_cloud");
    // The level is 1 minus the height above the surface.
    let levels = numbers(&answer["levels"]);
    assert!((levels[0] - 0.99).abs() < 1e-3 && (levels[2] - 1.01).abs() < 1e-3, "{levels:?}");
    let inward = json!({"orientation": "gradient"});
    let body = json!({"cloud": body["cloud"], "surface_model": "regression", "queries": queries, "orientation": inward["orientation"]});
    let turned = server.post("/v1/normals", &body).await.expect_ok();
    assert!((numbers(&turned["normals"])[2] + numbers(&answer["normals"])[2]).abs() < 1e-12);
}

#[tokio::test]
async fn beyond_the_dense_limit_auto_regresses_locally() {
    let server = Server::with_flags(&["--max-dense-points", "300"]).await;
    let points = fibonacci_sphere(400);
    let answer = server.post("/v1/curvatures", &json!({"cloud": {"points": points}})).await.expect_ok();
    assert_eq!(answer["diagnostics"]["solver"], "local");
    assert!(answer["diagnostics"]["solver_reason"].as_str().unwrap().contains("more points"));
    let values: Vec<f64> = points.iter().map(|x| x[2]).collect();
    let body = json!({"cloud": {"points": points}, "values": values});
    // Δz = −2z on the sphere.
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    for (found, z) in numbers(&answer["laplacians"]).iter().zip(&values) {
        assert!((found + 2.0 * z).abs() < 2e-2, "{found} at {z}");
    }
    let answer = server.post("/v1/surface-gradient", &body).await.expect_ok();
    for (gradient, x) in answer["gradients"].as_array().unwrap().iter().zip(&points) {
        let exact = [-x[2] * x[0], -x[2] * x[1], 1.0 - x[2] * x[2]];
        assert!(
            numbers(gradient).iter().zip(exact).all(|(a, b)| (a - b).abs() < 5e-3),
            "{gradient} at {x:?}"
        );
    }
}

#[tokio::test]
async fn sparse_matrices_agree_with_the_operators() {
    let server = Server::start().await;
    let points = fibonacci_sphere(600);
    let body = json!({"cloud": {"points": points}, "solver": "local"});
    let matrix = server.post("/v1/laplace-beltrami/sparse-matrix", &body).await.expect_ok();
    assert_eq!(numbers(&matrix["shape"]), [600.0, 600.0]);
    assert_eq!(matrix["diagnostics"]["stencils"]["nearest"], 600);
    let [indptr, indices, data] = ["indptr", "indices", "data"].map(|name| numbers(&matrix[name]));
    assert_eq!((indptr.len(), indptr[600] as usize, data.len()), (601, indices.len(), indices.len()));
    let values: Vec<f64> = points.iter().map(|x| (PI * x[2]).sin()).collect();
    let request = json!({
        "cloud": {"points": points}, "solver": "local", "values": values, "include": ["std"],
    });
    let applied = server.post("/v1/laplace-beltrami", &request).await.expect_ok();
    let deviations = numbers(&applied["laplacian_std"]);
    let applied = numbers(&applied["laplacians"]);
    // The operator reaches π² + 2π. With 600 points the deviations are below 1 % of that.
    let scale = PI * PI + 2.0 * PI;
    assert!(deviations.iter().all(|deviation| *deviation < 0.01 * scale), "{deviations:?}");
    for (row, expected) in applied.iter().enumerate() {
        let range = indptr[row] as usize..indptr[row + 1] as usize;
        let columns = &indices[range.clone()];
        assert!(columns.windows(2).all(|pair| pair[0] < pair[1]));
        let found: f64 =
            data[range].iter().zip(columns).map(|(w, &column)| w * values[column as usize]).sum();
        assert!((found - expected).abs() < 0.03 * scale, "{found} and {expected}");
    }
    let gradient = server.post("/v1/surface-gradient/sparse-matrix", &body).await.expect_ok();
    assert_eq!(numbers(&gradient["shape"]), [3.0, 600.0, 600.0]);
    assert_eq!(gradient["data"].as_array().unwrap().len(), 3);
}

#[tokio::test]
async fn too_few_points_for_an_operator_are_said_to_be() {
    let server = Server::start().await;
    for n in [10, 16] {
        let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
        let points: Vec<[f64; 2]> = (0..n).map(|i| [angle(i).cos(), angle(i).sin()]).collect();
        let body = json!({"cloud": {"points": points}, "solver": "local"});
        let matrix = server.post("/v1/laplace-beltrami/sparse-matrix", &body).await.expect_ok();
        assert!(numbers(&matrix["indptr"]).windows(2).all(|ends| ends[0] < ends[1]), "no row is empty");
        let values: Vec<f64> = points.iter().map(|x| x[0]).collect();
        let request = json!({"cloud": {"points": points}, "solver": "local", "values": values});
        let applied = server.post("/v1/laplace-beltrami", &request).await.expect_ok();
        assert!(applied["laplacians"].as_array().unwrap().iter().all(|value| value.is_number()));
        let slopes = server.post("/v1/surface-gradient", &request).await.expect_ok();
        let rows = slopes["gradients"].as_array().unwrap();
        assert!(rows.len() == n && rows.iter().all(|row| row.is_array()));
        let gradient = server.post("/v1/surface-gradient/sparse-matrix", &body).await.expect_ok();
        assert_eq!(gradient["data"].as_array().unwrap().len(), 2);
        for answer in [matrix, applied] {
            let flags = answer["flags"].as_array().unwrap();
            assert!(flags.len() == n && flags.iter().all(|flag| flag["reason"] == "under_resolved"));
        }
    }
}

#[tokio::test]
async fn what_local_regressions_lack_is_refused_by_name() {
    let server = Server::start().await;
    let points = fibonacci_sphere(60);
    let values = vec![0.0; 60];
    let cloud = json!({"points": points});
    let kernel = json!({"family": "gauss", "length_scale": 1.0});
    let cases = [
        ("/v1/curvatures", json!({"cloud": cloud, "surface_model": "regression", "alpha": 0.1}), "/alpha"),
        ("/v1/normals", json!({"cloud": cloud, "solver": "local", "kernel": kernel}), "/kernel"),
        ("/v1/laplace-beltrami/matrix", json!({"cloud": cloud, "solver": "local"}), "/solver"),
        ("/v1/surface-gradient/matrix", json!({"cloud": cloud, "solver": "local"}), "/solver"),
        (
            "/v1/curvatures",
            json!({"cloud": {"points": vec![[0.0; 5], [1.0; 5]]}, "surface_model": "regression"}),
            "/surface_model",
        ),
    ];
    for (path, body, pointer) in cases {
        let problem = server.post(path, &body).await.expect_problem(422, "unsupported-by-solver");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{path}");
    }
    let cases = [
        (json!({"cloud": cloud, "sites": points[..2]}), "unsupported-by-solver"),
        (json!({"cloud": cloud, "solver": "local", "sites": [[0.0, 1.0]]}), "dimension-mismatch"),
    ];
    for (body, slug) in cases {
        let problem = server.post("/v1/normals", &body).await.expect_problem(422, slug);
        assert_eq!(problem["errors"][0]["pointer"], "/sites", "{slug}");
    }
    // Clients that are generated send lists that are absent as empty ones.
    server.post("/v1/normals", &json!({"cloud": cloud, "sites": []})).await.expect_ok();
    let sites = [points[3], points[3], [1e3, 0.0, 0.0]];
    let body = json!({"cloud": cloud, "solver": "local", "sites": sites});
    let problem = server.post("/v1/normals", &body).await.expect_problem(422, "invalid-request");
    assert_eq!(problem["errors"][0]["pointer"], "/sites/2");
    let body = json!({"cloud": cloud, "values": values, "solver": "local"});
    assert_eq!(
        numbers(&server.post("/v1/laplace-beltrami", &body).await.expect_ok()["laplacians"]).len(),
        60
    );
}

#[tokio::test]
async fn surfaces_are_learned_where_it_is_said() {
    let server = Server::start().await;
    // A smooth sphere, and a rough one beside it.
    let mut random = Random(4);
    let rough = fibonacci_sphere(1000).into_iter().map(|x| x.map(|c| c * (1.0 + 0.02 * random.normal())));
    let rough: Vec<_> = rough.map(|[x, y, z]| [x + 4.0, y, z]).collect();
    let points: Vec<_> = fibonacci_sphere(1000).into_iter().chain(rough).collect();
    let mut noise = Vec::new();
    for sites in [&points[..90], &points[1000..1090], &points[..90]] {
        let body = json!({"cloud": {"points": points}, "solver": "local", "sites": sites});
        let answer = server.post("/v1/normals", &body).await.expect_ok();
        noise.push(answer["diagnostics"]["noise_deviation"].as_f64().unwrap());
    }
    assert!(noise[0] < 1e-3 && noise[1] > 1e-2 && noise[2] == noise[0], "{noise:?}");
}

#[tokio::test]
async fn eight_equal_requests_make_one_surface() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": fibonacci_sphere(2000)}, "surface_model": "regression", "include": ["std"]});
    let asked = (0..8).map(|_| server.post("/v1/curvatures", &body));
    let answers: Vec<Value> =
        futures_util::future::join_all(asked).await.into_iter().map(|answer| answer.expect_ok()).collect();
    let first = numbers(&answers[0]["mean_curvatures"]);
    assert!(answers.iter().all(|answer| numbers(&answer["mean_curvatures"]) == first));
}

#[tokio::test]
async fn operators_of_noisy_values_have_bars_that_hold_whatever_the_solver() {
    let server = Server::start().await;
    let (points, mut random) = (fibonacci_sphere(2000), Random(7));
    // Δz = −2z, with noise of 2 % of the field.
    let values: Vec<f64> = points.iter().map(|x| x[2] + 0.012 * random.normal()).collect();
    let body = json!({
        "cloud": {"points": points}, "values": values, "solver": "local", "include": ["std"],
    });
    let answer = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    assert_eq!(answer["diagnostics"]["solver"], "local");
    let (found, bars) = (numbers(&answer["laplacians"]), numbers(&answer["laplacian_std"]));
    let off = |i: usize| (found[i] + 2.0 * points[i][2]).abs();
    let n_within = (0..2000).filter(|&i| off(i) <= 1.96 * bars[i]).count();
    assert!(n_within >= 1760, "{n_within} of 2000 within their bars");
    // Stencils differentiate the noise, so they would be off by some hundred.
    assert!((0..2000).all(|i| off(i) < 0.5));
}

#[tokio::test]
async fn values_far_from_their_nodes_are_flagged_however_near_the_surface_is() {
    let server = Server::start().await;
    // The nodes are on the upper half of a sphere that is sampled all over.
    let nodes: Vec<_> = fibonacci_sphere(400).into_iter().filter(|x| x[2] > 0.0).collect();
    let values: Vec<f64> = nodes.iter().map(|x| x[2]).collect();
    let queries = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let body = json!({
        "cloud": {"points": nodes}, "values": values, "queries": queries,
        "surface": {"cloud": {"points": fibonacci_sphere(600)}},
    });
    for path in ["/v1/laplace-beltrami", "/v1/surface-gradient"] {
        let answer = server.post(path, &body).await.expect_ok();
        let flags = answer["flags"].as_array().unwrap();
        let is_far = |flag: &&Value| flag["reason"] == "far_from_cloud" && flag["query"] == 1;
        assert_eq!(flags.iter().filter(is_far).count(), 1, "{path}: {flags:?}");
        assert!(flags.iter().all(|flag| flag["query"] == 1), "{path}: {flags:?}");
    }
}

#[tokio::test]
async fn neighbourhoods_that_are_too_small_are_said_to_be() {
    let server = Server::start().await;
    let points: Vec<_> = (0..2000).map(|i| [f64::from(i % 50) / 25.0, f64::from(i / 50) / 20.0]).collect();
    let warned = async |alpha: f64, length_scale: f64| {
        let mut random = Random(3);
        let values: Vec<f64> = points.iter().map(|x| x[0].sin() + alpha.sqrt() * random.normal()).collect();
        let body = json!({
            "cloud": {"points": points}, "values": values, "queries": [[0.51, 0.52], [1.43, 1.01]], "solver": "local",
            "kernel": {"family": "matern", "nu": 2.5, "length_scale": length_scale}, "alpha": alpha,
        });
        let answer = server.post("/v1/posterior", &body).await.expect_ok();
        let warnings = answer["diagnostics"]["warnings"].as_array().unwrap().clone();
        warnings.iter().any(|warning| warning["code"] == "neighbours_not_enough")
    };
    // With noise this large, points beyond the nearest 128 still count. With little noise, the nearest screen
    // all others.
    for (alpha, length_scale, expected) in [(1.0, 1.0, true), (1e-4, 0.1, false)] {
        assert_eq!(warned(alpha, length_scale).await, expected, "{alpha} {length_scale}");
    }
}
