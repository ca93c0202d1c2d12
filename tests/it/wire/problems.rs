//! Bodies without the documented form: each is refused with a pointer, and the server keeps answering.

use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::support::Server;

#[tokio::test]
async fn what_is_not_json_is_malformed_on_every_route() {
    let server = Server::start().await;
    for route in &ROUTES {
        let good = route.request().to_string();
        let replaced = |number: &str| good.replace("1e-8", number).replace("1.0}", &format!("{number}}}"));
        let deep = format!("{{\"cloud\": {}", "[".repeat(200_000));
        for body in [
            "",
            " ",
            "{",
            "nonsense",
            &good[..good.len() / 2],
            &good[..good.len() - 1],
            &format!("{good}}}"),
            &format!("{good} {good}"),
            &replaced("NaN"),
            &replaced("1e400"),
            &replaced("Infinity"),
            &replaced("0x10"),
            &good.replace(':', "="),
            &good.replace('"', "'"),
            &deep,
        ] {
            route.refuses_text(&server, body, 400, "malformed-json").await;
        }
    }
}

#[tokio::test]
async fn bytes_that_are_no_text_are_malformed() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut body = route.request().to_string().into_bytes();
        body[3] = 0xff;
        server.post_text(route.path, body).await.expect_problem(400, "malformed-json");
        server.post(route.path, &route.request()).await.expect_ok();
    }
}

#[tokio::test]
async fn a_member_of_the_wrong_form_is_pointed_to_on_every_route() {
    let server = Server::start().await;
    for route in &ROUTES {
        for (pointer, value) in [
            ("/cloud", json!(null)),
            ("/cloud", json!([[[0, 0, 1]]])),
            ("/cloud", json!("points")),
            ("/cloud/frobnicate", json!(1)),
            ("/cloud/a~b", json!(1)),
            ("/cloud/points", json!(null)),
            ("/cloud/points", json!("many")),
            ("/cloud/points/3", json!(1.5)),
            ("/cloud/points/17/2", json!(null)),
            ("/cloud/points/17/2", json!("0.5")),
            ("/cloud/points/17/2", json!([0.5])),
            ("/cloud/normals", json!(null)),
            ("/cloud/id", json!(null)),
            ("/cloud/id", json!(7)),
            ("/kernel", json!(null)),
            ("/kernel", json!(["matern", 1.0])),
            ("/kernel", json!("matern")),
            ("/kernel/family", json!("rbf")),
            ("/kernel/family", json!(null)),
            ("/kernel/frobnicate", json!(1)),
            ("/kernel/length_scale", json!(null)),
            ("/kernel/length_scale", json!("1")),
            ("/kernel/length_scale", json!(0)),
            ("/kernel/length_scale", json!(-1.5)),
            ("/kernel/variance", json!(null)),
            ("/kernel/variance", json!(0)),
            ("/kernel/nu", json!(null)),
            ("/kernel/nu", json!(1)),
            ("/kernel/nu", json!(9.5)),
            ("/kernel/epsilon", json!(1)),
            ("/kernel/smoothness", json!(4)),
            ("/kernel", json!({"family": "gauss", "nu": 2.5})),
            ("/kernel", json!({"family": "laplace", "epsilon": -1})),
            ("/kernel", json!({"family": "wendland", "smoothness": 3})),
            ("/kernel", json!({"family": "wendland", "smoothness": 2.5})),
            ("/alpha", json!(null)),
            ("/alpha", json!("0")),
            ("/alpha", json!(-1e-9)),
            ("/noise_variances", json!(null)),
            ("/noise_variances", json!([1.0])),
            ("/solver", json!(null)),
            ("/solver", json!("magic")),
            ("/solver", json!([])),
            ("/solver", json!({"dense": null})),
            ("/duplicates", json!(null)),
            ("/duplicates", json!("ignore")),
            ("/queries", json!(null)),
            ("/queries", json!({})),
            ("/queries", json!([])),
            ("/queries", json!([[]])),
            ("/frobnicate", json!(null)),
            ("/a~b", json!(1)),
        ] {
            let expected = match (pointer, value.get("family").and_then(Value::as_str)) {
                (_, Some("gauss")) => "/kernel/nu",
                (_, Some("laplace")) => "/kernel/epsilon",
                (_, Some("wendland")) => "/kernel/smoothness",
                (pointer, _) => &pointer.replace("a~b", "a~0b"),
            };
            route.refuses(&server, &route.with(pointer, &value), 422, "invalid-request", expected).await;
        }
    }
}

#[tokio::test]
async fn a_member_of_one_route_is_pointed_to_when_null_or_wrong() {
    let server = Server::start().await;
    for (path, names) in [
        ("/v1/interpolation", &["values", "derivatives"][..]),
        ("/v1/posterior", &["values", "include"]),
        ("/v1/normals", &["surface_model", "orientation"]),
        ("/v1/curvatures", &["surface_model", "orientation"]),
        ("/v1/surface-gradient", &["values", "surface"]),
        ("/v1/surface-gradient/matrix", &["surface"]),
        ("/v1/laplace-beltrami", &["values", "surface"]),
        ("/v1/laplace-beltrami/matrix", &["surface", "solver"]),
    ] {
        let route = ROUTES.iter().find(|route| route.path == path).unwrap();
        for name in names {
            for value in [json!(null), json!(-7), json!("frobnicate")] {
                let pointer = format!("/{name}");
                let body = route.with(&pointer, &value);
                route.refuses(&server, &body, 422, "invalid-request", &pointer).await;
            }
        }
    }
    for route in ROUTES.iter().filter(|route| route.has_geometry) {
        for (name, value) in [
            ("frobnicate", json!(1)),
            ("cloud", json!(null)),
            ("cloud", json!([])),
            ("cloud", json!({})),
            ("kernel", json!(null)),
            ("kernel", json!([])),
            ("alpha", json!(null)),
            ("alpha", json!(-1)),
            ("noise_variances", json!(null)),
            ("solver", json!(null)),
            ("surface_model", json!(null)),
        ] {
            let pointer = format!("/surface/{name}");
            let body = route.with("/surface", &json!({name: value}));
            route.refuses(&server, &body, 422, "invalid-request", &pointer).await;
        }
        let body = route.with("/surface", &json!([]));
        route.refuses(&server, &body, 422, "invalid-request", "/surface").await;
    }
}

#[tokio::test]
async fn unknown_and_missing_members_are_named() {
    let server = Server::start().await;
    for route in &ROUTES {
        let unknown = route.with("/frobnicate", &json!(1));
        let problem = route.refuses(&server, &unknown, 422, "invalid-request", "/frobnicate").await;
        assert!(problem["detail"].as_str().unwrap().contains("frobnicate"), "{problem}");
        for (pointer, name) in [("/cloud", "cloud"), ("/kernel/family", "family"), ("/values", "values")] {
            if name == "values" && !route.has_values {
                continue;
            }
            let body = route.with(pointer, &json!("absent")).to_string();
            let problem = route.refuses_text(&server, &body, 422, "invalid-request").await;
            assert!(problem["detail"].as_str().unwrap().contains(name), "{problem}");
        }
        for body in ["null", "[]", "3", "\"text\"", "true", "{}"] {
            route.refuses_text(&server, body, 422, "invalid-request").await;
        }
        let twice = route.request().to_string().replacen('{', "{\"alpha\": 1, ", 1);
        route.refuses_text(&server, &twice, 422, "invalid-request").await;
    }
}
