//! Pages and probes of the process: problems, health, version, documents.

use gramian::http::problem::slug::Slug;
use serde_json::{Value, json};

use crate::routes::ROUTES;
use crate::support::{Answer, Server};

#[tokio::test]
async fn every_type_of_problem_has_a_page() {
    let server = Server::start().await;
    for slug in Slug::ALL {
        let page = server.get(&format!("/problems/{}", slug.as_str())).await;
        assert_eq!(page.status, 200);
        assert!(page.header("content-type").starts_with("text/html"));
        assert!(page.text.contains(slug.as_str()) && page.text.contains(slug.title()), "{}", page.text);
        assert!(page.text.contains(slug.status().as_str()));
    }
    // Slugs of the contract in this version. None may be removed or renamed.
    for slug in [
        "malformed-json invalid-request invalid-cloud duplicate-points dimension-mismatch length-mismatch",
        "kernel-not-smooth kernel-not-positive-definite not-positive-definite unsupported-by-solver unknown-cloud not-found",
        "method-not-allowed not-acceptable unsupported-media-type body-too-large problem-too-large unauthorized",
        "overloaded deadline-exceeded internal",
    ]
    .iter()
    .flat_map(|line| line.split(' '))
    {
        assert!(Slug::parse(slug).is_some(), "{slug}");
    }
}

#[tokio::test]
async fn the_root_leads_to_all_that_is_served_for_people() {
    let server = Server::start().await;
    let page = server.get("/").await;
    assert_eq!(page.status, 200, "{}", page.text);
    assert!(page.header("content-type").starts_with("text/html"));
    let sources = sources(&page);
    for linked in ["docs/", "openapi.json", "openapi-3.0.json", "problems"] {
        assert!(sources.iter().any(|source| source == linked), "{sources:?}");
    }
    for source in sources {
        assert_eq!(server.get(&format!("/{source}")).await.status, 200, "{source}");
    }
}

#[tokio::test]
async fn problems_are_listed_with_links_to_their_pages() {
    let server = Server::start().await;
    let sources = sources(&server.get("/problems").await);
    let expected: Vec<String> = Slug::ALL.iter().map(|slug| format!("problems/{}", slug.as_str())).collect();
    assert_eq!(sources, expected);
    for source in sources {
        assert_eq!(server.get(&format!("/{source}")).await.status, 200, "{source}");
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
    for route in &ROUTES {
        assert!(document.json()["paths"][route.path]["post"].is_object(), "{}", route.path);
    }
}

/// Returns the values of all `src` and `href` attributes of a page.
fn sources(page: &Answer) -> Vec<String> {
    let mut found = Vec::new();
    for attribute in ["src=", "href="] {
        for rest in page.text.split(attribute).skip(1) {
            let source = rest.trim_start_matches(['"', '\'']);
            let end = source.find(['"', '\'', '>', ' ']).unwrap();
            found.push(source[..end].to_owned());
        }
    }
    found
}

#[tokio::test]
async fn the_documentation_needs_no_other_host() {
    let server = Server::start().await;
    // With and without the slash, as people type it.
    for path in ["/docs", "/docs/"] {
        let page = server.get(path).await;
        assert_eq!(page.status, 200, "{path}");
        assert!(page.header("content-type").starts_with("text/html"));
        let sources = sources(&page);
        assert!(!sources.is_empty());
        for source in sources {
            assert!(!source.starts_with("//") && !source.contains("://"), "{source}");
            let source = source.trim_start_matches("./");
            let resolved =
                if source.starts_with('/') { source.to_owned() } else { format!("/docs/{source}") };
            let asset = server.get(&resolved).await;
            assert_eq!(asset.status, 200, "{resolved}");
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
