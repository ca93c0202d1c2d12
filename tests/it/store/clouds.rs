//! Registered clouds: identified by their content, listed, used by id, deleted, evicted.

use reqwest::Method;
use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::support::{Answer, Server, fibonacci_sphere};

async fn ask(server: &Server, method: Method, path: &str, if_none_match: &str) -> Answer {
    let mut request = server.client.request(method, server.url(path));
    if !if_none_match.is_empty() {
        request = request.header("if-none-match", if_none_match);
    }
    server.send(request).await
}

/// Returns the cloud id as the interface documents it: the BLAKE3 hash of d, n, then the numbers, all
/// little-endian.
fn documented_id(d: u64, points: &[f64], normals: &[f64]) -> String {
    let mut bytes = Vec::new();
    bytes.extend(d.to_le_bytes());
    bytes.extend((points.len() as u64 / d).to_le_bytes());
    bytes.extend(points.iter().chain(normals).flat_map(|x| x.to_le_bytes()));
    blake3::hash(&bytes).to_hex().to_string()
}

#[tokio::test]
async fn what_cannot_be_an_id_is_not_found() {
    let server = Server::start().await;
    for method in [Method::GET, Method::HEAD, Method::DELETE] {
        let not_text = ask(&server, method.clone(), "/v1/clouds/%FF", "").await;
        let no_id = ask(&server, method.clone(), "/v1/clouds/circle", "").await;
        assert_eq!((not_text.status, no_id.status), (404, 404));
        if method != Method::HEAD {
            not_text.expect_problem(404, "not-found");
            no_id.expect_problem(404, "unknown-cloud");
        }
    }
}

#[tokio::test]
async fn a_cloud_is_created_once_found_checked_and_deleted() {
    let server = Server::start().await;
    let body = json!({"points": [[0, 0, 0], [3, 0, 0], [3, 4, 0], [3, 4, 0]]});
    let first = server.post("/v1/clouds", &body).await;
    assert_eq!(first.status, 201, "{}", first.text);
    let cloud = first.json();
    let id = cloud["cloud_id"].as_str().unwrap();
    let path = format!("/v1/clouds/{id}");
    assert_eq!(first.header("location"), path);
    assert_eq!((&cloud["n_points"], &cloud["dimension"]), (&json!(4), &json!(3)));
    assert_eq!(cloud["bounding_box"], json!({"min": [0.0, 0.0, 0.0], "max": [3.0, 4.0, 0.0]}));
    assert_eq!(cloud["n_duplicates"], 1);
    assert_eq!((&cloud["spacing"]["min"], &cloud["spacing"]["max"]), (&json!(3.0), &json!(4.0)));
    assert!(cloud["created_at"].as_str().unwrap().ends_with('Z'));

    let again = server.post("/v1/clouds", &body).await;
    assert_eq!((again.status, again.header("location")), (200, path.as_str()));
    assert_eq!(again.json(), cloud);

    let (strong, etag) = (format!("\"{id}\""), format!("W/\"{id}\""));
    for method in [Method::GET, Method::HEAD] {
        let found = ask(&server, method.clone(), &path, "").await;
        assert_eq!((found.status, found.header("etag")), (200, etag.as_str()));
        for tags in [etag.clone(), strong.clone(), format!("\"other\", {etag}"), "*".to_owned()] {
            let known = ask(&server, method.clone(), &path, &tags).await;
            assert_eq!((known.status, known.header("etag")), (304, etag.as_str()), "{tags}");
            assert_eq!(known.text, "");
        }
        assert_eq!(ask(&server, method.clone(), &path, "\"other\"").await.status, 200);
    }
    assert_eq!(server.get(&path).await.expect_ok(), cloud);

    let deleted = ask(&server, Method::DELETE, &path, "").await;
    assert_eq!((deleted.status, deleted.text.as_str()), (204, ""));
    server.get(&path).await.expect_problem(404, "unknown-cloud");
    assert_eq!(ask(&server, Method::HEAD, &path, "").await.status, 404);
    ask(&server, Method::DELETE, &path, "").await.expect_problem(404, "unknown-cloud");
    assert_eq!(server.post("/v1/clouds", &body).await.status, 201);
}

#[tokio::test]
async fn the_id_is_the_hash_of_the_documented_bytes() {
    let server = Server::start().await;
    let id = async |body: Value| server.post("/v1/clouds", &body).await.json()["cloud_id"].clone();
    let expected = documented_id(2, &[0.0, 1.5, -2.25, 1e-310], &[]);
    assert_eq!(id(json!({"points": [[0.0, 1.5], [-2.25, 1e-310]]})).await, expected);
    assert_eq!(id(json!({"points": [[-0.0, 1.5], [-2.25, 1e-310]]})).await, expected);
    let with_normals = json!({"points": [[0.0, 1.5], [-2.25, 1e-310]], "normals": [[1, 0], [-0.0, 2]]});
    let expected = documented_id(2, &[0.0, 1.5, -2.25, 1e-310], &[1.0, 0.0, 0.0, 2.0]);
    assert_eq!(id(with_normals).await, expected);
    // The same numbers in another shape are a different cloud.
    let expected = documented_id(1, &[0.0, 1.5, -2.25, 1e-310], &[]);
    assert_eq!(id(json!({"points": [[0.0], [1.5], [-2.25], [1e-310]]})).await, expected);
}

#[tokio::test]
async fn bad_clouds_are_pointed_to() {
    let server = Server::start().await;
    for (body, slug, pointer) in [
        (json!({"points": []}), "invalid-cloud", "/points"),
        (json!({"points": [[]]}), "invalid-cloud", "/points"),
        (json!({"points": [[1, 2], [3]]}), "invalid-cloud", "/points/1"),
        (json!({"points": [[1, 2], [3, null]]}), "invalid-request", "/points/1/1"),
        (json!({"points": null}), "invalid-request", "/points"),
        (json!({}), "invalid-request", ""),
        (json!([[[1, 2]]]), "invalid-request", ""),
        (json!({"points": [[1, 2]], "id": "x"}), "invalid-request", "/id"),
        (json!({"points": [[1, 2]], "normals": null}), "invalid-request", "/normals"),
        (json!({"points": [[1, 2]], "normals": [[0, 0]]}), "invalid-cloud", "/normals/0"),
        (json!({"points": [[1, 2]], "normals": [[1, 0], [1, 0]]}), "length-mismatch", "/normals"),
        (json!({"points": [[1, 2]], "normals": [[1, 0, 0]]}), "dimension-mismatch", "/normals"),
    ] {
        let problem = server.post("/v1/clouds", &body).await.expect_problem(422, slug);
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{body}");
    }
    for text in ["", "{\"points\": [[1, 2]", "{\"points\": [[NaN]]}", "{\"points\": [[1e400]]}"] {
        server.post_text("/v1/clouds", text).await.expect_problem(400, "malformed-json");
    }
    assert_eq!(server.get("/v1/clouds").await.expect_ok()["clouds"], json!([]));
}

#[tokio::test]
async fn the_list_comes_in_pages_oldest_first() {
    let server = Server::start().await;
    let mut ids = Vec::new();
    for k in 0..5 {
        let posted = server.post("/v1/clouds", &json!({"points": [[k, 1], [2, 3]]})).await;
        ids.push(posted.json()["cloud_id"].as_str().unwrap().to_owned());
    }
    let ids_of = |page: &Value| -> Vec<String> {
        let clouds = page["clouds"].as_array().unwrap();
        clouds.iter().map(|cloud| cloud["cloud_id"].as_str().unwrap().to_owned()).collect()
    };
    for (limit, sizes) in [(2, &[2, 2, 1][..]), (5, &[5]), (1, &[1; 5]), (1000, &[5])] {
        let (mut listed, mut found_sizes) = (Vec::new(), Vec::new());
        let mut path = format!("/v1/clouds?limit={limit}");
        loop {
            let page = server.get(&path).await.expect_ok();
            found_sizes.push(ids_of(&page).len());
            listed.extend(ids_of(&page));
            match page.get("next") {
                Some(next) => path = format!("/v1/clouds?limit={limit}&cursor={}", next.as_str().unwrap()),
                None => break,
            }
        }
        assert_eq!(found_sizes, sizes);
        // Clouds of the same millisecond may come in any order.
        assert_eq!(listed.iter().collect::<std::collections::BTreeSet<_>>().len(), 5);
        assert!(ids.iter().all(|id| listed.contains(id)));
    }
    for (query, pointer) in [
        ("limit=0", "/limit"),
        ("limit=1001", "/limit"),
        ("limit=-1", "/limit"),
        ("limit=two", "/limit"),
        ("cursor=nonsense", "/cursor"),
        ("frobnicate=1", "/frobnicate"),
    ] {
        let problem = server.get(&format!("/v1/clouds?{query}")).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer);
    }
}

#[tokio::test]
async fn what_is_no_cursor_is_refused_as_the_pattern_of_the_document_says() {
    let server = Server::start().await;
    for document in [gramian::http::openapi_json(), gramian::http::openapi_3_0_json()] {
        let document: Value = serde_json::from_str(&document).unwrap();
        assert_eq!(document["components"]["schemas"]["Cursor"]["pattern"], "^[0-9a-f]{1,32}-[0-9a-f]{64}$");
        let parameters = document["paths"]["/v1/clouds"]["get"]["parameters"].as_array().unwrap();
        let cursor = parameters.iter().find(|parameter| parameter["name"] == "cursor").unwrap();
        assert_eq!(cursor["schema"]["$ref"], "#/components/schemas/Cursor");
    }
    let id = "0".repeat(64);
    for time in ["0", "18f3a", &"f".repeat(32), &"0".repeat(32)] {
        server.get(&format!("/v1/clouds?cursor={time}-{id}")).await.expect_ok();
    }
    let short = &id[1..];
    for cursor in [
        format!("-{id}"),
        format!("+1-{id}"),
        format!("1F-{id}"),
        format!("{}1-{id}", "0".repeat(32)),
        format!("1-{short}"),
        format!("1-{short}g"),
        format!("1{id}"),
        String::new(),
    ] {
        let answer = server.get(&format!("/v1/clouds?cursor={cursor}")).await;
        let problem = answer.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], "/cursor", "{cursor}");
    }
}

#[tokio::test]
async fn a_cursor_survives_the_deletion_of_the_cloud_it_stopped_at() {
    let server = Server::start().await;
    for k in 0..3 {
        server.post("/v1/clouds", &json!({"points": [[k, 1], [2, 3]]})).await;
    }
    let first = server.get("/v1/clouds?limit=1").await.expect_ok();
    let id = first["clouds"][0]["cloud_id"].as_str().unwrap();
    ask(&server, Method::DELETE, &format!("/v1/clouds/{id}"), "").await;
    let next = format!("/v1/clouds?limit=10&cursor={}", first["next"].as_str().unwrap());
    assert_eq!(server.get(&next).await.expect_ok()["clouds"].as_array().unwrap().len(), 2);
}

#[tokio::test]
async fn inline_points_are_registered_on_every_route() {
    for route in &ROUTES {
        let server = Server::start().await;
        let mut body = route.request();
        let inline = server.post(route.path, &body).await.expect_ok();
        let id = inline["diagnostics"]["cloud_id"].clone();
        let path = format!("/v1/clouds/{}", id.as_str().unwrap());
        assert_eq!(server.get(&path).await.expect_ok()["cloud_id"], id);
        assert_eq!(server.post("/v1/clouds", &body["cloud"]).await.status, 200, "{}", route.path);
        body["cloud"] = json!({"id": id});
        assert_eq!(server.post(route.path, &body).await.expect_ok(), inline);
    }
}

#[tokio::test]
async fn the_least_recently_used_cloud_makes_room() {
    // 1,000 points in 3 dimensions take some 26 KB, and their sampling 42 KB, so there is room for two
    // clouds.
    let server = Server::with_flags(&["--cloud-bytes", "170000"]).await;
    let post = async |shift: f64| {
        let points: Vec<_> = fibonacci_sphere(1000).iter().map(|x| [x[0] + shift, x[1], x[2]]).collect();
        let posted = server.post("/v1/clouds", &json!({"points": points})).await;
        assert_eq!(posted.status, 201);
        posted.json()["cloud_id"].as_str().unwrap().to_owned()
    };
    let use_by_id = async |id: &str| {
        let body = json!({
            "cloud": {"id": id}, "kernel": {"family": "laplace", "epsilon": 1.0, "length_scale": 1.0},
            "queries": [[0, 0, 2]]
        });
        server.post("/v1/normals", &body).await
    };
    let (first, second) = (post(0.0).await, post(1.0).await);
    use_by_id(&first).await.expect_ok();
    let third = post(2.0).await;
    let problem = use_by_id(&second).await.expect_problem(404, "unknown-cloud");
    assert_eq!(problem["errors"][0]["pointer"], "/cloud/id");
    assert!(problem["detail"].as_str().unwrap().contains("post"), "{problem}");
    use_by_id(&first).await.expect_ok();
    use_by_id(&third).await.expect_ok();
    server.get(&format!("/v1/clouds/{second}")).await.expect_problem(404, "unknown-cloud");
}

#[tokio::test]
async fn a_cloud_beyond_the_whole_budget_is_answered_all_the_same() {
    let server = Server::with_flags(&["--cloud-bytes", "2048"]).await;
    let body = json!({"cloud": {"points": fibonacci_sphere(300)}, "queries": [[0, 0, 2]]});
    let answer = server.post("/v1/normals", &body).await.expect_ok();
    let id = answer["diagnostics"]["cloud_id"].as_str().unwrap();
    server.get(&format!("/v1/clouds/{id}")).await.expect_problem(404, "unknown-cloud");
}
