//! Access control: API keys and CORS.

use reqwest::Method;
use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::support::{Answer, Server};

async fn send(server: &Server, method: Method, path: &str, headers: &[(&str, &str)], body: &Value) -> Answer {
    let mut request = server.client.request(method, server.url(path)).json(body);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    server.send(request).await
}

#[tokio::test]
async fn without_a_valid_key_nothing_below_v1_is_answered() {
    let server = Server::with_flags(&["--api-keys", "alpha-key,beta-key"]).await;
    let id = format!("/v1/clouds/{}", "0".repeat(64));
    let posts = ROUTES.iter().map(|route| (Method::POST, route.path));
    let others = [
        (Method::POST, "/v1/clouds"),
        (Method::GET, "/v1/clouds"),
        (Method::GET, "/v1/kernels"),
        (Method::GET, &id),
        (Method::DELETE, &id),
    ];
    for (method, path) in posts.chain(others) {
        for header in [
            "",
            "Bearer",
            "Bearer ",
            "Bearer wrong",
            "Bearer alpha-key,beta-key",
            "Bearer alpha-ke",
            "Bearer alpha-keyy",
            "Bearer ALPHA-KEY",
            "Basic alpha-key",
            "alpha-key",
        ] {
            let answer = send(&server, method.clone(), path, &[("authorization", header)], &json!({})).await;
            answer.expect_problem(401, "unauthorized");
            assert!(answer.header("www-authenticate").starts_with("Bearer"), "{path}");
        }
        let answer = send(&server, method, path, &[], &json!({})).await;
        answer.expect_problem(401, "unauthorized");
        assert!(!answer.text.contains("alpha-key"));
    }
    for route in &ROUTES {
        for header in ["Bearer alpha-key", "bearer beta-key"] {
            let headers = [("authorization", header)];
            send(&server, Method::POST, route.path, &headers, &route.request()).await.expect_ok();
        }
    }
}

#[tokio::test]
async fn probes_and_documents_need_no_key() {
    let server = Server::with_flags(&["--api-keys", "alpha-key"]).await;
    let documents =
        ["/openapi.json", "/openapi-3.0.json", "/docs/", "/problems/unauthorized", "/problems", "/"];
    for path in ["/health/live", "/health/ready", "/metrics", "/version"].into_iter().chain(documents) {
        assert_eq!(server.get(path).await.status, 200, "{path}");
    }
}

#[tokio::test]
async fn every_operation_refuses_keys_and_media_types_where_the_document_says_so() {
    let server = Server::with_flags(&["--api-keys", "alpha-key"]).await;
    let document = crate::support::document();
    let mut n_refused = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        let path = path.replace("{cloud_id}", &"0".repeat(64)).replace("{slug}", "unauthorized");
        for (method, operation) in item.as_object().unwrap() {
            let method: Method = method.to_uppercase().parse().unwrap();
            for (status, headers) in [("401", ["wrong-key", "*/*"]), ("406", ["alpha-key", "text/csv"])] {
                // The answer for a result depends on an earlier request.
                if path.ends_with("/result") && status == "406" {
                    continue;
                }
                let [key, accept] = headers;
                let headers = [("authorization", &*format!("Bearer {key}")), ("accept", accept)];
                let answer = send(&server, method.clone(), &path, &headers, &json!({})).await;
                let is_declared = operation["responses"].get(status).is_some();
                assert_eq!(
                    answer.status.to_string() == status,
                    is_declared,
                    "{method} {path} {}",
                    answer.status
                );
                n_refused += u32::from(is_declared);
            }
        }
    }
    assert!(n_refused > 25, "{n_refused}");
}

#[tokio::test]
async fn clouds_of_one_key_are_invisible_to_the_other() {
    let server = Server::with_flags(&["--api-keys", "alpha-key,beta-key"]).await;
    let alpha = [("authorization", "Bearer alpha-key")];
    let beta = [("authorization", "Bearer beta-key")];
    let points = json!({"points": [[1.0, 2.0, 3.0], [4.0, 5.0, 7.0]]});
    let posted = send(&server, Method::POST, "/v1/clouds", &alpha, &points).await;
    assert_eq!(posted.status, 201);
    let id = posted.json()["cloud_id"].as_str().unwrap().to_owned();
    let path = format!("/v1/clouds/{id}");
    for method in [Method::GET, Method::DELETE] {
        send(&server, method, &path, &beta, &json!({})).await.expect_problem(404, "unknown-cloud");
    }
    assert_eq!(send(&server, Method::HEAD, &path, &beta, &json!({})).await.status, 404);
    let list = send(&server, Method::GET, "/v1/clouds", &beta, &json!({})).await.expect_ok();
    assert_eq!(list["clouds"], json!([]));
    for route in &ROUTES {
        let mut body = route.with("/cloud", &json!({"id": id}));
        if route.has_values {
            body["values"] = json!([1.0, 2.0]);
        }
        let refused = send(&server, Method::POST, route.path, &beta, &body).await;
        refused.expect_problem(404, "unknown-cloud");
        send(&server, Method::POST, route.path, &alpha, &body).await.expect_ok();
        // A factor computed with one key is no cache hit for the other key.
        body["cloud"] = points.clone();
        let answer = send(&server, Method::POST, route.path, &alpha, &body).await;
        assert_eq!(answer.header("cache-status"), "gramian; hit", "{}", route.path);
    }
    let body = json!({"cloud": points, "values": [1, 2], "kernel": {"family": "matern", "length_scale": 1.0}, "alpha": 1e-8});
    let answer = send(&server, Method::POST, "/v1/interpolation", &beta, &body).await;
    assert_eq!(answer.header("cache-status"), "gramian; fwd=miss; stored");
    // Deleting the cloud with one key leaves it for the other.
    assert_eq!(send(&server, Method::DELETE, &path, &beta, &json!({})).await.status, 204);
    send(&server, Method::GET, &path, &alpha, &json!({})).await.expect_ok();
    let list = send(&server, Method::GET, "/v1/clouds", &alpha, &json!({})).await.expect_ok();
    assert_eq!(list["clouds"][0]["cloud_id"], json!(id));
}

async fn preflight(server: &Server, origin: &str) -> Answer {
    let headers = [
        ("origin", origin),
        ("access-control-request-method", "POST"),
        ("access-control-request-headers", "authorization,content-type"),
    ];
    send(server, Method::OPTIONS, "/v1/interpolation", &headers, &json!({})).await
}

#[tokio::test]
async fn configured_origins_may_call_and_others_may_not() {
    let flags = ["--cors-origins", "https://one.example,https://two.example", "--api-keys", "alpha-key"];
    let server = Server::with_flags(&flags).await;
    for origin in ["https://one.example", "https://two.example"] {
        // Browsers send no key with a preflight.
        let answer = preflight(&server, origin).await;
        assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, origin));
        assert!(answer.header("access-control-allow-methods").contains("POST"));
        let allowed = answer.header("access-control-allow-headers").to_ascii_lowercase();
        for name in ["authorization", "content-type", "prefer", "idempotency-key"] {
            assert!(allowed.contains(name), "{allowed}");
        }
        // Browsers read problems as well.
        for (headers, status) in [
            (&[("origin", origin)][..], 401),
            (&[("origin", origin), ("authorization", "Bearer alpha-key")], 200),
        ] {
            let answer = send(&server, Method::GET, "/v1/kernels", headers, &json!({})).await;
            assert_eq!((answer.status, answer.header("access-control-allow-origin")), (status, origin));
            assert!(answer.header("access-control-expose-headers").contains("x-request-id"));
            assert!(answer.header("vary").to_ascii_lowercase().contains("origin"));
        }
    }
    for origin in ["https://three.example", "http://one.example", "https://one.example.evil", "null"] {
        let headers = [("origin", origin), ("authorization", "Bearer alpha-key")];
        for answer in [
            preflight(&server, origin).await,
            send(&server, Method::GET, "/v1/kernels", &headers, &json!({})).await,
        ] {
            assert_eq!(answer.header("access-control-allow-origin"), "", "{origin}");
        }
    }
}

#[tokio::test]
async fn no_origin_may_call_unless_configured_and_a_star_lets_all() {
    let server = Server::start().await;
    let origin = [("origin", "https://one.example")];
    assert_eq!(preflight(&server, origin[0].1).await.header("access-control-allow-origin"), "");
    let answer = send(&server, Method::GET, "/v1/kernels", &origin, &json!({})).await;
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, ""));
    let server = Server::with_flags(&["--cors-origins", "*"]).await;
    assert_eq!(preflight(&server, origin[0].1).await.header("access-control-allow-origin"), "*");
}

#[tokio::test]
async fn options_of_unknown_paths_are_not_found_with_origins_and_without() {
    for flags in [&[][..], &["--cors-origins", "*"]] {
        let server = Server::with_flags(flags).await;
        let headers = [("origin", "https://one.example"), ("access-control-request-method", "POST")];
        for path in ["/v1/nothing", "/nothing", "/v1/clouds/a/b", "/v1"] {
            let answer = send(&server, Method::OPTIONS, path, &headers, &json!({})).await;
            answer.expect_problem(404, "not-found");
        }
        let known = send(&server, Method::OPTIONS, "/v1/normals", &headers, &json!({})).await;
        assert_eq!(known.status, if flags.is_empty() { 405 } else { 200 });
    }
}
