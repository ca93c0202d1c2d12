//! Tests of the checker: answers of the service pass, and fail once one thing about them is changed.

use reqwest::header::HeaderValue;
use serde_json::{Value, json};

use super::document::Contract;
use super::validator::Validator;
use super::{AnswerParts, BESIDE, is_beside};
use crate::all_routes::route_of;
use crate::support::{Server, document, receive};

const PATH: &str = "/v1/curvatures";

/// A request with its correct answer, which the tests then alter.
struct Case {
    contract: Contract,
    method: &'static str,
    path: &'static str,
    answer: AnswerParts,
}

impl Case {
    async fn of(method: &'static str, path: &'static str, body: &Value) -> Self {
        let server = Server::start().await;
        let request = server.client.request(method.parse().unwrap(), server.url(path)).json(body);
        let case =
            Self { contract: Contract::new(&document()), method, path, answer: receive(request).await };
        assert_eq!(case.found(&case.answer), Vec::<String>::new());
        case
    }

    fn found(&self, answer: &AnswerParts) -> Vec<String> {
        self.contract.mismatches(self.method, self.path, answer)
    }

    fn finds(&self, expected: &str, change: impl FnOnce(&mut AnswerParts)) {
        let mut answer = self.answer.clone();
        change(&mut answer);
        let found = self.found(&answer).join("\n");
        assert!(found.contains(expected), "{expected} is not in: {found}");
    }

    fn finds_in_body(&self, expected: &str, change: impl FnOnce(&mut Value)) {
        self.finds(expected, |answer| {
            let mut body = answer.json().unwrap();
            change(&mut body);
            answer.bytes = body.to_string().into_bytes();
        });
    }
}

fn set(answer: &mut AnswerParts, name: &'static str, value: &'static str) {
    answer.headers.insert(name, HeaderValue::from_static(value));
}

#[tokio::test]
async fn a_body_of_another_form_is_found() {
    let case = Case::of("POST", PATH, &route_of(PATH).request()).await;
    case.finds_in_body("body/mean_curvatures/0", |body| body["mean_curvatures"][0] = json!("1"));
    // Null may only replace a whole entry.
    case.finds_in_body("body/normals/0", |body| body["normals"][0] = json!([null, null, null]));
    case.finds_in_body("body/surface_models/1", |body| body["surface_models"][1] = json!("plane"));
    case.finds_in_body("body/diagnostics/rank", |body| body["diagnostics"]["rank"] = json!(-1));
    case.finds_in_body("frobnicate", |body| body["frobnicate"] = json!(1));
    case.finds_in_body("frobnicate", |body| body["diagnostics"]["kernel"]["frobnicate"] = json!(1));
    case.finds_in_body("flags", |body| {
        body.as_object_mut().unwrap().remove("flags");
    });
    case.finds("the body is no JSON", |answer| answer.bytes.truncate(100));
    case.finds("no safetensors", |answer| set(answer, "content-type", "application/x-safetensors"));
    let cloud = Case::of("POST", "/v1/clouds", &json!({"points": [[1, 2], [3, 4]]})).await;
    cloud.finds_in_body("body/created_at", |body| body["created_at"] = json!("yesterday"));
}

#[tokio::test]
async fn another_status_or_media_type_is_found() {
    let case = Case::of("POST", PATH, &route_of(PATH).request()).await;
    case.finds("status 418", |answer| answer.status = 418);
    case.finds("status 202", |answer| answer.status = 202);
    case.finds("no problem document", |answer| answer.status = 422);
    case.finds("Content-Type \"text/plain\"", |answer| set(answer, "content-type", "text/plain"));
    case.finds("Content-Type \"application/x-npy\"", |answer| {
        set(answer, "content-type", "application/x-npy")
    });
    let live = Case::of("HEAD", "/health/live", &json!({})).await;
    live.finds("a body, and none is declared", |answer| answer.bytes = b"{}".to_vec());
    let gone = "/v1/clouds/0000000000000000000000000000000000000000000000000000000000000000";
    let gone = Case::of("HEAD", gone, &json!({})).await;
    gone.finds("a body, and none is declared", |answer| answer.bytes = b"{}".to_vec());
}

#[tokio::test]
async fn headers_that_are_missing_or_undeclared_are_found() {
    let mut case = Case::of("POST", PATH, &route_of(PATH).request()).await;
    case.finds("no x-request-id", |answer| {
        answer.headers.remove("x-request-id");
    });
    case.finds("x-secret is not declared", |answer| set(answer, "x-secret", "1"));
    let mut document = document();
    let response = document.pointer_mut("/paths/~1v1~1curvatures/post/responses/200").unwrap();
    response["headers"]["X-Depth"] = json!({"required": true, "schema": {"type": "integer", "minimum": 1}});
    response["headers"]["X-Name"] = json!({"schema": {"type": "string", "pattern": "^[a-z]+$"}});
    case.contract = Contract::new(&document);
    case.finds("no x-depth", |_| {});
    case.finds("x-depth: \"deep\"", |answer| set(answer, "x-depth", "deep"));
    case.finds("x-depth: 0", |answer| set(answer, "x-depth", "0"));
    set(&mut case.answer, "x-depth", "3");
    case.finds("x-name: 7", |answer| set(answer, "x-name", "7"));
    set(&mut case.answer, "x-name", "gram");
    assert_eq!(case.found(&case.answer), Vec::<String>::new());
}

#[tokio::test]
async fn problems_that_contradict_themselves_are_found() {
    let case = Case::of("POST", PATH, &json!({})).await;
    assert_eq!(case.answer.status, 422);
    case.finds("another status", |answer| answer.status = 404);
    case.finds_in_body("another status", |body| body["type"] = json!("/problems/unknown-cloud"));
    case.finds_in_body("another status", |body| body["type"] = json!("/problems/frobnicated"));
    case.finds_in_body("status and instance", |body| body["status"] = json!(400));
    case.finds_in_body("status and instance", |body| body["instance"] = json!("another"));
    case.finds_in_body("title", |body| {
        body.as_object_mut().unwrap().remove("title");
    });
    case.finds_in_body("frobnicate", |body| body["frobnicate"] = json!(1));
    case.finds_in_body("problem/errors/0", |body| body["errors"] = json!(["/cloud"]));
}

#[tokio::test]
async fn what_the_document_does_not_have_is_refused_as_such() {
    let path = Case::of("GET", "/v1/nowhere", &json!({})).await;
    path.finds("status 200 instead of 404", |answer| answer.status = 200);
    path.finds("no problem document", |answer| set(answer, "content-type", "application/json"));
    let method = Case::of("PUT", "/v1/clouds", &json!({})).await;
    method.finds("status 404 instead of 405", |answer| answer.status = 404);
    method.finds("Allow", |answer| set(answer, "allow", "GET, HEAD"));
    let mut preflight = Case::of("OPTIONS", PATH, &json!({})).await;
    preflight.finds("status 200 instead of 405", |answer| answer.status = 200);
    set(&mut preflight.answer, "access-control-allow-methods", "POST");
    preflight.finds("a body, and none is declared", |answer| answer.status = 200);
    for path in BESIDE {
        assert!(is_beside(path));
    }
    assert!(is_beside("/docs/vendor/swagger-ui.css"));
    for path in ["/docsy", "/v1", "/openapi.yaml", "//"] {
        assert!(!is_beside(path), "{path}");
    }
}

/// Validates the schemas themselves, since validators would ignore an invalid one.
#[test]
fn every_component_is_a_schema() {
    let components = &document()["components"];
    for name in components["schemas"].as_object().unwrap().keys() {
        let reference = format!("#/components/schemas/{name}");
        let compiled = Validator::new(json!({"$ref": reference, "components": components}));
        assert!(compiled.is_ok(), "{name}: {}", compiled.err().unwrap());
    }
    let nonsense = json!({"$ref": "#/components/A", "components": {"A": {"type": "nothing"}}});
    assert!(Validator::new(nonsense).is_err());
}
