//! Examples of the document: each is sent, and its answer compared.

use std::path::{Path, PathBuf};

use gramian::http::openapi::examples::{EXAMPLES, PROBLEMS};
use gramian::http::problem::Problem;
use gramian::http::problem::{self, catalogue};
use gramian_host::problem::slug::Slug;
use serde_json::{Map, Value, json};

use crate::support::{Answer, Server, overwrites};
use crate::wire::limits::slow_request;

/// Members that depend on the moment or the machine. They must exist, with any value.
const VARYING: [&str; 6] =
    ["created_at", "relative_residual", "instruction_set", "threads", "version", "seconds"];

/// Asserts that two documents agree. Numbers may differ by 1e-9 relative, or 1e-12 for those below 1e-3.
fn assert_like(name: &str, found: &Value, expected: &Value) {
    match (found, expected) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-3), "{name}: {a} against {b}");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{name}");
            a.iter().zip(b).for_each(|(a, b)| assert_like(name, a, b));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{name}: {:?} against {:?}", a.keys(), b.keys());
            for (key, b) in b.iter().filter(|(key, _)| !VARYING.contains(&key.as_str())) {
                assert_like(&format!("{name}.{key}"), &a[key], b);
            }
        }
        _ => assert_eq!(found, expected, "{name}"),
    }
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/examples").join(name)
}

fn write(name: &str, value: &Value) {
    std::fs::write(file(name), serde_json::to_string_pretty(value).unwrap() + "\n").unwrap();
}

/// Returns method, path and definition of every operation, by operation id.
fn operations() -> Map<String, Value> {
    let document = crate::support::document();
    let mut operations = Map::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let id = operation["operationId"].as_str().unwrap();
            operations.insert(id.to_owned(), json!({"method": method, "path": path, "operation": operation}));
        }
    }
    operations
}

/// Sends the request of an operation, with the example as its body and the examples of its parameters in its
/// path.
async fn send(server: &Server, entry: &Value, body: Option<&Value>) -> Answer {
    let mut path = entry["path"].as_str().unwrap().to_owned();
    let parameters = entry["operation"].get("parameters").and_then(Value::as_array);
    for parameter in parameters.into_iter().flatten() {
        let Some(example) = parameter.get("example") else { continue };
        let (name, text) = (parameter["name"].as_str().unwrap(), example.to_string());
        match parameter["in"].as_str() {
            Some("path") => path = path.replace(&format!("{{{name}}}"), text.trim_matches('"')),
            _ => path.push_str(&format!("?{name}={text}")),
        }
    }
    match body {
        Some(body) => server.post(&path, body).await,
        None => server.get(&path).await,
    }
}

fn parsed(answer: &Answer) -> Value {
    if answer.header("content-type").starts_with("text/html") { json!(answer.text) } else { answer.json() }
}

#[tokio::test]
async fn every_example_is_what_the_service_answers() {
    let server = Server::start().await;
    let operations = operations();
    for (id, text) in EXAMPLES {
        let mut example: Value = serde_json::from_str(text).unwrap();
        let answer = send(&server, &operations[id], example.get("request")).await;
        assert!(answer.status < 300, "{id}: {}", answer.text);
        if !overwrites() {
            assert_like(id, &parsed(&answer), &example["response"]);
            continue;
        }
        example["response"] = parsed(&answer);
        for pointer in ["/response/created_at", "/response/clouds/0/created_at"] {
            if let Some(created_at) = example.pointer_mut(pointer) {
                *created_at = json!("2026-01-01T00:00:00.000Z");
            }
        }
        write(&format!("{id}.json"), &example);
    }
}

#[test]
fn every_operation_with_a_body_has_an_example() {
    for (id, entry) in operations() {
        // Metrics and jobs change at every moment, and the page says nothing as an example.
        let has_none = id == "get_metrics" || id == "get_start_page" || id.contains("job");
        let has_body = entry.pointer("/operation/responses/200/content").is_some() && !has_none;
        assert_eq!(EXAMPLES.iter().any(|(name, _)| *name == id), has_body, "{id}");
        for content in ["/operation/requestBody", "/operation/responses/200"] {
            let Some(content) = entry.pointer(&format!("{content}/content")).filter(|_| has_body) else {
                continue;
            };
            let text =
                ["application/json", "text/html"].iter().find_map(|media_type| content.get(media_type));
            assert!(text.unwrap()["example"] != Value::Null, "{id}");
        }
    }
}

/// Returns the problem that a request provokes. Three of them cannot be provoked by a single request.
async fn provoked(slug: Slug, sample: &Value) -> Value {
    match slug {
        catalogue::INTERNAL => return document(&Problem::internal()),
        catalogue::RATE_LIMITED => return document(&Problem::rate_limited("600 requests a minute", 1)),
        catalogue::OVERLOADED => return document(&Problem::overloaded(1)),
        catalogue::DEADLINE_EXCEEDED => {
            let server = Server::with_flags(&["--deadline-seconds", "0.05"]).await;
            let request = server.client.post(server.url("/v1/normals")).json(&slow_request());
            return server.send(request.header("x-request-id", REQUEST_ID)).await.json();
        }
        catalogue::REQUEST_TIMEOUT => {
            let server = Server::with_flags(&["--body-seconds", "0.1"]).await;
            let head = format!("X-Request-Id: {REQUEST_ID}\r\nContent-Length: 100000");
            return server.post_stalled("/v1/normals", &head, "{\"cloud\": ").await.json().unwrap();
        }
        _ => {}
    }
    let request = &sample["request"];
    let flags: Vec<&str> =
        request["flags"].as_array().into_iter().flatten().map(|flag| flag.as_str().unwrap()).collect();
    let server = Server::with_flags(&flags).await;
    let method = request["method"].as_str().unwrap().parse().unwrap();
    let mut sent = server.client.request(method, server.url(request["path"].as_str().unwrap()));
    sent = sent.header("x-request-id", REQUEST_ID);
    if let Some(body) =
        request.get("body").map(Value::to_string).or(request["text"].as_str().map(str::to_owned))
    {
        let media_type = request
            .pointer("/headers/Content-Type")
            .map_or("application/json", |text| text.as_str().unwrap());
        sent = sent.header("content-type", media_type).body(body);
    }
    for (name, value) in request["headers"].as_object().into_iter().flatten() {
        if name != "Content-Type" {
            sent = sent.header(name, value.as_str().unwrap());
        }
    }
    let answer = server.send(sent).await;
    answer.expect_problem(slug.status().as_u16(), slug.as_str())
}

const REQUEST_ID: &str = "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c";

fn document(problem: &Problem) -> Value {
    serde_json::to_value(problem.document(REQUEST_ID)).unwrap()
}

#[tokio::test]
async fn every_problem_has_an_example_that_the_service_answers() {
    let mut samples: Value = serde_json::from_str(PROBLEMS).unwrap();
    let slugs: Vec<&String> = samples.as_object().unwrap().keys().collect();
    assert_eq!(slugs, problem::all().into_iter().map(Slug::as_str).collect::<Vec<_>>());
    for slug in problem::all() {
        let sample = &mut samples[slug.as_str()];
        let found = provoked(slug, sample).await;
        if overwrites() {
            sample["response"] = found;
        } else {
            assert_like(slug.as_str(), &found, &sample["response"]);
        }
    }
    if overwrites() {
        write("problems.json", &samples);
    }
}
