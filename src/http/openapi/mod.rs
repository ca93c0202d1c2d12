//! The `OpenAPI` document: generated from the code, committed as openapi/openapi.json, and tested against the
//! code.
//!
//! The routes declare their operations. Parts that many operations share are added here.

pub mod examples;
mod formats;
mod headers;
mod links;
mod optional;
pub mod responses;
pub mod version_3_0;

use serde_json::Value;
use utoipa::openapi::RefOr;
use utoipa::openapi::path::{Operation, PathItem};
use utoipa::openapi::schema::Schema;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::{Modify, OpenApi, PartialSchema};

use super::problem::FurtherMembers;
use gramian_host::problem::ProblemDocument;

/// The parts of the document that no operation declares.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "gramian",
        description = "Geometric kernel interpolation and regression on point clouds, after Guidotti. Post points once; the \
                       factorization of their Gram matrix K + αI is kept, and interpolation, normals, curvatures, surface \
                       operators and Gaussian-process posteriors are served from it. Arrays keep the order of the request, \
                       lengths are in the client's unit, a null marks an entry without a meaningful value, and every error \
                       is an RFC 9457 problem document. Request bodies may be compressed, by Content-Encoding gzip or zstd, and so \
                       are computed answers in JSON if Accept-Encoding asks for it. Every request that computes is answered \
                       202 at once, with a job and its Location, if it is sent with `Prefer: respond-async`; with an `Idempotency-Key` \
                       of 1 to 255 visible ASCII characters beside it, sending it again is the same job.",
        contact(name = "The gramian developers"),
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "clouds", description = "Register point clouds and refer to them by id."),
        (name = "values", description = "Functions through values: interpolation, regression, Gaussian processes."),
        (name = "geometry", description = "Normals and curvatures of the surface that a cloud samples."),
        (name = "operators", description = "Surface gradient and Laplace–Beltrami, applied and as matrices."),
        (name = "tiles", description = "Clouds too large for one request, in tiles: which side of the surface is outward, consistently over all tiles."),
        (name = "jobs", description = "Long computations: requests sent with `Prefer: respond-async`, their progress and results."),
        (name = "process", description = "Health, version and pages for people; no key needed."),
    ),
    components(schemas(ProblemDocument<'static>)),
    modifiers(&BearerKeys)
)]
pub struct Document;

struct BearerKeys;

impl Modify for BearerKeys {
    fn modify(&self, document: &mut utoipa::openapi::OpenApi) {
        let scheme = HttpBuilder::new()
            .scheme(HttpAuthScheme::Bearer)
            .description(Some("One of the configured API keys; needed only where keys are configured."));
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("bearer", SecurityScheme::Http(scheme.build()));
    }
}

/// Declares whether operations take a key. Where no keys are configured, they do without.
pub fn set_security(document: &mut utoipa::openapi::OpenApi, takes_key: bool) {
    let mut security = vec![SecurityRequirement::default()];
    if takes_key {
        security.push(SecurityRequirement::new::<_, [&str; 0], &str>("bearer", []));
    }
    operations(document).for_each(|operation| operation.security = Some(security.clone()));
}

/// Completes the document that the routes declare.
pub fn complete(document: &mut utoipa::openapi::OpenApi) {
    add_members_of_problems(document);
    formats::add(document);
    examples::add(document);
    headers::add(document);
    links::add(document);
    empty_answers_to_head(document);
    optional::refuse_null(document);
}

/// Adds the members that this service has in problem documents, after the fields that were refused.
fn add_members_of_problems(document: &mut utoipa::openapi::OpenApi) {
    let problem = document.components.as_mut().and_then(|components| components.schemas.get_mut("Problem"));
    let (Some(RefOr::T(Schema::Object(problem))), RefOr::T(Schema::Object(further))) =
        (problem, FurtherMembers::schema())
    else {
        return;
    };
    let mut further = Some(further.properties);
    for (name, schema) in std::mem::take(&mut problem.properties) {
        let is_last = name == "errors";
        problem.properties.insert(name, schema);
        problem.properties.extend(further.take_if(|_| is_last).into_iter().flatten());
    }
}

/// Removes the bodies of answers to HEAD, which has none, whatever the problem.
fn empty_answers_to_head(document: &mut utoipa::openapi::OpenApi) {
    for operation in document.paths.paths.values_mut().filter_map(|item| item.head.as_mut()) {
        for response in operation.responses.responses.values_mut() {
            if let RefOr::T(response) = response {
                response.content.clear();
            }
        }
    }
}

/// Returns the document as JSON. Marks declared headers as always sent, which the library's types cannot
/// express.
pub fn to_value(document: &utoipa::openapi::OpenApi) -> Value {
    // A document built by utoipa always serializes. The test of openapi.json would catch an empty one.
    let mut document = serde_json::to_value(document).unwrap_or_default();
    let headers = document.pointer_mut("/components/headers").and_then(Value::as_object_mut);
    for header in headers.into_iter().flat_map(|headers| headers.values_mut()) {
        header["required"] = Value::Bool(true);
    }
    document
}

/// Returns the text of a document, as it is served.
pub fn to_text(document: &Value) -> String {
    format!("{document:#}\n")
}

fn operations(document: &mut utoipa::openapi::OpenApi) -> impl Iterator<Item = &mut Operation> {
    document.paths.paths.values_mut().flat_map(|item| {
        let PathItem { get, post, delete, head, .. } = item;
        [get, post, delete, head].into_iter().flatten()
    })
}

/// Returns the operation id, under which examples, formats and links are registered.
fn id_of(operation: &Operation) -> &str {
    operation.operation_id.as_deref().unwrap_or_default()
}

/// Whether an operation with this id needs no factorization.
fn is_direct(id: &str) -> bool {
    matches!(id, "estimate" | "choose_coarse_cloud" | "choose_sides")
}

/// Whether an operation answers from a factorization: all with a body, except registration of clouds and
/// those that need none.
fn is_computed(operation: &Operation) -> bool {
    operation.request_body.is_some() && id_of(operation) != "create_cloud" && !is_direct(id_of(operation))
}
