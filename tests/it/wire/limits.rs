//! Limits of size, time and queue: each has its problem, and the server keeps answering.

use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::all_routes::{ROUTES, route_of};
use crate::document::contract::{self, AnswerParts};
use crate::store::durable::Folder;
use crate::store::jobs::{ask, delete, result};
use crate::support::{Server, fibonacci_sphere, pause};

/// Returns a request that takes seconds on any machine.
pub fn slow_request() -> Value {
    let points = fibonacci_sphere(12_000);
    json!({
        "cloud": {"points": points},
        "kernel": {"family": "matern", "length_scale": 0.3},
        "alpha": 1e-6,
        "queries": points[..1],
    })
}

#[tokio::test]
async fn bodies_beyond_the_limit_are_refused_when_announced() {
    let server = Server::with_flags(&["--max-body-bytes", "4000"]).await;
    for route in &ROUTES {
        let good = route.request().to_string();
        let fits = format!("{good}{}", " ".repeat(4000 - good.len()));
        let body = format!("{good}{}", " ".repeat(4001 - good.len()));
        let problem = server.post_text(route.path, body).await.expect_problem(413, "body-too-large");
        assert_eq!((&problem["limit"], &problem["required"]), (&json!(4000), &json!(4001)));
        server.post_text(route.path, fits).await.expect_ok();
    }
    // More than sockets buffer, so the client is still sending when the server refuses.
    let body = " ".repeat(20 << 20);
    let problem = server.post_text("/v1/clouds", body).await.expect_problem(413, "body-too-large");
    assert_eq!(problem["required"], 20 << 20);
}

#[tokio::test]
async fn bodies_beyond_the_limit_are_refused_when_streamed() {
    let server = Server::with_flags(&["--max-body-bytes", "4000"]).await;
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let head = "POST /v1/interpolation HTTP/1.1\r\nHost: test\r\nContent-Type: application/json\r\n\
                Connection: close\r\nTransfer-Encoding: chunked\r\n\r\n";
    stream.write_all(head.as_bytes()).await.unwrap();
    let chunk = format!("3e8\r\n{}\r\n", " ".repeat(1000));
    for _ in 0..200 {
        stream.write_all(chunk.as_bytes()).await.unwrap();
    }
    stream.write_all(b"0\r\n\r\n").await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    let answer = AnswerParts::parse(&answer);
    let route = route_of("/v1/interpolation");
    contract::check("POST", route.path, &answer);
    let document = answer.json().unwrap();
    assert_eq!((answer.status, &document["limit"]), (413, &json!(4000)));
    assert_eq!(document["type"], "/problems/body-too-large");
    server.post(route.path, &route.request()).await.expect_ok();
}

#[tokio::test]
async fn a_body_that_breaks_off_leaves_the_server_as_it_was() {
    let server = Server::with_flags(&["--threads", "1", "--max-queue", "0"]).await;
    for _ in 0..3 {
        let mut stream = TcpStream::connect(server.address).await.unwrap();
        let head = "POST /v1/interpolation HTTP/1.1\r\nHost: test\r\nContent-Type: application/json\r\n\
                    Content-Length: 1000\r\n\r\n{\"cloud\"";
        stream.write_all(head.as_bytes()).await.unwrap();
        stream.shutdown().await.unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).await.unwrap();
    }
    let route = route_of("/v1/interpolation");
    server.post(route.path, &route.request()).await.expect_ok();
}

#[tokio::test]
async fn problems_beyond_the_limits_are_refused_with_limit_and_need() {
    let server =
        Server::with_flags(&["--max-points", "20", "--max-dimension", "3", "--max-queries", "5"]).await;
    let refuses = async |path: &str, body: Value, pointer: &str, limit: u64, required: u64| {
        let problem = server.post(path, &body).await.expect_problem(413, "problem-too-large");
        assert_eq!(problem["errors"][0]["pointer"], pointer);
        let remedy = match pointer.rsplit('/').next() {
            Some("queries") => "split them over several requests",
            Some("points") if limit == 20 => "GRAMIAN_MAX_POINTS",
            Some("points") => "transpose",
            _ => "one per point",
        };
        assert!(problem["detail"].as_str().unwrap().contains(remedy), "{problem}");
        assert_eq!((&problem["limit"], &problem["required"]), (&json!(limit), &json!(required)), "{path}");
    };
    for route in &ROUTES {
        let many = route.with("/cloud/points", &json!(fibonacci_sphere(21)));
        refuses(route.path, many, "/cloud/points", 20, 21).await;
        let wide = route.with("/cloud/points", &json!([[1, 2, 3, 4], [5, 6, 7, 8]]));
        refuses(route.path, wide, "/cloud/points", 3, 4).await;
        let queries = route.with("/queries", &json!(fibonacci_sphere(6)));
        refuses(route.path, queries, "/queries", 5, 6).await;
        if route.has_geometry {
            let surface = json!({"cloud": {"points": fibonacci_sphere(21)}});
            refuses(route.path, route.with("/surface", &surface), "/surface/cloud/points", 20, 21).await;
        }
        for name in ["values", "noise_variances"].into_iter().skip(usize::from(!route.has_values)) {
            let entries = route.with(&format!("/{name}"), &json!(vec![1.0; 1000]));
            refuses(route.path, entries, &format!("/{name}"), 20, 1000).await;
        }
        let mut good = route.request();
        good["queries"] = json!(fibonacci_sphere(5));
        server.post(route.path, &good).await.expect_ok();
    }
    refuses("/v1/clouds", json!({"points": fibonacci_sphere(21)}), "/points", 20, 21).await;
}

/// Checks that rows beyond the limits are counted, not kept. A batch of a million rows would otherwise take
/// four times its body.
#[tokio::test]
async fn lists_of_values_quantiles_and_sites_beyond_the_limits_are_refused() {
    let server = Server::with_flags(&["--max-points", "20"]).await;
    let batch = json!({
        "cloud": {"points": fibonacci_sphere(20)}, "kernel": {"family": "laplace", "epsilon": 1},
        "values": [vec![1.0; 20], vec![2.0; 20]], "queries": fibonacci_sphere(2)
    });
    let refuses = async |path: &str, member: &str, value: Value, pointer: &str, limit: u64, required: u64| {
        let mut body = batch.clone();
        body[member] = value;
        let problem = server.post(path, &body).await.expect_problem(413, "problem-too-large");
        assert_eq!(problem["errors"][0]["pointer"], pointer);
        assert_eq!((&problem["limit"], &problem["required"]), (&json!(limit), &json!(required)), "{path}");
    };
    for path in ["/v1/interpolation/batch", "/v1/posterior/batch"] {
        server.post(path, &batch).await.expect_ok();
        refuses(path, "values", json!([vec![1.0; 20], vec![1.0; 1000]]), "/values/1", 20, 1000).await;
        refuses(path, "values", json!(vec![vec![1.0; 20]; 21]), "/values", 20, 21).await;
    }
    refuses("/v1/posterior/batch", "quantiles", json!(vec![0.5; 1001]), "/quantiles", 1000, 1001).await;
    let sites = vec![[0.0; 3]; 193];
    let body = json!({"cloud": batch["cloud"], "solver": "local", "sites": sites});
    let problem = server.post("/v1/normals", &body).await.expect_problem(413, "problem-too-large");
    assert_eq!((&problem["limit"], &problem["errors"][0]["pointer"]), (&json!(192), &json!("/sites")));
}

#[tokio::test]
async fn clouds_beyond_the_limit_of_the_dense_solver_are_registered_and_not_factorized() {
    let server = Server::with_flags(&["--max-points", "25", "--max-dense-points", "20"]).await;
    let expect_refused = async |path: &str, body: Value, pointer: &str| {
        let problem = server.post(path, &body).await.expect_problem(413, "problem-too-large");
        assert_eq!((&problem["limit"], &problem["required"]), (&json!(20), &json!(25)), "{path}");
        assert_eq!(problem["errors"][0]["pointer"], pointer);
        let detail = problem["detail"].as_str().unwrap();
        assert!(
            detail.contains(r#""solver" to "local""#) && detail.contains("GRAMIAN_MAX_DENSE_POINTS"),
            "{detail}"
        );
    };
    let points = json!({"points": fibonacci_sphere(25)});
    let registered = server.post("/v1/clouds", &points).await;
    assert_eq!(registered.status, 201);
    let id = registered.json()["cloud_id"].clone();
    for route in &ROUTES {
        let mut body = route.with("/cloud", &points);
        if route.has_values {
            // Requests that the local solver can answer are refused only if they ask for the dense one.
            body["solver"] = json!("dense");
        }
        expect_refused(route.path, body.clone(), "/cloud/points").await;
        body["cloud"] = json!({"id": id});
        expect_refused(route.path, body, "/cloud/id").await;
        if route.has_geometry {
            // Asks for the dense solver, because local regressions would serve this surface, whatever the
            // kernel of the values.
            let surface = json!({"cloud": {"id": id}, "solver": "dense"});
            expect_refused(route.path, route.with("/surface", &surface), "/surface/cloud/id").await;
        }
        server.post(route.path, &route.request()).await.expect_ok();
    }
    let beyond = json!({"points": fibonacci_sphere(26)});
    let problem = server.post("/v1/clouds", &beyond).await.expect_problem(413, "problem-too-large");
    assert!(problem["detail"].as_str().unwrap().contains("GRAMIAN_MAX_POINTS"), "{problem}");
}

#[tokio::test]
async fn answers_beyond_the_limit_are_refused_before_they_are_computed() {
    let server = Server::with_flags(&["--max-response-bytes", "5000"]).await;
    // 20 points and 20 queries, with 25 bytes a number.
    for (path, member, value, required) in [
        ("/v1/laplace-beltrami/matrix", "alpha", json!(1e-8), 25 * 20 * 20),
        ("/v1/surface-gradient/matrix", "alpha", json!(1e-8), 25 * 3 * 20 * 20),
        ("/v1/posterior", "include", json!(["covariance"]), 25 * 20 * 20),
        ("/v1/interpolation", "derivatives", json!(2), 25 * 20 * 13),
        ("/v1/curvatures", "alpha", json!(1e-8), 25 * 20 * 15),
    ] {
        let mut body = route_of(path).with(&format!("/{member}"), &value);
        let problem = server.post(path, &body).await.expect_problem(413, "problem-too-large");
        assert_eq!(problem["limit"], 5000);
        assert!(problem["detail"].as_str().unwrap().contains("split the queries"), "{problem}");
        let found = problem["required"].as_u64().unwrap();
        assert!((required..=2 * required).contains(&found), "{path}: {found} against {required}");
        body["queries"] = json!([[0.5, 0.5, 2.0]]);
        let answer = server.post(path, &body).await;
        assert_eq!(answer.status, 200, "{path}: {}", answer.text);
    }
}

#[tokio::test]
async fn an_answer_that_takes_too_long_is_given_up_and_others_go_on() {
    let server = Server::with_flags(&["--deadline-seconds", "0.7"]).await;
    let small = route_of("/v1/curvatures").request();
    for _ in 0..2 {
        let problem =
            server.post("/v1/curvatures", &slow_request()).await.expect_problem(504, "deadline-exceeded");
        assert!(problem["detail"].as_str().unwrap().contains("0.7"));
        server.post("/v1/curvatures", &small).await.expect_ok();
        server.get("/health/ready").await.expect_ok();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_turns_requests_away_until_there_is_room() {
    for max_queue in [0, 1] {
        // The deadline is long, because lateness is not tested here, however busy the machine.
        let queue = max_queue.to_string();
        let flags = ["--threads", "1", "--max-queue", &queue, "--deadline-seconds", "600"];
        let server = Server::with_flags(&flags).await;
        let body = slow_request().to_string();
        let slow = (0..1 + max_queue).map(|_| {
            let request = server.client.post(server.url("/v1/curvatures"));
            tokio::spawn(request.header("content-type", "application/json").body(body.clone()).send())
        });
        let slow: Vec<_> = slow.collect();
        while server.get("/health/ready").await.status == 200 {
            pause().await;
        }
        for route in &ROUTES {
            let answer = server.post(route.path, &route.request()).await;
            answer.expect_problem(503, "overloaded");
            let seconds: u64 = answer.header("retry-after").parse().unwrap();
            assert!((1..=600).contains(&seconds));
        }
        let ready = server.get("/health/ready").await;
        ready.expect_problem(503, "overloaded");
        assert!(!ready.header("retry-after").is_empty());
        for path in ["/health/live", "/version", "/v1/kernels", "/openapi.json"] {
            server.get(path).await.expect_ok();
        }
        // Clients that disconnect free their places.
        for request in slow {
            request.abort();
        }
        while server.get("/health/ready").await.status != 200 {
            pause().await;
        }
        for route in &ROUTES {
            server.post(route.path, &route.request()).await.expect_ok();
        }
    }
}

/// Returns the path of a cloud, from its description.
fn path_of(cloud: &Value) -> String {
    format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_leaves_what_needs_no_computation() {
    let folder = Folder::new("queue-full");
    for store in [&[][..], &folder.flags()] {
        let flags = [store, &["--threads", "1", "--max-queue", "0", "--deadline-seconds", "600"]].concat();
        let clouds = {
            let server = Server::with_flags(&flags).await;
            let cloud = |k: usize| json!({"points": fibonacci_sphere(20 + k)});
            let mut clouds = Vec::new();
            for k in 0..3 {
                clouds.push(path_of(&server.post("/v1/clouds", &cloud(k)).await.json()));
            }
            let job = ask(server.url("/v1/normals"), &route_of("/v1/normals").request(), &[]).await;
            result(&server, &job).await.expect_ok();
            let slow = server.client.post(server.url("/v1/curvatures")).json(&slow_request());
            let slow = tokio::spawn(slow.send());
            while server.get("/health/ready").await.status == 200 {
                pause().await;
            }
            server
                .post("/v1/normals", &route_of("/v1/normals").request())
                .await
                .expect_problem(503, "overloaded");
            let list = server.get("/v1/clouds").await.expect_ok();
            let listed: Vec<_> = list["clouds"].as_array().unwrap().iter().map(path_of).collect();
            assert!(clouds.iter().all(|cloud| listed.contains(cloud)), "{list}");
            let first = server.get(&clouds[0]).await.expect_ok();
            assert_eq!((&first["n_points"], first["spacing"].is_object()), (&json!(20), true));
            let heads = server.client.head(server.url(&clouds[1])).send().await.unwrap();
            assert_eq!(heads.status(), 200);
            let deleted = server.client.delete(server.url(&clouds[2])).send().await.unwrap();
            assert_eq!(deleted.status(), 204);
            assert_eq!(server.get(&job).await.expect_ok()["status"], "succeeded");
            result(&server, &job).await.expect_ok();
            assert_eq!(delete(&server, &job).await, 204);
            slow.abort();
            clouds
        };
        if store.is_empty() {
            continue;
        }
        // A new process knows the clouds from the store alone. Their spacing has yet to be computed.
        let server = Server::with_flags(&flags).await;
        let slow = server.client.post(server.url("/v1/curvatures")).json(&slow_request());
        let slow = tokio::spawn(slow.send());
        while server.get("/health/ready").await.status == 200 {
            pause().await;
        }
        let list = server.get("/v1/clouds").await.expect_ok();
        let listed: Vec<_> = list["clouds"].as_array().unwrap().iter().map(path_of).collect();
        let is_listed: Vec<_> = clouds.iter().map(|cloud| listed.contains(cloud)).collect();
        assert_eq!(is_listed, [true, true, false], "{list}");
        assert_eq!(server.client.head(server.url(&clouds[0])).send().await.unwrap().status(), 200);
        server.get(&clouds[0]).await.expect_problem(503, "overloaded");
        slow.abort();
        while server.get("/health/ready").await.status != 200 {
            pause().await;
        }
        assert!(server.get(&clouds[0]).await.expect_ok()["spacing"].is_object());
    }
}
