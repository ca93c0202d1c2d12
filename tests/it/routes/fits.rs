//! Fits from few parameters: defaults, a surface other than that of the values, merged duplicates.

use serde_json::{Value, json};

use crate::all_routes::{N_POINTS, ROUTES};
use crate::support::{Server, fibonacci_sphere, numbers};

/// Returns the product of a matrix and the values.
fn times(matrix: &Value, values: &[f64]) -> Vec<f64> {
    let product = |row: &Value| numbers(row).iter().zip(values).map(|(a, b)| a * b).sum();
    matrix.as_array().unwrap().iter().map(product).collect()
}

fn assert_close(found: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= relative * scale, "{a:e} against {b:e} at scale {scale:e}");
    }
}

#[tokio::test]
async fn defaults_are_said_in_the_answer_and_pinning_them_repeats_it() {
    let server = Server::start().await;
    for route in &ROUTES {
        for kernel in
            [json!("absent"), json!({"family": "matern"}), json!({"family": "gauss", "length_scale": 0.7})]
        {
            let mut body = route.with("/kernel", &kernel);
            if kernel == "absent" {
                body.as_object_mut().unwrap().remove("kernel");
            }
            body.as_object_mut().unwrap().remove("alpha");
            body["cloud"] = json!({"points": fibonacci_sphere(60)});
            if route.has_values {
                body["values"] = json!((0..60).map(|i| f64::from(i).sin()).collect::<Vec<_>>());
            }
            let chosen = server.post(route.path, &body).await.expect_ok();
            let diagnostics = &chosen["diagnostics"];
            if kernel == "absent" && route.has_values {
                // Learned from the values: tests/it/routes/learned.rs.
                assert_eq!(
                    diagnostics["mean_coefficients"].as_array().map(Vec::len),
                    Some(1),
                    "{}",
                    route.path
                );
                continue;
            }
            let is_value = !route.is_geometry() || route.has_geometry;
            let family = match kernel.get("family") {
                Some(family) => family.clone(),
                None => json!(if is_value { "matern" } else { "laplace" }),
            };
            assert_eq!(diagnostics["kernel"]["family"], family, "{}", route.path);
            assert!(diagnostics["kernel"]["length_scale"].as_f64().unwrap() > 0.0);
            assert_eq!(diagnostics["kernel"]["variance"], 1.0);
            if kernel != "absent" || is_value {
                assert_eq!(diagnostics["alpha"], 1e-10, "{}", route.path);
            }
            body["kernel"] = diagnostics["kernel"].clone();
            body["alpha"] = diagnostics["alpha"].clone();
            if route.has_geometry {
                let geometry = &diagnostics["surface"];
                body["surface"] = json!({"kernel": geometry["kernel"], "alpha": geometry["alpha"]});
            }
            let pinned = server.post(route.path, &body).await;
            assert_eq!(pinned.header("cache-status"), "gramian; hit", "{}", route.path);
            assert_eq!(pinned.expect_ok(), chosen, "{}", route.path);
        }
    }
}

#[tokio::test]
async fn the_surface_may_come_from_another_cloud_and_kernel_than_the_values() {
    let server = Server::start().await;
    let nodes = fibonacci_sphere(150);
    let values: Vec<f64> = nodes.iter().map(|x| x[2]).collect();
    // The same sphere with other samples: turned about the first axis.
    let turned: Vec<_> = fibonacci_sphere(200)
        .iter()
        .map(|x| [x[0], 0.6 * x[1] - 0.8 * x[2], 0.8 * x[1] + 0.6 * x[2]])
        .collect();
    let surface = server.post("/v1/clouds", &json!({"points": turned})).await.json()["cloud_id"].clone();
    let mut body = json!({
        "cloud": {"points": nodes},
        "kernel": {"family": "gauss", "length_scale": 1.0},
        "alpha": 1e-12,
        "values": values,
        "surface": {
            "cloud": {"id": surface},
            "kernel": {"family": "matern", "nu": 4.5, "length_scale": 1.0},
            "alpha": 1e-10,
        },
    });
    let applied = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    assert_eq!(applied["diagnostics"]["surface"]["cloud_id"], surface);
    assert_eq!(applied["diagnostics"]["surface"]["kernel"]["family"], "matern");
    assert_eq!(applied["diagnostics"]["kernel"]["family"], "gauss");
    assert_eq!(applied["diagnostics"]["n_points"], 150);
    // On the unit sphere Δz = −2z. Without queries, the answer is at the points of the surface's cloud.
    let expected: Vec<f64> = turned.iter().map(|x| -2.0 * x[2]).collect();
    assert_close(&numbers(&applied["laplacians"]), &expected, 1e-3);
    let gradients = server.post("/v1/surface-gradient", &body).await.expect_ok()["gradients"].clone();
    // The surface gradient of z is e₃ − z x.
    let tangent = |x: &[f64; 3]| [-x[2] * x[0], -x[2] * x[1], 1.0 - x[2] * x[2]];
    assert_close(&numbers(&gradients), &turned.iter().flat_map(tangent).collect::<Vec<_>>(), 1e-3);

    body.as_object_mut().unwrap().remove("values");
    let matrix = server.post("/v1/laplace-beltrami/matrix", &body).await.expect_ok()["matrix"].clone();
    assert_eq!((matrix.as_array().unwrap().len(), matrix[0].as_array().unwrap().len()), (200, 150));
    // Rounding is relative to the entries of the matrix, which are much larger than their sums.
    let largest = numbers(&matrix).iter().fold(0.0f64, |a, b| a.max(b.abs()));
    assert_close(&times(&matrix, &values), &numbers(&applied["laplacians"]), 1e-10 * largest.max(10.0));
    let matrices = server.post("/v1/surface-gradient/matrix", &body).await.expect_ok()["matrices"].clone();
    for (axis, matrix) in matrices.as_array().unwrap().iter().enumerate() {
        let expected: Vec<f64> = numbers(&gradients).iter().skip(axis).step_by(3).copied().collect();
        assert_close(&times(matrix, &values), &expected, 1e-10 * largest.max(10.0));
    }
}

#[tokio::test]
async fn noise_of_the_values_cloud_is_not_taken_over_to_another_one() {
    let server = Server::start().await;
    for route in ROUTES.iter().filter(|route| route.has_geometry) {
        for n_surface in [N_POINTS, N_POINTS + 1] {
            let mut body = route.with("/noise_variances", &json!(vec![1e-6; N_POINTS]));
            body.as_object_mut().unwrap().remove("alpha");
            let points: Vec<_> = fibonacci_sphere(n_surface).iter().map(|x| [x[1], x[2], x[0]]).collect();
            body["surface"] = json!({"cloud": {"points": points}});
            let problem = server.post(route.path, &body).await.expect_problem(422, "invalid-request");
            assert_eq!(problem["errors"][0]["pointer"], "/surface", "{problem}");
            body["surface"]["alpha"] = json!(1e-6);
            let answer = server.post(route.path, &body).await.expect_ok();
            assert!(answer["diagnostics"].get("alpha").is_none());
            assert_eq!(answer["diagnostics"]["surface"]["alpha"], 1e-6);
        }
    }
}

#[tokio::test]
async fn merged_duplicates_keep_their_columns_and_share_the_weight() {
    let server = Server::start().await;
    let mut points = fibonacci_sphere(40);
    points.extend([points[3], points[9], points[3]]);
    let values: Vec<f64> = (0..points.len()).map(|i| (i as f64).cos()).collect();
    let mut body = json!({
        "cloud": {"points": points},
        "kernel": {"family": "matern", "length_scale": 1.0},
        "alpha": 0,
        "duplicates": "merge",
        "values": values,
    });
    let interpolated = server.post("/v1/interpolation", &body).await.expect_ok();
    let found = numbers(&interpolated["values"]);
    let mean = (values[3] + values[40] + values[42]) / 3.0;
    assert_close(&[found[3], found[40], found[42]], &[mean; 3], 1e-9);
    assert_close(&[found[9], found[41]], &[(values[9] + values[41]) / 2.0; 2], 1e-9);
    assert_close(&found[10..40], &values[10..40], 1e-9);
    let diagnostics = &interpolated["diagnostics"];
    assert_eq!((&diagnostics["n_points"], &diagnostics["n_merged_duplicates"]), (&json!(43), &json!(3)));
    assert_eq!(diagnostics["warnings"][0]["code"], "duplicates_merged");

    let applied = server.post("/v1/laplace-beltrami", &body).await.expect_ok();
    let gradients = server.post("/v1/surface-gradient", &body).await.expect_ok();
    body.as_object_mut().unwrap().remove("values");
    let matrix = server.post("/v1/laplace-beltrami/matrix", &body).await.expect_ok()["matrix"].clone();
    for row in matrix.as_array().unwrap() {
        assert_eq!(row.as_array().unwrap().len(), 43);
        assert!(row[3] == row[40] && row[3] == row[42] && row[9] == row[41]);
    }
    assert_close(&times(&matrix, &values), &numbers(&applied["laplacians"]), 1e-9);
    let matrices = server.post("/v1/surface-gradient/matrix", &body).await.expect_ok()["matrices"].clone();
    for (axis, matrix) in matrices.as_array().unwrap().iter().enumerate() {
        let expected: Vec<f64> =
            numbers(&gradients["gradients"]).iter().skip(axis).step_by(3).copied().collect();
        assert_close(&times(matrix, &values), &expected, 1e-9);
    }
    for path in ["/v1/normals", "/v1/curvatures"] {
        let answer = server.post(path, &body).await.expect_ok();
        assert_eq!(answer["normals"].as_array().unwrap().len(), 43);
        assert_eq!(answer["normals"][3], answer["normals"][40]);
    }
}
