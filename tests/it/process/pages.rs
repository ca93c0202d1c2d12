//! Pages for people (root, problems, docs), probes and the version.

use gramian::http::problem;
use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::support::{Answer, Server};

#[tokio::test]
async fn every_type_of_problem_has_a_page() {
    let server = Server::start().await;
    for slug in problem::all() {
        let page = server.get(&format!("/problems/{}", slug.as_str())).await;
        assert_eq!(page.status, 200);
        assert!(page.header("content-type").starts_with("text/html"));
        assert!(page.text.contains(slug.as_str()) && page.text.contains(slug.title()), "{}", page.text);
        assert!(page.text.contains(slug.status().as_str()));
    }
    // Slugs that clients may depend on. None may be removed or renamed; a new one is added here.
    let slugs = [
        "malformed-request malformed-json malformed-body invalid-request invalid-cloud duplicate-points",
        "dimension-mismatch length-mismatch kernel-not-smooth kernel-not-positive-definite not-positive-definite",
        "not-converged unsupported-by-solver unknown-cloud unknown-job not-found method-not-allowed not-acceptable",
        "unsupported-media-type request-timeout body-too-large problem-too-large unauthorized rate-limited",
        "overloaded deadline-exceeded internal",
    ];
    let slugs: Vec<&str> = slugs.iter().flat_map(|line| line.split(' ')).collect();
    for slug in &slugs {
        assert!(problem::named(slug).is_some(), "{slug}");
    }
    assert_eq!(slugs.len(), problem::all().len());
}

#[tokio::test]
async fn the_root_page_links_to_every_page() {
    let server = Server::start().await;
    let page = server.get("/").await;
    assert_eq!(page.status, 200, "{}", page.text);
    assert!(page.header("content-type").starts_with("text/html"));
    let links = links(&page);
    for path in ["docs/", "openapi.json", "openapi-3.0.json", "problems"] {
        assert!(links.iter().any(|link| link == path), "{links:?}");
    }
    // Files of the page itself are not in the document; they have tests of their own.
    for link in links.iter().filter(|link| !link.starts_with("page/")) {
        assert_eq!(server.get(&format!("/{link}")).await.status, 200, "{link}");
    }
}

#[tokio::test]
async fn problems_are_listed_with_links_to_their_pages() {
    let server = Server::start().await;
    let links = links(&server.get("/problems").await);
    let expected: Vec<String> =
        problem::all().iter().map(|slug| format!("problems/{}", slug.as_str())).collect();
    assert_eq!(links, expected);
    for link in links {
        assert_eq!(server.get(&format!("/{link}")).await.status, 200, "{link}");
    }
}

#[tokio::test]
async fn the_process_describes_itself() {
    let server = Server::with_flags(&["--threads", "2"]).await;
    assert_eq!(server.get("/health/live").await.expect_ok(), json!({"status": "ok"}));
    assert_eq!(server.get("/health/ready").await.expect_ok(), json!({"status": "ok"}));
    let version = server.get("/version").await.expect_ok();
    assert_eq!(version["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(version["threads"], 2);
    let kernels = server.get("/v1/kernels").await.expect_ok();
    let families: Vec<&Value> = kernels["kernels"].as_array().unwrap().iter().map(|k| &k["family"]).collect();
    assert_eq!(families, ["gauss", "laplace", "matern", "wendland", "inverse_multiquadric"]);
    let document = server.get("/openapi.json").await;
    assert_eq!(document.header("content-type"), "application/json");
    assert_eq!(document.text, gramian::http::openapi_json());
    let document_3_0 = server.get("/openapi-3.0.json").await;
    assert_eq!(document_3_0.header("content-type"), "application/json");
    assert_eq!(document_3_0.text, gramian::http::openapi_3_0_json());
    for route in &ROUTES {
        assert!(document.json()["paths"][route.path]["post"].is_object(), "{}", route.path);
    }
}

#[tokio::test]
async fn the_documentation_needs_no_other_host() {
    let server = Server::start().await;
    // With and without the slash, as people type it.
    for path in ["/docs", "/docs/"] {
        let page = server.get(path).await;
        assert_eq!(page.status, 200, "{path}");
        assert!(page.header("content-type").starts_with("text/html"));
        let links = links(&page);
        assert!(!links.is_empty());
        for link in links {
            assert!(!link.starts_with("//") && !link.contains("://"), "{link}");
            let link = link.trim_start_matches("./");
            let resolved = if link.starts_with('/') { link.to_owned() } else { format!("/docs/{link}") };
            let asset = server.get(&resolved).await;
            assert_eq!(asset.status, 200, "{resolved}");
            // Swagger UI's start script: it must load this server's document, not the demo's.
            if resolved.ends_with("initializer.js") {
                assert!(
                    asset.text.contains("/openapi.json") && !asset.text.contains("https://"),
                    "{}",
                    asset.text
                );
            }
        }
    }
}

/// Returns the targets of all `src` and `href` attributes, as written.
fn links(page: &Answer) -> Vec<String> {
    let mut found = Vec::new();
    for attribute in ["src=", "href="] {
        for rest in page.text.split(attribute).skip(1) {
            let link = rest.trim_start_matches(['"', '\'']);
            let end = link.find(['"', '\'', '>', ' ']).unwrap();
            found.push(link[..end].to_owned());
        }
    }
    found
}
