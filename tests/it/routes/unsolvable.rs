//! Consistent requests without an answer: coinciding points, kinks, matrices beyond float64.

use serde_json::{Value, json};

use crate::all_routes::{N_POINTS, ROUTES, lattice, route_of};
use crate::support::{Server, fibonacci_sphere, numbers};

#[tokio::test]
async fn wendland_kernels_end_at_dimension_three() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut body = route.with("/kernel", &json!({"family": "wendland", "length_scale": 2.0}));
        server.post(route.path, &body).await.expect_ok();
        body["cloud"]["points"] = json!(lattice(N_POINTS, 4));
        route.refuses(&server, &body, 422, "kernel-not-positive-definite", "/kernel/family").await;
        if route.has_geometry {
            body["surface"] = json!({"kernel": body["kernel"]});
            body["kernel"] = json!({"family": "matern", "length_scale": 1.0});
            let pointer = "/surface/kernel/family";
            route.refuses(&server, &body, 422, "kernel-not-positive-definite", pointer).await;
        }
    }
}

#[tokio::test]
async fn coinciding_points_are_listed_when_alpha_is_zero() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut body = route.with("/alpha", &json!(0));
        body["cloud"]["points"][17] = body["cloud"]["points"][4].clone();
        let problem = route.refuses(&server, &body, 422, "duplicate-points", "/cloud/points/4").await;
        assert_eq!(problem["point_indices"], json!([4, 17]));
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("alpha") && detail.contains("merge"), "{detail}");
        body["duplicates"] = json!("merge");
        let answer = server.post(route.path, &body).await.expect_ok();
        assert_eq!(answer["diagnostics"]["n_merged_duplicates"], 1);
        body["duplicates"] = json!("refuse");
        body["alpha"] = json!(1e-3);
        server.post(route.path, &body).await.expect_ok();
    }
}

#[tokio::test]
async fn coinciding_points_of_the_values_cloud_are_pointed_to_there_when_only_the_surface_has_alpha_zero() {
    let server = Server::start().await;
    for route in ROUTES.iter().filter(|route| route.has_geometry) {
        let mut body = route.with("/surface", &json!({"alpha": 0}));
        body["cloud"]["points"][17] = body["cloud"]["points"][4].clone();
        let problem = route.refuses(&server, &body, 422, "duplicate-points", "/cloud/points/4").await;
        assert_eq!(problem["point_indices"], json!([4, 17]));
    }
}

#[tokio::test]
async fn kernels_with_a_kink_have_no_derivatives_at_the_points() {
    let server = Server::start().await;
    for kernel in [json!({"family": "laplace"}), json!({"family": "matern", "nu": 0.5})] {
        for route in &ROUTES {
            let mut body = route.with("/kernel", &kernel);
            match route.path {
                "/v1/interpolation" => body["derivatives"] = json!(1),
                "/v1/posterior" => body["include"] = json!(["gradients"]),
                _ => {}
            }
            body["queries"] = json!([[0.1, 0.2, 0.3], body["cloud"]["points"][7]]);
            let problem = route.refuses(&server, &body, 422, "kernel-not-smooth", "/queries/1").await;
            assert!(problem["detail"].as_str().unwrap().contains("point 7"), "{problem}");
            body["queries"] = json!([[0.1, 0.2, 0.3]]);
            server.post(route.path, &body).await.expect_ok();
        }
    }
}

#[tokio::test]
async fn without_queries_the_kink_is_pointed_to_where_the_points_are() {
    let server = Server::start().await;
    for route in ROUTES.iter().filter(|route| route.is_geometry()) {
        let body = route.with("/kernel", &json!({"family": "laplace"}));
        route.refuses(&server, &body, 422, "kernel-not-smooth", "/cloud/points/0").await;
    }
}

#[tokio::test]
async fn what_is_not_positive_definite_names_an_alpha_that_works() {
    let server = Server::start().await;
    let posterior = route_of("/v1/posterior");
    for length_scale in [3.0, 30.0] {
        for variance in [1e-4, 1.0, 1e6] {
            let kernel = json!({"family": "gauss", "length_scale": length_scale, "variance": variance});
            let mut body = posterior.with("/kernel", &kernel);
            body["alpha"] = json!(0);
            body["cloud"] = json!({"points": fibonacci_sphere(200)});
            body["values"] = json!(vec![1.0; 200]);
            for include in ["variances", "covariance", "log_marginal_likelihood"] {
                body["include"] = json!([include]);
                let problem = posterior.refuses(&server, &body, 422, "not-positive-definite", "/alpha").await;
                let minimum_alpha = problem["minimum_alpha"].as_f64().unwrap();
                assert!(minimum_alpha > 0.0 && minimum_alpha < 1e-3 * variance, "{problem}");
                let mut remedied = body.clone();
                remedied["alpha"] = json!(minimum_alpha);
                let answer = server.post(posterior.path, &remedied).await.expect_ok();
                assert_eq!(answer["diagnostics"]["factorization"], "cholesky");
            }
        }
    }
}

#[tokio::test]
async fn extreme_numbers_are_answered_or_refused_but_are_no_internal_error() {
    let server = Server::start().await;
    for route in &ROUTES {
        for (pointer, value) in [
            ("/kernel/length_scale", json!(5e-324)),
            ("/kernel/length_scale", json!(1e-160)),
            ("/kernel/length_scale", json!(1e160)),
            ("/kernel/length_scale", json!(1.7e308)),
            ("/kernel/variance", json!(5e-324)),
            ("/kernel/variance", json!(1.7e308)),
            ("/alpha", json!(5e-324)),
            ("/alpha", json!(1.7e308)),
            ("/cloud/points/3", json!([1.7e308, -1.7e308, 1.7e308])),
            ("/cloud/points/3", json!([5e-324, 0.0, -0.0])),
            ("/queries", json!([[1.7e308, -1.7e308, 0.0]])),
            ("/queries", json!([[5e-324, 1e-160, 1e160]])),
            ("/values", json!(vec![1.7e308; N_POINTS])),
            ("/values", json!(vec![5e-324; N_POINTS])),
        ] {
            if pointer == "/values" && !route.has_values {
                continue;
            }
            let mut body = route.with(pointer, &value);
            let answer = server.post(route.path, &body).await;
            assert!([200, 422].contains(&answer.status), "{} {pointer} {value}: {}", route.path, answer.text);
            body.as_object_mut().unwrap().remove("kernel");
            let answer = server.post(route.path, &body).await;
            assert!([200, 422].contains(&answer.status), "{} {pointer} {value}: {}", route.path, answer.text);
            let good = server.post(route.path, &route.request()).await.expect_ok();
            assert!(good["diagnostics"]["misfit"].is_number());
        }
    }
}

/// Sends values of every magnitude up to the end of float64, alone and in batches. If an answer has no
/// number, the request must be refused with its remedy.
#[tokio::test]
async fn what_has_no_number_is_refused_and_is_never_null() {
    let server = Server::start().await;
    let points = fibonacci_sphere(N_POINTS);
    let values = |size: f64| (0..N_POINTS).map(|i| size * (i as f64).sin()).collect::<Vec<_>>();
    let likelihood = json!(["variances", "log_marginal_likelihood"]);
    let (mut n_refused, mut n_answered) = (0, 0);
    for size in [1.0, 1e100, 1e150, 1e155, 1e160, 1e200, 1e300] {
        for (path, extra) in [
            ("/v1/interpolation", json!({"derivatives": 2, "include": ["std"]})),
            ("/v1/interpolation/batch", json!({"derivatives": 2, "include": ["std"]})),
            ("/v1/posterior", json!({"include": likelihood, "mean": "linear", "quantiles": [0.1]})),
            ("/v1/posterior/batch", json!({"include": likelihood, "mean": "linear", "quantiles": [0.1]})),
        ] {
            let mut body = json!({
                "cloud": {"points": points},
                "kernel": {"family": "matern", "length_scale": 1.0},
                "alpha": 1e-8,
                "values": values(size),
            });
            if path.ends_with("/batch") {
                body["values"] = json!([values(1.0), values(size)]);
            }
            body.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
            let answer = server.post(path, &body).await;
            if answer.status == 200 {
                n_answered += 1;
                assert!(!answer.text.contains("null"), "{path} {size:e}: {}", answer.text);
                continue;
            }
            n_refused += 1;
            let problem = answer.expect_problem(422, "invalid-request");
            assert!(problem["detail"].as_str().unwrap().contains("scale the"), "{path} {size:e}: {problem}");
        }
    }
    assert!(n_answered >= 8 && n_refused >= 8, "{n_answered} answered, {n_refused} refused");
}

#[tokio::test]
async fn a_fit_beyond_cholesky_says_so() {
    let server = Server::start().await;
    let interpolation = route_of("/v1/interpolation");
    let mut body = interpolation.with("/kernel", &json!({"family": "gauss", "length_scale": 3.0}));
    body["alpha"] = json!(0);
    body["cloud"] = json!({"points": fibonacci_sphere(200)});
    body["values"] = json!(vec![1.0; 200]);
    let answer = server.post(interpolation.path, &body).await.expect_ok();
    let diagnostics = &answer["diagnostics"];
    assert_eq!(diagnostics["factorization"], "pivoted_cholesky");
    assert!(diagnostics["rank"].as_u64().unwrap() < 200);
    let codes: Vec<&Value> = diagnostics["warnings"].as_array().unwrap().iter().map(|w| &w["code"]).collect();
    assert!(codes.contains(&&json!("ill_conditioned")), "{diagnostics}");
    assert!(numbers(&answer["values"]).iter().all(|value| (value - 1.0).abs() < 1e-6));
}
