//! The headers of answers, declared once as components. Every answer that has a header refers to its
//! component.

use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::path::Operation;
use utoipa::openapi::schema::{SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, Ref, RefOr};

use super::{id_of, is_computed, operations};

/// Name, example, description.
const HEADERS: [(&str, &str, &str); 8] = [
    (
        "X-Request-Id",
        "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c",
        "The id of the request, as in the logs and in `instance` of problems; the client's own id if it sent one in the allowed form.",
    ),
    (
        "Server-Timing",
        "parse;dur=0.052, gram;dur=1.310, factor;dur=4.207, solve;dur=0.118, evaluate;dur=0.640, encode;dur=0.021",
        "Milliseconds of each stage; `encode` is absent if the answer is written while it is sent.",
    ),
    (
        "Cache-Status",
        "gramian; hit",
        "`gramian; hit`: the factorization was cached. `gramian; fwd=miss; stored`: computed and kept. \
         `gramian; fwd=miss; collapsed`: another request was computing it. `gramian; fwd=miss`: computed, not kept. \
         With two factorizations, a hit only if both were cached.",
    ),
    (
        "Gramian-Cloud",
        "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c",
        "The cloud that the answer is about. Send it with requests that name a cloud: a proxy can then route them to the \
         server that holds its factorizations. An id sent in this header or in the path is repeated, in refusals too.",
    ),
    ("Location", "/v1/clouds/…", "The path of the cloud."),
    ("ETag", "W/\"…\"", "What was answered, weak: of a cloud its id in quotes. For If-None-Match."),
    ("Retry-After", "1", "Seconds after which to try again."),
    ("WWW-Authenticate", "Bearer", "How to authenticate: a bearer key."),
];

/// Declares the headers and refers to them from the answers of every operation.
pub fn add(document: &mut utoipa::openapi::OpenApi) {
    for operation in operations(document) {
        let on_success = names_on_success(operation);
        for (status, response) in &mut operation.responses.responses {
            let RefOr::T(response) = response else { continue };
            for name in names_for_status(status, &on_success) {
                let reference = Ref::new(format!("#/components/headers/{name}"));
                response.headers.insert(name.to_owned(), RefOr::Ref(reference));
            }
        }
    }
    let declared = HEADERS.map(|(name, example, text)| (name.to_owned(), header(example, text)));
    document.components.get_or_insert_default().headers = declared.into();
}

/// Returns the headers that an operation has when it succeeds.
fn names_on_success(operation: &Operation) -> Vec<&'static str> {
    match id_of(operation) {
        "create_cloud" => vec!["Location", "Gramian-Cloud"],
        "get_cloud" | "check_cloud" => vec!["ETag", "Gramian-Cloud"],
        "get_start_page" => vec!["ETag"],
        "choose_coarse_cloud" | "choose_sides" => vec!["Server-Timing"],
        "get_job_result" => vec!["Server-Timing", "Cache-Status", "Gramian-Cloud"],
        _ if is_computed(operation) => vec!["Server-Timing", "Cache-Status", "Gramian-Cloud"],
        _ => vec![],
    }
}

/// Returns the headers that answers with this status have: X-Request-Id always, `on_success` on 200, 201 and
/// 304.
fn names_for_status(status: &str, on_success: &[&'static str]) -> Vec<&'static str> {
    let by_status = match status {
        "200" | "201" | "304" => on_success,
        "401" => &["WWW-Authenticate"],
        "429" | "503" => &["Retry-After"],
        _ => &[],
    };
    [&["X-Request-Id"], by_status].concat()
}

/// Returns the component of a header. An example that is a number makes the header an integer.
fn header(example: &str, description: &str) -> RefOr<Header> {
    let (kind, example) = match example.parse::<u64>() {
        Ok(number) => (Type::Integer, number.into()),
        Err(_) => (Type::String, example.into()),
    };
    let schema = ObjectBuilder::new().schema_type(SchemaType::Type(kind));
    let header = HeaderBuilder::new().schema(Some(schema)).description(Some(description));
    RefOr::T(header.example(Some(example)).build())
}
