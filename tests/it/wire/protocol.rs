//! Basics of HTTP: paths, methods, media types, request ids.

use std::collections::{BTreeSet, HashMap};

use reqwest::Method;
use serde_json::{Value, json};

use crate::all_routes::{ROUTES, route_of};
use crate::support::{Server, fibonacci_sphere, unpooled};

#[tokio::test]
async fn unknown_paths_are_problems_too() {
    let server = Server::start().await;
    for path in
        ["/nowhere", "/v1", "/v1/", "/v1/nowhere", "/v2/interpolation", "/v1/interpolation/", "/problems/no"]
    {
        server.get(path).await.expect_problem(404, "not-found");
        if path != "/problems/no" {
            server.post(path, &json!({})).await.expect_problem(404, "not-found");
        }
    }
    server.get("/v1/clouds/nonsense").await.expect_problem(404, "unknown-cloud");
    server.get("/health/ready").await.expect_ok();
}

#[tokio::test]
async fn a_wrong_method_is_answered_with_the_right_ones() {
    let server = Server::start().await;
    let id = "0".repeat(64);
    let allowed = async |method: Method, path: &str| {
        let answer = server.send(server.client.request(method, server.url(path))).await;
        answer.expect_problem(405, "method-not-allowed");
        let mut methods: Vec<_> = answer.header("allow").split(',').map(|m| m.trim().to_owned()).collect();
        methods.sort();
        methods.join(" ")
    };
    for route in &ROUTES {
        for method in [Method::GET, Method::PUT, Method::DELETE] {
            assert_eq!(allowed(method, route.path).await, "POST", "{}", route.path);
        }
        server.post(route.path, &route.request()).await.expect_ok();
    }
    assert_eq!(allowed(Method::PUT, "/v1/clouds").await, "GET HEAD POST");
    assert_eq!(allowed(Method::POST, &format!("/v1/clouds/{id}")).await, "DELETE GET HEAD");
    for path in [
        "/v1/kernels",
        "/health/live",
        "/health/ready",
        "/metrics",
        "/version",
        "/openapi.json",
        "/problems/internal",
    ] {
        assert_eq!(allowed(Method::POST, path).await, "GET HEAD", "{path}");
    }
}

#[tokio::test]
async fn answers_come_as_what_there_is_or_not_at_all() {
    let server = Server::start().await;
    let clouds = ("/v1/clouds", json!({"points": [[1, 2]]}));
    for (path, body) in ROUTES.iter().map(|route| (route.path, route.request())).chain([clouds]) {
        let send = async |accept: &str| {
            let request = server.client.post(server.url(path)).json(&body).header("accept", accept);
            server.send(request).await
        };
        for accept in
            ["text/html", "application/octet-stream", "application/json;q=0", "image/*, text/*;q=0.5"]
        {
            let problem = send(accept).await.expect_problem(406, "not-acceptable");
            assert!(problem["detail"].as_str().unwrap().contains("application/json"));
        }
        for accept in ["application/json", "*/*", "text/html, */*;q=0.1", "Application/*"] {
            assert!([200, 201].contains(&send(accept).await.status), "{path} {accept}");
        }
    }
}

/// Returns the media types of an answer, as generated clients accept them.
fn media_types(response: &Value) -> Vec<&str> {
    response["content"]
        .as_object()
        .into_iter()
        .flat_map(|content| content.keys())
        .map(String::as_str)
        .collect()
}

#[tokio::test]
async fn what_generated_clients_accept_is_acceptable() {
    let server = Server::start().await;
    let id = register_a_cloud(&server).await;
    let mut bodies: HashMap<&str, Value> = ROUTES.iter().map(|route| (route.path, route.request())).collect();
    for (sparse, dense) in [
        ("/v1/laplace-beltrami/sparse-matrix", "/v1/laplace-beltrami/matrix"),
        ("/v1/surface-gradient/sparse-matrix", "/v1/surface-gradient/matrix"),
    ] {
        bodies.insert(sparse, bodies[dense].clone());
    }
    for path in ["/v1/interpolation", "/v1/posterior"] {
        let mut batch = bodies[path].clone();
        batch["values"] = json!([batch["values"]]);
        bodies.insert(
            if path == "/v1/posterior" { "/v1/posterior/batch" } else { "/v1/interpolation/batch" },
            batch,
        );
    }
    bodies.insert("/v1/model-selection", bodies["/v1/posterior"].clone());
    let mut named = bodies["/v1/normals"].clone();
    named["operation"] = json!("compute_normals");
    bodies.insert("/v1/estimate", named);
    bodies.insert("/v1/tiles/sides", json!({"tiles": [], "links": []}));
    let tile = json!({"points": [[1, 0], [0, 1]], "normals": [[1, 0], [0, 1]]});
    let octagon: Vec<[f64; 2]> = [(1.0, 0.0), (0.7, 0.7)]
        .into_iter()
        .flat_map(|(x, y): (f64, f64)| [[x, y], [-y, x], [-x, -y], [y, -x]])
        .collect();
    bodies.insert("/v1/level-set", json!({"cloud": {"points": octagon}}));
    bodies.insert("/v1/tiles/regions", json!({"cloud": tile, "own": [0]}));
    for (name, document) in
        [("3.1", gramian::http::openapi_json()), ("3.0", gramian::http::openapi_3_0_json())]
    {
        let document: Value = serde_json::from_str(&document).unwrap();
        for (path, item) in document["paths"].as_object().unwrap() {
            for (method, operation) in item.as_object().unwrap() {
                let responses = operation["responses"].as_object().unwrap();
                let accepted: BTreeSet<&str> = responses.values().flat_map(media_types).collect();
                let accept = accepted.into_iter().collect::<Vec<_>>().join(", ");
                let method: Method = method.to_uppercase().parse().unwrap();
                let job =
                    if path.contains("{job_id}") { ask_for_a_job(&server).await } else { String::new() };
                let path = path.replace("{cloud_id}", &id).replace("{slug}", "internal");
                let url = server.url(&path.replace("{job_id}", &job));
                let mut request = server.client.request(method.clone(), url);
                if !accept.is_empty() {
                    request = request.header("accept", &accept);
                }
                if method == Method::POST {
                    let cloud = json!({"points": [[1, 2]]});
                    request = request.json(bodies.get(path.as_str()).unwrap_or(&cloud));
                }
                let answer = server.send(request).await;
                assert!(answer.status < 300, "{name}: {method} {path} with {accept}: {}", answer.text);
                // The next operation needs the cloud again, which this one may have deleted.
                register_a_cloud(&server).await;
            }
        }
    }
}

async fn ask_for_a_job(server: &Server) -> String {
    let request = server.client.post(server.url("/v1/normals")).header("prefer", "respond-async");
    let answer = request.json(&ROUTES[0].with("/values", &json!("absent"))).send().await.unwrap();
    answer.json::<Value>().await.unwrap()["job_id"].as_str().unwrap().to_owned()
}

async fn register_a_cloud(server: &Server) -> String {
    let cloud = server.post("/v1/clouds", &json!({"points": fibonacci_sphere(4)})).await;
    cloud.json()["cloud_id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_problem_is_acceptable_whatever_the_client_accepts() {
    let server = Server::start().await;
    let unknown = server.url(&format!("/v1/clouds/{}", "0".repeat(64)));
    for accept in
        ["application/problem+json", "application/json, application/problem+json", "application/json"]
    {
        for method in [Method::HEAD, Method::DELETE] {
            let request = server.client.request(method.clone(), &unknown).header("accept", accept);
            assert_eq!(server.send(request).await.status, 404, "{method} {accept}");
        }
    }
    // Where success would have a body, the client is told that it does not accept it.
    let both = "application/json, application/problem+json";
    for (accept, status, slug) in
        [("application/problem+json", 406, "not-acceptable"), (both, 404, "unknown-cloud")]
    {
        let request = server.client.get(&unknown).header("accept", accept);
        server.send(request).await.expect_problem(status, slug);
    }
}

#[tokio::test]
async fn bodies_are_announced_as_what_they_are() {
    let server = Server::start().await;
    let clouds = ("/v1/clouds", json!({"points": [[1, 2]]}));
    for (path, body) in ROUTES.iter().map(|route| (route.path, route.request())).chain([clouds]) {
        let body = body.to_string();
        let send = async |headers: &[(&str, &str)]| {
            let mut request = server.client.post(server.url(path)).body(body.clone());
            for (name, value) in headers {
                request = request.header(*name, *value);
            }
            server.send(request).await
        };
        for refused in [
            &[("content-type", "text/plain")][..],
            &[("content-type", "application/octet-stream")],
            &[("content-type", "application/problem+json")],
            &[("content-type", "application/json"), ("content-encoding", "br")],
            &[("content-type", "application/json"), ("content-encoding", "gzip, zstd")],
            &[("content-encoding", "gzip")],
            // A page of another origin needs no permission to send a body without a type.
            &[("origin", "https://elsewhere.example")],
        ] {
            send(refused).await.expect_problem(415, "unsupported-media-type");
        }
        for malformed in [
            &[("content-type", "application/x-safetensors")][..],
            &[("content-type", "application/json"), ("content-encoding", "gzip")],
            &[("content-type", "application/json"), ("content-encoding", "zstd")],
        ] {
            send(malformed).await.expect_problem(400, "malformed-body");
        }
        let npy = send(&[("content-type", "application/x-npy")]).await;
        match path {
            "/v1/clouds" => npy.expect_problem(400, "malformed-body"),
            _ => npy.expect_problem(415, "unsupported-media-type"),
        };
        for accepted in [
            &[("content-type", "application/json")][..],
            &[("content-type", "Application/JSON; charset=utf-8")],
            &[("content-type", "application/json"), ("content-encoding", "identity")],
            // A body without a type that begins with `{` is JSON.
            &[],
            &[("content-type", "")],
        ] {
            assert!([200, 201].contains(&send(accepted).await.status), "{path} {accepted:?}");
        }
    }
}

#[tokio::test]
async fn a_body_without_a_type_is_an_object_or_refused() {
    let server = Server::start().await;
    let object = json!({"points": [[1, 2]]}).to_string();
    let send =
        async |body: String| server.send(server.client.post(server.url("/v1/clouds")).body(body)).await;
    assert_eq!(send(format!(" \r\n\t{object}")).await.status, 201);
    for refused in [
        String::new(),
        " ".to_owned(),
        format!("[{object}]"),
        "ply\n".to_owned(),
        format!("\u{feff}{object}"),
    ] {
        let answer = send(refused).await;
        let problem = answer.expect_problem(415, "unsupported-media-type");
        assert!(problem["detail"].as_str().unwrap().contains("no Content-Type"), "{problem}");
    }
    // As a job it is the same request. The document has no 202, since that status depends on a header.
    let request = unpooled().post(server.url("/v1/normals")).header("prefer", "respond-async");
    let accepted = request.body(route_of("/v1/normals").request().to_string()).send().await.unwrap();
    assert_eq!(accepted.status(), 202);
    let result = format!("{}/result", accepted.headers()["location"].to_str().unwrap());
    server.get(&result).await.expect_ok();
}

#[tokio::test]
async fn every_answer_names_its_request() {
    let server = Server::start().await;
    let id = "0".repeat(64);
    let cloud = format!("/v1/clouds/{id}");
    let mut seen = std::collections::HashSet::new();
    for path in [
        "/health/live",
        "/health/ready",
        "/metrics",
        "/version",
        "/openapi.json",
        "/docs/",
        "/v1/kernels",
        "/v1/clouds",
        &cloud,
        "/no",
    ] {
        let ask = |id: &str| server.client.get(server.url(path)).header("x-request-id", id);
        let own = server.get(path).await;
        assert!(seen.insert(own.header("x-request-id").to_owned()), "{path}");
        assert!(own.header("x-request-id").len() >= 16, "{path}");
        assert_eq!(server.send(ask("client-7.a_b")).await.header("x-request-id"), "client-7.a_b", "{path}");
        for unsafe_id in ["a b", "{\"x\":1}", &"x".repeat(1000), ""] {
            let replaced = server.send(ask(unsafe_id)).await.header("x-request-id").to_owned();
            assert!(replaced != unsafe_id && !replaced.is_empty(), "{path} {unsafe_id}");
        }
    }
    for route in &ROUTES {
        let request = server.client.post(server.url(route.path)).header("x-request-id", "mine");
        let answer = server.send(request.json(&json!({}))).await;
        assert_eq!(answer.expect_problem(422, "invalid-request")["instance"], "mine");
        let request = server.client.post(server.url(route.path)).header("x-request-id", "mine");
        assert_eq!(server.send(request.json(&route.request())).await.header("x-request-id"), "mine");
    }
}
