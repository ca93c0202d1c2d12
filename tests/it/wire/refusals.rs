//! Well-formed requests whose parts do not fit together: points, lengths, dimensions, cloud ids.

use serde_json::json;

use crate::all_routes::{N_POINTS, ROUTES, lattice, route_of};
use crate::support::{Server, fibonacci_sphere};

#[tokio::test]
async fn points_that_are_no_cloud_are_refused_on_every_route() {
    let server = Server::start().await;
    for route in &ROUTES {
        for (pointer, value, expected) in [
            ("/cloud/points", json!([]), "/cloud/points"),
            ("/cloud/points", json!([[], []]), "/cloud/points"),
            ("/cloud/points/5", json!([1.0, 2.0]), "/cloud/points/5"),
            ("/cloud/points/5", json!([]), "/cloud/points/5"),
            ("/cloud/points/19", json!([1, 2, 3, 4]), "/cloud/points/19"),
        ] {
            route.refuses(&server, &route.with(pointer, &value), 422, "invalid-cloud", expected).await;
        }
    }
}

#[tokio::test]
async fn one_point_has_values_and_a_degenerate_geometry() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut request = route.with("/cloud/points", &json!([[0.25, 0.5, 0.75]]));
        if route.has_values {
            request["values"] = json!([3.0]);
        }
        for is_pinned in [true, false] {
            if !is_pinned {
                request.as_object_mut().unwrap().retain(|name, _| name == "cloud" || name == "values");
            }
            let answer = server.post(route.path, &request).await.expect_ok();
            if route.is_geometry() {
                // The signature function has its maximum at the point, so there is no normal.
                assert_eq!(answer["flags"][0]["query"], 0, "{}", route.path);
                assert_eq!(answer["flags"][0]["reason"], "vanishing_gradient");
            } else {
                let name = if route.path == "/v1/posterior" { "means" } else { "values" };
                assert!((answer[name][0].as_f64().unwrap() - 3.0).abs() < 1e-6, "{answer}");
            }
        }
    }
}

#[tokio::test]
async fn dimension_one_has_values_but_no_geometry() {
    let server = Server::start().await;
    for route in &ROUTES {
        let request = route.with("/cloud/points", &json!(lattice(N_POINTS, 1)));
        if route.is_geometry() {
            route.refuses(&server, &request, 422, "invalid-cloud", "/cloud/points").await;
        } else {
            server.post(route.path, &request).await.expect_ok();
        }
    }
}

#[tokio::test]
async fn entries_that_are_not_one_per_point_are_refused() {
    let server = Server::start().await;
    for route in &ROUTES {
        for length in [0, 1, N_POINTS - 1, N_POINTS + 1] {
            if route.has_values {
                let body = route.with("/values", &json!(vec![1.0; length]));
                route.refuses(&server, &body, 422, "length-mismatch", "/values").await;
            }
            // Empty lists of optional members count as absent.
            if length == 0 {
                continue;
            }
            let mut body = route.with("/noise_variances", &json!(vec![1e-3; length]));
            body.as_object_mut().unwrap().remove("alpha");
            route.refuses(&server, &body, 422, "length-mismatch", "/noise_variances").await;
            let normals = json!({"points": fibonacci_sphere(N_POINTS), "normals": fibonacci_sphere(length)});
            let body = route.with("/cloud", &normals);
            route.refuses(&server, &body, 422, "length-mismatch", "/cloud/normals").await;
        }
    }
}

#[tokio::test]
async fn empty_normals_and_variances_count_as_absent() {
    let server = Server::start().await;
    let points = fibonacci_sphere(N_POINTS);
    let registered = server.post("/v1/clouds", &json!({"points": points, "normals": []})).await;
    assert_eq!(registered.status, 201, "{}", registered.text);
    let id = registered.json()["cloud_id"].clone();
    let known = server.post("/v1/clouds", &json!({"points": points})).await.expect_ok();
    assert_eq!(known["cloud_id"], id);
    for route in &ROUTES {
        let plain = server.post(route.path, &route.request()).await.expect_ok();
        let mut request = route.with("/cloud/normals", &json!([]));
        request["noise_variances"] = json!([]);
        if route.has_geometry {
            request["surface"] = json!({"noise_variances": [], "cloud": {"id": id, "normals": []}});
        }
        assert_eq!(server.post(route.path, &request).await.expect_ok(), plain, "{}", route.path);
        // Rows without coordinates are not an empty list.
        let body = route.with("/cloud/normals", &json!([[], []]));
        route.refuses(&server, &body, 422, "invalid-cloud", "/cloud/normals").await;
    }
}

#[tokio::test]
async fn who_sends_columns_is_told_that_rows_are_points() {
    let server = Server::start().await;
    let transposed: Vec<Vec<f64>> =
        (0..3).map(|k| fibonacci_sphere(N_POINTS).iter().map(|point| point[k]).collect()).collect();
    let detail = "rows are points: 3 rows of 20 coordinates; transpose the array";
    for route in &ROUTES {
        for (pointer, slug, status) in [
            ("/cloud/points", "problem-too-large", 413),
            ("/cloud/normals", "problem-too-large", 413),
            ("/queries", "problem-too-large", 413),
        ] {
            let body = route.with(pointer, &json!(transposed));
            let problem = route.refuses(&server, &body, status, slug, pointer).await;
            assert!(problem["detail"].as_str().unwrap().ends_with(detail), "{problem}");
        }
        let few: Vec<&[f64]> = transposed.iter().map(|row| &row[..7]).collect();
        let body = route.with("/queries", &json!(few));
        let problem = route.refuses(&server, &body, 422, "dimension-mismatch", "/queries").await;
        let expected = "rows are points: 3 rows of 7 coordinates; transpose the array";
        assert!(problem["detail"].as_str().unwrap().ends_with(expected), "{problem}");
        let cloud = json!({"points": fibonacci_sphere(7), "normals": few});
        let body = route.with("/cloud", &cloud);
        let problem = route.refuses(&server, &body, 422, "dimension-mismatch", "/cloud/normals").await;
        assert!(problem["detail"].as_str().unwrap().ends_with(expected), "{problem}");
        if route.has_values {
            let mut body = route.with("/cloud/points", &json!(few));
            body["values"] = json!(vec![1.0; 7]);
            let problem = route.refuses(&server, &body, 422, "length-mismatch", "/values").await;
            assert!(problem["detail"].as_str().unwrap().ends_with(expected), "{problem}");
        }
    }
}

#[tokio::test]
async fn noise_is_said_once_and_is_not_negative() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut body = route.with("/noise_variances", &json!(vec![1e-3; N_POINTS]));
        route.refuses(&server, &body, 422, "invalid-request", "/noise_variances").await;
        body.as_object_mut().unwrap().remove("alpha");
        server.post(route.path, &body).await.expect_ok();
        body["noise_variances"][3] = json!(-1e-3);
        route.refuses(&server, &body, 422, "invalid-request", "/noise_variances/3").await;
    }
    let posterior = route_of("/v1/posterior");
    let mut body = posterior.with("/noise_variances", &json!(vec![1e-3; N_POINTS]));
    body.as_object_mut().unwrap().remove("alpha");
    body["include"] = json!(["variances"]);
    server.post(posterior.path, &body).await.expect_ok();
    body["include"] = json!(["variances", "observation_variances"]);
    posterior.refuses(&server, &body, 422, "invalid-request", "/include").await;
    body["include"] = json!(["variances", "frobnicate"]);
    posterior.refuses(&server, &body, 422, "invalid-request", "/include/1").await;
}

#[tokio::test]
async fn queries_have_the_dimension_of_the_cloud() {
    let server = Server::start().await;
    for route in &ROUTES {
        for d in [1, 2, 4] {
            let body = route.with("/queries", &json!(lattice(3, d)));
            route.refuses(&server, &body, 422, "dimension-mismatch", "/queries").await;
        }
        let ragged = route.with("/queries", &json!([[0, 0, 2], [0, 0], [0, 2, 0]]));
        route.refuses(&server, &ragged, 422, "invalid-request", "/queries/1").await;
        let null = route.with("/queries", &json!([[0, 0, 2], [0, 0, null]]));
        route.refuses(&server, &null, 422, "invalid-request", "/queries/1/2").await;
        if route.has_geometry {
            let body = route.with("/surface", &json!({"cloud": {"points": lattice(9, 2)}}));
            route.refuses(&server, &body, 422, "dimension-mismatch", "/surface/cloud").await;
        }
    }
}

#[tokio::test]
async fn a_cloud_is_named_or_given_but_not_both() {
    let server = Server::start().await;
    let unknown = "0".repeat(64);
    for route in &ROUTES {
        let points = fibonacci_sphere(N_POINTS);
        let both = json!({"id": unknown, "points": points});
        route.refuses(&server, &route.with("/cloud", &both), 422, "invalid-request", "/cloud").await;
        route.refuses(&server, &route.with("/cloud", &json!({})), 422, "invalid-request", "/cloud").await;
        let normals = json!({"id": unknown, "normals": points});
        let body = route.with("/cloud", &normals);
        route.refuses(&server, &body, 422, "invalid-request", "/cloud/normals").await;
        for id in [unknown.as_str(), "", "zz", &"A".repeat(64), &"0".repeat(100_000)] {
            let body = route.with("/cloud", &json!({"id": id}));
            let problem = route.refuses(&server, &body, 404, "unknown-cloud", "/cloud/id").await;
            assert!(problem["detail"].as_str().unwrap().len() < 300);
        }
        if route.has_geometry {
            let body = route.with("/surface", &json!({"cloud": {"id": unknown}}));
            route.refuses(&server, &body, 404, "unknown-cloud", "/surface/cloud/id").await;
        }
    }
}
